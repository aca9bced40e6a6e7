"""Poses near singular ones: reached, left and met again, with one driver and with several, in every engine."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import kinfmu
from kinfmu import Body, Mechanism
from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Pose, Solver, Status
from tests.fmu.host import OK, Host
from tests.mechanisms import (
    ROBOT_LENGTHS,
    ROBOT_PIVOT,
    folding_robot,
    side_by_side,
    tight_jaw,
    with_arm,
    with_robot,
    with_second,
)
from tests.power_series import Series, mp, sin_cos, sqrt
from tests.solver.change_points import Case, fourbar

Engine = Literal["python", "native"]
ENGINES: tuple[Engine, ...] = ("python", "native")
STRETCHED = math.acos(-11.0 / 12.0)  # [rad] of the five-bar's left arm, the right one mirrored
GAPS = (1e-3, 1e-4, 5e-5, 1e-5)  # [rad] before it
DEAD_CENTRE = math.acos(-5.0 / 16.0)  # [rad] of the crank of 2, 1, 1.5, 1: coupler and rocker stretched
THERE_AND_BACK = [STRETCHED - gap for gap in (*GAPS, *GAPS[-2::-1])]


@pytest.mark.parametrize("engine", ENGINES)
def test_with_several_drivers_the_path_back_from_a_near_singular_pose_is_the_path_there(engine: Engine) -> None:
    mechanism = kinfmu.load("five_bar")
    right = [math.pi - left for left in THERE_AND_BACK]
    run = kinfmu.solve(mechanism, engine=engine, left_angle=THERE_AND_BACK, right_angle=right)
    assert run.good.all()
    np.testing.assert_array_equal(run.status, run.status[::-1])
    there, back = run.values[: len(GAPS)], run.values[: -len(GAPS) - 1 : -1]
    assert np.abs(there - back).max() <= 2.0 * run.error[:, 0].max()


@pytest.mark.parametrize("flavour", ["python", pytest.param("native 2", marks=pytest.mark.long), "native 3"])
@pytest.mark.few(1)
def test_in_fmus_the_path_back_from_a_near_singular_pose_is_the_path_there(
    flavour: str, fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    name, _, fmi = flavour.partition(" ")
    host = opened(fmu_of("five_bar", name, int(fmi or 2), "inputs"))
    host.initialize(0.0)
    found = []
    for k, left in enumerate(THERE_AND_BACK):
        host.set({"left_angle": left, "right_angle": math.pi - left})
        found.append([host.status(), *host.get("T.x", "T.y")])
        assert host.step(0.1 * k, 0.1) == OK
    assert [int(row[0]) for row in found] == [0, 0, 1, 1, 1, 0, 0]
    np.testing.assert_allclose(found, found[::-1], rtol=0, atol=1e-9)


# --------------------------------------------------------------------------------------------------- the first sample


PYTHON_AND_NATIVE = [("python", gap) for gap in (0.3, 0.05, 0.01, 4e-3, 1e-3)] + [("native", 0.02)]


@pytest.mark.parametrize(("engine", "gap"), PYTHON_AND_NATIVE)
def test_at_the_start_pose_a_sample_is_judged_like_the_same_one_later(gap: float, engine: Engine) -> None:
    """Before a change point, where samples are bridged."""
    start = math.pi - gap
    case = fourbar("4", "1", "3", "2", start=start)
    run = case.run([start, start - 0.5, start], engine=engine)
    assert run.status[0] == run.status[2] == (Status.BRIDGED if gap < 0.04 else Status.OK)
    assert (case.errors(run) <= np.maximum(run.error, 1e-12)).all()


@pytest.mark.parametrize(
    ("engine", "drivers", "gap"),
    [*(("python", drivers, gap) for drivers in (1, 2) for gap in (0.1, 1e-2, 1e-5)), ("native", 2, 1e-5)],
)
@pytest.mark.few(3)
def test_before_a_limit_the_first_sample_is_judged_like_later_ones(gap: float, drivers: int, engine: Engine) -> None:
    """A triple rocker before its dead centre; an arm of its own is the second driver."""
    start = DEAD_CENTRE - gap
    case = fourbar("2", "1", "1.5", "1", start=start)
    arm = {} if drivers == 1 else {"arm_angle": 0.3}
    mechanism = case.mechanism if drivers == 1 else with_arm(case.mechanism)
    run = kinfmu.solve(mechanism, engine=engine, crank_angle=[start, start - 0.3, start], **arm)
    assert run.status[0] == run.status[2]
    assert (run.status[0] == Status.NEAR_SINGULAR) == (run.margin[0] < 0.0125)


def at_the_start(name: str) -> tuple[Mechanism, int]:
    """A mechanism that starts at or near a singular pose, and the status there."""
    if name == "change point":
        return fourbar("4", "1", "3", "2", start=math.pi - 0.01).mechanism, Status.BRIDGED
    rocker = fourbar("2", "1", "1.5", "1", start=DEAD_CENTRE - 1e-5).mechanism
    return (rocker if name == "limit" else with_arm(rocker)), Status.NEAR_SINGULAR


@pytest.mark.parametrize("drive", ["inputs", "time"])
@pytest.mark.parametrize("flavour", ["python", "native 2", "native 3"])
@pytest.mark.parametrize("name", ["change point", "limit", "limit and arm"])
@pytest.mark.few(4)
def test_in_fmus_the_first_sample_is_judged_as_by_the_engines(
    name: str, flavour: str, drive: str, fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    mechanism, expected = at_the_start(name)
    run = kinfmu.solve(mechanism, t=[0.0])
    kind, _, fmi = flavour.partition(" ")
    host = opened(fmu_of(mechanism, kind, int(fmi or 2), drive))
    host.enter(0.0)
    seen = [(host.status(), *host.get("solver.margin", *run.names))]
    host.fmu.exitInitializationMode()
    seen.append((host.status(), *host.get("solver.margin", *run.names)))
    assert host.step(0.0, 0.0) == OK
    seen.append((host.status(), *host.get("solver.margin", *run.names)))
    assert run.status[0] == expected
    np.testing.assert_allclose(seen, 3 * [(expected, run.margin[0], *run.q[0])], rtol=1e-12, atol=1e-12)


def test_a_start_pose_that_misses_the_tolerance_is_refused_like_every_other() -> None:
    mechanism = kinfmu.load("fourbar")
    start = compile_plan(mechanism).anchor.u[0]
    run = kinfmu.solve(mechanism, crank_angle=[start, start + 0.3, start], tolerance=1e-18)
    assert set(run.status.tolist()) <= {Status.NOT_CONVERGED, Status.INCONSISTENT, Status.OK}
    assert run.status[0] == run.status[2]


def test_an_anchor_near_a_change_point_is_bridged_and_stays_unchanged() -> None:
    """As other parameters may bring it there."""
    model = load_model(compile_plan(fourbar("4", "1", "3", "2").mechanism))
    far = Solver(model)
    near = far.solve(far.anchor, (math.pi - 0.04,))
    closer = far.solve(near, (math.pi - 0.02,))
    solver = Solver(model, anchor=Pose(closer.u, closer.found()))
    first = solver.solve(solver.anchor, solver.anchor.u)
    assert first.status == Status.BRIDGED
    assert solver.anchor.status == Status.OK
    assert solver.anchor.singularities is None
    assert solver.solve(first, first.u) is first
    again = solver.restore(solver.dump(first))
    assert again.z == first.z
    assert again.tangent == first.tangent


# ----------------------------------------------------------------------------------------------- where Newton ends


@pytest.mark.parametrize("gap", [3e-3, 1e-3, 1e-4, 1e-5])
def test_near_a_singular_pose_newton_leaves_no_residual_that_another_step_would_take(gap: float) -> None:
    """On average: what is left is rounding. At regular poses Newton ends at 4e-16."""
    model = load_model(compile_plan(kinfmu.load("five_bar")))
    solver = Solver(model)
    pose, left_over = solver.anchor, []
    for k in range(60):
        left = STRETCHED - gap * (1.0 + 1e-3 * k)
        pose = solver.solve(pose, (left, math.pi - left - 1e-4 * k * gap))
        still = (0.0,) * len(pose.z)
        _, _, margin, residual, *_ = model.position(pose.u, pose.z, still, still, -0.0, 0, 0.0)
        assert margin < 0.1
        left_over.append((pose.residual, residual))
    before, after = np.mean(left_over, axis=0)
    assert before <= 1.1 * after


SPEEDS, ACCELERATIONS = (0.7, -1.1), (0.3, 0.2)  # of the five-bar's left and right arm


def pin(left: float, right: float) -> tuple[float, float]:
    """Acceleration of pin T of the five-bar in 50 digits: it is where two circles about the ends of the arms meet."""
    arms = zip((left, right), SPEEDS, ACCELERATIONS, strict=True)
    (s1, c1), (s2, c2) = (sin_cos(Series([mp.mpf(u), mp.mpf(v), mp.mpf(a) / 2])) for u, v, a in arms)
    across, up = 100 + 120 * c2 - 120 * c1, 120 * s2 - 120 * s1
    height = sqrt(160 * 160 / (across * across + up * up) - mp.mpf(1) / 4)
    at = 120 * c1 + across / 2 - height * up, 120 * s1 + up / 2 + height * across
    return float(2 * at[0].c[2]), float(2 * at[1].c[2])


def pin_by_dense_newton(left: float, right: float, forearms: FloatArray) -> tuple[float, float]:
    """The same in doubles: Newton on the loop closure for the angles of both forearms, until it no longer improves."""
    (u1, u2), (v1, v2), (a1, a2) = np.exp(1j * np.array([left, right])), SPEEDS, ACCELERATIONS

    def solved(gap: complex, directions: FloatArray) -> FloatArray:
        jacobian = 160.0 * np.array([1j * directions[0], -1j * directions[1]])
        found: FloatArray = np.linalg.solve(np.array([jacobian.real, jacobian.imag]), [-gap.real, -gap.imag])
        return found

    angles = forearms.copy()
    for _ in range(30):
        p, r = np.exp(1j * angles)
        step = solved(120.0 * (u1 - u2) + 160.0 * (p - r) - 100.0, np.array([p, r]))
        angles += step
        if abs(step).max() < 1e-15:
            break
    directions = np.exp(1j * angles)
    w1, w2 = solved(120.0j * (v1 * u1 - v2 * u2), directions)
    ends = 120.0 * ((1j * a1 - v1 * v1) * u1 - (1j * a2 - v2 * v2) * u2)
    b1, _ = solved(ends - 160.0 * (w1 * w1 * directions[0] - w2 * w2 * directions[1]), directions)
    found = 120.0 * (1j * a1 - v1 * v1) * u1 + 160.0 * (1j * b1 - w1 * w1) * directions[0]
    return float(found.real), float(found.imag)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("gap", "rounding"), [(1e-3, 1e-12), (1e-4, 1e-11), (1e-5, 1e-10)])
@pytest.mark.few(3)
def test_near_a_singular_pose_of_two_drivers_accelerations_are_those_of_a_dense_newton_that_goes_on(
    engine: Engine, gap: float, rounding: float
) -> None:
    """Relative to the largest of the column; what rounding of the driver values leaves grows as 1 / gap."""
    left = STRETCHED - gap * (1.0 + 1e-3 * np.arange(60))
    right = math.pi - left - 1e-4 * gap * np.arange(60)
    mechanism = kinfmu.load("five_bar")
    run = kinfmu.solve(
        mechanism,
        engine=engine,
        left_angle=[2.356, *left],
        right_angle=[0.785, *right],
        left_speed=SPEEDS[0],
        right_speed=SPEEDS[1],
        left_acceleration=ACCELERATIONS[0],
        right_acceleration=ACCELERATIONS[1],
    )
    exact = np.array([pin(*of) for of in zip(left, right, strict=True)])
    forearms = np.array([run["left_forearm.phi"][1], run["right_forearm.phi"][1]])
    dense = np.array([pin_by_dense_newton(*of, forearms) for of in zip(left, right, strict=True)])
    found = np.array([run["T.ax"], run["T.ay"]]).T[1:]
    ours, theirs = (np.abs(one - exact).max() / np.abs(exact).max() for one in (found, dense))
    assert ours <= 1.5 * theirs
    assert ours <= rounding
    assert (np.abs(found - exact).max(axis=1) <= run.error[1:, 2] * compile_plan(mechanism).size).all()


# ---------------------------------------------------------------------------------- each driver its own singular points


def test_both_drivers_pass_a_crossing_of_their_own_in_one_step() -> None:
    mechanism = with_second(fourbar("4", "1", "3", "2").mechanism)
    alone = [fourbar("4", "1", "3", "2").run([1.0, 5.0]), fourbar("4", "1", "3", "2").run([1.0, -2.0])]
    run = kinfmu.solve(mechanism, crank_angle=[1.0, 5.0], second_angle=[1.0, -2.0])
    assert run.status.tolist() == [Status.OK, Status.OK]
    for name in ("coupler.phi", "rocker.phi"):
        assert abs(run[name] - alone[0][name]).max() <= 1e-12
        assert abs(run[f"{name.split('.')[0]}2.phi"] - alone[1][name]).max() <= 1e-12


def test_in_the_windows_of_two_crossings_rates_and_estimates_are_those_of_each() -> None:
    case, speeds, accelerations = fourbar("4", "1", "3", "2"), (0.7, -1.3), (0.4, 0.9)
    u = [math.pi - 0.013, math.pi + 0.004]
    run = kinfmu.solve(
        with_second(case.mechanism),
        crank_angle=u[:1],
        second_angle=u[1:],
        crank_speed=speeds[0],
        second_speed=speeds[1],
        crank_acceleration=accelerations[0],
        second_acceleration=accelerations[1],
    )
    assert run.status.tolist() == [Status.BRIDGED]
    exact = case.motion(np.array(u, dtype=np.longdouble))
    for k, (v, a, number) in enumerate(zip(speeds, accelerations, ("", "2"), strict=True)):
        for name in ("coupler", "rocker"):
            q, first, second = (float(table[k]) for table in exact[f"{name}.phi"])
            found = [run[f"{name}{number}.{letter}"][0] for letter in ("phi", "omega", "alpha")]
            gaps = np.abs(np.array(found) - [q, v * first, v * v * second + a * first])
            assert (gaps <= np.maximum(run.error[0], 1e-13)).all()
            assert run.error[0].max() <= 1e-8


def test_a_limit_of_one_driver_names_that_driver_alone() -> None:
    limited = fourbar("2", "1", "1.5", "1").mechanism
    run = kinfmu.solve(with_second(limited), crank_angle=[1.0, 2.5], second_angle=[1.0, 1.2])
    assert run.status.tolist() == [Status.OK, Status.OUTSIDE]
    assert run.events[0].text.startswith("crank = 2.5 rad")
    assert "second" not in run.events[0].text
    assert run.events[0].text.endswith("beyond it the loop of coupler.phi, rocker.phi cannot close")


def test_a_pose_of_two_bridges_comes_back_from_its_numbers_to_the_bit() -> None:
    solver = Solver(load_model(compile_plan(with_second(fourbar("4", "1", "3", "2").mechanism))))
    pose = solver.solve(solver.anchor, (math.pi + 0.01, math.pi - 0.02))
    again = solver.restore(solver.dump(pose))
    ud, udd = (0.3, 0.4), (0.1, -0.2)
    assert solver.motion(again, ud, udd) == solver.motion(pose, ud, udd)
    assert solver.errors(again, ud, udd) == solver.errors(pose, ud, udd)
    ahead, same = (solver.solve(start, (4.0, 4.4)) for start in (pose, again))
    assert ahead.z == same.z
    assert solver.restore(solver.dump(ahead)).z == ahead.z
    far = solver.solve(solver.restore(solver.dump(ahead)), (3.0, 3.3))
    assert far.z == solver.solve(ahead, (3.0, 3.3)).z


def stepped_twice(host: Host, inputs: tuple[str, str], ways: list[tuple[float, float]], *outputs: str) -> np.ndarray:
    """Return status and outputs in each step, the same after the state of the beginning is restored."""
    host.initialize(0.0)
    runs, taken = [], host.state()
    for _ in range(2):
        found = []
        for k, values in enumerate(ways):
            host.set(dict(zip(inputs, values, strict=True)))
            found.append([host.status(), *host.get(*outputs)])
            assert host.step(0.1 * k, 0.1) == OK
        runs.append(found)
        host.restore(taken)
    assert runs[0] == runs[1]
    return np.array(runs[0])


@pytest.mark.parametrize("flavour", ["python", pytest.param("native 2", marks=pytest.mark.long), "native 3"])
@pytest.mark.few(1)
def test_fmus_follow_a_crossing_with_blocks_of_several_drivers_and_go_back_to_a_state(
    flavour: str, fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    name, _, fmi = flavour.partition(" ")
    case = fourbar("4", "1", "3", "2")
    host = opened(fmu_of(with_robot(case.mechanism), name, int(fmi or 2), "inputs"))
    ways = [(1.0, 0.6), (3.1, 0.9), (3.16, 0.2), (5.0, 0.4), (2.0, 1.0)]
    found = stepped_twice(host, ("crank_angle", "arm_angle"), ways, "rocker.phi", "link.phi")
    assert found[:, 0].tolist() == [0, 2, 2, 0, 0]
    exact = robot_motion(case, np.array(ways), (0.0, 0.0), (0.0, 0.0))[0]
    off = found[:, 2] - exact
    assert np.abs(np.remainder(off + math.pi, 2.0 * math.pi) - math.pi).max() <= 1e-11


@pytest.mark.parametrize("flavour", ["python", "native 3"])
@pytest.mark.few(1)
def test_fmus_pass_crossings_of_each_driver_and_go_back_to_a_state(
    flavour: str, fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    name, _, fmi = flavour.partition(" ")
    case = fourbar("4", "1", "3", "2")
    host = opened(fmu_of(with_second(case.mechanism), name, int(fmi or 2), "inputs"))
    ways = [(1.0, 1.0), (3.1, 3.16), (3.18, 2.0), (5.0, -1.0)]
    found = stepped_twice(host, ("crank_angle", "second_angle"), ways, "rocker.phi", "rocker2.phi")
    assert found[:, 0].tolist() == [0, 2, 2, 0]
    exact = case.motion(np.array(ways, dtype=np.longdouble).ravel())["rocker.phi"][0].astype(float).reshape(-1, 2)
    assert np.abs(found[:, 1:] - exact).max() <= 1e-11


def test_a_track_has_every_constant_of_a_model_that_following_it_reads() -> None:
    plan = compile_plan(with_second(fourbar("4", "1", "3", "2").mechanism))
    solver = Solver(load_model(plan))
    of_the_whole = {"ANGLES", "BLOCK_DRIVERS", "OUTPUTS"}
    folder = Path(str(import_module("kinfmu.solver.python").__file__)).parent
    read = {name for file in folder.glob("*.py") for name in re.findall(r"model\.([A-Z_]+)\b", file.read_text("utf-8"))}
    pose = solver.solve(solver.anchor, (1.2, 1.3 + math.pi))
    assert [name for track, _ in pose.tracks for name in sorted(read - of_the_whole) if not hasattr(track, name)] == []
    assert len(pose.tracks) == 2


# ------------------------------------------------------------------------- blocks that depend on several drivers too


def robot_motion(case: Case, u: FloatArray, speeds: Sequence[float], accelerations: Sequence[float]) -> FloatArray:
    """(3, n) angle, rate and acceleration of the link of `with_robot`, from the rocker's closed form: two circles."""
    length, link, strut = ROBOT_LENGTHS
    crank, arm = np.asarray(u, dtype=np.longdouble).T
    phi, first, second = case.motion(crank)["rocker.phi"]
    v, w = speeds
    rate, bend = v * first, v * v * second + accelerations[0] * first
    ends = []
    for size, angle, one, two in ((2.0, phi, rate, bend), (length, arm, w, accelerations[1])):
        along = size * np.exp(1j * angle)
        ends.append((along, 1j * one * along, (1j * two - one * one) * along))
    pivot = complex(*ROBOT_PIVOT) - 4.0
    way, way1, way2 = (b - a for a, b in zip(*ends, strict=True))
    way = way + pivot
    far = abs(way)
    beta = np.angle(way) + np.arccos((link**2 + far**2 - strut**2) / (2.0 * link * far))
    gamma = np.angle(link * np.exp(1j * beta) - way)
    sine, cosine = np.sin(beta - gamma), np.cos(beta - gamma)
    beta1 = -(way1 * np.exp(-1j * gamma)).real / (link * sine)
    gamma1 = -(way1 * np.exp(-1j * beta)).real / (strut * sine)
    beta2 = (-(way2 * np.exp(-1j * gamma)).real - link * beta1**2 * cosine + strut * gamma1**2) / (link * sine)
    return np.array([beta, beta1, beta2], dtype=float)


