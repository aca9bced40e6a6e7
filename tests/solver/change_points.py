"""Mechanisms with change points, random grids over them, and their motion in closed form to 18 digits.

The closed forms keep their digits at and near the change points: terms that vanish there are factored out, so that a
square root becomes a cosine. They run on numpy's long doubles, thousands of samples at once; lengths are decimal
numbers. tests/solver/test_change_points.py holds them against the 50 digits of tests/oracle.py.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute, Run
from kinfmu.plan import SolvePlan, compile_plan
from tests import mechanisms
from tests.power_series import mp

LongArray = NDArray[np.longdouble]
Jet = tuple[LongArray, LongArray, LongArray]  # f, f', f'' of samples
Motion = dict[str, Jet]  # by coordinate; derivatives with respect to the crank's angle

TWO_PI = np.longdouble("6.283185307179586476925286766559")
_FINE = 2e-3  # [rad]; grid on which angles are followed over whole turns


@dataclass(frozen=True)
class Case:
    """A mechanism driven by the angle of its crank, and its exact motion on the smooth branch of its start pose."""

    name: str
    mechanism: Mechanism
    motion: Callable[[LongArray], Motion]

    @cached_property
    def plan(self) -> SolvePlan:
        return compile_plan(self.mechanism)

    def run(self, u: ArrayLike, **inputs: Any) -> Run:
        """The run over crank angles."""
        return kinfmu.solve(self.plan, crank_angle=u, **inputs)

    def errors(self, run: Run, speed: float = 1.0) -> NDArray[np.float64]:
        """Largest errors of q, qd, qdd of each good sample of a run at a constant speed, (n, 3); NaN for others.

        Angles count with all their turns.
        """
        exact = self.motion(run.inputs[:, 0].astype(np.longdouble))
        largest = np.zeros((len(run), 3))
        for k, name in enumerate(run.names):
            for order, table in enumerate((run.q, run.qd, run.qdd)):
                gap = np.abs(table[:, k] - exact[name][order] * np.longdouble(speed) ** order)
                largest[:, order] = np.maximum(largest[:, order], gap.astype(float))
        return largest


def reference() -> Case:
    """The gallery's four-bar: x2 = 1 + cos u, y2 = sin u, phi2 = 0, phi3 = u."""

    def motion(u: LongArray) -> Motion:
        c, s, one = np.cos(u), np.sin(u), np.ones_like(u)
        angle = (u, one, 0 * u)
        still = (0 * u, 0 * u, 0 * u)
        x, y = (2 * np.cos(u / 2) ** 2, -s, -c), (s, c, -s)
        return {"crank.phi": angle, "coupler.x": x, "coupler.y": y, "coupler.phi": still, "rocker.phi": angle}

    return Case("reference", kinfmu.load("fourbar"), motion)


def fourbar(ground: str, crank: str, coupler: str, rocker: str, branch: int = 1, start: float = 1.0) -> Case:
    """A four-bar with lengths as decimal numbers, on its smooth branch: branch as in the oracle at the start angle.

    d^2 = (g - a)^2 + 4 g a sin^2(u/2),   e = (b^2 - c^2 + d^2) / (2 d^2),   h = A B / (2 d^2)
    A^2 = (b + c)^2 - (g + a)^2 + 4 g a cos^2(u/2),   B^2 = (g - a)^2 - (b - c)^2 + 4 g a sin^2(u/2)
    """
    g, a, b, c = (mp.mpf(length) for length in (ground, crank, coupler, rocker))
    far, near = (b + c) ** 2 - (g + a) ** 2, (g - a) ** 2 - (b - c) ** 2
    root = _long(2 * mp.sqrt(g * a))

    def coordinates(u: LongArray) -> Motion:
        s, co = _sin_cos(u)
        half_s, half_c = _halves(u)
        px, py = _scaled(co, _long(a)), _scaled(s, _long(a))
        dx, dy = _plus(_scaled(px, -1), _long(g)), _scaled(py, -1)
        squared = _plus(_scaled(_times(half_s, half_s), root**2), _long((g - a) ** 2))
        first = _root(_scaled(half_c, root), _long(far))
        second = _root(_scaled(half_s, root), _long(near))
        across = _over(_scaled(_times(first, second), branch * np.longdouble(0.5)), squared)
        along = _over(_scaled(_plus(squared, _long(b * b - c * c)), np.longdouble(0.5)), squared)
        qx = _sum(_times(along, dx), _scaled(_times(across, dy), -1))
        qy = _sum(_times(along, dy), _times(across, dx))
        return {
            "crank.phi": (u, np.ones_like(u), 0 * u),
            "coupler.x": px,
            "coupler.y": py,
            "coupler.phi": _angle(qy, qx),
            "rocker.phi": _angle(_sum(qy, _scaled(dy, -1)), _sum(qx, _scaled(dx, -1))),
        }

    numbers = [float(length) for length in (ground, crank, coupler, rocker)]
    name = "-".join((ground, crank, coupler, rocker)) + (" crossed" if branch < 0 else "")
    mechanism = mechanisms.fourbar(*numbers, start=start, branch=branch)
    return Case(name, mechanism, _with_turns(coordinates, mechanism, start))


