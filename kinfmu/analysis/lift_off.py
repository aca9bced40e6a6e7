"""Where the followers of cams would lift off: the contact would have to pull, which a cam without a groove cannot."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from kinfmu.analysis.cams import CamFindings
from kinfmu.mechanism.force_names import names_of_rows
from kinfmu.motion.cams import pressing_sign
from kinfmu.motion.history import History
from kinfmu.motion.motion import Motion
from kinfmu.run.axis import TIME
from kinfmu.units import unit_of

_ROUNDING = 1e-9  # of the largest contact force; smaller tensions are rounding


@dataclass(frozen=True)
class LiftOff:
    """A contact of a cam that would have to pull.

    joint: the cam's; force: the column of the contact force or moment; sense: 1 if a positive value presses
    follower and cam together, -1 if a negative one does; parts: where it would pull, each from begin to end in the
    direction of growing values of the driver, or in times if it turns back or several drivers move (driver: 'time'); of
    a motion that goes round a part may go on past its end; extent: 'turn' if it would pull
    at every angle of the driver, 'motion' if during the whole motion, else 'part'; largest, at: the largest tension, of
    a lever the largest moment that would pull, as a positive number, and where it occurs.
    """

    joint: str
    force: str
    sense: int
    unit: str
    driver: str
    at_unit: str
    parts: tuple[tuple[float, float], ...]
    extent: str
    largest: float
    at: float

    def as_json(self) -> dict[str, Any]:
        """Return the values as plain data."""
        return {
            "joint": self.joint,
            "force": self.force,
            "sense": self.sense,
            "unit": self.unit,
            "driver": self.driver,
            "at_unit": self.at_unit,
            "parts": [{"begin": begin, "end": end} for begin, end in self.parts],
            "extent": self.extent,
            "largest_tension": {"value": self.largest, "at": self.at},
        }


def lift_offs(motion: Motion, cams: Sequence[CamFindings]) -> Iterator[LiftOff]:
    """Yield the contacts of cams that would have to pull during a motion with forces.

    A lever of which no contact is known has no sense in which it is pressed, so it is left out.
    """
    for cam in cams:
        if cam.cam is None:
            continue
        (name,) = names_of_rows(cam.cam.joint)
        sense = pressing_sign(cam.cam)
        history = motion.history(name)
        if sense < 0:
            history = history.negative()
        if not history.is_known:
            continue
        low, high = history.extremes()
        if -float(low.value) <= _ROUNDING * max(-float(low.value), float(high.value)):
            continue
        unit = motion.mechanism.length_unit
        parts = _negative_parts(history)
        direction = 0 if motion.drive is None else _direction(motion.drive)
        driven_at = motion.driven_at if direction else np.asarray
        driven = [driven_at(np.array(part)[:: direction or 1]).tolist() for part in parts]
        yield LiftOff(
            joint=cam.joint,
            force=name,
            sense=sense,
            unit=unit_of(name.quantity, unit),
            driver=motion.driver if direction else TIME,
            at_unit=unit_of(motion.driver_quantity, unit) if direction else "s",
            parts=tuple((begin, end) for begin, end in driven[:: direction or 1]),
            extent=_extent(motion, history, parts),
            largest=-float(low.value),
            at=float(driven_at(np.asarray(low.x))),
        )


def _direction(drive: History) -> int:
    """Return 1 if the driver's value never falls, -1 if it never grows, 0 if it turns back."""
    least = _ROUNDING * float(np.abs(drive.rate).max())
    falls, grows = bool(np.any(drive.rate < -least)), bool(np.any(drive.rate > least))
    return 0 if falls and grows else -1 if falls else 1


def _negative_parts(history: History) -> list[tuple[float, float]]:
    """Return the parts of a motion in which a quantity is negative, from argument to argument."""
    crossings = np.sort(history.crossings(np.asarray(0.0))[1])
    ends = [float(history.x[0]), *crossings.tolist(), float(history.x[-1])]
    parts = [(a, b) for a, b in pairwise(ends) if b > a and history.at(np.array([0.5 * (a + b)]))[0] < 0]
    if history.is_closed and len(parts) > 1 and parts[0][0] == ends[0] and parts[-1][1] == ends[-1]:
        parts = [*parts[1:-1], (parts[-1][0], parts[0][1])]  # one part goes on past the end
    return parts


def _extent(motion: Motion, history: History, parts: list[tuple[float, float]]) -> str:
    """Return the extent of the negative parts, as in LiftOff."""
    if parts != [(float(history.x[0]), float(history.x[-1]))]:
        return "part"
    travel = motion.driven_between(history.x[0], history.x[-1])
    is_turn = motion.driver_quantity.kind == "angle" and travel > math.tau - _ROUNDING
    return "turn" if is_turn else "motion"