@pytest.mark.parametrize("engine", ENGINES)
def test_blocks_that_depend_on_several_drivers_follow_a_track_over_its_crossing(engine: Engine) -> None:
    """In even steps, in jumps, unordered, and in the window: rates and estimates too."""
    case, speeds, accelerations = fourbar("4", "1", "3", "2"), (0.7, -1.1), (0.3, 0.2)
    rng = np.random.default_rng(5)
    crank = np.concatenate(
        [np.arange(1.0, 8.0, 0.07), rng.uniform(-6.0, 12.0, 25), math.pi + rng.uniform(-0.04, 0.04, 25), [math.pi, 1.0]]
    )
    arm = 0.6 + 0.3 * np.sin(3.0 * crank)
    run = kinfmu.solve(
        with_robot(case.mechanism),
        engine=engine,
        crank_angle=crank,
        arm_angle=arm,
        crank_speed=speeds[0],
        arm_speed=speeds[1],
        crank_acceleration=accelerations[0],
        arm_acceleration=accelerations[1],
    )
    assert set(run.status.tolist()) == {Status.OK, Status.BRIDGED}
    assert (run.status == Status.BRIDGED).sum() >= 25
    exact = robot_motion(case, np.column_stack([crank, arm]), speeds, accelerations)
    found = np.array([run["link.phi"], run["link.omega"], run["link.alpha"]])
    gaps = np.abs(found - exact)
    gaps[0] = np.abs(np.remainder(found[0] - exact[0] + math.pi, 2.0 * math.pi) - math.pi)
    assert (gaps <= np.maximum(run.error.T, 1e-13)).all()
    assert run.error[:, 0].max() <= 1e-11
    assert run.error.max() <= 1e-8


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.few(1)
def test_only_a_crossing_that_depends_on_several_drivers_is_reported_as_a_limit(engine: Engine) -> None:
    reason = "link.phi, strut.phi cross; the crossing depends on several drivers, so no bridge is built"
    ways = {"left_angle": [0.3, -0.3], "right_angle": [math.pi + 0.3, math.pi - 0.3]}
    robot = kinfmu.solve(folding_robot(), engine=engine, **ways)
    assert robot.status.tolist() == [Status.OK, Status.OUTSIDE]
    assert robot.events[0].text.endswith(reason)
    both = side_by_side(folding_robot(), fourbar("4", "1", "3", "2").mechanism)
    run = kinfmu.solve(both, engine=engine, crank2_angle=[2.0, 4.0], **ways)
    assert run.status.tolist() == [Status.OK, Status.OUTSIDE]
    assert run.events[0].text.endswith(reason)
    limit = re.search(r"the limit is left = (\S+) rad .*, right = (\S+) rad .*, crank2 = (\S+) rad", run.events[0].text)
    assert limit is not None
    np.testing.assert_allclose([float(u) for u in limit.groups()], [0.0, math.pi, 3.0], rtol=0, atol=1e-6)
    crank = kinfmu.solve(both, engine=engine, crank2_angle=[2.0, 4.0], left_angle=0.3, right_angle=math.pi + 0.3)
    assert crank.status.tolist() == [Status.OK, Status.OK]


