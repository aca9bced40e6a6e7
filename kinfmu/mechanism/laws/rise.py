"""Rises: from one value to another in a given time, at rest before and after; their normalized curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from kinfmu.mechanism.laws.law import RISE_STEPS, Argument, Duration, Jumps, Law, Led, jumping_breaks
from kinfmu.mechanism.quantities.arithmetic import Value, curve
from kinfmu.solver.python.curve import CurveData, Piece


@dataclass(frozen=True)
class Rise(Law):
    """A rise.

        u = start + rise N(s),   s = (x - begin) / duration

    N: the normalized curve of the class, from 0 to 1 on [0, 1], 0 before and 1 after.
    """

    shape: ClassVar[CurveData]  # N

    rise: Annotated[Led, "change of u, negative for a fall"]
    duration: Annotated[Duration, "range of x that the rise takes"]
    start: Annotated[Led, "value before the rise"] = 0.0
    begin: Annotated[Argument, "x where the rise begins"] = 0.0

    def target(self, x: Value, **constants: Value) -> Value:
        part = (x - constants["begin"]) / constants["duration"]
        return constants["start"] + constants["rise"] * curve(part, self.shape)

    def fewest_steps(self, x: Value, **constants: Value) -> Value:
        return RISE_STEPS * curve((x - constants["begin"]) / constants["duration"], RAMP)

    def most_steps(self, **constants: Value) -> Value:
        return RISE_STEPS / constants["duration"]

    def breaks(self, order: int, /, **constants: Value) -> Jumps:
        begin, duration = constants["begin"], constants["duration"]
        return Jumps(tuple(begin + duration * x for x in jumping_breaks(self.shape, order)))


def polynomial(origin: float, *coefficients: float) -> Piece:
    """Return a piece that is a polynomial of s = x - origin, highest power first."""
    return origin, coefficients, 0.0, 0.0, 0.0


RAMP: CurveData = ((0.0, 1.0), (polynomial(0.0, 0.0), polynomial(0.0, 1.0, 0.0), polynomial(1.0, 1.0)))


def normalized(half: Sequence[tuple[float, Piece]]) -> CurveData:
    """Return the curve that is 0 before 0, 1 after 1, and in between satisfies N(x) = 1 - N(1 - x).

    The second half is the mirror image of the first about (1/2, 1/2), with origins mirrored too, so that both ends are
    met to the last bit.

    half: The pieces of the first half, each with the x where it begins.
    """
    begins = [begin for begin, _ in half]
    ends = [*begins[1:], 0.5]
    mirrored = [(1.0 - end, _mirrored(piece)) for end, (_, piece) in zip(ends, half, strict=True)]
    pieces = [*half, *reversed(mirrored), (1.0, polynomial(1.0, 1.0))]
    return tuple(begin for begin, _ in pieces), (polynomial(0.0, 0.0), *(piece for _, piece in pieces))


def _mirrored(piece: Piece) -> Piece:
    """Return 1 - f(1 - x): its origin is 1 - o, s^k becomes -(-1)^k s^k, and a sin(w s + p) becomes a sin(w s - p)."""
    o, coefficients, a, w, p = piece
    degree = len(coefficients) - 1
    turned = [c if (degree - k) % 2 else 0.0 - c for k, c in enumerate(coefficients)]
    turned[-1] += 1.0
    return 1.0 - o, tuple(turned), a, w, -p


@dataclass(frozen=True)
class SimpleHarmonic(Rise):
    """A rise along half a cosine; its acceleration jumps at both ends.

        u = start + rise N(s),   s = (x - begin) / duration
        N = (1 - cos pi s) / 2

    Peaks: velocity pi / 2, acceleration pi^2 / 2.
    """

    type: ClassVar[str] = "simple_harmonic"
    shape: ClassVar[CurveData] = (
        (0.0, 1.0),
        (polynomial(0.0, 0.0), (0.5, (0.5,), 0.5, math.pi, 0.0), polynomial(1.0, 1.0)),
    )


@dataclass(frozen=True)
class Cycloidal(Rise):
    """A rise whose acceleration is a whole sine.

        u = start + rise N(s),   s = (x - begin) / duration
        N = s - sin(2 pi s) / (2 pi)

    Peaks: velocity 2, acceleration 2 pi = 6.283.
    """

    type: ClassVar[str] = "cycloidal"
    shape: ClassVar[CurveData] = normalized([(0.0, (0.0, (1.0, 0.0), -0.5 / math.pi, 2.0 * math.pi, 0.0))])


_SINE_SLOPE = math.pi / (4.0 + math.pi)
_SINE_WAVE = 0.25 / (4.0 + math.pi)


@dataclass(frozen=True)
class ModifiedSine(Rise):
    """A rise whose acceleration is a sine, of higher frequency in the first and last eighth than in between.

        u = start + rise N(s),   s = (x - begin) / duration
        N'' = A sin(4 pi s)                     up to s = 1/8,   A = 4 pi^2 / (4 + pi)
        N'' = A sin(4 pi s / 3 + pi / 3)        up to s = 7/8
        N'' = A sin(4 pi s)                     up to s = 1

    Peaks: velocity 4 pi / (4 + pi) = 1.760, acceleration A = 5.528.
    """

    type: ClassVar[str] = "modified_sine"
    shape: ClassVar[CurveData] = normalized(
        [
            (0.0, (0.0, (_SINE_SLOPE, 0.0), -_SINE_WAVE, 4.0 * math.pi, 0.0)),
            (0.125, (0.5, (_SINE_SLOPE, 0.5), 9.0 * _SINE_WAVE, 4.0 * math.pi / 3.0, 0.0)),
        ]
    )


_TRAPEZOID_PEAK = 8.0 * math.pi / (2.0 + math.pi)  # A
_TRAPEZOID_SLOPE = 2.0 / (2.0 + math.pi)  # N' at 1/8
_TRAPEZOID_WAVE = 0.5 / (math.pi * (2.0 + math.pi))
_TRAPEZOID_EIGHTH = (math.pi - 2.0) / (4.0 * math.pi * (2.0 + math.pi))  # N at 1/8


@dataclass(frozen=True)
class ModifiedTrapezoid(Rise):
    """A rise whose acceleration is a trapezoid with its edges rounded by quarters of a sine.

        u = start + rise N(s),   s = (x - begin) / duration
        N'' = A sin(4 pi s)             up to s = 1/8,   A = 8 pi / (2 + pi)
        N'' = A                         up to s = 3/8
        N'' = A cos(4 pi s - 3 pi / 2)  up to s = 5/8, then mirrored

    Peaks: velocity 2, acceleration A = 4.888.
    """

    type: ClassVar[str] = "modified_trapezoid"
    shape: ClassVar[CurveData] = normalized(
        [
            (0.0, (0.0, (_TRAPEZOID_SLOPE, 0.0), -_TRAPEZOID_WAVE, 4.0 * math.pi, 0.0)),
            (0.125, polynomial(0.125, 0.5 * _TRAPEZOID_PEAK, _TRAPEZOID_SLOPE, _TRAPEZOID_EIGHTH)),
            (0.375, (0.5, (2.0 - _TRAPEZOID_SLOPE, 0.5), _TRAPEZOID_WAVE, 4.0 * math.pi, 0.0)),
        ]
    )


@dataclass(frozen=True)
class Polynomial345(Rise):
    """A rise along the polynomial of powers 3, 4, 5, at rest with no acceleration at both ends.

        u = start + rise N(s),   s = (x - begin) / duration
        N = 10 s^3 - 15 s^4 + 6 s^5

    Peaks: velocity 15/8 = 1.875, acceleration 10 / sqrt 3 = 5.774.
    """

    type: ClassVar[str] = "3-4-5"
    shape: ClassVar[CurveData] = normalized([(0.0, polynomial(0.0, 6.0, -15.0, 10.0, 0.0, 0.0, 0.0))])


@dataclass(frozen=True)
class Polynomial4567(Rise):
    """A rise along the polynomial of powers 4 to 7, at rest with neither acceleration nor jerk at both ends.

        u = start + rise N(s),   s = (x - begin) / duration
        N = 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7

    Peaks: velocity 35/16 = 2.188, acceleration 7.513.
    """

    type: ClassVar[str] = "4-5-6-7"
    shape: ClassVar[CurveData] = normalized([(0.0, polynomial(0.0, -20.0, 70.0, -84.0, 35.0, 0.0, 0.0, 0.0, 0.0))])


RISES: tuple[type[Rise], ...] = (
    SimpleHarmonic,
    Cycloidal,
    ModifiedSine,
    ModifiedTrapezoid,
    Polynomial345,
    Polynomial4567,
)
