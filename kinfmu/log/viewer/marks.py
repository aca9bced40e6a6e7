"""What a recording shows around the moving bodies: names that are always shown, the ground, loads, arrows of forces."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import details, palette
from kinfmu.draw.scene.forces import Arrows
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene
from kinfmu.draw.scene.shape import Shape
from kinfmu.log.viewer.timeline import send
from kinfmu.mechanism.body import GROUND_NAME

if TYPE_CHECKING:
    import rerun as rr

    from kinfmu.log.viewer.linkage import Linkage


MARGIN = 0.12  # around the linkage, as a part of its size
_SUPPORT = 0.05  # height of a support, as a part of the size
_WIDTH, _HEIGHT = 600.0, 380.0  # [points] of the view on a usual screen, within its frame
_LETTER, _EDGE, _LINE = 6.5, 8.0, 17.0  # [points]; of a name: width of a letter, margin, height
_SAMPLES = 40  # poses that are compared
_OFTEN = 0.35  # of them; of two names that cover each other in more poses only one is shown
_GRAVITY = 0.07  # of the size: length of the arrow of gravity
MOST_NAMES = 12  # more names would hide the linkage; they show when pointed at
FORCES = ("force", "force_along", "force_between")  # kinds that the arrows of a run show to scale
_LOAD_ORDER = 28.0  # above cylinders, below pins
_LOAD_RADIUS = 0.9  # of lines [points of the screen]
_JOINT = (185, 28, 28)
_ARROW_ORDER = 50.0  # above the linkage
_PLACES, _LOWEST_PART = 9, 0.2  # places of the legend; part of the size above the lowest point, in which names matter
_ARROW_RADIUS = 0.004  # as a part of the scene's size, however thin its links are


def detail(scene: Scene) -> float:
    """Return the size of details of a recording [length]."""
    return _SUPPORT * scene.stroke / details.SUPPORT


def dots(scene: Scene) -> float:
    """Return the points of the screen per unit of length, where the view shows the whole linkage."""
    width, height = np.maximum(scene.high - scene.low, 1e-9 * scene.size)
    return float(min(_WIDTH / width, _HEIGHT / height))


def places_below(scene: Scene) -> FloatArray:
    """Return the places of the names of supports, (k, 2): below each, or lower where another name would cover it."""
    depth = 1.7 * _SUPPORT * scene.stroke
    line, placed = _LINE / dots(scene), list[FloatArray]()
    for at in scene.supports.values():
        here = at - np.array([0.0, depth])
        while any(_covers(scene, here[None], a[None], b, c).any() for a, b, c in _pairs(scene, placed)):
            here = here - [0.0, line]
        placed.append(here)
    return np.array(placed).reshape(-1, 2)


def _pairs(scene: Scene, placed: Sequence[FloatArray]) -> list[tuple[FloatArray, str, str]]:
    """Return the supports' names that are placed, each with the name of the next one."""
    names = list(scene.supports)
    return [(at, names[len(placed)], name) for at, name in zip(placed, names, strict=False)]


def shown_names(scene: Scene) -> frozenset[str]:
    """Return the bodies and bars whose names are always shown; supports and points of interest have precedence."""
    count = max((len(pose) for pose in scene.frames.values()), default=0)
    rows = np.unique(np.linspace(0, max(count - 1, 0), _SAMPLES).astype(int)) if count else np.zeros(0, int)
    taken = [(name, path[rows]) for name, path in scene.paths.items()]
    taken += [(name, np.tile(at, (len(rows), 1))) for name, at in zip(scene.supports, places_below(scene), strict=True)]
    found = []
    middles = [
        (shape.name, world(scene.frames[shape.frame][rows], _middle(shape)))
        for shape in scene.shapes
        if shape.kind in ("link", "bar")
    ]
    for name, track in middles:
        covered = [_covers(scene, track, other, name, text) for text, other in taken]
        if all(overlap.sum() <= _OFTEN * len(rows) for overlap in covered):
            taken.append((name, track))
            found.append(name)
    return frozenset(found)


def _middle(shape: Shape) -> tuple[float, float]:
    """Return where the viewer puts the name of a line."""
    x, y = shape.line.mean(axis=0)
    return float(x), float(y)


