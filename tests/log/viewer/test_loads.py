"""Loads in recordings: symbols that reach from point to point, and one picture for each force."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import scene
from kinfmu.log import write_rrd
from kinfmu.log.viewer.comparison import write_comparison
from kinfmu.log.viewer.linkage import view_box
from kinfmu.mechanism.body import Gravity
from kinfmu.run import Run
from tests.log.runs import with_gap
from tests.log.viewer.test_rerun_file import STRIPS, entities, rows, statics, verified
from tests.mechanism.loads.every_load import every_load, fourbar

TIMES = np.linspace(0.0, 1.0, 11)


@pytest.fixture(scope="module")
def run() -> Run:
    return kinfmu.solve(every_load(), TIMES)


@pytest.fixture(scope="module")
def path(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("recordings") / "run.rrd"
    write_rrd(run, found)
    return found


def lines(path: Path, entity: str, at: float) -> FloatArray:
    """All points of an entity's lines in the plane at a time [s]."""
    local = np.vstack([np.array(strip, float) for strip in statics(path, entity, STRIPS)])
    time = round(at * 1e9)
    found = {
        part: np.array(dict(rows(path, entity, f"Transform3D:{part}"))[time], float)[0]
        for part in ("translation", "quaternion")
    }
    scale = dict(rows(path, entity, "Transform3D:scale")).get(time)
    local = local * (np.array(scale, float)[0][:2] if scale else 1.0)
    x, y, _ = found["translation"]
    turn = 2.0 * np.arctan2(found["quaternion"][2], found["quaternion"][3])
    return np.vstack([world(np.array([[x, y, turn]]), (a, b)) for a, b in local.tolist()])


def point(run: Run, name: str, row: int) -> FloatArray:
    body, _, _ = name.partition(".")
    pose = (0.0, 0.0, 0.0)
    if body != "ground":
        known = {**run.fixed, **{one: run[one][row] for one in run.outputs}}
        pose = (known[f"{body}.x"], known[f"{body}.y"], known[f"{body}.phi"])
    return np.asarray(world(np.array([pose]), every_load().body_points[name])[0])


def test_a_recording_has_a_symbol_for_each_load_without_an_arrow_of_its_own(path: Path) -> None:
    found = entities(path)
    symbols = {entity.split("/")[3] for entity in found if entity.startswith("/linkage/loads/")}
    assert symbols == {"coil", "oil", "strut", "muscle", "wind", "brake", "clock", "grease"}  # the weight has an arrow
    arrows = {entity.rpartition("/")[2] for entity in found if entity.startswith("/linkage/forces/loads/")}
    assert arrows == {"coil", "oil", "strut", "weight"}
    assert statics(path, "/linkage/loads/coil/between", "LineStrips2D:labels") == ["coil"]
    assert verified(path)


@pytest.mark.parametrize("row", [0, 4, 9])
def test_a_spring_is_stretched_between_its_points(path: Path, run: Run, row: int) -> None:
    zigzag = lines(path, "/linkage/loads/coil/between", TIMES[row])
    np.testing.assert_allclose(zigzag[0], point(run, "ground.D", row), atol=1e-3)
    np.testing.assert_allclose(zigzag[-1], point(run, "coupler.M", row), atol=1e-3)


def test_parts_of_a_gas_spring_keep_their_lengths_at_both_ends(tmp_path: Path) -> None:
    strut = (
        '[loads.strut]\ntype = "gas_spring"\nbetween = ["ground.F", "rocker.T"]\nextended_length = 400\n'
        "stroke = 250\nextended_force = 100\ncompressed_force = 150\n"
    )
    run = kinfmu.solve(fourbar(strut), TIMES)
    file = tmp_path / "run.rrd"
    write_rrd(run, file)
    for row in (0, 5):
        tube, rod = (lines(file, f"/linkage/loads/strut/{end}", TIMES[row]) for end in ("first", "last"))
        a, b = point(run, "ground.F", row), point(run, "rocker.T", row)
        along = (b - a) / np.hypot(*(b - a))
        assert np.abs((tube - a) @ along).min() < 1e-3
        assert np.abs((rod - b) @ along).min() < 1e-3
        piston, end = ((rod - a) @ along).min(), ((tube - a) @ along).max()
        assert 0.0 < piston < end < np.hypot(*(b - a))
    for end in ("first", "last"):
        assert not rows(file, f"/linkage/loads/strut/{end}", "Transform3D:scale")


