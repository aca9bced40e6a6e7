"""The picture of a mechanism in its FMU, as SVG, and its icon as PNG: the same lines, without matplotlib."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import details, palette
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene, drawable
from kinfmu.draw.scene.shape import Shape, guides_of_cams
from kinfmu.run import Run

WIDTH, ICON = 640, 100  # [px]
_EDGE = 30.0  # [px] around everything
_DETAIL = 1.1  # [px] of a unit of details
_STROKES = {
    "link": 5.0,
    "rib": 3.0,
    "bar": 4.0,
    "rod": 3.0,
    "face": 5.0,
    "barrel": 9.0,
    "shaft": 4.0,
    "pitch": 0.8,
}  # [px]
_PIN = 3.5  # [px], radius
_ROUND = np.linspace(0.0, 2.0 * np.pi, 25)
_LOWEST, _HIGHEST = 160, 480  # [px] of the height


@dataclass(frozen=True, eq=False)
class PictureLine:
    """A line of the picture: points (k, 2) in px, y down; colour, width [px]; filled: an area in a lighter colour."""

    points: FloatArray
    colour: palette.Colour
    width: float
    is_filled: bool = False
    is_dashed: bool = False


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

    lines = [
        PictureLine(placed(points), line.colour, line.width, line.is_filled, line.is_dashed)
        for line in _lines(found, row, _DETAIL / scale)
        if np.isfinite(points := line.points).all()
    ]
    return Picture(tuple(lines), width, height)


def svg(drawn: Picture, title: str) -> str:
    """Return a picture as SVG; title: text with entities for special characters."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {drawn.width:.0f} {drawn.height:.0f}" role="img" '
        f'aria-label="{title}" stroke-linecap="round" stroke-linejoin="round" fill="none">'
    ]
    for line in drawn.lines:
        path = " ".join(f"{x + 0.0:.1f},{y + 0.0:.1f}" for x, y in line.points.tolist())
        fill = f' fill="{_hex(palette.lighter(line.colour))}" fill-opacity="0.6"' if line.is_filled else ""
        dash = ' stroke-dasharray="4 5"' if line.is_dashed else ""
        tag = "polygon" if line.is_filled else "polyline"
        parts.append(
            f'<{tag} points="{path}" stroke="{_hex(line.colour)}" stroke-width="{line.width:.1f}"{fill}{dash}/>'
        )
    return "\n".join([*parts, "</svg>", ""])


def png(drawn: Picture, size: int = ICON) -> bytes:
    """Return a picture as a square PNG with a transparent background."""
    scale = size / max(drawn.width, drawn.height)
    shift = 0.5 * (size - scale * np.array([drawn.width, drawn.height]))
    x, y = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    colours = np.zeros((size, size, 3))
    cover = np.zeros((size, size, 1))
    for line in drawn.lines:
        if line.is_dashed:
            continue
        points = line.points * scale + shift
        step = max(len(points) // 24, 1)
        points = np.vstack([points[:-1:step], points[-1:]])
        half = max(line.width * scale, 0.7)  # an icon needs thicker lines than a picture
        (left, top), (right, bottom) = np.clip(
            [points.min(axis=0) - half - 1.0, points.max(axis=0) + half + 2.0], 0.0, size
        ).astype(int)
        part = np.s_[top:bottom, left:right]
        distance = _distance(x[part], y[part], np.vstack([points, points[:1]]) if line.is_filled else points)
        if line.is_filled:
            inside = _inside(x[part], y[part], points) * 0.6
            _paint(colours[part], cover[part], palette.lighter(line.colour), inside)
        _paint(colours[part], cover[part], line.colour, np.clip(half + 0.5 - distance, 0.0, 1.0))
    image = np.concatenate([colours, 255.0 * cover], axis=2)
    return _encoded(np.rint(image).astype(np.uint8))


def _lines(found: Scene, row: int, size: float) -> Iterator[PictureLine]:
    """Yield the lines in the world, in order; size: of a unit of details."""
    for path in found.paths.values():
        good = path[np.isfinite(path).all(axis=1)]
        if len(good) > 1 and np.ptp(good, axis=0).max() > 1e-3 * found.size:
            yield PictureLine(good, palette.GROUND, 1.2, is_dashed=True)
    order = ("support", "rail", "bed", "slot", "belt")
    frames = {name: pose[row] for name, pose in found.frames.items()}
    guides = guides_of_cams(found.shapes)
    shapes = sorted(
        found.shapes,
        key=lambda shape: shape.kind not in order and not (shape.kind == "block" and shape.name in guides),
    )
    for shape in shapes:
        if shape.kind != "pitch" and shape.frame in frames:
            drawn = shape.placed(frames)
            for face in shapes:
                if face.kind == "face" and face.frame == shape.frame and shape.kind in ("link", "rib", "rod", "face"):
                    half = 0.5 * _STROKES["link"] * size / _DETAIL
                    drawn = replace(drawn, points=details.on_face(drawn.points, face.placed(frames), half))
            yield from _of_shape(drawn, size)
    for frame, pins in found.pins.items():
        if frame in frames:
            for _, point in pins:
                centre = world(frames[frame][None], (point[0], point[1]))[0]
                circle = centre + _PIN * size / _DETAIL * np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])
                yield PictureLine(circle, (60, 60, 60), 1.2, is_filled=True)


def _of_shape(shape: Shape, size: float) -> Iterator[PictureLine]:
    """Yield the lines of a shape that is placed in the world."""
    if shape.kind == "support":
        triangle, foot = details.support(shape, size)
        yield PictureLine(triangle, palette.GROUND, 1.5, is_filled=True)
        yield from _ground(foot, shape, size)
    elif shape.kind in ("rail", "bed"):
        yield from _ground(details.rail(shape, size), shape, size)
    elif shape.kind in ("block", "die"):
        corners = details.box(shape.points[0], shape.towards, details.BLOCK * size, details.BLOCK_WIDTH * size)
        yield PictureLine(corners, shape.colour, 1.5, is_filled=True)
    elif shape.strips:
        for strip, points in details.symbol(shape, size):
            yield PictureLine(points, shape.colour, 1.5, is_filled=strip.is_area)
    elif shape.kind == "contact":
        return
    else:
        is_area = shape.kind in ("cam", "wheel") or (shape.kind == "link" and shape.is_closed)
        yield PictureLine(shape.line, shape.colour, _STROKES.get(shape.kind, 1.5), is_filled=is_area)


def _ground(line: FloatArray, shape: Shape, size: float) -> Iterator[PictureLine]:
    yield PictureLine(line, palette.GROUND, 1.5)
    for stroke in details.hatching(line, shape.towards, size):
        yield PictureLine(stroke, palette.GROUND, 1.0)


def _hex(colour: palette.Colour) -> str:
    return "#" + "".join(f"{value:02x}" for value in colour)


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
