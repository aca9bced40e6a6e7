"""Contract of joints, tested for all members of JOINTS."""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from typing import Any, get_type_hints

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.joints import JOINTS, CamRoller, Coupling, Joint
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.closing import CLOSED, close
from kinfmu.plan.equations.graph import evaluate
from kinfmu.plan.equations.system import System
from kinfmu.plan.trace import Tracer
from tests.mechanism.joints.drawn import (
    angles,
    coordinates,
    jacobian_by_complex_step,
    poses,
    regular_poses,
    second_derivative,
    size,
    systems,
)
from tests.power_series import Series

PAIRS = tuple(cls for cls in JOINTS if "between" in {field.name for field in dataclasses.fields(cls)})

SLANTED = (CamRoller, Coupling)  # what they measure does not grow by d when a body is displaced by d

every_joint = pytest.mark.parametrize("cls", JOINTS, ids=lambda cls: cls.type)
every_pair = pytest.mark.parametrize("cls", PAIRS, ids=lambda cls: cls.type)
NO_DRIVERS = np.zeros(0)
ROUNDING = 1e-14


@cache
def moving(cls: type[Joint]) -> st.SearchStrategy[tuple[str, str]]:
    """Return the two moving bodies, as points or as names, as the joint's `between` needs them."""
    is_body = Reference("body") in get_type_hints(cls, include_extras=True)["between"].__metadata__
    pair = ("left", "right") if is_body else ("left.P", "right.Q")
    return st.sampled_from([pair, pair[::-1]])


def closed(data: st.DataObject, cls: type[Joint], **given: st.SearchStrategy[Any]) -> tuple[System, FloatArray]:
    """Draw a system in a pose where its joint holds."""
    system = data.draw(systems(cls, **given))
    q, gap = close(system, data.draw(poses(system)), NO_DRIVERS)
    assume(gap <= CLOSED)
    return system, q


@every_joint
@given(data=st.data())
def test_there_is_one_label_scale_residual_and_gap_a_row_at_any_time_and_a_file_holds_them(
    cls: type[Joint], data: st.DataObject
) -> None:
    """A joint that is not between two bodies says that it is absolute."""
    system = data.draw(systems(cls))
    (joint,) = system.mechanism.joints
    q = data.draw(poses(system))
    residual = system.residual(q, NO_DRIVERS)
    assert len(residual) == len(cls.labels) == len(joint.scales()) == len(joint.gaps(tuple(residual)))
    assert all(scale > 0.0 for scale in joint.scales())
    assert not system.nu(q, NO_DRIVERS, NO_DRIVERS).any()
    assert len(joint.bodies()) == len(set(joint.bodies()))
    assert (len(joint.bodies()) > 1) == (cls in PAIRS) or cls is Coupling  # it may be either
    assert cls in PAIRS or "absolute" in (cls.__doc__ or "")
    again = parse(text(system.mechanism))
    assert again == system.mechanism
    assert hash(again) == hash(system.mechanism)


@every_joint
@given(data=st.data())
def test_the_jacobian_is_the_complex_step_derivative_and_0_for_bodies_that_the_joint_does_not_name(
    cls: type[Joint], data: st.DataObject
) -> None:
    system = data.draw(systems(cls))
    q = data.draw(regular_poses(system))
    jacobian = system.jacobian(q)
    exact = jacobian_by_complex_step(system, q, [])
    np.testing.assert_allclose(jacobian, exact, rtol=0.0, atol=ROUNDING * size(system, q))
    (joint,) = system.mechanism.joints
    for k, name in enumerate(system.coordinates):
        if name.partition(".")[0] not in joint.bodies():
            assert not jacobian[:, k].any()


@every_joint
@given(data=st.data())
def test_gamma_is_minus_the_second_derivative_and_the_acceleration_equation_holds_along_any_motion(
    cls: type[Joint], data: st.DataObject
) -> None:
    """Phi'' = Phi_q qdd - gamma, whatever q, qd and qdd are."""
    system = data.draw(systems(cls))
    q, qd, qdd = data.draw(regular_poses(system)), data.draw(poses(system)), data.draw(poses(system))
    gamma = system.gamma(q, qd, NO_DRIVERS, NO_DRIVERS, NO_DRIVERS)
    motion = [Series([a, b, 0]) for a, b in zip(q, qd, strict=True)]
    exact = -second_derivative(system, motion, [])
    np.testing.assert_allclose(gamma, exact, rtol=ROUNDING, atol=ROUNDING * size(system, q, qd))  # laws may be steep
    motion = [Series([a, b, c / 2]) for a, b, c in zip(q, qd, qdd, strict=True)]
    exact = second_derivative(system, motion, [])
    second = system.jacobian(q) @ qdd - gamma
    np.testing.assert_allclose(second, exact, rtol=0.0, atol=10 * ROUNDING * size(system, q, qd, qdd))


