"""Engines of pages: in Node, in one Chromium, and the native engine that they are compared with."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.codegen.lanes import lanes
from kinfmu.page import page
from kinfmu.page.module import PageModule, solver

SCRIPT = Path(__file__).with_name("run_engines.mjs")
NODE = shutil.which("node") or ""
needs_node = pytest.mark.skipif(not NODE, reason="not installed: node")
POSES = 361

Call = Sequence[Any]  # a method of the engine and its arguments
Driven = tuple[FloatArray, FloatArray, FloatArray]  # (n, d) values, speeds and accelerations of the drivers


def answers(folder: Path, jobs: Sequence[tuple[PageModule, Sequence[Call]]]) -> list[list[Any]]:
    """Return what the calls of each job return; all modules run in one process of Node."""
    listed = []
    for number, (module, calls) in enumerate(jobs):
        path = folder / f"module_{number}.txt"
        path.write_text(module.text)
        listed.append({"module": str(path), "calls": calls})
    done = subprocess.run(
        [NODE, SCRIPT],
        input=json.dumps({"solver": solver(), "jobs": listed}),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: list[list[Any]] = json.loads(done.stdout)
    return found


def sweep_call(module: PageModule, driven: Driven) -> Call:
    """Return the call of a sweep of all outputs with rates and accelerations."""
    columns = list(range(3 * len(module.plan.outputs)))
    u, ud, udd = (table.ravel().tolist() for table in driven)
    return ["sweep", u, columns, ud, udd]


def drag_call(driven: Driven) -> Call:
    """Return the call of many steps."""
    return ["drag", np.stack(driven, axis=1).tolist()]


def table(numbers: Sequence[Any], columns: int) -> FloatArray:
    """Return numbers from JSON as a table of so many columns."""
    return np.array([float(number) for number in numbers]).reshape(-1, columns)


def driven_of(run: kinfmu.Run) -> Driven:
    """Return driver values, speeds and accelerations of a run."""
    u, ud, udd = (np.ascontiguousarray(run.inputs[:, order::3]) for order in range(3))
    return u, ud, udd


def rows_of(run: kinfmu.Run) -> FloatArray:
    """Return positions, rates and accelerations of a run side by side."""
    return np.hstack([run.values, run.rates, run.accelerations])


class StepByStep:
    """The native engine of a mechanism without lanes: each sample follows from the one before, as in a page."""

    def __init__(self, mechanism: kinfmu.Mechanism) -> None:
        with pytest.MonkeyPatch.context() as without_lanes:
            without_lanes.setattr(lanes, "has_lanes", lambda _: False)
            self._model = kinfmu.compile(replace(mechanism, coordinates="moving"), engine="native")

    def solve(
        self, t: FloatArray | None = None, parameters: Mapping[str, float] | None = None, **inputs: FloatArray
    ) -> kinfmu.Run:
        """Solve as `Model.solve` does; parameters that continuation does not reach are an error."""
        return self._model.solve(t, parameters=parameters, anew=False, **inputs)


def driven_through(mechanism: kinfmu.Mechanism, native: StepByStep) -> kinfmu.Run:
    """Return a run of the native engine: through a turn of the crank from where it starts, or else over time."""
    run, (driver, *others) = mechanism.run, mechanism.drivers
    if others or driver.quantity.kind != "angle":
        return native.solve(np.linspace(run.start, run.stop, POSES))
    start = native.solve(np.array([run.start])).inputs[0, 0]
    value, speed, acceleration = driver.inputs()
    given = {value: start + np.linspace(0.0, 2.0 * np.pi, POSES), speed: np.full(POSES, 3.0)}
    return native.solve(**given, **{acceleration: np.full(POSES, -0.7)})


# -------------------------------------------------------------------------------------------------------------- browser


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed; scripts/browser installs it")
DESKTOP, PHONE = {"width": 1280, "height": 800}, {"width": 360, "height": 740}


@dataclass
class Opened:
    """A page in the browser; errors: of its console and scripts; requests: addresses beyond its own file."""

    tab: Any
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def get(self, expression: str) -> Any:
        """Return the value of an expression in which `k` is the page's object."""
        return self.tab.evaluate(f"() => {{ const k = window.kinfmu; return {expression}; }}")

    def settle(self) -> None:
        """Wait until the page has drawn what was asked for."""
        self.tab.wait_for_function("!window.kinfmu.isAsked")

    def resize(self, size: dict[str, int]) -> None:
        """Give the window a size, and wait until the drawing has its own."""
        self.tab.set_viewport_size(size)
        self.tab.wait_for_function(
            """([width, height]) => {
                const { view } = window.kinfmu;
                const stage = document.querySelector("#stage").getBoundingClientRect();
                return innerWidth === width && innerHeight === height
                    && view.width === stage.width && view.height === stage.height;
            }""",
            arg=[size["width"], size["height"]],
        )
        self.settle()

    def move(self, value: float) -> None:
        """Move the only driver."""
        self.get(f"k.refresh(() => k.move(0, {value!r}))")
        self.settle()

    def at(self, point: str) -> tuple[float, float]:
        """Return the place on the screen of a point 'body.point'."""
        x, y = self.tab.evaluate(
            """name => {
                const { linkage, view, canvas } = window.kinfmu;
                const number = linkage.data.points.findIndex((one) => `${one.body}.${one.name}` === name);
                const box = canvas.getBoundingClientRect();
                const [x, y] = view.pixel(linkage.point(number));
                return [x + box.left, y + box.top];
            }""",
            point,
        )
        return x, y

    def drag(self, point: str, way: list[tuple[float, float]]) -> None:
        """Drag a point through places on the screen."""
        mouse = self.tab.mouse
        mouse.move(*self.at(point))
        mouse.down()
        for place in way:
            mouse.move(*place)
            self.settle()
        mouse.up()
        self.settle()

    def touch(self, *ways: list[tuple[float, float]]) -> None:
        """Draw fingers over the screen, each along its places, by events as a touch screen sends them."""
        session = self.tab.context.new_cdp_session(self.tab)

        def send(kind: str, places: list[tuple[float, float]]) -> None:
            points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(places)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
            self.tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
            self.settle()

        kind = "touchStart"
        for places in zip(*ways, strict=True):
            send(kind, list(places))
            kind = "touchMove"
        send("touchEnd", [])
        self.tab.wait_for_function("!window.kinfmu.canvas.classList.contains('dragging')")
        self.settle()
        session.detach()


