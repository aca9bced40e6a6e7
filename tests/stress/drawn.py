"""Drawn: a random mechanism with its closed form, and its place in the world."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kinfmu import Body, Mechanism, Revolute
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from tests.stress.jets import LONG, Array, Exact, Jet, Numbers, Value, Vector, turned
from tests.stress.loops import Closing

TURN = 2.0 * np.pi


class Pose(NamedTuple):
    """Where a body is: its frame's origin and its angle."""

    at: Vector
    phi: Jet


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
    the closed form.
    """

    points: Mapping[str, Mapping[str, tuple[Exact, Exact]]]
    poses: Callable[[Numbers, Sequence[Jet], Closing], dict[str, Pose]]
    drivers: Callable[[Frame, Sequence[float]], tuple[Driver, ...]]
    joints: Callable[[Frame], tuple[Joint, ...]] = lambda _: ()
    kinds: tuple[str, ...] = ("angle",)
    marks: tuple[float, ...] = ()
    period: int = 2
    reach: tuple[float, float] = (0.0, TURN)
    is_level: bool = False  # its angles count from the world's axis: it is not turned
    gap: Exact = 0


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
