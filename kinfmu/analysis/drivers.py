"""Drivers compared with degrees of freedom: surplus drivers, and what to add, to leave out or to change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import AssemblyError, KinfmuError, MobilityError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import AngleDriver, CoordinateDriver, Driver, RelativeAngleDriver, SlideDriver
from kinfmu.mechanism.joints import Fixed, PointOnLine, Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of, point_of
from kinfmu.mechanism.toml_text import toml_value
from kinfmu.plan.equations.closing import motion_samples, null_space
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.redundancy import Redundancy, find_redundancy
from kinfmu.plan.equations.system import System, placement
from kinfmu.units import CoordinateName

_SAMPLES = 4  # poses of the motion that the joints allow; a row dependent at all of them is dependent
_IN_SPAN = 1e-7  # part of a gradient outside the span of the others; smaller counts as zero
_MOVES = 1e-6  # part of a free direction; a coordinate with more counts as moving
INSTEAD = "; drive, for example, "
_LARGE = 600  # coordinates; the null space of more takes too long


class SurplusDriver(NamedTuple):
    """A driver whose quantity the joints and the drivers before it already determine.

    implied_by: names of those drivers; none if the joints alone determine it.
    """

    name: str
    implied_by: tuple[str, ...]


class Suggestion(NamedTuple):
    """A driver or joint that could be added, the keys of its table, and that table's name."""

    name: str
    keys: dict[str, Any]
    table: str = "drivers"

    def __str__(self) -> str:
        keys = ", ".join(f"{key} = {toml_value(value)}" for key, value in self.keys.items())
        return f"[{self.table}] {self.name} = {{ {keys} }}"


@dataclass(frozen=True)
class DriverAdvice:
    """Motion that the drivers leave free, at generic poses.

    missing: number of further drivers needed; surplus: drivers of quantities already determined; loose: names of
    coordinates that joints and drivers leave free; suggestions: pins that are probably missing, and drivers; added
    together they would determine the motion. idle: the body that moves alone though several joints hold it, such as a
    roller, None if there is none; stiff: fixed joints, each of which as a revolute one would leave the motion driven.
    """

    missing: int
    surplus: tuple[SurplusDriver, ...]
    loose: tuple[CoordinateName, ...]
    suggestions: tuple[Suggestion, ...]
    idle: str | None = None
    stiff: tuple[str, ...] = ()

    @property
    def loose_bodies(self) -> tuple[str, ...]:
        """Names of the bodies with a loose coordinate."""
        return tuple(dict.fromkeys(name.owner for name in self.loose))

    def as_json(self) -> dict[str, Any]:
        """Return the advice as plain data."""
        return {
            "missing": self.missing,
            "surplus": [{"name": s.name, "implied_by": list(s.implied_by)} for s in self.surplus],
            "loose": list(self.loose),
            "suggestions": [{"table": s.table, "name": s.name, "keys": s.keys} for s in self.suggestions],
            "idle": self.idle,
            "stiff": list(self.stiff),
        }


def driver_advice(system: System, redundancy: Redundancy) -> DriverAdvice | None:
    """Return which drivers are surplus, which coordinates are loose, and which drivers would determine them.

    None if drivers and degrees of freedom match, if the joints do not close, or if the mechanism is too large.
    """
    if len(system.coordinates) > _LARGE:
        return None
    poses = list(motion_samples(Part(system, redundancy.kept), redundancy.assembly.start.q, _SAMPLES))
    if not poses:
        return None
    gradients = [system.scaled_jacobian(pose) for pose in poses]
    rows, surplus = _independent_rows(system, gradients, list(redundancy.kept))
    free = null_space(gradients[-1][rows])  # (n, free directions)
    if free.shape[1] == 0 and not surplus:
        return None
    loose = tuple(
        name for name, part in zip(system.coordinates, free, strict=True) if np.abs(part).max(initial=0.0) > _MOVES
    )
    missing, start = free.shape[1], redundancy.assembly.start.q
    suggestions = tuple(_suggestions(system, start, poses[-1], free))
    idle = idle_body(system.mechanism, tuple(dict.fromkeys(name.owner for name in loose)), missing)
    stiff = stiff_joints(system.mechanism, redundancy)
    return DriverAdvice(missing, tuple(surplus), loose, suggestions, idle, stiff)