def test_a_limit_of_one_driver_gives_no_such_reason_where_others_are_mixed() -> None:
    """A dead centre, and a crossing too narrow for a bridge, while blocks of several drivers move."""
    limited = fourbar("2", "1", "1.5", "1").mechanism
    run = kinfmu.solve(side_by_side(folding_robot(), limited), crank2_angle=[1.0, 2.5], left_angle=0.5, right_angle=3.6)
    assert run.status.tolist() == [Status.OK, Status.OUTSIDE]
    assert run.events[0].text.startswith("crank2 = 2.5 rad")
    assert "left" not in run.events[0].text
    assert run.events[0].text.endswith("beyond it the loop of coupler2.phi, rocker2.phi cannot close")
    jaw = tight_jaw()
    ground, *bodies = jaw.bodies
    arms = folding_robot()
    both = replace(
        jaw,
        bodies=(Body("ground", {**ground.points, **arms.bodies[0].points}), *bodies, *arms.bodies[1:]),
        joints=(*jaw.joints, *(replace(joint, name=f"{joint.name}2") for joint in arms.joints)),
        drivers=(*jaw.drivers, *arms.drivers),
    )
    piston = [jaw.drivers[0].law.start, 54.6]
    run = kinfmu.solve(both, piston_position=piston, left_angle=0.5, right_angle=3.6)
    assert run.status.tolist() == [Status.OK, Status.OUTSIDE]
    assert re.search(r"the limit is piston = 54\.2863\d* mm, where branches of \w+\.phi cross$", run.events[0].text)


