"""All closed poses of a block: none is missed, each is proved, and what cannot be proved is reported."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute
from kinfmu.analysis.certified.intervals import Intervals, contracted
from kinfmu.analysis.certified.poses import ClosedPoses, closed_poses
from kinfmu.mechanism import gallery
from kinfmu.mechanism.joints import Distance, PointOnLine
from kinfmu.mechanism.quantities.arithmetic import cos, sin, sqrt
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.equations.graph import Graph, Node, evaluate
from tests.mechanisms import fourbar, six_bar
from tests.stress.assemblies import FAMILIES, compared

SINGULAR = ("fourbar_chain", "peaucellier")  # assemblies in which links fold
LARGE = ("stephenson_six_bar",)  # a block of four unknowns


def whole_plan(mechanism: Mechanism) -> SolvePlan:
    return compile_plan(replace(mechanism, coordinates="all"))


def poses_and_time(mechanism: Mechanism) -> tuple[ClosedPoses, float]:
    plan, begun = whole_plan(mechanism), time.process_time()
    closed = closed_poses(plan)
    return closed, time.process_time() - begun


FORMULAS: tuple[Callable[[Node, Node], Node], ...] = (
    lambda x, y: x * 3.0 + y * y - x * y,
    lambda x, y: (x - 0.3) * (x - 0.3) + (y + 1.0) * (y + 1.0),
    lambda x, y: sin(x) * 2.0 - cos(y + x * 0.5),
    lambda x, y: x / (y * y + 0.1) - sqrt(x * x + 1.0),
    lambda x, y: sin(x * 2.0) / (cos(y) + 2.0),
)


@pytest.mark.parametrize("number", range(len(FORMULAS)))
def test_a_contraction_keeps_every_solution_and_shrinks(number: int) -> None:
    random = np.random.default_rng(number)
    graph = Graph()
    x, y, goal = map(graph.symbol, "xyg")
    row = FORMULAS[number](x, y)
    points = random.uniform(-7.0, 7.0, (2, 2000)) * 10.0 ** random.uniform(-3.0, 0.0, 2000)
    width = 10.0 ** random.uniform(-6.0, 1.0, (2, 2000))
    width[:, :40] = 0.0
    part = random.random((2, 2000))
    box = Intervals(points - width * part, points + width * (1.0 - part))
    of = [evaluate([row], {"x": a, "y": b})[0] for a, b in points.T.tolist()]
    near = 1e-13 * (1.0 + np.abs(of)) * 100.0
    values = {"x": box[0], "y": box[1], "g": Intervals(of - near, of + near)}
    narrowed, is_empty = contracted([row - goal], values, ["x", "y"])
    assert not is_empty.any()
    for part, at in zip(narrowed, points, strict=True):
        assert ((part.low <= at) & (at <= part.high)).all()
    assert sum(float((part.high - part.low).sum()) for part in narrowed) < 0.95 * float(2.0 * box.radius.sum())
    away = {**values, "g": Intervals(np.full(2000, 1e6), np.full(2000, 2e6))}
    assert contracted([row - goal], away, ["x", "y"])[1].mean() > 0.9


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(8)
def test_assemblies_of_the_gallery_are_complete(name: str) -> None:
    closed, seconds = poses_and_time(kinfmu.load(name))
    print(f"{name}: {len(closed.outputs)} assemblies, {1e3 * seconds:.0f} ms")
    assert (not closed.reasons) == (name not in SINGULAR)
    assert len(closed.outputs) >= 1


@pytest.mark.parametrize(("seed", "family"), [(seed, family) for seed in range(10) for family in FAMILIES])
@pytest.mark.few(8)
def test_platforms_and_six_bars_have_the_assemblies_of_an_elimination(seed: int, family: str) -> None:
    found = compared((seed, family))
    assert not found.refused
    assert found.faults == []
    assert found.count >= 2


def two_tables(seed: int) -> Mechanism:
    """Two tables pinned to each other, each on two bars: a block of six angles."""
    random = np.random.default_rng(seed)
    tables = random.uniform(-1.0, 1.0, (2, 3, 2))
    pivots = random.uniform(-2.0, 2.0, (4, 2))
    phis = random.uniform(-math.pi, math.pi, 2)
    turned = [
        table @ [[math.cos(phi), math.sin(phi)], [-math.sin(phi), math.cos(phi)]]
        for table, phi in zip(tables, phis, strict=True)
    ]
    first = random.uniform(-1.0, 1.0, 2)
    places = [first, first + turned[0][2] - turned[1][2]]
    bodies = [Body("ground", {"M": (0, 0), **{f"B{k}": tuple(map(float, at)) for k, at in enumerate(pivots)}})]
    bodies.append(Body("wheel", {"M": (0, 0)}, (0, 0, 0)))
    joints = [Revolute("M", ("ground.M", "wheel.M")), Revolute("T", ("table0.Q2", "table1.Q2"))]
    for k, number in itertools.product(range(2), range(2)):
        bar, along = f"bar{2 * k + number}", places[k] + turned[k][number] - pivots[2 * k + number]
        start = *map(float, pivots[2 * k + number]), math.atan2(along[1], along[0])
        bodies.append(Body(bar, {"a": (0, 0), "b": (math.hypot(*along), 0)}, start))
        joints.append(Revolute(f"a_{bar}", (f"ground.B{2 * k + number}", f"{bar}.a")))
        joints.append(Revolute(f"b_{bar}", (f"{bar}.b", f"table{k}.Q{number}")))
    for k in range(2):
        points = {f"Q{n}": tuple(map(float, point)) for n, point in enumerate(tables[k])}
        bodies.append(Body(f"table{k}", points, (*map(float, places[k]), float(phis[k]))))
    return Mechanism("tables", bodies, joints, [AngleDriver("motor", "wheel", ConstantSpeed(0.0, 1.0))])


@pytest.mark.parametrize(
    ("mechanism", "size", "count"), [(six_bar(), 4, 2), (two_tables(0), 6, 6), (two_tables(3), 6, 8)]
)
def test_blocks_of_four_and_six_angles_are_complete(mechanism: Mechanism, size: int, count: int) -> None:
    assert max(len(block.unknowns) for block in whole_plan(mechanism).blocks) == size
    closed, seconds = poses_and_time(mechanism)
    print(f"{size} angles: {len(closed.outputs)} assemblies, {seconds:.2f} s")
    assert closed.reasons == ()
    assert len(closed.outputs) == count


def test_a_time_limit_is_reported_and_keeps_the_poses_proved_by_then() -> None:
    plan = whole_plan(two_tables(0))
    closed = closed_poses(plan, limit=0.0)
    assert len(closed.reasons) == 1
    assert closed.reasons[0].endswith("the time limit of 0 s ended its search")
    assert len(closed.outputs) == len(closed_poses(plan).outputs)


def test_a_length_that_nothing_bounds_is_reported() -> None:
    """Three pins of the ground in slots of a block, which may be long: in each of its angles one equation remains."""
    lines = {"A": (0.0, 0.0, 0.3, 0.5), "B": (1.0, 0.2, 1.4, -0.3), "C": (0.3, 0.7, 2.5, 0.2)}  # point, axis, way
    x, y, phi = 0.5, 0.1, 0.4
    pins, points, joints = {}, {}, [Revolute("M", ("ground.M", "wheel.M"))]
    for name, (a, b, axis, way) in lines.items():
        a_end, b_end = a + way * math.cos(axis), b + way * math.sin(axis)
        pins[name] = (
            x + math.cos(phi) * a_end - math.sin(phi) * b_end,
            y + math.sin(phi) * a_end + math.cos(phi) * b_end,
        )
        points[name] = (a, b)
        joints.append(PointOnLine(f"slot_{name}", (f"block.{name}", f"ground.{name}"), axis))
    bodies = [
        Body("ground", {"M": (0, 0), **pins}),
        Body("block", points, (x, y, phi)),
        Body("wheel", {"M": (0, 0)}, (0, 0, 0)),
    ]
    motor = AngleDriver("motor", "wheel", ConstantSpeed(0.0, 1.0))
    closed = closed_poses(whole_plan(Mechanism("slots", bodies, joints, [motor])))
    assert closed.reasons
    assert "its rows give no bounds of block.x, block.y" in closed.reasons[0]
    assert len(closed.outputs) == 2


def test_poses_at_which_links_fold_are_not_decided() -> None:
    lengths = 2.0, 1.0, 2.0, 1.0  # a parallelogram; its driver starts where the antiparallelogram is regular too
    closed = closed_poses(whole_plan(fourbar(*lengths, start=1.0)))
    assert closed.reasons == ()
    assert len(closed.outputs) == 2
    chain = closed_poses(whole_plan(kinfmu.load("fourbar_chain")))
    assert all("not decided near" in reason for reason in chain.reasons)
    inversor = closed_poses(whole_plan(kinfmu.load("peaucellier")))
    assert "poses are not isolated, or close to singular, near" in inversor.reasons[0]


def test_each_pose_is_found_once_if_it_is_at_half_a_turn() -> None:
    """A bar between two others at -180 deg, the border of the usual range of angles."""
    sides = [Distance("bar", ("ground.D", "link.E"), 1.0)]
    ground = Body("ground", {"O": (0, 0), "D": (-1.0, 1.0)})
    crank, link = (
        Body("crank", {"O": (0, 0), "P": (1.0, 0)}, (0, 0, 0)),
        Body("link", {"P": (0, 0), "E": (2.0, 0)}, (1, 0, 3.1)),
    )
    joints = [Revolute("O", ("ground.O", "crank.O")), Revolute("P", ("crank.P", "link.P")), *sides]
    at_half_a_turn = Mechanism(
        "half", [ground, crank, link], joints, [AngleDriver("motor", "crank", ConstantSpeed(0.0, 1.0))]
    )
    closed = closed_poses(whole_plan(at_half_a_turn))
    assert closed.reasons == ()
    assert len(closed.outputs) == 2
