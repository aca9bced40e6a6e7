"""The moving linkage of a recording, y up: lines that are fixed in frames of bodies, and the moving frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.forces import Arrows
from kinfmu.draw.scene.scene import Scene
from kinfmu.draw.scene.strokes import STROKES, Painted, strokes_of
from kinfmu.log.viewer.ground import MARGIN, MOST_NAMES, log_ground, shown_names
from kinfmu.log.viewer.timeline import Timeline, send
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import Run

if TYPE_CHECKING:
    import rerun as rr

TRAIL = 0.5  # length of the trail behind a point, as a part of the linkage's size
LONGEST_TRAIL = 0.2  # of the run's time
_TRAIL_PIECES = 1500  # of a path over the whole run
_MOST_LINES = 200  # that fill an area
_OWN = ("link", "bar", "barrel", "shaft")  # shapes whose entity is that of their frame
_NAMED = ("link", "bar", "block")
_TIP = 0.03  # around the tips of arrows, as a part of the size
_SUPPORT_NAMES = 0.04  # additional margin below, for the names of supports
APPLICATION = "kinfmu"


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

    width: factor of the lines' widths; layer: higher layers cover lower ones, by lines without areas. Where the run has
    no numbers, the last pose that closed stays, in grey, with a notice; before the first pose nothing is drawn.
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
        self.sizes = self.scene.sizes._replace(point=self.width * self.scene.sizes.point)
        self.frames = Frames(self.rec, self.timeline, self.run, self.layer)
        self.ground = Frames(self.rec, self.timeline, self.run, self.layer, is_fixed=True)
        bare = [shape.frame for shape in self.scene.shapes if shape.kind == "link" and len(shape.points) < 2]
        self._unlinked = {body: body for body in bare}  # bodies whose name is that of their first other shape
        is_named = self.colour is None and len(self.scene.bodies) <= MOST_NAMES
        self.names = shown_names(self.scene) if is_named else frozenset[str]()

    def log(self) -> None:
        """Log everything, the ground first."""
        import rerun as rr

        # Rerun's plane has y down; flipping the plane once keeps the logged numbers as they are.
        self.rec.log(self.root, rr.Transform3D(mat3x3=[[1, 0, 0], [0, -1, 0], [0, 0, 1]]), static=True)
        log_ground(self.rec, self.root, self.scene)
        entities = {frame: self._entity(frame) for frame in self.scene.frames}
        for frame, path in entities.items():
            if frame != GROUND_NAME:
                self.frames.move(path, self.scene.frames[frame])
        self._shapes()
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
        """Return the colour of a point of interest, of which those of its dot and path are made."""
        return self.colour or self.scene.colour(point)

    def _entity(self, frame: str) -> str:
        """Return the entity of a frame, such as 'bodies/crank' or 'cylinders/boom/rod'."""
        kind, dot, name = frame.partition(".")
        if frame == GROUND_NAME:
            return f"{self.root}/ground"
        if not dot:
            return f"{self.root}/bodies/{frame}"
        return f"{self.root}/{kind}s/{name.replace('.', '/')}"

    def _shapes(self) -> None:
        """Log the shapes but for loads and drivers; the link and the bars of a body are one entity."""
        strokes: dict[str, list[Painted]] = {}
        shapes = [shape for shape in self.scene.shapes if shape.frame in self.scene.frames and shape.kind != "pitch"]
        for one in strokes_of([shape for shape in shapes if not shape.is_effort], self.sizes):
            strokes.setdefault(self._place(one), []).append(one)
        for entity, painted in strokes.items():
            first = painted[0]
            label = first.shape.name if first.shape.kind in _NAMED else self._unlinked.pop(first.shape.frame, None)
            lines = [line for one in painted for line in self._lines(one)]
            order = first.stroke.order + self.scene.bodies.get(first.shape.frame, 0) / 100.0
            frames = self.ground if first.shape.frame == GROUND_NAME else self.frames
            frames.lines(entity, lines, order, label, shown=label in self.names)

    def _place(self, one: Painted) -> str:
        """Return the entity of a stroke; that of a link, a bar or a cylinder is the frame's own."""
        shape, own = one.shape, self._entity(one.shape.frame)
        if shape.frame == GROUND_NAME:
            return f"{own}/blocks" if shape.kind == "block" else own
        return own if shape.is_bar or shape.kind in _OWN else f"{own}/{shape.kind}/{shape.name}"

    def _lines(self, one: Painted) -> Iterator[RecordedLine]:
        """Yield the lines of a stroke: those that fill its area, then its own."""
        tinted = one._replace(shape=replace(one.shape, colour=self.colour)) if self.colour else one
        line, area = tinted.colours(is_dark=True)
        radius = 0.5 * self.sizes.width(one.stroke)
        if area and not self.layer:
            yield from filled(one.points, area, radius)
        yield RecordedLine(np.vstack([one.points, one.points[: int(one.is_closed)]]), radius, line)

    def _points(self, path: str, frame: str) -> None:
        """Log pins with the names of their joints, which show when pointed at, and points of interest."""
        pins, frames = self.scene.pins.get(frame, ()), self.ground if frame == GROUND_NAME else self.frames
        (pin,), (point,) = STROKES["pin"], STROKES["point"]
        if pins:
            names, at = zip(*pins, strict=True)
            radius, half = self.sizes.radius(pin), 0.5 * self.sizes.width(pin)
            for name, size, role in (("pins", radius + half, pin.line), ("pins/inside", radius - half, pin.fill)):
                colour = palette.tint(role, palette.INK, is_dark=True)
                texts = list(names) if name == "pins" else []
                order = pin.order + (name != "pins") / 2.0
                frames.points(f"{path}/{name}", np.array(at), size, colour, order, texts, shown=False)
        for name, place in self.scene.points.get(frame, ()):
            colour = palette.tint(point.fill, self._colour_of(name), is_dark=True)
            radius, shown = self.sizes.radius(point), self.colour is None
            frames.points(f"{path}/points/{name}", place[None], radius, colour, point.order, [name], shown)

    def _path(self, path: str, points: FloatArray, colour: palette.Colour) -> None:
        """Log the path of a point over the run, one line for each part between gaps."""
        import rerun as rr

        pieces = [piece.astype(np.float32) for piece in pieces_between_gaps(points)]
        if pieces:
            (path_,) = STROKES["path"]
            tinted = palette.tint(path_.line, colour, is_dark=True)
            radii = self._thin(0.5 * path_.width)
            line = rr.LineStrips2D(pieces, colors=[tinted], radii=radii, draw_order=self.layer + path_.order)
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
        look = rr.LineStrips2D.from_fields(radii=self._thin(2.4), colors=[colour], draw_order=self.layer + 26.0)
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


