"""The solver in C finds what the one in Python finds: the same bits, decisions and messages.

So that even the last bits can be compared, the Python side forms a tangent as velocity and acceleration per unit of the
driver, which the generated Python otherwise simplifies.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.codegen.c import compiler, emit
from kinfmu.codegen.python import load_model, load_module
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.run.driving import run_times
from kinfmu.solver.python import Solver, Status, with_parameters
from kinfmu.solver.python.pose import AT_REST, UNIT_SPEED
from kinfmu.solver.python.span import PLACES, weights
from tests.fmu.test_parameters import geared, linkage
from tests.gallery_members import every_member, mostly_long
from tests.mechanisms import (
    bar_as_body,
    folding_robot,
    fourbar,
    reference_fourbar,
    side_by_side,
    six_bar,
    slider_crank,
    tight_jaw,
    with_robot,
)
from tests.solver.c.native import STRICT, Native
from tests.solver.change_points import fourbar as change_point_fourbar
from tests.solver.change_points import two_loops
from tests.stress.trial import trial

QUICK = (*STRICT, "-O0")  # to compile
Samples = Sequence[tuple[float, ...]]


def solver_of(plan: SolvePlan) -> Solver:
    """A solver in Python whose tangents are formed as in C."""
    model = load_model(plan)
    velocity, acceleration, motion = model.velocity, model.acceleration, model.motion

    def tangent(values: Any) -> Any:
        zd = velocity(values, UNIT_SPEED)
        return zd, acceleration(values, UNIT_SPEED, AT_REST, zd)

    def first_motion(values: Any, ud: Any, udd: Any) -> Any:
        return tangent(values), motion(values, ud, udd, *tangent(values))

    if len(model.DRIVERS) == 1:
        model.tangent, model.first_motion = tangent, first_motion
    return Solver(model)


def assert_same(plan: SolvePlan, samples: Samples, flags: Sequence[str] = QUICK) -> list[int]:
    """Both solvers followed through the samples; the statuses met."""
    python, c = solver_of(plan), Native(plan, flags)
    good, statuses = python.anchor, []
    for u in samples:
        pose, answer = python.solve(good, u), c.solve(u)
        statuses.append(answer.status)
        assert answer.status == pose.status, u
        if not pose.good:
            assert c.message == pose.message
            continue
        assert (answer.z, answer.iterations) == (pose.z, pose.iterations), u
        assert (answer.margin, answer.residual, answer.watch) == (pose.margin, pose.residual, pose.watch), u
        ud, udd = (0.7,) * len(u), (-0.3,) * len(u)
        row, wanted = (
            [value for row in c.motion(ud, udd) for value in row or ()],
            np.array(python.motion(pose, ud, udd)),
        )
        np.testing.assert_allclose(row, wanted, rtol=0, atol=1e-12 * max(np.abs(wanted).max(), 1.0))
        assert c.margin() == pytest.approx(python.margin(pose), rel=1e-12, abs=1e-15)
        if len(statuses) % 4 == 0:
            q, *others = python.errors(pose, ud, udd)  # differences in the last digits, which rates may round otherwise
            assert c.errors(ud, udd) == (pytest.approx(q, rel=1e-9), *(pytest.approx(one, rel=0.3) for one in others))
        good = pose
        c.commit()
    return statuses


@every_member
@pytest.mark.few(1)
def test_c_and_python_are_the_same_over_the_run_of_a_gallery_mechanism(name: str) -> None:
    mechanism = kinfmu.load(name)
    plan = compile_plan(mechanism)
    model = load_model(plan)
    constants = tuple(value for _, value in model.LAW_CONSTANTS)
    times = run_times(mechanism.run)
    assert_same(plan, [tuple(model.drive(t, constants)[0]) for t in times[:: max(1, len(times) // 30)].tolist()])


def wander(middle: float, reach: float, special: Sequence[float], seed: int) -> Samples:
    """Short steps and jumps, back and forth, at special places and near them."""
    rng = random.Random(seed)  # noqa: S311  # samples, not secrets
    samples, u = [], middle
    for _ in range(200):
        kind = rng.random()
        if kind < 0.6:
            u += rng.uniform(-0.02, 0.05) * reach * rng.choice((1.0, 1.0, 1.0, -3.0))
        elif kind < 0.8:
            u = rng.choice(special) + rng.choice((0.0, 0.0, 1e-12, -1e-9, 1e-6, -1e-3, 0.02, -0.04)) * reach
        else:
            u = middle + rng.uniform(-4.0, 4.0) * reach
        samples.append((u,))
    return samples


QUARTERS = [k * math.pi / 2.0 for k in range(-8, 9)]
SINGULAR: dict[str, tuple[Callable[[], Mechanism], Samples, set[Status]]] = {
    "parallelogram with a redundant bar": (
        reference_fourbar, wander(1.0, 3.0, QUARTERS, 1), {Status.OK, Status.BRIDGED}),
    "bar as a body": (bar_as_body, wander(1.0, 3.0, QUARTERS, 2), {Status.OK, Status.BRIDGED}),
    "4-1-3-2": (lambda: fourbar(4, 1, 3, 2), wander(1.0, 3.0, QUARTERS, 3), {Status.OK, Status.BRIDGED}),
    "2-1-2-1": (lambda: fourbar(2, 1, 2, 1), wander(1.0, 3.0, QUARTERS, 4), {Status.OK, Status.BRIDGED}),
    "antiparallelogram": (
        lambda: fourbar(2, 1, 2, 1, branch=-1), wander(1.0, 3.0, QUARTERS, 5), {Status.OK, Status.BRIDGED}),
    "near a change point": (
        lambda: fourbar(4, 1, 3, 2 + 1e-7), wander(1.0, 3.0, QUARTERS, 6), {Status.OK}),
    "slider-crank, crank = rod": (lambda: slider_crank(1.0, 1.0), wander(1.0, 3.0, QUARTERS, 7), {Status.OK}),
    "two loops": (lambda: two_loops(0.12).mechanism, wander(1.0, 3.0, QUARTERS, 14), {Status.OK, Status.BRIDGED}),
    "a block of four": (six_bar, wander(1.6, 0.3, [1.6, 2.0], 15), {Status.OK, Status.OUTSIDE}),
    "triple rocker": (
        lambda: kinfmu.load("triple_rocker"), wander(0.0, 0.8, [math.acos(1 / 13), -math.acos(1 / 13)], 8),
        {Status.OK, Status.OUTSIDE}),
    "double pendulum": (
        lambda: kinfmu.load("double_pendulum"), wander(5.0, 1.0, [math.pi, math.tau], 9), {Status.OK, Status.OUTSIDE}),
    "gripper": (lambda: kinfmu.load("parallel_jaw"), wander(30.0, 15.0, [51.22498, 54.5], 10), {Status.OK}),
    "tight gripper": (tight_jaw, wander(30.0, 15.0, [54.28, 54.2863], 11), {Status.OK}),
}  # fmt: skip


@pytest.mark.parametrize(
    "name",
    mostly_long(
        SINGULAR,
        few=(
            "parallelogram with a redundant bar",
            "antiparallelogram",
            "two loops",
            "double pendulum",
            "tight gripper",
        ),
    ),
)
@pytest.mark.few(1)
def test_c_and_python_are_the_same_near_singular_points_and_limits(name: str) -> None:
    mechanism, samples, expected = SINGULAR[name]
    statuses = assert_same(compile_plan(mechanism()), samples)
    assert expected <= set(statuses)


def test_c_and_python_are_the_same_for_several_drivers_within_and_beyond_reach() -> None:
    plan = compile_plan(kinfmu.load("five_bar"))
    rng = random.Random(13)  # noqa: S311  # samples, not secrets
    u, samples = load_model(plan).ANCHOR[0], []
    for _ in range(200):
        u = tuple(value + rng.choice((0.02, 0.2, 2.0)) * rng.uniform(-1.0, 1.0) for value in u)
        samples.append(u)
    assert {Status.OK, Status.OUTSIDE} <= set(assert_same(plan, samples))


CHANGES: dict[Callable[[], Mechanism], list[dict[str, float]]] = {
    linkage: [
        {},
        {"ground": 4.2, "crank": 1.3, "coupler": 3.1, "rocker": 3.3},
        {"coupler": 9.0},
        {"crank": 2.4},
        {"rocker": 0.6},
        {"crank": 0.0, "rocker": 0.0},
        {"ground": -4.0},
        {"ground": 1e300},
    ],
    geared: [{"rod": 3.6}, {"rod": -3.5}, {"teeth": 0.0}, {"teeth": 31.0}, {"pace": -2.0}, {"pace": 0.0}],
}


@pytest.mark.parametrize("seed", [0, 3])
@pytest.mark.few(1)
def test_c_and_python_are_the_same_where_each_driver_has_singular_points_of_its_own(seed: int) -> None:
    """Two machines in one file, over crossings and to limits of each."""
    mechanism = trial(seed, "two machines").drawn.mechanism
    ways = [wander(driver.law.start, 2.0, [0.0, math.pi], k) for k, driver in enumerate(mechanism.drivers)]
    samples = [tuple(u for (u,) in each) for each in zip(*ways, strict=True)]
    assert {Status.OK, Status.BRIDGED} <= set(assert_same(compile_plan(mechanism), samples))


@pytest.mark.parametrize("carried", [True, pytest.param(False, marks=pytest.mark.long)])
def test_c_and_python_are_the_same_where_blocks_of_one_driver_and_of_several_are_mixed(carried: bool) -> None:
    """Over crossings of one driver, and to crossings of several."""
    machine = change_point_fourbar("4", "1", "3", "2").mechanism
    mechanism = with_robot(machine) if carried else side_by_side(folding_robot(), machine)
    marks = [[0.0, math.pi]] * 3 if carried else [[0.0], [math.pi], [0.0, math.pi]]
    ways = [wander(driver.law.start, 2.0, marks[k], k) for k, driver in enumerate(mechanism.drivers)]
    samples = [tuple(u for (u,) in each) for each in zip(*ways, strict=True)]
    expected = {Status.OK, Status.BRIDGED} if carried else {Status.OK, Status.BRIDGED, Status.OUTSIDE}
    assert expected <= set(assert_same(compile_plan(mechanism), samples))


@pytest.mark.parametrize("mechanism", CHANGES)
@pytest.mark.few(1)
def test_parameters_are_followed_and_refused_by_both_solvers(mechanism: Callable[[], Mechanism]) -> None:
    plan = compile_plan(mechanism())
    c = Native(plan, QUICK)
    for change in CHANGES[mechanism]:
        values = tuple(change.get(parameter.name, parameter.value) for parameter in plan.parameters)
        python = with_parameters(load_module(plan), values)
        assert c.bind(values) == getattr(python, "message", ""), change
        assert c.anchor().z == pytest.approx(python.anchor.z, rel=0, abs=1e-12)
        for u in (1.2, 2.0, 7.5):
            pose, answer = python.solve(python.anchor, (u,)), c.solve((u,))
            assert answer.status == pose.status
            assert c.message == pose.message or pose.good
            if pose.good:
                assert answer.z == pytest.approx(pose.z, rel=0, abs=1e-12)


def test_both_solvers_report_a_redundant_row_that_no_longer_holds() -> None:
    reference = kinfmu.load("fourbar")
    joints = tuple(replace(joint, length="bar") if joint.name == "AB" else joint for joint in reference.joints)
    plan = compile_plan(replace(reference, joints=joints, parameters={"bar": 1.0}))
    c = Native(plan, QUICK)
    for bar in (1.0, 1.01, 1.0 + 1e-10):
        assert c.bind((bar,)) == getattr(with_parameters(load_module(plan), (bar,)), "message", "")
    assert c.solve((1.1,)).status == Status.OK
    for u in (3.0, 1.0 + 4.0 * math.pi):
        answer = c.solve((u,))
        assert answer.status == Status.OK


def test_both_solvers_report_values_that_are_not_numbers() -> None:
    plan = compile_plan(kinfmu.load("five_bar"))
    python, c = solver_of(plan), Native(plan, QUICK)
    for u in ((math.nan, 1.0), (1.0, math.inf), (1e300, 1.0)):
        pose, answer = python.solve(python.anchor, u), c.solve(u)
        assert answer.status == pose.status == Status.OUTSIDE
        assert c.message == pose.message


@pytest.mark.parametrize("name", ["fourbar", "double_pendulum"])
def test_trials_leave_no_trace_and_a_copy_of_the_bytes_behaves_the_same(name: str) -> None:
    plan = compile_plan(kinfmu.load(name))
    one, other, again = Native(plan), Native(plan), Native(plan)
    rng = random.Random(5)  # noqa: S311  # samples, not secrets
    u, middle = 5.0, 5.0
    for k in range(150):
        for _ in range(rng.randrange(3)):
            other.solve((middle + rng.uniform(-9.0, 9.0),))
        if k % 10 == 0:
            again.take(one)
        u = rng.choice([u + rng.uniform(-0.2, 0.4), middle + rng.uniform(-4.0, 4.0), math.pi * rng.randrange(6)])
        answer = [solver.solve((u,)) for solver in (one, other, again)]
        if answer[0].status <= Status.BRIDGED:
            assert answer[0] == answer[1] == answer[2]
            rows = [solver.motion((1.0,), (0.5,)) for solver in (one, other, again)]
            assert rows[0] == rows[1] == rows[2]
            for solver in (one, other, again):
                solver.commit()
        else:
            assert [pose.status for pose in answer] == [answer[0].status] * 3
            assert one.message == other.message == again.message


def test_an_anchor_that_does_not_close_is_not_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = compile_plan(kinfmu.load("triple_rocker"))
    model = load_model(plan)
    beyond = 1.6  # the limit is 1.494
    model.ANCHOR = (beyond,), model.ANCHOR[1]
    moved = rf"kf_anchor_u[1] = {{{beyond}}}"
    files = {name: re.sub(r"kf_anchor_u\[1\] = \{.*?\}", moved, text) for name, text in emit(plan).items()}
    monkeypatch.setattr("tests.solver.c.native.emit", lambda _: files)
    python, c = Solver(model), Native(plan, QUICK)
    pose = python.solve(python.anchor, (beyond,))
    assert c.solve((beyond,)).status == pose.status == Status.NOT_CONVERGED
    assert c.message == pose.message == "left = 1.6 rad (91.6732 deg): the rows do not close: residual 2.3 of the size"
    assert c.solve((1.2,)).status == python.solve(python.anchor, (1.2,)).status == Status.OUTSIDE


def test_only_requested_tables_are_written_with_the_same_numbers() -> None:
    for name, drivers in (("crank_rocker", 1), ("five_bar", 2)):
        c = Native(compile_plan(kinfmu.load(name)), QUICK)
        start = load_model(compile_plan(kinfmu.load(name))).ANCHOR[0]
        for wanted in ("v", "a", "va", "p", "pa"):
            c.solve([value + 0.01 * len(wanted) for value in start])
            rows = c.motion((0.7,) * drivers, (0.2,) * drivers, wanted)
            full = c.motion((0.7,) * drivers, (0.2,) * drivers)
            assert rows == [row if letter in wanted else None for letter, row in zip("pva", full, strict=True)]
            c.restart()


@pytest.mark.parametrize(("name", "nodes"), [("inner", PLACES[1:5]), ("outer", (*PLACES[:2], *PLACES[4:]))])
def test_weights_of_the_centre_of_a_span_are_written_down_as_they_are_computed(
    name: str, nodes: tuple[float, ...]
) -> None:
    (text,) = re.findall(rf"{name}_weights\[4\]\[3\] = {{(.*?)}};", compiler.sources(["span.c"])["span.c"], re.S)
    written = [float(number) for number in re.findall(r"-?[0-9.e-]+", text)]
    assert written == [number for row in weights(nodes, 0.0) for number in row]
