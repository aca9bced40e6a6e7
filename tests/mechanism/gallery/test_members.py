"""Every mechanism of the gallery: its folder is complete, and every engine and FMU agrees with the reference."""

from __future__ import annotations

import csv
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Distance, Mechanism, Revolute, Run
from kinfmu.mechanism import gallery
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement
from tests.gallery_members import mostly_long
from tests.mechanism.gallery.conftest import Member
from tests.mechanism.gallery.reference_file import row, samples
from tests.mechanism.gallery.references import REFERENCES
from tests.oracle import mp

AGREEMENT = 1e-11  # of a column's largest magnitude
FORCES_AGREE = 1e-11  # of a column's largest magnitude; of the largest reaction, if a column is zero
CLOSURE = 1e-12  # of the size

every_member = pytest.mark.parametrize("name", gallery.names())
few_members = pytest.mark.parametrize("name", mostly_long(gallery.names()))
fewest_members = pytest.mark.parametrize(
    "name", mostly_long(gallery.names(), few=("cam_roller", "excavator_loaded", "fourbar", "geared_five_bar"))
)


def test_every_mechanism_has_a_reference_and_every_reference_a_mechanism() -> None:
    assert sorted(REFERENCES) == gallery.names()
    assert len(gallery.names()) >= 16


@every_member
def test_the_folder_names_the_mechanism(name: str) -> None:
    page = (gallery.folder() / name / "README.md").read_text(encoding="utf-8")
    assert page.startswith(f"# {gallery.load(name).title}\n\n")
    assert len(page) > 300
    assert (gallery.folder() / name / "figure.svg").is_file(), "scripts/pictures draws it"


@every_member
@pytest.mark.few(7)
def test_the_reference_holds_samples_of_the_run_and_every_output(name: str, member: Callable[[str], Member]) -> None:
    asked = member(name)
    run = kinfmu.solve(asked.plan, asked.times[:1])
    columns = [column.name for column in run.columns()]
    first = 1 + len(run.input_names)
    motion = ["time", *columns[first : first + 3 * len(run.outputs)]]
    assert list(asked.reference[0])[: len(motion)] == motion
    forces = list(asked.reference[0])[len(motion) :]
    drivers = {driver.name for driver in asked.mechanism.drivers}
    efforts = [name for name in run.force_names if name.owner in drivers and name.noun in {"torque", "force"}]
    assert sorted(forces) == sorted([*efforts, *run.reaction_names, "kinetic_energy"] if asked.has_forces else [])
    assert 15 <= len(asked.reference) <= 25
    grid = kinfmu.run.driving.run_times(asked.mechanism.run)
    assert set(asked.times) <= set(grid.tolist())


@every_member
def test_a_recomputed_row_equals_the_row_of_the_file(name: str, member: Callable[[str], Member]) -> None:
    drawn = random.Random(name).choice(member(name).reference)  # noqa: S311
    assert row(name, float(drawn["time"])) == drawn


@few_members
@pytest.mark.few(1)
def test_check_finds_nothing_wrong_and_a_driver_for_every_freedom(name: str, member: Callable[[str], Member]) -> None:
    report = kinfmu.check(member(name).mechanism)
    assert report.problem is None
    assert report.mobility == len(report.mechanism.drivers)
    assert not report.inconsistent


@every_member
@pytest.mark.few(6)
def test_solved_it_equals_the_reference(name: str, member: Callable[[str], Member]) -> None:
    asked = member(name)
    run = kinfmu.solve(asked.plan, asked.times)
    assert _largest_disagreement(run, asked) <= AGREEMENT
    assert _largest_force_disagreement(run, asked) <= FORCES_AGREE


@few_members
@pytest.mark.few(1)
def test_its_fmu_driven_by_time_equals_the_reference(name: str, member: Callable[[str], Member]) -> None:
    asked, (times, step) = member(name), samples(name)
    run = kinfmu.simulate(asked.fmu("time"), start=times[0], stop=times[-1], step=step)
    assert _largest_disagreement(run, asked) <= AGREEMENT
    assert bool(run.force_names) == asked.has_forces
    assert _largest_force_disagreement(run, asked) <= FORCES_AGREE


@fewest_members
@pytest.mark.few(1)
def test_its_fmu_driven_from_a_csv_equals_the_reference(
    name: str, member: Callable[[str], Member], tmp_path: Path
) -> None:
    asked, (times, step) = member(name), samples(name)
    table = _inputs(asked, tmp_path / "inputs.csv")
    run = kinfmu.simulate(asked.fmu("inputs"), start=times[0], stop=times[-1], step=step, inputs=table)
    assert _largest_disagreement(run, asked) <= AGREEMENT
    assert bool(run.force_names) == asked.has_forces
    assert _largest_force_disagreement(run, asked) <= FORCES_AGREE


