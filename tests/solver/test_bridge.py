"""Bridges over change points, moved by whole turns, and the singularity map that remembers them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from kinfmu import Point
from kinfmu.codegen.python import load_model
from kinfmu.mechanism.gallery.chains import fourbar_chain
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Pose, Solver, Status, singularity_map
from kinfmu.solver.python.bridge import TURN, turned, whole_turns

Errors = Callable[[Solver, Pose], list[float]]


@pytest.mark.parametrize("distance", [0.0, 1e-12, -1e-9, 1e-6, -1e-3, 0.049])
@pytest.mark.parametrize("centre", [0.0, math.pi])
def test_inside_a_window_the_motion_keeps_its_digits(
    fourbar: Solver, errors: Errors, centre: float, distance: float
) -> None:
    pose = fourbar.solve(fourbar.anchor, (centre + distance,))
    assert pose.status == Status.BRIDGED
    q, qd, qdd = errors(fourbar, pose)
    assert q < 2e-14
    assert qd < 1e-12
    assert qdd < 1e-10


def test_bridge_is_built_once_and_moved_on_later_turns(
    fourbar: Solver, errors: Errors, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = []
    build = singularity_map.build

    def counted(*args: object) -> object:
        built.append(args)
        return build(*args)  # type: ignore[arg-type]

    monkeypatch.setattr("kinfmu.solver.python.singularity_map.build", counted)
    pose = fourbar.anchor
    for k in range(40):
        pose = fourbar.solve(pose, (1.0 + 0.5 * math.pi * k,))
        assert pose.good
        assert max(errors(fourbar, pose)) < 1e-9
    assert len(built) == 2
    assert len(pose.singularities.bridges) == 2


@pytest.mark.parametrize("turns", [1000, -1000])
def test_a_window_is_as_accurate_after_thousands_of_turns(fourbar: Solver, errors: Errors, turns: int) -> None:
    pose = fourbar.solve(fourbar.anchor, (turned(math.pi + 0.01, turns),))
    assert pose.status == Status.BRIDGED
    q, qd, qdd = errors(fourbar, pose)
    assert q < 1e-12 * abs(turns)
    assert qd < 1e-12
    assert qdd < 1e-10
    assert fourbar.solve(pose, (pose.u[0] + 0.06,)).status == Status.OK


def test_whole_turns_lose_no_digits() -> None:
    assert turned(turned(1.25, 100_000), -100_000) == pytest.approx(1.25, abs=1e-10)
    assert turned(0.5, 0) == 0.5
    assert turned(0.0, 1) == TURN
    assert whole_turns(3.0 * TURN + 1.0) == 3


@pytest.mark.parametrize("u", [2.0, math.pi + 0.02, 3.0 * math.pi - 0.01, 21.0])
def test_dumped_pose_is_restored_to_the_bit_in_and_out_of_windows(fourbar: Solver, u: float) -> None:
    pose = fourbar.solve(fourbar.anchor, (u,))
    again = fourbar.restore(json.loads(json.dumps(fourbar.dump(pose))))
    assert fourbar.motion(again, (1.0,), (0.5,)) == fourbar.motion(pose, (1.0,), (0.5,))
    for target in (u + 0.01, u + 1.5, u + 7.0, u - 9.0):
        a, b = fourbar.solve(pose, (target,)), fourbar.solve(again, (target,))
        assert (a.z, a.status) == (b.z, b.status)
        assert fourbar.accelerations(a, (1.0,), (0.0,)) == fourbar.accelerations(b, (1.0,), (0.0,))


def test_many_loops_that_all_but_cross_at_once_are_each_searched_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """More of them than a singularity map has places: each search must be remembered until all are done."""
    searched: list[int] = []
    monkeypatch.setattr("kinfmu.solver.python.singularity_map.build", lambda *args: searched.append(args[2]))
    written = fourbar_chain(40)
    longer = [
        replace(body, points={**body.points, "Q": Point(1.0 + 1e-6, 0.0)}) if body.name[:7] == "coupler" else body
        for body in written.bodies
    ]
    solver = Solver(load_model(compile_plan(replace(written, bodies=tuple(longer)))))
    pose = solver.solve(solver.anchor, (math.pi - 0.04,))
    assert pose.good
    assert sorted(searched) == list(range(40))