class RecordedLine(NamedTuple):
    """A line of a recording: points (k, 2) in its frame; radius [length], or a negative one [points of the screen]."""

    points: FloatArray
    radius: float
    colour: palette.Colour


def filled(points: FloatArray, colour: palette.Colour, radius: float) -> list[RecordedLine]:
    """Return lines along the longest side of an area (k, 2), which fill it: the viewer fills no areas.

    radius: of the line around the area, up to which the lines may reach beyond it.
    """
    sides = np.roll(points, -1, axis=0) - points
    along = sides[int(np.argmax(np.hypot(*sides.T)))]
    turn = np.array([along, [-along[1], along[0]]]) / max(float(np.hypot(*along)), 1e-300)
    a = points @ turn.T  # the side is along x
    b = np.roll(a, -1, axis=0)
    low, high = float(a[:, 1].min()), float(a[:, 1].max())
    count = int(np.clip(np.ceil((high - low) / (1.8 * radius)), 1, _MOST_LINES))
    found = []
    for y in low + (high - low) * (np.arange(count) + 0.5) / count:
        crossed = (a[:, 1] > y) != (b[:, 1] > y)
        (x_a, y_a), (x_b, y_b) = a[crossed].T, b[crossed].T
        xs = np.sort(x_a + (y - y_a) / (y_b - y_a) * (x_b - x_a)).reshape(-1, 2)
        found += [RecordedLine(np.column_stack([ends, [y, y]]) @ turn, radius, colour) for ends in xs]
    return found


class Frames:
    """The frames of one run, placed on a timeline.

    layer: added to the order of drawing; is_fixed: what is in them is there at all samples, as the ground is.
    """

    def __init__(
        self, rec: rr.RecordingStream, timeline: Timeline, run: Run, layer: float, *, is_fixed: bool = False
    ) -> None:
        self._rec, self._timeline, self._run, self._layer = rec, timeline, run, layer
        self._good = np.flatnonzero(run.good)
        self._always = is_fixed or 0 < len(self._good) == len(run.good)  # every sample holds numbers

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

    def lines(
        self, path: str, lines: Sequence[RecordedLine], order: float, label: str | None, *, shown: bool = False
    ) -> None:
        """Log lines that are fixed in their frame, from the first pose on; grey where the run has no numbers.

        Later lines cover earlier ones. label: their name, if they have one; shown: True if it is always shown.
        """
        import rerun as rr

        look = self._look([line.radius for line in lines], order, [label] if label else [], shown)
        strips, colours = [line.points.astype(np.float32) for line in lines], [line.colour for line in lines]
        if self._always:
            self._rec.log(path, rr.LineStrips2D(strips, colors=colours, **look), static=True)
        elif len(self._good):
            self._rec.log(path, rr.LineStrips2D.from_fields(**look), static=True)
            self._with_first_pose(path, rr.LineStrips2D.columns(strips=strips).partition([len(strips)]))
            switches = self.switches()
            both = [[palette.grey(colour) for colour in colours], colours]
            table = np.array(both, np.uint8)[self._run.good[switches].astype(int)]  # (switches, lines, 3)

            def columns(rows: slice) -> Any:
                chosen = table[rows]
                partition = [len(lines)] * len(chosen)
                return rr.LineStrips2D.columns(colors=chosen.reshape(-1, 3)).partition(partition)

            send(self._rec, path, self._timeline, self._run.t[switches], columns)

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

        look = {"colors": [colour], **self._look([radius], order, names, shown)}
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

    def _look(self, radii: Sequence[float], order: float, names: list[str], shown: bool) -> dict[str, Any]:
        """Return the style that lines and points have in common."""
        return {
            "radii": radii,
            "labels": names or None,
            "show_labels": shown if names else None,
            "draw_order": self._layer + order,
        }
