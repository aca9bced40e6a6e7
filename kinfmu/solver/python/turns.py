"""Whole turns: angles moved by multiples of 2 pi without a loss of digits."""

from __future__ import annotations

TURN = 6.283185307179586  # [rad]; for counting
_HIGH = 6.2831853069365025  # [rad]; 2 pi to 32 bits, so that its multiples by up to 2^21 turns are exact
_LOW = 2.430840202602477e-10  # [rad]; the rest


def turned(angle: float, turns: float) -> float:
    """Return angle + turns * 2 pi [rad], rounded about once."""
    return angle + turns * _HIGH + turns * _LOW


def whole_turns(angle: float) -> int:
    """Return the whole number of turns nearest to an angle [rad]."""
    return round(angle / TURN)
