"""Rerun recordings: complete files with the numbers of the run."""

from __future__ import annotations

import dataclasses
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import LogError
from kinfmu.log import write_rrd
from kinfmu.log.viewer import headless
from kinfmu.log.viewer.comparison import _percent, in_common, write_comparison
from kinfmu.log.viewer.rerun_file import _check_whole
from kinfmu.run import Run
from kinfmu.run.channels import select
from kinfmu.units import CoordinateName
from tests.log.runs import KINDS, fourbar, without_samples
from tests.run.test_forces import loaded

SCALARS, STRIPS = "Scalars:scalars", "LineStrips2D:strips"


def rows(path: Path, entity: str, component: str) -> list[tuple[int, list[object]]]:
    """Time [ns] and value of every row of an entity's component, static data left out."""
    import rerun as rr

    found = []
    for chunk in rr.chunk.RrdReader(path).stream():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            if component in batch.schema.names:
                times = batch["sim_time"].cast("int64").to_pylist()
                found += zip(times, batch[component].to_pylist(), strict=True)
    return sorted(found, key=lambda row: row[0])


def statics(path: Path, entity: str, component: str) -> list[object]:
    """Return the static values of an entity's component."""
    import rerun as rr

    found = []
    for chunk in rr.chunk.RrdReader(path).stream():
        if chunk.entity_path == entity and chunk.is_static:
            batch = chunk.to_record_batch()
            if component in batch.schema.names:
                found += [value for row in batch[component].to_pylist() for value in row]
    return found


def documents(path: Path, entity: str) -> list[str]:
    """The texts of a card."""
    return [str(text) for text in statics(path, entity, "TextDocument:text")]


def entities(path: Path) -> set[str]:
    import rerun as rr

    return {chunk.entity_path for chunk in rr.chunk.RrdReader(path).stream()}


def verified(path: Path) -> bool:
    process = subprocess.run(
        [headless.executable(), "rrd", "verify", str(path)],
        capture_output=True,
        check=False,
        env=os.environ | {"CI": "1"},
    )
    return process.returncode == 0


def test_rerun_verifies_any_recording(tmp_path: Path) -> None:
    for name, kind in KINDS.items():
        path = tmp_path / f"{name}.rrd"
        write_rrd(kind(), path)
        assert verified(path), name


def test_curves_hold_the_numbers_of_the_run_at_its_times(run: Run, tmp_path: Path) -> None:
    write_rrd(run, tmp_path / "run.rrd")
    angles = rows(tmp_path / "run.rrd", "/position/angle", SCALARS)
    assert [time for time, _ in angles] == [k * 10**9 for k in range(181)]
    phi = [run["crank.phi"][60], run["coupler.phi"][60], run["rocker.phi"][60]]
    np.testing.assert_allclose(angles[60][1], np.degrees(phi), rtol=1e-15)
    speeds = rows(tmp_path / "run.rrd", "/velocity/length", SCALARS)
    assert speeds[60][1] == [run[name][60] for name in ("coupler.vx", "coupler.vy", "A.vx", "A.vy")]


def test_times_are_rounded_to_whole_nanoseconds(tmp_path: Path) -> None:
    write_rrd(fourbar(np.arange(-500, 2500) * 1e-3), tmp_path / "run.rrd")
    angles = rows(tmp_path / "run.rrd", "/position/angle", SCALARS)
    assert [time for time, _ in angles] == [k * 1_000_000 for k in range(-500, 2500)]


def test_links_have_the_poses_of_the_run(run: Run, tmp_path: Path) -> None:
    write_rrd(run, tmp_path / "run.rrd")
    path = tmp_path / "run.rrd"
    edge, fill = statics(path, "/linkage/bodies/crank", STRIPS)
    np.testing.assert_allclose([edge, fill], [[[0, 0], [1, 0]]] * 2)
    for entity, angle, x, y in (("crank", "crank.phi", 0.0, 0.0), ("coupler", "coupler.phi", None, None)):
        shifts = dict(rows(path, f"/linkage/bodies/{entity}", "Transform3D:translation"))
        turns = dict(rows(path, f"/linkage/bodies/{entity}", "Transform3D:quaternion"))
        assert len(shifts) == len(turns) == len(run)
        x, y = (run["coupler.x"][60], run["coupler.y"][60]) if x is None else (x, y)
        np.testing.assert_allclose(shifts[60 * 10**9], [[x, y, 0]], atol=1e-6)
        half = run[angle][60] / 2
        np.testing.assert_allclose(turns[60 * 10**9], [[0, 0, np.sin(half), np.cos(half)]], atol=1e-6)


def test_what_joints_add_to_bodies_moves_with_them(tmp_path: Path) -> None:
    path = tmp_path / "rack.rrd"
    mechanism = kinfmu.load("rack_steering")
    write_rrd(kinfmu.solve(mechanism, np.linspace(0.0, 0.5, 6)), path)
    found = {entity for entity in entities(path) if entity.startswith("/linkage/bodies")}
    assert {f"/linkage/bodies/{part}/mesh" for part in ("rack/rack", "pinion/wheel", "pinion/spoke")} <= found
    *_, teeth = statics(path, "/linkage/bodies/rack/rack/mesh", STRIPS)  # after the lines that fill it
    *_, rim = statics(path, "/linkage/bodies/pinion/wheel/mesh", STRIPS)
    assert len(teeth) > 10
    assert np.ptp(np.array(rim)[:, 1]) == pytest.approx(16.0)


