"""Advance: the branch is kept, limits are found, every way ends."""

from __future__ import annotations

import cmath
import math
import random
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    AngleDriver,
    Body,
    ConstantSpeed,
    Distance,
    DistanceDriver,
    Mechanism,
    PointOnLine,
    Revolute,
    Translational,
)
from kinfmu.codegen.python import load_model
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Pose, Solver, Status, singularity_map
from kinfmu.solver.python.trusted_step import trusted_step
from tests import oracle
from tests.mechanisms import PINS, slider_crank, tight_jaw, with_arm
from tests.reports import unwrapped
from tests.solver.change_points import fourbar

Errors = Callable[[Solver, Pose], list[float]]


@pytest.mark.parametrize("seed", range(12))
def test_branch_is_kept_over_random_grids_there_and_back(fourbar: Solver, errors: Errors, seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311  # a grid, not a secret
    pose, u, h = fourbar.anchor, 0.5, 10.0 ** rng.uniform(-1.0, 0.7)
    places: list[float] = []
    while abs(u) < 15.0 and len(places) < 60:
        places.append(u)
        u += rng.uniform(0.5, 1.5) * h
    for u in (*places, *reversed(places)):
        pose = fourbar.solve(pose, (u,))
        assert pose.good
        q, qd, qdd = errors(fourbar, pose)
        assert (q < 1e-13, qd < 1e-11, qdd < 1e-9) == (True, True, True)


@pytest.mark.parametrize(("target", "limit"), [(7.0, 2.0 * math.pi), (3.0, math.pi)])
def test_limit_is_located_and_named_and_can_be_left_again(pendulum: Solver, target: float, limit: float) -> None:
    beyond = pendulum.solve(pendulum.anchor, (target,))
    assert beyond.status == Status.OUTSIDE
    assert not beyond.good
    assert "cannot be reached: the limit is" in beyond.message
    located = float(beyond.message.split("the limit is ")[1].split(" = ")[1].split()[0])
    assert located == pytest.approx(limit, abs=1e-10)
    back = pendulum.solve(pendulum.anchor, (5.0,))
    assert back.good
    assert back.z == pytest.approx((2.0 * math.pi + math.asin(-1.0 - math.sin(5.0)),), abs=1e-13)


def test_a_value_too_far_away_is_refused_at_once(fourbar: Solver) -> None:
    pose = fourbar.solve(fourbar.anchor, (1e300,))
    assert pose.status == Status.OUTSIDE
    assert "is too far from" in pose.message


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_driver_value_that_is_not_finite_is_outside(fourbar: Solver, value: float) -> None:
    assert fourbar.solve(fourbar.anchor, (value,)).status == Status.OUTSIDE


def test_same_value_is_the_same_pose(fourbar: Solver) -> None:
    pose = fourbar.solve(fourbar.anchor, (2.0,))
    assert fourbar.solve(pose, (2.0,)) is pose


def test_result_is_a_function_of_the_start_pose_alone(fourbar: Solver) -> None:
    start = fourbar.solve(fourbar.anchor, (2.5,))
    first = fourbar.solve(start, (9.0,))
    for trial in (3.2, 40.0, -7.0):
        fourbar.solve(start, (trial,))
    assert fourbar.solve(start, (9.0,)).z == first.z


def test_from_a_pose_at_the_limit_nothing_beyond_it_is_reached_and_all_before_it_is(pendulum: Solver) -> None:
    pose = pendulum.anchor
    for k in range(1, 5):
        pose = pendulum.solve(pose, (math.radians(300.0 + 15.0 * k),))
    assert pose.status == Status.NEAR_SINGULAR
    beyond = pendulum.solve(pose, (math.radians(375.0),))
    assert beyond.status == Status.OUTSIDE
    assert "the limit is" in beyond.message


@pytest.mark.parametrize("step", [0.25, 3.0, 20.0, 60.0])
def test_a_crossing_3_mm_before_a_dead_centre_is_bridged_there_and_back(step: float) -> None:
    """The gripper's parallelograms cross their other branch at 51.22 mm; its bell cranks and rods are in line at 54.54.

    crank = angle of R - 90 deg where |R| = 20, |R - (-25, y)| = 40
    """
    crossing, dead_centre = math.sqrt(40.0**2 - 25.0**2) + 20.0, math.sqrt(60.0**2 - 25.0**2)
    up = np.arange(-44.0, dead_centre, step)
    piston = np.concatenate([up, [54.5, crossing, 54.0, crossing + 1e-9], up[::-1]])
    run = kinfmu.solve(kinfmu.load("parallel_jaw"), piston_position=piston)
    assert run.good.all()
    for name in ("right_jaw.phi", "right_jaw.omega", "left_jaw.phi", "left_jaw.omega"):
        np.testing.assert_allclose(run[name], 0.0, rtol=0, atol=1e-10)
    assert np.abs(run["right_jaw.alpha"]).max() < 1e-7
    distance = np.hypot(25.0, piston)
    apart = np.arccos((distance**2 + 20.0**2 - 40.0**2) / (2.0 * 20.0 * distance))
    crank = np.arctan2(piston, -25.0) - apart - np.pi / 2.0
    off = np.remainder(run["right_crank.phi"] - crank + np.pi, 2.0 * np.pi) - np.pi
    np.testing.assert_allclose(off, 0.0, rtol=0, atol=1e-11)
    beyond = kinfmu.solve(kinfmu.load("parallel_jaw"), piston_position=[53.0, dead_centre + 1e-6])
    assert beyond.good.tolist() == [True, False]


def test_a_crossing_too_near_a_dead_centre_is_a_limit() -> None:
    piston = np.arange(-44.0, 54.6, 0.25)
    run = kinfmu.solve(tight_jaw(), piston_position=piston)
    assert run.good[piston < 54.25].all()
    np.testing.assert_allclose(run["right_jaw.phi"][run.good], 0.0, rtol=0, atol=1e-9)
    assert (run.status[piston > 54.3] == Status.OUTSIDE).all()
    assert re.search(r"the limit is piston = 54\.2863\d* mm, where branches of \w+\.phi cross$", run.events[0].text)


@pytest.mark.parametrize("degrees", [24.5, 24.6, 24.61, 24.618])
@pytest.mark.few(2)
def test_a_crossing_without_room_for_a_bridge_is_reported_as_one(degrees: float) -> None:
    """The crossing comes as close as 3e-8 mm to the dead centre, where the rods and the cranks are in line."""
    turn = math.radians(degrees)
    run = kinfmu.solve(tight_jaw((-20.0 * math.sin(turn), 20.0 * math.cos(turn))), piston_position=[50.0, 56.0])
    assert run.status.tolist() == [Status.OK, Status.OUTSIDE]
    assert re.search(r"the limit is piston = 54\.5\d* mm, where branches of \w+\.phi cross$", run.events[0].text)


def test_prediction_far_off_does_not_land_a_turn_away() -> None:
    # near a limit the rod turns ever faster than the crank: one long step back once took it round
    mechanism = slider_crank(1.78, 1.086, -0.796, start=0.11)
    run = kinfmu.solve(mechanism, crank_angle=[0.15220722892189027, -3.2256017379760742])
    steps = kinfmu.solve(mechanism, crank_angle=np.linspace(0.15220722892189027, -3.2256017379760742, 1000))
    assert run.good.all()
    assert steps.good.all()
    assert run["rod.phi"][1] == pytest.approx(steps["rod.phi"][-1], abs=1e-12)


# ------------------------------------------------------------------------------------------ dead centres, to the digit


DEAD_CENTRE = oracle.mp.acos(oracle.mp.mpf(1) / 13)  # 65^2 + 100^2 - 2 65 100 cos u = (50 + 65)^2


@pytest.fixture(scope="module")
def rocker() -> Solver:
    return Solver(load_model(compile_plan(kinfmu.load("triple_rocker"))))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_limit_of_a_triple_rocker_is_exact_from_every_start(rocker: Solver, side: float) -> None:
    rng = random.Random(3)  # noqa: S311  # samples, not secrets
    limit = side * float(DEAD_CENTRE)
    for _ in range(100):
        near = rng.choice([rng.uniform(-0.9, 0.9), 1.0 - 10.0 ** rng.uniform(-12.0, -1.0)])
        start = rocker.solve(rocker.anchor, (limit * near,))
        assert start.good
        beyond = rocker.solve(start, (limit + side * 10.0 ** rng.uniform(-9.0, 1.0),))
        assert beyond.status == Status.OUTSIDE
        located = float(beyond.message.split("the limit is left = ")[1].split()[0])
        assert abs(located - side * DEAD_CENTRE) <= 1e-10
        assert "the loop of coupler.phi, right.phi cannot close" in beyond.message


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_before_a_limit_samples_are_right_within_their_estimate_in_every_order(side: float) -> None:
    names = ("left.phi", "coupler.phi", "right.phi")
    for powers in (range(3, 13), range(12, 2, -1), (12, 3, 11, 4, 12, 7)):
        u = [side * float(DEAD_CENTRE) * (1.0 - 10.0**-k) for k in powers]
        run = kinfmu.solve(kinfmu.load("triple_rocker"), left_angle=u)
        assert run.good.all()
        exact = oracle.fourbar("100", "65", "50", "65", u)
        columns = [run.outputs.index(name) for name in names]
        for order, table in enumerate((run.values, run.rates, run.accelerations)):
            for row, truth, estimate in zip(table[:, columns], exact[order], run.error[:, order], strict=True):
                assert oracle.largest_error(row, truth, modulo_turns=order == 0) <= max(estimate, 1e-12)


def test_a_run_is_never_poisoned_by_samples_outside() -> None:
    limit = float(DEAD_CENTRE)
    rng = random.Random(5)  # noqa: S311  # samples, not secrets
    u = [rng.choice([1.0, 1.6]) * rng.uniform(-1.0, 1.0) * limit for _ in range(300)]
    run = kinfmu.solve(kinfmu.load("triple_rocker"), left_angle=u)
    np.testing.assert_array_equal(run.good, np.abs(u) < limit)
    good = [value for value, fine in zip(u, run.good, strict=True) if fine]
    exact = oracle.fourbar("100", "65", "50", "65", good)
    columns = [run.outputs.index(name) for name in ("left.phi", "coupler.phi", "right.phi")]
    errors = run.values[run.good][:, columns] - exact.q.astype(float)
    np.testing.assert_allclose(np.remainder(errors + 3.0, 2.0 * math.pi) - 3.0, 0.0, rtol=0, atol=1e-11)


# --------------------------------------------------------------------------------------------------- several drivers


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("lengths", [("4", "1", "3", "2"), ("2", "1", "2", "1")])
@pytest.mark.few(2)
def test_a_crossing_that_depends_on_one_driver_is_bridged_for_all_values_of_the_others(
    lengths: tuple[str, str, str, str], branch: int
) -> None:
    case = fourbar(*lengths, branch=branch)
    mechanism = with_arm(case.mechanism)
    rng = random.Random(branch)  # noqa: S311  # samples, not secrets
    for _ in range(6):
        step = 10.0 ** rng.uniform(-2.0, 0.5)
        u = [1.0]
        for k in range(80):
            u.append(u[-1] + rng.uniform(0.5, 1.5) * (step if k < 50 else -step))
        arm = [rng.uniform(0.0, 1.0) for _ in u]
        run = kinfmu.solve(mechanism, crank_angle=u, arm_angle=arm, arm_speed=0.0)
        assert set(run.status.tolist()) <= {Status.OK, Status.BRIDGED}
        exact = case.motion(np.array(u, dtype=np.longdouble))
        for name, columns in exact.items():
            for order, table in enumerate((run.values, run.rates, run.accelerations)):
                gap = np.abs(table[:, run.outputs.index(name)] - columns[order].astype(float))
                assert (gap[run.good] <= np.maximum(run.error[run.good, order], 1e-11)).all()


# ---------------------------------------------------------------------------------------------------------- poles


def lever(offset: float, turn: float, start: float = 1.0, unit: float = 1.0, *, has_shoe: bool = False) -> Mechanism:
    """A lever about (0, 0) whose slot, `offset` off the pivot, moves a block on y = unit, all turned by `turn`.

    The block is at x = (cos phi - offset) / sin phi, which has poles at every half turn of the lever.
    """

    def world(x: float, y: float) -> tuple[float, float]:
        at = cmath.rect(1.0, turn) * complex(x, y) * unit
        return at.real, at.imag

    at = world((math.cos(start) - offset) / math.sin(start), 1.0)
    bodies = [
        Body("ground", {"O": (0, 0), "way": world(0, 1)}),
        Body("lever", {"O": (0, 0), "slot": (0, offset * unit)}, (0, 0, start + turn)),
        Body("block", {"S": (0, 0)}, (*at, turn)),
    ]
    joints: list[Joint] = [
        Revolute("O", ("ground.O", "lever.O")),
        Translational("way", ("ground.way", "block.S"), turn, turn),
    ]
    if has_shoe:
        bodies.append(Body("shoe", {"S": (0, 0)}, (*at, start + turn)))
        joints += [Revolute("S", ("block.S", "shoe.S")), Translational("slot", ("lever.slot", "shoe.S"))]
    else:
        joints.append(PointOnLine("slot", ("lever.slot", "block.S")))
    return Mechanism("lever", bodies, joints, [AngleDriver("drive", "lever", ConstantSpeed(start + turn, 1.0))])


LEVERS = [
    (offset, turn, unit, has_shoe)
    for offset in (0.0, 0.3, -0.9)
    for turn in (0.0, 0.7, math.pi / 2)
    for unit, has_shoe in ((1.0, False), (1e-3, True))
]


@pytest.mark.parametrize("target", [math.pi, math.pi + 1e-9, 9.0, -1.5])
@pytest.mark.parametrize(("offset", "turn", "unit", "has_shoe"), LEVERS)
@pytest.mark.few(13)
def test_beyond_a_pole_a_path_ends_early_with_the_pole_and_what_runs_to_infinity(
    monkeypatch: pytest.MonkeyPatch, offset: float, turn: float, unit: float, has_shoe: bool, target: float
) -> None:
    solver = Solver(load_model(compile_plan(lever(offset, turn, 1.0, unit, has_shoe=has_shoe))))
    steps = 0

    def counted(*arguments: Any) -> Pose | None:
        nonlocal steps
        steps += 1
        return trusted_step(*arguments)

    monkeypatch.setattr("kinfmu.solver.python.advance.trusted_step", counted)
    pose = solver.solve(solver.anchor, (target + turn,))
    assert pose.status == Status.OUTSIDE
    assert steps < 1000
    assert pose.message.endswith(" runs to infinity")
    pole = turn + (math.pi if target > 1.0 else 0.0)
    located = float(re.findall(r"drive = (\S+) rad", pose.message)[-1])
    assert located == pytest.approx(pole, abs=2e-9 if abs(target + turn - pole) < 1e-8 else 1e-10)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize(("offset", "turn", "unit", "has_shoe"), LEVERS[::3])
@pytest.mark.few(1)
def test_toward_a_pole_samples_up_to_10_000_sizes_away_are_right(
    engine: str, offset: float, turn: float, unit: float, has_shoe: bool
) -> None:
    before = math.pi - np.geomspace(2.0, 1e-4, 30)
    angles = np.concatenate([before, [math.pi, 3.5, 5.0], before[::-1]])
    run = kinfmu.solve(lever(offset, turn, 1.0, unit, has_shoe=has_shoe), engine=engine, drive_angle=turn + angles)
    good = np.array([*[True] * 30, *[False] * 3, *[True] * 30])
    np.testing.assert_array_equal(run.good, good)
    exact = unit * (np.cos(angles) - offset)[good] / np.sin(angles)[good]
    along = np.cos(turn) * run["block.x"] + np.sin(turn) * run["block.y"]
    np.testing.assert_allclose(along[good], exact, rtol=1e-11)
    assert all(event.text.endswith(" runs to infinity") for event in run.events if "cannot be reached" in event.text)
    assert any("runs to infinity" in event.text for event in run.events)


def test_check_calls_a_pole_no_dead_centre() -> None:
    report = kinfmu.check(lever(0.3, 0.0))
    assert [(limit.value, limit.kind, limit.bodies) for limit in report.ranges[0].limits] == [
        (pytest.approx(0.0, abs=1e-10), "pole", ()),
        (pytest.approx(math.pi, abs=1e-10), "pole", ()),
    ]
    assert "from 0 deg to 180 deg; a slide runs to infinity at both ends" in unwrapped(report)


def crossing_lines(moved_by: str, *, has_shoes: bool = False, is_whole: bool = True) -> Mechanism:
    """Two arms, about (0, 0) and (1, 0), with slots that a pin slides in: where they are parallel it is at infinity.

    moved_by: what moves the left arm: its own driver, the crank of a four-bar, that of a parallelogram or a cylinder.
    is_whole: with pin and right arm.
    """
    start = 2.5 if moved_by == "parallelogram" else 1.2
    other = start + 1.0
    pin = cmath.rect(math.sin(other) / math.sin(other - start), start)
    bodies = [Body("left", {"O": (0, 0), "Q": (0.8, 0)}, (0, 0, start))]
    joints: list[Joint] = [Revolute("O", ("ground.O", "left.O"))]
    crank = 1.0 if moved_by == "rocker" else start
    end, top = cmath.rect(0.5 if moved_by == "rocker" else 0.8, crank) - 3.0, cmath.rect(0.8, start)
    driver: Driver = AngleDriver("drive", "crank", ConstantSpeed(crank, 1.0))
    if moved_by == "driver":
        driver = AngleDriver("drive", "left", ConstantSpeed(start, 1.0))
    elif moved_by == "cylinder":
        driver = DistanceDriver("drive", ("ground.M", "left.Q"), ConstantSpeed(abs(top + 1.0 + 0.3j), 1.0))
    else:
        bodies += [
            Body("crank", {"A": (0, 0), "P": (abs(end + 3.0), 0)}, (-3, 0, crank)),
            Body("rod", {"P": (0, 0), "Q": (abs(top - end), 0)}, (end.real, end.imag, cmath.phase(top - end))),
        ]
        joints += [
            Revolute("A", ("ground.A", "crank.A")),
            Revolute("P", ("crank.P", "rod.P")),
            Revolute("Q", ("rod.Q", "left.Q")),
        ]
    drivers = [driver]
    if is_whole:
        bodies += [
            Body("right", {"C": (0, 0)}, (1, 0, other)),
            Body("pin", {"S": (0, 0)}, (pin.real, pin.imag, start)),
        ]
        joints += [Revolute("C", ("ground.C", "right.C")), Translational("left_slot", ("left.O", "pin.S"))]
        if has_shoes:
            bodies.append(Body("shoe", {"S": (0, 0)}, (pin.real, pin.imag, other)))
            joints += [Revolute("S", ("pin.S", "shoe.S")), Translational("right_slot", ("right.C", "shoe.S"))]
        else:
            joints.append(PointOnLine("right_slot", ("right.C", "pin.S")))
        drivers.append(AngleDriver("right", "right", ConstantSpeed(other, 1.0)))
    ground = Body("ground", {"O": (0, 0), "C": (1, 0), "A": (-3, 0), "M": (-1, -0.3)})
    return Mechanism("crossing_lines", [ground, *bodies], joints, drivers)


CROSSING_LINES = [
    ("driver", False, (0.3, -1.3)),
    ("driver", True, (0.8, -0.6)),
    ("rocker", False, (0.2, -1.2)),
    ("rocker", True, (-0.2, -1.5)),
    ("rocker", False, (0.0, -1.5)),
    ("cylinder", False, (0.1, -1.5)),
    ("cylinder", True, (-0.2, -1.5)),
    ("parallelogram", False, (1.0, -0.5)),  # beyond the change point of the track
    ("parallelogram", False, (1.0, -0.56)),  # next to it, where the slots almost coincide
]


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize(("moved_by", "has_shoes", "change"), CROSSING_LINES)
@pytest.mark.few(5)
def test_a_pole_that_depends_on_two_drivers_ends_a_path_early(
    monkeypatch: pytest.MonkeyPatch, engine: str, moved_by: str, has_shoes: bool, change: tuple[float, float]
) -> None:
    """Oracle: bisection of the angle between the slots, without a pin."""
    bare = Solver(load_model(compile_plan(crossing_lines(moved_by, is_whole=False))))
    plan = compile_plan(crossing_lines(moved_by, has_shoes=has_shoes))
    solver = Solver(load_model(plan))
    start = solver.anchor.u

    def between(part: float) -> float:
        pose = bare.solve(bare.anchor, (start[0] + part * change[0],))
        assert pose.good
        left = bare.outputs(pose)[bare.model.OUTPUTS.index("left.phi")]
        return start[1] + part * change[1] - left

    low, high = 0.0, 1.0
    assert between(low) > 0.0 > between(high)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if between(middle) > 0.0 else (low, middle)
    pole = [a + low * d for a, d in zip(start, change, strict=True)]
    steps = 0

    def counted(*arguments: Any) -> Pose | None:
        nonlocal steps
        steps += 1
        return trusted_step(*arguments)

    for module in ("advance", "tracks"):
        monkeypatch.setattr(f"kinfmu.solver.python.{module}.trusted_step", counted)
    values = [[a, a + 0.9 * low * d, a + d] for a, d in zip(start, change, strict=True)]
    names = [driver.inputs[0] for driver in plan.drivers]
    run = kinfmu.solve(plan, engine=engine, **dict(zip(names, values, strict=True)))
    assert run.good.tolist() == [True, True, False]
    assert steps < 5000
    (text,) = [event.text for event in run.events if "cannot be reached" in event.text]
    assert re.search(r", where (pin|shoe)\.[xy] runs to infinity$", text)
    located = [float(re.findall(rf"{driver.name} = (\S+) ", text)[-1]) for driver in plan.drivers]
    assert located == pytest.approx(pole, abs=1e-9)


@pytest.mark.parametrize("moved_by", ["driver", "rocker", "cylinder"])
@pytest.mark.few(1)
def test_check_calls_a_pole_of_two_drivers_no_dead_centre(moved_by: str) -> None:
    report = kinfmu.check(crossing_lines(moved_by))
    (reach,) = [reach for reach in report.ranges if reach.driver == "right"]
    expected = [(pytest.approx(1.2 + turn, abs=1e-10), "pole", ()) for turn in (0.0, math.pi)]
    assert [(limit.value, limit.kind, limit.bodies) for limit in reach.limits] == expected


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_a_dead_centre_of_a_slide_is_no_pole(engine: str) -> None:
    """Before it the block is as fast as before a pole: x = 1.5 cos phi + sqrt(1 - (1.5 sin phi)^2)."""
    mechanism = Mechanism(
        "short_rod",
        [
            Body("ground", {"O": (0, 0), "way": (0, 0)}),
            Body("crank", {"O": (0, 0), "P": (1.5, 0)}, (0, 0, 0.2)),
            Body("block", {"S": (0, 0)}, (2.4, 0, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Translational("slide", ("ground.way", "block.S"), 0.0, 0.0),
            Distance("rod", ("crank.P", "block.S"), 1.0),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(0.2, 1.0))],
    )
    limit = math.asin(2.0 / 3.0)
    run = kinfmu.solve(mechanism, engine=engine, crank_angle=[*(limit - 10.0 ** -np.arange(1.0, 9.0)), limit + 1e-4])
    assert run.good.tolist() == [True] * 8 + [False]
    (text,) = [event.text for event in run.events if "cannot be reached" in event.text]
    assert text.endswith(
        "the limit is crank = 0.7297276562 rad (41.8103149 deg); beyond it the loop of block.x cannot close"
    )


def test_a_determinant_that_stays_low_is_not_searched_again_in_every_short_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    searched: list[float] = []

    def counted(model: Any, pose: Pose, block: int, distance: float) -> Pose | None:
        searched.append(pose.u[0])
        return nearby(model, pose, block, distance)

    nearby = singularity_map._nearby
    monkeypatch.setattr(singularity_map, "_nearby", counted)
    flat = Mechanism(
        "flat",
        [
            Body("ground", {"O": (0, 0), "C": (2, 0)}),
            Body("crank", {"O": (0, 0), "P": (0.002, 0)}, (0, 0, 1.0)),
            Body("coupler", {"P": (0, 0), "Q": (1, 0)}, (0, 0, 0.09)),
            Body("rocker", {"C": (0, 0), "Q": (1.006, 0)}, (2, 0, 3.05)),
        ],
        [*PINS],
        [AngleDriver("crank", "crank", ConstantSpeed(1.0, 1.0))],
    )
    run = kinfmu.solve(flat, np.arange(100) * 1e-4, engine="python")
    assert (run.status == 0).all()
    assert len(searched) <= 2
