"""Contract of drivers, tested for all members of DRIVERS."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinfmu.mechanism.drivers import DRIVERS, Driver
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.graph import evaluate
from kinfmu.plan.trace import Tracer
from tests.mechanism.joints.drawn import (
    coordinates,
    jacobian_by_complex_step,
    poses,
    second_derivative,
    size,
    systems,
)
from tests.power_series import Series

every_driver = pytest.mark.parametrize("cls", DRIVERS, ids=lambda cls: cls.type)
ROUNDING = 1e-14


@every_driver
@given(data=st.data(), u=coordinates)
def test_the_jacobian_is_the_complex_step_derivative_and_the_traced_graph_gives_the_bits_of_the_residual(
    cls: type[Driver], data: st.DataObject, u: float
) -> None:
    system = data.draw(systems(cls))
    q = data.draw(poses(system))
    exact = jacobian_by_complex_step(system, q, [u])
    np.testing.assert_allclose(system.jacobian(q), exact, rtol=0.0, atol=ROUNDING * size(system, q))
    (driver,) = system.mechanism.drivers
    node = Tracer(system.mechanism).driver(driver, {})
    values = {**dict(zip(system.coordinates, map(float, q), strict=True)), driver.inputs()[0]: u}
    assert evaluate([node], values) == system.residual(q, [u]).tolist()


@every_driver
@given(data=st.data(), u=coordinates)
def test_code_of_its_row_gives_the_numbers_of_its_formula(cls: type[Driver], data: st.DataObject, u: float) -> None:
    """The value to the bit."""
    system = data.draw(systems(cls))
    q, target = data.draw(poses(system)), np.array([u])
    (member,) = system.members
    values, gradients = (
        list(system.values(member, member.coordinates(q), target)),
        system.gradients(member, member.coordinates(q)),
    )
    system.use_code()
    assert list(system.values(member, member.coordinates(q), target)) == values
    np.testing.assert_allclose(
        system.gradients(member, member.coordinates(q)), gradients, rtol=1e-14, atol=1e-15 * size(system, q)
    )


@every_driver
@given(data=st.data(), u=coordinates, ud=coordinates, udd=coordinates)
def test_velocity_and_acceleration_equations_hold_along_any_motion(
    cls: type[Driver], data: st.DataObject, u: float, ud: float, udd: float
) -> None:
    """Phi' = Phi_q qd - nu and Phi'' = Phi_q qdd - gamma, whatever q(t) and u(t) are."""
    system = data.draw(systems(cls))
    q, qd, qdd = (data.draw(poses(system)) for _ in range(3))
    motion = [Series([a, b, c / 2]) for a, b, c in zip(q, qd, qdd, strict=True)]
    target = [Series([u, ud, udd / 2])]
    first = np.array([float(phi.c[1]) for phi in system.evaluate(motion, target)])
    tolerance = 10 * ROUNDING * size(system, q, qd, qdd)
    np.testing.assert_allclose(system.jacobian(q) @ qd - system.nu(q, [u], [ud]), first, rtol=0.0, atol=tolerance)
    second = system.jacobian(q) @ qdd - system.gamma(q, qd, [u], [ud], [udd])
    np.testing.assert_allclose(second, second_derivative(system, motion, target), rtol=0.0, atol=tolerance)


@every_driver
@given(data=st.data())
def test_the_residual_of_a_driver_is_0_at_its_measured_value(cls: type[Driver], data: st.DataObject) -> None:
    system = data.draw(systems(cls))
    q = data.draw(poses(system))
    measured = system.measure(q)
    scale = system.mechanism.drivers[0].measured().scale(float(measured[0]))
    assert system.residual(q, measured) == pytest.approx([0.0], abs=1e-13)
    assert system.residual(q, measured + 1e-6) == pytest.approx([-1e-6 * scale], rel=1e-3, abs=2e-12)
    assert system.nu(q, measured, [1.0]) == pytest.approx([scale])


@every_driver
@given(data=st.data())
def test_inputs_are_named_after_the_driver_and_what_it_drives_and_a_file_holds_them(
    cls: type[Driver], data: st.DataObject
) -> None:
    mechanism = data.draw(systems(cls)).mechanism
    (driver,) = mechanism.drivers
    assert driver.inputs() == (f"member_{cls.noun}", "member_speed", "member_acceleration")
    assert parse(text(mechanism)) == mechanism
