"""Layout of a recording on the screen: linkage, card and log on the left, plots on the right."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from kinfmu.draw.scene.forces import Arrows, arrows
from kinfmu.draw.scene.scene import Scene
from kinfmu.log.viewer.linkage import trail_path, trail_time, view_box
from kinfmu.log.viewer.series import KINDS, ORDERS, Group
from kinfmu.log.viewer.timeline import Timeline
from kinfmu.run import Run
from kinfmu.run.verdict import notable_events

if TYPE_CHECKING:
    import rerun.blueprint as rrb

SHORTEST_SHOW, LONGEST_SHOW = 5.0, 30.0  # [s], limits of the time to play the whole run
SWEEP_SHOW = 10.0  # [s] to play a run that has no time
EDGE = 0.01  # of the run's time, left free before and after the curves
LABEL = 31.0  # [points], half of the label of a tick such as +100 ms; most runs end at a tick
LEGEND_EDGE, LETTER = 34.0, 7.0  # [points]; width of a legend around its names, and of a letter
ABREAST = 4  # most plots of efforts and signals in a row
FEW = 4  # plots of two runs, up to which they are wide
WIDTH, HEIGHT = 870.0, 820.0  # [points], of all plots and states on a usual screen
NUMBERS, CAPTION = 65.0, 44.0  # [points] of a plot: width of the numbers of y, height of the title and of those of x
EDGE_Y = 0.1  # of the distance of labels, by which an axis ends beyond a label
CUT_OFF = 3.0  # [points]; of a label nearer to the end of an axis almost half is missing
FREE_Y = 0.025  # of the length of an axis, left free below and above its curves
LABELLED = 21.0  # [points]; Rerun labels the multiples of that power of ten whose distance is at least this, in grey
STATUS, LANES = 0.13, 0.17  # of the height of the right side, for the states of one run and of two
LEAST_LEGEND, MOST_LEGEND = 0.15, 0.8  # of the run's time, left free after the curves for the legend


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
) -> rrb.Blueprint:
    """Return the layout of one run: linkages on the left, each in a view of its own; plots on the right.

    There is one row per order, with one column per unit. Efforts, energies and signals, then the solver's diagnostics
    are below the curves.
    """
    import rerun.blueprint as rrb

    rows = _rows([_alone(curves.get((order, kind))) for kind in KINDS] for order in ORDERS)
    rows += _abreast(_known(map(_alone, forces)))
    shares = [2.0] * len(rows)
    if solver:
        rows.append(_known(map(_alone, solver)))
        shares.append(1.5)
    has_motion = bool(run.outputs) or any(one.scene for one in drawn)
    right = _stacked(rows, shares, timeline, [run], [""] if has_motion else [])
    linked = [linkage_view([one.root], timeline, [one.run], [one.scene], one.title, one.arrows) for one in drawn]
    linkages = (linked[0] if len(linked) == 1 else rrb.Grid(*linked)) if has_motion and linked else None
    left = _left(linkages, [""], [run])
    return arranged(rrb.Horizontal(left, right, column_shares=[1, 1.25]), timeline, [run])


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
    both = _rows(overlaid) + _abreast(_known(of_loads), ABREAST - 1)
    moved = [[_apart(difference.get((order, kind))) for kind in KINDS] for order in ORDERS]
    most = 2 if len(loaded) <= FEW else ABREAST - 1  # titles of comparisons are long
    forces = _abreast(_known([_of_both(group.path, loads) for group in loaded]), most)
    forces += _abreast(_known(map(_apart, loaded)), most)
    tabs = {"B - A": _rows(overlaid)[:1] + _rows(moved) if difference else forces}
    tabs |= {"B - A of forces": forces if difference else [], "A and B": both}
    shown = [(name, rows) for name, rows in tabs.items() if rows] or [("A and B", both)]
    stacks = [
        _stacked(rows, [2.0] * len(rows), timeline, runs, ["/a", "/b"] if k == 0 else [], name)
        for k, (name, rows) in enumerate(shown)
    ]
    left = _left(linkage_view(["/a/linkage", "/b/linkage"], timeline, runs, scenes), ["/a", "/b"], runs)
    right = rrb.Tabs(*stacks) if len(stacks) > 1 else stacks[0]
    return arranged(rrb.Horizontal(left, right, column_shares=[1, 1.25]), timeline, runs)


class Plot(NamedTuple):
    """A plot of curves: its title, and its groups with their root entities."""

    title: str
    groups: Sequence[tuple[str, Group]]


def _alone(group: Group | None) -> Plot | None:
    """Return a plot of a group of the only run, if there is one."""
    return Plot(group.title, [("", group)]) if group else None


def _of_both(key: Any, found: Sequence[Mapping[Any, Group]]) -> Plot | None:
    """Return a plot of a group of both runs; None if neither has it."""
    pair = [(root, of[key]) for root, of in zip(("/a", "/b"), found, strict=True) if key in of]
    return Plot(f"{pair[0][1].title} of A (wide) and B", pair) if pair else None


def _apart(group: Group | None) -> Plot | None:
    """Return a plot of a difference, if there is one."""
    return Plot(f"B - A: {group.title}", [("/difference", group)]) if group else None


def _known(plots: Iterable[Plot | None]) -> list[Plot]:
    return [one for one in plots if one]


def _rows(rows: Iterable[Iterable[Plot | None]]) -> list[list[Plot]]:
    """Return the rows that hold plots."""
    return [found for row in rows if (found := _known(row))]


def _abreast(plots: Sequence[Plot], most: int = ABREAST) -> list[list[Plot]]:
    """Return rows of at most so many plots, of about the same length, and of fewer where legends would hide curves."""
    fitting = [k for k in range(1, most + 1) if all(_legend_part(plot, WIDTH / k) < MOST_LEGEND for plot in plots)]
    most = max(fitting, default=1)
    abreast = -(-len(plots) // -(-len(plots) // most)) if plots else 1
    return [list(plots[k : k + abreast]) for k in range(0, len(plots), abreast)]


def _stacked(
    rows: Sequence[Sequence[Plot]],
    shares: Sequence[float],
    timeline: Timeline,
    runs: Sequence[Run],
    roots: Sequence[str],
    name: str | None = None,
) -> rrb.Container:
    """Return rows of plots, with these shares of the height, and below them the states of the runs with these roots."""
    import rerun.blueprint as rrb

    lanes = (0.0, STATUS, LANES)[len(roots)]
    height = HEIGHT * (1.0 - lanes) / (sum(shares) or 1.0)
    views: list[rrb.Container | rrb.View] = [
        rrb.Horizontal(*[plot(*one, timeline, runs, WIDTH / len(row), share * height) for one in row])
        for row, share in zip(rows, shares, strict=True)
    ]
    if roots:
        views.append(status_view(roots, timeline, runs))
        shares = [*shares, lanes / (1.0 - lanes) * sum(shares) or 1.0]
    return rrb.Vertical(*views, row_shares=list(shares), name=name)


def _left(linkage: rrb.View | rrb.Container | None, roots: Sequence[str], runs: Sequence[Run]) -> rrb.Container:
    """Return the left side: linkage, if there is one, card, and the log if there are events.

    The log does not wrap its texts, so it gets the full width; the card wraps them.
    """
    import rerun.blueprint as rrb

    if linkage is None:
        views = [card_view(), *([log_view(roots)] if any(notable_events(run) for run in runs) else [])]
        return rrb.Vertical(*views)
    if any(notable_events(run) for run in runs):
        return rrb.Vertical(linkage, card_view(), log_view(roots), row_shares=[1.5, 0.9, 0.6])
    return rrb.Vertical(linkage, card_view(), row_shares=[1.7, 1.0])


def arranged(content: rrb.Container, timeline: Timeline, runs: Sequence[Run]) -> rrb.Blueprint:
    """Return the blueprint of the content, with Rerun's own panels collapsed, ready to play."""
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
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def time_axis(timeline: Timeline, runs: Sequence[Run], after: float = EDGE) -> rrb.TimeAxis:
    """Return an axis over the whole runs; Rerun's default is half a minute around the cursor.

    after: part of the runs' time that is left free after the curves.
    """
    import rerun as rr
    import rerun.blueprint as rrb

    start = min((float(run.t.min()) for run in runs if len(run)), default=0.0)
    stop = max((float(run.t.max()) for run in runs if len(run)), default=0.0)
    length = stop - start or 1.0
    boundary = rr.encodings.TimeRangeBoundary.absolute
    first, last = timeline.number(start - EDGE * length), timeline.number(stop + after * length)
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
    """Return a plot of curves with a legend; groups: (root entity, group); width, height: of the plot [points]."""
    import rerun.blueprint as rrb

    has_legend = sum(len(group.names) for _, group in groups) > 1  # a long legend scrolls
    after = min(max(_legend_part(Plot(title, groups), width), LEAST_LEGEND), MOST_LEGEND)
    ranges = [group.extent for _, group in groups if group.extent]
    low, high = min((low for low, _ in ranges), default=0.0), max((high for _, high in ranges), default=0.0)
    return rrb.TimeSeriesView(
        name=title,
        origin="/",
        contents=[f"{root}/{group.path}" for root, group in groups],
        axis_x=time_axis(timeline, runs, after if has_legend else LABEL / (width - NUMBERS)),
        axis_y=rrb.ScalarAxis(range=with_two_labels(low, high, height - CAPTION)) if ranges else None,
        plot_legend=rrb.PlotLegend(corner="RightTop", visible=has_legend),
    )


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


def _legend_part(plot: Plot, width: float) -> float:
    """Return the part of the run's time that the legend hides in a plot of this width [points], 0 without a legend."""
    names = [name for _, group in plot.groups for name in group.names]
    legend = LEGEND_EDGE + LETTER * max(map(len, names), default=0)
    return legend / max(width - NUMBERS - legend, 1.0) if len(names) > 1 else 0.0


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
