"""Drawn: a random mechanism with its closed form, its place in the world, and its laws."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from random import Random
from typing import Any, NamedTuple

import numpy as np

from kinfmu import Body, Mechanism, MotionSequence, Revolute, Segment
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from tests.power_series import mp
from tests.stress.jets import LONG, Array, Exact, Jet, Numbers, Value, Vector, turned
from tests.stress.loops import Closing

TURN = 2.0 * np.pi


class Pose(NamedTuple):
    """Where a body is: its frame's origin and its angle."""

    at: Vector
    phi: Jet


Poses = Callable[[Numbers, Sequence[Jet], Closing], dict[str, Pose]]


@dataclass(frozen=True)
class Frame:
    """Where the mechanism stands: as it is sketched, then scaled, turned to an exact direction, and moved."""

    scale: Fraction = Fraction(1)
    direction: tuple[Fraction, Fraction] = (Fraction(1), Fraction(0))
    at: tuple[Fraction, Fraction] = (Fraction(0), Fraction(0))

    @property
    def angle(self) -> float:
        """Of the x axis of the sketch in the world [rad]."""
        return float(np.arctan2(float(self.direction[1]), float(self.direction[0])))

    def length(self, value: Exact) -> float:
        """A length of the sketch in the world."""
        return float(value * self.scale)

    def ground(self, x: Exact, y: Exact) -> tuple[float, float]:
        """A point of the sketch in the world."""
        c, s = self.direction
        return (
            float(self.scale * (c * x - s * y) + self.at[0]),
            float(self.scale * (s * x + c * y) + self.at[1]),
        )


@dataclass(frozen=True)
class Sketch:
    """A mechanism about the origin: its points by body, what moves it, and its closed form.

    Bodies that share a name of a point share a pin. poses: (numbers, driver values, closing) -> pose of each moving
    body. kinds: of the drivers, 'angle' or 'length'. joints: other than the pins, drivers: at start values, both in a
    frame. marks: driver values where loops may be singular, of a turn if it is an angle. period: of the closed form,
    in turns, 0 if it does not go round; reach: values to draw the start from; gap: by how much a length contradicts
    the closed form. later: poses whose law takes place at a larger argument, by so much.
    """

    points: Mapping[str, Mapping[str, tuple[Exact, Exact]]]
    poses: Poses
    drivers: Callable[[Frame, Sequence[float]], tuple[Driver, ...]]
    joints: Callable[[Frame], tuple[Joint, ...]] = lambda _: ()
    kinds: tuple[str, ...] = ("angle",)
    marks: tuple[float, ...] = ()
    period: int = 2
    reach: tuple[float, float] = (0.0, TURN)
    is_level: bool = False  # its angles count from the world's axis: it is not turned
    gap: Exact = 0
    later: Callable[[float], Poses] | None = None


class Exactly(NamedTuple):
    """A closed form's answer: columns by name as jets, and how well the loops close."""

    columns: dict[str, Jet]
    closing: Closing


