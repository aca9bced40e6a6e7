"""All rows of the two reference mechanisms: Jacobian, nu, gamma and the dense solution, against the oracle."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import kinfmu
from kinfmu.errors import PoseError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.assembly import find_assembly
from kinfmu.plan.equations.reference import solve_reference
from kinfmu.plan.equations.system import System, size_of
from tests import oracle

MotionOf = Callable[..., list[NDArray[np.float64]]]  # (u, ud, udd) -> q, qd, qdd
FOURBAR = kinfmu.load("fourbar")
PENDULUM = kinfmu.load("double_pendulum")
WITHOUT_AB = [k for k in range(10) if k != 8]
ANGLES = [math.radians(degrees) for degrees in (10.0, 60.0, 100.0, 175.0, 200.0, 355.0)]
RATES = (0.7, -0.3)  # of the driver: speed and acceleration


def fourbar_motion(u: float, ud: float = 1.0, udd: float = 0.0) -> list[NDArray[np.float64]]:
    """q, qd, qdd of all nine coordinates: those of the report and the two pivots, which do not move."""
    tables = []
    for pivot, table in zip((1.0, 0.0, 0.0), oracle.reference_fourbar(u, ud, udd).rounded(), strict=True):
        phi1, x2, y2, phi2, phi3 = table[0]
        tables.append(np.array([0.0, 0.0, phi1, x2, y2, phi2, pivot, 0.0, phi3]))
    return tables


def pendulum_motion(u: float, ud: float = 1.0, udd: float = 0.0) -> list[NDArray[np.float64]]:
    return [table[0] for table in oracle.guided_double_pendulum(u, ud, udd).rounded()]


CASES = [(FOURBAR, fourbar_motion, u) for u in ANGLES] + [(PENDULUM, pendulum_motion, u) for u in (5.3, 5.5, 6.0)]


def test_rows_carry_their_owners_names_in_file_order() -> None:
    names = [row.name for row in System(FOURBAR).rows]
    assert names == ["O.x", "O.y", "P.x", "P.y", "C.x", "C.y", "Q.x", "Q.y", "AB.length", "crank.angle"]
    assert System(FOURBAR).joint_row_count == 9


def test_scales_turn_residuals_into_lengths() -> None:
    assert System(FOURBAR).scales.tolist() == [1.0] * 8 + [2.0, 0.5]  # a distance row 2 L; an angle at the size's end
    assert size_of(FOURBAR) == 2.0
    assert size_of(PENDULUM) == 1.0


@pytest.mark.parametrize(("mechanism", "motion", "u"), CASES)
def test_position_velocity_and_acceleration_of_the_oracle_satisfy_the_equations(
    mechanism: Mechanism, motion: MotionOf, u: float
) -> None:
    system = System(mechanism)
    ud, udd = RATES
    q, qd, qdd = motion(u, ud, udd)
    jacobian = system.jacobian(q)
    np.testing.assert_allclose(system.residual(q, [u]), 0.0, atol=4e-15)
    np.testing.assert_allclose(jacobian @ qd, system.nu(q, [u], [ud]), atol=4e-15)
    np.testing.assert_allclose(jacobian @ qdd, system.gamma(q, qd, [u], [ud], [udd]), atol=4e-15)


@pytest.mark.parametrize(("mechanism", "motion", "u"), CASES)
def test_the_dense_solution_is_the_oracles(mechanism: Mechanism, motion: MotionOf, u: float) -> None:
    system = System(mechanism)
    rows = WITHOUT_AB if mechanism is FOURBAR else range(6)
    ud, udd = RATES
    exact = motion(u, ud, udd)
    nearby = motion(u + 0.01)[0]
    found = solve_reference(system, rows, nearby, *(np.array([value]) for value in (u, ud, udd)))
    for table, expected in zip(found[:3], exact, strict=True):
        np.testing.assert_allclose(table, expected, rtol=0.0, atol=2e-13)
    assert 2 <= found.iterations <= 6


def test_the_dense_solution_says_when_newton_does_not_end() -> None:
    system = System(PENDULUM)
    unreachable = np.array([math.pi / 2.0])  # the first bar points up: y = -1 is out of the second one's reach
    one = np.array([1.0])
    with pytest.raises(PoseError, match=r"^Newton did not end: residual [0-9.e+-]+ after \d+ iterations$"):
        solve_reference(system, range(6), pendulum_motion(5.5)[0], unreachable, one, one)


def test_at_sixty_degrees_the_joint_rows_have_rank_eight_of_nine() -> None:
    """One row is redundant: over the report's five coordinates, rank 4 of 5."""
    system = System(FOURBAR)
    q = fourbar_motion(math.pi / 3.0)[0]
    joint_rows = system.jacobian(q)[:9]
    moving = [2, 3, 4, 5, 8]
    assert q[moving] == pytest.approx([math.pi / 3.0, 1.5, math.sqrt(0.75), 0.0, math.pi / 3.0], abs=1e-15)
    assert np.linalg.matrix_rank(joint_rows) == 8
    assert np.linalg.matrix_rank(joint_rows[[2, 3, 6, 7, 8]][:, moving]) == 4
    assert np.linalg.matrix_rank(np.delete(joint_rows, 8, axis=0)) == 8
    assert np.linalg.matrix_rank(system.jacobian(q)) == 9


