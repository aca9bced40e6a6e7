"""DriverPath: the poses through which one driver moves, the others at their start values; driver values as text."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.mechanism import Mechanism, RunSettings, Start
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Held
from kinfmu.mechanism.quantities import CoordinateOf, DistanceBetween, PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import decimal_sum
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.origin import in_world
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.advance import advance
from kinfmu.solver.python.bridge import Bridge
from kinfmu.solver.python.limit import NO_BLOCK, Limit

STEP = 0.1  # [rad, sizes] between evaluations of the determinants
MOST_TURNS = 12  # most turns after which a mechanism may repeat: gears with odd ratios
SIZES = 3.0  # reach of a driver of a length, in both directions
_LARGE = 150  # coordinates; a larger mechanism is followed for one turn only
_NEAR_LIMIT = 1e-6  # [rad, sizes]; distance from a limit of the poses from which its own is extrapolated
_REPEATS = 1e-6  # [rad, sizes]; poses closer than this are equal
_SAME = 1e-15  # of a driver value; places closer than this are equal
_SAME_PLACE = 1e-9  # [rad]; values closer than this are one place of a cycle
_MANY = 200  # poses among which no two extremes of a quantity are neighbours
_NEAR_END = 16  # poses between the last one and a limit, where coordinates change with the root of the distance


@dataclass(frozen=True, eq=False)
class DriverPath:
    """The path of one driver from the anchor to its limits, to a repetition, or to the end of its reach.

    name, kind: of the driver, 'angle' or 'length'; plan, solver: those in which it moves alone; poses: in the order of
    the driver value, the anchor among them; bridges: those crossed; low, high: the limits, None where none was met;
    turns: number of turns after which the mechanism repeats, None for a length or if it does not; stopped: the reason
    that ended the path other than a limit; is_stopped_high: at its upper end.
    """

    name: str
    kind: str
    plan: SolvePlan
    solver: Solver
    poses: tuple[Pose, ...]
    bridges: tuple[Bridge, ...]
    low: Limit | None
    high: Limit | None
    turns: int | None
    stopped: str | None
    is_stopped_high: bool

    def coordinates(self, pose: Pose) -> dict[str, float]:
        """Return all coordinates of a pose by name, including fixed ones, in the world."""
        return {**self.plan.fixed, **dict(zip(self.plan.outputs, self.solver.outputs(pose), strict=True))}

    def speeds(self, pose: Pose) -> dict[str, float]:
        """Return the rates of all coordinates per unit of the driver, by name."""
        rates: dict[str, float] = dict(zip(self.plan.outputs, self.solver.rates(pose, (1.0,)), strict=True))
        return {**dict.fromkeys(self.plan.fixed, 0.0), **rates}

    def within_cycle(self, u: float, low: float | None = None) -> float:
        """Return a driver value moved by whole cycles of the mechanism to the first one from `low` on.

        low: default: the start of the driver's law. A value just below the end of the cycle counts as its start.
        """
        if self.turns is None:
            return u
        period = self.turns * math.tau
        low = float(self.plan.mechanism.drivers[0].law.at(self.plan.mechanism.run.start)) if low is None else low
        ahead = (u - low) % period
        return low + (0.0 if period - ahead < _SAME_PLACE else ahead)

    @cached_property
    def pose_coordinates(self) -> tuple[dict[str, float], ...]:
        """`coordinates` of each of the poses."""
        return tuple(map(self.coordinates, self.poses))

    @cached_property
    def fine_coordinates(self) -> tuple[dict[str, float], ...]:
        """`coordinates` of each of the fine poses."""
        return tuple(map(self.coordinates, self.fine_poses))

    @cached_property
    def fine_speeds(self) -> tuple[dict[str, float], ...]:
        """`speeds` of each of the fine poses."""
        return tuple(map(self.speeds, self.fine_poses))

    @cached_property
    def fine_poses(self) -> tuple[Pose, ...]:
        """Poses close enough to find the extremes of a quantity between them, up to the limits, in the same order."""
        parts = math.ceil(_MANY / len(self.poses))
        fine = [self.poses[0]]
        for before, after in pairwise(self.poses):
            a, b = before.u[0], after.u[0]
            between = (self.solver.solve(before, (a + (b - a) * k / parts,)) for k in range(1, parts))
            fine += [*(pose for pose in between if pose.good), after]
        low, high = (() if limit is None else self._before(limit) for limit in self._limits)
        return (*low[::-1], *fine, *high)

    def _before(self, limit: Limit) -> tuple[Pose, ...]:
        """Return poses between the last one of the path and a limit, toward the limit."""
        start = self.poses[0 if limit is self.low else -1]
        apart = start.u[0] - limit.u[0]
        parts = [(k / _NEAR_END) ** 2 for k in range(_NEAR_END - 1, 0, -1)]
        poses = [self.solver.solve(start, (limit.u[0] + part * apart,)) for part in parts]
        last = [
            pose
            for pose in self._near_limits[limit is self.high][:1]
            if abs(pose.u[0] - limit.u[0]) < parts[-1] * abs(apart)
        ]
        return tuple(pose for pose in (*poses, *last) if pose.good)

    def zero(self, value: Callable[[Pose], float], low: Pose, high: Pose) -> Pose:
        """Return the pose between two where a value changes its sign; one where the path ends before it.

        Inverse quadratic interpolation where it is safe, else halving: Chandrupatla (1997), Advances in Engineering
        Software 28, 145-149.
        """
        last, other = _ValueAtPose(high.u[0], value(high), high), _ValueAtPose(low.u[0], value(low), low)
        part = 0.5  # of the interval from the last place to the other, where the value has the other sign
        while True:
            best = min(last, other, key=lambda place: abs(place.value))
            width, finest = other.u - last.u, 0.5 * _SAME * (1.0 + abs(best.u))
            if best.value == 0.0 or abs(width) <= 2.0 * finest:
                return best.pose
            u = last.u + min(max(part, finest / abs(width)), 1.0 - finest / abs(width)) * width
            pose = self.solver.solve(low, (u,))
            if not pose.good:
                return last.pose
            before, last = last, _ValueAtPose(u, value(pose), pose)
            if last.value * before.value < 0.0:
                before, other = other, before
            part = _part_to_zero(last, other, before)

    def at_limit(self, limit: Limit) -> dict[str, float]:
        """Return all coordinates by name at one of the limits.

        They are a + b sqrt(s) + c s at a distance s from the limit; three poses near it give a.
        """
        near = self._near_limits[limit is self.high]
        if len(near) < 3:
            return self.coordinates(self.poses[0 if limit is self.low else -1])
        first, second, third = map(self.coordinates, near)
        return {name: 3.0 * first[name] - 3.0 * second[name] + third[name] for name in first}

    @property
    def _limits(self) -> tuple[Limit | None, Limit | None]:
        return self.low, self.high

    @cached_property
    def _near_limits(self) -> tuple[list[Pose], list[Pose]]:
        """Poses near the lower and near the upper limit; none where none was met."""
        low, high = ([] if limit is None else self._near(limit) for limit in self._limits)
        return low, high

    def _near(self, limit: Limit) -> list[Pose]:
        """Return poses at s, 4 s and 9 s before a limit; fewer if they are unreachable."""
        start, inwards = (self.poses[0], 1.0) if limit is self.low else (self.poses[-1], -1.0)
        parts = [inwards * part * _NEAR_LIMIT * self.solver.model.REACH[0] for part in (1.0, 4.0, 9.0)]
        poses = [self.solver.solve(start, (limit.u[0] + part,)) for part in parts]
        return [pose for pose in poses if pose.good]


class _ValueAtPose(NamedTuple):
    """A value at a pose, by its driver value."""

    u: float
    value: float
    pose: Pose


def _part_to_zero(a: _ValueAtPose, b: _ValueAtPose, c: _ValueAtPose) -> float:
    """Return the part of the way from a to b after which the value is 0; c: the place before."""
    x, y = (a.u - b.u) / (c.u - b.u), (a.value - b.value) / (c.value - b.value)
    if y * y >= x or (1.0 - y) ** 2 >= 1.0 - x:
        return 0.5  # interpolation is not safe
    of_c = a.value / (c.value - a.value) * b.value / (c.value - b.value)
    return a.value / (b.value - a.value) * c.value / (b.value - c.value) + (c.u - a.u) / (b.u - a.u) * of_c


@dataclass(frozen=True)
class _Leg:
    """A part of a path in one direction: its poses, bridges, and the limit or other reason that ended it early."""

    poses: list[Pose]
    bridges: list[Bridge]
    limit: Limit | None = None
    stopped: str | None = None

    @property
    def is_whole(self) -> bool:
        return self.limit is None and self.stopped is None


def follow(plan: SolvePlan, number: int) -> DriverPath:
    """Return the path of one driver, by its number, the others at the values of the plan's anchor.

    An angle turns until the mechanism repeats (at most 12 turns), a length moves by three sizes in both directions, a
    distance down to 0. Raise a KinfmuError if the driver cannot be planned alone.
    """
    single = alone(plan, number)
    driver = plan.mechanism.drivers[number]
    solver = Solver(load_model(single))
    anchor, turns, low = solver.anchor, None, None
    if driver.quantity.kind == "angle":
        up, down, turns = _turned_both_ways(solver, single)
    else:
        reach = SIZES * plan.size
        least = 0.0 if isinstance(driver.measured(), DistanceBetween) else -math.inf
        up = _leg(solver, anchor, reach, plan.size)
        down = _leg(solver, anchor, -min(reach, anchor.u[0] - least), plan.size)
        if down.is_whole and anchor.u[0] - reach <= least:
            low = Limit((least,), NO_BLOCK)
    return DriverPath(
        name=driver.name,
        kind=driver.quantity.kind,
        plan=single,
        solver=solver,
        poses=(*down.poses[::-1], anchor, *up.poses),
        bridges=(*down.bridges, *up.bridges),
        low=down.limit or low,
        high=up.limit,
        turns=turns,
        stopped=up.stopped or down.stopped,
        is_stopped_high=up.stopped is not None,
    )


def _turned_both_ways(solver: Solver, plan: SolvePlan) -> tuple[_Leg, _Leg, int | None]:
    """Return the paths over turns up and down, and the number after which the mechanism repeats.

    Down it is followed if it does not repeat, or if laws of couplings or cams do not: what they do may lie before.
    """
    is_periodic = not any(joint.law.why_not_periodic() for joint in plan.mechanism.joints if hasattr(joint, "law"))
    up, turns = _turned(solver, plan, math.tau, is_periodic=is_periodic)
    if turns is not None and is_periodic:
        return up, _Leg([], []), turns
    down, back = _turned(solver, plan, -math.tau, is_periodic=is_periodic)
    return (up, _Leg([], []), turns) if turns is not None and turns == back else (up, down, None)


def _turned(solver: Solver, plan: SolvePlan, path: float, *, is_periodic: bool) -> tuple[_Leg, int | None]:
    """Return the path over full turns of 2 pi or -2 pi, and the number after which the mechanism repeats.

    If laws of couplings or cams do not repeat with every turn, the same pose may come back with another rate or before
    another rise: then the poses of all turns are compared, of twice as many as a mechanism may repeat after.
    """
    most = 1 if len(plan.mechanism.coordinate_names) > _LARGE else MOST_TURNS
    legs: list[_Leg] = []
    outputs = [solver.outputs(solver.anchor)]
    periods: list[int] = []  # numbers of turns after which all poses so far have repeated
    for turn in range(1, 2 * most + 1):
        leg = _leg(solver, legs[-1].poses[-1] if legs else solver.anchor, path, 1.0)
        legs.append(leg)
        if not leg.is_whole:
            return _joined(legs), None
        outputs += map(solver.outputs, leg.poses)
        periods += [turn] if turn <= most else []
        periods = [n for n in periods if _repeats(plan, outputs, n * len(leg.poses), len(leg.poses))]
        if periods and (is_periodic or turn == 2 * most):
            return _joined(legs[: periods[0]]), periods[0]
        if turn >= most and not periods:
            break
    return _joined(legs[:most]), None


def _joined(legs: list[_Leg]) -> _Leg:
    """Return legs that follow each other as one."""
    poses = [pose for leg in legs for pose in leg.poses]
    bridges = {bridge.centre: bridge for leg in legs for bridge in leg.bridges}
    return _Leg(poses, [*bridges.values()], legs[-1].limit, legs[-1].stopped)


def _repeats(plan: SolvePlan, outputs: list[tuple[float, ...]], period: int, last: int) -> bool:
    """Return True if each of the last poses equals the one a period before it, where there is one."""
    later = range(max(len(outputs) - 1 - last, period), len(outputs))
    return all(_is_back(plan, outputs[k - period], outputs[k]) for k in later)


def _is_back(plan: SolvePlan, before: tuple[float, ...], after: tuple[float, ...]) -> bool:
    """Return True if two poses are equal modulo whole turns."""
    for name, a, b in zip(plan.outputs, before, after, strict=True):
        apart = math.remainder(b - a, math.tau) if name.is_angle else (b - a) / plan.size
        if abs(apart) > _REPEATS:
            return False
    return True


def _leg(solver: Solver, start: Pose, distance: float, unit: float) -> _Leg:
    """Follow the driver from a pose over a distance, in steps that miss no singular point."""
    poses: list[Pose] = []
    bridges: list[Bridge] = []
    pose, count = start, math.ceil(abs(distance) / (STEP * unit))
    for k in range(1, count + 1):
        arrived = advance(solver.model, pose.base or pose, (start.u[0] + distance * k / count,))
        if isinstance(arrived, Limit):
            return _Leg(poses, bridges, limit=arrived)
        if not arrived.good:
            return _Leg(poses, bridges, stopped=arrived.message)
        pose = arrived
        poses.append(pose)
        crossed = {bridge.centre for bridge in bridges}
        bridges += [
            bridge
            for bridge in (pose.singularities.bridges if pose.singularities else ())
            if bridge.centre not in crossed
        ]
    return _Leg(poses, bridges)


def alone(plan: SolvePlan, number: int) -> SolvePlan:
    """Return the plan of one driver alone, by its number, with all coordinates as outputs.

    The other drivers keep their values in the plan's anchor, and it starts from the anchor's pose. Returns the plan
    itself if there is nothing to hold.
    """
    mechanism = plan.mechanism
    if len(mechanism.drivers) == 1 and isinstance(mechanism.coordinates, str):
        return plan
    taken = {joint.name for joint in mechanism.joints}
    held = []
    for k, driver in enumerate(mechanism.drivers):
        if k != number:
            name = driver.name
            while name in taken:
                name += "_held"
            taken.add(name)
            held.append(HeldDriver(name, driver, float(plan.anchor.u[k])))
    return compile_plan(
        replace(
            started(mechanism, in_world(plan.origin, plan.anchor.q)),
            joints=(*mechanism.joints, *held),
            drivers=(mechanism.drivers[number],),
            coordinates="all",
            points={},
            measures=(),  # they may read forces of the other drivers
        )
    )


def started(mechanism: Mechanism, pose: FloatArray) -> Mechanism:
    """Return the mechanism with this pose of all coordinates, in the world, as its start."""
    poses = iter(pose.reshape(-1, 3).tolist())
    bodies = [body if body.is_ground else replace(body, start=Start(*next(poses))) for body in mechanism.bodies]
    return replace(mechanism, bodies=tuple(bodies))


@dataclass(frozen=True)
class HeldDriver(Held):
    """The quantity of a driver, held at a value.

        Phi = quantity - value, or the row that the quantity defines in its place        (1 row)

    Only `check` uses it: the range of one driver is found with the others at their start values.
    """

    type: ClassVar[str] = "held_driver"
    labels: ClassVar[tuple[str, ...]] = ("value",)

    name: str
    driver: Driver = field(metadata={"internal": True})
    value: float = field(metadata={"internal": True})

    def moved(self, dx: float, dy: float) -> HeldDriver:
        quantity = self.driver.measured()
        if not isinstance(quantity, CoordinateOf):
            return self
        return replace(self, value=decimal_sum(self.value, dx if quantity.axis == "x" else dy))

    def measured(self) -> tuple[PoseQuantity, float]:
        return self.driver.measured(), self.value


LOOKS = 201  # times of a run at which a driver is evaluated


def value_text(value: float, unit: str, kind: str) -> str:
    """Return a driver value as text: 'pi (180 deg)', '0.7227 rad (41.41 deg)' or '0.35 m'."""
    if kind != "angle":
        return f"{value:.9g} {unit}"
    return f"{multiple_of_pi(value) or f'{value:.9g} rad'} ({round(math.degrees(value), 8) + 0.0:.9g} deg)"


def place_text(value: float, unit: str) -> str:
    """Return where something occurs as text: '41.41 deg' for an angle in rad, '0.35 m', '1.2 s'."""
    return degrees(value) if unit == "rad" else f"{value:.6g} {unit}"


def driver_text(driver: Driver, value: float, unit: str) -> str:
    """Return a driver with its value as text: 'crank = pi (180 deg)'."""
    return f"{driver.name} = {value_text(value, unit, driver.quantity.kind)}"


def law_values(driver: Driver, run: RunSettings) -> list[float]:
    """Return the driver's values at 201 times of a run."""
    return [float(driver.law.at(t)) for t in np.linspace(run.start, run.stop, LOOKS).tolist()]


def multiple_of_pi(value: float) -> str | None:
    """Return '0', 'pi', '3 pi/2' for simple fractions of pi, to nine digits; None for others."""
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


def degrees(angle: float) -> str:
    """Return an angle [rad] as text: '41.4096 deg'."""
    return f"{round(math.degrees(angle), 4) + 0.0:.6g} deg"
