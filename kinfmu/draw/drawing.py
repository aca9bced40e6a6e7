"""figure(): a textbook figure of a mechanism with its names; the painting of shapes on its sheet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, overload

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.instant import instant, pose_note
from kinfmu.draw.marks import gap_note, gaps, gravity, motion, paths, pins
from kinfmu.draw.names import Mark, Name, place
from kinfmu.draw.scene import details, palette
from kinfmu.draw.scene.details import box
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.joints import cam_shapes
from kinfmu.draw.scene.loads import load_text
from kinfmu.draw.scene.shape import Shape, guides_of_cams
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.sheet import BAR, PAPER, Sheet
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
DASHES = (0, (7.0, 2.0, 1.5, 2.0))  # of a pitch circle or curve
_GREY, _LIGHT_GREY = palette.darker(palette.GROUND), palette.lighter(palette.BAR)  # edge and area without a body
_EDGE = 0.9  # [pt]
_NAMED_AT = (0.5, 0.35, 0.65, 0.2, 0.8)  # of the length of an edge, places for its name
_SLOT, _OPENING = 1.55, 0.75  # widths of a slotted link and of its slot, relative to a bar
_LOAD, _TO_NAME = 1.2, 5.0  # [pt]; lines of loads, distance of their names
_BARREL, _ROD, _PISTON = 5.5, 1.9, 1.6  # [pt]; half widths of a cylinder, half thickness of its piston


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
    arrows, places, tracks = motion(shown), pins(shown), paths(shown)
    reach = np.vstack([extent(in_world), *(mark.extent() for mark in (*arrows, *places, *tracks, *more))])
    size = float(np.ptp(reach, axis=0).max())
    sheet = Sheet(reach, shortest(in_world, size), mechanism.length_unit, mechanism.title or mechanism.name, ax)
    texts = {load.name: load_text(load) for load in mechanism.loads}
    names = draw(sheet, in_world, tracks, [*arrows, *places, *gaps(shown), *more], texts)
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


def draw(
    sheet: Sheet,
    in_world: Sequence[Shape],
    tracks: Sequence[Mark],
    above: Sequence[Mark],
    loads: Mapping[str, str] | None = None,
) -> list[Name]:
    """Draw shapes of the world, paths between plates and bars, and marks above all, and return the names to place.

    loads: texts next to loads, by name.
    """
    painter = Painter(sheet, in_world)
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


def shortest(in_world: Sequence[Shape], size: float) -> float:
    """Return the length of the shortest link of a figure, `size` if there is none."""
    steps = [np.diff(shape.points, axis=0) for shape in in_world if shape.kind in ("link", "bar")]
    lengths = [length for step in steps for length in np.hypot(*step.T) if length > 1e-3 * size]
    return float(min(lengths, default=size))


def _anchors(load: Shape, symbol: FloatArray) -> FloatArray:
    """Return places for the name of a load, (k, 2); symbol: points (s, 2) of its lines."""
    if len(load.points) < 2:
        return np.vstack([symbol.mean(axis=0), symbol[:: max(len(symbol) // 6, 1)]])
    a, b = load.points
    off = symbol.mean(axis=0) - 0.5 * (a + b)  # of a symbol next to others
    return np.array([a + off + part * (b - a) for part in _NAMED_AT])


class Painter:
    """Shapes of the world that are painted on a sheet, each kind by a method; `names` collects the names to place."""

    def __init__(self, sheet: Sheet, in_world: Sequence[Shape]) -> None:
        self.names: list[Name] = []
        self._sheet, self._shapes = sheet, in_world
        self._width = BAR * sheet.fine  # [pt], of a link
        self._guides = guides_of_cams(in_world)
        self._racks = {rack.name for rack in self._all("rack")}

    def _all(self, *kinds: str) -> list[Shape]:
        return [shape for shape in self._shapes if shape.kind in kinds]

    def wheels(self) -> None:
        """Paint gear pairs and belts, larger wheels first."""
        gears = [wheel for wheel in self._all("wheel") if wheel.name not in self._racks]
        for wheel in sorted(gears, key=lambda wheel: -wheel.radius):
            self._wheel(wheel, is_filled=True)
        for belt in self._all("belt"):
            self._sheet.line(belt.points, 1.6, _GREY, matters=0.6)
        self._contacts(*(contact for contact in self._all("contact") if contact.name not in self._racks))

    def racks(self) -> None:
        """Paint racks and their pinions, over the links, since a rack is often a link too."""
        sheet, size = self._sheet, self._sheet.ornament
        for rack in self._all("rack"):
            edge, fill = palette.darker(rack.colour), palette.lighter(rack.colour)
            along = rack.points[1] - rack.points[0]
            length = float(np.hypot(*along))
            bar = box(rack.points.mean(axis=0), along / length, length / 2.0, (details.TOOTH + 2.0) * size)
            sheet.line(bar, 0.0, PAPER, closed=True, fill=PAPER, matters=0.0)  # covers the body's own bar
            sheet.line(details.teeth(rack, size), 0.9, edge, closed=True, fill=fill)
            sheet.line(rack.points, 0.7, edge, style=DASHES, matters=0.0)
            for wheel in self._all("wheel"):
                if wheel.name == rack.name:
                    self._wheel(wheel, is_filled=False)
        self._contacts(*(contact for contact in self._all("contact") if contact.name in self._racks))

    def _contacts(self, *contacts: Shape) -> None:
        """Name joints where their bodies touch."""
        self.names += [Name(contact.name, contact.points, 3.0, _GREY, italic=True, rank=4) for contact in contacts]

    def _wheel(self, wheel: Shape, *, is_filled: bool) -> None:
        edge = palette.darker(wheel.colour)
        fill = palette.lighter(palette.lighter(palette.lighter(wheel.colour))) if is_filled else None
        self._sheet.circle(wheel.points[0], wheel.radius, 1.0, edge, fill=fill, style=DASHES, matters=0.6)
        for spoke in self._all("spoke"):
            if (spoke.name, spoke.frame) == (wheel.name, wheel.frame):
                self._sheet.line(spoke.points, 1.0, edge, matters=0.4)

    def cams(self) -> None:
        """Paint cams in their bodies' colours over the blocks of their followers, and rollers over both."""
        sheet = self._sheet
        for pitch in self._all("pitch"):
            edge = palette.darker(pitch.colour)
            sheet.line(pitch.points, 0.7, edge, closed=True, style=DASHES, matters=0.3)
        self._rollers(PAPER)
        for block in self._all("block"):
            if block.name in self._guides:
                self._block(block)
        for cam in self._all("cam"):
            fill = palette.lighter(palette.lighter(cam.colour))
            sheet.line(cam.points, 1.2, palette.darker(cam.colour), closed=True, fill=fill, matters=1.0)
        if self._guides:
            self._rollers(None)

    def _rollers(self, fill: palette.Colour | None) -> None:
        for roller in self._all("roller"):
            edge = palette.darker(roller.colour)
            self._sheet.circle(roller.points[0], roller.radius, 1.0, edge, fill=fill, matters=0.8)

    def ground(self) -> None:
        """Paint supports and rails."""
        size = self._sheet.ornament
        for shape in self._all("support"):
            triangle, line = details.support(shape, size)
            self._sheet.line(triangle, 0.9, _GREY, closed=True, fill=_LIGHT_GREY, matters=1.5)
            self._hatched(line, shape.towards)
        for shape in self._all("rail", "bed"):
            first, last = line = details.rail(shape, size)
            self._hatched(line, shape.towards)
            anchors = np.array([last + part * (first - last) for part in (0.05, 0.95, 0.25, 0.75, 0.5)])
            self.names.append(Name(shape.name, anchors, 6.5, _GREY, italic=True, rank=4))

    def _hatched(self, line: FloatArray, towards: FloatArray) -> None:
        size = self._sheet.ornament
        self._sheet.strokes(details.hatching(line, towards, size), 0.6, _GREY)
        self._sheet.line(line, 1.1, _GREY, matters=1.5)
        self._sheet.cover(details.ground_side(line, towards, size), 1.0)

    def plates(self) -> None:
        """Paint bodies whose points enclose an area."""
        for link in self._all("link"):
            if link.is_closed:
                self._link(link)

    def bars(self) -> None:
        """Paint massless bars, then bodies whose points are on a line."""
        for bar in self._all("bar"):
            width = 0.45 * self._width
            self._sheet.line(bar.points, width + _EDGE, _GREY, matters=0.8)
            self._sheet.line(bar.points, width - _EDGE / 2.0, palette.lighter(bar.colour), matters=0.0)
            anchors = np.array([bar.points[0] + part * (bar.points[1] - bar.points[0]) for part in _NAMED_AT])
            self.names.append(Name(bar.name, anchors, 0.3 * self._width + 1.5, _GREY, italic=True, rank=2))
        for link in self._all("link"):
            if not link.is_closed:
                self._link(link)

    def _link(self, link: Shape) -> None:
        """Paint a body with its rods; all edges first, so that the parts look like one body."""
        width, sheet = self._width, self._sheet
        clearance = width / 2.0 + 1.5
        edge, fill = palette.darker(link.colour), palette.lighter(link.colour)
        routes = [(link.points, link.is_closed)] if len(link.points) > 1 else []
        routes += [(rod.points, False) for rod in self._all("rod", "face") if rod.frame == link.frame]
        for face in self._all("face"):
            if face.frame == link.frame:
                routes = [(details.on_face(route, face, width / 2.0 * sheet.point), closed) for route, closed in routes]
        if not routes:
            self.names.append(Name(link.name, link.points, 2.0 * clearance, edge, italic=True, rank=3))
            return
        for route, is_closed in routes:
            sheet.line(route, width + _EDGE, edge, closed=is_closed, matters=0.8)
        for route, is_closed in routes:
            sheet.line(route, width - _EDGE, fill, closed=is_closed, fill=fill if is_closed else None, matters=0.0)
        edges = [ends for route, is_closed in routes for ends in pairwise([*route, *route[: int(is_closed)]])]
        edges.sort(key=lambda ends: -float(np.hypot(*(ends[1] - ends[0]))))
        anchors = [a + part * (b - a) for a, b in edges for part in _NAMED_AT]
        if link.is_closed:  # its name is inside, if it fits
            anchors, clearance = [link.points.mean(axis=0), *anchors], 0.0
        self.names.append(Name(link.name, np.array(anchors), clearance, edge, italic=True, rank=2))

    def slides(self) -> None:
        """Paint slots and blocks."""
        for shape in self._all("slot", "block", "die"):
            if shape.kind == "slot":
                self._slot(shape.points, palette.darker(shape.colour), palette.lighter(shape.colour))
            elif shape.kind == "die" or shape.name not in self._guides:
                self._block(shape)

    def _block(self, block: Shape) -> None:
        size, edge = self._sheet.ornament, palette.darker(block.colour)
        corners = box(block.points[0], block.towards, details.BLOCK * size, details.BLOCK_WIDTH * size)
        self._sheet.line(corners, 1.1, edge, closed=True, fill=palette.lighter(block.colour), matters=1.5)

    def _slot(self, ends: FloatArray, edge: palette.Colour, fill: palette.Colour) -> None:
        along = ends[1] - ends[0]
        play = 0.4 * self._width * self._sheet.point * along / max(float(np.hypot(*along)), 1e-30)  # the pin's radius
        line = np.array([ends[0] - play, ends[1] + play])
        self._sheet.line(line, _SLOT * self._width + 0.9, edge)
        self._sheet.line(line, _SLOT * self._width - 0.9, fill, matters=0.0)
        self._sheet.line(line, _OPENING * self._width + 0.8, edge, matters=0.0)
        self._sheet.line(line, _OPENING * self._width - 0.8, PAPER, matters=0.0)

    def cylinders(self) -> None:
        """Paint cylinders: the rod, and over it the barrel with the piston."""
        for barrel, shaft in zip(self._all("barrel"), self._all("shaft"), strict=True):
            self._cylinder(barrel.points, shaft.points)

    def loads(self, texts: Mapping[str, str]) -> None:
        """Paint the symbols of loads with their texts by name; none for a load without a text."""
        sheet = self._sheet
        for load in self._shapes:
            if not load.strips:
                continue
            places = []
            for strip, points in details.symbol(load, sheet.ornament):
                fill = (load.colour if strip.is_solid else PAPER) if strip.is_area else None
                width = 0.4 if strip.is_solid else _LOAD
                sheet.line(points, width, load.colour, closed=strip.is_area, fill=fill, matters=1.5)
                places.append(points)
            if text := texts.get(load.name):
                self.names.append(Name(text, _anchors(load, np.vstack(places)), _TO_NAME, load.colour, rank=1))

    def _cylinder(self, barrel: FloatArray, shaft: FloatArray) -> None:
        """Paint one cylinder; barrel: from its pin to its end, shaft: from the piston to its own pin."""
        sheet, size = self._sheet, self._sheet.ornament
        a, b = barrel[0], shaft[1]
        length = float(np.hypot(*(b - a)))
        along = (b - a) / length
        end, piston = float((barrel[1] - a) @ along), float((shaft[0] - a) @ along)
        sheet.line(box((a + b) / 2.0, along, length / 2.0, _ROD * size), 0.9, _GREY, closed=True, fill=PAPER)
        start = min(0.12 * length, 9.0 * size)
        tube = box(a + along * (start + end) / 2.0, along, (end - start) / 2.0, _BARREL * size)
        sheet.line(tube, 1.0, _GREY, closed=True, fill=_LIGHT_GREY, matters=1.0)
        inside = min(max(piston, start + _PISTON * size), end - _PISTON * size)
        disc = box(a + along * inside, along, _PISTON * size, _BARREL * size)
        sheet.line(disc, 0.5, _GREY, closed=True, fill=_GREY, matters=0.0)