@every_joint
@given(data=st.data())
def test_the_traced_graph_gives_the_bits_of_direct_evaluation_and_its_derivatives_the_jacobian(
    cls: type[Joint], data: st.DataObject
) -> None:
    system = data.draw(systems(cls))
    q = data.draw(regular_poses(system))
    tracer = Tracer(system.mechanism)
    nodes = tracer.joint(system.mechanism.joints[0], {})
    values = dict(zip(system.coordinates, map(float, q), strict=True))
    assert evaluate(nodes, values) == system.residual(q, NO_DRIVERS).tolist()
    jacobian = system.jacobian(q)
    for k, name in enumerate(system.coordinates):
        rates = {tracer.symbols[name]: tracer.graph.constant(1.0)}
        column = evaluate(tracer.graph.derivative(nodes, rates), values)
        np.testing.assert_allclose(column, jacobian[:, k], rtol=0.0, atol=ROUNDING * size(system, q))


@every_pair
@given(data=st.data(), shift_x=coordinates, shift_y=coordinates, turn=angles)
def test_moving_both_bodies_together_keeps_a_closed_joint_closed_and_is_not_resisted(
    cls: type[Joint], data: st.DataObject, shift_x: float, shift_y: float, turn: float
) -> None:
    """Phi_q times the three rigid motions of the plane is zero in a closed pose.

    For joints between two bodies; a joint on a single body depends on the world frame.
    """
    system, q = closed(data, cls, between=moving(cls))
    assume("ground" not in system.mechanism.joints[0].bodies())
    c, s = math.cos(turn), math.sin(turn)
    moved = [
        coordinate
        for x, y, phi in q.reshape(-1, 3)
        for coordinate in (shift_x + c * x - s * y, shift_y + s * x + c * y, phi + turn)
    ]
    gaps = system.residual(moved, NO_DRIVERS) / system.scales
    np.testing.assert_allclose(gaps, 0.0, atol=ROUNDING * 10 * size(system, q, np.array(moved)))
    rigid = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-y, x, 1.0]] for x, y, _ in q.reshape(-1, 3)])  # (b, 3, 3)
    resisted = system.jacobian(q) @ rigid.transpose(0, 2, 1).reshape(-1, 3)
    np.testing.assert_allclose(resisted, 0.0, atol=1e-11 * size(system, q))


@pytest.mark.parametrize("cls", [cls for cls in JOINTS if cls not in SLANTED], ids=lambda cls: cls.type)
@given(data=st.data(), outwards=st.sampled_from([1.0, -1.0]))
def test_a_body_displaced_by_d_gives_a_residual_of_d_times_the_scale(
    cls: type[Joint], data: st.DataObject, outwards: float
) -> None:
    system, q = closed(data, cls)
    (joint,) = system.mechanism.joints
    d = outwards * 1e-6 * min(1.0, *joint.scales())
    body = joint.bodies()[:2][-1]  # the second of two: the first carries the line, or the gear that is counted from
    assume(body != "ground")
    at = system.coordinates.index(f"{body}.x")
    for k, (scale, kind) in enumerate(zip(joint.scales(), joint.kinds(), strict=True)):
        moved = slice(at, at + 2) if kind == "length" else slice(at + 2, at + 3)
        gradient = system.jacobian(q)[k, moved]
        displaced = q.copy()
        displaced[moved] += d * gradient / np.linalg.norm(gradient)
        residual = system.residual(displaced, NO_DRIVERS)
        assert residual[k] / scale == pytest.approx(d, rel=1e-4)
        assert joint.gaps(tuple(residual))[k] == pytest.approx(d, rel=1e-4)


@every_joint
@given(data=st.data())
def test_code_of_its_rows_gives_the_numbers_of_its_formulas(cls: type[Joint], data: st.DataObject) -> None:
    """Values to the bit; gradients to the rounding of a root."""
    system = data.draw(systems(cls))
    q = data.draw(regular_poses(system))
    (member,) = system.members
    values, gradients = (
        list(system.values(member, member.coordinates(q), NO_DRIVERS)),
        system.gradients(member, member.coordinates(q)),
    )
    system.use_code()
    assert list(system.values(member, member.coordinates(q), NO_DRIVERS)) == values
    np.testing.assert_allclose(
        system.gradients(member, member.coordinates(q)), gradients, rtol=1e-14, atol=1e-15 * size(system, q)
    )