@pytest.mark.parametrize("u", ANGLES)
def test_row_ab_is_a_combination_of_the_others_at_every_pose(u: float) -> None:
    jacobian = System(FOURBAR).jacobian(fourbar_motion(u)[0])
    weights, *_ = np.linalg.lstsq(jacobian[:8].T, jacobian[8], rcond=None)
    np.testing.assert_allclose(weights @ jacobian[:8], jacobian[8], atol=1e-13)


@pytest.mark.parametrize("u", ANGLES)
def test_the_determinant_of_the_fourbar_is_the_sine_of_coupler_less_rocker(u: float) -> None:
    q = fourbar_motion(u)[0]
    determinant = np.linalg.det(System(FOURBAR).jacobian(q)[WITHOUT_AB])
    assert abs(determinant) == pytest.approx(abs(math.sin(q[5] - q[8])), abs=1e-14)


@pytest.mark.parametrize("u", [5.3, 5.5, 6.0])
def test_the_determinant_of_the_pendulum_is_the_cosine_of_the_lower_bar(u: float) -> None:
    q = pendulum_motion(u)[0]
    assert abs(np.linalg.det(System(PENDULUM).jacobian(q))) == pytest.approx(abs(math.cos(q[5])), abs=1e-14)


@pytest.mark.parametrize("u", [0.0, math.pi])
def test_rank_is_lost_at_multiples_of_pi_and_a_small_turn_restores_it(u: float) -> None:
    system = System(FOURBAR)
    assert np.linalg.matrix_rank(system.jacobian(fourbar_motion(u)[0])[WITHOUT_AB], tol=1e-12) == 8
    assert np.linalg.matrix_rank(system.jacobian(fourbar_motion(u + 0.01)[0])[WITHOUT_AB], tol=1e-12) == 9


def test_a_bar_too_long_by_a_hundredth_has_a_gap_of_a_hundredth() -> None:
    bars = [dataclasses.replace(j, length=1.01) if isinstance(j, kinfmu.Distance) else j for j in FOURBAR.joints]
    system = System(dataclasses.replace(FOURBAR, joints=tuple(bars)))
    gaps = system.gaps(system.residual(fourbar_motion(1.0)[0], [1.0]))
    assert gaps == pytest.approx([0.0] * 8 + [-0.01], abs=1e-14)


def test_the_scaled_jacobian_does_not_depend_on_the_unit_of_length() -> None:
    """The pendulum in millimetres has the same pure numbers, so the same margin."""
    lines = text(PENDULUM).splitlines()
    source = "\n".join(line.replace('length = "m"', 'length = "mm"') for line in lines)
    for lengths, longer in (("[-1.0, 0.0]", "[-1e3, 0.0]"), ("value = -1.0", "value = -1e3")):
        source = source.replace(lengths, longer)
    for lengths, longer in (("x = 0.5, y = -0.866", "x = 500, y = -866"), ("x = 1.5, y = -1.0", "x = 1500, y = -1e3")):
        assert lengths in source
        source = source.replace(lengths, longer)
    in_metres, in_millimetres = System(PENDULUM), System(parse(source))
    q = pendulum_motion(5.5)[0]
    longer_q = q * np.array([1e3, 1e3, 1.0] * 2)
    np.testing.assert_allclose(
        in_millimetres.scaled_jacobian(longer_q), in_metres.scaled_jacobian(q), rtol=1e-14, atol=1e-14
    )
    one, other = find_assembly(in_metres).pose, find_assembly(in_millimetres).pose
    assert one is not None
    assert other is not None
    assert other.margin == pytest.approx(one.margin, rel=1e-9)


def test_assembly_closes_the_rough_start_pose_of_the_report() -> None:
    assembled = find_assembly(System(PENDULUM)).pose
    assert assembled is not None
    exact = pendulum_motion(math.radians(300.0))[0]
    assert assembled.q == pytest.approx(exact, abs=1e-11)
    assert assembled.u == pytest.approx([5.0 * math.pi / 3.0])
