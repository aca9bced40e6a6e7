"""Laws of rises and dwells, drawn at random, and their closed form."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

import numpy as np

from kinfmu import MotionSequence, Segment
from tests.power_series import mp
from tests.stress.jets import Array, Jet, Numbers, Value

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

    def value(self, numbers: Numbers, x: Jet) -> Jet:
        """The law's value, with the derivatives of a jet."""
        at = numbers.number(Fraction(self.begin))
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
    """A normalized curve, 0 before 0 and 1 after 1."""
    if shape == "cycloidal":
        turn = 2 * numbers.pi
        inside = s - (s * turn).sin_cos()[0] / turn
    else:
        inside = s * s * s * (s * (s * 6 + -15) + 10)
    before, after = s.d0 < 0, s.d0 > 1

    def chosen(table: Array, beyond: int) -> Array:
        return np.where(before, numbers.number(0), np.where(after, numbers.number(beyond), table))

    if isinstance(s, Value):
        return Value(numbers, chosen(inside.d0, 1))
    return Jet(numbers, chosen(inside.d0, 1), chosen(inside.d1, 0), chosen(inside.d2, 0))
