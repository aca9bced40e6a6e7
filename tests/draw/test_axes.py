"""Axes, titles and fits of figures, and the figures that are committed."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

import kinfmu
from kinfmu import load
from kinfmu.arrays import FloatArray
from kinfmu.draw import figure, plot
from kinfmu.draw.chart import unit_in
from kinfmu.draw.drawing import sheet_of
from kinfmu.draw.fitted import Curve, Fitted, figure_of
from kinfmu.draw.instant import instant
from kinfmu.draw.plots import _sheet, stacks_of
from kinfmu.draw.sheet import INCH, Sheet, title_lines
from kinfmu.draw.writing import figure_style
from kinfmu.errors import FigureError, KinfmuError, RequestError
from kinfmu.mechanism import gallery
from kinfmu.run import Run
from tests.draw.picture import differences, picture
from tests.gallery_members import every_member
from tests.log.runs import fourbar, with_gap
from tests.mechanism.loads.every_load import every_load
from tests.mechanisms import fourbar as general_fourbar


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


# ---------------------------------------------------------------------------------------------------------------- title


pytest.importorskip("matplotlib")

LONG = "Gripper with parallel jaws whose piston opens two of them through bell cranks of a kind"


def titled(title: str) -> Run:
    run = fourbar(np.arange(10.0))
    return dataclasses.replace(run, info={**run.info, "title": title})


def test_a_title_that_fits_is_one_line() -> None:
    assert title_lines("Gripper with parallel jaws", 400.0) == ["Gripper with parallel jaws"]
    assert title_lines("", 400.0) == []
    assert title_lines("A", 400.0) == ["A"]


def test_a_long_title_continues_on_a_second_line_and_ends_in_an_ellipsis() -> None:
    assert " ".join(title_lines(LONG, 400.0)) == LONG
    assert title_lines(LONG, 200.0) == ["Gripper with parallel jaws whose", "piston opens two of them through…"]
    first, second = title_lines("W" * 90, 200.0)
    assert set(first) == {"W"}
    assert second == f"{first}…"


@pytest.mark.parametrize(
    "title", ["\U0001f468\ue1ff", pytest.param("a" * 10_000, marks=pytest.mark.long), "$\\frac{$ {} %s <b>&amp;"]
)
@pytest.mark.few(1)
def test_any_line_of_text_is_a_title_of_every_picture(title: str, tmp_path: Path) -> None:
    mechanism = dataclasses.replace(load("fourbar"), title=title)
    figure(mechanism, tmp_path / "a.svg")
    plot(titled(title), tmp_path / "b.svg")
    for name in ("a.svg", "b.svg"):
        ET.parse(tmp_path / name)  # noqa: S314  # written just now


@pytest.mark.parametrize("title", ["Four-bar", LONG, "W" * 200])
@pytest.mark.parametrize("unit", ["m", None])
def test_the_title_of_a_figure_is_in_the_picture(title: str, unit: str | None) -> None:
    figure = Sheet(np.array([[0.0, 0.0], [0.5, 4.0]]), 1.0, unit, title).figure
    figure.canvas.draw()
    texts = [*figure.axes[0].texts, figure.axes[0]._left_title]
    boxes = [text.get_window_extent() for text in texts if text.get_text()]
    assert len(boxes) == 1
    assert boxes[0].x0 >= 0.0
    assert boxes[0].x1 <= figure.bbox.x1
    assert boxes[0].y1 <= figure.bbox.y1


@pytest.mark.parametrize("title", ["Four-bar", LONG, "W" * 200])
@pytest.mark.few(1)
def test_the_title_of_plots_is_in_the_picture_and_above_the_names(title: str) -> None:
    figure = _sheet([titled(title)], stacks_of(fourbar(np.arange(10.0)), ["coupler.x"]))
    figure.canvas.draw()
    (box,) = (text.get_window_extent() for text in figure.texts)
    assert box.x1 <= figure.bbox.x1
    assert box.y1 <= figure.bbox.y1
    assert box.y0 > figure.axes[0]._left_title.get_window_extent().y1


@pytest.mark.parametrize("stop", [1.0, 1e5, 9e5, 0.0123456])
@pytest.mark.few(2)
def test_the_number_of_the_last_tick_is_in_the_picture(stop: float) -> None:
    run = fourbar(np.arange(10.0))
    figure = _sheet(
        [dataclasses.replace(run, t=np.linspace(0.0, stop, 10))],
        stacks_of(run, ["coupler.x", "coupler.y"]),
    )
    figure.canvas.draw()
    assert figure.axes[-1].xaxis.get_tightbbox().x1 <= figure.bbox.x1


# --------------------------------------------------------------------------------------------------------------- fitted


def panels(step: float) -> list[Axes]:
    """Of a fit whose five wanted points are `step` apart [m]."""
    wanted = np.array([0.2, 0.1]) + step * np.column_stack([np.arange(5.0), 0.1 * np.arange(5.0) ** 2])
    found = figure_of(Fitted(kinfmu.load("fourbar"), None, [Curve("P", wanted, wanted, wanted)], []))
    found.draw_without_rendering()
    return list(found.axes)


def markers(axes: Axes) -> tuple[float, float]:
    """Size of the wanted points, and their smallest distance on the paper, both [pt]."""
    (line,) = (line for line in axes.lines if line.get_label() == "P: wanted")
    at = axes.transData.transform(line.get_xydata()) * INCH / axes.figure.dpi
    return line.get_markersize(), min(float(np.hypot(*(b - a))) for a, b in pairwise(at))


def test_points_close_together_are_separate_and_enlarged() -> None:
    drawing, enlarged = panels(0.05)
    size, apart = markers(drawing)
    assert size < 6.0
    assert size < apart
    size, apart = markers(enlarged)
    assert size == 6.0
    assert apart > 30.0
    (x0, y0), (x1, y1) = enlarged.transData.transform([[0.0, 0.0], [0.01, 0.01]])
    assert x1 - x0 == pytest.approx(y1 - y0)
    assert enlarged.get_title(loc="left") == "P, enlarged"
    assert (enlarged.get_xlabel(), enlarged.get_ylabel()) == ("x [m]", "y [m]")
    assert np.ptp(enlarged.get_xlim()) == pytest.approx(1.24 * 0.2)


def test_points_far_apart_need_no_panel() -> None:
    (drawing,) = panels(0.3)
    assert markers(drawing)[0] == 6.0


@pytest.mark.parametrize("name", ["crank_rocker", "jansen_leg", "slider_crank", "watt_six_bar", "double_crank"])
@pytest.mark.few(1)
def test_the_name_of_the_driver_keeps_off_a_curve_through_its_usual_place(name: str) -> None:
    mech = kinfmu.load(name)

    def drawn(curve: FloatArray) -> tuple[Axes, Bbox]:
        made = figure_of(Fitted(mech, 1.0, [Curve("path", curve[:2], curve[:2], curve)], []))
        FigureCanvasAgg(made).draw()
        (text,) = (text for text in made.axes[0].texts if text.get_text().startswith(f"{mech.drivers[0].name} = "))
        return made.axes[0], text.get_window_extent()

    far = np.array([[0.0, 0.0], [0.0, 1e-3]])
    axes, box = drawn(far)
    x, y = (box.x0 + box.x1) / 2.0, (box.y0 + box.y1) / 2.0
    across = np.linspace([x - 40.0, y - 9.0], [x + 40.0, y + 9.0], 200)
    curve = axes.transData.inverted().transform(across)
    axes, box = drawn(curve)
    on_paper = axes.transData.transform(curve)
    assert not ((box.min + 1.0 < on_paper) & (on_paper < box.max - 1.0)).all(axis=1).any()


# ------------------------------------------------------------------------------------------------------------ committed


DOCS = Path(__file__).parents[2] / "docs"


@every_member
@pytest.mark.few(2)
def test_the_figure_in_the_gallery_is_current(name: str, gallery_figure: Callable[[str], Path]) -> None:
    there, now = picture(gallery.folder() / name / "figure.svg"), picture(gallery_figure(name))
    assert not differences(there, now), "scripts/pictures draws it anew"


def test_the_figure_of_every_load_in_the_docs_is_current(tmp_path: Path) -> None:
    figure(every_load(), tmp_path / "now.svg")
    there, now = picture(DOCS / "loads.svg"), picture(tmp_path / "now.svg")
    assert not differences(there, now), "scripts/pictures draws it anew"


def test_pictures_of_two_mechanisms_differ_in_shapes_and_texts(tmp_path: Path) -> None:
    figure(general_fourbar(4.0, 1.0, 3.5, 3.0), tmp_path / "one.svg")
    figure(general_fourbar(4.0, 1.0, 3.5, 3.2), tmp_path / "other.svg")
    one, other = picture(tmp_path / "one.svg"), picture(tmp_path / "other.svg")
    assert {line.partition(" ")[0].strip(":") for line in differences(one, other)} >= {"shape", "text"}
    assert {"crank", "coupler", "rocker"} <= {text.look.split("'")[1] for text in one.texts}
    assert any(np.ptp(shape.points, axis=0).max() > 100.0 for shape in one.shapes)
    assert not differences(one, one)