def slider_crank(crank: str, rod: str, start: float = 0.7) -> Case:
    """A slider-crank without offset, on its smooth branch: x = a cos u + R, R^2 = b^2 - a^2 + a^2 cos^2 u."""
    a, b = mp.mpf(crank), mp.mpf(rod)

    def coordinates(u: LongArray) -> Motion:
        s, c = _sin_cos(u)
        run = _root(_scaled(c, _long(a)), _long(b * b - a * a))
        x, y = _scaled(c, _long(a)), _scaled(s, _long(a))
        slider = _sum(x, run)
        angle = (u, np.ones_like(u), 0 * u)
        return {
            "crank.phi": angle,
            "rod.x": x,
            "rod.y": y,
            "rod.phi": _angle(_scaled(y, -1), run),
            "slider.x": slider,
            "slider.y": (0 * u, 0 * u, 0 * u),
        }

    mechanism = mechanisms.slider_crank(float(crank), float(rod), start=start)
    return Case(f"slider-crank {crank} {rod}", mechanism, _with_turns(coordinates, mechanism, start))


def two_loops(apart: float, start: float = 1.0) -> Case:
    """A parallelogram 2-1-2-1 whose rocker drives a four-bar 4-1-3-2 by an arm at an angle [rad] to itself.

    The second has a change point so much before one of the first.
    """
    second = fourbar("4", "1", "3", "2", start=start + apart)
    bodies = {body.name: body for body in second.mechanism.bodies}
    c, s = math.cos(start), math.sin(start)

    def moved(name: str) -> tuple[float, float, float]:
        x, y, phi = bodies[name].start
        return 2.0 + (x or 0.0), y or 0.0, phi or 0.0

    mechanism = Mechanism(
        "two_loops",
        [
            Body("ground", {"O": (0, 0), "C": (2, 0), "E": (6, 0)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (0, 0, start)),
            Body("coupler", {"P": (0, 0), "Q": (2, 0)}, (c, s, 0)),
            Body("arm", {"C": (0, 0), "Q": (1, 0), "R": (math.cos(apart), math.sin(apart))}, (2, 0, start)),
            Body("link", {"R": (0, 0), "S": (3, 0)}, moved("coupler")),
            Body("output", {"E": (0, 0), "S": (2, 0)}, moved("rocker")),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "coupler.P")),
            Revolute("Q", ("coupler.Q", "arm.Q")),
            Revolute("C", ("ground.C", "arm.C")),
            Revolute("R", ("arm.R", "link.R")),
            Revolute("S", ("link.S", "output.S")),
            Revolute("E", ("ground.E", "output.E")),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(start, 1.0))],
    )

    def motion(u: LongArray) -> Motion:
        turning = (u, np.ones_like(u), 0 * u)
        of_second = second.motion(u + np.longdouble(apart))
        x, y = of_second["coupler.x"], of_second["coupler.y"]
        return {
            "crank.phi": turning,
            "coupler.x": (np.cos(u), -np.sin(u), -np.cos(u)),
            "coupler.y": (np.sin(u), np.cos(u), -np.sin(u)),
            "coupler.phi": (0 * u, 0 * u, 0 * u),
            "arm.phi": turning,
            "link.x": (2 + x[0], *x[1:]),
            "link.y": y,
            "link.phi": of_second["coupler.phi"],
            "output.phi": of_second["rocker.phi"],
        }

    return Case(f"two loops {apart:g}", mechanism, motion)


def change_point_cases() -> list[Case]:
    """Those with a change point in every turn."""
    return [
        fourbar("4", "1", "3", "2"),
        fourbar("4", "1", "3", "2", branch=-1),
        fourbar("2", "1", "2", "1"),
        fourbar("2", "1", "2", "1", branch=-1),
        slider_crank("1", "1"),
    ]