@dataclass(frozen=True)
class Drawn:
    """A sketch in a frame, started at given driver values: a mechanism, and what it does."""

    sketch: Sketch
    frame: Frame
    start: tuple[float, ...]
    law_start: tuple[float, ...] | None = None  # None: the start
    rough: Mapping[str, float] | None = None  # coordinates of the start poses; None: those of the start

    def exactly(self, numbers: Numbers, u: Array, ud: Array, udd: Array) -> Exactly:
        """Every coordinate at driver values, speeds and accelerations (n, d); angles as principal values."""
        tables = [[numbers.array(column) for column in table.T] for table in (u, ud, udd)]
        return self._columns(numbers, [Jet(numbers, *given) for given in zip(*tables, strict=True)])

    def places(self, u: Array) -> Exactly:
        """Coordinates without their derivatives, in long doubles."""
        return self._columns(LONG, [Value(LONG, LONG.array(column)) for column in u.T])

    def closing(self, u: Array) -> Closing:
        """What must stay positive and what changes its sign, in long doubles."""
        closing = Closing()
        self.sketch.poses(LONG, self._local(LONG, [Value(LONG, LONG.array(column)) for column in u.T]), closing)
        return closing

    def _local(self, numbers: Numbers, given: Sequence[Jet]) -> list[Jet]:
        """Return driver values in the frame and the unit of the sketch."""
        theta, scale = numbers.angle(self.frame.direction), numbers.number(self.frame.scale)
        kinds = zip(given, self.sketch.kinds, strict=True)
        return [one - theta if kind == "angle" else one / scale for one, kind in kinds]

    def _columns(self, numbers: Numbers, given: Sequence[Jet]) -> Exactly:
        value = numbers.number
        theta, scale = numbers.angle(self.frame.direction), value(self.frame.scale)
        local = self._local(numbers, given)
        closing = Closing()
        poses = self.sketch.poses(numbers, local, closing)
        c, s = (value(part) * scale for part in self.frame.direction)
        zero = local[0] * value(0)
        x0, y0 = (value(part) for part in self.frame.at)
        columns = {}
        for body, (at, phi) in poses.items():
            columns[f"{body}.x"] = zero + (at.x * c - at.y * s) + x0
            columns[f"{body}.y"] = zero + (at.x * s + at.y * c) + y0
            columns[f"{body}.phi"] = phi + theta
        return Exactly(columns, closing)

    def positions(self, u: Array) -> Exactly:
        """Coordinates per unit of the driver, in long doubles: speed 1, acceleration 0."""
        return self.exactly(LONG, u, np.ones_like(u), np.zeros_like(u))

    @cached_property
    def starts(self) -> dict[str, float]:
        """Coordinates of the start pose."""
        exact = self.positions(np.array([self.start]))
        return {name: float(column.d0[0]) for name, column in exact.columns.items()}

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism that kinfmu is given: lengths and start pose as doubles."""
        length, starts = self.frame.length, self.starts if self.rough is None else self.rough
        bodies, pins = [], dict[str, list[str]]()
        for body, points in self.sketch.points.items():
            place = self.frame.ground if body == "ground" else lambda x, y: (length(x), length(y))
            given = {name: place(*point) for name, point in points.items()}
            if body == "ground":
                bodies.append(Body(body, given))
            else:
                start = tuple(starts[f"{body}.{letter}"] for letter in ("x", "y", "phi"))
                bodies.append(Body(body, given, start))
            for name in points:
                pins.setdefault(name, []).append(f"{body}.{name}")
        joints: list[Joint] = [Revolute(name, (ends[0], ends[1])) for name, ends in pins.items() if len(ends) == 2]
        joints += self.sketch.joints(self.frame)
        return Mechanism("drawn", bodies, joints, self.sketch.drivers(self.frame, self.law_start or self.start))


def standing(numbers: Numbers, x: Exact, y: Exact, like: Jet) -> Vector:
    """A point of the ground, as jets like another one."""
    zero = like * numbers.number(0)
    return Vector(zero + numbers.number(x), zero + numbers.number(y))


def world(numbers: Numbers, pose: Pose, point: tuple[Exact, Exact]) -> Vector:
    """A point of a body."""
    return pose.at + turned(pose.phi, *(numbers.number(part) for part in point))


def framed(numbers: Numbers, at: Vector, phi: Jet, point: tuple[Exact, Exact]) -> Pose:
    """The pose of a body whose `point` lies at a place."""
    return Pose(at - turned(phi, *(numbers.number(part) for part in point)), phi)


# ----------------------------------------------------------------------------------------------------------------- laws


LONGEST = 1.0  # [rad] of rises
EIGHTHS = 8  # of a rise, at which an oracle looks closely
SHAPES = ("cycloidal", "3-4-5", "dwell")


class DrawnLaw:
    """A sequence that may repeat: single rises, or bumps that go up and back; shortest: of them [rad]."""

    def __init__(self, rng: Random, shortest: float) -> None:
        self.repeat = rng.random() < 0.5
        self.start = round(rng.uniform(-3.0, 3.0), 3)
        self.begin = 0.0
        self.segments: list[Segment] = []
        for _ in range(rng.randint(1, 3)):
            self.segments.append(Segment("dwell", 0.0))
            rise = round(rng.uniform(-1.0, 1.0) * rng.choice((0.1, 1.0, 2.0, math.tau)), 3)
            shape, duration = rng.choice(SHAPES[:2]), _duration(rng, shortest)
            self.segments.append(Segment(shape, duration, rise))
            if rng.random() < 0.6:
                self.segments.append(Segment(rng.choice(SHAPES[:2]), duration, -rise))

    def placed(self, rng: Random, low: float, high: float) -> None:
        """Begin at an argument between others, with dwells such that the rises lie between them."""
        spare = (high - low) / sum(segment.law == "dwell" for segment in self.segments)
        self.begin = rng.uniform(low, high)
        self.segments = [
            segment._replace(duration=rng.uniform(0.1, 0.9) * spare) if segment.law == "dwell" else segment
            for segment in self.segments
        ]
        whole = sum(segment.duration for segment in self.segments)
        times = (
            range(-math.ceil((high - low) / whole) - 1, math.ceil((high - low) / whole) + 2) if self.repeat else (0,)
        )
        self.marks = []
        for n in times:
            at = self.begin + n * whole
            for segment in self.segments:
                if segment.law != "dwell":
                    self.marks += [at + segment.duration * k / EIGHTHS for k in range(EIGHTHS + 1)]
                at += segment.duration

    @property
    def law(self) -> MotionSequence:
        """The law that kinfmu is given."""
        return MotionSequence(tuple(self.segments), self.start, self.begin, self.repeat)

    def value(self, numbers: Numbers, x: Jet, later: float = 0.0) -> Jet:
        """The law's value, with the derivatives of a jet; of a law that begins later."""
        at = numbers.number(Fraction(self.begin) + Fraction(later))
        value = x * numbers.number(0) + numbers.number(Fraction(self.start))
        if self.repeat:
            whole = sum(numbers.number(Fraction(segment.duration)) for segment in self.segments)
            times = np.frompyfunc(_floor, 1, 1)((x.d0 - at) / whole)
            times = times.astype(np.longdouble) if isinstance(whole, np.longdouble) else times
            x = x + -(times * whole)
            value = value + times * sum(numbers.number(Fraction(segment.rise)) for segment in self.segments)
        for segment in self.segments:
            duration = numbers.number(Fraction(segment.duration))
            if segment.law != "dwell":
                risen = _risen(numbers, (x - at) / duration, segment.law)
                value = value + risen * numbers.number(Fraction(segment.rise))
            at = at + duration
        return value


