"""Breaks of a run: where laws of its cams, couplings and drivers join pieces whose derivatives differ."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints import CamRoller
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import External, Law
from kinfmu.mechanism.laws.law import Constant
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.plan.equations.system import placement
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Run
from kinfmu.run.axis import TIME

AT_SAMPLE = 1e-6  # of the step between samples; a break that is nearer to a sample is at it


class FollowedLaw(NamedTuple):
    """A law with its argument over a run: the joint that follows it, or None for a driver over time."""

    law: Law
    argument: FloatArray  # (n,), continuous
    joint: Joint | None


class LawBreak(NamedTuple):
    """A break of a law within a run.

    place: where, in samples: 2.25 is after the third sample; number: of the law; level: the value of its argument.
    """

    place: float
    number: int
    level: float


def followed_laws(run: Run, mechanism: Mechanism) -> list[FollowedLaw]:
    """Return the laws of joints, and in runs over time those of drivers; the run must hold all coordinates."""
    columns = [np.asarray(run[name], dtype=float) for name in mechanism.coordinate_names]
    at = placement(mechanism, columns)
    found: list[FollowedLaw] = []
    for joint in mechanism.joints:
        follower = joint.led_by(at)
        if follower is not None:
            law, argument = follower[0], np.broadcast_to(np.asarray(follower[1], dtype=float), (len(run),))
            found.append(FollowedLaw(law, np.unwrap(argument) if isinstance(joint, CamRoller) else argument, joint))
    if run.axis == TIME:
        found += [FollowedLaw(one.law, run.t, None) for one in mechanism.drivers if not isinstance(one.law, External)]
    return found


def breaks_of(laws: list[FollowedLaw], order: int) -> list[LawBreak]:
    """Return where a law's value or a derivative up to an order jumps; places are those of a straight argument."""
    found: list[LawBreak] = []
    for number, (law, argument, _) in enumerate(laws):
        jumps = law.own_breaks(order)
        period = float(jumps.period)
        for at in map(float, jumps.at):
            along = (argument - at) / (period or 1.0)
            piece = np.floor(along) if period else np.where(along >= 0.0, 0.0, -1.0)
            known = np.isfinite(along[:-1]) & np.isfinite(along[1:])
            for k in np.flatnonzero(known & (np.diff(piece) != 0.0)).tolist():
                low, high = sorted((int(piece[k]), int(piece[k + 1])))
                for turn in range(low + 1, high + 1):
                    place = k + (turn - along[k]) / (along[k + 1] - along[k])
                    found.append(LawBreak(float(place), number, at + turn * period))
    return found


def bracket(place: float, side: int) -> tuple[int, int]:
    """Return the two samples between which a side of a place is: -1 before it, 1 after it."""
    nearest = round(place)
    if abs(place - nearest) < AT_SAMPLE:
        return (nearest - 1, nearest) if side < 0 else (nearest, nearest + 1)
    return math.floor(place), math.floor(place) + 1


@dataclass(frozen=True, eq=False)
class OneSided(Law):
    """A law at arguments that are Taylor numbers, with the limits of its derivatives at breaks.

    law: the law; side: (n,) -1 where the limit is that from below, 1 from above.
    """

    type: ClassVar[str] = "one_sided"

    law: Law
    side: FloatArray

    def constants(self) -> dict[str, Constant]:
        return self.law.constants()

    def target(self, x: Value, **constants: Value) -> Value:
        found = self.law.target(Taylor(x.c, self.side) if isinstance(x, Taylor) else x, **constants)
        return Taylor(found.c) if isinstance(found, Taylor) else found
