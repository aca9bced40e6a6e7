"""An oracle of 50 digits: what the motion of a mechanism is, by other means than kinfmu's.

It shares no code with kinfmu. Two independent ways lead to an answer, and tests/test_oracle.py holds them against each
other:

* closed forms of four mechanisms (`reference_fourbar`, `guided_double_pendulum`, `fourbar`, `slider_crank`);
* residuals of any mechanism, written here by hand as `residual(q, u)` with + - * / and this module's sin, cos, sqrt;
  position by Newton (`solve`), or along the branch and through isolated singular points (`follow`).

Derivatives are exact in both: everything runs on truncated power series, none is a difference quotient. Numbers that
come in are taken as they are: a float is the double it is, a string is that decimal number. Results are mpmath numbers
good to 50 digits in arrays of objects; `Motion.rounded()` gives the nearest doubles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.power_series import DIGITS, Real, Series, asin, atan2, cos, mp, sin, sin_cos, sqrt

__all__ = [
    "Motion",
    "Series",
    "cos",
    "follow",
    "fourbar",
    "guided_double_pendulum",
    "largest_error",
    "mp",
    "reference_fourbar",
    "sin",
    "sin_cos",
    "slider_crank",
    "solve",
    "sqrt",
]

SINGULAR = mp.mpf("2e-4")  # 1 / condition below which a pose is interpolated, not solved
GAP = mp.mpf("0.01")  # [rad or length]; nodes of an interpolation lie this far off, up to twice as far
NODES = 16  # on either side: the error is about (1.45 GAP / radius of convergence)^32 < 1e-50
PREDICTOR_ORDER = 10
LOST = mp.mpf("1e-3")  # a correction this large means that the prediction was no prediction

Input = float | str | Real | Iterable[float | str | Real]
Residual = Callable[[Sequence[Series], Any], Sequence[Any]]  # (q, u) -> m rows; u one Series, or a list of them


class Motion(NamedTuple):
    """Coordinates with their rates and accelerations, each (n, m), of mpmath numbers or of doubles."""

    q: NDArray[Any]
    qd: NDArray[Any]
    qdd: NDArray[Any]

    def rounded(self) -> Motion:
        """The nearest doubles."""
        return Motion(*(table.astype(np.float64) for table in self))


def largest_error(values: ArrayLike, exact: NDArray[Any], *, modulo_turns: bool = False) -> float:
    """The largest |values - exact|, subtracted in full precision; NaN if there is one among the values.

    modulo_turns: angles 2 pi k apart are equal.
    """
    if np.isnan(np.asarray(values, dtype=float)).any():
        return float("nan")
    gaps = [mp.mpf(float(a)) - b for a, b in zip(np.ravel(values), np.ravel(exact), strict=True)]
    if modulo_turns:
        gaps = [gap - 2 * mp.pi * mp.nint(gap / (2 * mp.pi)) for gap in gaps]
    return float(max(abs(gap) for gap in gaps))


# ---------------------------------------------------------------------------------------------------- closed forms


def reference_fourbar(u: Input, ud: Input = 1, udd: Input = 0) -> Motion:
    """The reference four-bar on its parallelogram branch: q = [phi1, x2, y2, phi2, phi3].

        x2 = 1 + cos phi1,   y2 = sin phi1,   phi2 = 0,   phi3 = phi1

    u, ud, udd: crank angle [rad] with its rates, numbers or lists of n.
    """

    def coordinates(phi1: Series) -> list[Series]:
        s, c = sin_cos(phi1)
        return [phi1, 1 + c, s, phi1 * 0, phi1]

    return _evaluate(coordinates, u, ud, udd)


def guided_double_pendulum(u: Input, ud: Input = 1, udd: Input = 0) -> Motion:
    """The guided double pendulum on the branch of its start pose: q = [x1, y1, phi1, x2, y2, phi2].

        phi2 = 2 pi + asin(-1 - sin phi1)      bars of length 1, the second tip on y = -1

    u, ud, udd: angle of the upper bar, between pi and 2 pi [rad], with its rates; numbers or lists of n.
    """

    def coordinates(phi1: Series) -> list[Series]:
        s, c = sin_cos(phi1)
        _reachable(abs(1 + s.c[0]) < 1, phi1, "the second bar does not reach y = -1")
        phi2 = 2 * mp.pi + asin(-1 - s)
        return [c, s, phi1, c + cos(phi2), phi1 * 0 - 1, phi2]

    return _evaluate(coordinates, u, ud, udd)


def fourbar(
    ground: float | str,
    crank: float | str,
    coupler: float | str,
    rocker: float | str,
    u: Input,
    ud: Input = 1,
    udd: Input = 0,
    *,
    branch: int = 1,
) -> Motion:
    """Any four-bar, crank pivot (0, 0) and rocker pivot (ground, 0): angles [crank, coupler, rocker] [rad].

        P = crank (cos u, sin u),   d = (ground, 0) - P
        Q = P + (e d + branch h d_turned_left) / |d|
        e = (coupler^2 - rocker^2 + d.d) / (2 |d|),   h^2 = coupler^2 - e^2

    branch: 1, Q left of the diagonal d from the crank's tip to the rocker's pivot; -1, right of it. On a linkage with
    a change point the smooth motion changes its sign there; exactly at one take `follow`. The coupler's and the
    rocker's angles are principal values, in (-pi, pi].
    """
    g, a, b, c = (mp.mpf(length) for length in (ground, crank, coupler, rocker))

    def coordinates(phi: Series) -> list[Series]:
        s, co = sin_cos(phi)
        px, py = a * co, a * s
        dx, dy = g - px, -py
        squared = dx * dx + dy * dy
        along = (b * b - c * c + squared) / (2 * squared)  # e / |d|
        offset = b * b / squared - along * along  # (h / |d|)^2
        _reachable(offset.c[0] > 0, phi, "coupler and rocker do not meet, or only just")
        across = branch * sqrt(offset)
        qx, qy = along * dx - across * dy, along * dy + across * dx  # Q - P
        return [phi, atan2(qy, qx), atan2(qy - dy, qx - dx)]

    return _evaluate(coordinates, u, ud, udd)


def slider_crank(
    crank: float | str,
    rod: float | str,
    offset: float | str,
    u: Input,
    ud: Input = 1,
    udd: Input = 0,
    *,
    branch: int = 1,
) -> Motion:
    """Slider-crank, crank pivot (0, 0), slider on y = offset: [crank angle, rod angle, slider's x].

        x = crank cos u + branch sqrt(rod^2 - (offset - crank sin u)^2)

    The rod's angle, from the crank's tip to the slider, is a principal value, in (-pi, pi].
    """
    a, b, y = (mp.mpf(length) for length in (crank, rod, offset))

    def coordinates(phi: Series) -> list[Series]:
        s, c = sin_cos(phi)
        rise = y - a * s
        squared = b * b - rise * rise
        _reachable(squared.c[0] > 0, phi, "the rod does not reach the slide, or only just")
        run = branch * sqrt(squared)
        return [phi, atan2(rise, run), a * c + run]

    return _evaluate(coordinates, u, ud, udd)


def _evaluate(coordinates: Callable[[Series], list[Series]], u: Input, ud: Input, udd: Input) -> Motion:
    """Coordinates as series in time about every sample, as a Motion."""
    return _motion([coordinates(Series([a, b, c / 2])) for a, b, c in _samples(u, ud, udd)])


def _reachable(fine: bool, phi: Series, otherwise: str) -> None:
    if not fine:
        raise ValueError(f"{otherwise} at {mp.nstr(phi.c[0], 17)} rad")


# ---------------------------------------------------------------------------------------------- from residuals alone


def solve(residual: Residual, guess: ArrayLike, u: Any, ud: Any = 1, udd: Any = 0) -> Motion:
    """The motion at regular poses, by Newton from a guess: q, then qd and qdd from the linear equations.

    residual(q, u) gives as many rows as q has coordinates, driver rows among them. guess: (m,) for all samples or
    (n, m), near enough that Newton finds the branch wanted. u, ud, udd: numbers or lists of n; with several
    drivers an entry is a tuple of their values and residual gets u as a list.
    """
    samples = _samples(u, ud, udd)
    guesses = np.broadcast_to(np.asarray(guess, dtype=object), (len(samples), np.shape(guess)[-1]))
    motions = []
    for start, (value, speed, acceleration) in zip(guesses, samples, strict=True):
        if isinstance(value, tuple):
            rates = (_tuple(speed, len(value)), _tuple(acceleration, len(value)))
            driver: Any = [Series([a, b, c / 2]) for a, b, c in zip(value, *rates, strict=True)]
        else:
            driver = Series([value, speed, acceleration / 2])
        q, inverse = _newton(residual, [mp.mpf(x) for x in start], driver)
        motions.append(_expand(residual, q, inverse, driver, 2))
    return _motion(motions)


def follow(
    residual: Residual,
    start: ArrayLike,
    start_u: float | str,
    u: Input,
    ud: Input = 1,
    udd: Input = 0,
    *,
    step: float = 0.05,
) -> Motion:
    """The motion of a mechanism with one driver along its smooth branch, through isolated singular points too.

    start: (m,) a rough pose at the regular driver value start_u; from there the samples u are reached in their order,
    in steps of at most `step` [rad or length], each predicted by a series and corrected by Newton. Where the Jacobian
    is near-singular, q(u) is interpolated from poses on both sides. Much dearer than `solve`: for a few samples.
    """
    path = _Path(residual, start, mp.mpf(start_u), mp.mpf(step))
    return _motion(
        [_chain(path.go_to(value), speed, acceleration) for value, speed, acceleration in _samples(u, ud, udd)]
    )


class _Path:
    """A branch that is being followed: the last regular pose and its series in the driver value."""

    def __init__(self, residual: Residual, start: ArrayLike, u: Real, step: Real) -> None:
        self.residual = residual
        self.step = step
        q, inverse = _newton(residual, [mp.mpf(x) for x in np.asarray(start, dtype=object)], Series([u, 1]))
        self._settle(u, q, inverse)

    def go_to(self, u: Real) -> list[Series]:
        """The series of q about u, three terms; the path's centre moves there, or as near as is regular."""
        while abs(u - self.centre) > self.step:
            self._move(self.centre + mp.sign(u - self.centre) * self.step)
        if self._move(u):
            return [x.cut(3) for x in self.series]
        return self._between(u)

    def _move(self, u: Real) -> bool:
        """Try to settle at u; where it is near-singular there, settle one GAP further on, and say False."""
        q, inverse, margin = self._pose(u)
        if margin > SINGULAR:
            self._settle(u, q, inverse)
            return True
        onward = u + (mp.sign(u - self.centre) or 1) * GAP
        q, inverse, margin = self._pose(onward)
        if margin < SINGULAR:
            raise ValueError(f"singular over more than a point near u = {mp.nstr(u, 17)}")
        self._settle(onward, q, inverse)
        return False

    def _pose(self, u: Real) -> tuple[list[Real], Any, Real]:
        """q, the inverse Jacobian and 1 / condition at u, as the present series predicts the branch."""
        driver = Series([u, 1])
        predicted = [x.at(u - self.centre) for x in self.series]
        _, margin = _inverse(_jacobian(self.residual, predicted, driver))
        if margin < SINGULAR:
            return predicted, None, margin
        q, inverse = _newton(self.residual, predicted, driver)
        if max(abs(a - b) for a, b in zip(q, predicted, strict=True)) > LOST:
            raise ValueError(f"the branch was lost near u = {mp.nstr(u, 17)}: take a smaller step")
        return q, inverse, margin

    def _settle(self, u: Real, q: list[Real], inverse: Any) -> None:
        self.centre = u
        self.series = _expand(self.residual, q, inverse, Series([u, 1] + [0] * (PREDICTOR_ORDER - 1)), PREDICTOR_ORDER)

    def _between(self, u: Real) -> list[Series]:
        """Three terms of q about u by polynomial interpolation between poses GAP to 2 GAP away on either side."""
        chebyshev = [mp.cos(mp.pi * (2 * k + 1) / (2 * NODES)) for k in range(NODES)]
        offsets = [side * GAP * (3 + x) / 2 for side in (-1, 1) for x in chebyshev]
        poses = [self._pose(u + offset)[0] for offset in offsets]
        weights = [_lagrange(offsets, i) for i in range(len(offsets))]
        return [
            Series(mp.fdot((w.c[k], pose[j]) for w, pose in zip(weights, poses, strict=True)) for k in range(3))
            for j in range(len(self.series))
        ]


def _lagrange(nodes: Sequence[Real], i: int) -> Series:
    """Three terms about 0 of the polynomial that is 1 at node i and 0 at the others."""
    product = Series([1, 0, 0])
    for j, node in enumerate(nodes):
        if j != i:
            product = product * Series([-node, 1, 0]) / (nodes[i] - node)
    return product


def _chain(in_u: list[Series], ud: Real, udd: Real) -> list[Series]:
    """Series in the driver value as series in time: qd = q' ud, qdd = q'' ud^2 + q' udd."""
    return [Series([x.c[0], x.c[1] * ud, x.c[2] * ud**2 + x.c[1] * udd / 2]) for x in in_u]


def _newton(residual: Residual, q: list[Real], driver: Any) -> tuple[list[Real], Any]:
    """The pose near q, and the inverse of its Jacobian."""
    u = _constant(driver)
    close = mp.mpf(10) ** (-DIGITS)  # of a quadratic iteration: the step after this one would be 1e-100
    for _ in range(60):
        inverse, margin = _inverse(_jacobian(residual, q, driver))
        if margin < mp.mpf(10) ** (-DIGITS // 2):
            raise ValueError("the Jacobian is singular on the way from the guess: take another guess, or `follow`")
        value = [mp.mpf(row.c[0]) for row in residual([Series([x]) for x in q], u)]
        dq = inverse * mp.matrix([-row for row in value])
        q = [a + b for a, b in zip(q, dq, strict=True)]
        if mp.mnorm(dq, 1) < close:
            return q, inverse
    raise ValueError(f"Newton did not converge from the guess; the last step was {mp.nstr(mp.mnorm(dq, 1), 5)}")


def _inverse(jacobian: Any) -> tuple[Any, Real]:
    """The inverse, and 1 / condition number in the 1-norm; that is 0 where the matrix is exactly singular."""
    try:
        inverse = mp.inverse(jacobian)
    except ZeroDivisionError:
        return jacobian, mp.zero
    return inverse, 1 / (mp.mnorm(jacobian, 1) * mp.mnorm(inverse, 1))


def _jacobian(residual: Residual, q: Sequence[Real], driver: Any) -> Any:
    """The Jacobian dPhi_i / dq_j (m, m), column by column from series of two terms."""
    u = _constant(driver, terms=2)
    columns = []
    for j in range(len(q)):
        rows = residual([Series([x, 1 if i == j else 0]) for i, x in enumerate(q)], u)
        columns.append([row.c[1] for row in rows])
    return mp.matrix(columns).T


def _expand(residual: Residual, q: Sequence[Real], inverse: Any, driver: Any, order: int) -> list[Series]:
    """Power series of the motion, term by term: term k of Phi(q, u) = 0 is linear in term k of q.

    For k = 1 and 2 these are Haug's linear equations for velocity and acceleration.
    """
    terms = [[x] for x in q]
    for k in range(1, order + 1):
        u = [x.cut(k + 1) for x in driver] if isinstance(driver, list) else driver.cut(k + 1)
        rows = residual([Series([*known, 0]) for known in terms], u)
        for known, new in zip(terms, inverse * mp.matrix([-row.c[k] for row in rows]), strict=True):
            known.append(new)
    return [Series(known) for known in terms]


def _constant(driver: Any, terms: int = 1) -> Any:
    """The driver, or each driver of a list, held at its value."""
    if isinstance(driver, list):
        return [_constant(one, terms) for one in driver]
    return Series([driver.c[0]] + [0] * (terms - 1))


def _motion(samples: Sequence[Sequence[Series]]) -> Motion:
    """Series in time of m coordinates at n samples, as a Motion: the k-th derivative is k! times term k."""
    tables = ([[mp.factorial(k) * x.c[k] for x in row] for row in samples] for k in range(3))
    return Motion(*(np.array(table, dtype=object) for table in tables))


def _samples(u: Any, ud: Any, udd: Any) -> list[tuple[Any, Any, Any]]:
    """One (u, ud, udd) a sample, of mpmath numbers; numbers stand for lists."""
    lists = [x if isinstance(x, list | np.ndarray | range) else None for x in (u, ud, udd)]
    n = max((len(x) for x in lists if x is not None), default=1)
    columns = [[value] * n if x is None else list(x) for x, value in zip(lists, (u, ud, udd), strict=True)]
    return [(_exact(a), _exact(b), _exact(c)) for a, b, c in zip(*columns, strict=True)]


def _exact(value: Any) -> Any:
    """A number as it is; a tuple of several drivers' numbers entry by entry."""
    if isinstance(value, tuple):
        return tuple(_exact(one) for one in value)
    return mp.mpf(value.item() if isinstance(value, np.generic) else value)


def _tuple(value: Any, count: int) -> tuple[Any, ...]:
    """One number for all drivers, or one each."""
    return value if isinstance(value, tuple) else (value,) * count