@every_member
@pytest.mark.few(17)
def test_no_link_stretches_and_no_joint_opens_over_its_run(name: str, member: Callable[[str], Member]) -> None:
    mechanism, run = member(name).mechanism, kinfmu.solve(member(name).plan)
    assert run.good.all()
    for joint in mechanism.joints:
        assert _largest_gap(joint, mechanism, run) <= CLOSURE * _size(mechanism), joint.name


def _largest_disagreement(run: Run, asked: Member) -> float:
    """Return the largest |ours - reference| of all columns, each relative to its largest magnitude.

    A column of zeros is taken relative to the largest column of its kind, or to 1 if all of that kind are zero.
    """
    np.testing.assert_allclose(run.t, asked.times, rtol=1e-12, atol=1e-12)
    assert run.good.all()
    coordinates = list(asked.reference[0])[1 : 1 + 3 * len(run.outputs)]
    exact = {name: [mp.mpf(sample[name]) for sample in asked.reference] for name in coordinates}
    largest = {name: max(map(abs, column)) for name, column in exact.items()}

    def scale(name: str) -> object:
        same_kind = (value for other, value in largest.items() if _kind(other) == _kind(name))
        return largest[name] or max(same_kind) or 1

    return max(
        float(abs(mp.mpf(float(ours)) - value) / scale(name))
        for name, column in exact.items()
        for ours, value in zip(run[name], column, strict=True)
    )


def _largest_force_disagreement(run: Run, asked: Member) -> float:
    """Return the largest |ours - reference| of all forces, each relative to its largest magnitude."""
    names = [name for name in (*run.force_names, *run.reaction_names) if name in asked.reference[0]]
    exact = {name: np.array([float(sample[name]) for sample in asked.reference]) for name in names}
    usual = max((np.abs(column).max() for column in exact.values()), default=0.0)
    return max(
        (float(np.abs(run[name] - column).max() / (np.abs(column).max() or usual)) for name, column in exact.items()),
        default=0.0,
    )


def _kind(name: str) -> str:
    """Letter of a column, x for both axes: 'ax' of 'crank.ay'."""
    return name.rpartition(".")[2].replace("y", "x")


def _inputs(asked: Member, path: Path) -> Path:
    """A CSV of the drivers' values, speeds and accelerations as the reference has them."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = [name for driver in asked.mechanism.drivers for name in driver.inputs()]
        assert [driver.inputs()[0] for driver in asked.mechanism.drivers] == list(REFERENCES[asked.name].laws)
        writer.writerow(["time", *names])
        for t in asked.times:
            driven = REFERENCES[asked.name].inputs(t).values()
            writer.writerow([repr(t), *(repr(float(mp.factorial(k) * u.c[k])) for u in driven for k in range(3))])
    return path


def _largest_gap(joint: Joint, mechanism: Mechanism, run: Run) -> float:
    """Return the largest gap of a joint over a run; for pins and bars the distance of the joined points."""
    if isinstance(joint, Revolute | Distance):
        (a_x, a_y), (b_x, b_y) = (_point(end, mechanism, run) for end in joint.between)
        length = joint.length if isinstance(joint, Distance) else 0.0
        return float(np.abs(np.hypot(b_x - a_x, b_y - a_y) - length).max())
    return max(abs(gap) for k in range(len(run)) for gap in joint.gaps(joint.residual(_placement(mechanism, run, k))))


def _point(name: str, mechanism: Mechanism, run: Run) -> tuple[np.ndarray, np.ndarray]:
    """World coordinates of 'body.point', (n,) each."""
    owner = name.partition(".")[0]
    s_x, s_y = mechanism.body_points[name]
    if owner == "ground":
        return np.full(len(run), s_x), np.full(len(run), s_y)
    x, y, phi = (run[f"{owner}.{letter}"] for letter in ("x", "y", "phi"))
    return x + np.cos(phi) * s_x - np.sin(phi) * s_y, y + np.sin(phi) * s_x + np.cos(phi) * s_y


def _placement(mechanism: Mechanism, run: Run, k: int) -> Placement:
    poses = {
        body.name: BodyFrame.of(*(float(run[f"{body.name}.{c}"][k]) for c in ("x", "y", "phi")))
        for body in mechanism.moving_bodies
    }
    return Placement({"ground": GROUND, **poses}, mechanism.body_points)


def _size(mechanism: Mechanism) -> float:
    """Return the largest distance of a point from the origin of its body's frame."""
    return max(float(np.hypot(*point)) for point in mechanism.body_points.values())
