"""Charts of what the bench measures: names beside curves, what is off the scale, the same bytes every time."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

import pytest

from kinfmu.bench.near_singular import ChartRow, Passage, near_singular
from kinfmu.bench.work_precision import Curve, Panel, work_precision
from kinfmu.draw.chart import Look
from kinfmu.errors import FigureError, MissingPackageError

LOOKS = {"quick": Look((213, 94, 0), 2.2, "D"), "slow": Look((60, 120, 200)), "odd": Look((0, 178, 130))}
PANEL = Panel(
    "a linkage",
    [
        Curve("slow", 0, [(1e-2, 900.0), (1e-9, 1500.0), (0.0, 2000.0)]),
        Curve("slow", 1, [(1e-4, 800.0), (1e-14, 1200.0)]),
        Curve("odd", 0, [(1e-3, 700.0), (1e-12, 750.0)]),
        Curve("quick", 2, [(1e-15, 4.0)]),
    ],
)
ROW = ChartRow(
    "a point",
    [1e-1, 1e-2, 1e-3],
    [
        Passage("quick", [[1e-15] * 3] * 3, [0.0] * 3, [[1e-15] * 3] * 3),
        Passage("slow", [[1e-9, 1e-5, 1e-1]] * 3, [math.nan] * 3, [[math.nan, 1.0, 1e300]] * 3),
    ],
)


def heights(svg: str, words: list[str]) -> list[float]:
    """How far down the sheet each text stands [pt]."""
    found = {word: float(y) for y, word in re.findall(r"translate\([\d.]+ ([\d.]+)\)[^>]*>([^<]+)</text>", svg)}
    found |= {word: float(y) for y, word in re.findall(r' y="([\d.]+)"[^>]*>([^<]+)</text>', svg)}
    return [found[word] for word in words]


def test_every_engine_is_named_once_a_panel_above_or_below_its_curves(tmp_path: Path) -> None:
    path = tmp_path / "chart.svg"
    work_precision((path,), [PANEL, PANEL], LOOKS, ["how to read it"])
    svg = path.read_text(encoding="utf-8")
    for name in LOOKS:
        assert len(re.findall(f">{name}<", svg)) == 2
    assert len(re.findall(">a linkage<", svg)) == 2
    assert ">how to read it<" in svg
    slow, odd, quick = heights(svg, ["slow", "odd", "quick"])
    assert slow < odd < quick  # [pt] down the sheet: slow above its curves, odd below them


def test_numbers_off_the_scale_and_samples_without_numbers_are_drawn_as_far_as_they_go(tmp_path: Path) -> None:
    path = tmp_path / "chart.svg"
    near_singular((path,), [ROW], LOOKS)
    svg = path.read_text(encoding="utf-8")
    assert ">a point: q<" in svg
    assert len(re.findall(">(?:quick|slow)<", svg)) == 2
    assert "nan" not in svg.lower()


def test_equal_numbers_give_equal_bytes_in_both_formats(tmp_path: Path) -> None:
    for draw in (
        lambda paths: work_precision(paths, [PANEL], LOOKS, []),
        lambda paths: near_singular(paths, [ROW], LOOKS),
    ):
        once, again = ((tmp_path / f"{k}.svg", tmp_path / f"{k}.png") for k in "ab")
        draw(once)
        draw(again)
        assert [path.read_bytes() for path in once] == [path.read_bytes() for path in again]


def test_what_cannot_be_written_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FigureError, match=r"chart\.pdf: '\.pdf' is not a known format of figures; known: \.svg, \.png"):
        near_singular((tmp_path / "chart.svg", tmp_path / "chart.pdf"), [ROW], LOOKS)
    with pytest.raises(FigureError, match=r"cannot be written \(No such file or directory\)"):
        near_singular((tmp_path / "nowhere" / "chart.svg",), [ROW], LOOKS)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingPackageError, match="drawing needs matplotlib"):
        near_singular((tmp_path / "chart.svg",), [ROW], LOOKS)
    assert not list(tmp_path.iterdir())
