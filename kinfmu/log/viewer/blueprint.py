"""Layout of a recording on the screen: linkage and card on the left, tabs of motion and solver on the right."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from kinfmu.arrays import finite
from kinfmu.draw.scene.forces import Arrows, arrows
from kinfmu.draw.scene.scene import Scene
from kinfmu.log.viewer.linkage import trail_path, trail_time, view_box
from kinfmu.log.viewer.series import KINDS, ORDERS, Group
from kinfmu.log.viewer.timeline import Timeline
from kinfmu.run import Run
from kinfmu.run.verdict import notable_events

if TYPE_CHECKING:
    import rerun.blueprint as rrb

Corner = Literal["RightTop", "LeftTop", "RightBottom", "LeftBottom"]
SHORTEST_SHOW, LONGEST_SHOW = 5.0, 30.0  # [s], limits of the time to play the whole run
SWEEP_SHOW = 10.0  # [s] to play a run that has no time
EDGE = 0.01  # of the run's time, left free before and after the curves
AFTER = 0.13  # of the run's time, left free after them for half of the label of a tick such as +100 ms at the end
LEGEND_EDGE, LETTER = 34.0, 7.0  # [points]; width of a legend around its names, and of a letter
LEGEND_EDGE_Y, LEGEND_LINE = 14.0, 23.0  # [points]; height of a legend around its names, and of one
MOST_LEGEND = 0.5  # of the height of a plot, that is made free for a legend
LONGER = 1.1  # times the range of curves and legend, of an axis that leaves enough of it to the curves
ABREAST = 3  # most plots of efforts and signals in a row
FEW = 4  # plots of two runs, up to which they are wide
WIDTH, HEIGHT = 870.0, 820.0  # [points], of all plots and states on a usual screen
NUMBERS, CAPTION = 65.0, 44.0  # [points] of a plot: width of the numbers of y, height of the title and of those of x
EDGE_Y = 0.1  # of the distance of labels, by which an axis ends beyond a label
CUT_OFF = 3.0  # [points]; of a label nearer to the end of an axis almost half is missing
FREE_Y = 0.025  # of the length of an axis, left free below and above its curves
LABELLED = 21.0  # [points]; Rerun labels the multiples of that power of ten whose distance is at least this, in grey
STATUS, LANES = 0.13, 0.17  # of the height of the right side, for the states of one run and of two
LOG = 0.25  # of this height


@dataclass(frozen=True, eq=False)
class Drawn:
    """A linkage of a recording: title of its view, root entity, its run, and what is drawn of it, if anything."""

    title: str
    root: str
    run: Run
    scene: Scene | None

    @cached_property
    def arrows(self) -> Arrows | None:
        """The arrows of its forces, None without any."""
        run = self.run
        has_forces = bool(run.reaction_names or run.force_names)
        return arrows(run, run.mechanism, self.scene) if has_forces and self.scene and run.mechanism else None


def single(
    timeline: Timeline,
    run: Run,
    drawn: Sequence[Drawn],
    curves: Mapping[tuple[str, str], Group],
    forces: Sequence[Group],
    solver: Sequence[Group],
    *,
    is_dataset: bool = False,
) -> rrb.Blueprint:
    """Return the layout of one run, or of each in a dataset: linkages on the left, in views of their own; plots right.

    The tab 'motion' has one row per order, with one column per unit, and efforts, energies and signals below; curves
    that are all constant have no plot. The tab 'solver' has states, log and diagnostics; it is the one in front if a
    sample is not ok. Of a dataset 'motion' is in front, and the list of its recordings is open.
    """
    import rerun.blueprint as rrb

    rows = _rows([_alone(curves.get((order, kind))) for kind in KINDS] for order in ORDERS)
    rows += _abreast(_known(map(_alone, forces)))
    has_motion = bool(run.outputs) or any(one.scene for one in drawn)
    tabs = [_stacked(rows, timeline, [run], name="motion")] if rows else []
    if has_motion or solver:
        has_log = is_dataset or bool(notable_events(run))
        tabs.append(_solver_tab(_abreast(_known(map(_alone, solver)), 2), timeline, run, has_log=has_log))
    right = rrb.Tabs(*tabs, active_tab=0 if rows and (is_dataset or is_ok(run)) else len(tabs) - 1)
    linked = [linkage_view([one.root], timeline, [one.run], [one.scene], one.title, one.arrows) for one in drawn]
    linkages = (linked[0] if len(linked) == 1 else rrb.Grid(*linked)) if has_motion and linked else None
    left = _left(linkages)
    content = rrb.Horizontal(left, right, column_shares=[1, 1.25])
    return arranged(content, timeline, [run], is_dataset=is_dataset)


def compared(
    timeline: Timeline,
    runs: tuple[Run, Run],
    scenes: Sequence[Scene | None],
    curves: Sequence[Mapping[tuple[str, str], Group]],
    difference: Mapping[tuple[str, str], Group],
    loads: Sequence[Mapping[str, Group]],
    loaded: Sequence[Group],
) -> rrb.Blueprint:
    """Return the layout of two runs: curves overlaid, and below the differences of what they have in common.

    loads: efforts, energies, reactions and signals of both runs; loaded: their differences that are visible.
    """
    import rerun.blueprint as rrb

    overlaid = [[_of_both((order, kind), curves) for kind in KINDS] for order in ORDERS]
    of_loads = [_of_both(path, loads) for path in dict.fromkeys([*loads[0], *loads[1]])]
    both = _rows(overlaid) + _abreast(_known(of_loads))
    moved = [[_apart(difference.get((order, kind))) for kind in KINDS] for order in ORDERS]
    most = 2 if len(loaded) <= FEW else ABREAST  # titles of comparisons are long
    forces = _abreast(_known([_of_both(group.path, loads) for group in loaded]), most)
    forces += _abreast(_known(map(_apart, loaded)), most)
    tabs = {"B - A": _rows(overlaid)[:1] + _rows(moved) if difference else forces}
    tabs |= {"B - A of forces": forces if difference else [], "A and B": both}
    shown = [(name, rows) for name, rows in tabs.items() if rows] or [("A and B", both)]
    stacks = [
        _stacked(rows, timeline, runs, ["/a", "/b"] if k == 0 else [], name) for k, (name, rows) in enumerate(shown)
    ]
    left = _left(linkage_view(["/a/linkage", "/b/linkage"], timeline, runs, scenes), ["/a", "/b"], runs)
    right = rrb.Tabs(*stacks) if len(stacks) > 1 else stacks[0]
    return arranged(rrb.Horizontal(left, right, column_shares=[1, 1.25]), timeline, runs)


class Plot(NamedTuple):
    """A plot of curves: its title, and its groups with their root entities."""

    title: str
    groups: Sequence[tuple[str, Group]]


def is_ok(run: Run) -> bool:
    """Return True if every sample has status 'ok'."""
    return not run.status.any()


def _alone(group: Group | None) -> Plot | None:
    """Return a plot of a group of the only run, if there is one that moves."""
    return Plot(group.title, [("", group)]) if group and not group.is_constant else None


def _of_both(key: Any, found: Sequence[Mapping[Any, Group]]) -> Plot | None:
    """Return a plot of a group of both runs; None if neither has it, or it moves in neither."""
    pair = [(root, of[key]) for root, of in zip(("/a", "/b"), found, strict=True) if key in of]
    moves = not all(group.is_constant for _, group in pair)
    return Plot(f"{pair[0][1].title} of A (wide) and B", pair) if moves else None


def _apart(group: Group | None) -> Plot | None:
    """Return a plot of a difference, if there is one."""
    return Plot(f"B - A: {group.title}", [("/difference", group)]) if group else None


def _known(plots: Iterable[Plot | None]) -> list[Plot]:
    return [one for one in plots if one]


def _rows(rows: Iterable[Iterable[Plot | None]]) -> list[list[Plot]]:
    """Return the rows that hold plots."""
    return [found for row in rows if (found := _known(row))]


def _abreast(plots: Sequence[Plot], most: int = ABREAST) -> list[list[Plot]]:
    """Return rows of at most so many plots, of about the same length."""
    abreast = -(-len(plots) // -(-len(plots) // most)) if plots else 1
    return [list(plots[k : k + abreast]) for k in range(0, len(plots), abreast)]


def _stacked(
    rows: Sequence[Sequence[Plot]],
    timeline: Timeline,
    runs: Sequence[Run],
    roots: Sequence[str] = (),
    name: str | None = None,
) -> rrb.Container:
    """Return rows of plots of one height, and below them the states of the runs with these roots."""
    import rerun.blueprint as rrb

    lanes = LANES if roots else 0.0
    views = _plots(rows, timeline, runs, HEIGHT * (1.0 - lanes))
    shares = [1.0] * len(rows)
    if roots:
        views.append(status_view(roots, timeline, runs))
        shares.append(lanes / (1.0 - lanes) * len(rows) or 1.0)
    return rrb.Vertical(*views, row_shares=shares, name=name)


def _plots(
    rows: Sequence[Sequence[Plot]], timeline: Timeline, runs: Sequence[Run], height: float
) -> list[rrb.Container | rrb.View]:
    """Return rows of plots that share a height [points]."""
    import rerun.blueprint as rrb

    each = height / max(len(rows), 1)
    return [rrb.Horizontal(*[plot(*one, timeline, runs, WIDTH / len(row), each) for one in row]) for row in rows]


def _solver_tab(rows: Sequence[Sequence[Plot]], timeline: Timeline, run: Run, *, has_log: bool) -> rrb.Container:
    """Return the states of the solver, the log, and its diagnostics."""
    import rerun.blueprint as rrb

    above: list[rrb.Container | rrb.View] = [status_view([""], timeline, [run])]
    shares = [STATUS]
    if has_log:
        above.append(log_view([""]))
        shares.append(LOG)
    free = 1.0 - sum(shares)
    views = [*above, *_plots(rows, timeline, [run], HEIGHT * free)]
    return rrb.Vertical(*views, row_shares=[*shares, *[free / max(len(rows), 1)] * len(rows)], name="solver")


def _left(
    linkage: rrb.View | rrb.Container | None, roots: Sequence[str] = (), runs: Sequence[Run] = ()
) -> rrb.Container:
    """Return the left side: linkage, if there is one, card, and the log of two runs if there are events.

    The log does not wrap its texts, so it gets the full width; the card wraps them.
    """
    import rerun.blueprint as rrb

    log = [log_view(roots)] if any(notable_events(run) for run in runs) else []
    if linkage is None:
        return rrb.Vertical(card_view(), *log)
    return rrb.Vertical(linkage, card_view(), *log, row_shares=[1.5, 0.9, 0.6] if log else [1.7, 1.0])


def arranged(
    content: rrb.Container, timeline: Timeline, runs: Sequence[Run], *, is_dataset: bool = False
) -> rrb.Blueprint:
    """Return the blueprint of the content, with Rerun's own panels collapsed but for the list of a dataset, to play."""
    import rerun.blueprint as rrb

    length = max((float(run.t.max() - run.t.min()) for run in runs if len(run)), default=0.0)
    show = min(max(length, SHORTEST_SHOW), LONGEST_SHOW) if timeline.parts is None else SWEEP_SHOW
    speed = float(f"{length / show:.2g}") or 1.0
    return rrb.Blueprint(
        content,
        rrb.TimePanel(
            timeline=timeline.name,
            state="collapsed",
            play_state="paused",
            loop_mode="all",
            playback_speed=speed if timeline.parts is None else None,
            fps=speed if timeline.parts else None,
        ),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="expanded" if is_dataset else "collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def time_axis(timeline: Timeline, runs: Sequence[Run]) -> rrb.TimeAxis:
    """Return the axis of all plots, over the whole runs; Rerun's default is half a minute around the cursor."""
    import rerun as rr
    import rerun.blueprint as rrb

    start = min((float(run.t.min()) for run in runs if len(run)), default=0.0)
    stop = max((float(run.t.max()) for run in runs if len(run)), default=0.0)
    length = stop - start or 1.0
    boundary = rr.encodings.TimeRangeBoundary.absolute
    first, last = timeline.number(start - EDGE * length), timeline.number(stop + AFTER * length)
    shown = rr.TimeRange(start=boundary(**first), end=boundary(**last))
    return rrb.TimeAxis(view_range=shown)


def plot(
    title: str,
    groups: Sequence[tuple[str, Group]],
    timeline: Timeline,
    runs: Sequence[Run],
    width: float = WIDTH / 2,
    height: float = HEIGHT / 4,
) -> rrb.TimeSeriesView:
    """Return a plot of curves, with a legend in a corner where it hides none of them, or above them.

    Without a legend is a single curve, and a plot of which it would take too large a part. groups: (root entity,
    group); width, height: of the plot [points].
    """
    import rerun.blueprint as rrb

    ranges = [group.extent for _, group in groups if group.extent]
    low, high = min((low for low, _ in ranges), default=0.0), max((high for _, high in ranges), default=0.0)
    shown = with_two_labels(low, high, height - CAPTION) if ranges else None
    found = [group for _, group in groups]
    corner = free_corner(found, runs, shown, width - NUMBERS, height - CAPTION)
    wide, part = legend_size(found, width - NUMBERS, height - CAPTION)
    if corner is None and shown and wide <= 1.0 and part <= MOST_LEGEND:
        longer = with_two_labels(low, low + (high - low) / (1.0 - part), height - CAPTION)
        if (longer[1] - longer[0]) * (1.0 - part) <= LONGER * (high - low):  # it has its labels without being longer
            shown, corner = longer, "RightTop"
    return rrb.TimeSeriesView(
        name=title,
        origin="/",
        contents=[f"{root}/{group.path}" for root, group in groups],
        axis_x=time_axis(timeline, runs),
        axis_y=rrb.ScalarAxis(range=shown) if shown else None,
        plot_legend=rrb.PlotLegend(corner=corner or "RightTop", visible=corner is not None),
    )


CORNERS: tuple[Corner, ...] = ("RightTop", "LeftTop", "RightBottom", "LeftBottom")


def legend_size(groups: Sequence[Group], width: float, height: float) -> tuple[float, float]:
    """Return width and height of a legend as parts of those of a plot; more than all of it for a single curve."""
    names = [name for group in groups for name in group.names]
    if len(names) < 2:
        return math.inf, math.inf
    wide = (LEGEND_EDGE + LETTER * max(map(len, names))) / width
    return wide, (LEGEND_EDGE_Y + LEGEND_LINE * len(names)) / height


def free_corner(
    groups: Sequence[Group], runs: Sequence[Run], shown: tuple[float, float] | None, width: float, height: float
) -> Corner | None:
    """Return the corner of a plot in which a legend hides no curve; None without one, and for a single curve.

    shown: range of the values, None for that of the curves; width, height: of the plot without its numbers [points].
    """
    wide, high = legend_size(groups, width, height)
    if wide > 1.0 or high > 1.0:
        return None
    times = [run.t for run in runs if len(run)] or [np.zeros(1)]
    start, stop = min(float(t.min()) for t in times), max(float(t.max()) for t in times)
    begin, length = start - EDGE * (stop - start), (1.0 + EDGE + AFTER) * (stop - start) or 1.0
    known = np.concatenate([finite(group.values) for group in groups])
    low, top = shown or ((float(known.min()), float(known.max())) if len(known) else (0.0, 1.0))
    boxes = {corner: (corner.startswith("Right"), corner.endswith("Top")) for corner in CORNERS}
    for group in groups:
        count = len(group.values)
        t = next((t for t in times if count % len(t) == 0), np.linspace(start, stop, count))
        x = (np.resize(t, count) - begin) / length  # of a dataset the values of all runs are below each other
        y = (group.values - low) / (top - low or 1.0)
        for corner, (is_right, is_top) in list(boxes.items()):
            rows = (x >= 1.0 - wide) if is_right else (x <= wide)
            inside = y[rows] >= 1.0 - high if is_top else y[rows] <= high
            if inside.any():
                del boxes[corner]
    return next(iter(boxes), None)


def with_two_labels(low: float, high: float, height: float) -> tuple[float, float]:
    """Return a range of y with at least two labels on an axis of this height [points]: one alone, 0, states no scale.

    The range leaves a margin on both sides, and ends beyond a label if it holds less than two.
    """
    margin = FREE_Y * (high - low)
    bottom, top = low - margin, high + margin
    step = 10.0 ** math.ceil(math.log10(LABELLED * (top - bottom) / max(height, LABELLED)))
    cut = CUT_OFF * (top - bottom) / max(height, LABELLED)
    first, last = math.ceil((bottom + cut) / step), math.floor((top - cut) / step)
    if last > first:
        return bottom, top
    below, above = (first - 1) * step, (last + 1) * step
    if last == first:  # one label more, on the nearer side
        is_nearer_above = above - top < bottom - below
        below, above = (first * step, above) if is_nearer_above else (below, last * step)
    bottom, top = min(bottom, below - EDGE_Y * step), max(top, above + EDGE_Y * step)
    margin = FREE_Y * (top - bottom)
    return min(bottom, low - margin), max(top, high + margin)


def linkage_view(
    roots: Sequence[str],
    timeline: Timeline,
    runs: Sequence[Run],
    scenes: Sequence[Scene | None],
    title: str = "linkage",
    forces: Arrows | None = None,
) -> rrb.Spatial2DView:
    """Return the view of the linkages with trails; its origin is the root, so that the flip of the plane applies."""
    import rerun as rr
    import rerun.blueprint as rrb

    drawn = [(root, run, scene) for root, run, scene in zip(roots, runs, scenes, strict=True) if scene]
    boxes = [view_box(scene, forces) for _, _, scene in drawn]
    bounds = None
    if boxes:
        x = (min(box[0][0] for box in boxes), max(box[0][1] for box in boxes))
        y = (min(box[1][0] for box in boxes), max(box[1][1] for box in boxes))
        bounds = rrb.VisualBounds2D(x_range=x, y_range=y)
    relative = rr.encodings.TimeRangeBoundary.cursor_relative
    trails: dict[Any, Any] = {}
    for root, run, scene in drawn:
        for point in scene.paths:
            back = relative(**timeline.number(-trail_time(run, scene, point)))
            ranges = rrb.VisibleTimeRange(timeline.name, start=back, end=relative(**timeline.number(0.0)))
            trails[trail_path(root, point)] = rrb.VisibleTimeRanges([ranges])
    contents = [f"{root}/**" for root in roots]
    return rrb.Spatial2DView(name=title, origin="/", contents=contents, visual_bounds=bounds, overrides=trails)


def card_view() -> rrb.TextDocumentView:
    """Return the view of the card."""
    import rerun.blueprint as rrb

    return rrb.TextDocumentView(name="run", origin="/card")


def status_view(roots: Sequence[str], timeline: Timeline, runs: Sequence[Run]) -> rrb.StateTimelineView:
    """Return the view of the solver's states, one lane for each run."""
    import rerun.blueprint as rrb

    contents = [f"{root}/solver/status" for root in roots]
    name = "solver status" if timeline.parts is None else f"solver status over {timeline.name}"
    return rrb.StateTimelineView(name=name, origin="/", contents=contents, time_view=time_axis(timeline, runs))


def log_view(roots: Sequence[str]) -> rrb.TextLogView:
    """Return the view of the log."""
    import rerun.blueprint as rrb

    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    if len(roots) > 1:
        columns = rrb.TextLogColumns(text_log_columns=["EntityPath", "LogLevel", "Body"])
    return rrb.TextLogView(name="log", origin="/", contents=[f"{root}/log" for root in roots], columns=columns)
