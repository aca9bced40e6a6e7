"""Views of recordings: which there are, their axes, timelines and names, and the samples that long runs leave out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.draw.scene.forces import arrows
from kinfmu.draw.scene.scene import Scene, drawable, scene
from kinfmu.errors import LogError
from kinfmu.log import write_mcap, write_rrd
from kinfmu.log.viewer import headless, timeline
from kinfmu.log.viewer.blueprint import ABREAST, EDGE, NUMBERS, WIDTH, plot, with_two_labels
from kinfmu.log.viewer.card import card
from kinfmu.log.viewer.comparison import write_comparison
from kinfmu.log.viewer.dataset import DesignRun, write_dataset
from kinfmu.log.viewer.ground import dots, places_below, shown_names
from kinfmu.log.viewer.marks import legend_start
from kinfmu.log.viewer.series import margin
from kinfmu.log.viewer.timeline import decimated, timeline_of
from kinfmu.mechanism import gallery
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from kinfmu.run.channels import select
from kinfmu.run.driving import run_times
from tests.gallery_members import every_member, mostly_long
from tests.log.runs import KINDS, fourbar, with_gap
from tests.log.viewer.test_rerun_file import SCALARS, documents, rows, statics, verified
from tests.run.test_forces import loaded

MOST_SAMPLES = 60  # of a mechanism of the gallery


def _single(path: Path) -> None:
    write_rrd(with_gap(fourbar(np.arange(181.0)), 100, 120), path)


def _one_sample(path: Path) -> None:
    write_rrd(KINDS["one sample"](), path)


def _selected(path: Path) -> None:
    write_rrd(select(fourbar(np.arange(181.0)), ["q", "-coupler.x"]), path)


def _compared(path: Path) -> None:
    other = with_gap(fourbar(np.arange(0.0, 181.0, 0.5)), 40, 60)
    write_comparison(fourbar(np.arange(181.0)), other.replaced(values=1.01 * other.values), path)


def _loaded(path: Path) -> None:
    write_rrd(kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 0.1, 21)), path)


def _forces(path: Path) -> None:
    """Two runs that differ in their forces only: no plot shows zeros."""
    light = loaded("slider_crank")
    heavy = dataclasses.replace(light, gravity=(2.0 * light.gravity[0], 2.0 * light.gravity[1]))
    write_comparison(*(kinfmu.solve(one, np.linspace(0.0, 0.1, 21)) for one in (light, heavy)), path)


@pytest.mark.parametrize(
    ("name", "write", "views"),
    [
        pytest.param(
            "gap.rrd",
            _single,
            {"linkage", "velocity [m/s]", "log10 margin", "solver status", "log", "run"},
            marks=pytest.mark.long,
        ),
        ("one.rrd", _one_sample, {"linkage", "position [m]"}),
        pytest.param("selected.rrd", _selected, {"linkage", "angle [deg]", "solver status"}, marks=pytest.mark.long),
        ("loaded.rrd", _loaded, {"linkage", "crank.torque [N m]", "crank.power [W]", "energy [J]"}),
        ("compared.rrd", _compared, {"linkage", "B - A: position [m]", "position [m] of A (wide) and B"}),
        ("forces.rrd", _forces, {"crank.torque [N m] of A (wide) and B", "B - A: crank.torque [N m]", "solver status"}),
    ],
)
def test_no_view_reports_an_error(
    name: str, write: Callable[[Path], None], views: set[str], tmp_path: Path, viewer: headless.Viewer
) -> None:
    write(tmp_path / name)
    viewer.show(tmp_path / name)
    shot = viewer.glance()
    assert shot.reports == ()
    assert views <= set(shot.views)
    assert ("B - A: position [m]" in shot.views) == (name == "compared.rrd")
    assert shot.png.startswith(b"\x89PNG")


@pytest.mark.parametrize("name", mostly_long(gallery.names(), few=("cam_roller", "excavator_loaded", "fourbar")))
def test_no_view_of_the_gallery_reports_an_error(name: str, tmp_path: Path, viewer: headless.Viewer) -> None:
    mechanism = kinfmu.load(name)
    times = run_times(mechanism.run)
    run = kinfmu.solve(mechanism, times[:: -(-len(times) // MOST_SAMPLES)])
    path = tmp_path / f"{name}.rrd"
    write_rrd(run, path)
    assert verified(path)
    viewer.show(path, {"duration": float(run.t[len(run) // 3])})
    shot = viewer.glance()
    assert shot.reports == ()
    assert {"linkage", "run", "solver status", "log10 margin", "Newton iterations"} <= set(shot.views)
    assert any(view.startswith("log10 residual") for view in shot.views)


@pytest.mark.parametrize("name", ["excavator", "fourbar", "cam_roller"])
def test_the_record_alone_opens_with_plots_and_the_linkage(name: str, tmp_path: Path, viewer: headless.Viewer) -> None:
    mechanism = kinfmu.load(name)
    times = run_times(mechanism.run)
    write_mcap(kinfmu.solve(mechanism, times[:: -(-len(times) // MOST_SAMPLES)]), tmp_path / "run.mcap")
    viewer.show(tmp_path / "run.mcap")
    shot = viewer.glance()
    assert shot.reports == ()
    assert {"/", "joint_states/position", "joint_states/velocity", "joint_accelerations/position"} <= set(shot.views)


def test_the_error_of_a_view_is_reported(tmp_path: Path, viewer: headless.Viewer) -> None:
    import rerun as rr
    import rerun.blueprint as rrb

    rec = rr.RecordingStream("kinfmu_wrong")
    flat = rr.Points2D([[0.0, 0.0]])
    view = rrb.Spatial3DView(name="wrong", overrides={"/points": flat.visualizer()})
    rec.save(tmp_path / "wrong.rrd", default_blueprint=rrb.Blueprint(view, auto_views=False))
    rec.set_time("sim_time", duration=0.0)
    rec.log("/points", flat)
    rec.flush()
    rec.disconnect()
    viewer.show(tmp_path / "wrong.rrd")
    (report,) = viewer.glance().reports
    assert report.startswith("wrong: error: 2D visualizers require a pinhole")


def test_recordings_of_designs_are_a_table_whose_layout_shows_each(tmp_path: Path, viewer: headless.Viewer) -> None:
    runs = [kinfmu.solve(kinfmu.load("jansen_leg"), np.linspace(0.0, 1.0, 31), parameters={"j": j}) for j in (49, 51)]
    designs = [DesignRun(f"design {k}", run, {"j [mm]": 49.0 + 2 * k}) for k, run in enumerate(runs)]
    paths = write_dataset(designs, tmp_path, "legs")
    viewer.show(paths)
    assert "/dataset/" in viewer._client.get_location() or "/entry/" in viewer._client.get_location()
    for path in paths:
        viewer.show(path)
        shot = viewer.glance()
        assert shot.reports == ()
        assert {"linkage", "angle [deg]", "acceleration [mm/s2]"} <= set(shot.views)


@pytest.mark.long
def test_recordings_of_two_mechanisms_do_not_share_a_layout(tmp_path: Path, viewer: headless.Viewer) -> None:
    """Rerun keeps one layout for all recordings of an application; bounds and times of another run would be wrong."""
    write_rrd(fourbar(np.arange(181.0)), tmp_path / "first.rrd")
    write_rrd(select(fourbar(np.arange(20.0)), ["q"]), tmp_path / "second.rrd")
    viewer.show(tmp_path / "first.rrd")
    assert "velocity [m/s]" in viewer.glance().views
    viewer.show(tmp_path / "second.rrd")
    assert "velocity [m/s]" not in viewer.glance().views


# ------------------------------------------------------------------------------------------------------------ blueprint


pytest.importorskip("rerun")
WIDEST_LABEL = 50.0  # [points], such as +100 ms


@pytest.mark.parametrize("width", [WIDTH / 2, WIDTH / ABREAST])
def test_the_label_at_the_end_of_the_run_is_not_cut_off(width: float) -> None:
    run = fourbar(np.arange(181.0))
    group = margin(run)
    assert group is not None
    view = plot(group.title, [("", group)], timeline_of([run]), [run], width)
    (shown,) = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()
    start, end = (shown[key] / 1e9 for key in ("start", "end"))
    assert start == pytest.approx(-EDGE * 180.0)
    assert (end - 180.0) / (end - start) * (width - NUMBERS) > 0.5 * WIDEST_LABEL


@pytest.mark.parametrize("height", [45.0, 82.0, 110.0, 300.0])
def test_an_axis_has_two_labels_at_powers_of_ten(height: float) -> None:
    """Rerun labels the multiples of the least power of ten that are 20 points apart or more."""
    drawn = np.random.default_rng(4)
    for _ in range(500):
        low, high = np.sort(drawn.choice([0.0, 1.0], 2) * drawn.normal(size=2) * 10.0 ** drawn.uniform(-9, 9, 2))
        if not high > low:
            continue
        bottom, top = with_two_labels(low, high, height)
        free = 0.023 * (top - bottom)  # a curve at the least or greatest value is not on the edge of the plot
        assert bottom < low - free
        assert high + free < top
        assert top - bottom < 25.0 * (high - low)
        steps = [step for k in range(-20, 20) if (step := 10.0**k) / (top - bottom) * height >= 20.0]
        cut = 1.5 * (top - bottom) / height  # of a label nearer to the end half is missing
        labels = np.arange(np.ceil((bottom + cut) / steps[0]), np.floor((top - cut) / steps[0]) + 0.5)
        assert len(labels) >= 2, (low, high, bottom, top)


# ------------------------------------------------------------------------------------------------------------- timeline


def test_runs_over_different_axes_have_no_timeline_in_common() -> None:
    mechanism = kinfmu.load("fourbar")
    runs = [kinfmu.solve(mechanism, [0.0, 1.0]), kinfmu.solve(mechanism, crank_angle=[0.0, 1.0])]
    message = r"the runs are over t \[s\] and crank \[deg\]; runs over the same axis can be compared"
    with pytest.raises(LogError, match=f"^{message}$"):
        timeline_of(runs)


def test_values_that_a_recording_cannot_hold_are_refused() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=np.array([0.0, 3e9]))
    with pytest.raises(LogError, match=r"^crank \[rad\]: a recording holds values of at most 2147483648$"):
        timeline_of([run])


# ------------------------------------------------------------------------------------------------------------ decimated


@pytest.fixture
def long_run() -> Run:
    """2001 samples with a gap of three and one sample that stands out."""
    run = fourbar(np.linspace(0.0, 180.0, 2001))
    peaked = np.where(np.arange(2001) == 777, 5.0, run.residual)
    return with_gap(dataclasses.replace(run, residual=peaked), 1234, 1236)


def test_a_short_run_is_left_as_it_is(run: Run) -> None:
    assert decimated(run, 181) is run
    assert decimated(run) is run


def test_peaks_are_kept(long_run: Run) -> None:
    less = decimated(long_run, 100)
    assert 100 <= len(less) < 150
    kept = np.searchsorted(long_run.t, less.t)
    assert {0, 777, 1233, 1234, 1236, 1237, 2000} <= set(kept.tolist())
    for column, whole in zip(less.columns(), long_run.columns(), strict=True):
        np.testing.assert_array_equal(column.values, whole.values[kept])
        assert np.nanmax(column.values) == np.nanmax(whole.values)
        assert np.nanmin(column.values) == np.nanmin(whole.values)


def test_a_recording_states_what_it_leaves_out_and_holds_all_events(
    long_run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(timeline, "MOST_ROWS", 100)
    write_rrd(long_run, tmp_path / "run.rrd")
    angles = rows(tmp_path / "run.rrd", "/position/angle", SCALARS)
    assert 100 <= len(angles) < 150
    (text,) = documents(tmp_path / "run.rrd", "/card")
    assert f"{len(angles)} of 2001 samples are drawn" in text
    texts = [text for _, (text,) in rows(tmp_path / "run.rrd", "/log", "TextLog:text")]  # type: ignore[misc]  # one each
    assert texts[0] == (
        "1 sample (crank 0 deg), bridged: the equations are singular there, so poses are interpolated across"
    )
    assert len(texts) == 3
    write_comparison(long_run, long_run, tmp_path / "both.rrd")
    (text,) = documents(tmp_path / "both.rrd", "/card")
    assert "A: " in text
    assert "B: " in text


# --------------------------------------------------------------------------------------------------------------- labels


SLIDER_FIRST = """
name = "slider_first"
[bodies.ground]
points = { O = [0, 0], way = [0, -1] }
[bodies.crank]
points = { O = [0, 0], P = [1, 0] }
[bodies.rod]
points = { P = [0, 0], S = [3, 0] }
start = { x = 1, phi = -0.3 }
[bodies.slider]
points = { S = [0, 0], tip = [1, 0] }
start = { x = 4, y = -1 }
[joints]
main = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
S = { type = "revolute", between = ["rod.S", "slider.S"] }
guide = { type = "translational", between = ["slider.S", "ground.way"] }
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
speed = 1
"""


def scene_of(mechanism: Mechanism) -> Scene:
    run = kinfmu.solve(mechanism, np.linspace(mechanism.run.start, mechanism.run.stop, 41))
    found, _ = drawable(run)
    assert found
    return found


@every_member
def test_names_of_supports_do_not_cover_each_other(name: str) -> None:
    scene = scene_of(kinfmu.load(name))
    places, names = places_below(scene) * dots(scene), list(scene.supports)
    for k, at in enumerate(places):
        for other, text in zip(places[:k], names, strict=False):
            assert abs(at - other)[1] > 16.0 or abs(at - other)[0] > 3.2 * (len(text) + len(names[k]))


def test_a_name_that_would_cover_another_is_shown_only_when_pointed_at() -> None:
    mechanism = kinfmu.load("fourbar")
    assert {"crank", "coupler", "rocker"} <= shown_names(scene_of(mechanism))
    scene = scene_of(mechanism)
    (crank,) = (shape for shape in scene.shapes if (shape.kind, shape.name) == ("link", "crank"))
    twins = replace(scene, shapes=(*scene.shapes, replace(crank, name="other")))
    assert "other" not in shown_names(twins)
    assert "crank" in shown_names(twins)


def test_supports_have_the_names_of_all_joints_at_their_place() -> None:
    assert list(scene_of(parse(SLIDER_FIRST, "slider.toml")).supports) == ["main"]
    assert "pin_upper, pin_lower" in scene_of(kinfmu.load("jansen_leg")).supports


def test_the_block_of_the_ground_through_which_a_slider_moves_is_drawn(tmp_path: Path) -> None:
    mechanism = parse(SLIDER_FIRST, "slider.toml")
    write_rrd(kinfmu.solve(mechanism, np.linspace(0.0, 1.0, 11)), tmp_path / "run.rrd")
    *area, block = statics(tmp_path / "run.rrd", "/linkage/ground/blocks", "LineStrips2D:strips")
    np.testing.assert_allclose(np.mean(block[:4], axis=0), [0.0, -1.0], atol=1e-6)
    inside = np.array(area)  # (lines, 2, 2), next to each other
    assert np.ptp(inside[:, :, 1]) == pytest.approx(np.ptp(np.array(block)[:, 1]), rel=0.2)
    assert "guide" in statics(tmp_path / "run.rrd", "/linkage/ground/blocks", "LineStrips2D:labels")


def test_the_card_states_the_tool_that_made_the_fmu_but_not_its_token() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), [0.0])
    of_fmu = replace(run, info={"name": "fourbar", "generation_tool": "kinfmu 1", "token": "{12ab}", "parameters": ""})
    assert "{12ab}" not in card(of_fmu)
    assert "token" not in card(of_fmu)
    assert "| FMU made by | kinfmu 1 |" in card(of_fmu)
    assert "parameters set" not in card(of_fmu)


@pytest.mark.long
def test_the_scale_of_forces_keeps_off_the_names_of_supports() -> None:
    for name in ("fourbar_loaded", "excavator_loaded", "jansen_leg_loaded", "toggle_press"):
        mechanism = kinfmu.load(name)
        run = kinfmu.solve(mechanism)
        found = scene(run, mechanism)
        drawn = arrows(run, mechanism, found)
        assert drawn is not None
        middle = legend_start(found, drawn.length) + 0.5 * drawn.length
        near = [at for at in found.supports.values() if at[1] < found.low[1] + 0.2 * found.size]
        assert all(abs(at[0] - middle) > 0.1 * found.size for at in near), name