def _independent_rows(
    system: System, gradients: Sequence[FloatArray], rows: list[int]
) -> tuple[list[int], list[SurplusDriver]]:
    """Return the rows of joints and independent drivers in file order, and the surplus drivers."""
    surplus = []
    counted: list[int] = []
    for index in range(system.joint_row_count, len(system.rows)):
        others = [*rows, *counted]
        used = np.zeros(len(others), dtype=bool)
        is_outside = False
        for jacobian in gradients:
            basis, gradient = jacobian[others].T, jacobian[index]
            weights = np.linalg.lstsq(basis, gradient, rcond=1e-9)[0]
            left = float(np.linalg.norm(gradient - basis @ weights))
            is_outside |= left > _IN_SPAN * max(1.0, float(np.linalg.norm(gradient)))
            used |= np.abs(weights) > _MOVES
        if is_outside:
            counted.append(index)
        else:
            by = [system.rows[k].owner for k, is_used in zip(others, used, strict=True) if is_used and k in counted]
            surplus.append(SurplusDriver(system.rows[index].owner, tuple(by)))
    return [*rows, *counted], surplus


def _suggestions(system: System, start: FloatArray, pose: FloatArray, free: FloatArray) -> Iterator[Suggestion]:
    """Yield pins that are probably missing, then drivers for the free directions left, the most natural first."""
    for pin in missing_pins(system, start, pose, free):
        yield Suggestion(pin.name, {"type": pin.type, "between": list(pin.between)}, "joints")
        probe = System(replace(system.mechanism, joints=(pin,), drivers=(), measures=()), system.size)
        free = free @ null_space(probe.scaled_jacobian(pose) @ free)
    taken = {driver.name for driver in system.mechanism.drivers}
    for driver in _candidates(system.mechanism):
        if free.shape[1] == 0:
            return
        gradient = _gradient(system, driver, pose) @ free  # component along each free direction
        if np.linalg.norm(gradient) <= 1e-3:
            continue
        name = driver.name
        while name in taken:
            name += "_2"
        taken.add(name)
        yield Suggestion(name, _keys(driver))
        free = free @ null_space(gradient[None, :])


def _candidates(mechanism: Mechanism) -> Iterator[Driver]:
    """Yield drivers in order of preference: motors on the ground, slides, motors between bodies, then any."""
    pinned = [joint for joint in mechanism.joints if isinstance(joint, Revolute)]
    slides = [joint for joint in mechanism.joints if isinstance(joint, Translational)]
    slots = [joint for joint in mechanism.joints if isinstance(joint, PointOnLine)]
    rigid = {body for joint in mechanism.joints if isinstance(joint, Fixed) for body in joint.bodies()[1:]}
    for pin in pinned:
        if GROUND_NAME in pin.bodies():
            (name,) = (name for name in pin.bodies() if name != GROUND_NAME)
            yield AngleDriver(name, name)
    for on_ground in (True, False):
        for slide in slides:
            if (GROUND_NAME in slide.bodies()) is on_ground:
                yield SlideDriver(slide.name, slide.between, slide.axis)
    for pin in pinned:
        if GROUND_NAME not in pin.bodies():
            i, j = pin.bodies()
            yield RelativeAngleDriver(pin.name, (i, j))
    for slot in slots:
        yield SlideDriver(slot.name, slot.between, slot.axis)
    for body in mechanism.moving_bodies:
        if body.name not in rigid:
            yield AngleDriver(body.name, body.name)
            for point in body.points:
                for axis in ("x", "y"):
                    yield CoordinateDriver(f"{body.name}_{axis}", f"{body.name}.{point}", axis)


def _gradient(system: System, driver: Driver, pose: FloatArray) -> FloatArray:
    """Return the gradient of the driven quantity with respect to the scaled coordinates, (n,)."""
    probe = System(replace(system.mechanism, joints=(), drivers=(driver,), measures=()), system.size)
    gradient = probe.jacobian(pose)[0] * system.column_scales
    length = float(np.linalg.norm(gradient))
    return np.asarray(gradient / length) if length > 0.0 else gradient


def _keys(driver: Driver) -> dict[str, Any]:
    """Return the keys of a driver's table, with the simplest law and without defaults."""
    keys: dict[str, Any] = {"type": driver.type}
    for field in fields(driver):  # type: ignore[arg-type]  # every leaf is a dataclass, unknown to the contract
        value = getattr(driver, field.name)
        if field.name not in ("name", "law") and value != field.default:
            keys[field.name] = list(value) if isinstance(value, tuple) else value
    keys["law"] = driver.law.type
    return keys


