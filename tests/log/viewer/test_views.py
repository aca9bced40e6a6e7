"""Views of recordings in a viewer without a window: none reports an error."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.log import write_mcap, write_rrd
from kinfmu.log.viewer import headless
from kinfmu.log.viewer.comparison import write_comparison
from kinfmu.mechanism import gallery
from kinfmu.run.channels import select
from kinfmu.run.driving import run_times
from tests.gallery_members import mostly_long
from tests.log.runs import KINDS, fourbar, with_gap
from tests.log.viewer.test_rerun_file import verified
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
            {"linkage", "angular velocity [rad/s]", "log10 margin", "solver status", "log", "run"},
            marks=pytest.mark.long,
        ),
        ("one.rrd", _one_sample, {"linkage", "position [m]"}),
        pytest.param("selected.rrd", _selected, {"linkage", "angle [rad]", "solver status"}, marks=pytest.mark.long),
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


@pytest.mark.long
def test_recordings_of_two_mechanisms_do_not_share_a_layout(tmp_path: Path, viewer: headless.Viewer) -> None:
    """Rerun keeps one layout for all recordings of an application; bounds and times of another run would be wrong."""
    write_rrd(fourbar(np.arange(181.0)), tmp_path / "first.rrd")
    write_rrd(select(fourbar(np.arange(20.0)), ["q"]), tmp_path / "second.rrd")
    viewer.show(tmp_path / "first.rrd")
    assert "velocity [m/s]" in viewer.glance().views
    viewer.show(tmp_path / "second.rrd")
    assert "velocity [m/s]" not in viewer.glance().views
