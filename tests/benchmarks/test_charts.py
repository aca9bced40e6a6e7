"""Charts of what the bench measures: names of curves, what is off the scale, the same bytes every time."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy import Measured
from benchmarks.charts import draw, near_singular, work_precision
from benchmarks.engine import EngineSetting
from benchmarks.rounds import spread
from benchmarks.singular import DISTANCES, Near
from benchmarks.sizes import Cost, chart, run
from kinfmu.draw.writing import write
from kinfmu.errors import FigureError, MissingPackageError

SLOW, ODD, QUICK = "readable reference", "scipy fsolve", "kinfmu"


def curve(engine: str, order: int, points: list[tuple[float, float]], case: str = "slider_crank") -> list[Measured]:
    """What is measured of an engine with one predictor: errors and microseconds, the last setting its usual one."""
    return [
        Measured(
            case, engine, EngineSetting(order, 10.0**-k), (error, time) == points[-1], spread([time]), (error, 0.0, 0.0)
        )
        for k, (error, time) in enumerate(points)
    ]


MEASURED = [
    *curve(SLOW, 0, [(1e-2, 900.0), (1e-9, 1500.0), (0.0, 2000.0)]),
    *curve(SLOW, 1, [(1e-4, 800.0), (1e-14, 1200.0)]),
    *curve(ODD, 0, [(1e-3, 700.0), (math.nan, 720.0), (1e-12, 750.0)]),
    *curve(QUICK, 2, [(1e-15, 4.0)]),
]
SMOOTH = np.full((len(DISTANCES), 3), 1e-15)
NEAR = [
    Near("a point", QUICK, SMOOTH, np.zeros(3), SMOOTH, spread([4.0])),
    Near("a point", SLOW, 1e10 * SMOOTH, np.full(3, math.nan), math.inf * SMOOTH, spread([900.0])),
]


def svg_of(path: Path, figure: object) -> str:
    write(path, lambda: figure)  # type: ignore[arg-type,return-value]
    return path.read_text(encoding="utf-8")


def heights(svg: str, words: list[str]) -> list[float]:
    """How far down the sheet each text is [pt]."""
    found = {word: float(y) for y, word in re.findall(r"translate\([\d.]+ ([\d.]+)\)[^>]*>([^<]+)</text>", svg)}
    found |= {word: float(y) for y, word in re.findall(r' y="([\d.]+)"[^>]*>([^<]+)</text>', svg)}
    return [found[word] for word in words]


def test_every_engine_is_named_once_the_slowest_first(tmp_path: Path) -> None:
    again = [one._replace(case="crank_rocker") for one in MEASURED]
    svg = svg_of(tmp_path / "chart.svg", work_precision([*MEASURED, *again]))
    for name in (SLOW, ODD, QUICK):
        assert len(re.findall(f">{name}<", svg)) == 1
    assert ">slider crank: 1 unknown<" in svg
    assert ">crank rocker: 2 unknowns<" in svg
    assert ">To the left is exact, below is fast.<" in svg
    slow, odd, quick = heights(svg, [SLOW, ODD, QUICK])
    assert slow < odd < quick  # [pt] down the sheet


def test_every_setting_of_an_engine_with_an_error_is_a_point() -> None:
    panel, _ = work_precision(MEASURED).axes
    errors = [list(line.get_xdata()) for line in panel.get_lines()]
    assert sorted(map(len, errors)) == [1, 2, 2, 3]
    assert min(map(min, errors)) == 1e-17  # an error of 0 is drawn at the left end


def test_numbers_off_the_scale_and_samples_without_numbers_are_drawn_as_far_as_they_go(tmp_path: Path) -> None:
    svg = svg_of(tmp_path / "chart.svg", near_singular(NEAR))
    assert ">a point: q<" in svg
    assert len(re.findall(f">(?:{QUICK}|{SLOW})<", svg)) == 2
    assert "nan" not in svg.lower()


def test_equal_numbers_give_equal_bytes_in_both_formats(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
    once, again = (draw(tmp_path / name, MEASURED, NEAR) for name in "ab")
    assert len(once) == 4
    assert [path.read_bytes() for path in once] == [path.read_bytes() for path in again]


def test_what_cannot_be_written_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        FigureError, match=r"chart\.eps: '\.eps' is not a known format of figures; known: \.svg, \.png, \.pdf"
    ):
        write((tmp_path / "chart.svg", tmp_path / "chart.eps"), lambda: near_singular(NEAR))
    (tmp_path / "a_file").touch()
    with pytest.raises(FigureError, match=r"cannot be written"):
        draw(tmp_path / "a_file", MEASURED, NEAR)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingPackageError, match="drawing needs matplotlib"):
        draw(tmp_path, MEASURED, NEAR)
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]


def test_cost_against_size_has_a_panel_each_with_the_floor() -> None:
    costs = [
        Cost(f"{what}: {what}", (1, 10), {"ours": [2e-3, 3e-2], "floor": [1e-3, 1e-2]}) for what in ("rows", "loops")
    ]
    panels = chart(costs).axes
    assert [panel.get_xlabel() for panel in panels] == ["rows", "loops"]
    assert [line.get_label() for line in panels[0].get_lines()] == ["ours", "floor"]
    assert panels[0].get_ylim() == pytest.approx((1e-3, 1.0))


@pytest.mark.long
def test_cost_against_size_is_measured_up_to_a_largest_size(tmp_path: Path) -> None:
    text = run(1, tmp_path, most=10)
    assert re.findall(r"^(a sample|measures) of .*: (\w+)", text, re.M) == [
        ("a sample", "loops"),
        ("measures", "designs"),
    ]
    assert len(re.findall(r"^10? ", text, re.M)) == 4
    assert all(float(ratio) > 0.0 for ratio in re.findall(r"([\d.]+)$", text, re.M))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cost-against-size.png", "cost-against-size.svg"]
