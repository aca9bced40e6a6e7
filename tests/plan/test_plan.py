from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from kinfmu import AngleDriver, Body, ConstantSpeed, DistanceDriver, Mechanism, Point, Revolute, load, solve
from kinfmu.errors import AmbiguousStartError, AssemblyError, MobilityError, RequestError
from kinfmu.plan import compile_plan, determinant_formula
from tests.mechanisms import bar_as_body, bar_linkage, five_bar, fourbar, reference_fourbar, six_bar, slider_crank
from tests.oracle import fourbar as exact_fourbar
from tests.oracle import largest_error


def test_nine_coordinates_of_the_fourbar_become_one_solve_of_two() -> None:
    plan = compile_plan(reference_fourbar())
    assert plan.unknowns == ("coupler.phi", "rocker.phi")
    assert plan.fixed == {"crank.x": 0.0, "crank.y": 0.0, "rocker.x": 1.0, "rocker.y": 0.0}
    assert [block.coordinates for block in plan.blocks] == [
        ("crank.phi",),
        ("coupler.x", "coupler.y", "coupler.phi", "rocker.phi"),
    ]
    assert plan.watch_names == ("AB.length",)


@pytest.mark.parametrize(
    ("mechanism", "sizes"),
    [
        (bar_as_body(0.3), [(2, 2), (2, 1)]),  # the bar's pin keeps both rows: least squares
        (six_bar(), [(4, 4)]),
        (five_bar(), [(2, 2)]),
        (slider_crank(), [(1, 1)]),
        (bar_linkage(), [(1, 1)]),
        (load("double_pendulum"), [(1, 1)]),
    ],
)
def test_blocks_are_as_small_as_the_topology_allows(mechanism: Mechanism, sizes: list[tuple[int, int]]) -> None:
    plan = compile_plan(mechanism)
    assert [(len(block.residuals), len(block.unknowns)) for block in plan.blocks if block.unknowns] == sizes


@pytest.mark.parametrize(
    ("mechanism", "formula"),
    [
        (reference_fourbar(), "sin(coupler.phi - rocker.phi)"),
        (fourbar(4.0, 1.0, 3.5, 3.0), "10.5 sin(coupler.phi - rocker.phi)"),
        (load("double_pendulum"), "-cos(lower.phi)"),
        (five_bar(), "7.5 sin(forearm.phi - strut.phi)"),
    ],
)
def test_the_determinant_of_a_small_block_is_a_formula(mechanism: Mechanism, formula: str) -> None:
    (block,) = (block for block in compile_plan(mechanism).blocks if block.unknowns)
    assert determinant_formula(block) == formula


def test_what_the_outputs_do_not_need_is_not_solved() -> None:
    plan = compile_plan(reference_fourbar(), ["crank.phi"])
    assert plan.outputs == ("crank.phi",)
    assert plan.unknowns == ()
    assert plan.watches == ()
    with pytest.raises(RequestError, match=r"'coupler\.z' is not one; did you mean 'coupler\.[xy]'\?; outputs:"):
        compile_plan(reference_fourbar(), ["coupler.z"])
    with pytest.raises(
        RequestError, match=r"^outputs: 'crank\.phi' must be a list of names, such as \['crank\.phi'\]$"
    ):
        compile_plan(reference_fourbar(), "crank.phi")


def test_dependencies_are_structural() -> None:
    plan = compile_plan(five_bar())
    assert plan.depends("left.phi") == (0,)
    assert plan.depends("right.phi") == (1,)
    assert plan.depends("tip.x") == (0, 1)
    fixed_angle = compile_plan(reference_fourbar())
    assert fixed_angle.depends("coupler.phi") == (0,)  # though it happens to stay 0


def test_equal_mechanisms_have_equal_plans_and_others_have_not() -> None:
    one, other = compile_plan(reference_fourbar()), compile_plan(reference_fourbar())
    assert one == other
    assert hash(one) == hash(other)
    assert compile_plan(fourbar(4, 1, 3.5, 3)) != compile_plan(fourbar(4, 1, 3.5, 3.25))


@pytest.mark.long
def test_hash_order_never_reaches_the_plan_or_its_code() -> None:
    script = (
        "import hashlib, kinfmu; from kinfmu.plan import compile_plan; from kinfmu.codegen.python import emit\n"
        "from tests.mechanisms import six_bar, bar_as_body\n"
        "for m in (kinfmu.load('fourbar'), six_bar(), bar_as_body(0.3)):\n"
        "    p = compile_plan(m); print(hashlib.sha256((p.text + emit(p)).encode()).hexdigest())\n"
    )
    hashes = [
        subprocess.run(
            [sys.executable, "-c", script],
            check=True,
            capture_output=True,
            text=True,
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path)},
        ).stdout
        for seed in ("1", "2")
    ]
    assert hashes[0] == hashes[1]
    assert hashes[0].count("\n") == 3


