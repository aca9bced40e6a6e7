"""What rises have in common: from one value to another in a given time, at rest before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from kinfmu.laws.jumps import Jumps, jumping_breaks
from kinfmu.laws.law import Argument, Duration, Law, Led
from kinfmu.measures.arithmetic import Value, curve
from kinfmu.solver.python.curve import CurveData, Piece


@dataclass(frozen=True)
class Rise(Law):
    """A rise.

        u = start + rise N((x - begin) / duration)

    N: the normalized curve of the class, from 0 to 1 on [0, 1], 0 before and 1 after. start: value before; rise: how
    far, down if negative; begin: x where it begins; duration: x that it takes.
    """

    shape: ClassVar[CurveData]  # N

    rise: Led
    duration: Duration
    start: Led = 0.0
    begin: Argument = 0.0

    def target(self, x: Value, **constants: Value) -> Value:
        part = (x - constants["begin"]) / constants["duration"]
        return constants["start"] + constants["rise"] * curve(part, self.shape)

    def jumps(self, **constants: Value) -> Jumps:
        begin, duration = constants["begin"], constants["duration"]
        return Jumps(tuple(begin + duration * x for x in jumping_breaks(self.shape)))


def polynomial(origin: float, *coefficients: float) -> Piece:
    """A piece that is a polynomial of s = x - origin, highest power first."""
    return origin, coefficients, 0.0, 0.0, 0.0


def normalized(half: Sequence[tuple[float, Piece]]) -> CurveData:
    """The curve that is 0 before 0, 1 after 1, and between them N(x) = 1 - N(1 - x).

    half: the pieces of the first half, each with where it begins. The second half is their mirror image about
    (1/2, 1/2) with origins mirrored too, so that both ends are met to the last bit.
    """
    begins = [begin for begin, _ in half]
    ends = [*begins[1:], 0.5]
    mirrored = [(1.0 - end, _mirrored(piece)) for end, (_, piece) in zip(ends, half, strict=True)]
    pieces = [*half, *reversed(mirrored), (1.0, polynomial(1.0, 1.0))]
    return tuple(begin for begin, _ in pieces), (polynomial(0.0, 0.0), *(piece for _, piece in pieces))


def _mirrored(piece: Piece) -> Piece:
    """1 - f(1 - x): about o = 1 - o each s^k turns into -(-1)^k s^k, and a sin(w s + p) into a sin(w s - p)."""
    o, coefficients, a, w, p = piece
    degree = len(coefficients) - 1
    turned = [c if (degree - k) % 2 else 0.0 - c for k, c in enumerate(coefficients)]
    turned[-1] += 1.0
    return 1.0 - o, tuple(turned), a, w, -p
