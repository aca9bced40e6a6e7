"""The picture of a mechanism in its FMU, as SVG, and its icon as PNG: the same lines, without matplotlib."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.dark import with_dark_colours
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene, drawable
from kinfmu.draw.scene.strokes import STROKES, Sizes, Stroke, strokes_of
from kinfmu.run import Run

WIDTH, ICON = 640, 100  # [px]
_EDGE = 30.0  # [px] around everything
_POINT = 1.2  # [px] of a printer's point
_ROUND = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
_LOWEST, _HIGHEST = 160, 480  # [px] of the height


@dataclass(frozen=True, eq=False)
class PictureLine:
    """A line of the picture: points (k, 2) in px, y down; colours: of line and area, None without one; width [px]."""

    points: FloatArray
    colours: tuple[palette.Colour, palette.Colour | None]
    width: float
    dash: tuple[float, ...]
    is_closed: bool


@dataclass(frozen=True, eq=False)
class Picture:
    """Lines, in the order in which they are drawn, and the size of the picture [px]."""

    lines: tuple[PictureLine, ...]
    width: float
    height: float


def picture(run: Run, width: float = WIDTH, highest: float = _HIGHEST, part: float = 0.0) -> Picture | None:
    """Return the picture of the mechanism in a run; None if there is nothing to draw.

    width, highest: of the picture [px]; bars, pins and supports have the same size in all. part: of the solved samples,
    after which the pose is drawn; 0: the first.
    """
    found, _ = drawable(run)
    if found is None or not found.shapes or not run.good.any():
        return None
    row = int(np.flatnonzero(run.good)[int(part * (run.good.sum() - 1))])
    extent = np.maximum(found.high - found.low, 1e-3 * found.size)
    scale = min((width - 2 * _EDGE) / extent[0], (highest - 2 * _EDGE) / extent[1])
    height = max(float(extent[1] * scale + 2 * _EDGE), min(_LOWEST, highest))
    middle = 0.5 * (found.low + found.high)

    def placed(points: FloatArray) -> FloatArray:
        return np.asarray((points - middle) * [scale, -scale] + [0.5 * width, 0.5 * height])

    sizes = Sizes(_POINT / scale, found.sizes.fine)
    lines = [
        PictureLine(placed(points), colours, scale * sizes.width(stroke), stroke.dash, is_closed)
        for stroke, points, colours, is_closed in _lines(found, row, sizes)
        if np.isfinite(points).all()
    ]
    return Picture(tuple(lines), width, height)


def svg(drawn: Picture, title: str) -> str:
    """Return a picture as SVG, light or dark as the page is; title: text with entities for special characters."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {drawn.width:.0f} {drawn.height:.0f}" role="img" '
        f'aria-label="{title}" stroke-linecap="round" stroke-linejoin="round" fill="none">'
    ]
    for line in drawn.lines:
        path = " ".join(f"{x + 0.0:.1f},{y + 0.0:.1f}" for x, y in line.points.tolist())
        colour, area = line.colours
        fill = f' fill="{palette.hexadecimal(area)}"' if area else ""
        dash = f' stroke-dasharray="{" ".join(map(str, line.dash))}"' if line.dash else ""
        tag = "polygon" if line.is_closed else "polyline"
        look = f'stroke="{palette.hexadecimal(colour)}" stroke-width="{line.width:.1f}"'
        parts.append(f'<{tag} points="{path}" {look}{fill}{dash}/>')
    return with_dark_colours("\n".join([*parts, "</svg>", ""]))


