from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, Distance, Mechanism, Point, Revolute
from kinfmu.errors import InconsistentError
from kinfmu.mechanism.gallery.chains import fourbar_chain
from kinfmu.plan.equations.assembly import closed_start
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.system import System
from tests.mechanisms import bar_as_body, fourbar, reference_fourbar, six_bar
from tests.stress.trial import trial


def test_the_third_parallel_bar_is_named_with_what_implies_it() -> None:
    redundancy = find_redundancy(System(reference_fourbar()))
    assert redundancy.mobility == 1
    (row,) = redundancy.redundant
    assert (row.row.name, row.implied_by_joints) == ("AB.length", ("O", "P", "C", "Q"))
    assert abs(row.gap) < 1e-14


@pytest.mark.parametrize("degrees", [0.0, 1.0, 45.0, 90.0, 179.0, 180.0, 270.0])
def test_the_finding_does_not_depend_on_the_start_pose(degrees: float) -> None:
    redundancy = find_redundancy(System(reference_fourbar(start_degrees=degrees)))
    assert [row.row.name for row in redundancy.redundant] == ["AB.length"]


@pytest.mark.parametrize("seed", [4030, 4591, 6451, 7032])
def test_motion_is_judged_on_its_own_branch_when_a_change_point_is_near(seed: int) -> None:
    """Steps from these starts end near a change point, from where the other branch is as near."""
    redundancy = find_redundancy(System(trial(seed, "redundant parallelograms").drawn.mechanism))
    assert redundancy.mobility == 1
    assert len(redundancy.redundant) == 1
    assert redundancy.inconsistent == ()


@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0])
def test_a_bar_as_a_body_leaves_one_redundant_row_of_its_last_joint(turn: float) -> None:
    redundancy = find_redundancy(System(bar_as_body(np.radians(turn))))
    assert redundancy.mobility == 1
    (row,) = redundancy.redundant
    assert row.row.owner == "A"
    assert set(row.implied_by_joints) == {"O", "P", "C", "Q", "B"}


def test_a_loss_of_rank_at_one_pose_is_no_redundancy() -> None:
    stretched = fourbar(4.0, 1.0, 3.5, 3.0, start=1.0)
    assert find_redundancy(System(stretched)).dependent == ()
    change_point = fourbar(4.0, 1.0, 3.0, 2.0, start=3.14)
    assert find_redundancy(System(change_point)).dependent == ()
    assert find_redundancy(System(six_bar())).dependent == ()


@pytest.mark.parametrize(("length", "gap"), [(1.01, 0.01), (0.9, 0.1), (1.0 + 1e-9, 1e-9)])
def test_a_bar_of_a_wrong_length_is_inconsistent_with_its_gap(length: float, gap: float) -> None:
    mechanism = reference_fourbar(bar=length)
    (row,) = find_redundancy(System(mechanism)).inconsistent
    assert row.row.owner == "AB"
    assert abs(row.gap) == pytest.approx(gap, rel=1e-5)
    with pytest.raises(InconsistentError, match=r"\[joints\.AB\] contradicts .* O, P, C, Q closed, .* gap") as caught:
        kinfmu.solve(mechanism, [0.0])
    assert caught.value.joint == "AB"


def test_of_two_equal_bars_the_later_one_is_set_aside() -> None:
    mechanism = Mechanism(
        "twice",
        [
            Body("ground", {"O": (0, 0), "C": (4, 0)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (0, 0, 1.0)),
            Body("rocker", {"C": (0, 0), "Q": (3, 0)}, (4, 0, 1.9)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("C", ("ground.C", "rocker.C")),
            Distance("first", ("crank.P", "rocker.Q"), 3.5),
            Distance("second", ("rocker.Q", "crank.P"), 3.5),
        ],
        [AngleDriver("crank", "crank")],
    )
    (row,) = find_redundancy(System(mechanism)).redundant
    assert row.row.owner == "second"
    assert "first" in row.implied_by_joints


def test_a_redundant_bar_in_every_loop_of_a_chain_is_found_with_its_own_loop() -> None:
    count = 12
    chain, bodies = fourbar_chain(count), []
    for body in chain.bodies:
        points = dict(body.points)
        if body.name == "ground":
            points |= {f"X_{k}": Point(k - 0.7, 0.0) for k in range(1, count + 1)}
        elif body.name.startswith("coupler"):
            points["X"] = Point(0.3, 0.0)
        bodies.append(replace(body, points=points))
    bars = [Distance(f"bar_X_{k}", (f"ground.X_{k}", f"coupler_{k}.X"), 1.0) for k in range(1, count + 1)]
    redundancy = find_redundancy(System(replace(chain, bodies=tuple(bodies), joints=(*chain.joints, *bars))))
    assert redundancy.mobility == 1
    assert [row.row.owner for row in redundancy.redundant] == [bar.name for bar in bars]
    for k, row in enumerate(redundancy.redundant, start=1):
        assert row.implied_by_joints == (f"O_{k - 1}", f"O_{k}", f"P_{k}", f"Q_{k}")


def test_a_structure_without_drivers_that_is_nearly_singular_is_judged() -> None:
    pins = {"A": (9.4111, 6.619), "B": (9.4114, 6.62)}
    structure = Mechanism(
        "structure",
        [Body("ground", pins), Body("link", {**pins, "D": (-30, 0)}, (0, 0, 0))],
        [Revolute(name, (f"ground.{name}", f"link.{name}")) for name in pins],
    )
    assert find_redundancy(System(structure)).mobility == 0


def test_a_known_closed_start_gives_the_same_mobility() -> None:
    for name in ("fourbar", "parallel_jaw", "peaucellier"):
        system = System(kinfmu.load(name))
        found = find_redundancy(system)
        assert found.assembly.pose is not None
        again = find_redundancy(system, closed_start(system, found.assembly.pose.q, found.assembly.pose.u))
        assert (again.mobility, again.kept) == (found.mobility, found.kept)
