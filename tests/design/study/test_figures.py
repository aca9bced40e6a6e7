"""Pictures of studies: each kind shows its names, and equal results give equal bytes."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.design.study.figure import figure_of, picture_of
from kinfmu.errors import FigureError, StudyError
from kinfmu.mechanism import toml_file
from tests.design.study.linkage import TEXT, linkage, swing

KINDS: dict[str, dict[str, Any]] = {
    "response": {"crank": {"from": 10, "to": 25, "count": 5}},
    "contours": {"crank": {"from": 10, "to": 30, "count": 4}, "base": {"values": [60, 30, 40]}},
    "scatter": {"crank": {"from": 10, "to": 25}, "base": {"tolerance": 1}},
    "contributions": {"crank": {"tolerance": 0.1}, "base": {"tolerance": 0.1}},
}
SHOWN = {
    "response": ["crank [mm]", "swing [deg]", "fastest [rad/s]"],
    "contours": ["crank [mm]", "base [mm]", "swing [deg]", "fastest [rad/s]"],
    "scatter": ["crank [mm]", "base [mm]", "swing [deg]", "fastest [rad/s]", "hoeken: 16 designs"],
    "contributions": ["crank", "base", "part of the variance [%]", "hoeken: tolerances"],
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.few(2)
def test_each_kind_names_what_it_shows_and_is_the_same_every_time(kind: str, tmp_path: Path) -> None:
    found = kinfmu.study(linkage(), KINDS[kind], designs=16, workers=1)
    assert picture_of(found) == kind
    path = tmp_path / "figure.svg"
    found.figure(path)
    first = path.read_text()
    texts = re.findall(r"<text [^>]*>([^<]*)</text>", first)
    assert set(SHOWN[kind]) <= set(texts)
    found.figure(path)
    assert path.read_text() == first
    found.figure(tmp_path / "figure.png", ("swing",))
    assert (tmp_path / "figure.png").read_bytes()[:4] == b"\x89PNG"


IN_AXES: dict[str, tuple[dict[str, Any], tuple[str, str]]] = {
    "response": (KINDS["response"], ("crank [mm]", "swing [deg]")),
    "contours": (KINDS["contours"], ("crank [mm]", "base [mm]")),
    "scatter": ({"crank": {"from": 10, "to": 25}}, ("crank [mm]", "swing [deg]")),
    "contributions": (KINDS["contributions"], ("part of the variance [%]", "")),
}


@pytest.mark.parametrize("kind", IN_AXES)
@pytest.mark.few(2)
def test_one_measure_is_drawn_into_axes(kind: str, tmp_path: Path) -> None:
    from matplotlib.figure import Figure

    tables, labels = IN_AXES[kind]
    found = kinfmu.study(linkage(), tables, designs=16, workers=1)
    left, right = Figure().subplots(1, 2)
    found.figure(ax=left, measures="swing")
    assert picture_of(found) == kind
    assert left.has_data()
    assert not right.has_data()
    assert (left.get_xlabel(), left.get_ylabel()) == labels
    if kind == "response":
        (line,) = left.lines
        np.testing.assert_array_equal(line.get_xydata(), np.column_stack([found["crank"], np.degrees(found["swing"])]))
    if kind == "scatter":
        (dots,) = left.collections
        assert len(dots.get_offsets()) == 16
    with pytest.raises(
        FigureError, match=r"^Axes show one measure, and these are 2: swing, fastest; choose one, such "
    ):
        found.figure(ax=right)
    with pytest.raises(StudyError, match=r"^the study has no measure 'swin'; did you mean 'swing'"):
        found.figure(ax=right, measures="swin")
    for path, ax in ((None, None), (tmp_path / "a.svg", right)):
        with pytest.raises(FigureError, match=r"^figure needs a path, or Axes of matplotlib as ax=; give one of both$"):
            found.figure(path, ("swing",), ax=ax)
    assert not right.has_data()


def test_a_scatter_matrix_does_not_fit_into_axes() -> None:
    from matplotlib.figure import Figure

    found = kinfmu.study(linkage(), KINDS["scatter"], designs=16, workers=1)
    with pytest.raises(
        FigureError, match=r"^designs that vary crank, base are drawn as a matrix of several Axes: give "
    ):
        found.figure(ax=Figure().subplots(), measures=("swing",))


def test_columns_are_shown_in_the_units_of_the_files_and_the_table_keeps_its_own(tmp_path: Path) -> None:
    tilted = TEXT.replace("{ crank", '{ tilt = "5 deg", lean = "0.1 rad", crank').replace(
        'Q = ["rocker", 0] }, start = { x = 20',
        'Q = ["rocker", 0], pen = ["rocker*cos(tilt + lean)", "rocker*sin(tilt + lean)"] }, start = { x = 20',
    )
    width = 'measures.width = { type = "range", of = "pen.x" }'
    mechanism = toml_file.parse(tilted + 'points.pen = "coupler.pen"\n' + width)
    tables = {"tilt": {"from": 0, "to": 0.5, "count": 3}, "base": {"values": ["1.5 in", 40, 50]}}
    path = tmp_path / "study.parquet"
    kinfmu.study(mechanism, tables, output=path, workers=1)
    found = kinfmu.StudyResult.read(path)
    assert (found.units["tilt"], found.units["base"], found.units["swing"]) == ("rad", "mm", "rad")
    assert found["tilt"].max() == 0.5
    shown = {name: found.display_unit(name) for name in ("tilt", "base", "width", "swing", "fastest")}
    assert [unit for unit, _ in shown.values()] == ["deg", "in", "mm", "deg", "rad/s"]
    assert shown["base"].factor == pytest.approx(25.4)
    figure = figure_of(found)
    panel = figure.axes[0]
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("tilt [deg]", "base [in]")
    assert panel.get_xlim() == pytest.approx((0.0, math.degrees(0.5)))
    assert panel.get_ylim() == pytest.approx((1.5, 50.0 / 25.4))
    (row,) = [line.split() for line in str(found).splitlines() if line.split()[:1] == ["swing"]]
    assert row[1] == "deg"
    assert float(row[2]) == pytest.approx(math.degrees(swing(20.0, 50.0, 40.0)), rel=1e-5)
    lean = kinfmu.study(mechanism, {"lean": {"from": 0, "to": 0.5, "count": 3}}, workers=1)
    assert lean.display_unit("lean").unit == "rad"  # as the file writes it
    tolerances = {"tilt": {"tolerance": 0.01}, "crank": {"tolerance": "0.002 in"}}
    scattered = kinfmu.study(mechanism, tables | tolerances, measures="swing", designs=4, workers=1)
    assert [scattered.display_unit(name).unit for name in ("tilt", "crank")] == ["deg", "in"]


@pytest.mark.long
def test_a_scatter_matrix_has_one_axis_for_each_row_and_column_and_marks_designs_that_fail() -> None:
    given = {"crank": {"from": 10, "to": 60}, "base": {"from": 20, "to": 60}}
    found = kinfmu.study(linkage(), given, measures="swing", designs=64, workers=1)
    failed = int(np.isnan(found["swing"]).sum())
    assert 0 < failed < 64
    figure = figure_of(found)
    panels = np.array(figure.axes[:9]).reshape(3, 3)  # histograms have axes of their own, behind these
    for k in range(3):
        assert len({panels[row, k].get_xlim() for row in range(3)}) == 1
        assert len({panels[k, column].get_ylim() for column in range(3)}) == 1
        assert panels[k, 0].yaxis.get_tick_params()["labelleft"]  # in the top row too
    low, high = panels[0, 0].get_xlim()
    assert low < min(found["crank"]) < max(found["crank"]) < high
    crosses, dots = (len(one.get_offsets()) for one in panels[0, 1].collections)
    assert (crosses, dots) == (failed, 64 - failed)
    assert [len(one.get_offsets()) for one in panels[0, 2].collections] == [64 - failed]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [f"a measure has no value: {failed} of 64 designs"]
    assert not figure_of(kinfmu.study(linkage(), KINDS["scatter"], designs=16, workers=1)).legends


def test_contributions_are_written_at_their_bars(tmp_path: Path) -> None:
    found = kinfmu.study(linkage(), KINDS["contributions"], measures="swing", designs=4, workers=1)
    found.figure(tmp_path / "figure.svg")
    text = (tmp_path / "figure.svg").read_text()
    for part in found.nominal.contributions("swing").values():
        assert f">{100.0 * part:.1f} %<" in text
    assert f"deviation {math.degrees(found.nominal.deviation('swing')):.4g} deg to first order" in text


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    found = kinfmu.study(linkage(), KINDS["response"], workers=1)
    with pytest.raises(StudyError, match="no measure 'swin'; did you mean 'swing'"):
        found.figure(tmp_path / "figure.svg", ("swin",))
    with pytest.raises(FigureError, match="not a known format of figures"):
        found.figure(tmp_path / "figure.gif")
