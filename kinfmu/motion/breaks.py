"""Breaks of a run: where laws of its cams, couplings and drivers join pieces whose derivatives differ."""

from __future__ import annotations

import numpy as np

from kinfmu.equations.system import placement
from kinfmu.joints import CamRoller
from kinfmu.laws import External, Law
from kinfmu.mechanism import Mechanism
from kinfmu.run import FloatArray, Run
from kinfmu.run.axis import TIME

AT_SAMPLE = 1e-6  # of the step between samples; a break that is nearer to a sample is at it


def breaks_of(run: Run, mechanism: Mechanism, order: int) -> FloatArray:
    """Return where a law's value or a derivative up to an order jumps, in samples: 2.25 is after the third sample.

    The run must hold all coordinates. Laws of drivers count in runs over time.
    """
    columns = [np.asarray(run[name], dtype=float) for name in mechanism.coordinate_names]
    at = placement(mechanism, columns)
    led: list[tuple[Law, FloatArray]] = []
    for joint in mechanism.joints:
        follower = joint.led_by(at)
        if follower is not None:
            law, argument = follower[0], np.broadcast_to(np.asarray(follower[1], dtype=float), (len(run),))
            led.append((law, np.unwrap(argument) if isinstance(joint, CamRoller) else argument))
    if run.axis == TIME:
        led += [(one.law, run.t) for one in mechanism.drivers if not isinstance(one.law, External)]
    found = [_crossed(argument, law, order) for law, argument in led]
    return np.unique(np.concatenate([np.empty(0), *found]).round(9))


def _crossed(argument: FloatArray, law: Law, order: int) -> FloatArray:
    """Return where an argument (n,) crosses a break of its law."""
    jumps = law.own_breaks(order)
    period = float(jumps.period)
    found = [np.empty(0)]
    for place in map(float, jumps.at):
        along = (argument - place) / (period or 1.0)
        piece = np.floor(along) if period else np.where(along >= 0.0, 0.0, -1.0)
        known = np.isfinite(along[:-1]) & np.isfinite(along[1:])
        (k,) = np.nonzero(known & (np.diff(piece) != 0.0))
        found.append(k + (np.maximum(piece[k], piece[k + 1]) - along[k]) / (along[k + 1] - along[k]))
    return np.concatenate(found)


def with_jumps(x: FloatArray, y: FloatArray, breaks: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a curve (n,), (n,) with a vertical line at each break, from one side of it to the other.

    Both ends continue their side in a straight line. A break without two samples of its own on either side, such as at
    the points of a table, is a step from one sample to the next; several breaks between two samples are one step. Of a
    break at the first or last sample, only the side within the run is drawn.
    """
    drop: list[int] = []
    places, xs, ys = [], [], []
    last = len(x) - 1
    steps: dict[int, list[float]] = {}  # breaks within each interval that is drawn as a step, by its first sample

    def add(place: float, at: float, value: float) -> None:
        places.append(place)
        xs.append(at)
        ys.append(value)

    def straight(a: int, b: int, at: float) -> float:
        return float(y[b] + (y[b] - y[a]) / (x[b] - x[a]) * (at - x[b]))

    for place in breaks.tolist():
        nearest = round(place)
        is_sample = abs(place - nearest) < AT_SAMPLE
        left, right = (nearest - 1, nearest + 1) if is_sample else (int(place), int(place) + 1)
        others = ((breaks != place) & (breaks > left - 1) & (breaks < right + 1)).any()
        sides = [(left - 1, left)] * (left >= 1) + [(right + 1, right)] * (right < last)
        is_end = is_sample and nearest in (0, last) and bool(sides)
        if others or not (len(sides) == 2 or is_end):
            for first in (nearest - 1, nearest) if is_sample else (left,):
                steps.setdefault(first, []).append(place)
            continue
        drop += [nearest] * is_sample
        at = float(np.interp(place, np.arange(len(x)), x))
        for a, b in sides:
            add(place, at, straight(a, b, at))
    for first, within in steps.items():
        if 0 <= first < last:
            inside = [place for place in within if first + AT_SAMPLE < place < first + 1 - AT_SAMPLE]
            place = float(np.mean(inside or within))
            at = float(np.interp(place, np.arange(len(x)), x))
            add(place, at, float(y[first]))
            add(place, at, float(y[first + 1]))
    kept = np.delete(np.arange(len(x)), drop)
    order = np.argsort(np.concatenate([kept, places]), kind="stable")
    return np.concatenate([x[kept], xs])[order], np.concatenate([y[kept], ys])[order]
