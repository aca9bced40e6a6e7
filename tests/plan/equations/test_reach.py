"""Proof that rows close in no pose: against closed forms, and never for what closes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.mechanism.body import Body
from kinfmu.mechanism.drivers import AngleDriver, DistanceDriver, RelativeAngleDriver
from kinfmu.mechanism.joints import Angle, Distance, Joint, Revolute
from kinfmu.plan import compile_plan
from kinfmu.plan.equations import assembly
from kinfmu.plan.equations.closing import CLOSED, close
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.reach import cannot_close
from kinfmu.plan.equations.system import System
from tests.mechanisms import bar_linkage, five_bar, six_bar, with_robot

length = st.floats(0.1, 10.0)
CRANK = [Body("ground", {"O": (0, 0), "C": (4, 0)}), Body("crank", {"O": (0, 0), "P": (1, 0)})]


def bars(ground: float, crank: float, coupler: float, rocker: float, *, pinned: bool) -> Mechanism:
    """A four-bar without start poses; its coupler and rocker are bodies, or rows of distances."""
    bodies = [Body("ground", {"O": (0, 0), "C": (ground, 0)}), Body("crank", {"O": (0, 0), "P": (crank, 0)})]
    joints: list[Joint] = [Revolute("O", ("ground.O", "crank.O"))]
    if pinned:
        bodies += [Body("coupler", {"P": (0, 0), "Q": (coupler, 0)}), Body("rocker", {"C": (0, 0), "Q": (rocker, 0)})]
        joints += [Revolute("P", ("crank.P", "coupler.P")), Revolute("Q", ("coupler.Q", "rocker.Q"))]
        joints += [Revolute("C", ("ground.C", "rocker.C"))]
    else:
        bodies += [Body("rocker", {"C": (0, 0), "Q": (rocker, 0)})]
        joints += [Revolute("C", ("ground.C", "rocker.C")), Distance("PQ", ("crank.P", "rocker.Q"), coupler)]
    return Mechanism("bars", bodies, joints, [AngleDriver("crank", "crank")])


@given(ground=length, crank=length, coupler=length, rocker=length, angle=st.floats(-7.0, 7.0), pinned=st.booleans())
def test_a_four_bar_is_proved_open_exactly_where_coupler_and_rocker_do_not_meet(
    ground: float, crank: float, coupler: float, rocker: float, angle: float, pinned: bool
) -> None:
    system = System(bars(ground, crank, coupler, rocker, pinned=pinned))
    across = math.hypot(ground - crank * math.cos(angle), crank * math.sin(angle))
    missing = max(across - coupler - rocker, abs(coupler - rocker) - across)
    assume(abs(missing) > 1e-5 * system.size)
    assert cannot_close(Part(system), np.array([angle])) == (missing > 0.0)


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(7)
def test_nothing_that_closes_is_proved_open(name: str) -> None:
    mechanism = kinfmu.load(name)
    system = System(mechanism)
    run = kinfmu.solve(mechanism, np.linspace(mechanism.run.start, mechanism.run.stop, 9))
    for k in np.flatnonzero(run.good):
        assert not cannot_close(Part(system), run.inputs[k, ::3])


@given(data=st.data())
def test_nothing_that_closes_from_random_starts_is_proved_open(data: st.DataObject) -> None:
    mechanism = data.draw(st.sampled_from([six_bar(), five_bar(), bar_linkage(), with_robot(bar_linkage())]))
    system = System(mechanism)
    u = np.array([data.draw(st.floats(-7.0, 7.0)) for _ in mechanism.drivers])
    rough = np.array(
        data.draw(st.lists(st.floats(-3.0, 3.0), min_size=len(system.coordinates), max_size=len(system.coordinates)))
    )
    _, gap = close(system, rough * system.column_scales, u)
    if cannot_close(Part(system), u):
        assert gap > CLOSED


def test_a_driven_distance_that_is_too_long_is_proved_open() -> None:
    arm = Body("arm", {"O": (0, 0), "E": (3, 0)})
    mechanism = Mechanism(
        "cylinder",
        [Body("ground", {"O": (0, 0), "B": (5, 0)}), arm],
        [Revolute("O", ("ground.O", "arm.O"))],
        [DistanceDriver("cylinder", ("ground.B", "arm.E"))],
    )
    system = System(mechanism)
    open_at = {reach: cannot_close(Part(system), np.array([reach])) for reach in (1.9, 2.1, 5.0, 7.9, 8.1)}
    assert open_at == {1.9: True, 2.1: False, 5.0: False, 7.9: False, 8.1: True}


def test_angles_are_known_from_held_and_driven_ones_in_any_order() -> None:
    """Two links, the second set against the first, whose angle is held; their end must be 2 from the point C."""
    links = [Body("upper", {"A": (0, 0), "B": (1, 0)}), Body("fore", {"B": (0, 0), "E": (1, 0)})]
    mechanism = Mechanism(
        "arm",
        [Body("ground", {"A": (0, 0), "C": (0, 3)}), *links],
        [
            Distance("reach", ("fore.E", "ground.C"), 2.0),
            Revolute("B", ("upper.B", "fore.B")),
            Revolute("A", ("ground.A", "upper.A")),
            Angle("held", "upper", math.radians(90)),
        ],
        [RelativeAngleDriver("elbow", ("upper", "fore"))],
    )
    system = System(mechanism)
    end_at = {0.0: 1.0, math.pi / 2: math.hypot(1.0, 2.0), math.acos(0.25): 2.0}  # its distance from C
    for elbow, apart in end_at.items():
        assert cannot_close(Part(system), np.array([elbow])) == (abs(apart - 2.0) > 1e-6)


def test_two_bars_between_the_same_points_and_two_pins_that_do_not_fit_are_proved_open() -> None:
    crank_pin = Revolute("O", ("ground.O", "crank.O"))
    for second, is_open in ((3.0, False), (3.1, True)):
        rods = [Distance("one", ("crank.P", "ground.C"), 3.0), Distance("two", ("crank.P", "ground.C"), second)]
        system = System(Mechanism("rods", CRANK, [crank_pin, *rods], []))
        assert cannot_close(Part(system), np.zeros(0)) == is_open
    for at, is_open in (((1.0, 0.0), False), ((1.1, 0.0), True)):
        bodies = [Body("ground", {"O": (0, 0), "P": at}), CRANK[1]]
        system = System(Mechanism("pins", bodies, [crank_pin, Revolute("P", ("ground.P", "crank.P"))], []))
        assert cannot_close(Part(system), np.zeros(0)) == is_open


def test_bodies_outside_of_a_part_are_where_they_are() -> None:
    system = System(bars(4.0, 1.0, 3.5, 3.0, pinned=True))
    rows = [k for k, row in enumerate(system.rows) if row.owner in ("P", "Q", "C")]
    columns = [k for k, name in enumerate(system.coordinates) if name.owner in ("coupler", "rocker")]
    at = np.zeros(len(system.coordinates))
    for x, is_open in ((0.0, False), (-3.4, False), (-3.6, True), (2.4, False), (2.6, True), (3.6, False)):
        at[0] = x
        assert cannot_close(Part(system, rows, columns, at), np.zeros(1)) == is_open


def test_of_a_loop_in_its_block_the_origins_of_frames_are_known() -> None:
    """The block of a four-bar's loop has the rows of Q and the angles of coupler and rocker alone."""
    system = System(bars(4.0, 1.0, 3.5, 3.0, pinned=True))
    rows = [k for k, row in enumerate(system.rows) if row.owner == "Q"]
    columns = [k for k, name in enumerate(system.coordinates) if name.owner in ("coupler", "rocker") and name.is_angle]
    at = np.zeros(len(system.coordinates))
    at[system.coordinates.index("rocker.x")] = 4.0
    for x, is_open in ((1.0, False), (-2.4, False), (-2.6, True), (3.4, False), (3.6, True)):
        at[system.coordinates.index("coupler.x")] = x
        assert cannot_close(Part(system, rows, columns, at), np.zeros(1)) == is_open


def test_a_design_that_is_proved_open_is_reported_as_before_without_random_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mechanism = bars(9.0, 1.0, 3.0, 4.0, pinned=True)
    messages = []
    for proof in (cannot_close, lambda *_: False):
        monkeypatch.setattr(assembly, "cannot_close", proof)
        monkeypatch.setattr("kinfmu.plan.open_loop.cannot_close", proof)
        with pytest.raises(KinfmuError) as error:
            compile_plan(mechanism)
        messages.append(str(error.value))
    assert messages[0] == messages[1]
    monkeypatch.setattr(assembly, "cannot_close", cannot_close)
    monkeypatch.setattr(assembly, "assemble_from_random_starts", lambda *_: pytest.fail("it was searched for"))
    with pytest.raises(KinfmuError, match="does not close"):
        compile_plan(mechanism)