def clearer_problem(
    problem: KinfmuError, system: System, redundancy: Redundancy, advice: DriverAdvice | None
) -> KinfmuError:
    """Return the problem, or one that names drivers of one degree of freedom while another is free."""
    if isinstance(problem, AssemblyError) and redundancy.mobility < 0 and len(system.coordinates) <= _LARGE:
        stiff = stiff_joints(system.mechanism, redundancy)
        return AssemblyError(f"{problem} {_is_pin(stiff)}", **problem.data) if stiff else problem
    if advice is None or redundancy.inconsistent:
        return problem
    is_of_mobility = isinstance(problem, MobilityError)
    if advice.stiff and is_of_mobility:
        return MobilityError(f"{problem}; {_is_pin(advice.stiff)}", **problem.data)
    if advice.idle and not advice.surplus and is_of_mobility:
        return MobilityError(f"{problem}; or leave out {advice.idle}, which no other body follows", **problem.data)
    if not advice.surplus or not advice.loose:
        return problem
    conflicts = [
        f"[drivers.{surplus.name}] drives what "
        + (f"{listed(surplus.implied_by)} and the joints determine" if surplus.implied_by else "the joints hold")
        for surplus in advice.surplus
    ]
    instead = f"{INSTEAD}{advice.suggestions[0]}" if advice.suggestions else ""
    return MobilityError(
        f"{listed(conflicts)}, while {listed(advice.loose_bodies)} can still move{instead}",
        mobility=redundancy.mobility,
    )


def _is_pin(stiff: Sequence[str]) -> str:
    return f"is {listed(stiff)} a revolute joint?"


_SAME = 1e-3  # of the size; points of two bodies that are nearer in the start pose are one pin
_RANK = 1e-3  # of the free directions; a pin that holds less holds nothing new
_MOST_POINTS = 400  # every pair is compared


def missing_pins(system: System, start: FloatArray, pose: FloatArray, free: FloatArray) -> Iterator[Revolute]:
    """Yield pins that are probably missing: points at one place, or of one name if a start pose is incomplete.

    Args:
        system: The equations of a mechanism with more degrees of freedom than drivers.
        start: (n,) rough start pose.
        pose: (n,) pose of the motion that joints and drivers leave.
        free: (n, k) free directions there.

    Yields:
        Pins that together hold two of the free directions each.

    """
    mechanism = system.mechanism
    taken = {joint.name for joint in mechanism.joints}
    for a, b in _pairs(mechanism, start, _SAME * system.size):
        if free.shape[1] < 2:
            return
        name = point_of(a) if point_of(a) == point_of(b) else f"{point_of(a)}_{point_of(b)}"
        while name in taken:
            name += "_2"
        pin = Revolute(name, (a, b))
        probe = System(replace(mechanism, joints=(pin,), drivers=(), measures=()), system.size)
        holds = probe.scaled_jacobian(pose) @ free  # (2, k)
        if np.linalg.svd(holds, compute_uv=False)[-1] <= _RANK:
            continue
        taken.add(name)
        yield pin
        free = free @ null_space(holds)


def _pairs(mechanism: Mechanism, start: FloatArray, near: float) -> list[tuple[str, str]]:
    """Return pairs of points that are probably one pin, of which at least one is in no joint; the likeliest first."""
    joined = {point for joint in mechanism.joints for point in getattr(joint, "between", ()) if "." in str(point)}
    points = list(mechanism.body_points)
    if len(points) > _MOST_POINTS:
        return []
    at = placement(mechanism, start.tolist())
    places = {point: np.array(at.point(point)) for point in points}
    is_open = {body.name: None in body.start for body in mechanism.moving_bodies} | {GROUND_NAME: False}
    linked = {frozenset(joint.bodies()) for joint in mechanism.joints}
    found = []
    for a, b in combinations(points, 2):
        bodies = body_of(a), body_of(b)
        if bodies[0] == bodies[1] or {a, b} <= joined or frozenset(bodies) in linked:
            continue
        is_same = point_of(a) == point_of(b)
        is_near = float(np.hypot(*(places[a] - places[b]))) <= near
        if is_near or (is_same and (is_open[bodies[0]] or is_open[bodies[1]])):
            found.append((not is_same, not is_near, len({a, b} & joined), a, b))
    return [(a, b) for *_, a, b in sorted(found, key=lambda one: one[:3])]


def idle_body(mechanism: Mechanism, loose: tuple[str, ...], missing: int) -> str | None:
    """Return the only body that can still move if several joints hold it, such as a roller on its pin; else None.

    loose: bodies that can still move; missing: number of missing drivers.
    """
    if missing != 1 or len(loose) != 1:
        return None
    others = [set(joint.bodies()) - {*loose} for joint in mechanism.joints if loose[0] in joint.bodies()]
    return loose[0] if len(others) > 1 else None


def stiff_joints(mechanism: Mechanism, redundancy: Redundancy) -> tuple[str, ...]:
    """Return names of fixed joints each of which, as a revolute joint, would give every driver a degree of freedom."""
    wanted = len(mechanism.drivers)
    if redundancy.mobility >= wanted:
        return ()
    found = []
    for joint in mechanism.joints:
        if isinstance(joint, Fixed):
            pin = Revolute(joint.name, joint.between)
            joints = tuple(pin if one is joint else one for one in mechanism.joints)
            if find_redundancy(System(replace(mechanism, joints=joints))).mobility == wanted:
                found.append(joint.name)
    return tuple(found)
