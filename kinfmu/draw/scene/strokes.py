"""The table of strokes: how every line and area of a mechanism looks, in every picture.

Figures, animations, FMUs and recordings paint what `strokes_of` returns, in a loop; so does the page, which has the
table as data. Widths are in points.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.shape import FLAT, Shape, Strip, guides_of_cams

UNITS = 420.0  # [pt], that a picture of a mechanism is usually wide or high
BAR = 9.0  # [pt]; largest width of a link
_LONG_ENOUGH, _FINEST = 0.12, 0.1  # of the picture: shortest link that needs no thinner lines; factor of the thinnest
_ALWAYS = 0.35  # part of details that does not shrink with the links
_THINNEST = 0.3  # [pt]
BLOCK, BLOCK_WIDTH = 11.0, 7.0  # half length and half width of a block
SUPPORT = 13.0  # height of a support
_DASHES = (7.0, 2.0, 1.5, 2.0)  # of a pitch circle or curve
_HALF, _FOOT = 8.0, 12.0  # half widths of a support's triangle and of its line
_HATCH, _HATCH_STEP = 4.5, 5.0  # depth of hatching, usual distance of its strokes
_LIFT = {"rail": BLOCK_WIDTH, "bed": 11.0}  # from the line on which a block or rack slides to its rail
_REACH = 19.0  # of a rail beyond the middle of its block
_TOOTH, _BACK, _TOOTH_STEP = 4.0, 10.0, 9.0  # half height of a rack's teeth, its back, usual pitch
_TOOTH_PROFILE = ((0.0, 1.0), (0.25, 1.0), (0.4, -1.0), (0.6, -1.0), (0.75, 1.0))  # part of the pitch, depth
_TUBE, _ROD, _PISTON, _START = 5.5, 1.9, 1.6, 9.0  # half widths of a cylinder; half of its piston; from pin to tube


class Stroke(NamedTuple):
    """A line, and the area inside it.

    Attributes:
        order: Strokes of a higher order cover those of a lower one. Of one order, a body is painted after another one,
            all its strokes as they follow in the table, so that its parts look like one.
        line: Role in `palette.ROLES` of the colour of the line.
        width: Of the line [pt].
        of_link: Part of the width of a link that is added to it.
        fill: Role of the colour of the area. Default: none.
        dash: Lengths of dashes and gaps [pt]. Default: none.
        radius: Of a dot, as a part of the width of a link.

    """

    order: float
    line: str = "edge"
    width: float = 1.0
    of_link: float = 0.0
    fill: str = ""
    dash: tuple[float, ...] = ()
    radius: float = 0.0


def _solid(order: float, of_link: float = 1.0, fill: str = "") -> tuple[Stroke, ...]:
    """Return the strokes of a bar with an edge."""
    return Stroke(order, "edge", 0.9, of_link), Stroke(order, "fill", -0.9, of_link, fill)


STROKES: dict[str, tuple[Stroke, ...]] = {
    "wheel": (Stroke(0, fill="pale", dash=_DASHES),),
    "spoke": (Stroke(1),),
    "belt": (Stroke(1, width=1.6),),
    "pitch": (Stroke(2, width=0.7, dash=_DASHES),),
    "roller": (Stroke(3, fill="paper"), Stroke(6)),  # its edge is over the cam too
    "guide": (Stroke(4, width=1.1, fill="fill"),),  # the block of a follower
    "cam": (Stroke(5, width=1.2, fill="fill"),),
    "support": (Stroke(10, width=0.9, fill="fill"),),
    "hatch": (Stroke(11, width=0.6),),
    "ground": (Stroke(12, width=1.1),),
    "plate": _solid(20, fill="fill"),
    "arm": _solid(20),  # a bar of a plate
    "range": (Stroke(24, width=0.6),),  # the path of a point over the range of the driver
    "path": (Stroke(25, width=1.4),),  # and over the run
    "bar": _solid(30, 0.45),
    "link": _solid(40),
    "slot": (*_solid(50, 1.55), Stroke(50, "edge", 0.8, 0.75), Stroke(50, "paper", -0.8, 0.75)),
    "block": (Stroke(51, width=1.1, fill="fill"),),
    "rack": (Stroke(60, width=0.9, fill="fill"),),
    "shaft": (Stroke(70, width=0.9, fill="paper"),),
    "barrel": (Stroke(71, fill="fill"),),
    "piston": (Stroke(72, width=0.5, fill="edge"),),
    "symbol": (Stroke(80, "own", 1.2),),  # of loads and drivers
    "case": (Stroke(80, "own", 1.2, fill="paper"),),
    "head": (Stroke(80, "own", 0.4, fill="own"),),
    "pin": (Stroke(90, "ink", 1.1, fill="paper", radius=0.34),),
    "weld": (Stroke(90, "ink", 0.5, fill="ink", radius=0.32),),
    "loose": (Stroke(90, "ink", 0.5, fill="ink", radius=0.14),),
    "point": (Stroke(91, "edge", 0.5, fill="edge", radius=0.22),),
}


def look() -> dict[str, Any]:
    """Return the table as data for the page."""
    rows = {
        name: [{key: value for key, value in stroke._asdict().items() if value or key == "order"} for stroke in strokes]
        for name, strokes in STROKES.items()
    }
    sizes = {
        "units": UNITS,
        "bar": BAR,
        "longEnough": _LONG_ENOUGH,
        "finest": _FINEST,
        "always": _ALWAYS,
        "thinnest": _THINNEST,
    }
    return {"strokes": rows, "roles": palette.ROLES, **sizes}


class Sizes(NamedTuple):
    """Sizes of strokes in a picture.

    Attributes:
        point: Length of a printer's point [length].
        fine: Factor of the width of links, see `fineness`.

    """

    point: float
    fine: float

    @property
    def link(self) -> float:
        """Width of a link [length]."""
        return BAR * self.fine * self.point

    @property
    def detail(self) -> float:
        """Length of a unit of details [length]: a point, or less if links are thin."""
        return (_ALWAYS + (1.0 - _ALWAYS) * self.fine) * self.point

    def width(self, stroke: Stroke) -> float:
        """Return the width of a line [length]."""
        return max(stroke.width + stroke.of_link * BAR * self.fine, _THINNEST) * self.point

    def radius(self, stroke: Stroke) -> float:
        """Return the radius of a dot [length]."""
        return stroke.radius * self.link


def fineness(shapes: Iterable[Shape], size: float) -> float:
    """Return the factor of the width of links: less than 1 if some are short compared with the size of the picture."""
    links = [np.diff(shape.points, axis=0) for shape in shapes if shape.kind in ("link", "bar")]
    lengths = [length for steps in links for length in np.hypot(*steps.T).tolist() if length > 1e-3 * size]
    return float(np.sqrt(np.clip(min(lengths, default=size) / (_LONG_ENOUGH * size), _FINEST**2, 1.0)))


class Painted(NamedTuple):
    """A stroke of a shape: points (k, 2) in the shape's frame, or in the world if the shape is placed there.

    is_first: True for the first stroke of a line, the widest one.
    """

    shape: Shape
    key: str
    stroke: Stroke
    points: FloatArray
    is_closed: bool
    is_first: bool

    def colours(self, *, is_dark: bool = False) -> tuple[palette.Colour, palette.Colour | None]:
        """Return the colours of the line and of the area, None without one."""
        colour, fill = self.shape.colour, self.stroke.fill
        area = palette.tint(fill, colour, is_dark=is_dark) if fill else None
        return palette.tint(self.stroke.line, colour, is_dark=is_dark), area


def strokes_of(shapes: Iterable[Shape], sizes: Sizes) -> list[Painted]:
    """Return the strokes of the shapes of a picture in the order in which they are painted."""
    every = list(shapes)
    guides = guides_of_cams(every)
    plates = {shape.frame for shape in every if shape.kind == "link" and shape.is_closed}
    faces = [shape for shape in every if shape.kind == "face"]
    rank = {frame: k for k, frame in enumerate(dict.fromkeys(shape.frame for shape in every))}
    painted = []
    for shape in every:
        key = _key(shape, guides, plates)
        for name, points, is_closed in _routes(shape, key, sizes.detail):
            if name in ("plate", "arm", "link"):
                for face in faces:
                    if face.frame == shape.frame:
                        points = on_face(points, face, 0.5 * sizes.link)
            for layer, stroke in enumerate(STROKES[name]):
                place = (stroke.order, -shape.radius, rank[shape.frame], layer)
                painted.append((place, Painted(shape, name, stroke, points, is_closed, layer == 0)))
    return [one for _, one in sorted(painted, key=lambda entry: entry[0])]


def _key(shape: Shape, guides: frozenset[str], plates: set[str]) -> str:
    """Return the row of the table for a shape that is a line; '' for what is not painted."""
    if shape.kind == "link":
        return "plate" if shape.is_closed else "link"
    if shape.is_bar:
        return "arm" if shape.frame in plates else "link"
    if shape.kind == "block" and shape.name in guides:
        return "guide"
    return shape.kind if shape.kind in STROKES else ""


def _routes(shape: Shape, key: str, size: float) -> Iterator[tuple[str, FloatArray, bool]]:
    """Yield the lines of a shape: their row of the table, points (k, 2), and True for a closed one."""
    for strip, points in symbol(shape, size):
        name = key if strip.stroke == shape.kind else strip.stroke
        yield name, points, bool(STROKES[name][0].fill)
    if key and not shape.strips and (shape.radius or len(shape.points) > 1):
        is_closed = shape.is_closed or shape.radius > 0.0
        yield key, shape.line[:-1] if is_closed else shape.points, is_closed


def symbol(shape: Shape, size: float) -> Iterator[tuple[Strip, FloatArray]]:
    """Yield the strips of a shape, each with its points (k, 2); parts of a cylinder stay between its ends."""
    start, along, length = _base(shape)
    across = np.array([-along[1], along[0]])
    for strip in shape.strips:
        part, own, detail, side = strip.points.T
        ahead = np.clip(part * length + own, 0.0, length) + size * detail
        yield strip, start + ahead[:, None] * along + size * side[:, None] * across


def _base(shape: Shape) -> tuple[FloatArray, FloatArray, float]:
    """Return where the strips of a shape begin, the unit vector along them, and the distance of their ends.

    Two points with a direction are on a line that has the direction on its right.
    """
    start, end = shape.points[0], shape.points[-1]
    if shape.direction is None:
        length = float(np.hypot(*(end - start)))
        return start, (end - start) / max(length, 1e-300), length
    if len(shape.points) < 2:
        return start, shape.direction, 0.0
    along = np.array([-shape.direction[1], shape.direction[0]])
    length = float((end - start) @ along)
    return (start, along, length) if length >= 0.0 else (end, along, -length)


def on_face(points: FloatArray, face: Shape, by: float) -> FloatArray:
    """Return points (k, 2) of a body, those on the line of its flat face shifted away from the cam by a length.

    A stroke of twice this width through them then touches the line of the face, and with it the cam.
    """
    off = np.abs((points - face.points[0]) @ face.towards)
    is_on = off <= FLAT * np.hypot(*(face.points[1] - face.points[0]))
    return np.asarray(points + by * is_on[:, None] * face.towards)


# ---------------------------------------------------------------- details, whose size follows from the picture


def support() -> tuple[Strip, ...]:
    """Return a support: a triangle from a pin into the ground, on a hatched line."""
    corners = [(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, SUPPORT, -_HALF), (0.0, 0.0, SUPPORT, _HALF)]
    line = np.array([[0.0, 0.0, SUPPORT, side] for side in (-_FOOT, _FOOT)])
    deeper = np.array([0.0, 0.0, 1.0, 0.0])
    return Strip(np.array(corners), "support"), _hatching(line, deeper, 5), Strip(line, "ground")


def rail(kind: str, length: float, size: float) -> tuple[Strip, ...]:
    """Return the hatched line of a rail or bed of a length, which reaches beyond its block; size: as for `rack`."""
    line = np.array([[part, 0.0, (2.0 * part - 1.0) * _REACH, -_LIFT[kind]] for part in (0.0, 1.0)])
    count = round((length / size + 2.0 * _REACH) / _HATCH_STEP)
    return _hatching(line, np.array([0.0, 0.0, 0.0, -1.0]), min(max(count, 3), 300)), Strip(line, "ground")


def _hatching(line: FloatArray, deeper: FloatArray, count: int) -> Strip:
    """Return short lines at the side of the ground of a line (2, 4): one line, which comes back on it each time."""
    step = line[1] - line[0]
    along = np.sign(step) * (deeper == 0.0) * [0.0, 0.0, 1.0, 1.0]
    tops = line[0] + step * ((np.arange(count) + 0.8) / count)[:, None]
    ends = tops + _HATCH * (deeper - 0.8 * along)
    return Strip(np.stack([tops, ends, tops], axis=1).reshape(-1, 4), "hatch")


def block() -> tuple[Strip, ...]:
    """Return a block about a point, longer along its line."""
    return (box((-BLOCK, BLOCK), BLOCK_WIDTH, "block"),)


def rack(length: float, size: float) -> tuple[Strip, ...]:
    """Return a rack of a length: teeth along its pitch line, a straight back; size: usual one of details."""
    count = max(round(length / (_TOOTH_STEP * size)), 2)
    profile = [((k + part) / count, -depth * _TOOTH) for k in range(count) for part, depth in _TOOTH_PROFILE]
    corners = [*profile, (1.0, -_TOOTH), (1.0, -_BACK), (0.0, -_BACK)]
    return (Strip(np.array([[part, 0.0, 0.0, across] for part, across in corners]), "rack"),)


def barrel() -> tuple[Strip, ...]:
    """Return the barrel of a cylinder, from its pin to its end."""
    tube = [(0.0, _START, -_TUBE), (1.0, 0.0, -_TUBE), (1.0, 0.0, _TUBE), (0.0, _START, _TUBE)]
    return box((0.0, _START), _ROD, "shaft"), Strip(np.array([[a, 0.0, b, c] for a, b, c in tube]), "barrel")


def shaft(*, has_piston: bool) -> tuple[Strip, ...]:
    """Return the rod of a cylinder, from its piston to its pin."""
    rod = Strip(np.array([[a, 0.0, 0.0, b * _ROD] for a, b in ((0, -1), (1, -1), (1, 1), (0, 1))]), "shaft")
    return (rod, box((-_PISTON, _PISTON), _TUBE, "piston")) if has_piston else (rod,)


def box(ends: tuple[float, float], half: float, stroke: str) -> Strip:
    """Return a rectangle at the first point, from one end to the other along the shape."""
    corners: Sequence[tuple[float, float]] = [(ends[0], -half), (ends[1], -half), (ends[1], half), (ends[0], half)]
    return Strip(np.array([[0.0, 0.0, along, across] for along, across in corners]), stroke)
