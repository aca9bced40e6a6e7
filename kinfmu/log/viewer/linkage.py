"""The moving linkage of a recording, y up: lines that are fixed in frames of bodies, and the moving frames."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import details, palette
from kinfmu.draw.scene.forces import Arrows
from kinfmu.draw.scene.scene import Scene
from kinfmu.draw.scene.shape import Shape, guides_of_cams
from kinfmu.log.viewer.ground import MARGIN, MOST_NAMES, detail, log_ground, shown_names
from kinfmu.log.viewer.timeline import Timeline, send
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import Run

if TYPE_CHECKING:
    import rerun as rr

TRAIL = 0.5  # length of the trail behind a point, as a part of the linkage's size
LONGEST_TRAIL = 0.2  # of the run's time
_TRAIL_PIECES = 1500  # of a path over the whole run
_PIN, _POINT = 0.012, 0.015  # radii, as parts of the size
_TIP = 0.03  # around the tips of arrows, as a part of the size
_SUPPORT_NAMES = 0.04  # additional margin below, for the names of supports
APPLICATION = "kinfmu"


class _Paint(NamedTuple):
    """How lines of one kind are drawn: radius, as a part of the size; order: higher ones cover lower ones."""

    radius: float
    order: float


_PAINT = {
    "cam": _Paint(0.006, 19.5),  # under the link through its pins
    "wheel": _Paint(0.006, 19.5),
    "spoke": _Paint(0.004, 19.5),
    "rack": _Paint(0.004, 19.5),
    "rod": _Paint(0.012, 19.5),
    "face": _Paint(0.012, 19.5),
    "bar": _Paint(0.006, 10.0),
    "link": _Paint(0.012, 20.0),
    "rib": _Paint(0.012, 20.0),
    "belt": _Paint(0.004, 20.0),
    "slot": _Paint(0.006, 20.5),
    "block": _Paint(0.022, 20.6),
    "die": _Paint(0.022, 20.6),
    "roller": _Paint(0.004, 23.0),
    "shaft": _Paint(0.006, 26.0),
    "barrel": _Paint(0.0176, 27.0),
}


def view_box(scene: Scene, forces: Arrows | None = None) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return ranges of x and of the flipped y that show everything with a margin, and the arrows of forces."""
    margin = MARGIN * scene.size
    below = np.array([0.0, _SUPPORT_NAMES * scene.size if scene.supports else 0.0])
    low, high = scene.low - margin - below, scene.high + margin
    if forces is not None:
        tips = np.vstack([forces.at[name] + along for name, along in forces.along.items()])
        edge = _TIP * scene.size
        low, high = np.fmin(low, np.nanmin(tips, axis=0) - edge), np.fmax(high, np.nanmax(tips, axis=0) + edge)
    return (float(low[0]), float(high[0])), (float(-high[1]), float(-low[1]))


def trail_path(root: str, point: str) -> str:
    """Return the entity of the trail behind a point of interest."""
    return f"{root}/trails/{point}"


def trail_time(run: Run, scene: Scene, point: str) -> float:
    """Return the duration of the trail behind a point on the timeline; its length is usually TRAIL of the size."""
    steps = np.hypot(*np.diff(scene.paths[point], axis=0).T)
    length, span = float(np.nansum(steps)), float(np.ptp(run.t)) if len(run) else 0.0
    return span * min(TRAIL * scene.size / length, LONGEST_TRAIL) if length > 0.0 else 0.0


