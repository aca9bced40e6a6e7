"""figure(): a textbook figure of a mechanism with its names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, overload

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.instant import instant, pose_note
from kinfmu.draw.marks import gap_note, gaps, gravity, paths, pins, value_text
from kinfmu.draw.names import Mark, Name, place
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.joints import cam_shapes
from kinfmu.draw.scene.loads import load_text
from kinfmu.draw.scene.shape import Shape
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.scene.strokes import STROKES, fineness, strokes_of, symbol
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
_NAMED_AT = (0.5, 0.35, 0.65, 0.2, 0.8)  # of the length of an edge, places for its name
_ON_CYLINDER = (0.6, 0.9, 0.4, 1.2)  # of the length of its barrel
_TO_NAME = 5.0  # [pt] from lines of loads and drivers to their names


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
    in_world = placed(shown, shapes(shown))
    places, tracks = pins(shown), paths(shown)
    reach = np.vstack([extent(in_world), *(mark.extent() for mark in (*places, *tracks, *more))])
    size = float(np.ptp(reach, axis=0).max())
    sheet = Sheet(reach, fineness(in_world, size), mechanism.length_unit, mechanism.title or mechanism.name, ax)
    names = draw(sheet, in_world, tracks, [*places, *gaps(shown), *more])
    names += _names(sheet, in_world, _texts(shown))
    names += gravity(sheet, mechanism)
    notes = [text for text in (gap_note(shown), pose_note(shown), *_face_notes(shown)) if text]
    if len(names) <= MOST_NAMES:
        place(names, sheet)
    else:
        notes.append(f"{len(names)} names left out")
    missing = _not_drawn(mechanism, in_world)
    if missing:
        notes.append(f"not drawn: {listed(missing)}")
    sheet.note("; ".join(notes))
    return sheet


def draw(sheet: Sheet, in_world: Sequence[Shape], tracks: Sequence[Mark], above: Sequence[Mark]) -> list[Name]:
    """Paint shapes of the world, paths between plates and bars, and marks above all; return the names of the marks."""
    names: list[Name] = []
    painted = strokes_of(in_world, sheet.sizes)
    for is_over in (False, True):
        for stroke in painted:
            if (stroke.stroke.order > STROKES["path"][0].order) == is_over:
                sheet.paint(stroke)
        names += [name for mark in (above if is_over else tracks) for name in mark.draw(sheet)]
    return names


def _texts(shown: Instant) -> dict[tuple[str, bool], str]:
    """Return the texts next to loads, and with their values next to drivers, by name and True for a driver."""
    texts = {(load.name, False): load_text(load) for load in shown.mechanism.loads}
    for driver in shown.drivers:
        texts[driver.name, True] = f"{driver.name} = {value_text(shown, driver, shown.value(driver.name))}"
    return texts


def _names(sheet: Sheet, in_world: Sequence[Shape], texts: Mapping[tuple[str, bool], str]) -> Iterator[Name]:
    """Yield the names of bodies, bars, rails and contacts, and the texts of loads and drivers."""
    grey = palette.darker(palette.GROUND)
    for shape in in_world:
        first, last = shape.points[0], shape.points[-1]
        if shape.kind == "contact":
            yield Name(shape.name, shape.points, 3.0, grey, italic=True, rank=4)
        elif shape.kind in ("rail", "bed"):
            ends = np.vstack([points for _, points in symbol(shape, sheet.sizes.detail)])
            first, last = ends[0], ends[-1]
            anchors = np.array([last + part * (first - last) for part in (0.05, 0.95, 0.25, 0.75, 0.5)])
            yield Name(shape.name, anchors, 6.5, grey, italic=True, rank=4)
        elif shape.kind == "bar":
            anchors = np.array([first + part * (last - first) for part in _NAMED_AT])
            yield Name(shape.name, anchors, 0.3 * sheet.bar + 1.5, grey, italic=True, rank=2)
        elif shape.kind == "link":
            yield _of_body(sheet, shape, [rod.points for rod in in_world if rod.frame == shape.frame and rod.is_bar])
        elif shape.kind == "barrel":
            anchors = np.array([first + part * (last - first) for part in _ON_CYLINDER])
            yield Name(texts[shape.name, True], anchors, 8.0, palette.DRIVER, rank=1)
        elif shape.is_effort:
            places = np.vstack([points for _, points in symbol(shape, sheet.sizes.detail)])
            text = texts[shape.name, shape.kind == "driver"]
            yield Name(text, _anchors(shape, places), _TO_NAME, shape.colour, rank=1)


def _of_body(sheet: Sheet, link: Shape, bars: Sequence[FloatArray]) -> Name:
    """Return the name of a body: on its plate, if it fits, or else next to the longest of its edges and bars (2, 2)."""
    clearance, edge = sheet.bar / 2.0 + 1.5, palette.darker(link.colour)
    edges = [np.array(ends) for ends in pairwise(link.line)] + [*bars]
    if not edges:
        return Name(link.name, link.points, 2.0 * clearance, edge, italic=True, rank=3)
    edges.sort(key=lambda ends: -float(np.hypot(*(ends[1] - ends[0]))))
    anchors = [a + part * (b - a) for a, b in edges for part in _NAMED_AT]
    if link.is_closed:
        anchors, clearance = [link.points.mean(axis=0), *anchors], 0.0
    return Name(link.name, np.array(anchors), clearance, edge, italic=True, rank=2)


def _face_notes(shown: Instant) -> Iterator[str]:
    """Yield a sentence for each flat face whose contact never reaches the point that defines it."""
    points = {joint.name: members_of(joint)[2] for joint in shown.joints if isinstance(joint, CAM_JOINTS)}
    for shape in cam_shapes(shown):
        if shape.reach is not None and shape.reach[0] * shape.reach[1] > 0.0:
            near, far = sorted(map(abs, shape.reach))
            distance = f"{near:.4g}" if far - near <= 1e-6 * far else f"{near:.4g} to {far:.4g}"
            yield f"{shape.joint}: contact {distance} {shown.mechanism.length_unit} from {points[shape.joint]}"


def _not_drawn(mechanism: Mechanism, in_world: Sequence[Shape]) -> list[str]:
    """Return the names of joints that are not drawn, such as a held angle, or wheels without pins."""
    drawn = {shape.name for shape in in_world if shape.kind in ("contact", "pitch")}
    joints = [joint for joint in mechanism.joints if not isinstance(joint, _ALWAYS_DRAWN)]
    return [joint.name for joint in joints if joint.name not in drawn]


def placed(shown: Instant, in_world: Sequence[Shape]) -> list[Shape]:
    """Return shapes in the world as drawn."""
    poses = {name: pose[0] for name, pose in shown.frames.items()}
    return [shape.placed(poses) for shape in in_world]


def extent(in_world: Sequence[Shape]) -> FloatArray:
    """Return world coordinates (k, 2) that must be on the sheet; a cylinder's rod may project behind its barrel."""
    return np.vstack([shape.points[-1:] if shape.kind == "shaft" else shape.line for shape in in_world])


def _anchors(load: Shape, symbol: FloatArray) -> FloatArray:
    """Return places for the name of a load, (k, 2); symbol: points (s, 2) of its lines."""
    if len(load.points) < 2:
        return np.vstack([symbol.mean(axis=0), symbol[:: max(len(symbol) // 6, 1)]])
    a, b = load.points
    off = symbol.mean(axis=0) - 0.5 * (a + b)  # of a symbol next to others
    return np.array([a + off + part * (b - a) for part in _NAMED_AT])
