"""Notes on probable mistakes in a mechanism file: in its numbers and their units, its run, its start poses."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence

import numpy as np

from kinfmu.analysis.driver_path import LOOKS, degrees, follow, law_values, value_text
from kinfmu.analysis.singular import DriverRange, driver_range
from kinfmu.errors import KinfmuError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import AngleDriver, DistanceDriver
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.joints.cam import Cam, CamOscillating
from kinfmu.mechanism.laws import MotionSequence, Spline
from kinfmu.mechanism.members import NumberPath, path_text
from kinfmu.mechanism.number import given_unit
from kinfmu.mechanism.operations import Dimension
from kinfmu.mechanism.parameters import dimensions_of
from kinfmu.mechanism.quantities import AngleBetween
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.equations.start_poses import StartValues, is_in_world_coordinates, open_joints_text, start_from_poses
from kinfmu.plan.equations.system import System
from kinfmu.run.solve import solve
from kinfmu.units import METRES, PLAUSIBLE_TURN, Quantity, looks_like_degrees, unit_of

_TABLES = (Spline, MotionSequence)  # laws that keep their last value beyond their end
_FAR = 0.5  # [rad]; start angles read off a sketch are nearer to those of a cam
_LARGE = 600  # coordinates; a larger mechanism is not evaluated for a note on its run
_USUAL = {  # a bare number is in N/m or N s/m
    ("stiffness", "mm"): "N/mm",
    ("stiffness", "cm"): "N/cm",
    ("stiffness", "in"): "lbf/in",
    ("damping", "mm"): "N s/mm",
}
_EARTH = (9.7, 10.1)  # [m/s2]; what is written for the gravity of the earth
LEAVES_RANGE = "[run] takes", "[run] at t ="  # how notes begin on a run that leaves what the mechanism can reach
_SLIP = 1000.0  # between m and mm
_APART = 100.0  # a length that is farther from all others is probably one in another unit
_FREE_APART = 20.0  # the same for free lengths, which are like the distances that springs span
_NEAR = 2.0  # of the others' range, in which the length is then
_FEWEST = 3  # other lengths that tell


def file_notes(mechanism: Mechanism, written: Mechanism | None = None) -> Iterator[str]:
    """Yield a line for unused parameters and one for each angle that looks like degrees without a unit.

    Also one for each driven distance that starts below 0, for each cam or load that turns beyond the end of its law,
    for gravity without masses, and for probable slips of units. written: the mechanism as in its file, whose bare
    numbers count.
    """
    unused = mechanism.unused_parameters
    if unused:
        verb = "changes" if len(unused) == 1 else "change"
        yield f"[parameters] {listed(unused)} {verb} nothing: no number of the mechanism refers to it"
    for driver in mechanism.drivers:
        first = float(driver.law.at(mechanism.run.start))
        if isinstance(driver, DistanceDriver) and first < 0.0:
            yield (
                f"[drivers.{driver.name}] the distance is {first:.6g} {mechanism.length_unit} at the start of the run: "
                "its magnitude counts, and decreases as the value increases"
            )
    yield from _lengths_without_a_unit(mechanism)
    yield from _cams(mechanism)
    yield from _loads(mechanism)
    yield from _bare_angles(mechanism if written is None else written)
    yield from unit_notes(mechanism if written is None else written)


def _bare_angles(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for each angle without a unit that is probably in degrees."""
    large: dict[tuple[NumberPath, float], tuple[NumberPath, float]] = {}  # a rise and its return are one mistake
    cams = {joint.name for joint in mechanism.joints if isinstance(joint, Cam)}
    for place, value, quantity in mechanism.members.numbers():
        # Those of laws may be many turns, but for cams; multiples of 15 are probably degrees.
        is_turns = ("law" in place and place[1] not in cams) or place[0] == "drivers"
        if (
            quantity == Quantity("angle")
            and not given_unit(value)
            and abs(value) > PLAUSIBLE_TURN
            and (not is_turns or looks_like_degrees(value))
        ):
            owner = place[:2] if "law" in place else place
            large.setdefault((owner, abs(value)), (place, float(value)))
    for place, value in large.values():
        yield (
            f"{path_text(place)} = {value:.6g} rad is {math.degrees(value):.6g} deg, more than a turn: "
            "a bare angle is in radians; degrees are written such as '60 deg'"
        )


