"""Redundant rows that carry a mechanism where the kept rows alone would be singular."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Distance, Mechanism, Revolute
from kinfmu.errors import InconsistentError
from kinfmu.plan import SolvePlan, compile_plan
from tests.mechanisms import reference_fourbar, wheels, with_open_lengths
from tests.stress.trial import trial

QUARTER = math.pi / 2
LOCOMOTIVE = {"A": (0, 1, 0.0), "B": (0, 1, QUARTER)}
IN_LINE = {"A": (0, 1, 0.0), "B": (0, 1, math.pi)}
ROW = {f"{name}{k}": (k, k + 1, turn + 0.035 * k) for k in range(3) for name, turn in (("A", 0.0), ("B", QUARTER))}
PAIRS = {  # twelve, each 2 degrees further than the one before
    f"{name}{k}": (k, k + 1, turn + k * math.radians(2.0))
    for k in range(12)
    for name, turn in (("A", 0.0), ("B", QUARTER))
}
# A and C are in their dead centres together: B then carries the last wheel, and nothing the middle one
MIDDLE_LOOSE = {"A": (0, 1, 0.0), "C": (1, 2, 0.0), "B": (0, 2, QUARTER)}
ANGLES = np.radians(np.arange(-40.0, 400.0, 2.5))
AT_ENDS = np.array([k * math.pi + off for k in (0, 1, 2) for off in (-1e-3, -1e-7, 0.0, 1e-12, 1e-5)])


def _tall(plan: SolvePlan) -> list[tuple[int, int]]:
    sizes = [(len(block.residuals), len(block.unknowns)) for block in plan.blocks]
    return [(rows, unknowns) for rows, unknowns in sizes if rows > unknowns]


@pytest.mark.parametrize(("rods", "tall"), [(LOCOMOTIVE, [(4, 3)]), (ROW, 3 * [(4, 3)]), (MIDDLE_LOOSE, [(6, 5)])])
def test_a_rod_that_carries_joins_the_loops_that_it_is_redundant_to(
    rods: dict[str, tuple[int, int, float]], tall: list[tuple[int, int]]
) -> None:
    assert _tall(compile_plan(wheels(rods))) == tall


@pytest.mark.parametrize("mechanism", [reference_fourbar(), kinfmu.load("parallel_jaw"), kinfmu.load("fourbar_chain")])
def test_a_redundant_row_that_is_singular_where_the_others_are_is_only_watched(mechanism: Mechanism) -> None:
    assert _tall(compile_plan(mechanism)) == []


def test_rods_in_line_keep_their_change_points() -> None:
    report = kinfmu.check(wheels(IN_LINE))
    assert [point.kind for point in report.singular] == ["change point", "change point"]


@pytest.mark.parametrize("rods", [LOCOMOTIVE, ROW])
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("second", [False, pytest.param(True, marks=pytest.mark.long)])
@pytest.mark.few(2)
def test_coupled_wheels_turn_by_equal_angles(
    rods: dict[str, tuple[int, int, float]], engine: str, second: bool
) -> None:
    """Closed form: every wheel turns as the first, every rod stays parallel to itself."""
    angles = np.concatenate([ANGLES, AT_ENDS])
    inputs = {"crank_angle": angles, "crank_speed": 2.0, "crank_acceleration": -3.0}
    inputs |= {"arm_angle": 0.3 * angles} if second else {}
    run = kinfmu.solve(wheels(rods, second=second), engine=engine, **inputs)
    assert (run.status == 0).all()
    assert run.margin.min() > 0.2
    for name in run.names:
        body, _, axis = name.partition(".")
        if axis == "phi" and body != "arm":
            turns = body.startswith("wheel")
            assert run[name] == pytest.approx(angles if turns else 0.0 * angles, abs=1e-14)
            assert run[f"{body}.omega"] == pytest.approx(2.0 if turns else 0.0, abs=1e-13)
            assert run[f"{body}.alpha"] == pytest.approx(-3.0 if turns else 0.0, abs=1e-12)


def mismatched(longer: float) -> Mechanism:
    """Two wheels, the second rod of which is longer than the first."""
    plain = wheels(LOCOMOTIVE)
    rod = next(body for body in plain.bodies if body.name == "rodB")
    changed = replace(rod, points={"PB": (0.0, 0.0), "QB": (2.0 + longer, 0.0)})
    return replace(plain, bodies=tuple(changed if body is rod else body for body in plain.bodies))


@pytest.mark.parametrize("longer", [1e-13, -3e-13, 1e-12, -2e-12, 4e-12])
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(3)
def test_a_mismatch_that_counts_as_consistent_moves_coupled_wheels_by_as_little(engine: str, longer: float) -> None:
    """A rod turns its wheel by its mismatch over the pin's distance, 0.5, from the line of centres; within 45 deg."""
    run = kinfmu.solve(mismatched(longer), engine=engine, crank_angle=np.concatenate([ANGLES, AT_ENDS]))
    assert (run.status == 0).all()
    assert np.abs(run["wheel1.phi"] - run["wheel0.phi"]).max() <= 2.0 * math.sqrt(2.0) * abs(longer) + 1e-14
    assert run["wheel1.omega"] == pytest.approx(1.0, abs=10.0 * abs(longer) + 1e-13)


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])
@pytest.mark.few(1)
def test_fmus_of_coupled_wheels_with_a_mismatch_turn(tmp_path: Path, flavour: str, fmi: int) -> None:
    fmu = kinfmu.build(mismatched(2e-12), tmp_path / "wheels.fmu", flavour=flavour, fmi=fmi)
    run = kinfmu.simulate(fmu, stop=6.5, step=0.05)
    assert (run.status == 0).all()
    assert run["wheel1.phi"] == pytest.approx(run["wheel0.phi"], abs=1e-11)


