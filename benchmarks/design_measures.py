"""Measures of many designs: crank-rockers and Jansen's legs over a turn, compared with the closed form in numba."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.util import find_spec
from time import perf_counter, process_time
from typing import Any

import numpy as np

from benchmarks.crank_rockers import ANGLES, closed_form, crank_rocker, drawn
from benchmarks.rounds import in_turn, spread, table
from kinfmu.arrays import FloatArray
from kinfmu.mechanism.gallery import load
from kinfmu.mechanism.measures import PeakAcceleration, PeakSpeed, Range, Reading, TimeRatio, TransmissionAngle
from kinfmu.motion import DesignMeasures, measure_designs
from kinfmu.run.model import compile as compiled

OF_ROCKER: tuple[Reading, ...] = (
    Range("swing", "rocker.phi"),
    TimeRatio("quick_return", "rocker.phi"),
    TransmissionAngle("transmission", ("coupler.P", "coupler.Q"), ("rocker.C", "rocker.Q")),
    PeakAcceleration("shock", "rocker.phi"),
)
BEGIN, END = math.radians(300.0), math.radians(60.0)  # the foot is on the ground
OF_LEG: tuple[Reading, ...] = (
    Range("stride", "foot.x"),
    Range("lift", "foot.y"),
    Range("level", "foot.y", BEGIN, END),
    PeakSpeed("speed", "leg.foot"),
)
DEVIATION = 0.1  # [mm] of the lengths of legs, one standard deviation


def lines(rounds: int, count: int) -> list[str]:
    """Return a table of seconds for all designs, and what a second thread gains."""
    angles, lengths = np.linspace(0.0, 2.0 * np.pi, ANGLES), drawn(count)
    rocker, leg = compiled(crank_rocker(), engine="native"), compiled(load("jansen_leg"), engine="native")
    rng = np.random.default_rng(1)
    of_legs = {
        name: rng.normal(float(leg.mechanism.parameters[name].value), DEVIATION, count) for name in "abcdefghijk"
    }

    def rockers(workers: int = 1) -> DesignMeasures:
        return measure_designs(rocker, lengths, OF_ROCKER, crank_angle=angles, workers=workers)

    def legs(workers: int = 1) -> DesignMeasures:
        return measure_designs(leg, of_legs, OF_LEG, crank_angle=angles, workers=workers)

    ways: dict[str, Callable[[], object]] = {"crank-rockers": rockers, "Jansen's legs": legs}
    notes = []
    if find_spec("numba") is not None:
        read = read_off(angles, lengths)
        ways["crank-rockers, closed form in numba, read off the samples"] = read
        apart = np.abs(read() / np.array([rockers()[one.name] for one in OF_ROCKER]) - 1.0).max(axis=1)
        shown = ", ".join(f"{one.name} {value:.1e}" for one, value in zip(OF_ROCKER, apart, strict=True))
        notes = [f"largest relative difference of what numba reads off: {shown}"]
    seconds = [spread(one) for one in in_turn(list(ways.values()), rounds, process_time)]
    rows = [[name, *of.cells(3), f"{of.median / count * 1e6:.1f}"] for name, of in zip(ways, seconds, strict=True)]
    in_pairs = [lambda: rockers(1), lambda: rockers(2), lambda: legs(1), lambda: legs(2)]
    one, two, leg_one, leg_two = (spread(found).low for found in in_turn(in_pairs, rounds, perf_counter))
    return [
        f"{count} designs at {ANGLES} angles with four measures, {rounds} rounds in turn; s of processor time",
        *table(("", "median", "min", "max", "us a design"), rows),
        *notes,
        f"two threads: crank-rockers {one / two:.2f} times faster ({one:.3f} s and {two:.3f} s by the clock, least of "
        f"the rounds), legs {leg_one / leg_two:.2f} times ({leg_one:.3f} s and {leg_two:.3f} s)",
    ]


def read_off(angles: FloatArray, lengths: dict[str, FloatArray]) -> Callable[[], FloatArray]:
    """Return a function that reads the four measures of crank-rockers off the samples of the closed form, (4, m)."""
    import numba

    one: Any = numba.njit(closed_form)

    def all_of(u: FloatArray, g: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, out: FloatArray) -> None:
        for k in range(len(g)):
            low, high, at_low, at_high, worst, peak = np.inf, -np.inf, 0.0, 0.0, 0.0, 0.0
            for t in u:
                coupler, rocker = one(t, g[k], a[k], b[k], c[k])
                sine, cosine = math.sin(rocker - coupler), math.cos(rocker - coupler)
                rocker_speed = a[k] * math.sin(t - coupler) / (c[k] * sine)
                coupler_speed = a[k] * math.sin(t - rocker) / (b[k] * sine)
                pull = a[k] * math.cos(t - coupler) + b[k] * coupler_speed**2
                acceleration = (pull - c[k] * rocker_speed**2 * cosine) / (c[k] * sine)
                if rocker < low:
                    low, at_low = rocker, t
                if rocker > high:
                    high, at_high = rocker, t
                worst = max(worst, abs(cosine))
                peak = max(peak, abs(acceleration))
            stroke = abs(at_high - at_low)
            longer = max(stroke, 2.0 * math.pi - stroke)
            out[0, k], out[1, k] = high - low, longer / (2.0 * math.pi - longer)
            out[2, k], out[3, k] = math.asin(worst), peak

    loop: Any = numba.njit(all_of)
    out = np.empty((4, len(lengths["crank_link"])))

    def read() -> FloatArray:
        loop(angles, *lengths.values(), out)
        return out

    return read