@dataclass
class Linkage:
    """The linkage of a placed run, logged under the entity `root`: all in `colour`, or each body in its own.

    width: factor of the lines' widths; layer: higher layers cover lower ones. Where the run has no numbers, the last
    pose that closed stays, in grey, with a notice; before the first pose nothing is drawn.
    """

    rec: rr.RecordingStream
    root: str
    timeline: Timeline
    run: Run
    scene: Scene
    colour: palette.Colour | None = None
    width: float = 1.0
    layer: float = 0.0

    def __post_init__(self) -> None:
        """Set what follows from the scene: sizes, and the names that are always shown."""
        self.size, self.detail = self.width * self.scene.stroke, detail(self.scene)
        self.frames = Frames(self.rec, self.timeline, self.run, self.size, self.layer)
        bare = [shape.frame for shape in self.scene.shapes if shape.kind == "link" and len(shape.points) < 2]
        self._unlinked = {body: body for body in bare}  # bodies whose name is that of their first other shape
        is_named = self.colour is None and len(self.scene.bodies) <= MOST_NAMES
        self.names = shown_names(self.scene) if is_named else frozenset[str]()

    def log(self) -> None:
        """Log everything, the ground first."""
        import rerun as rr

        # Rerun's plane has y down; flipping the plane once keeps the logged numbers as they are.
        self.rec.log(self.root, rr.Transform3D(mat3x3=[[1, 0, 0], [0, -1, 0], [0, 0, 1]]), static=True)
        log_ground(self.rec, self.root, self.scene, _PIN * self.size)
        entities = {frame: self._entity(frame) for frame in self.scene.frames if frame != GROUND_NAME}
        seen: Counter[str] = Counter()  # entities of bodies with several shapes of one kind and joint
        for frame, path in entities.items():
            self.frames.move(path, self.scene.frames[frame])
        for shape in self.scene.shapes:
            if shape.frame in entities and shape.kind in _PAINT:
                entity = f"{entities[shape.frame]}/{shape.kind}/{shape.name}"
                self._shape(shape, f"{entity}/{seen[entity]}" if seen[entity] else entity)
                seen[entity] += 1
        for frame, path in entities.items():
            self._points(path, frame)
        for name, points in self.scene.paths.items():
            self._trail(trail_path(self.root, name), points, self._colour_of(name))
        self.log_paths(self.scene.paths)
        self._notice()

    def log_paths(self, paths: Mapping[str, FloatArray]) -> None:
        """Log paths (n, 2) of points of interest, which replace those logged before."""
        for name, points in paths.items():
            self._path(f"{self.root}/paths/{name}", points, self._colour_of(name))

    def _colour_of(self, point: str) -> palette.Colour:
        """Return the colour of a point of interest."""
        return self.colour or palette.body(len(self.scene.bodies) + list(self.scene.paths).index(point))

    def _entity(self, frame: str) -> str:
        """Return the entity of a frame, such as 'bodies/crank' or 'cylinders/boom/rod'."""
        kind, dot, name = frame.partition(".")
        if not dot:
            return f"{self.root}/bodies/{frame}"
        return f"{self.root}/{kind}s/{name.replace('.', '/')}"

    def _shape(self, shape: Shape, entity: str) -> None:
        """Log one shape; that of a body's link, a bar or a cylinder is the frame's own entity."""
        paint, line, own = _PAINT[shape.kind], shape.line, self.colour or shape.colour
        if shape.kind == "link" and len(line) < 2:
            return
        if shape.kind in ("link", "bar", "barrel", "shaft"):
            entity = self._entity(shape.frame)
            label = shape.name if shape.kind in ("link", "bar") else None
        else:
            label = self._unlinked.pop(shape.frame, None)
        if shape.kind in ("block", "die"):
            line = details.core(shape, self.detail)
        elif shape.kind == "rack":
            pinion = next(wheel for wheel in self.scene.shapes if (wheel.kind, wheel.name) == ("wheel", shape.name))
            line = details.teeth(shape, details.teeth_size(pinion.radius))
            line = np.vstack([line, line[:1]])
        elif shape.kind == "slot":
            own = palette.BACKDROP
        elif shape.kind == "shaft":
            own = self.colour or palette.lighter(shape.colour)
        for face in self.scene.shapes:
            if shape.kind in ("link", "rib", "rod", "face") and (face.kind, face.frame) == ("face", shape.frame):
                line = details.on_face(line, face, paint.radius * self.size)
        order = paint.order + self.scene.bodies.get(shape.frame, 0) / 100.0
        if shape.kind == "block" and shape.name in guides_of_cams(self.scene.shapes):
            order = _PAINT["cam"].order - 1.0
        self.frames.line(entity, line, paint.radius, own, order, label, label in self.names)

    def _points(self, path: str, frame: str) -> None:
        """Log pins with the names of their joints, which show when pointed at, and points of interest."""
        pins = self.scene.pins.get(frame, ())
        if pins:
            names, at = zip(*pins, strict=True)
            self.frames.points(f"{path}/pins", np.array(at), _PIN, palette.PIN, 30.0, list(names), shown=False)
        order = list(self.scene.paths)
        for name, place in self.scene.points.get(frame, ()):
            tint = self.colour or palette.body(len(self.scene.bodies) + order.index(name))
            self.frames.points(f"{path}/points/{name}", place[None], _POINT, tint, 40.0, [name], self.colour is None)

    def _path(self, path: str, points: FloatArray, colour: palette.Colour) -> None:
        """Log the path of a point over the run, one line for each part between gaps."""
        import rerun as rr

        pieces = [piece.astype(np.float32) for piece in pieces_between_gaps(points)]
        if pieces:
            line = rr.LineStrips2D(pieces, colors=[colour], radii=self._thin(1.0), draw_order=self.layer + 5.0)
            self.rec.log(path, line, static=True)

    def _trail(self, path: str, points: FloatArray, colour: palette.Colour) -> None:
        """Log pieces of the path at their times; the view shows those of the last moments."""
        import rerun as rr

        step = max(-(-len(points) // _TRAIL_PIECES), 1)
        ends = np.arange(step, len(points), step)
        pieces = [points[end - step : end + 1] for end in ends]
        known = np.array([bool(np.isfinite(piece).all()) for piece in pieces], bool)
        if not known.any():
            return
        look = rr.LineStrips2D.from_fields(radii=self._thin(2.4), colors=[colour], draw_order=self.layer + 6.0)
        self.rec.log(path, look, static=True)
        strips = np.stack([piece for piece, is_known in zip(pieces, known, strict=True) if is_known])
        self._strips(path, self.run.t[ends[known]], strips)

    def _thin(self, points: float) -> Any:
        """Return the radius of a line that is thin at any zoom; of two overlaid runs the lower one is wide."""
        import rerun as rr

        return rr.Radius.ui_points(points if self.colour is None else 2.0 * self.width * points)

    def _strips(self, path: str, t: FloatArray, strips: FloatArray) -> None:
        """Send one polyline per sample; strips: (n, k, 2)."""
        import rerun as rr

        columns = lambda rows: rr.LineStrips2D.columns(strips=strips[rows].astype(np.float32))  # noqa: E731  short
        send(self.rec, path, self.timeline, t, columns)

    def _notice(self) -> None:
        """Log a notice above the linkage for samples without numbers."""
        import rerun as rr

        run, scene, path = self.run, self.scene, f"{self.root}/notice"
        if run.good.all():
            return
        place = [(scene.low[0] + scene.high[0]) / 2, scene.high[1] + 0.6 * MARGIN * scene.size]
        look = rr.Points2D.from_fields(colors=[palette.STATUS[3]], radii=[0.0], show_labels=True)
        self.rec.log(path, look, static=True)
        switches = self.frames.switches()
        lost = ~run.good[switches]
        before = ~np.maximum.accumulate(run.good)[switches]
        texts = [
            "no pose yet" if early else "no pose: the last one that closed, in grey"
            for early, gone in zip(before, lost, strict=True)
            if gone
        ]

        def columns(rows: slice) -> Any:
            counts = lost[rows].astype(int)
            first = int(lost[: rows.start].sum())
            labels = texts[first : first + int(counts.sum())]
            positions = np.tile(np.array(place, np.float32), (len(labels), 1))
            return [*rr.Points2D.columns(positions=positions, labels=labels).partition(counts)]

        send(self.rec, path, self.timeline, run.t[switches], columns)


def pieces_between_gaps(points: FloatArray) -> list[FloatArray]:
    """Return the parts of a path (n, 2) between its gaps that have more than one point."""
    known = np.isfinite(points).all(axis=1)
    pieces = [piece[np.isfinite(piece).all(axis=1)] for piece in np.split(points, np.flatnonzero(~known)) if len(piece)]
    return [piece for piece in pieces if len(piece) > 1]


class Frames:
    """The frames of one run, placed on a timeline.

    size: of which radii are parts [length]; layer: added to the order of drawing.
    """

    def __init__(self, rec: rr.RecordingStream, timeline: Timeline, run: Run, size: float, layer: float) -> None:
        self._rec, self._timeline, self._run, self._size, self._layer = rec, timeline, run, size, layer
        self._good = np.flatnonzero(run.good)
        self._always = 0 < len(self._good) == len(run.good)  # every sample holds numbers

    def move(self, path: str, pose: FloatArray, stretch: FloatArray | None = None) -> None:
        """Send poses (n, 3) of the frame of an entity, x, y [length], phi [rad], at the samples that hold numbers.

        stretch: factors (n,) of lengths along its first axis. Default: none.
        """
        import rerun as rr

        known = pose[self._good]
        zero = np.zeros(len(known))
        half = 0.5 * known[:, 2]
        turn = np.column_stack([zero, zero, np.sin(half), np.cos(half)]).astype(np.float32)
        shift = np.column_stack([known[:, :2], zero]).astype(np.float32)
        scale = None
        if stretch is not None and not (stretch == 1.0).all():
            scale = np.column_stack([stretch[self._good], zero + 1.0, zero + 1.0]).astype(np.float32)
        send(
            self._rec,
            path,
            self._timeline,
            self._run.t[self._good],
            lambda rows: rr.Transform3D.columns(
                translation=shift[rows], quaternion=turn[rows], scale=None if scale is None else scale[rows]
            ),
        )

    def line(
        self,
        path: str,
        points: FloatArray,
        radius: float,
        colour: palette.Colour,
        order: float,
        label: str | None = None,
        shown: bool = False,
    ) -> None:
        """Log a line (k, 2) that is fixed in its frame, from the first pose on; grey where the run has no numbers.

        radius: relative to the size; label: its name, if it has one; shown: True if the name is always shown.
        """
        self.lines(path, [points], radius * self._size, colour, order, label, shown)

    def lines(
        self,
        path: str,
        points: Sequence[FloatArray],
        radius: Any,
        colour: palette.Colour,
        order: float,
        label: str | None = None,
        shown: bool = False,
    ) -> None:
        """Log lines, each (k, 2), of one colour and name, as `line` does; radius: of the plane or of the screen."""
        import rerun as rr

        look = self._look(radius, order, [label] if label else [], shown)
        strips = [line.astype(np.float32) for line in points]
        if self._always:
            self._rec.log(path, rr.LineStrips2D(strips, colors=[colour], **look), static=True)
        elif len(self._good):
            self._rec.log(path, rr.LineStrips2D.from_fields(**look), static=True)
            self._with_first_pose(path, rr.LineStrips2D.columns(strips=strips).partition([len(strips)]))
            switches = self.switches()
            colours = np.array(
                [colour if good else palette.OUT_OF_REACH for good in self._run.good[switches]], np.uint8
            )
            at = self._run.t[switches]
            send(self._rec, path, self._timeline, at, lambda rows: rr.LineStrips2D.columns(colors=colours[rows]))

    def points(
        self,
        path: str,
        points: FloatArray,
        radius: float,
        colour: palette.Colour,
        order: float,
        names: list[str],
        shown: bool,
    ) -> None:
        """Log points (k, 2) with their names, fixed in their frame, from the first pose on."""
        import rerun as rr

        look = {"colors": [colour], **self._look(radius * self._size, order, names, shown)}
        at = points.astype(np.float32)
        if self._always:
            self._rec.log(path, rr.Points2D(at, **look), static=True)
        elif len(self._good):
            self._rec.log(path, rr.Points2D.from_fields(**look), static=True)
            self._with_first_pose(path, rr.Points2D.columns(positions=at).partition([len(at)]))

    def switches(self) -> NDArray[np.int64]:
        """Return the first sample of each series with numbers, and of each without."""
        return np.flatnonzero(np.diff(self._run.good.astype(int), prepend=-1))

    def _with_first_pose(self, path: str, columns: Any) -> None:
        send(self._rec, path, self._timeline, self._run.t[self._good[:1]], lambda _: columns)

    def _look(self, radius: Any, order: float, names: list[str], shown: bool) -> dict[str, Any]:
        """Return the style that lines and points have in common."""
        return {
            "radii": [radius],
            "labels": names or None,
            "show_labels": shown if names else None,
            "draw_order": self._layer + order,
        }
