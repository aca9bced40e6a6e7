"""Singular points of a one-driver mechanism over a turn of its driver, and the range that the driver can reach."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kinfmu.backends.python import load_model
from kinfmu.plan import SolvePlan
from kinfmu.solver import Pose, Solver
from kinfmu.solver.advance import Limit, advance
from kinfmu.solver.bridge import Bridge

_STEP = 0.1  # [rad, sizes] between looks at the determinants


@dataclass(frozen=True)
class SingularPoint:
    """A driver value where a block's determinant vanishes.

    kind: 'change point' (branches cross, the motion goes on) or 'limit' (a dead centre: the motion turns back).
    block: its number, from 1.
    """

    value: float
    kind: str
    block: int


@dataclass(frozen=True)
class DriverRange:
    """Singular points met on one turn either way from the anchor (or until a limit), in order; and the reachable range.

    low and high are None where no limit was met.
    """

    points: tuple[SingularPoint, ...]
    low: float | None
    high: float | None


def driver_range(plan: SolvePlan) -> DriverRange | None:
    """Follow the branch one turn (or three sizes) either way from the anchor; None if there is not just one driver."""
    if len(plan.drivers) != 1:
        return None
    solver = Solver(load_model(plan))
    is_angle = plan.drivers[0].quantity.kind == "angle"
    reach, unit = (2.0 * math.pi, 1.0) if is_angle else (3.0 * plan.size, plan.size)
    found: dict[float, SingularPoint] = {}
    limits: list[float | None] = []
    start = solver.anchor.u[0]
    for side in (-1.0, 1.0):
        pose, limit = solver.anchor, None
        count = math.ceil(reach / (_STEP * unit))
        for k in range(1, count + 1):
            arrived = advance(solver.model, pose, (start + side * reach * k / count,))
            if isinstance(arrived, Limit):
                limit = arrived.u[0]
                found[limit] = SingularPoint(limit, "limit", arrived.block + 1)
                break
            if not arrived.good:
                break
            pose = arrived
            for bridge in pose.road.bridges if pose.road else ():
                if bridge.centre not in found:
                    found[bridge.centre] = _change_point(bridge)
        limits.append(limit)
    points = sorted(found.values(), key=lambda point: point.value)
    return DriverRange(tuple(_distinct(points, is_angle)), limits[0], limits[1])


def _change_point(bridge: Bridge) -> SingularPoint:
    """The zero of the determinant inside a bridge's window, by bisection on interpolated poses."""
    low, high = bridge.centre - 0.999 * bridge.half, bridge.centre + 0.999 * bridge.half
    block = _block(bridge)
    at_low = _determinant(bridge, low, block)
    for _ in range(60):
        middle = 0.5 * (low + high)
        at_middle = _determinant(bridge, middle, block)
        if at_middle == 0.0:
            low = high = middle
        elif (at_middle < 0.0) == (at_low < 0.0):
            low = middle
        else:
            high = middle
    return SingularPoint(0.5 * (low + high), "change point", block + 1)


def _block(bridge: Bridge) -> int:
    """The block whose determinant changes its sign."""
    before, after = bridge.nodes[2].determinants, bridge.nodes[3].determinants
    return next(k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a * b < 0.0)


def _determinant(bridge: Bridge, u: float, block: int) -> float:
    pose: Pose = bridge.pose((u,))
    return float(pose.determinants[block])


def _distinct(points: list[SingularPoint], is_angle: bool) -> list[SingularPoint]:
    """Points that differ by whole turns are one, the one in [0, 2 pi)."""
    if not is_angle:
        return points
    kept: dict[tuple[int, str], SingularPoint] = {}
    for point in points:
        turned = point.value
        if point.kind == "change point":
            turned = math.fmod(math.fmod(turned, math.tau) + math.tau, math.tau)
            turned -= math.tau if math.tau - turned < 1e-9 else 0.0
        kept.setdefault((round(turned * 1e7), point.kind), SingularPoint(turned, point.kind, point.block))
    return sorted(kept.values(), key=lambda point: point.value)


def written(value: float, unit: str, kind: str) -> str:
    """'pi (180 deg)', '0.7227 rad (41.41 deg)' or '0.35 m': a driver value for people."""
    if kind != "angle":
        return f"{value:.9g} {unit}"
    return f"{multiple_of_pi(value) or f'{value:.9g} rad'} ({round(math.degrees(value), 8) + 0.0:.9g} deg)"


def multiple_of_pi(value: float) -> str | None:
    """'0', 'pi', '3 pi/2' for values that are simple fractions of pi to nine digits."""
    for denominator in (1, 2, 3, 4, 6):
        numerator = value / math.pi * denominator
        if abs(numerator - round(numerator)) < 1e-9:
            whole = round(numerator)
            if whole == 0:
                return "0"
            sign, size = ("-" if whole < 0 else ""), abs(whole)
            top = "pi" if size == 1 else f"{size} pi"
            return f"{sign}{top}" if denominator == 1 else f"{sign}{top}/{denominator}"
    return None