def test_a_force_by_time_in_a_run_over_an_angle_has_a_symbol(tmp_path: Path) -> None:
    push = '[loads.push]\ntype = "force_along"\nat = "rocker.T"\nlaw = "polynomial"\ncoefficients = [0, 3]\n'
    for name, given, kind in (("time", {"t": TIMES}, "forces"), ("angle", {"crank_angle": TIMES + 1.0}, "linkage")):
        run = kinfmu.solve(fourbar(push), **given)
        write_rrd(run, tmp_path / f"{name}.rrd")
        found = entities(tmp_path / f"{name}.rrd")
        drawn = {entity for entity in found if "push" in entity}
        wanted = "/linkage/forces/loads/push" if kind == "forces" else "/linkage/loads/push/first"
        assert wanted in drawn
        assert len({entity.split("/")[2] for entity in drawn}) == 1  # once


def test_symbols_turn_grey_where_the_run_has_no_numbers(tmp_path: Path) -> None:
    run = with_gap(kinfmu.solve(every_load(), TIMES), 4, 6)
    write_rrd(run, tmp_path / "run.rrd")
    colours = rows(tmp_path / "run.rrd", "/linkage/loads/clock/first", "LineStrips2D:colors")
    assert [time / 1e9 for time, value in colours if value] == pytest.approx([0.0, 0.4, 0.7])
    assert colours[1][1] != colours[0][1] == colours[2][1]


def test_a_comparison_draws_the_loads_of_both_runs_in_their_colours(run: Run, tmp_path: Path) -> None:
    other = kinfmu.solve(dataclasses.replace(every_load(), loads=every_load().loads[:1]), TIMES)
    write_comparison(run, other, tmp_path / "both.rrd")
    found = entities(tmp_path / "both.rrd")
    symbols = {tuple(entity.split("/")[1:5:3]) for entity in found if "/linkage/loads/" in entity}
    assert {("a", load.name) for load in every_load().loads} | {("b", "coil")} == symbols
    (a,) = statics(tmp_path / "both.rrd", "/a/linkage/loads/coil/between", "LineStrips2D:colors")
    (b,) = statics(tmp_path / "both.rrd", "/b/linkage/loads/coil/between", "LineStrips2D:colors")
    shown = [palette.tint("own", colour, is_dark=True) for colour in palette.RUNS]
    assert [a, b] == [red << 24 | green << 16 | blue << 8 | 255 for red, green, blue in shown]


def test_a_recording_without_loads_has_no_symbols(tmp_path: Path) -> None:
    write_rrd(kinfmu.solve(fourbar(has_gravity=True), TIMES), tmp_path / "run.rrd")
    assert not [entity for entity in entities(tmp_path / "run.rrd") if "loads" in entity]


@pytest.mark.parametrize("pull", [(0.0, -9.81), (3.0, 4.0), (0.0, 0.0)])
def test_a_recording_shows_the_direction_of_gravity_outside_the_linkage(
    pull: tuple[float, float], tmp_path: Path
) -> None:
    mechanism = dataclasses.replace(fourbar(), gravity=Gravity(*pull))
    run = kinfmu.solve(mechanism, TIMES)
    write_rrd(run, tmp_path / "run.rrd")
    assert ("/linkage/ground/gravity" in entities(tmp_path / "run.rrd")) == any(pull)
    if any(pull):
        (arrow,) = statics(tmp_path / "run.rrd", "/linkage/ground/gravity", "Arrows2D:vectors")
        (tail,) = statics(tmp_path / "run.rrd", "/linkage/ground/gravity", "Arrows2D:origins")
        np.testing.assert_allclose(np.array(arrow) / np.hypot(*arrow), np.array(pull) / np.hypot(*pull), atol=1e-6)
        made = scene(run, mechanism)
        assert max(tail[0], tail[0] + arrow[0]) < made.low[0]
        (x0, x1), (y0, y1) = view_box(made)
        for x, y in (tail, np.add(tail, arrow)):
            assert x0 < x < x1
            assert y0 < -y < y1
    bare = kinfmu.load("slider_crank")
    write_rrd(kinfmu.solve(bare), tmp_path / "bare.rrd")
    assert "/linkage/ground/gravity" not in entities(tmp_path / "bare.rrd")
