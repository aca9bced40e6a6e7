"""dxf(): one pose of a run as a DXF drawing, for CAD."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.draw.animation import placed_run
from kinfmu.draw.lines import Lines
from kinfmu.draw.painting import placed
from kinfmu.draw.pose_at import pose_at
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.writing import write_bytes
from kinfmu.errors import FigureError, MissingPackageError
from kinfmu.files import suffix_of
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.run import Run

DXF_UNITS = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "um": 13}  # $INSUNITS
_DRAWN = (  # what has true dimensions
    *("link", "rod", "face", "bar", "slot", "rail", "rack", "wheel", "barrel", "shaft"),
    *("cam", "pitch", "roller"),
)
POINT_STYLE = 34  # $PDMODE: a cross in a circle


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
    if suffix_of(path) != ".dxf":
        raise FigureError(f"{path}: '{path.suffix}' is not a known format of CAD drawings; known: .dxf")
    good = np.flatnonzero(run.good)
    if not len(good):
        raise FigureError(f"{path}: the run has no sample with numbers to draw")
    try:
        ezdxf: Any = import_module("ezdxf")
    except ImportError:
        raise MissingPackageError(f"{path}: a DXF file needs ezdxf: pip install 'kinfmu[dxf]'") from None
    mechanism, poses = placed_run(run, path)
    drawn = {body: pose[good[:1]] for body, pose in poses.items()} if at is None else pose_at(run, mechanism, at, path)
    shown = Instant(mechanism, drawn, {})
    with without_date(ezdxf):
        text = _drawing(ezdxf, shown, mechanism.length_unit)
    write_bytes(path, text.encode())


def _drawing(ezdxf: Any, shown: Instant, length_unit: str) -> str:
    """Return the text of the drawing."""
    drawing = ezdxf.new("R2010", units=DXF_UNITS.get(length_unit, 0))
    drawing.header["$PDMODE"] = POINT_STYLE
    space = drawing.modelspace()
    for body in (GROUND_NAME, *(body.name for body in shown.mechanism.moving_bodies)):
        drawing.layers.add(body, true_color=ezdxf.rgb2int(shown.colour(body)))
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
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue()


@contextmanager
def without_date(ezdxf: Any) -> Iterator[None]:
    """Let ezdxf write no dates and no random identifiers in this block."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