def test_too_few_and_too_many_drivers_have_different_messages() -> None:
    bodies, joints = fourbar(4, 1, 3.5, 3).bodies, fourbar(4, 1, 3.5, 3).joints
    with pytest.raises(
        MobilityError, match=r"no driver: crank, coupler, rocker can still move; add 1 driver, or joints"
    ):
        compile_plan(Mechanism("m", bodies, joints))
    two = [AngleDriver("a", "crank"), AngleDriver("b", "rocker")]
    with pytest.raises(MobilityError, match=r"mobility is 1 but there are 2 drivers \(a, b\): remove 1"):
        compile_plan(Mechanism("m", bodies, joints, two))
    five = five_bar()
    with pytest.raises(
        MobilityError, match=r"mobility is 2 but there is 1 driver \(shoulder\): .* can still move; add 1"
    ):
        compile_plan(Mechanism("m", five.bodies, five.joints, five.drivers[:1]))


def test_two_drivers_on_one_freedom_are_refused() -> None:
    five = five_bar()
    with pytest.raises(MobilityError, match="a, b do not determine the motion"):
        compile_plan(Mechanism("m", five.bodies, five.joints, [AngleDriver("a", "left"), AngleDriver("b", "left")]))


@pytest.mark.parametrize(
    ("coupler", "message"),
    [
        (
            1.0,
            r"the start pose is singular \(crank = 0 rad .*no closed pose is found on either side of it: start crank",
        ),
        (1.0 - 1e-8, r"does not close near its start pose .* does not close: gap 1e-08 m"),
    ],
)
def test_a_start_that_closes_at_a_single_pose_or_misses_it_is_refused_with_the_reason(
    coupler: float, message: str
) -> None:
    """Three bars stretched over the fourth: that they do not determine the motion would not be the reason."""
    with pytest.raises(AssemblyError, match=message):
        compile_plan(fourbar(4, 1, coupler, 2, start=0.0))


def test_a_rough_start_pose_is_assembled() -> None:
    plan = compile_plan(fourbar(4, 1, 3.5, 3))
    rough = Mechanism(
        "rough",
        [
            body
            if body.is_ground
            else Body(body.name, body.points, [round(float(v or 0.0) + 0.2, 1) for v in body.start])
            for body in fourbar(4, 1, 3.5, 3).bodies
        ],
        plan.mechanism.joints,
        plan.mechanism.drivers,
    )
    again = compile_plan(rough)
    np.testing.assert_allclose(again.anchor.u, 1.2, atol=1e-12)
    assert again.anchor.margin > 0.01


def test_the_loop_that_does_not_close_is_named_with_the_distance_that_its_links_lack() -> None:
    """The links reach 2 + 3 from the crank's end P = (cos 1, sin 1) toward C = (9, 0)."""
    loop = r"the loop of bodies coupler, rocker with joints P, Q, C does not close: gap 3\.501 m at '[PQC]'"
    with pytest.raises(AssemblyError, match=rf"\(crank = 1 rad .*\): {loop} with the others closed") as caught:
        compile_plan(fourbar(9, 1, 2, 3))
    assert caught.value.gap == pytest.approx(math.dist((math.cos(1.0), math.sin(1.0)), (9.0, 0.0)) - 5.0, rel=1e-4)


def test_a_driver_that_cannot_reach_is_named_where_it_alone_sets_a_bar() -> None:
    """From C = (3, 0) to the end of a bar of length 1 about the origin it is 4 at most."""
    mechanism = Mechanism(
        "bar",
        [
            Body("ground", {"O": (0, 0), "C": (3, 0)}),
            Body("bar", {"O": (0, 0), "P": (0.8, 0.6)}),
        ],
        [Revolute("O", ("ground.O", "bar.O"))],
        [DistanceDriver("cylinder", ("ground.C", "bar.P"), ConstantSpeed(5.0, 0.1))],
    )
    with pytest.raises(AssemblyError, match=r"body bar with joints O, cylinder does not close: gap 1 m at 'cylinder'"):
        compile_plan(mechanism)


def test_a_loop_of_possible_lengths_that_no_step_closes_from_its_start_poses_blames_these() -> None:
    """All links in one line, folded where they are too far apart: a saddle of the squared gaps, but the lengths fit."""
    four = fourbar(4, 1, 3.5, 3, start=0.0)
    starts = {"crank": (0, 0, 0), "coupler": (1, 0, 0), "rocker": (4, 0, 0)}
    in_line = replace(four, bodies=[replace(body, start=starts.get(body.name, body.start)) for body in four.bodies])
    with pytest.raises(AssemblyError, match=r"with the others closed; check start poses: the loop closes from others"):
        compile_plan(in_line)