def _covers(scene: Scene, a: FloatArray, b: FloatArray, first: str, second: str) -> FloatArray:
    """Return where two names at (n, 2) cover each other, (n,) of 1.0 or 0.0; 0.0 in gaps."""
    apart = np.abs(a - b) * dots(scene)
    width = 0.5 * _LETTER * (len(first) + len(second)) + _EDGE
    return np.asarray((apart[:, 0] < width) & (apart[:, 1] < _LINE), float)


def log_ground(rec: rr.RecordingStream, root: str, scene: Scene, pin: float) -> None:
    """Log everything that is fixed under the entity `root`.

    pin: radius of the pins [length].
    """
    import rerun as rr

    size = detail(scene)
    shapes = [
        shape for shape in scene.shapes if shape.frame == GROUND_NAME and shape.kind != "contact" and not shape.strips
    ]
    strips: list[FloatArray] = []
    for shape in shapes:
        if shape.kind == "support":
            triangle, line = details.support(shape, size)
            strips += [np.vstack([triangle, triangle[:1]]), line, *details.hatching(line, shape.towards, size)]
        elif shape.kind in ("rail", "bed"):
            line = details.rail(shape, size)
            strips += [line, *details.hatching(line, shape.towards, size)]
        elif shape.kind != "block":
            strips.append(shape.line)
    if strips:
        lines = rr.LineStrips2D(strips, colors=[palette.GROUND], radii=rr.Radius.ui_points(0.9), draw_order=0.0)
        rec.log(f"{root}/ground", lines, static=True)
    blocks = [shape for shape in shapes if shape.kind == "block"]
    if blocks:
        bushes = rr.LineStrips2D(
            [details.core(shape, size) for shape in blocks],
            colors=[palette.GROUND],
            radii=[details.BLOCK_WIDTH * size],
            labels=[shape.name for shape in blocks],
            show_labels=False,
            draw_order=1.0,
        )
        rec.log(f"{root}/ground/blocks", bushes, static=True)
    names = list(scene.supports)
    if names:
        labels = rr.Points2D(
            places_below(scene),
            labels=names,
            colors=[palette.GROUND],
            radii=[0.0],
            show_labels=len(names) <= MOST_NAMES,
        )
        rec.log(f"{root}/ground/names", labels, static=True)
    if scene.gravity is not None:
        _log_gravity(rec, f"{root}/ground/gravity", scene, scene.gravity)
    if GROUND_NAME in scene.pins:
        names, at = map(list, zip(*scene.pins[GROUND_NAME], strict=True))
        pins = rr.Points2D(at, labels=names, colors=[palette.PIN], radii=[pin], show_labels=False, draw_order=30.0)
        rec.log(f"{root}/ground/pins", pins, static=True)


def _log_gravity(rec: rr.RecordingStream, entity: str, scene: Scene, along: FloatArray) -> None:
    """Log an arrow along gravity in the upper left margin, which the linkage never enters, with a name behind it."""
    import rerun as rr

    middle = np.array([scene.low[0] - _GRAVITY * scene.size, scene.high[1]])
    arrow = _GRAVITY * scene.size * along
    look: dict[str, Any] = {"colors": [palette.GROUND]}
    lines = rr.Arrows2D(vectors=[arrow], origins=[middle - 0.5 * arrow], radii=rr.Radius.ui_points(1.8), **look)
    rec.log(entity, lines, static=True)
    name = rr.Points2D([middle - 1.3 * arrow], labels=["g"], radii=[0.0], show_labels=True, **look)
    rec.log(f"{entity}/name", name, static=True)


class _Part(NamedTuple):
    """Lines of a symbol that move together: pose (n, 3), stretch along it (n,), lines (k, 2) in this frame."""

    name: str
    pose: FloatArray
    stretch: FloatArray
    lines: list[FloatArray]


