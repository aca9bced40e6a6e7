"""Code as a skilled user of numpy writes it: equations of each kind of constraint and their derivatives, by hand.

    a = A s                                           from the origin of a body's frame to its point
    d = r_j + a_j - r_i - a_i                         between two points
    revolute    Phi = d                               distance              Phi = |d| - L
    slide       Phi = [n.d; phi_j - phi_i - angle]    driver of an angle    Phi = phi - u

The matrix is allocated once and holds its constants; scalar arithmetic fills what moves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.case import Case, Motion
from benchmarks.engine import GAP, BenchEngine, EngineSetting, Sampler
from kinfmu.arrays import FloatArray
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import AngleDriver, DistanceDriver
from kinfmu.mechanism.joints import Distance, Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of

CLOSED = 1e-14  # residual relative to the size at which Newton ends
MOST = 25  # iterations

PointOf = tuple[int, float, float]  # number of the body, s_x, s_y


def _sampler(case: Case, setting: EngineSetting) -> Sampler | None:
    """Return a sampler: Newton with an analytic Jacobian and `numpy.linalg.solve` over all coordinates.

    None if the case has a joint or driver of another kind.
    """
    try:
        equations = _Equations(case)
    except NotImplementedError:
        return None
    bound = setting.tolerance * case.system.size
    chosen = np.array([case.system.coordinates.index(name) for name in case.columns])
    gap = (GAP,) * (3 * len(chosen))
    samples = list(zip(case.t, case.u, case.ud, case.udd, strict=True))
    solve: Callable[..., FloatArray] = np.linalg.solve
    jacobian = equations.jacobian

    def take(count: int) -> Motion:
        last, last_t = case.start_coordinates, case.t[0]
        qd = qdd = np.zeros_like(last)
        motion: list[Sequence[float]] = []
        for t, u, ud, udd in samples[:count]:
            q, h = last, t - last_t
            if setting.predictor == 1:
                q = q + h * qd
            elif setting.predictor == 2:
                q = q + h * (qd + 0.5 * h * qdd)
            try:
                for _ in range(MOST):
                    residual = equations.position(q.tolist(), u)
                    if max(map(abs, residual)) <= bound:
                        break
                    q = q - solve(jacobian, residual)
                else:
                    raise ArithmeticError
                speeds = solve(jacobian, equations.velocity(ud))
                accelerations = solve(jacobian, equations.acceleration(speeds.tolist(), udd))
            except (ArithmeticError, ValueError, np.linalg.LinAlgError):  # go on from the last pose
                motion.append(gap)
                continue
            last, last_t, qd, qdd = q, t, speeds, accelerations
            motion.append([*q[chosen], *qd[chosen], *qdd[chosen]])
        return motion

    return take


class _Equations:
    """The rows of a case. The ground is an additional last body; rows that the case leaves out share an additional row.

    Call `position` first at a pose: it fills `jacobian`, and keeps what `velocity` and `acceleration` need.

    Raises:
        NotImplementedError: The case has a joint or driver of another kind.

    """

    def __init__(self, case: Case) -> None:
        mechanism = case.mechanism
        number = {body.name: k for k, body in enumerate(mechanism.moving_bodies)}
        number[GROUND_NAME] = len(number)
        self.size = len(case.rows)
        self.width = width = 3 * len(number)
        matrix = np.zeros((self.size + 1, width))
        self.jacobian = matrix[: self.size, : width - 3]
        self.entries = matrix.reshape(-1)
        self.pins: list[tuple[int, int, PointOf, PointOf]] = []  # row of x, row of y
        self.bars: list[tuple[int, PointOf, PointOf, float]] = []  # row, length
        self.slides: list[tuple[int, PointOf, PointOf, tuple[float, float]]] = []  # row, n in the frame of i
        self.angles: list[tuple[int, int, int, float]] = []  # row, i, j, angle
        self.driven: list[int] = [self.size] * len(mechanism.drivers)  # row of each driver
        place = {row: k for k, row in enumerate(case.rows)}

        def end(name: str) -> PointOf:
            x, y = mechanism.body_points[name]
            return number[body_of(name)], float(x), float(y)

        def ends(pair: tuple[str, str]) -> tuple[PointOf, PointOf]:
            return end(pair[0]), end(pair[1])

        for member in case.system.members:
            one = member.owner
            first, second = (place.get(member.rows[0] + k, self.size) for k in range(2))
            if member.driver is not None:
                self.driven[member.driver] = first
            if isinstance(one, Revolute):
                self.pins.append((first, second, *ends(one.between)))
            elif isinstance(one, Distance):
                self.bars.append((first, *ends(one.between), float(one.length)))
            elif isinstance(one, DistanceDriver):
                self.bars.append((first, *ends(one.between), 0.0))
            elif isinstance(one, Translational):
                a, b = ends(one.between)
                self.slides.append((first, a, b, (-math.sin(one.axis), math.cos(one.axis))))
                self.angles.append((second, a[0], b[0], float(one.angle)))
            elif isinstance(one, AngleDriver):
                self.angles.append((first, number[GROUND_NAME], number[one.of], 0.0))
            else:
                raise NotImplementedError(one.name)
        for row_x, row_y, (i, *_), (j, *_) in self.pins:
            matrix[[row_x, row_y], [3 * i, 3 * i + 1]] = -1.0
            matrix[[row_x, row_y], [3 * j, 3 * j + 1]] = 1.0
        for row, i, j, _ in self.angles:
            matrix[row, [3 * i + 2, 3 * j + 2]] = -1.0, 1.0

    def position(self, coordinates: list[float], u: Sequence[float]) -> list[float]:
        """Return Phi (m,) at all coordinates (n,) and driver values (d,), and fill Phi_q."""
        entries, width = self.entries, self.width
        self.q = q = [*coordinates, 0.0, 0.0, 0.0]
        self.cos = c = list(map(math.cos, q[2::3]))
        self.sin = s = list(map(math.sin, q[2::3]))
        phi = [0.0] * (self.size + 1)
        for row_x, row_y, (i, s_ix, s_iy), (j, s_jx, s_jy) in self.pins:
            a_ix, a_iy = c[i] * s_ix - s[i] * s_iy, s[i] * s_ix + c[i] * s_iy
            a_jx, a_jy = c[j] * s_jx - s[j] * s_jy, s[j] * s_jx + c[j] * s_jy
            at_i, at_j = 3 * i, 3 * j
            phi[row_x] = q[at_j] + a_jx - q[at_i] - a_ix
            phi[row_y] = q[at_j + 1] + a_jy - q[at_i + 1] - a_iy
            first, second = row_x * width + 2, row_y * width + 2
            entries[first + at_i], entries[second + at_i] = a_iy, -a_ix
            entries[first + at_j], entries[second + at_j] = -a_jy, a_jx
        for row, a, b, length in self.bars:
            a_i, a_j, (dx, dy) = self._between(a, b)
            distance = math.hypot(dx, dy)
            phi[row] = distance - length
            self._along(row, a[0], b[0], (dx / distance, dy / distance), a_i, a_j)
        for row, a, b, (n_x, n_y) in self.slides:
            a_i, a_j, (dx, dy) = self._between(a, b)
            i = a[0]
            n = c[i] * n_x - s[i] * n_y, s[i] * n_x + c[i] * n_y
            phi[row] = n[0] * dx + n[1] * dy
            self._along(row, i, b[0], n, a_i, a_j)
            entries[row * width + 3 * i + 2] += n[0] * dy - n[1] * dx
        for row, i, j, angle in self.angles:
            phi[row] = q[3 * j + 2] - q[3 * i + 2] - angle
        for row, value in zip(self.driven, u):  # noqa: B905  both have one entry per driver
            phi[row] -= value
        del phi[self.size]
        return phi

    def velocity(self, ud: Sequence[float]) -> list[float]:
        """Return nu (m,), the right side of Phi_q qd = nu, at driver speeds (d,)."""
        nu = [0.0] * (self.size + 1)
        for row, speed in zip(self.driven, ud):  # noqa: B905  both have one entry per driver
            nu[row] = speed
        del nu[self.size]
        return nu

    def acceleration(self, speeds: list[float], udd: Sequence[float]) -> list[float]:
        """Return gamma (m,), the right side of Phi_q qdd = gamma, at velocities (n,) and driver accelerations (d,)."""
        qd = [*speeds, 0.0, 0.0, 0.0]
        c, s = self.cos, self.sin
        squares = [omega * omega for omega in qd[2::3]]
        gamma = [0.0] * (self.size + 1)
        for row_x, row_y, (i, s_ix, s_iy), (j, s_jx, s_jy) in self.pins:
            w_i, w_j = squares[i], squares[j]
            gamma[row_x] = w_j * (c[j] * s_jx - s[j] * s_jy) - w_i * (c[i] * s_ix - s[i] * s_iy)
            gamma[row_y] = w_j * (s[j] * s_jx + c[j] * s_jy) - w_i * (s[i] * s_ix + c[i] * s_iy)
        for row, a, b, _ in self.bars:
            _, _, (dx, dy) = self._between(a, b)
            distance = math.hypot(dx, dy)
            (vx, vy), (px, py) = self._rates(a, b, qd)
            along = (dx * vx + dy * vy) / distance
            gamma[row] = (dx * px + dy * py - vx * vx - vy * vy + along * along) / distance
        for row, a, b, (n_x, n_y) in self.slides:
            _, _, (dx, dy) = self._between(a, b)
            (vx, vy), (px, py) = self._rates(a, b, qd)
            i = a[0]
            nx, ny, omega = c[i] * n_x - s[i] * n_y, s[i] * n_x + c[i] * n_y, qd[3 * i + 2]
            turning = omega * (omega * (nx * dx + ny * dy) - 2.0 * (nx * vy - ny * vx))
            gamma[row] = nx * px + ny * py + turning
        for row, value in zip(self.driven, udd):  # noqa: B905  both have one entry per driver
            gamma[row] += value
        del gamma[self.size]
        return gamma

    def _between(self, a: PointOf, b: PointOf) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
        """Return a_i, a_j and d."""
        q, c, s = self.q, self.cos, self.sin
        (i, s_ix, s_iy), (j, s_jx, s_jy) = a, b
        a_i = c[i] * s_ix - s[i] * s_iy, s[i] * s_ix + c[i] * s_iy
        a_j = c[j] * s_jx - s[j] * s_jy, s[j] * s_jx + c[j] * s_jy
        return a_i, a_j, (q[3 * j] + a_j[0] - q[3 * i] - a_i[0], q[3 * j + 1] + a_j[1] - q[3 * i + 1] - a_i[1])

    def _along(
        self,
        row: int,
        i: int,
        j: int,
        n: tuple[float, float],
        a_i: tuple[float, float],
        a_j: tuple[float, float],
    ) -> None:
        """Fill the derivatives of n.d along a fixed n."""
        entries, first, second = self.entries, row * self.width + 3 * i, row * self.width + 3 * j
        nx, ny = n
        entries[first], entries[first + 1], entries[first + 2] = -nx, -ny, nx * a_i[1] - ny * a_i[0]
        entries[second], entries[second + 1], entries[second + 2] = nx, ny, ny * a_j[0] - nx * a_j[1]

    def _rates(self, a: PointOf, b: PointOf, qd: list[float]) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return d', and the part of -d'' that holds at any accelerations: w_j^2 a_j - w_i^2 a_i."""
        a_i, a_j, _ = self._between(a, b)
        vx_i, vy_i, w_i = qd[3 * a[0] : 3 * a[0] + 3]
        vx_j, vy_j, w_j = qd[3 * b[0] : 3 * b[0] + 3]
        rate = vx_j - w_j * a_j[1] - vx_i + w_i * a_i[1], vy_j + w_j * a_j[0] - vy_i - w_i * a_i[0]
        return rate, (w_j * w_j * a_j[0] - w_i * w_i * a_i[0], w_j * w_j * a_j[1] - w_i * w_i * a_i[1])


NUMPY_NEWTON = BenchEngine(
    "numpy Newton",
    _sampler,
    settings=tuple(EngineSetting(order, tolerance) for order in range(3) for tolerance in (1e-3, 1e-9, CLOSED)),
    usual=EngineSetting(2, CLOSED),
)
