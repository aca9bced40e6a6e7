"""pylinkage: dyads one after the other, closed forms of circles that meet, compiled by numba where that is installed.

It gives points and steps its crank by equal angles; angles and their rates are read off two points of a body.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.case import Case, Motion
from benchmarks.engine import BenchEngine, EngineSetting, Sampler
from kinfmu.arrays import FloatArray
from kinfmu.errors import MissingPackageError
from kinfmu.units import CoordinateName

Bodies = Mapping[str, tuple[str, str]]  # two points of each moving body, its frame's origin and one on its x-axis


def _sampler(case: Case, _setting: EngineSetting) -> Sampler | None:
    """Return a sampler: `step_fast_with_kinematics`, without a tolerance, of crank-driven chains of dyads only."""
    if case.name not in _LINKAGES:
        return None
    try:
        import pylinkage  # noqa: F401  the solver needs it; a missing package is reported first
    except ImportError:
        raise MissingPackageError("pylinkage is not installed: pip install 'kinfmu[bench]'") from None
    u = np.array(case.u)[:, 0]
    step = float(u[1] - u[0])
    if not np.allclose(np.diff(u), step, rtol=1e-9):
        return None
    named, bodies = _LINKAGES[case.name](case, float(u[0]) - step, step)
    linkage = _ready(named, case.ud[0][0], case.udd[0][0])
    parts = list(named.values())
    start = [(part.x, part.y) for part in parts]
    place = {name: k for k, name in enumerate(named)}

    def take(n: int) -> Motion:
        for part, (x, y) in zip(parts, start, strict=True):
            part.x, part.y = x, y
        moved = linkage.step_fast_with_kinematics(n)
        return _rows(case.columns, {name: [table[:, k] for table in moved] for name, k in place.items()}, bodies)

    return take


def _ready(named: Mapping[str, Any], speed: float, acceleration: float) -> Any:
    from pylinkage.actuators import Crank
    from pylinkage.simulation import Linkage

    linkage = Linkage(list(named.values()))
    (crank,) = (part for part in named.values() if isinstance(part, Crank))
    linkage.set_input_velocity(crank, speed, acceleration)
    return linkage


def _rows(columns: Sequence[CoordinateName], points: Mapping[str, Sequence[FloatArray]], bodies: Bodies) -> Motion:
    """Return (n, 3 m) from positions, velocities and accelerations (n, 2) of points."""
    tables: list[list[FloatArray]] = [[], [], []]
    for column in columns:
        origin, other = bodies[column.owner]
        if column.is_angle:
            (dx, dy), v, a = (np.subtract(to, at).T for to, at in zip(points[other], points[origin], strict=True))
            square = dx * dx + dy * dy
            values = [np.unwrap(np.arctan2(dy, dx)), (dx * v[1] - dy * v[0]) / square, (dx * a[1] - dy * a[0]) / square]
        else:
            values = [table[:, "xy".index(column.axis)] for table in points[origin]]
        for table, value in zip(tables, values, strict=True):
            table.append(value)
    return list(np.array([value for table in tables for value in table]).T)


def _length(case: Case, body: str, a: str, b: str) -> float:
    """Return the distance of two points of a body."""
    points = case.mechanism.body_points
    return math.dist(points[f"{body}.{a}"], points[f"{body}.{b}"])


def _start(case: Case, body: str, point: str) -> tuple[float, float]:
    """Return the position of a body's point at the first sample: of the two where circles meet, the nearer one."""
    pose: dict[str, float] = {**case.plan.fixed, **dict(zip(case.columns, case.exact[0, 0].tolist(), strict=True))}
    x, y, phi = (pose[f"{body}.{letter}"] for letter in ("x", "y", "phi"))
    s_x, s_y = case.mechanism.body_points[f"{body}.{point}"]
    return x + math.cos(phi) * s_x - math.sin(phi) * s_y, y + math.sin(phi) * s_x + math.cos(phi) * s_y


def _crank_rocker(case: Case, angle: float, step: float) -> tuple[dict[str, Any], Bodies]:
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad

    points = case.mechanism.body_points
    o, c = (Ground(*points[f"ground.{name}"]) for name in "OC")
    p = Crank(o, _length(case, "crank", "O", "P"), step, angle)
    lengths = _length(case, "coupler", "P", "Q"), _length(case, "rocker", "C", "Q")
    q = RRRDyad(p.output, c, *lengths, *_start(case, "rocker", "Q"))
    bodies = {"crank": ("O", "P"), "coupler": ("P", "Q"), "rocker": ("C", "Q")}
    return {"O": o, "C": c, "P": p, "Q": q}, bodies


def _jansen_leg(case: Case, angle: float, step: float) -> tuple[dict[str, Any], Bodies]:
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import FixedDyad, RRRDyad

    points = case.mechanism.body_points
    axle, pin = (Ground(*points[f"ground.{name}"]) for name in ("axle", "pin"))
    x = Crank(axle, _length(case, "crank", "axle", "X"), step, angle)

    def dyad(a: Any, b: Any, point: str, first: tuple[str, str], second: tuple[str, str]) -> Any:
        lengths = _length(case, *first, point), _length(case, *second, point)
        return RRRDyad(a, b, *lengths, *_start(case, first[0], point))

    top = dyad(x.output, pin, "top", ("upper_rod", "X"), ("upper_triangle", "pin"))
    bottom = dyad(x.output, pin, "bottom", ("lower_rod", "X"), ("lower_rocker", "pin"))
    third = points["upper_triangle.left"]
    left = FixedDyad(pin, top, math.hypot(*third), math.atan2(third[1], third[0]))
    knee = dyad(left, bottom, "knee", ("link", "left"), ("leg", "bottom"))
    bodies = {
        "crank": ("axle", "X"),
        "upper_rod": ("X", "top"),
        "upper_triangle": ("pin", "top"),
        "lower_rod": ("X", "bottom"),
        "lower_rocker": ("pin", "bottom"),
        "link": ("left", "knee"),
        "leg": ("bottom", "knee"),
    }
    parts = {"axle": axle, "pin": pin, "X": x, "top": top, "bottom": bottom, "left": left, "knee": knee}
    return parts, bodies


_LINKAGES: dict[str, Callable[[Case, float, float], tuple[dict[str, Any], Bodies]]] = {
    "crank_rocker": _crank_rocker,
    "jansen_leg": _jansen_leg,
}


PYLINKAGE = BenchEngine("pylinkage", _sampler, settings=(EngineSetting(0),), usual=EngineSetting(0))