def log_loads(linkage: Linkage, with_arrow: Collection[str] = ()) -> None:
    """Log the symbols of loads; those of forces only if they are not among the names of loads `with_arrow`."""
    import rerun as rr

    for load in linkage.scene.shapes:
        if not load.strips or (load.kind in FORCES and load.name in with_arrow):
            continue
        for part in _parts(load, linkage):
            entity = f"{linkage.root}/loads/{load.name}/{part.name}"
            linkage.frames.move(entity, part.pose, part.stretch)
            linkage.frames.lines(
                entity,
                part.lines,
                rr.Radius.ui_points(_LOAD_RADIUS),
                linkage.colour or palette.LOAD_ON_DARK,
                _LOAD_ORDER,
                load.name,
            )


def _parts(load: Shape, linkage: Linkage) -> Iterator[_Part]:
    """Yield the parts at the first point, at the second one, and what is stretched between them."""
    first, angle, distance = load.ends(linkage.scene.frames)
    second = first + distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    keeps = np.ones(len(angle))
    poses = {"first": (first, 0.0, keeps), "last": (second, 1.0, keeps), "between": (first, np.nan, distance)}
    found: dict[str, list[FloatArray]] = {}
    for strip in load.strips:
        part, length, along, across = strip.points.T
        (name,) = [key for key, (_, end, _) in poses.items() if (part == end).all()] or ["between"]
        ahead = part if name == "between" else length + linkage.detail * along
        line = np.column_stack([ahead, linkage.detail * across])
        found.setdefault(name, []).append(np.vstack([line, line[:1]]) if strip.is_area else line)
    for name, lines in found.items():
        at, _, stretch = poses[name]
        yield _Part(name, np.column_stack([at, angle]), stretch, lines)


def legend_start(scene: Scene, length: float) -> float:
    """Return x where the arrow of the legend begins: below the linkage, off the names of supports there.

    Of some places from left to right it is the one whose middle is furthest from them; the first one of equal ones.
    """
    low, high = scene.low, scene.high
    deepest = low[1] + _LOWEST_PART * scene.size
    below = np.array([at[0] for at in scene.supports.values() if at[1] < deepest])
    starts = np.linspace(low[0], max(float(high[0]) - length, float(low[0])), _PLACES)
    apart = np.abs(starts[:, None] + 0.5 * length - below).min(axis=1, initial=length)  # further away is as good
    return float(starts[int(np.argmax(np.round(apart / scene.size, 6)))])


def log_arrows(linkage: Linkage, found: Arrows | None) -> frozenset[str]:
    """Log the forces of joints and loads, as the scene scales them, and return the names of these loads.

    Samples without numbers have no arrows.
    """
    import rerun as rr

    run, scene, path = linkage.run, linkage.scene, f"{linkage.root}/forces"
    if found is None:
        return frozenset()
    look: dict[str, Any] = {
        "radii": [_ARROW_RADIUS * max(linkage.size, scene.size)],
        "draw_order": linkage.layer + _ARROW_ORDER,
    }
    for name, along in found.along.items():
        kind, _, label = name.partition(".")
        entity, colour = f"{path}/{kind}/{label}", palette.LOAD_ON_DARK if kind == "loads" else _JOINT
        known = np.asarray(np.isfinite(along + found.at[name]).all(axis=1))
        linkage.rec.log(
            entity, rr.Arrows2D.from_fields(**look, colors=[colour], labels=[label], show_labels=False), static=True
        )
        tails, vectors = found.at[name].astype(np.float32), along.astype(np.float32)

        def columns(
            rows: slice, known: Any = known, tails: Any = tails, vectors: Any = vectors
        ) -> Iterable[rr.ComponentColumn]:
            chosen = known[rows]
            columns = rr.Arrows2D.columns(origins=tails[rows][chosen], vectors=vectors[rows][chosen])
            return columns.partition(chosen.astype(int))

        send(linkage.rec, entity, linkage.timeline, run.t, columns)
    corner = [legend_start(scene, found.length), float(scene.low[1] - 0.6 * MARGIN * scene.size)]
    linkage.rec.log(
        f"{path}/legend",
        rr.Arrows2D(
            origins=[corner],
            vectors=[[found.length, 0.0]],
            labels=[found.legend],
            show_labels=True,
            colors=[_JOINT],
            **look,
        ),
        static=True,
    )
    return frozenset(name.removeprefix("loads.") for name in found.along if name.startswith("loads."))
