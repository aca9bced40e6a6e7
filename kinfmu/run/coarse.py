"""Samples too far apart to show a motion under torques, and the step with which they would show it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.units import InputName

_MOST_TURN = math.pi / 3.0  # [rad] between samples: six samples a turn
_GOOD_TURN = math.pi / 18.0  # [rad] between samples with the step that the note states: 36 samples a turn
_MOST_MISS = 0.02  # of the range of a value; eight samples a period of an oscillation
_LEAST = 1e-3  # of a value, or [rad]; smaller motions between samples are none


def coarse_samples(t: FloatArray, names: Sequence[InputName], u: FloatArray, ud: FloatArray) -> str:
    """Return a note if samples are too far apart to show the motion of the drivers; '' if they are not.

    They are if a driver turns by more than 60 deg between two of them, or if its speeds at the samples do not explain
    how its value changes, as when it swings to and fro between them.

    Args:
        t: (n,) times [s].
        names: (d,) names of the drivers' values, such as 'crank_angle'.
        u: (n, d) their values.
        ud: (n, d) their speeds.

    """
    good = np.isfinite(u).all(axis=1) & np.isfinite(ud).all(axis=1)
    t, u, ud = t[good], u[good], ud[good]
    steps = np.diff(t)
    if len(t) < 3 or not (steps > 0.0).all():
        return ""
    found: list[tuple[float, str]] = []  # steps that would do, and why
    for name, value, speed in zip(names, u.T, ud.T, strict=True):
        fastest, span = float(np.abs(speed).max()), float(np.ptp(value))
        is_angle = name.quantity.kind == "angle"
        least = _LEAST * (1.0 if is_angle else float(np.abs(value).max()))
        if not fastest * float(steps.max()) > least:
            continue
        turned = np.maximum(np.abs(np.diff(value)), np.abs(speed[1:]) * steps)
        miss = np.abs(np.diff(value) - steps * (speed[1:] + speed[:-1]) / 2.0)
        if is_angle and turned.max() > _MOST_TURN:
            most = math.degrees(float(turned.max()))
            why = f"{name.driver} turns by up to {most:.3g} deg from one to the next"
            found.append((float((steps * _GOOD_TURN / np.maximum(turned, _GOOD_TURN)).min()), why))
        elif miss.max() > _MOST_MISS * span:
            rate = fastest / max(span / 2.0, fastest * float(steps.max()) / 20.0)  # of an oscillation of this range
            why = f"the speed of {name.driver} changes too much from one to the next"
            found.append((min(2.0 * math.pi / 36.0 / rate, float(steps.min()) / 3.0), why))
    if not found:
        return ""
    step, why = min(found)
    return (
        f"samples {float(steps.max()):.6g} s apart do not show the motion: {why}; "
        f"a step of {_rounded_down(step):g} s would"
    )


def _rounded_down(step: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not above a step."""
    power = math.floor(math.log10(step))
    return float(f"{max(digit for digit in (1, 2, 5) if digit * 10.0**power <= step * (1.0 + 1e-12))}e{power}")
