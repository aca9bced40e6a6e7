"""Named loops and dyads with their transmission angles, over the range of a driver."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from kinfmu.analysis.driver_path import DriverPath
from kinfmu.analysis.loops import (
    Dyad,
    FourBar,
    Grashof,
    Place,
    SliderCrank,
    dyads,
    four_bar_class,
    named_loops,
    slider_crank_class,
)
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import AngleDriver
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.solver.python import Pose

POOR = math.radians(40.0)  # [rad]; the usual lower bound
LOCKED = math.radians(1e-4)  # [rad]; a smaller angle is 0 within rounding, because it is an arc cosine
_STRAIGHT = 1e-7  # a cosine this close to 1 at a limit is 1, because there the coupler is in line

Coordinates = Mapping[str, float]


@dataclass(frozen=True)
class TransmissionRange:
    """Extremes of the angle between coupler and output, 0 to pi; pi/2 is best, 0 and pi transmit nothing.

    Attributes:
        driver: Name of the driver.
        kind: What its value is: 'angle' or 'length'.
        coupler: Name of the coupler, or of the rod.
        output: Name of the output link, or of the slider.
        is_slide: True if the output slides: the angle is then that between the rod and the normal of the slide.
        smallest: Smallest angle [rad].
        at_smallest: Value of the driver there.
        largest: Largest angle [rad].
        at_largest: Value of the driver there.
        in_line_at: Limits of the driver at which the angle is 0 or pi.

    """

    driver: str
    kind: str
    coupler: str
    output: str
    is_slide: bool
    smallest: float
    at_smallest: float
    largest: float
    at_largest: float
    in_line_at: tuple[float, ...] = ()

    @property
    def worst(self) -> float:
        """The smallest acute angle between the two [rad]."""
        return min(self.smallest, math.pi - self.largest)

    @property
    def verdict(self) -> str:
        """'locks' (0 somewhere), 'poor' (below 40 degrees) or 'good'."""
        if self.worst <= LOCKED:
            return "locks"
        return "poor" if self.worst < POOR else "good"

    def as_json(self) -> dict[str, Any]:
        """Return the extremes as plain data."""
        keys = ("driver", "coupler", "output", "smallest", "at_smallest", "largest", "at_largest", "verdict")
        return {key: getattr(self, key) for key in keys}


class _Cosine(NamedTuple):
    """Cosine of the angle as a smooth function of a pose, and its rate from coordinates and their rates."""

    value: Callable[[Coordinates], float]
    slope: Callable[[Coordinates, Coordinates], float]


def transmission_angle(path: DriverPath, loop: FourBar | SliderCrank) -> TransmissionRange | None:
    """Return the extremes of a loop's transmission angle over the path of a driver, to round-off in the driver value.

    None if the driver does not move the loop, or neither of its ends leads the other.
    """
    led = _led_four_bar(path.plan, loop) if isinstance(loop, FourBar) else _led_slider_crank(path.plan, loop)
    if led is None:
        return None
    coupler, output, cosine, is_slide = led
    return _range(path, coupler, output, cosine, is_slide=is_slide)


def dyad_angle(path: DriverPath, dyad: Dyad) -> tuple[TransmissionRange, tuple[Place, ...]] | None:
    """Return the extremes of a dyad's transmission angle over the path of a driver, and the places of its pins.

        cos mu = (b^2 + c^2 - f^2) / (2 b c)        f: distance of the other pins P and C of links of lengths b and c
        cos mu = n.(S - P) / l                      n: normal of the slide of the point S of a link of length l

    None if the driver does not move the links relative to each other, or if their other pins are not on bodies that
    are solved before both links.
    """
    places = path.plan.block_of
    own = {dyad.first.name, dyad.second.name}
    axes = ("phi",) if dyad.direction is None else ("x", "y")
    blocks = [places.get(f"{dyad.first.name}.phi"), *(places.get(f"{dyad.second.name}.{axis}") for axis in axes)]
    later = [block for block in blocks if block is not None]
    if not later or (dyad.direction is None and len(set(later)) > 1):
        return None

    def led(pin: Iterable[Place]) -> Place | None:
        """Return a pin as a place on a body that is solved before the links."""
        for place in pin:
            solved = [places.get(f"{place.body}.{axis}", -1) for axis in ("x", "y", "phi")]
            if place.body not in own and max(solved) < min(later):
                return place
        return None

    outer = [place for place in map(led, dyad.pins[::2]) if place is not None]
    if len(outer) < len(dyad.pins[::2]):
        return None
    middle, b, c = dyad.pins[1][0], dyad.first.length, dyad.second.length
    if dyad.direction is not None:
        cosine = _against_normal(outer[0], middle, b, dyad.direction)
    else:
        cosine = _opposite(b, c, outer[0], outer[1])
    found = _range(path, dyad.first.name, dyad.second.name, cosine, is_slide=dyad.direction is not None)
    return None if found is None else (found, (outer[0], middle, *outer[1:]))


def _range(path: DriverPath, coupler: str, output: str, cosine: _Cosine, *, is_slide: bool) -> TransmissionRange | None:
    found = _extremes(path, cosine)
    if found is None:
        return None
    (least, at_least), (most, at_most), in_line_at = found
    return TransmissionRange(
        driver=path.name,
        kind=path.kind,
        coupler=coupler,
        output=output,
        is_slide=is_slide,
        smallest=_angle(most),
        at_smallest=at_most,
        largest=_angle(least),
        at_largest=at_least,
        in_line_at=in_line_at,
    )


def _angle(cosine: float) -> float:
    return math.acos(max(-1.0, min(1.0, cosine)))


def _led_four_bar(plan: SolvePlan, loop: FourBar) -> tuple[str, str, _Cosine, bool] | None:
    """Return coupler, output and the cosine of their angle, if one end of the loop is solved before the rest.

    cos mu = (b^2 + c^2 - f^2) / (2 b c)        f: distance of the input's pin P from the output's pivot C
    """
    if is_led_by_last(plan, loop):
        loop = loop.turned_round()
    elif not is_led_by_last(plan, loop.turned_round()):
        return None
    _, p, _, c = loop.pins
    return loop.coupler.name, loop.last.name, _opposite(loop.coupler.length, loop.last.length, p, c), False


def is_led_by_last(plan: SolvePlan, loop: FourBar) -> bool:
    """Return True if the last link of a four-bar is solved before the others."""
    places = plan.block_of
    first, coupler, last = (places.get(f"{name}.phi") for name in loop.links)
    return _is_before(last, coupler, first)


def _led_slider_crank(plan: SolvePlan, loop: SliderCrank) -> tuple[str, str, _Cosine, bool] | None:
    """Return rod and slider led by the crank, or rod and crank led by the slider, and the cosine of their angle.

    cos mu = n.(S - P) / l        n: normal of the slide
    """
    places = plan.block_of
    crank, rod = (places.get(f"{link.name}.phi") for link in (loop.crank, loop.rod))
    slider = None
    if loop.slider != loop.rod.name:
        slider = max((places.get(f"{loop.slider}.{axis}", -1) for axis in ("x", "y")), default=-1)
    o, p, s = loop.pins
    if _is_before(crank, rod, slider):
        cosine = _against_normal(p, s, loop.rod.length, loop.direction)
        return loop.rod.name, loop.slider if slider is not None else loop.guide, cosine, True
    if _is_before(slider, rod, crank) or _drives_end(plan, loop):
        return loop.rod.name, loop.crank.name, _opposite(loop.rod.length, loop.crank.length, s, o), False
    return None


def _drives_end(plan: SolvePlan, loop: SliderCrank) -> bool:
    """Return True if a driver moves the guided end of the rod along the slide."""
    return loop.slider == loop.rod.name and any(
        driver.quantity.kind == "length" and set(driver.bodies()) <= {loop.rod.name, GROUND_NAME}
        for driver in plan.mechanism.drivers
    )


def _is_before(leading: int | None, *others: int | None) -> bool:
    """Return True if a coordinate is solved in an earlier block than the others; None is no coordinate."""
    later = [other for other in others if other is not None]
    return leading is not None and bool(later) and leading < min(later)


def _opposite(b: float, c: float, p: Place, q: Place) -> _Cosine:
    """Return the cosine of the angle between sides b and c of a triangle whose third side joins p and q."""

    def value(at: Coordinates) -> float:
        (px, py), (qx, qy) = p.world(at), q.world(at)
        return (b * b + c * c - (qx - px) ** 2 - (qy - py) ** 2) / (2.0 * b * c)

    def slope(at: Coordinates, rates: Coordinates) -> float:
        (px, py, pu, pv), (qx, qy, qu, qv) = p.motion(at, rates), q.motion(at, rates)
        return -((qx - px) * (qu - pu) + (qy - py) * (qv - pv)) / (b * c)

    return _Cosine(value, slope)


def _against_normal(p: Place, s: Place, length: float, direction: float) -> _Cosine:
    """Return the cosine of the angle between a rod from p to s and the normal of the line on which s slides."""
    n = (-math.sin(direction), math.cos(direction))

    def value(q: Coordinates) -> float:
        (px, py), (sx, sy) = p.world(q), s.world(q)
        return (n[0] * (sx - px) + n[1] * (sy - py)) / length

    def slope(q: Coordinates, qd: Coordinates) -> float:
        _, _, vx, vy = p.motion(q, qd)
        return -(n[0] * vx + n[1] * vy) / length

    return _Cosine(value, slope)


def _extremes(
    path: DriverPath, cosine: _Cosine
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, ...]] | None:
    """Return the smallest and largest cosine with their driver values, and the limits where it is -1 or 1.

    None if it does not change on the path.
    """

    def slope(pose: Pose) -> float:
        return cosine.slope(path.coordinates(pose), path.speeds(pose))

    poses = path.fine_poses
    slopes = [cosine.slope(q, qd) for q, qd in zip(path.fine_coordinates, path.fine_speeds, strict=True)]
    if max(map(abs, slopes)) * (poses[-1].u[0] - poses[0].u[0]) < 1e-9:
        return None
    found = []
    for before, after, a, b in zip(poses, poses[1:], slopes, slopes[1:], strict=False):
        if a * b < 0.0:
            pose = path.zero(slope, before, after)
            found.append((cosine.value(path.coordinates(pose)), pose.u[0]))
    found += [(cosine.value(q), pose.u[0]) for q, pose in zip(path.fine_coordinates, poses, strict=True)]
    in_line = []
    for limit in (path.low, path.high):
        if limit is not None:
            value = cosine.value(path.at_limit(limit))
            if abs(value) > 1.0 - _STRAIGHT:
                in_line.append(limit.u[0])
                value = math.copysign(1.0, value)
            found.append((value, limit.u[0]))
    least, most = ((cosine, path.within_cycle(u)) for cosine, u in (min(found), max(found)))
    return least, most, tuple(in_line)


MOST = 200  # coordinates; transmission angles of larger mechanisms are not computed


@dataclass(frozen=True)
class NamedLoop:
    """A four-bar or slider-crank with its class and its transmission angle over the path of each driver.

    assembly: of a four-bar in the assembled pose, 'open' or 'crossed'; '' for others, or without a pose.
    """

    loop: FourBar | SliderCrank
    grashof: Grashof
    transmission: tuple[TransmissionRange, ...] = ()
    assembly: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the loop as plain data."""
        loop, kind = self.loop, self.grashof
        if isinstance(loop, FourBar):
            lengths = dict(zip(("ground", *loop.links), loop.lengths, strict=True))
            sizes: dict[str, Any] = {"kind": "four-bar", "links": list(loop.links), "lengths": lengths}
        else:
            lengths = {link.name: link.length for link in (loop.crank, loop.rod)}
            sizes = {"kind": "slider-crank", "links": list(loop.links), "lengths": lengths, "offset": loop.offset}
        return {
            **sizes,
            "class": kind.name,
            "shape": kind.shape or None,
            "assembly": self.assembly or None,
            "sums": [kind.small, kind.large],
            "transmission": [angle.as_json() for angle in self.transmission],
        }


