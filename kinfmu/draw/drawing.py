"""figure(): a textbook figure of a mechanism with its names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, overload

import numpy as np

from kinfmu.draw.instant import instant, pose_note
from kinfmu.draw.marks import gap_note, gaps, gravity, motion, paths, pins
from kinfmu.draw.names import Mark, Name, place
from kinfmu.draw.painting import Painter, extent, placed, shortest
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.joints import cam_shapes
from kinfmu.draw.scene.loads import load_text
from kinfmu.draw.scene.shape import Shape
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.sheet import Sheet
from kinfmu.draw.writing import check_target, write
from kinfmu.errors import listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints import Coordinate, Distance, Fixed, PointOnLine, Revolute, Translational
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.motion.cams import CAM_JOINTS
from kinfmu.motion.cams.placed import members_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_NAMES = 90  # more would cover the drawing
_ALWAYS_DRAWN = (Revolute, Translational, Fixed, Distance, PointOnLine, Coordinate)


@overload
def figure(mechanism: Mechanism, path: str | Path, at: float | None = None, *, ax: None = None) -> None: ...


@overload
def figure(mechanism: Mechanism, path: None = None, at: float | None = None, *, ax: Axes) -> Axes: ...


def figure(
    mechanism: Mechanism, path: str | Path | None = None, at: float | None = None, *, ax: Axes | None = None
) -> Axes | None:
    """Draw a mechanism into a .svg or .png file, or into Axes of matplotlib.

    The figure shows bodies, joints, drivers and points of interest with their names, and the paths of these points over
    the file's run; the axes are in the mechanism's unit of length, with equal scales. The same mechanism gives the same
    bytes. A mechanism that closes but cannot be solved is drawn too, and so is one that does not close: with its loops
    closed up to the first open one, whose gap is a red line.

    Args:
        mechanism: The mechanism.
        path: The .svg or .png file.
        at: Value of the only driver [rad or length]. Default: the start of the run, or a later sample if links hide one
            another at the start.
        ax: Axes to draw into, in place of a file. Widths of lines and places of names are for their size at the time
            of the call; limits, labels and title are set.

    Returns:
        `ax`; None for a file.

    Raises:
        RequestError: `mechanism` is something else, such as a run.
        FigureError: The suffix is unknown, the file cannot be written, `at` cannot be reached, or neither or both of
            `path` and `ax` are given.
        MissingPackageError: matplotlib is not installed.
        AssemblyError: The mechanism has no pose to draw, or none at `at`.
        MechanismError: The mechanism is invalid.

    """
    require_mechanism(mechanism, "figure")
    check_target("figure", path, ax)
    if path is None:
        return sheet_of(instant(mechanism, at, with_gap=True), ax).axes
    write(Path(path), lambda: sheet_of(instant(mechanism, at, with_gap=True)).figure)
    return None


def sheet_of(shown: Instant, ax: Axes | None = None, more: Sequence[Mark] = ()) -> Sheet:
    """Return the sheet with everything and `more` drawn on it; default: in a figure of its own; needs matplotlib."""
    mechanism = shown.mechanism
    found = placed(shown, shapes(shown))
    arrows, places, tracks = motion(shown), pins(shown), paths(shown)
    reach = np.vstack([extent(found), *(mark.extent() for mark in (*arrows, *places, *tracks, *more))])
    size = float(np.ptp(reach, axis=0).max())
    sheet = Sheet(reach, shortest(found, size), mechanism.length_unit, mechanism.title or mechanism.name, ax)
    texts = {load.name: load_text(load) for load in mechanism.loads}
    names = draw(sheet, found, tracks, [*arrows, *places, *gaps(shown), *more], texts)
    names += gravity(sheet, mechanism)
    notes = [text for text in (gap_note(shown), pose_note(shown), *_face_notes(shown)) if text]
    if len(names) <= MOST_NAMES:
        place(names, sheet)
    else:
        notes.append(f"{len(names)} names left out")
    missing = _not_drawn(mechanism, found)
    if missing:
        notes.append(f"not drawn: {listed(missing)}")
    sheet.note("; ".join(notes))
    return sheet


def draw(
    sheet: Sheet,
    found: Sequence[Shape],
    tracks: Sequence[Mark],
    above: Sequence[Mark],
    loads: Mapping[str, str] | None = None,
) -> list[Name]:
    """Draw shapes of the world, paths between plates and bars, and marks above all, and return the names to place.

    loads: texts next to loads, by name.
    """
    painter = Painter(sheet, found)
    painter.wheels()
    painter.cams()
    painter.ground()
    painter.plates()
    names = [name for track in tracks for name in track.draw(sheet)]
    painter.bars()
    painter.slides()
    painter.racks()
    painter.cylinders()
    painter.loads(loads or {})
    names += [name for mark in above for name in mark.draw(sheet)]
    return [*painter.names, *names]


def _face_notes(shown: Instant) -> Iterator[str]:
    """Yield a sentence for each flat face whose contact never reaches the point that defines it."""
    points = {joint.name: members_of(joint)[2] for joint in shown.joints if isinstance(joint, CAM_JOINTS)}
    for shape in cam_shapes(shown):
        if shape.reach is not None and shape.reach[0] * shape.reach[1] > 0.0:
            near, far = sorted(map(abs, shape.reach))
            distance = f"{near:.4g}" if far - near <= 1e-6 * far else f"{near:.4g} to {far:.4g}"
            yield f"{shape.joint}: contact {distance} {shown.mechanism.length_unit} from {points[shape.joint]}"


def _not_drawn(mechanism: Mechanism, found: Sequence[Shape]) -> list[str]:
    """Return the names of joints that are not drawn, such as a held angle, or wheels without pins."""
    drawn = {shape.name for shape in found if shape.kind in ("contact", "pitch")}
    joints = [joint for joint in mechanism.joints if not isinstance(joint, _ALWAYS_DRAWN)]
    return [joint.name for joint in joints if joint.name not in drawn]
