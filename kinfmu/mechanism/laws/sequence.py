"""Rises and dwells one after another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, NamedTuple

from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.mechanism.laws.law import (
    NEARLY,
    RISE_STEPS,
    TURN,
    Argument,
    Constant,
    ConstantPath,
    Jumps,
    Law,
    LawQuantity,
    Led,
    jumping_breaks,
)
from kinfmu.mechanism.laws.rise import RAMP, RISES
from kinfmu.mechanism.quantities.arithmetic import Value, curve, split_periods, sqrt
from kinfmu.solver.python.curve import CurveData

DWELL = "dwell"
_SHAPES = {rise.type: rise.shape for rise in RISES}
_RISE, _DURATION = LawQuantity("led"), LawQuantity("argument", is_positive=True)


class Segment(NamedTuple):
    """One part of a sequence: a rise by the law of that name, or a "dwell", which stays where it is."""

    law: str
    duration: float
    rise: float = 0.0  # how far, down if negative


@dataclass(frozen=True)
class MotionSequence(Law):
    """Rises and dwells one after another.

        u = start + sum_k rise_k N_k((x - begin_k) / duration_k),   begin_1 = begin,   begin_k+1 = begin_k + duration_k

    N_k: normalized curves, 0 before and 1 after. Constants: start, begin, duration_1, rise_1, duration_2, ...
    """

    type: ClassVar[str] = "sequence"

    segments: Annotated[tuple[Segment, ...], "the rises and dwells in order"]
    start: Annotated[Led, "value before the first segment"] = 0.0
    begin: Annotated[Argument, "x where the first segment begins"] = 0.0
    repeat: Annotated[
        bool,
        "repeat the sequence before `begin` and after its end, each time from the value at which the last one ended",
    ] = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", tuple(Segment(*segment) for segment in self.segments))

    def numbers(self) -> dict[ConstantPath, Constant]:
        found = super().numbers()
        for k, segment in enumerate(self.segments, start=1):
            if segment.law != DWELL:
                found[(f"rise_{k}",)] = Constant(segment.rise, _RISE)
            found[(f"duration_{k}",)] = Constant(segment.duration, _DURATION)
        return found

    def with_numbers(self, values: Mapping[ConstantPath, Any]) -> MotionSequence:
        segments = tuple(
            segment._replace(
                rise=values.get((f"rise_{k}",), segment.rise),
                duration=values.get((f"duration_{k}",), segment.duration),
            )
            for k, segment in enumerate(self.segments, start=1)
        )
        own = {key: values.get((key,), getattr(self, key)) for key in ("start", "begin")}
        return replace(self, segments=segments, **own)

    def target(self, x: Value, **constants: Value) -> Value:
        return self._summed(x, constants, _SHAPES)

    def fewest_steps(self, x: Value, **constants: Value) -> Value:
        steps = {name: RISE_STEPS for name in constants if name.startswith("rise_")}
        return self._summed(x, constants | steps | {"start": 0.0}, dict.fromkeys(_SHAPES, RAMP))

    def most_steps(self, **constants: Value) -> Value:
        rising = [k for k, segment in enumerate(self.segments, start=1) if segment.law != DWELL]
        return sum((RISE_STEPS / constants[f"duration_{k}"] for k in rising), start=0.0)

    def _summed(self, x: Value, constants: Mapping[str, Value], shapes: Mapping[str, CurveData]) -> Value:
        """Return start + sum_k rise_k N_k with these normalized curves."""
        numbered = list(enumerate(self.segments, start=1))
        rises = {k: constants[f"rise_{k}"] for k, segment in numbered if segment.law != DWELL}
        durations = {k: constants[f"duration_{k}"] for k, _ in numbered}
        value, begin = constants["start"], constants["begin"]
        if self.repeat:
            times, x = split_periods(x, begin, *durations.values())
            value = value + sum(rises.values()) * times
        since = x - begin
        begin = 0.0
        for k, segment in numbered:
            if k in rises:
                value = value + rises[k] * curve((since - begin) / durations[k], shapes[segment.law])
            begin = begin + durations[k]
        return value

    def breaks(self, order: int, /, **constants: Value) -> Jumps:
        found: list[Value] = []
        begin = constants["begin"]
        for k, segment in enumerate(self.segments, start=1):
            duration = constants[f"duration_{k}"]
            if segment.law != DWELL:
                found += [begin + duration * x for x in jumping_breaks(_SHAPES[segment.law], order)]
            begin = begin + duration
        return Jumps(tuple(found), begin - constants["begin"] if self.repeat else 0.0)

    def check(self, where: str) -> None:
        super().check(where)
        if not self.segments:
            raise MechanismError(f"{where} segments must hold at least one segment")
        words = (*_SHAPES, DWELL)
        for k, segment in enumerate(self.segments, start=1):
            if segment.law not in words:
                near = suggestion(str(segment.law), words)
                raise MechanismError(
                    f"{where} segments: law {segment.law!r} of segment {k} is not known{near}; known: {listed(words)}"
                )
            if segment.law == DWELL and segment.rise != 0.0:
                raise MechanismError(f"{where} segments: segment {k} is a dwell, which has no rise")

    @property
    def repeats(self) -> bool:
        return self.repeat

    @property
    def period(self) -> float:
        rises = [segment.rise for segment in self.segments]
        is_back = abs(sum(rises)) <= NEARLY * max((abs(rise) for rise in rises), default=0.0)
        return float(sum(segment.duration for segment in self.segments)) if self.repeat and is_back else 0.0

    def zeros(self) -> Mapping[str, Value]:
        whole = sum(segment.duration for segment in self.segments)
        rises = [
            segment.rise for segment in self.segments if not (isinstance(segment.rise, float) and segment.rise == 0.0)
        ]
        found = {"durations in all over a turn, less 1,": whole / TURN - 1.0}
        if rises:
            found["rises in all over their size"] = sum(rises) / sqrt(sum(rise * rise for rise in rises))
        return found

    def why_not_periodic(self) -> str:
        if not self.repeat:
            return "its sequence does not repeat; set repeat = true"
        whole = sum(segment.duration for segment in self.segments)
        if abs(whole - TURN) > NEARLY * TURN:
            found = f"the durations of its sequence add up to {math.degrees(whole):.9g} deg, not to a turn of 360 deg"
            bare = next((one.duration for one in self.segments if one.duration > TURN), None)
            if bare is not None:
                return f"{found}; a bare angle is in radians: write '{bare:.6g} deg' for degrees"
            rest = math.degrees(TURN - whole)
            cure = f"{rest:.9g} deg are missing: add a dwell" if rest > 0.0 else f"{-rest:.9g} deg are too many"
            return f"{found}; {cure}"
        rise = sum(segment.rise for segment in self.segments)
        if abs(rise) > NEARLY * max(abs(segment.rise) for segment in self.segments):
            return f"the rises of its sequence add up to {rise:.9g}, not to 0"
        return ""