def find_named_loops(
    mechanism: Mechanism, redundancy: Redundancy, paths: Sequence[DriverPath]
) -> tuple[NamedLoop, ...]:
    """Return the four-bars and slider-cranks of a mechanism, each read from its driven end.

    Joints with a row set aside are ignored: they form no loop of their own. Large mechanisms have no
    transmission angles.
    """
    four_bars, slider_cranks = named_loops(mechanism, {row.row.owner for row in redundancy.dependent})
    followed = paths if len(mechanism.coordinate_names) <= MOST else ()
    found = [*_four_bars(mechanism, four_bars, paths, followed)]
    for loop in slider_cranks:
        angles = (transmission_angle(path, loop) for path in followed)
        kind = slider_crank_class(loop.crank.length, loop.rod.length, loop.offset)
        found.append(NamedLoop(loop, kind, tuple(angle for angle in angles if angle is not None)))
    return tuple(found)


def _four_bars(
    mechanism: Mechanism, loops: Sequence[FourBar], paths: Sequence[DriverPath], followed: Sequence[DriverPath]
) -> Iterator[NamedLoop]:
    driven = {driver.of for driver in mechanism.drivers if isinstance(driver, AngleDriver)}
    for loop in loops:
        from_last = any(is_led_by_last(path.plan, loop) for path in paths) if paths else loop.last.name in driven
        read = loop.turned_round() if from_last and loop.first.name not in driven else loop
        angles = (transmission_angle(path, read) for path in followed)
        kind, assembly = four_bar_class(*read.lengths), ""
        if paths:
            pose = paths[0].coordinates(paths[0].solver.anchor)
            assembly = "crossed" if read.is_crossed(pose) else "open"
        if kind.shape == "parallelogram" and assembly == "crossed":
            kind = replace(kind, shape="antiparallelogram")
        yield NamedLoop(read, kind, tuple(angle for angle in angles if angle is not None), assembly)