def test_a_gap_breaks_the_curves_and_turns_the_linkage_grey(run_with_gap: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    write_rrd(run_with_gap, path)
    broken = [time // 10**9 for time, value in rows(path, "/position/angle", SCALARS) if np.isnan(value).all()]
    assert broken == list(range(100, 121))
    drawn = {time // 10**9 for time, turn in rows(path, "/linkage/bodies/crank", "Transform3D:quaternion") if turn}
    assert drawn == set(range(181)) - set(range(100, 121))
    colours = [time // 10**9 for time, value in rows(path, "/linkage/bodies/crank", "LineStrips2D:colors") if value]
    assert colours == [0, 100, 121]
    notices = [(time // 10**9, value) for time, value in rows(path, "/linkage/notice", "Points2D:labels")]
    assert notices == [(0, []), (100, ["no pose: the last one that closed, in grey"]), (121, [])]


def test_paths_do_not_depend_on_the_run(tmp_path: Path) -> None:
    write_rrd(fourbar(np.arange(10.0, 20.0)), tmp_path / "a.rrd")
    write_rrd(fourbar(np.arange(30.0, 33.0)), tmp_path / "b.rrd")
    named = [{path for path in entities(tmp_path / name) if path != "/log"} for name in ("a.rrd", "b.rrd")]
    assert named[0] == named[1]
    assert {"/position/angle", "/acceleration/length", "/solver/status", "/card", "/linkage/bodies/crank"} <= named[0]


def test_what_was_not_kept_has_no_curves(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    write_rrd(select(run, ["q", "-coupler.x", "residual"]), path)
    found = entities(path)
    assert {"/position/angle", "/position/length", "/solver/accuracy", "/solver/status"} <= found
    assert not {entity for entity in found if entity.startswith(("/velocity", "/acceleration", "/solver/margin"))}
    assert "/linkage/bodies/crank" in found
    assert "/linkage/bodies/coupler" not in found
    assert verified(path)
    write_comparison(run, select(run, ["qd"]), tmp_path / "compare.rrd")
    assert {entity for entity in entities(tmp_path / "compare.rrd") if entity.startswith("/difference")} == {
        "/difference/velocity/angle",
        "/difference/velocity/length",
    }


def test_a_run_that_cannot_be_recorded_leaves_nothing_behind(run: Run, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="time of sample 0 is inf s"):
        write_rrd(dataclasses.replace(run, t=run.t + np.inf), tmp_path / "new" / "run.rrd")
    assert not list(tmp_path.iterdir())


def test_a_recording_without_its_end_is_reported(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    write_rrd(run, path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(LogError, match=r"run\.rrd: the recording could not be written to its end; is the disk full\?"):
        _check_whole(path, path)


def test_a_run_without_samples_is_a_recording_too(run: Run, tmp_path: Path) -> None:
    write_rrd(without_samples(run), tmp_path / "run.rrd")
    assert verified(tmp_path / "run.rrd")


def test_differences_are_those_of_b_from_a(run: Run, tmp_path: Path) -> None:
    shifted = dataclasses.replace(run, values=run.values + 0.25)
    write_comparison(run, shifted, tmp_path / "compare.rrd")
    for entity, apart in (("/difference/position/angle", np.degrees(0.25)), ("/difference/position/length", 0.25)):
        found = rows(tmp_path / "compare.rrd", entity, SCALARS)
        assert len(found) == len(run)
        np.testing.assert_allclose([value for _, value in found], apart, rtol=1e-14)
    assert verified(tmp_path / "compare.rrd")


def test_the_card_of_a_comparison_lists_what_differs_and_names_what_is_equal(run: Run, tmp_path: Path) -> None:
    moved = run.values + 0.25 * (np.array(run.outputs) == "A.x")
    write_comparison(run, dataclasses.replace(run, values=moved), tmp_path / "compare.rrd")
    (text,) = documents(tmp_path / "compare.rrd", "/card")
    assert "| A.x | 0.25 m | 0 | 0 |" in text
    assert "of the largest value: crank.phi, coupler.x, coupler.y, coupler.phi, rocker.phi, A.y." in text
    assert "coupler.x |" not in text


def test_runs_that_differ_in_forces_only_are_compared_by_their_forces(tmp_path: Path) -> None:
    times = np.linspace(0.0, 0.1, 21)
    light = loaded("slider_crank")
    heavy = dataclasses.replace(light, gravity=(2.0 * light.gravity[0], 2.0 * light.gravity[1]))
    a, b = (
        dataclasses.replace(kinfmu.solve(one, times), info={"name": "x", "g": str(k)})
        for k, one in enumerate((light, heavy), 1)
    )
    write_comparison(a, b, tmp_path / "compare.rrd")
    (text,) = documents(tmp_path / "compare.rrd", "/card")
    assert "| parameter | A | B |\n|---|---:|---:|\n| g | 1 | 2 |" in text
    apart = b["crank.torque"] - a["crank.torque"]
    largest, part = np.abs(apart).max(), np.abs(apart).max() / np.abs(a["crank.torque"]).max()
    assert f"| crank.torque | {largest:.3g} N m | {100.0 * part:.0f} % |" in text
    assert "| kinetic" not in text
    parts = [float(line.split("|")[3].strip(" %")) for line in text.splitlines() if line.endswith("% |")]
    assert parts == sorted(parts, reverse=True)
    assert len(parts) > 3
    found = rows(tmp_path / "compare.rrd", "/difference/forces/torque", SCALARS)
    np.testing.assert_allclose([value for _, (value,) in found], apart, rtol=1e-12, atol=1e-15)
    assert {"/a/forces/torque", "/b/reactions/force", "/difference/reactions/force"} <= entities(
        tmp_path / "compare.rrd"
    )
    assert verified(tmp_path / "compare.rrd")


def test_round_off_of_two_runs_is_no_difference(tmp_path: Path) -> None:
    """An engine whose moment at the guide is round-off alone: neither in the table nor in plots."""
    times = np.linspace(0.0, 0.04, 101)
    a = kinfmu.solve(kinfmu.load("engine"), times, engine="python")
    b = kinfmu.solve(kinfmu.load("engine"), times, engine="native")
    tables = {name: getattr(b, name) * (1.0 + 1e-14) for name in ("values", "rates", "accelerations", "reactions")}
    write_comparison(a, b.replaced(**tables), tmp_path / "compare.rrd")
    (text,) = documents(tmp_path / "compare.rrd", "/card")
    assert "Equal in both, to a billionth of the largest value: crank.phi, rod.x, rod.y, rod.phi, piston.y." in text
    assert "largest difference" not in text
    assert "%" not in text
    blueprint = subprocess.run(
        [headless.executable(), "rrd", "print", "-vvv", str(tmp_path / "compare.rrd")],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "of A (wide) and B" in blueprint
    assert "B - A: " not in blueprint


@pytest.mark.parametrize(
    ("part", "text"),
    [(0.0123, "1.2 %"), (0.0999, "10 %"), (2.04, "204 %"), (9.99, "999 %"), (11.0, "over 1000 %"), (np.inf, "-")],
)
def test_parts_are_percent_without_powers_of_ten(part: float, text: str) -> None:
    assert _percent(part) == text


def test_runs_of_different_times_are_compared_by_interpolation(tmp_path: Path) -> None:
    coarse, fine = fourbar(np.arange(0.0, 20.0)), fourbar(np.arange(5.0, 15.0, 0.01))
    write_comparison(coarse, fine, tmp_path / "compare.rrd")
    found = rows(tmp_path / "compare.rrd", "/difference/position/length", SCALARS)
    apart = np.array([value for _, value in found])
    assert np.isnan(apart[:5]).all()
    assert np.isnan(apart[15:]).all()
    assert np.abs(apart[5:15]).max() < 1e-12


def renamed(run: Run, *kept: str) -> Run:
    """A run of another mechanism, whose coordinates have other names but for those that are kept."""
    outputs = tuple(name if name in kept else CoordinateName(f"other_{name.owner}", name.axis) for name in run.outputs)
    return dataclasses.replace(run, outputs=outputs, mechanism_source="", info={})


def test_a_comparison_states_what_runs_of_two_mechanisms_have_in_common(run: Run, tmp_path: Path) -> None:
    assert in_common(run, run) == ""
    none = "A and B have no coordinates in common, so there are no differences to show"
    assert in_common(run, renamed(run)) == none
    part = renamed(run, "crank.phi", "A.x")
    some = "A and B have 2 of 7 and 7 coordinates in common, whose differences are shown: crank.phi, A.x"
    assert in_common(run, part) == some
    more = dataclasses.replace(run, outputs=(*run.outputs[:-1], CoordinateName("B", "y")))
    assert in_common(run, more, ("a.mcap", "b.mcap")) == (
        "a.mcap and b.mcap have 6 of 7 and 7 coordinates in common, whose differences are shown: "
        f"{', '.join(run.outputs[:-1])}"
    )
    wide = [dataclasses.replace(run, outputs=(*map(str, range(7)), last)) for last in ("a", "b")]
    assert in_common(wide[0], wide[1]).endswith(": 0, 1, 2, 3, 4, 5, ...")
    for other, line in ((renamed(run), none), (part, some)):
        write_comparison(run, other, tmp_path / "compare.rrd")
        (text,) = documents(tmp_path / "compare.rrd", "/card")
        assert f"\n{line}.\n".replace("_", r"\_") in text


def test_runs_in_different_units_are_not_compared(run: Run, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="lengths in m and mm; they need the same unit"):
        write_comparison(run, dataclasses.replace(run, length_unit="mm"), tmp_path / "compare.rrd")
