"""figure(): a mechanism with its names, as a textbook would print it."""

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
_SEEN = (Revolute, Translational, Fixed, Distance, PointOnLine, Coordinate)  # joints that always have a picture


def figure(mechanism: Mechanism, path: str | Path, at: float | None = None) -> None:
    """Draw a mechanism into a .svg or .png file, where its run starts or, where links hide one another there, later.

    at: value of the only driver at which it is drawn instead [rad or length].

    Bodies, joints, drivers and points of interest with their names and the paths of these points over the file's run;
    axes in the mechanism's unit of length, both of one scale. The same mechanism gives the same bytes. A mechanism that
    cannot be solved but closes is drawn too.

    Raises FigureError for another suffix or a file that cannot be written, MissingPackageError without matplotlib,
    AssemblyError or MechanismError if the mechanism does not close, FigureError for a value that cannot be reached.
    """
    write(Path(path), lambda: sheet_of(instant(mechanism, at)).figure)


def sheet_of(shown: Instant) -> Sheet:
    """The sheet with everything on it; needs matplotlib."""
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
    unseen = _unseen(mechanism, marks)
    if unseen:
        notes.append(f"not drawn: {listed(unseen)}")
    sheet.note("; ".join(notes))
    return sheet


def _unseen(mechanism: Mechanism, marks: list[Mark]) -> list[str]:
    """Names of joints that have no picture, such as a held angle, or wheels that no pins hold."""
    meshing = {mark.name for mark in marks if isinstance(mark, MeshName)}
    return [joint.name for joint in mechanism.joints if not isinstance(joint, _SEEN) and joint.name not in meshing]


def _marks(shown: Instant) -> list[Mark]:
    """Everything to draw, what is drawn later on top."""
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