@dataclass(frozen=True)
class NamedDyad:
    """A dyad that is part of no four-bar or slider-crank, with its transmission angle over the path of each driver.

    pins: the places of its pins: of the first link, where the links meet, of the second link; of a link on a slide, of
    its pin and of the point that slides.
    """

    dyad: Dyad
    pins: tuple[Place, ...]
    transmission: tuple[TransmissionRange, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the dyad as plain data."""
        dyad = self.dyad
        links = [dyad.first] if dyad.direction is not None else [dyad.first, dyad.second]
        return {
            "links": [dyad.first.name, dyad.second.name],
            "lengths": {link.name: link.length for link in links},
            "joint": dyad.joint or None,
            "between": [place.body for place in (self.pins[0], *self.pins[2:])],
            "transmission": [angle.as_json() for angle in self.transmission],
        }


def find_dyads(
    mechanism: Mechanism, redundancy: Redundancy, paths: Sequence[DriverPath], loops: Sequence[NamedLoop]
) -> tuple[NamedDyad, ...]:
    """Return the dyads that a driver moves and whose transmission angle is that of no loop.

    Large mechanisms have no transmission angles.
    """
    if len(mechanism.coordinate_names) > MOST or not paths:
        return ()
    known = {frozenset((angle.coupler, angle.output)) for loop in loops for angle in loop.transmission}
    found = []
    for dyad in dyads(mechanism, {row.row.owner for row in redundancy.dependent}):
        key = frozenset((dyad.first.name, dyad.second.name))
        angles = [] if key in known else [angle for path in paths if (angle := dyad_angle(path, dyad)) is not None]
        if angles:
            known.add(key)
            found.append(NamedDyad(dyad, angles[0][1], tuple(angle for angle, _ in angles)))
    return tuple(found)