def _duration(rng: Random, shortest: float) -> float:
    return float(10.0 ** rng.uniform(math.log10(shortest), math.log10(LONGEST)))


def _floor(x: Any) -> Any:
    return mp.floor(x) if isinstance(x, mp.mpf) else np.floor(x)


def _risen(numbers: Numbers, s: Jet, shape: str) -> Jet:
    """A normalized curve, 0 before 0 and 1 after 1.

    The second half is formed from its end: there sums of powers of s would be off by the rounding of their terms.
    """
    if shape == "cycloidal":
        turn = 2 * numbers.pi
        curve = s - (s * turn).sin_cos()[0] / turn
    else:
        lower, upper = (x * x * x * (x * (x * 6 + -15) + 10) for x in (s, 1 - s))
        curve = _where(s.d0 * 2 > 1, 1 - upper, lower)
    ends = [s * numbers.number(0) + numbers.number(end) for end in (0, 1)]
    return _where(s.d0 < 0, ends[0], _where(s.d0 > 1, ends[1], curve))


def _where(chosen: Array, one: Jet, other: Jet) -> Jet:
    """Each element from one jet where `chosen`, else from the other."""
    if isinstance(one, Value):
        return Value(one.numbers, np.where(chosen, one.d0, other.d0))
    pairs = ((one.d0, other.d0), (one.d1, other.d1), (one.d2, other.d2))
    return Jet(one.numbers, *(np.where(chosen, a, b) for a, b in pairs))