def png(drawn: Picture, size: int = ICON) -> bytes:
    """Return a picture as a square PNG with a transparent background."""
    scale = size / max(drawn.width, drawn.height)
    shift = 0.5 * (size - scale * np.array([drawn.width, drawn.height]))
    x, y = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    colours = np.zeros((size, size, 3))
    cover = np.zeros((size, size, 1))
    for line in drawn.lines:
        points = line.points * scale + shift
        step = max(len(points) // 24, 1)
        points = np.vstack([points[:-1:step], points[-1:]])
        half = max(line.width * scale, 0.7)  # an icon needs thicker lines than a picture
        (left, top), (right, bottom) = np.clip(
            [points.min(axis=0) - half - 1.0, points.max(axis=0) + half + 2.0], 0.0, size
        ).astype(int)
        part = np.s_[top:bottom, left:right]
        distance = _distance(x[part], y[part], np.vstack([points, points[:1]]) if line.is_closed else points)
        colour, area = line.colours
        if area:
            _paint(colours[part], cover[part], area, _inside(x[part], y[part], points))
        _paint(colours[part], cover[part], colour, np.clip(half + 0.5 - distance, 0.0, 1.0))
    image = np.concatenate([colours, 255.0 * cover], axis=2)
    return _encoded(np.rint(image).astype(np.uint8))


_Line = tuple[Stroke, FloatArray, tuple[palette.Colour, palette.Colour | None], bool]


def _lines(found: Scene, row: int, sizes: Sizes) -> Iterator[_Line]:
    """Yield strokes in the world in their order, with points, colours, and True for closed ones."""
    frames = {name: pose[row] for name, pose in found.frames.items()}
    shapes = [shape.placed(frames) for shape in found.shapes if {shape.frame, shape.other or shape.frame} <= {*frames}]
    painted = strokes_of(shapes, sizes)
    (path,) = STROKES["path"]
    over = next((k for k, one in enumerate(painted) if one.stroke.order > path.order), len(painted))
    yield from ((one.stroke, one.points, one.colours(), one.is_closed) for one in painted[:over])
    for name, points in found.paths.items():
        good = points[np.isfinite(points).all(axis=1)]
        if len(good) > 1 and np.ptp(good, axis=0).max() > 1e-3 * found.size:
            yield path, good, (palette.tint(path.line, found.colour(name)), None), False
    yield from ((one.stroke, one.points, one.colours(), one.is_closed) for one in painted[over:])
    for key, dots in (("pin", found.pins), ("point", found.points)):
        (dot,) = STROKES[key]
        circle = sizes.radius(dot) * np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])
        for frame in frames:
            for name, (x, y) in dots.get(frame, ()):
                colour = found.colour(name) if key == "point" else palette.INK
                both = palette.tint(dot.line, colour), palette.tint(dot.fill, colour)
                yield dot, world(frames[frame][None], (float(x), float(y)))[0] + circle, both, True


def _distance(x: FloatArray, y: FloatArray, points: FloatArray) -> FloatArray:
    """Return distances of pixels from a polyline (k, 2)."""
    nearest = np.full(x.shape, np.inf)
    for (ax, ay), (bx, by) in zip(points[:-1].tolist(), points[1:].tolist(), strict=True):
        dx, dy = bx - ax, by - ay
        part = np.clip(((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-30), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(x - ax - part * dx, y - ay - part * dy))
    return nearest


def _inside(x: FloatArray, y: FloatArray, points: FloatArray) -> FloatArray:
    """Return 1 for pixels inside a polygon (k, 2), else 0: an odd number of edges to the right."""
    inside = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(points.tolist(), np.roll(points, -1, axis=0).tolist(), strict=True):
        if ay != by:
            inside ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) / (by - ay) * (bx - ax))
    return inside.astype(float)


def _paint(colours: FloatArray, cover: FloatArray, colour: Sequence[float], alpha: FloatArray) -> None:
    """Paint a colour over a part of an image (h, w, 3) with its cover (h, w, 1), both changed; alpha: (h, w)."""
    own = alpha[:, :, None]
    below = cover * (1.0 - own)
    total = own + below
    colours[:] = (np.array(colour) * own + colours * below) / np.maximum(total, 1e-9)
    cover[:] = total


def _encoded(image: FloatArray) -> bytes:
    """Return an image (height, width, 4) as PNG."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width = image.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)  # 8 bits, RGBA
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
