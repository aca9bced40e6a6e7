"""Figures and plots in Axes of matplotlib that the caller gives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import kinfmu
from kinfmu.draw import figure, plot
from kinfmu.draw.chart import unit_in
from kinfmu.draw.drawing import sheet_of
from kinfmu.draw.instant import instant
from kinfmu.draw.writing import figure_style
from kinfmu.errors import FigureError, KinfmuError, RequestError
from kinfmu.run import Run
from tests.draw.picture import differences, picture
from tests.log.runs import fourbar, with_gap


@pytest.fixture
def run() -> Run:
    return fourbar(np.arange(181.0))


@pytest.fixture
def axes() -> Axes:
    return Figure().subplots()


def test_axes_of_the_size_of_a_figure_show_the_same_picture(tmp_path: Path) -> None:
    mechanism = kinfmu.load("jansen_leg")
    with figure_style(tmp_path):
        own = sheet_of(instant(mechanism)).figure
        other = Figure(figsize=own.get_size_inches(), dpi=own.dpi, facecolor="white")
        given = other.add_axes(own.axes[0].get_position().bounds)
        assert figure(mechanism, ax=given) is given
        own.savefig(tmp_path / "own.svg")
        other.savefig(tmp_path / "other.svg")
    assert differences(picture(tmp_path / "own.svg"), picture(tmp_path / "other.svg")) == []


@pytest.mark.parametrize("dpi", [72, 200])
def test_a_mechanism_fills_its_axes_and_leaves_the_others_alone(dpi: int) -> None:
    mechanism = kinfmu.load("fourbar")
    whole = Figure(figsize=(8.0, 3.0), dpi=dpi)
    left, right = whole.subplots(1, 2)
    before = right.get_window_extent().bounds
    assert figure(mechanism, at=1.0, ax=left) is left
    (x0, x1), (y0, y1) = left.get_xlim(), left.get_ylim()
    box = left.get_window_extent()
    assert (x1 - x0) / box.width == pytest.approx((y1 - y0) / box.height)  # equal scales
    shown = {text.get_text(): text.get_position() for text in left.texts}
    assert {"crank", "coupler", "rocker", "AB", "O", "P", "Q", "C", "A", "B"} <= set(shown)
    assert all(x0 < x < x1 and y0 < y < y1 for name, (x, y) in shown.items() if "starts" not in name)
    assert (x1 - x0) < 2.0 * np.ptp(np.vstack([patch.get_path().vertices for patch in left.patches])[:, 0])
    assert left.get_title(loc="left").split() == mechanism.title.split()
    assert left.get_xlabel() == "x [m]"
    assert not right.has_data()
    assert right.get_window_extent().bounds == before


def test_a_long_note_stays_within_given_axes() -> None:
    whole = Figure(figsize=(4.0, 3.0))
    given = figure(kinfmu.load("excavator"), ax=whole.subplots())
    note = next(text for text in given.texts if text.get_text().startswith("the run starts at"))
    assert "\n" in note.get_text()
    assert note.get_window_extent().x0 >= given.get_window_extent().x0


def test_columns_are_curves_with_their_names(run: Run, axes: Axes) -> None:
    assert plot(run, columns=["coupler.v*"], ax=axes) is axes
    assert [line.get_label() for line in axes.lines] == ["coupler.vx", "coupler.vy"]
    for line in axes.lines:
        np.testing.assert_array_equal(line.get_xydata(), np.column_stack([run.t, run[str(line.get_label())]]))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("t [s]", "[m/s]")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["coupler.vx", "coupler.vy"]


def test_one_column_is_named_at_its_axis_and_a_gap_is_tinted(run: Run, axes: Axes) -> None:
    plot(with_gap(run, 100, 120), columns=["coupler.ax"], ax=axes)
    assert axes.get_ylabel() == "coupler.ax [m/s²]"
    assert axes.get_legend() is None
    (line,), (tint,) = axes.lines, axes.patches
    values = np.asarray(line.get_ydata())
    assert np.flatnonzero(np.isnan(values)).tolist() == list(range(100, 121))
    assert tint.get_extents().transformed(axes.transData.inverted()).intervalx.tolist() == [99.0, 121.0]


def test_two_runs_share_axes(run: Run, axes: Axes) -> None:
    for part in (run, run.part(slice(0, 90))):
        plot(part, columns=["A.x"], ax=axes)
    assert [len(line.get_xydata()) for line in axes.lines] == [181, 90]
    assert len({str(line.get_color()) for line in axes.lines}) == 2
    assert axes.get_ylabel() == "A.x [m]"
    plot(run, columns=["A.y"], ax=axes)
    assert axes.get_ylabel() == "[m]"


def test_what_axes_cannot_show_is_reported(run: Run, axes: Axes, tmp_path: Path) -> None:
    mechanism = kinfmu.load("fourbar")
    with pytest.raises(FigureError, match=r"^Axes show one unit, but 'crank\.phi' is in rad and 'coupler\.x' in m; "):
        plot(run, ax=axes)
    with pytest.raises(RequestError, match=r"^'rocker\.x' does not move, so there is no curve"):
        plot(run, columns=["rocker.x"], ax=axes)
    with pytest.raises(kinfmu.KinfmuError, match=r"^the run has no column 'couplr\.x'; did you mean 'coupler\.x'"):
        plot(run, columns=["couplr.x"], ax=axes)
    with pytest.raises(RequestError, match=r"^columns: 'coupler\.x' must be a list of names, such as \['coupler\.x'\]"):
        plot(run, columns="coupler.x", ax=axes)
    with pytest.raises(FigureError, match=r"^the run has no samples to plot$"):
        plot(run.part(slice(0, 0)), columns=["coupler.x"], ax=axes)
    assert not axes.has_data()
    for name, call in (("figure", figure), ("plot", plot)):
        what = mechanism if call is figure else run
        for path, ax in ((None, None), (tmp_path / "a.svg", axes)):
            with pytest.raises(FigureError, match=rf"^{name} needs a path, or Axes of matplotlib as ax=; give one of"):
                call(what, path, ax=ax)
        with pytest.raises(FigureError, match=r"^ax must be Axes of matplotlib, .*, not Figure$"):
            call(what, ax=axes.figure)
        with pytest.raises(FigureError, match=r"^ax must be Axes with x and y, not with the projection 'polar'$"):
            call(what, ax=Figure().add_subplot(projection="polar"))
    assert not list(tmp_path.iterdir())


def test_without_matplotlib_axes_cannot_be_given() -> None:
    script = (
        "import sys; sys.modules['matplotlib'] = None\nimport kinfmu\n"
        "try:\n    kinfmu.draw.figure(kinfmu.load('fourbar'), ax=1)\n"
        "except kinfmu.KinfmuError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "figure: drawing needs matplotlib: pip install 'kinfmu[figures]'\n"


@pytest.mark.parametrize(
    ("name", "unit"),
    [("piston.phi", "rad"), ("piston.omega", "rad/s"), ("piston.alpha", "rad/s2"), ("piston.vy", "mm/s")],
)
def test_a_coordinate_that_a_joint_holds_has_the_unit_of_its_derivative(name: str, unit: str) -> None:
    run = kinfmu.solve(kinfmu.load("slider_crank"), t=[0.0, 0.1])
    assert unit_in(run, name) == unit
    with pytest.raises(KinfmuError, match=r"the run has no column 'piston\.beta'"):
        unit_in(run, "piston.beta")