@pytest.mark.parametrize("rod", [0.4, 9.0])
def test_a_loop_that_a_wrong_length_opens_is_blamed_and_none_before_it(rod: float) -> None:
    """A crank-rocker that closes drives a second dyad from Q; the joints of the four-bar are innocent."""
    four = fourbar(4, 1, 3.5, 3)
    ground = next(body for body in four.bodies if body.is_ground)
    mechanism = replace(
        four,
        bodies=(
            *(
                replace(body, points={**body.points, "E": Point(7.0, 0.0)}) if body is ground else body
                for body in four.bodies
            ),
            Body("rod", {"Q": (0, 0), "D": (rod, 0)}, (4, 3, 0.0)),
            Body("flap", {"E": (0, 0), "D": (1, 0)}, (7, 0, 2.0)),
        ),
        joints=(
            *four.joints,
            Revolute("Q2", ("rocker.Q", "rod.Q")),
            Revolute("D", ("rod.D", "flap.D")),
            Revolute("E", ("ground.E", "flap.E")),
        ),
    )
    with pytest.raises(AssemblyError, match=r"the loop of bodies rod, flap with joints Q2, D, E does not") as caught:
        compile_plan(mechanism)
    q = exact_fourbar(4, 1, 3.5, 3, [float(four.drivers[0].law.at(0.0))]).q[0]
    away = math.dist((7.0, 0.0), (4.0 + 3.0 * math.cos(q[2]), 3.0 * math.sin(q[2])))
    lacks = away - rod - 1.0 if rod < 1.0 else rod - 1.0 - away
    assert caught.value.gap == pytest.approx(lacks, rel=1e-3)


@pytest.mark.parametrize(("lengths", "start"), [((4, 1, 3, 2), np.pi), ((2, 1, 2, 1), np.pi), ((2, 1, 2, 1), 0.0)])
def test_a_start_where_branches_cross_is_refused_as_ambiguous(lengths: tuple[float, ...], start: float) -> None:
    with pytest.raises(
        AmbiguousStartError,
        match=r"is singular .* and 2 branches leave it: at crank = .* \w+\.phi can be .* rad \(.* deg\) or .*; give",
    ):
        compile_plan(fourbar(*lengths, start=start))


@pytest.mark.parametrize("distance", [0.1, 1e-2, 1e-4, -1e-3])
@pytest.mark.parametrize("branch", [1, -1])
def test_a_start_near_a_crossing_keeps_its_branch(distance: float, branch: int) -> None:
    start = np.pi + distance
    u = [start + step * np.sign(distance) for step in (0.2, 0.8, 1.5)]  # away from the crossing
    run = solve(fourbar(2, 1, 2, 1, start=start, branch=branch), crank_angle=u)
    exact = exact_fourbar(2, 1, 2, 1, u, branch=branch)
    assert largest_error(run["rocker.phi"], exact.q[:, 2], modulo_turns=True) < 1e-13


def test_a_mechanism_of_assignments_alone_needs_no_solve() -> None:
    mechanism = Mechanism(
        "pendulum",
        [Body("ground", {"O": (0, 0)}), Body("bob", {"O": (0, 0), "tip": (2, 0)})],
        [Revolute("O", ("ground.O", "bob.O"))],
        [AngleDriver("motor", "bob", ConstantSpeed(0.5, 1.0))],
        points={"tip": "bob.tip"},
    )
    plan = compile_plan(mechanism)
    assert plan.unknowns == ()
    assert plan.outputs == ("bob.phi", "tip.x", "tip.y")


def test_what_cannot_move_at_all_is_refused() -> None:
    mechanism = Mechanism(
        "truss",
        [
            Body("ground", {"A": (0, 0), "B": (2, 0)}),
            Body("left", {"A": (0, 0), "T": (1.5, 0)}, (0, 0, 0.7)),
            Body("right", {"B": (0, 0), "T": (1.5, 0)}, (2, 0, 2.4)),
        ],
        [Revolute(name, (f"ground.{name}", f"{body}.{name}")) for name, body in (("A", "left"), ("B", "right"))]
        + [Revolute("T", ("left.T", "right.T"))],
    )
    with pytest.raises(MobilityError, match="mobility is 0: the joints leave no motion, so there is nothing to drive"):
        compile_plan(mechanism)


def test_a_body_without_joints_is_free() -> None:
    with pytest.raises(MobilityError, match="there is no driver: b can still move; add 3 drivers, or joints"):
        compile_plan(Mechanism("free", [Body("b")]))


def test_last_bits_that_differ_between_machines_do_not_reach_the_code() -> None:
    (_, z) = compile_plan(reference_fourbar()).anchor_values
    assert z == (0.0, round(z[1], 11))
