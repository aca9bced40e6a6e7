"""One Chromium for the tests of pages: a page of a mechanism, opened from a file, with what it logs and requests."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from kinfmu.page import page

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
        context = self._chromium.new_context(viewport=DESKTOP, accept_downloads=True, **options)
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