@cache
def text_of(name: str) -> str:
    """Return the page of a mechanism of the gallery."""
    return page(kinfmu.load(name))


class Browser:
    """The browser; pages open in contexts of their own."""

    def __init__(self, chromium: Any, folder: Path) -> None:
        self._chromium, self._folder = chromium, folder

    @contextmanager
    def open(self, text: str, fragment: str = "", **options: Any) -> Iterator[Opened]:
        """Yield the page of an HTML text, opened from a file with an address that ends with `fragment`."""
        path = self._folder / f"{abs(hash(text))}.html"
        if not path.exists():
            path.write_text(text, "utf-8")
        with self.open_at(path.as_uri(), fragment, **options) as opened:
            yield opened

    @contextmanager
    def open_at(self, url: str, fragment: str = "", **options: Any) -> Iterator[Opened]:
        """Yield the page at an address."""
        with self.tab(**options) as opened:
            opened.tab.goto(f"{url}{fragment}")
            opened.tab.wait_for_function("window.kinfmu")
            opened.settle()
            opened.requests = [one for one in opened.requests if not one.startswith((url, "data:", "blob:"))]
            yield opened

    @contextmanager
    def tab(self, **options: Any) -> Iterator[Opened]:
        """Yield an empty page."""
        usual = {"viewport": DESKTOP, "accept_downloads": True, "reduced_motion": "reduce"}
        context = self._chromium.new_context(**(usual | options))
        try:
            opened = Opened(context.new_page())
            opened.tab.on("console", lambda message: opened.errors.append(message.text))
            opened.tab.on("pageerror", lambda error: opened.errors.append(str(error)))
            opened.tab.on("request", lambda request: opened.requests.append(request.url))
            yield opened
        finally:
            context.close()


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """Yield a browser that runs without a display."""
    from playwright.sync_api import sync_playwright

    options = ["--no-sandbox"] if os.name == "posix" and os.geteuid() == 0 else []
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=options)
        yield Browser(chromium, folder)
        chromium.close()
