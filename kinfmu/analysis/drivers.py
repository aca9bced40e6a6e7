"""Drivers compared with degrees of freedom: surplus drivers, and what is loose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from kinfmu.analysis.remedies import LARGEST
from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError, MobilityError, listed
from kinfmu.plan.equations.closing import motion_samples, null_space
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.plan.equations.system import System
from kinfmu.units import CoordinateName

_SAMPLES = 4  # poses of the motion that the joints allow; a row dependent at all of them is dependent
_IN_SPAN = 1e-7  # part of a gradient outside the span of the others; smaller counts as zero
_MOVES = 1e-6  # part of a free direction; a coordinate with more counts as moving


class SurplusDriver(NamedTuple):
    """A driver whose quantity the joints and the drivers before it already determine.

    implied_by: names of those drivers; none if the joints alone determine it.
    """

    name: str
    implied_by: tuple[str, ...]


@dataclass(frozen=True)
class DriverMismatch:
    """Motion that the drivers leave free, and drivers of what is held, at generic poses.

    missing: number of further drivers needed; surplus: drivers of quantities already determined; loose: names of
    coordinates that joints and drivers leave free.
    """

    missing: int
    surplus: tuple[SurplusDriver, ...]
    loose: tuple[CoordinateName, ...]

    @property
    def loose_bodies(self) -> tuple[str, ...]:
        """Names of the bodies with a loose coordinate."""
        return tuple(dict.fromkeys(name.owner for name in self.loose))

    def as_json(self) -> dict[str, Any]:
        """Return the mismatch as plain data."""
        return {
            "missing": self.missing,
            "surplus": [{"name": s.name, "implied_by": list(s.implied_by)} for s in self.surplus],
            "loose": list(self.loose),
        }


def driver_mismatch(system: System, redundancy: Redundancy) -> DriverMismatch | None:
    """Return which drivers are surplus and which coordinates are loose.

    None if drivers and degrees of freedom match, if the joints do not close, or if the mechanism is too large.
    """
    if len(system.coordinates) > LARGEST:
        return None
    poses = list(motion_samples(Part(system, redundancy.kept), redundancy.assembly.start.q, _SAMPLES))
    if not poses:
        return None
    gradients = [system.scaled_jacobian(pose) for pose in poses]
    rows, surplus = _independent_rows(system, gradients, list(redundancy.kept))
    free = null_space(gradients[-1][rows])  # (n, free directions)
    if free.shape[1] == 0 and not surplus:
        return None
    loose = tuple(
        name for name, part in zip(system.coordinates, free, strict=True) if np.abs(part).max(initial=0.0) > _MOVES
    )
    return DriverMismatch(free.shape[1], tuple(surplus), loose)


def _independent_rows(
    system: System, gradients: Sequence[FloatArray], rows: list[int]
) -> tuple[list[int], list[SurplusDriver]]:
    """Return the rows of joints and independent drivers in file order, and the surplus drivers."""
    surplus = []
    counted: list[int] = []
    for index in range(system.joint_row_count, len(system.rows)):
        others = [*rows, *counted]
        used = np.zeros(len(others), dtype=bool)
        is_outside = False
        for jacobian in gradients:
            basis, gradient = jacobian[others].T, jacobian[index]
            weights = np.linalg.lstsq(basis, gradient, rcond=1e-9)[0]
            left = float(np.linalg.norm(gradient - basis @ weights))
            is_outside |= left > _IN_SPAN * max(1.0, float(np.linalg.norm(gradient)))
            used |= np.abs(weights) > _MOVES
        if is_outside:
            counted.append(index)
        else:
            by = [system.rows[k].owner for k, is_used in zip(others, used, strict=True) if is_used and k in counted]
            surplus.append(SurplusDriver(system.rows[index].owner, tuple(by)))
    return [*rows, *counted], surplus


def clearer_problem(problem: KinfmuError, redundancy: Redundancy, mismatch: DriverMismatch | None) -> KinfmuError:
    """Return the problem, or one that names drivers of one degree of freedom while another is free."""
    if mismatch is None or redundancy.inconsistent or not mismatch.surplus or not mismatch.loose:
        return problem
    conflicts = [
        f"[drivers.{surplus.name}] drives what "
        + (f"{listed(surplus.implied_by)} and the joints determine" if surplus.implied_by else "the joints hold")
        for surplus in mismatch.surplus
    ]
    return MobilityError(
        f"{listed(conflicts)}, while {listed(mismatch.loose_bodies)} can still move", mobility=redundancy.mobility
    )
