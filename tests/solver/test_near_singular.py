"""Poses near singular ones: reached, left and met again, with one driver and with several, in every engine."""

from __future__ import annotations

import math
from importlib import import_module
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import kinfmu
from kinfmu.backends.c import compiler
from kinfmu.backends.python import load_model
from kinfmu.plan import compile_plan
from kinfmu.solver import Pose, Solver, Status
from tests.fmu.host import Host as PythonHost
from tests.fmu.native.host import Host as NativeHost
from tests.mechanisms import with_arm
from tests.solver.change_points import fourbar

Engine = Literal["python", "native"]
ENGINES: tuple[Engine, ...] = ("python", "native")
STRETCHED = math.acos(-11.0 / 12.0)  # [rad] of the five-bar's left arm, the right one mirrored
GAPS = (1e-3, 1e-4, 5e-5, 1e-5)  # [rad] before it
THERE_AND_BACK = [STRETCHED - gap for gap in (*GAPS, *GAPS[-2::-1])]


@pytest.fixture(autouse=True)
def compiled(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Libraries stay inside the tests, and are compiled quickly."""
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path_factory.getbasetemp() / "compiled"))
    for module in (compiler, import_module("kinfmu.fmu.native.archive")):
        monkeypatch.setattr(module, "FLAGS", ["-O0" if flag.startswith("-O") else flag for flag in module.FLAGS])


@pytest.mark.parametrize("engine", ENGINES)
def test_with_several_drivers_the_way_back_from_a_near_singular_pose_is_the_way_there(engine: Engine) -> None:
    mechanism = kinfmu.load("five_bar")
    right = [math.pi - left for left in THERE_AND_BACK]
    run = kinfmu.solve(mechanism, engine=engine, left_angle=THERE_AND_BACK, right_angle=right)
    assert run.good.all()
    np.testing.assert_array_equal(run.status, run.status[::-1])
    there, back = run.values[: len(GAPS)], run.values[: -len(GAPS) - 1 : -1]
    assert np.abs(there - back).max() <= 2.0 * run.error[:, 0].max()


@pytest.mark.parametrize("flavour", ["python", "native 2", "native 3"])
def test_so_it_is_in_fmus(flavour: str, tmp_path: Path) -> None:
    name, _, fmi = flavour.partition(" ")
    path = kinfmu.build(
        kinfmu.load("five_bar"),
        tmp_path / "five_bar.fmu",
        flavour=name,  # type: ignore[arg-type]  # one of the two
        fmi=int(fmi or 2),  # type: ignore[arg-type]
        drive="inputs",
    )
    host = (PythonHost if name == "python" else NativeHost)(path, tmp_path / "unpacked")
    try:
        host.initialize(0.0)
        found = []
        for k, left in enumerate(THERE_AND_BACK):
            host.set({"left_angle": left, "right_angle": math.pi - left})
            found.append([host.status(), *host.get("T.x", "T.y")])
            assert host.step(0.1 * k, 0.1) == (name == "python")  # True, or fmi2OK
    finally:
        host.free()
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
    [*(("python", drivers, gap) for drivers in (1, 2) for gap in (0.1, 1e-2, 1e-4)), ("native", 2, 1e-4)],
)
def test_so_it_is_before_a_limit(gap: float, drivers: int, engine: Engine) -> None:
    """A triple rocker before its dead centre; an arm of its own is the second driver."""
    start = math.acos(-1.0 / 8.0) - gap  # 2, 1, 1.5, 1: coupler and rocker stretched
    case = fourbar("2", "1", "1.5", "1", start=start)
    arm = {} if drivers == 1 else {"arm_angle": 0.3}
    mechanism = case.mechanism if drivers == 1 else with_arm(case.mechanism)
    run = kinfmu.solve(mechanism, engine=engine, crank_angle=[start, start - 0.3, start], **arm)
    assert run.status[0] == run.status[2]
    assert (run.status[0] == Status.NEAR_SINGULAR) == (run.margin[0] < 0.0125)


def test_a_start_pose_that_misses_the_tolerance_is_refused_like_every_other() -> None:
    mechanism = kinfmu.load("fourbar")
    start = compile_plan(mechanism).anchor.u[0]
    run = kinfmu.solve(mechanism, crank_angle=[start, start + 0.3, start], tolerance=1e-18)
    assert set(run.status.tolist()) <= {Status.NOT_CONVERGED, Status.INCONSISTENT, Status.OK}
    assert run.status[0] == run.status[2]


def test_an_anchor_near_a_change_point_is_bridged_and_stays_what_it_is() -> None:
    """As other parameters may bring it there."""
    model = load_model(compile_plan(fourbar("4", "1", "3", "2").mechanism))
    far = Solver(model)
    near = far.solve(far.anchor, (math.pi - 0.04,))
    beside = far.solve(near, (math.pi - 0.02,))
    solver = Solver(model, anchor=Pose(beside.u, beside.found()))
    first = solver.solve(solver.anchor, solver.anchor.u)
    assert first.status == Status.BRIDGED
    assert solver.anchor.status == Status.OK
    assert solver.anchor.road is None
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
