"""figure(): a textbook figure of a mechanism with its names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kinfmu.draw.ground import supports
from kinfmu.draw.instant import instant, pose_note
from kinfmu.draw.links import links, shortest
from kinfmu.draw.mark import Mark
from kinfmu.draw.motion import motion
from kinfmu.draw.names import place
from kinfmu.draw.pins import paths, pins
from kinfmu.draw.sheet import Sheet
from kinfmu.draw.slides import rails, slots_and_blocks
from kinfmu.draw.wheels import MeshName, cams, racks, wheels
from kinfmu.draw.writing import write
from kinfmu.errors import listed
from kinfmu.joints import Coordinate, Distance, Fixed, PointOnLine, Revolute, Translational
from kinfmu.mechanism import Mechanism
from kinfmu.scene.instant import Instant
from kinfmu.scene.slides import rods, slides

MOST_NAMES = 90  # more would cover the drawing
_ALWAYS_DRAWN = (Revolute, Translational, Fixed, Distance, PointOnLine, Coordinate)


def figure(mechanism: Mechanism, path: str | Path, at: float | None = None) -> None:
    """Draw a mechanism into a .svg or .png file.

    The figure shows bodies, joints, drivers and points of interest with their names, and the paths of these points over
    the file's run; the axes are in the mechanism's unit of length, with equal scales. The same mechanism gives the same
    bytes. A mechanism that closes but cannot be solved is drawn too.

    Args:
        mechanism: The mechanism.
        path: The .svg or .png file.
        at: Value of the only driver [rad or length]. Default: the start of the run, or a later sample if links hide one
            another at the start.

    Raises:
        FigureError: The suffix is unknown, the file cannot be written, or `at` cannot be reached.
        MissingPackageError: matplotlib is not installed.
        AssemblyError: The mechanism does not close.
        MechanismError: The mechanism is invalid.

    """
    write(Path(path), lambda: sheet_of(instant(mechanism, at)).figure)


def sheet_of(shown: Instant) -> Sheet:
    """Return the sheet with everything drawn on it; needs matplotlib."""
    marks = _marks(shown)
    mechanism = shown.mechanism
    extent = np.vstack([mark.extent() for mark in marks])
    size = float(np.ptp(extent, axis=0).max())
    sheet = Sheet(extent, shortest(marks, size), mechanism.length_unit, mechanism.title or mechanism.name)
    names = [name for mark in marks for name in mark.draw(sheet)]
    notes = [pose] if (pose := pose_note(shown)) else []
    if len(names) <= MOST_NAMES:
        place(names, sheet)
    else:
        notes.append(f"{len(names)} names left out")
    missing = _not_drawn(mechanism, marks)
    if missing:
        notes.append(f"not drawn: {listed(missing)}")
    sheet.note("; ".join(notes))
    return sheet


def _not_drawn(mechanism: Mechanism, marks: list[Mark]) -> list[str]:
    """Return the names of joints that are not drawn, such as a held angle, or wheels without pins."""
    drawn = {mark.name for mark in marks if isinstance(mark, MeshName)}
    joints = [joint for joint in mechanism.joints if not isinstance(joint, _ALWAYS_DRAWN)]
    return [joint.name for joint in joints if joint.name not in drawn]


def _marks(shown: Instant) -> list[Mark]:
    """Return everything to draw; later marks cover earlier ones."""
    sliding = slides(shown)
    plates, bars = links(shown, rods(shown, sliding))
    return [
        *wheels(shown),
        *cams(shown),
        *supports(shown),
        *rails(shown, sliding),
        *plates,
        *paths(shown),
        *bars,
        *slots_and_blocks(shown, sliding),
        *racks(shown),
        *motion(shown),
        *pins(shown, sliding),
    ]
