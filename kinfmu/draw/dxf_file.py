"""dxf(): one pose of a run as a DXF drawing, for CAD."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.animation import placed_run
from kinfmu.draw.drawing import placed
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.palette import Colour
from kinfmu.draw.scene.placing import poses_after, poses_of
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.writing import check_suffix, write_bytes
from kinfmu.errors import FigureError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.imports.dxf import DXF_UNITS, imported_ezdxf
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.run import Run
from kinfmu.run.axis import SAMPLE, Axis, axis_of

_DRAWN = (  # what has true dimensions
    *("link", "rod", "face", "bar", "slot", "rail", "rack", "wheel", "barrel", "shaft"),
    *("cam", "pitch", "roller"),
)
POINT_STYLE = 34  # $PDMODE: a cross in a circle
_SAME_VALUE = 1e-9  # of the largest value; nearer ones are one: driver values are rounded
_SAME_POINT = 1e-9  # of the extent of the drawing; points that are closer are one


def dxf(run: Run, path: str | Path, at: float | None = None) -> None:
    """Write one pose of `run` into a .dxf file, in the mechanism's unit of length.

    Each body has a layer of its name and colour, with its lines and circles and its points as POINT. Profile and pitch
    curve of a cam are closed polylines on the layer of the cam, one corner a degree; `kinfmu.draw.cam` draws them
    within a tolerance. What has no true dimensions, such as supports, blocks and names, is left out. The same run gives
    the same bytes with the same ezdxf.

    Args:
        run: The run.
        path: The .dxf file.
        at: Value on the axis of the run, in the unit of `axis_of`. Between two samples the pose is solved. Default: the
            first sample with numbers.

    Raises:
        FigureError: The run has no mechanism, not all its coordinates, or no sample with numbers; `at` is outside the
            run, in a gap, or between samples from which its pose cannot be solved; or the file cannot be written.
        MissingPackageError: ezdxf is not installed.

    """
    path = Path(str(path))
    check_suffix(path, (".dxf",), "CAD drawings")
    good = np.flatnonzero(run.good)
    if not len(good):
        raise FigureError(f"{path}: the run has no sample with numbers to draw")
    ezdxf = imported_ezdxf(path)
    mechanism, poses = placed_run(run, path)
    drawn = {body: pose[good[:1]] for body, pose in poses.items()} if at is None else pose_at(run, mechanism, at, path)
    with written_drawing(ezdxf, path, mechanism.length_unit) as drawing:
        _fill(drawing, Instant(mechanism, drawn, {}), ezdxf.rgb2int)


def _fill(drawing: Any, shown: Instant, colour_number: Callable[[Colour], int]) -> None:
    space = drawing.modelspace()
    for body in (GROUND_NAME, *(body.name for body in shown.mechanism.moving_bodies)):
        drawing.layers.add(body, true_color=colour_number(shown.colour(body)))
    drawn = [shape for shape in placed(shown, shapes(shown)) if shape.kind in _DRAWN]
    extent = float(np.ptp(np.concatenate([shape.points for shape in drawn]), axis=0).max()) if drawn else 0.0
    lines: dict[str, Lines] = {}
    circles: set[tuple[str, float, float, float]] = set()
    for shape in sorted(drawn, key=lambda shape: not shape.is_closed):  # lines along a rim are parts of the rim
        layer = shape.frame if drawing.layers.has_entry(shape.frame) else GROUND_NAME
        if shape.radius:
            (x, y), radius = map(float, shape.points[0]), float(shape.radius)
            circles.add((layer, x, y, radius))
            continue
        for points, is_closed in lines.setdefault(layer, Lines(extent)).new(shape.points, is_closed=shape.is_closed):
            space.add_lwpolyline(points.tolist(), close=is_closed, dxfattribs={"layer": layer})
    for layer, x, y, radius in sorted(circles):
        space.add_circle((x, y), radius, dxfattribs={"layer": layer})
    for name in shown.body_points:
        space.add_point(tuple(map(float, shown.point(name))), dxfattribs={"layer": body_of(name)})


@contextmanager
def written_drawing(ezdxf: Any, path: Path, length_unit: str) -> Iterator[Any]:
    """Give this block an empty drawing, and write it into a file, without dates and random identifiers."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        drawing = ezdxf.new("R2010", units=DXF_UNITS.get(length_unit, 0))
        drawing.header["$PDMODE"] = POINT_STYLE
        yield drawing
        text = io.StringIO()
        drawing.write(text)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    write_bytes(path, text.getvalue().encode())


