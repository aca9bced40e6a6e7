"""What notebooks show: pictures, tables whose text is escaped, and reasons in place of errors."""

from __future__ import annotations

import re
import subprocess
import sys
from base64 import b64decode
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import notebook as shown_mechanism
from kinfmu.display import page as html_page
from kinfmu.display import table
from kinfmu.draw import figure
from kinfmu.mechanism.measures import Maximum, Range
from kinfmu.run.verdict import sentence
from tests.log.runs import fourbar, with_gap
from tests.mechanisms import fourbar as fourbar_of
from tests.page.engines import browser, needs_browser

IMAGE = "data:image/svg+xml;base64,"
TURN = np.linspace(0.0, 2.0 * np.pi, 61)


class Page(HTMLParser):
    """The cells and images of a page; tags must close in order."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.rows: list[list[str]] = []
        self.images: list[str] = []
        self.text = ""
        self.feed(html)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        if tag == "img":
            self.images.append(b64decode(str(dict(attrs)["src"]).removeprefix(IMAGE)).decode())
            return
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data
        if self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data

    def row(self, name: str) -> list[str]:
        """The cells after the first of the row that begins with a name."""
        return next(cells for first, *cells in self.rows if first == name)


def page(value: Any) -> Page:
    return Page(value._repr_html_())


def test_a_mechanism_shows_its_drawing_and_its_parts(tmp_path: Path) -> None:
    mechanism = kinfmu.load("fourbar")
    figure(mechanism, tmp_path / "figure.svg")
    shown = page(mechanism)
    assert shown.images == [mechanism._repr_svg_()] == [(tmp_path / "figure.svg").read_text(encoding="utf-8")]
    assert shown.row("moving bodies") == ["3: crank, coupler, rocker"]
    assert shown.row("joints") == ["4 revolute: O, P, C, Q\n1 distance: AB"]
    assert shown.row("drivers") == ["crank: angle, constant_speed"]
    assert shown.row("mobility") == ["1"]
    assert shown.row("redundant") == ["AB"]
    assert repr(mechanism) == "<Mechanism fourbar; moving bodies: 3, joints: 5, drivers: 1>"


def test_a_mechanism_that_does_not_close_shows_the_reason() -> None:
    mechanism = fourbar_of(9.0, 1.0, 3.5, 3.0)
    shown = page(mechanism)
    assert shown.images == []
    assert "the mechanism does not close near its start pose" in shown.text
    assert mechanism._repr_svg_() is None
    assert shown.row("joints") == ["4 revolute: O, P, Q, C"]


def test_a_mechanism_without_a_driver_shows_its_drawing_and_the_problem() -> None:
    shown = page(replace(fourbar_of(4.0, 1.0, 3.5, 3.0), drivers=()))
    assert len(shown.images) == 1
    assert shown.row("drivers") == ["0"]
    assert "driver" in shown.row("problem")[0]


def test_text_of_a_file_is_no_html() -> None:
    title = "<script>alert(1)</script> & <b>"
    mechanism = replace(kinfmu.load("crank_rocker"), title=title)
    for value in (mechanism, kinfmu.check(mechanism), kinfmu.solve(mechanism, crank_angle=TURN)):
        shown = page(value)
        assert not {"script", "b"} & shown.tags
        assert title in shown.text


def test_an_unexpected_error_is_text_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> str:
        raise ZeroDivisionError("<no> drawing")

    monkeypatch.setattr(shown_mechanism, "drawing", fail)
    mechanism = kinfmu.load("crank_rocker")
    assert page(mechanism).text == f"{mechanism!r}\ncannot be shown: <no> drawing"


def test_without_matplotlib_the_tables_remain() -> None:
    script = (
        "import sys; sys.modules['matplotlib'] = None\nimport kinfmu\n"
        "mechanism = kinfmu.load('fourbar')\nrun = kinfmu.solve(mechanism)\n"
        "print(mechanism._repr_svg_(), mechanism._repr_html_(), run._repr_svg_(), run._repr_html_())"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert done.stdout.startswith("None <div>")
    reason = "<p>this picture: drawing needs matplotlib: pip install &#x27;kinfmu[figures]&#x27;</p>"
    assert done.stdout.count(reason) == 2
    assert {"moving bodies", "mobility", "coupler.x"} <= set(re.split("[<>]", done.stdout))


def test_a_run_shows_verdict_plot_events_and_ranges() -> None:
    run = with_gap(fourbar(np.arange(181.0)), 100, 120)
    shown = page(run)
    assert f"t = 0 to 180 s; {sentence(run)}" in shown.text
    assert "181 samples: 158 ok, 2 bridged, 21 outside" in shown.text
    (picture,) = shown.images
    assert {"A.x", "crank.φ", "t [s]", "deg"} <= set(re.split("[<>]", picture))
    assert ["100 s", "error"] in [cells[:2] for cells in shown.rows]
    good = run["coupler.x"][run.good]
    assert shown.row("coupler.x") == ["m", f"{good[0]:.6g}", f"{good.min():.6g}", f"{good.max():.6g}"]


@pytest.mark.parametrize(
    "change",
    [
        lambda run: run.part(slice(0, 0)),
        lambda run: run.part(slice(0, 1)),
        lambda run: with_gap(run, 0, 180),
        lambda run: run.without(list(run.outputs)),
        lambda run: run.without(["coupler.x"]),
    ],
    ids=["no sample", "one sample", "no numbers", "no positions", "a column not kept"],
)
@pytest.mark.few(3)
def test_a_run_shows_what_it_holds(change: Callable[[kinfmu.Run], kinfmu.Run]) -> None:
    run = change(fourbar(np.arange(181.0)))
    shown = page(run)
    assert "cannot be shown" not in shown.text
    assert f"{len(run)} sample" in shown.text
    names = [row[0] for row in shown.rows]
    assert [name in names for name in run.outputs] == [name not in run.absent for name in run.outputs]


def test_a_report_shows_every_line_of_its_text() -> None:
    report = kinfmu.check(kinfmu.load("fourbar"))
    shown = page(report)
    assert shown.text.startswith("fourbar: Four-bar crank with a redundant constraint")
    summary = report.summary()
    tables = [row for table in summary.tables for row in (table.columns, *table.rows)]
    assert [tuple(row) for row in shown.rows] == [verdict[:2] for verdict in summary.verdicts] + tables
    assert repr(report) == "<Report on fourbar: mobility 1>"
    problem = kinfmu.check(fourbar_of(9.0, 1.0, 3.5, 3.0))
    assert page(problem).row("problem") == [str(problem.problem)]
    assert repr(problem).startswith("<Report on fourbar_general: mobility 1; problem: the mechanism does not close")


def test_designs_show_ranges_and_the_reasons_of_gaps() -> None:
    model = kinfmu.compile(kinfmu.load("jansen_leg"), ["foot.x", "foot.y"])
    designs = model.solve_designs({"f": [39.4, 5.0, 39.0]}, crank_angle=TURN)
    shown = page(designs)
    assert "3 designs at 61 samples, 2 of them without gaps" in shown.text
    assert shown.row("f") == ["5", "39.4"]
    known = designs["foot.x"][designs.good]
    assert shown.row("foot.x") == ["length", f"{known.min():.6g}", f"{known.max():.6g}"]
    assert shown.row("1") == ["61", designs.reasons[1]]


def test_measures_of_designs_show_ranges_and_reasons() -> None:
    model = kinfmu.compile(kinfmu.load("jansen_leg"), ["foot.x", "foot.y"])
    found = kinfmu.measure_designs(model, {"f": [39.4, 5.0, 39.0]}, [Range("stroke", of="foot.x")], crank_angle=TURN)
    shown = page(found)
    assert "3 designs, 2 of them with all measures" in shown.text
    ends = np.nanmin(found["stroke"]), np.nanmax(found["stroke"])
    assert shown.row("stroke") == ["mm", *(f"{value:.6g}" for value in ends)]
    assert shown.row("1") == [found.reasons[1]]


def test_sensitivities_show_the_largest_derivatives() -> None:
    model = kinfmu.compile(kinfmu.load("jansen_leg"), ["foot.x", "foot.y"])
    found = model.sensitivities(crank_angle=TURN, wrt=["a", "c"])
    largest = np.abs(found.values_by).max(axis=0)
    assert page(found).row("foot.y") == [f"{value:.6g}" for value in largest[1]]
    assert repr(found) == "<Sensitivities at 61 samples: foot.x, foot.y by a, c>"


def test_measures_show_their_values_or_reasons() -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=TURN)
    values = kinfmu.measure(run, [Range("swing", of="rocker.phi"), Maximum("top", of="tracer.y")])
    assert isinstance(values, dict)
    shown = page(values)
    assert shown.row("top")[0] == "maximum"
    assert shown.row("top")[1] == f"{values['top'].value:.6g} mm"
    none = page(kinfmu.measure(with_gap(run, 5, 9), [Maximum("top", of="tracer.y")]))
    assert none.row("top")[1].startswith("5 of 61 samples have no numbers, the first at")


def test_every_class_that_shows_itself_has_html() -> None:
    from kinfmu.display import Displayed, Live, html_of

    found = {*Displayed.__subclasses__(), *Live.__subclasses__()} - {Live}
    classes = {cls for cls in found if cls.__module__.startswith("kinfmu.")}
    assert {cls.__name__ for cls in classes} >= {
        "Mechanism", "Run", "Report", "Designs", "Sensitivities", "MeasuredValues",
    }  # fmt: skip
    for cls in classes:
        assert html_of.dispatch(cls) is not html_of.dispatch(object), cls


@needs_browser
@pytest.mark.long
def test_tables_that_follow_each_other_do_not_touch(tmp_path: Path) -> None:
    shown = html_page("fit", table([("a", 1.0)], ("unknown", "value")), table([("b", 2.0)], ("target", "error")))
    with browser(tmp_path) as chromium, chromium.tab() as opened:
        opened.tab.set_content(f"<style>table {{ margin: 0 }}</style>{shown}")  # as Jupyter has it
        first, second = (opened.tab.locator("table").nth(k).bounding_box() for k in range(2))
    assert second["y"] - first["y"] - first["height"] >= 8.0