def _lengths_without_a_unit(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for each pure number that would be a length in every expression with it: '0.8*crank' of a length."""
    dimensions, length = dimensions_of(mechanism.parameters), Quantity("length")
    places: dict[str, list[tuple[Expression, Quantity]]] = {}
    for place, _, quantity in mechanism.members.numbers():
        if place in mechanism.expressions:
            expression = mechanism.expressions[place]
            for name in expression.names:
                places.setdefault(name, []).append((expression, quantity))
    derived = {name for p in mechanism.parameters.values() if p.expression for name in p.expression.names}
    for name, parameter in mechanism.parameters.items():
        value = float(parameter.value)
        if parameter.kind != "number" or parameter.expression or name in derived or value == 1.0:  # 1: a scale
            continue
        uses = places.get(name, [])
        if uses and all(quantity == length and _is_length(one, name, dimensions) for one, quantity in uses):
            yield (
                f"[parameters] {name} = {value:.12g} has no unit and is a pure number, although '{uses[0][0].text}' is "
                f'a length: if {name} is one, write {name} = "{value:.12g} {mechanism.length_unit}", '
                "a unit that studies, fits and FMUs then know"
            )


def _is_length(expression: Expression, name: str, dimensions: Mapping[str, Dimension]) -> bool:
    """Return True if an expression is a length with this parameter as a length, and none with it as a number."""
    if any(not dimensions[other].is_known for other in expression.names if other != name):
        return False
    length = Dimension.of(Quantity("length"))

    def is_length(of_parameter: Dimension) -> bool:
        try:
            found = expression.dimension({**dimensions, name: of_parameter})
        except KinfmuError:
            return False
        return found.is_known and found.powers == length.powers

    return is_length(length) and not is_length(Dimension())


def _cams(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for each cam that a driver turns by more than a turn, although its lift is not periodic."""
    drivers = {driver.of: driver for driver in mechanism.drivers if isinstance(driver, AngleDriver)}
    for joint in mechanism.joints:
        if not isinstance(joint, Cam) or joint.cam not in drivers:
            continue
        if why := joint.law.why_not_periodic():
            yield from _turned_beyond(f"[joints.{joint.name}] law: {why}", mechanism, drivers[joint.cam])


def _loads(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for gravity without masses, and for each table of a load that ends while a driver turns on."""
    if mechanism.gravity is not None and not mechanism.has_masses:
        yield "[gravity] has no effect: no body has a mass"
    drivers = {driver.of: driver for driver in mechanism.drivers if isinstance(driver, AngleDriver)}
    for load in mechanism.loads:
        over = getattr(load, "over", None)
        if not isinstance(over, AngleBetween) or over.of not in drivers or over.to not in (None, GROUND_NAME):
            continue
        law = getattr(load, "law", None)
        if not isinstance(law, _TABLES) or law.repeats:
            continue
        why = law.why_not_periodic()
        yield from _turned_beyond(f"[loads.{load.name}] law: {why}", mechanism, drivers[over.of])


def _turned_beyond(law: str, mechanism: Mechanism, driver: AngleDriver) -> Iterator[str]:
    """Yield a line for a law that is not periodic, if the run turns its driver by more than a turn."""
    angles = law_values(driver, mechanism.run)
    turn = max(angles) - min(angles)
    if turn > PLAUSIBLE_TURN:
        yield f"{law}; [run] turns {driver.of} by {math.degrees(turn):.6g} deg"


def run_notes(plan: SolvePlan, ranges: Sequence[DriverRange]) -> Iterator[str]:
    """Yield a line if the run exceeds the range of its driver, or if several drivers leave the reachable poses."""
    mechanism = plan.mechanism
    if len(mechanism.drivers) == 1 and ranges:
        (driver,) = mechanism.drivers
        values = law_values(driver, mechanism.run)
        low, high = (
            end if limit is None else limit for end, limit in ((-math.inf, ranges[0].low), (math.inf, ranges[0].high))
        )
        if min(values) < low or max(values) > high:
            ends = (values[0], values[-1])
            extent = ends if {min(values), max(values)} == set(ends) else (min(values), max(values))
            asked = " to ".join(value_text(u, mechanism.length_unit, driver.quantity.kind) for u in extent)
            yield f"{LEAVES_RANGE[0]} {driver.name} from {asked}: beyond the range"
    elif len(mechanism.drivers) > 1 and len(mechanism.coordinate_names) <= _LARGE:
        times = np.linspace(mechanism.run.start, mechanism.run.stop, LOOKS)
        for event in solve(plan, times).events[:1]:
            yield f"{LEAVES_RANGE[1]} {event.t:.6g} s: {event.text}"


def beyond_range(mechanism: Mechanism) -> list[str]:
    """Return the notes of `run_notes` for a mechanism that can be planned; none for a large one."""
    if len(mechanism.coordinate_names) > _LARGE:
        return []
    plan = compile_plan(mechanism)
    ranges = [driver_range(follow(plan, 0))] if len(mechanism.drivers) == 1 else []
    return list(run_notes(plan, ranges))


def start_notes(system: System, values: StartValues) -> Iterator[str]:
    """Yield a line for joints that the start poses leave wide open, and one for a start at other driver values.

    That is a mechanism assembled at the start of the laws in place of the start poses' values.
    """
    opened = open_joints_text(system, start_from_poses(system).q)
    if opened:
        them, their = ("them", "their") if ", " in opened else ("it", "its")
        cure = f"; check the coordinates of {their} points" if is_in_world_coordinates(system.mechanism) else ""
        yield f"in the start poses of the file {opened}; assembly closed {them}{cure}"
    yield from _turned_followers(system)
    if not values.is_moved:
        return
    starts, unit = start_from_poses(system).u, system.mechanism.length_unit
    changed = [
        (driver.name, value_text(there, unit, driver.quantity.kind), value_text(start, unit, driver.quantity.kind))
        for driver, there, start in zip(system.mechanism.drivers, starts.tolist(), values.u.tolist(), strict=True)
        if there != start
    ]
    yield (
        f"the start poses give {listed(f'{name} = {there}' for name, there, _ in changed)}; the law starts at "
        f"{listed(f'{name} = {start}' for name, _, start in changed)}, which cannot be reached from there: "
        "the mechanism is assembled at the start of the law"
    )


def _turned_followers(system: System) -> Iterator[str]:
    """Yield a line for each oscillating follower that its cam holds far from its start angle."""
    bodies = system.mechanism.moving_bodies
    with_angle = {body.name for body in bodies if body.start.phi is not None}
    residual = system.residual(start_from_poses(system).q, np.zeros(len(system.mechanism.drivers)))
    for member in system.members[: len(system.mechanism.joints)]:
        joint = member.owner
        if isinstance(joint, CamOscillating) and with_angle.issuperset(member.bodies):
            off = math.remainder(float(residual[member.rows[0]]), math.tau)
            if abs(off) > _FAR:
                yield (
                    f"[joints.{joint.name}] turns {joint.between[1]} by {degrees(-off)} from its start pose: check "
                    f"offset = {degrees(joint.offset)} and the law"
                )


def unit_notes(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for each bare number that is probably in another unit than its own; mechanism: as written."""
    unit = mechanism.length_unit
    lengths: dict[NumberPath, float] = {}
    bare: dict[NumberPath, tuple[float, Quantity]] = {}
    for place, value, quantity in mechanism.members.numbers():
        is_start = place[0] == "bodies" and place[2] == "start"
        if "law" in place or is_start or place[0] == "measures" or not value:
            continue
        if quantity == Quantity("length"):
            lengths[place] = abs(float(value))
        if not given_unit(value) and place not in mechanism.expressions:
            bare[place] = float(value), quantity
    yield from _gravity(mechanism, bare)
    for place, (value, quantity) in bare.items():
        meant = _USUAL.get((quantity.kind, unit))
        if meant:
            understood = f"{value:.12g} {unit_of(quantity, unit)}"
            yield (
                f"{path_text(place)} = {value:.12g} is {understood}, although the unit of length is {unit}: write "
                f"'{value:.12g} {meant}' if intended, else '{understood}'"
            )
    ends = {point for joint in mechanism.joints for point in getattr(joint, "between", ())}
    yield from dict.fromkeys(
        text
        for place, (value, _) in bare.items()
        if place in lengths
        for text in _lengths(place, value, lengths, unit, is_link=_is_link(place, ends))
    )  # once for the two coordinates of a point


def _gravity(mechanism: Mechanism, bare: dict[NumberPath, tuple[float, Quantity]]) -> Iterator[str]:
    """Yield a line for a bare gravity that is the earth's in another unit of length."""
    size, unit = math.hypot(*(mechanism.gravity or (0.0, 0.0))), mechanism.length_unit
    places = [place for place in bare if place[0] == "gravity"]
    near = [one for one in ("m", "mm", "cm", "in", "ft") if _EARTH[0] <= size * METRES[one] <= _EARTH[1]]
    if places and near and unit not in near:
        value, _ = bare[places[0]]
        yield (
            f"{path_text(places[0])} = {value:.12g} is {value:.12g} {unit}/s2, {size * METRES[unit]:.6g} m/s2 in all: "
            f"for the gravity of the earth write '{value:.12g} {near[0]}/s2'"
        )


def _is_link(place: NumberPath, ends: Container[str]) -> bool:
    """Return whether a number is the place of a joint on a moving body, whose length is noted as that of a link."""
    return place[2:3] == ("points",) and place[1] != GROUND_NAME and f"{place[1]}.{place[3]}" in ends


def _lengths(
    place: NumberPath, value: float, lengths: dict[NumberPath, float], unit: str, *, is_link: bool
) -> Iterator[str]:
    """Yield a line for a length that all others are a thousand times, or a thousandth of."""
    size, least = abs(value), _FREE_APART if place[-1] == "free_length" else _APART
    others = [other for other in lengths.values() if max(other, size) > min(other, size) * math.sqrt(least)]
    if len(others) < _FEWEST or len(others) <= len(lengths) - len(others):
        return
    low, high = min(others), max(others)
    for factor, word in ((_SLIP, "a thousandth of"), (1.0 / _SLIP, "a thousand times")):
        is_apart = size * least < low if factor > 1.0 else size > high * least
        meant = [f"{value:.12g} {one}" for one in ("m", "mm") if math.isclose(METRES[one], METRES[unit] * factor)]
        if not is_link:
            meant.append(f"{value * factor:.12g} {unit}")
        if is_apart and low / _NEAR <= size * factor <= high * _NEAR and meant:
            yield (
                f"{path_text(place)}: {value:.12g} is {value:.12g} {unit}, about {word} the other lengths ({low:.6g} "
                f"to {high:.6g} {unit}); write '{meant[0]}' if intended"
            )