def test_a_larger_mismatch_is_refused_with_its_gap() -> None:
    with pytest.raises(InconsistentError, match=r"does not close: gap .*e-1[01] m in every pose"):
        compile_plan(mismatched(1e-10))


@pytest.mark.long
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("second", [False, True])
def test_twelve_pairs_of_rods_out_of_phase_are_regular_at_every_angle(engine: str, second: bool) -> None:
    """Among the angles are the dead centres of the first pairs."""
    angles = np.radians(np.arange(-10.0, 370.0, 10.0))
    inputs = {"crank_angle": angles, "crank_speed": 2.0, "crank_acceleration": -3.0}
    run = kinfmu.solve(
        wheels(PAIRS, second=second), engine=engine, **inputs | ({"arm_angle": -angles} if second else {})
    )
    assert (run.status == 0).all()
    assert run.margin.min() > 0.2
    for k in range(13):
        assert run[f"wheel{k}.phi"] == pytest.approx(angles, abs=1e-13)
        assert run[f"wheel{k}.alpha"] == pytest.approx(-3.0, abs=1e-12)


def test_check_sees_no_singular_point_where_the_second_rod_carries() -> None:
    assert kinfmu.check(wheels(LOCOMOTIVE)).singular == ()


@pytest.mark.parametrize("start", [0.0, math.pi, -0.25 * math.pi])
def test_a_start_in_the_dead_centre_of_one_rod_is_an_ordinary_start(start: float) -> None:
    run = kinfmu.solve(wheels(LOCOMOTIVE, start=start), crank_angle=start + np.linspace(0.0, 6.3, 64))
    assert (run.status == 0).all()
    assert run["wheel1.phi"] == pytest.approx(run["wheel0.phi"], abs=1e-14)


@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_crossing_of_a_block_with_a_companion_is_bridged(engine: str) -> None:
    """Its determinant has no sign: that steps do not pass over it unseen is judged by the columns' orientation."""
    run = kinfmu.solve(wheels(MIDDLE_LOOSE), engine=engine, crank_angle=ANGLES)
    assert set(run.status.tolist()) == {0, 2}
    assert run["wheel1.phi"] == pytest.approx(ANGLES, abs=1e-12)
    assert run["wheel1.omega"] == pytest.approx(1.0, abs=1e-10)
    there_and_back = kinfmu.solve(wheels(MIDDLE_LOOSE), engine=engine, crank_angle=[0.5, 5.9, 3.2, -1.0, math.pi, 0.5])
    assert there_and_back["wheel1.phi"] == pytest.approx(there_and_back["wheel0.phi"], abs=1e-12)


def test_check_names_the_crossing_of_a_block_with_a_companion() -> None:
    points = kinfmu.check(wheels(MIDDLE_LOOSE)).singular
    assert [point.kind for point in points] == ["change point", "change point"]
    assert [point.value for point in points] == pytest.approx(
        [math.pi, math.tau], abs=1e-9
    )  # within a turn from the start


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])
@pytest.mark.few(1)
def test_fmus_of_coupled_wheels_are_regular_at_every_angle(tmp_path: Path, flavour: str, fmi: int) -> None:
    fmu = kinfmu.build(wheels(LOCOMOTIVE), tmp_path / "wheels.fmu", flavour=flavour, fmi=fmi)
    run = kinfmu.simulate(fmu, stop=6.5, step=0.05)
    assert (run.status == 0).all()
    assert run["wheel1.phi"] == pytest.approx(run["wheel0.phi"], abs=1e-14)
    assert run["wheel1.alpha"] == pytest.approx(0.0, abs=1e-12)