def grid(seed: int, shortest: float, longest: float, turns: int = 5, most: int | None = None) -> list[float]:
    """Crank angles [rad] from 0 over a turn and back, and `turns` turns on, in steps about as long as a random one.

    shortest, longest: of that step [deg]. Every fourth grid has equal steps that divide half a turn: it hits all k pi
    as nearly as doubles can. most: where samples would be more, a grid covers less.
    """
    rng = random.Random(seed)  # noqa: S311  # a grid, not a secret
    step = math.radians(math.exp(rng.uniform(math.log(shortest), math.log(longest))))
    if seed % 4 == 0:
        count = max(1, round(math.pi / step))
        up = [k * math.pi / count for k in range(2 * count + 1)]
        on = [k * math.pi / count for k in range(1, 2 * turns * count + 1)]
    else:
        up, on = list(_walk(rng, step, math.tau)), list(_walk(rng, step, turns * math.tau))
    u = [*up, *reversed(up), *on]
    if most is not None and len(u) > most:
        first = rng.randrange(len(u) - most)
        u = u[first : first + most]
    return u


def _walk(rng: random.Random, step: float, end: float) -> Iterator[float]:
    u = 0.0
    while u < end:
        yield u
        u += rng.uniform(0.5, 1.5) * step


def _with_turns(
    coordinates: Callable[[LongArray], Motion], mechanism: Mechanism, start: float
) -> Callable[[LongArray], Motion]:
    """Angles with their turns: followed from the start pose over a dense grid."""
    given = {f"{body.name}.phi": body.start.phi for body in mechanism.moving_bodies}

    def motion(u: LongArray) -> Motion:
        exact = coordinates(u)
        span = max(abs(float(u.min()) - start), abs(float(u.max()) - start), 1.0) + 0.01
        count = math.ceil(span / _FINE)
        dense = start + np.arange(-count, count + 1) * np.longdouble(_FINE)
        rough = coordinates(dense)
        for name in exact:
            if name.endswith(".phi") and name != "crank.phi":
                followed = _unwrapped(rough[name][0].astype(float), count)
                followed += given[name] - followed[count]
                near = np.interp(u.astype(float), dense.astype(float), followed)
                whole = np.round((near - exact[name][0].astype(float)) / math.tau)
                exact[name] = (exact[name][0] + whole * TWO_PI, *exact[name][1:])
        return exact

    return motion


def _unwrapped(angles: NDArray[np.float64], middle: int) -> NDArray[np.float64]:
    """Angles without jumps from the middle outwards; beyond a limit, where there are none, the last ones hold."""
    for side in (angles[middle:], angles[middle::-1]):  # views
        beyond = np.flatnonzero(np.isnan(side))
        if len(beyond):
            side[beyond[0] :] = side[beyond[0] - 1]
        side[:] = np.unwrap(side)
    return angles


def _long(x: Any) -> np.longdouble:
    return np.longdouble(mp.nstr(mp.mpf(x), 25))


def _sin_cos(u: LongArray) -> tuple[Jet, Jet]:
    s, c = np.sin(u), np.cos(u)
    return (s, c, -s), (c, -s, -c)


def _halves(u: LongArray) -> tuple[Jet, Jet]:
    """Sine and cosine of u / 2."""
    (s, sd, sdd), (c, cd, cdd) = _sin_cos(u / 2)
    return (s, sd / 2, sdd / 4), (c, cd / 2, cdd / 4)


def _root(f: Jet, more: np.longdouble) -> Jet:
    """sqrt(f^2 + more), positive; f itself if there is no more: that passes through its zero smoothly."""
    if more == 0:
        return f
    square = _plus(_times(f, f), more)
    with np.errstate(invalid="ignore"):  # beyond a limit there is none
        root = np.sqrt(square[0])
    first = square[1] / (2 * root)
    return root, first, (square[2] / 2 - first * first) / root


def _plus(a: Jet, number: np.longdouble) -> Jet:
    return a[0] + number, a[1], a[2]


def _sum(a: Jet, b: Jet) -> Jet:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _scaled(a: Jet, by: Any) -> Jet:
    return a[0] * by, a[1] * by, a[2] * by


def _times(a: Jet, b: Jet) -> Jet:
    return a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]


def _over(a: Jet, b: Jet) -> Jet:
    f = a[0] / b[0]
    first = (a[1] - f * b[1]) / b[0]
    return f, first, (a[2] - 2 * first * b[1] - f * b[2]) / b[0]


def _angle(y: Jet, x: Jet) -> Jet:
    """atan2 with its derivatives."""
    squared = x[0] * x[0] + y[0] * y[0]
    first = (x[0] * y[1] - y[0] * x[1]) / squared
    second = (x[0] * y[2] - y[0] * x[2] - 2 * first * (x[0] * x[1] + y[0] * y[1])) / squared
    return np.arctan2(y[0], x[0]), first, second