@pytest.mark.parametrize("engine", ENGINES)
def test_there_and_back_next_to_a_machine_ends_where_it_began(engine: Engine) -> None:
    """Before a mixed crossing, with the machine in its window: the next way starts from the last regular pose."""
    gaps = [0.3, 1e-2, 1e-3, 1e-4, 1e-5]
    there_and_back = np.array([*gaps, *gaps[-2::-1]])
    crank = math.pi + 0.02 * np.sign(there_and_back - 5e-3)
    run = kinfmu.solve(
        side_by_side(folding_robot(), fourbar("4", "1", "3", "2").mechanism),
        engine=engine,
        left_angle=there_and_back,
        right_angle=math.pi + there_and_back,
        crank2_angle=crank,
    )
    assert run.good.all()
    np.testing.assert_array_equal(run.status, run.status[::-1])
    assert run.status[0] == Status.BRIDGED
    assert Status.NEAR_SINGULAR in run.status
    assert np.abs(run.values - run.values[::-1]).max() <= 2.0 * run.error[:, 0].max()


@pytest.mark.parametrize("gap", [0.3, 1e-4])
def test_a_pose_of_bridges_and_mixed_blocks_comes_back_from_its_numbers_to_the_bit(gap: float) -> None:
    """With its base, where it has one."""
    both = side_by_side(folding_robot(), fourbar("4", "1", "3", "2").mechanism)
    solver = Solver(load_model(compile_plan(both)))
    regular = solver.solve(solver.anchor, (0.3, math.pi + 0.3, 2.9))
    pose = solver.solve(regular, (gap, math.pi + gap, math.pi + 0.01))
    assert (pose.base is not None) == (gap < 1e-2)
    again = solver.restore(solver.dump(pose))
    ud, udd = (0.3, 0.4, 0.2), (0.1, -0.2, 0.5)
    assert solver.motion(again, ud, udd) == solver.motion(pose, ud, udd)
    assert solver.errors(again, ud, udd) == solver.errors(pose, ud, udd)
    ahead, same = (solver.solve(start, (0.4, math.pi + 0.3, 3.3)) for start in (pose, again))
    assert ahead.good
    assert ahead.z == same.z
    assert pose.z == solver.solve(regular, pose.u).z