def test_what_a_row_of_a_joined_block_meets_is_computed_before_it() -> None:
    """A bar on the ground whose pivot has lengths: its y follows from its angle, which the joined block solves."""
    mechanism = with_open_lengths(trial(26, "redundant parallelograms").drawn.mechanism)
    plan = compile_plan(mechanism)
    (block,) = [block for block in plan.blocks if len(block.residuals) > len(block.unknowns)]
    assert "bar.y" in dict(block.assigned)
    for engine in ("python", "native"):
        run = kinfmu.compile(mechanism, engine=engine).solve(drive_angle=np.linspace(0.0, 6.0, 40))
        assert run.good.all()
        np.testing.assert_allclose(run["bar.phi"], run["crank.phi"], atol=1e-12)


class Stage(NamedTuple):
    """A table on a driven crank and legs as long as it, with these pins: in capitals distances, the others bodies."""

    crank: float
    start: float
    legs: dict[str, tuple[float, float]]


def tables(*stages: Stage) -> Mechanism:
    """Tables, each on the one below; none of them turns."""
    points: dict[str, dict[str, tuple[float, float]]] = {"ground": {}}
    poses, x, y = dict[str, tuple[float, float, float]](), 0.0, 0.0
    pins, bars, drivers = list[Revolute](), list[Distance](), list[AngleDriver]()
    for k, (crank, start, legs) in enumerate(stages):
        below, table = f"table{k - 1}" if k else "ground", f"table{k}"
        points[table] = {}
        for name, pin in {"crank": (0.0, 0.0), **legs}.items():
            leg = f"{name}{k}"
            points[below][leg] = points[table][leg] = pin
            if name.isupper():
                bars.append(Distance(leg, (f"{below}.{leg}", f"{table}.{leg}"), crank))
                continue
            points[leg], poses[leg] = {"a": (0, 0), "b": (crank, 0)}, (x + pin[0], y + pin[1], start)
            pins += [
                Revolute(f"{leg}{end}", (f"{on}.{leg}", f"{leg}.{end}")) for end, on in (("a", below), ("b", table))
            ]
        x, y = x + crank * math.cos(start), y + crank * math.sin(start)
        poses[table] = (x, y, 0.0)
        drivers.append(AngleDriver(f"drive{k}", f"crank{k}", ConstantSpeed(start, 1.0)))
    bodies = [Body(name, own, poses.get(name, (None, None, None))) for name, own in points.items()]
    return Mechanism("tables", bodies, [*pins, *bars], drivers)


STACKS = [
    (Stage(0.258, 5.87, {"B": (-1.46, 0)}), Stage(0.262, 3.64, {"B": (-0.637, 0), "c": (-0.965, 1.657)})),
    (Stage(0.23, 4.95, {"b": (1.609, 0)}), Stage(0.847, 0.92, {"B": (0.764, 0), "c": (1.402, 0.58)})),
    (
        Stage(0.641, 5.94, {"B": (0, 0.357), "C": (0, -0.1785)}),
        Stage(0.211, 6.05, {"b": (0, 1.968), "C": (-0.833, -0.434)}),
    ),
]


@pytest.mark.parametrize("stages", STACKS)
def test_a_row_joins_no_block_whose_rows_have_no_part_in_it(stages: tuple[Stage, ...]) -> None:
    """The table below is singular where its legs are in line, whatever carries the table on it."""
    plan = compile_plan(tables(*stages))
    assert _tall(plan) == [(3, 2)]
    (alone,) = [block for block in plan.blocks if "table0.phi" in block.unknowns]
    assert "table1.phi" not in alone.coordinates


@pytest.mark.parametrize("stages", STACKS)
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(2)
def test_a_carried_table_passes_the_change_points_of_the_table_below(stages: tuple[Stage, ...], engine: str) -> None:
    angles = np.concatenate([ANGLES, AT_ENDS])
    run = kinfmu.solve(tables(*stages), engine=engine, drive0_angle=angles, drive1_angle=1.7 * angles)
    assert set(run.status.tolist()) <= {0, 1, 2}
    x = 0.0
    for k, (stage, factor) in enumerate(zip(stages, (1.0, 1.7), strict=True)):
        x = x + stage.crank * np.cos(factor * angles)
        assert run[f"table{k}.phi"] == pytest.approx(0.0 * angles, abs=1e-12)
        assert run[f"table{k}.x"] == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize("far", [3.0, -12.0, 40.0])
def test_a_row_that_is_singular_where_the_others_are_carries_nothing_however_long_its_lever(far: float) -> None:
    assert _tall(compile_plan(tables(Stage(0.25, 5.87, {"b": (1.0, 0.0), "C": (far, 0.0)})))) == []


@pytest.mark.parametrize("seed", [10111, 10113, 10213, 10615, 10689, 11072])
@pytest.mark.few(2)
def test_a_table_on_a_table_is_carried_through_the_whole_turn_of_its_crank(seed: int) -> None:
    """Its legs are singular in turn, far from the start poses."""
    assert trial(seed, "translating tables").judged().faults == []
