"""The anchor: an assembled pose from which every run is followed, where every block is regular."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import AmbiguousStartError, AssemblyError, MobilityError, listed
from kinfmu.plan.equations.assembly import SINGULAR, Assembled, AssembledStart, closes_nearby
from kinfmu.plan.equations.closing import OFFSET_ROUNDING, branches, close, margin
from kinfmu.plan.equations.start_poses import StartValues, open_joints_text, start_from_poses
from kinfmu.plan.equations.system import System
from kinfmu.plan.open_loop import find_open_loop
from kinfmu.plan.origin import far_rows


def find_anchor(system: System, assembly: AssembledStart, kept: Sequence[int]) -> Assembled:
    """Return the closed start pose, or a pose near it if it is singular.

    Raise an AssemblyError if the mechanism does not close; the message has the loop and its gap, an AmbiguousStartError
    if the start pose is singular and several branches leave it, a MobilityError if the mechanism is singular near the
    start pose too.

    assembly: Its start values and assembled pose. kept: Its independent joint rows, by index into System.rows.
    """
    start, found = assembly
    if found is None:
        raise does_not_close(system, start, kept)
    if found.margin <= SINGULAR:
        names = listed(driver.name for driver in system.mechanism.drivers)
        if not closes_nearby(system, found):
            raise AssemblyError(
                f"the start pose is singular ({_at(system, found.u)}), and no closed pose is found on either side of "
                f"it: start {names} elsewhere, or check the lengths"
            )
        raise MobilityError(f"[drivers] {names} do not determine the motion: it stays singular near the start pose too")
    if np.array_equal(found.u, start.u):
        return found  # the start pose itself
    closed, _ = close(system, start.q, start.u)
    if margin(system, closed) <= SINGULAR:
        leaving = branches(system, closed, found.u)
        if len(leaving) > 1:
            raise _ambiguous(system, start, found, leaving)
    return found


def does_not_close(system: System, start: StartValues, kept: Sequence[int]) -> AssemblyError:
    """Return the error of the loop that does not close, with its gap and the pose that has it."""
    loop = find_open_loop(system, start, kept)
    cure = (
        "check start poses: the loop closes from others" if loop.closes_elsewhere else "check lengths and start poses"
    )
    away = far_rows(system, loop.pose).offset
    scale = 1.0 if loop.unit == "rad" else system.size
    opened = open_joints_text(system, start_from_poses(system).q)
    if 0.0 < loop.gap <= OFFSET_ROUNDING * away * scale:
        cure = f"this is rounding, {away:.2g} sizes from the world's origin, to which it is tied: place it nearer"
    elif opened:  # an earlier loop may have closed far from its start poses
        cure += f"; in the start poses of the file {opened}"
    if len(kept) > len(system.coordinates):
        cure += f"; {len(kept)} rows of the joints hold {len(system.coordinates)} coordinates: is a joint too many?"
    return AssemblyError(
        f"the mechanism does not close near its start pose ({_at(system, start.u)}): {loop}; {cure}",
        joint=loop.joint,
        gap=loop.gap,
        loop=loop,
    )


def _ambiguous(system: System, start: StartValues, found: Assembled, leaving: list[FloatArray]) -> AmbiguousStartError:
    spread = np.ptp(np.array(leaving) / system.column_scales, axis=0)
    widest = int(spread.argmax())
    name, unit = system.coordinates[widest], system.mechanism.length_unit
    values = " or ".join(_value(branch[widest], is_angle=name.is_angle, unit=unit) for branch in leaving)
    return AmbiguousStartError(
        f"the start pose is singular ({_at(system, start.u)}) and {len(leaving)} branches leave it: at "
        f"{_at(system, found.u)} {name} can be {values}; give a start pose near it, on the branch wanted",
        branches=leaving,
    )


def _at(system: System, u: FloatArray) -> str:
    """Return 'crank = 1.047 rad (60 deg)': driver values for a message."""
    values = []
    for driver, value in zip(system.mechanism.drivers, u, strict=True):
        is_angle = driver.quantity.kind == "angle"
        values.append(f"{driver.name} = {_value(value, is_angle=is_angle, unit=system.mechanism.length_unit)}")
    return listed(values)


def _value(value: float, *, is_angle: bool, unit: str) -> str:
    """Return '1.0472 rad (60 deg)' or '12 mm'; values that rounding left of zero are 0."""
    value = round(float(value), 12) + 0.0
    return f"{value:.6g} rad ({math.degrees(value):.6g} deg)" if is_angle else f"{value:.6g} {unit}"