def pose_at(run: Run, mechanism: Mechanism, at: float, path: Path) -> dict[str, FloatArray]:
    """Return poses (1, 3) by body and for the ground.

    Raise a FigureError if the value is outside the run, in a gap, or its pose cannot be solved.

    run: The run, with a sample at least. at: Value on the axis of the run, in the unit of `axis_of`. path: The file to
    draw, for messages.
    """
    axis = axis_of(run)
    asked = f"at t = {at:g} s" if axis.is_time else f"at {axis.name} = {at:.9g} {axis.unit}".rstrip()
    distance = (axis.values - at) * (1.0 if axis.values[-1] >= axis.values[0] else -1.0)  # ascending
    same = _SAME_VALUE * float(np.abs(axis.values).max())
    if distance[0] > same or distance[-1] < -same:
        raise FigureError(f"{path}: {asked} is outside the run, {axis.range()}")
    there = np.flatnonzero(np.abs(axis.values - at) <= same)
    after = int(there[-1]) if len(there) else int(np.argmax(distance > 0.0))
    before = after if len(there) else after - 1
    if not run.good[[before, after]].all():
        raise FigureError(f"{path}: the run has no numbers {asked}")
    ground = {GROUND_NAME: np.zeros((1, 3))}
    if len(there):
        return {body: pose[[after]] for body, pose in poses_of(run, mechanism)[0].items()} | ground
    found = None
    if run.axis != SAMPLE:
        found = poses_after(run, mechanism, before, [*_driver_values(run, mechanism, axis, at, before)])
    if found is None:
        raise FigureError(
            f"{path}: {asked} is between two samples, and its pose cannot be solved from them; samples: "
            f"{axis.values[before]:.9g} and {axis.values[after]:.9g}"
        )
    return found | ground


def _driver_values(run: Run, mechanism: Mechanism, axis: Axis, at: float, row: int) -> Iterator[float]:
    """Yield the value of each driver at a value of the axis between `row` and the next sample.

    Over time it is that of the law if the run follows it there, else of a polynomial through values, speeds and
    accelerations; over a driver it is that on the axis, and the others are at rest.
    """
    from scipy.interpolate import BPoly

    ends = [row, row + 1]
    for k, name in enumerate(run.input_names[::3]):
        table = run.inputs[ends, 3 * k : 3 * k + 3]
        if not axis.is_time:
            yield at * axis.factor if name == run.axis else float(table[0, 0])
            continue
        law = mechanism.drivers[k].law
        t = run.t[ends]
        if not isinstance(law, External) and np.allclose([law.at(one) for one in t], table[:, 0], 1e-9, 1e-9):
            yield float(law.at(at))
        else:
            known = table if np.isfinite(table).all() else table[:, :1]
            yield float(BPoly.from_derivatives(t, known)(at))


class Lines:
    """The straight lines of a layer.

    extent: Of the drawing.
    """

    def __init__(self, extent: float) -> None:
        self._near = _SAME_POINT * extent
        self._drawn: list[tuple[FloatArray, FloatArray]] = []

    def new(self, points: FloatArray, *, is_closed: bool) -> Iterator[tuple[FloatArray, bool]]:
        """Yield the parts of a polyline (n, 2) that are not drawn yet, each with whether it is closed."""
        ends = np.concatenate([points, points[:1]]) if is_closed and len(points) > 2 else points
        ends = ends[np.append(True, np.hypot(*np.diff(ends, axis=0).T) > self._near)]
        parts = []
        for a, b in pairwise(ends):
            parts.append(self._open_parts(a, b))
            self._drawn.append((a, b))
        if parts and all(part == [(0.0, 1.0)] for part in parts):
            closes = is_closed and len(parts) > 2
            yield (ends[:-1] if closes else ends), closes
            return
        for (a, b), own in zip(pairwise(ends), parts, strict=True):
            for low, high in own:
                yield np.array([a + low * (b - a), a + high * (b - a)]), False

    def _open_parts(self, a: FloatArray, b: FloatArray) -> list[tuple[float, float]]:
        """Return the parts of the line from a to b, as parts of it, that no drawn line covers."""
        along = b - a
        length = float(np.hypot(*along))
        least = self._near / length
        drawn = np.array(self._drawn).reshape(-1, 2, 2) - a  # (k, 2, 2)
        across = np.abs(drawn[..., 0] * along[1] - drawn[..., 1] * along[0]).max(axis=1, initial=0.0) / length
        covered = np.sort(drawn[across <= self._near] @ along / length**2, axis=1)
        found, begin = [], 0.0
        for low, high in sorted((low, high) for low, high in covered.tolist() if high > least and low < 1.0 - least):
            if low > begin + least:
                found.append((begin, low))
            begin = max(begin, high)
        return found if begin >= 1.0 - least else [*found, (begin, 1.0)]
