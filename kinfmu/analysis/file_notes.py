"""Notes of what in a mechanism file is hardly meant: in its numbers, in the run it asks for, in its start poses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from kinfmu.analysis.singular import DriverRange
from kinfmu.analysis.written import written
from kinfmu.drivers import AngleDriver, DistanceDriver
from kinfmu.equations.start_poses import StartValues, start_from_poses
from kinfmu.equations.system import System
from kinfmu.errors import listed
from kinfmu.joints.cam import Cam
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.members import NumberPath, path_text
from kinfmu.plan import SolvePlan
from kinfmu.sweep import solve
from kinfmu.units import Quantity, looks_like_degrees

_TURN = 2.0 * math.pi * (1.0 + 1e-9)  # [rad]; a whole turn may be meant
_LOOKS = 201  # times of a run at which a driver is looked at


def file_notes(mechanism: Mechanism) -> Iterator[str]:
    """One line about parameters that stand nowhere, and one for each angle that looks like degrees without a unit.

    And one for each driven distance that begins below 0, and for each cam that the run turns on where its lift ends.
    """
    unused = mechanism.unused_parameters
    if unused:
        one = "changes" if len(unused) == 1 else "change"
        yield f"[parameters] {listed(unused)} {one} nothing: no number of the mechanism refers to it"
    for driver in mechanism.drivers:
        first = float(driver.law.at(mechanism.run.start))
        if isinstance(driver, DistanceDriver) and first < 0.0:
            yield (
                f"[drivers.{driver.name}] the distance is {first:.6g} {mechanism.length_unit} at the start of the run: "
                "it counts without its sign, and shrinks as the value grows"
            )
    yield from _cams(mechanism)
    large: list[tuple[NumberPath, float]] = []

    def look(place: NumberPath, value: Any, quantity: Quantity) -> Any:
        is_turns = "law" in place or place[0] == "drivers"  # they go on for many turns; whole fifteens are degrees
        if quantity == Quantity("angle") and abs(value) > _TURN and (not is_turns or looks_like_degrees(value)):
            large.append((place, float(value)))
        return value

    mechanism.members.changed(look)
    for place, value in large:
        yield (
            f"{path_text(place)} = {value:.6g} rad is {math.degrees(value):.6g} deg, more than a turn: "
            "a bare angle is in radians; degrees are written such as '60 deg'"
        )


def _cams(mechanism: Mechanism) -> Iterator[str]:
    """One line for each cam that a driver turns by more than a turn, although its lift does not come again."""
    run = mechanism.run
    times = [run.start + (run.stop - run.start) * k / (_LOOKS - 1) for k in range(_LOOKS)]
    drivers = {driver.of: driver for driver in mechanism.drivers if isinstance(driver, AngleDriver)}
    for joint in mechanism.joints:
        if not isinstance(joint, Cam) or joint.cam not in drivers:
            continue
        why = joint.law.why_not_periodic()
        angles = [float(drivers[joint.cam].law.at(t)) for t in times] if why else []
        if why and max(angles) - min(angles) > _TURN:
            yield (
                f"[joints.{joint.name}] law: {why}; "
                f"[run] turns {joint.cam} by {math.degrees(max(angles) - min(angles)):.6g} deg"
            )


_LARGE = 600  # coordinates of a mechanism whose run with several drivers is left unlooked at


def run_notes(plan: SolvePlan, ranges: Sequence[DriverRange]) -> Iterator[str]:
    """One line where the file's run takes its driver past a limit, or several drivers where the mechanism cannot go."""
    mechanism = plan.mechanism
    times = np.linspace(mechanism.run.start, mechanism.run.stop, _LOOKS)
    if len(mechanism.drivers) == 1 and ranges:
        (driver,) = mechanism.drivers
        values = [float(driver.law.at(t)) for t in times.tolist()]
        low, high = (
            end if limit is None else limit for end, limit in ((-math.inf, ranges[0].low), (math.inf, ranges[0].high))
        )
        if min(values) < low or max(values) > high:
            ends = (values[0], values[-1])
            way = ends if {min(values), max(values)} == set(ends) else (min(values), max(values))
            asked = " to ".join(written(u, mechanism.length_unit, driver.quantity.kind) for u in way)
            yield f"[run] takes {driver.name} from {asked}: beyond the range"
    elif len(mechanism.drivers) > 1 and len(mechanism.coordinate_names) <= _LARGE:
        for event in solve(plan, times).events[:1]:
            yield f"[run] at t = {event.t:.6g} s: {event.text}"


def start_notes(system: System, values: StartValues) -> Iterator[str]:
    """Yield one line if the mechanism was assembled at the start of the laws in place of the start poses' values."""
    if not values.is_moved:
        return
    given, unit = start_from_poses(system).u, system.mechanism.length_unit
    changed = [
        (driver.name, written(there, unit, driver.quantity.kind), written(start, unit, driver.quantity.kind))
        for driver, there, start in zip(system.mechanism.drivers, given.tolist(), values.u.tolist(), strict=True)
        if there != start
    ]
    yield (
        f"the start poses give {listed(f'{name} = {there}' for name, there, _ in changed)}; the law starts at "
        f"{listed(f'{name} = {start}' for name, _, start in changed)}, which cannot be reached from there: "
        "the mechanism is assembled at the start of the law"
    )
