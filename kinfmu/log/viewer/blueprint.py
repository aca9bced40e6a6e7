"""Layout of a recording on the screen: linkage, card and log on the left, plots on the right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from kinfmu.log.viewer.linkage import trail_path, trail_time, view_box
from kinfmu.log.viewer.series import KINDS, ORDERS, Group
from kinfmu.log.viewer.timeline import Timeline
from kinfmu.run import Run
from kinfmu.run.verdict import notable_events
from kinfmu.scene.forces import Arrows, arrows
from kinfmu.scene.scene import Scene

if TYPE_CHECKING:
    import rerun.blueprint as rrb

SHORTEST_SHOW, LONGEST_SHOW = 5.0, 30.0  # [s], limits of the time to play the whole run
SWEEP_SHOW = 10.0  # [s] to play a run that has no time
EDGE = 0.01  # of the run's time, left free before and after the curves
LABEL = 30.0  # [points], half of the label of a tick such as +100 ms; most runs end at a tick
LEGEND_EDGE, LETTER = 34.0, 7.0  # [points]; width of a legend around its names, and of a letter
ABREAST = 4  # most plots of efforts and signals in a row
FEW = 4  # plots of two runs, up to which they are wide
PLOT, NARROW = 400.0, 200.0  # [points], widths of plots on a usual screen
STATUS, LANES = 0.13, 0.17  # of the height of the right side, for the states of one run and of two
LEAST_LEGEND, MOST_LEGEND = 0.15, 0.6  # of the run's time, left free after the curves for the legend


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

    rows: list[rrb.Container | rrb.View] = []
    for order in ORDERS:
        found = [curves[order, kind] for kind in KINDS if (order, kind) in curves]
        if found:
            rows.append(rrb.Horizontal(*[plot(group.title, [("", group)], timeline, [run]) for group in found]))
    if forces:
        width = NARROW if len(forces) > len(KINDS) else PLOT
        rows += _abreast([plot(group.title, [("", group)], timeline, [run], width) for group in forces])
    shares = [2.0] * len(rows)
    if solver:
        rows.append(rrb.Horizontal(*[plot(group.title, [("", group)], timeline, [run], NARROW) for group in solver]))
        shares.append(1.5)
    has_motion = bool(run.outputs) or any(one.scene for one in drawn)
    if has_motion:
        rows.append(status_view([""], timeline, [run]))
        shares.append(STATUS * sum(shares) / (1.0 - STATUS) if shares else 1.0)
    linked = [linkage_view([one.root], timeline, [one.run], [one.scene], one.title, one.arrows) for one in drawn]
    linkages = (linked[0] if len(linked) == 1 else rrb.Grid(*linked)) if has_motion and linked else None
    left = _left(linkages, [""], [run])
    right = rrb.Vertical(*rows, row_shares=shares)
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

    overlaid = [row for order in ORDERS if (row := _overlaid(order, timeline, runs, curves))]
    of_loads = [_both(path, timeline, runs, loads) for path in dict.fromkeys([*loads[0], *loads[1]])]
    rows: list[rrb.Container | rrb.View] = [*overlaid[:1]] if difference or not loaded else []
    most = 2 if len(loaded) <= FEW else ABREAST - 1  # titles of comparisons are long
    if not rows:
        rows += _abreast([_both(group.path, timeline, runs, loads) for group in loaded], most)
    for order in ORDERS:
        found = [difference[order, kind] for kind in KINDS if (order, kind) in difference]
        if found:
            rows.append(
                rrb.Horizontal(
                    *[plot(f"B - A: {group.title}", [("/difference", group)], timeline, runs) for group in found]
                )
            )
    width = NARROW if len(loaded) > len(KINDS) else PLOT
    rows += _abreast(
        [plot(f"B - A: {group.title}", [("/difference", group)], timeline, runs, width) for group in loaded], most
    )
    rows.append(status_view(["/a", "/b"], timeline, runs))
    left = _left(linkage_view(["/a/linkage", "/b/linkage"], timeline, runs, scenes), ["/a", "/b"], runs)
    plots = len(rows) - 1
    status = 2.0 * plots * LANES / (1.0 - LANES) or 1.0
    apart = rrb.Vertical(*rows, row_shares=[2.0] * plots + [status], name="B - A")
    both = rrb.Vertical(*overlaid, *_abreast(of_loads, ABREAST - 1), name="A and B")
    right = rrb.Tabs(apart, both)
    return arranged(rrb.Horizontal(left, right, column_shares=[1, 1.25]), timeline, runs)


def _abreast(views: Sequence[rrb.View], most: int = ABREAST) -> list[rrb.Container]:
    """Return rows of at most so many views, of about the same length."""
    import rerun.blueprint as rrb

    abreast = -(-len(views) // -(-len(views) // most)) if views else 1
    return [rrb.Horizontal(*views[k : k + abreast]) for k in range(0, len(views), abreast)]


def _both(path: str, timeline: Timeline, runs: tuple[Run, Run], loads: Sequence[Mapping[str, Group]]) -> rrb.View:
    """Return a plot of the efforts of one unit of both runs."""
    pair = [(root, of[path]) for root, of in zip(("/a", "/b"), loads, strict=True) if path in of]
    return plot(f"{pair[0][1].title} of A (wide) and B", pair, timeline, runs, NARROW)


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


def _overlaid(
    order: str, timeline: Timeline, runs: tuple[Run, Run], curves: Sequence[Mapping[tuple[str, str], Group]]
) -> rrb.Container | None:
    """Return plots of the curves of both runs, one for each unit; None if they have none of that order."""
    import rerun.blueprint as rrb

    plots = []
    for kind in KINDS:
        pair = [(root, of[order, kind]) for root, of in zip(("/a", "/b"), curves, strict=True) if (order, kind) in of]
        if pair:
            plots.append(plot(f"{pair[0][1].title} of A (wide) and B", pair, timeline, runs))
    return rrb.Horizontal(*plots) if plots else None


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
    width: float = PLOT,
) -> rrb.TimeSeriesView:
    """Return a plot of curves with a legend; groups: (root entity, group); width: of the plot [points]."""
    import rerun.blueprint as rrb

    names = [name for _, group in groups for name in group.names]
    has_legend = len(names) > 1  # a long legend scrolls
    ranges = [group.shown for _, group in groups if group.shown]
    axis_y = rrb.ScalarAxis(range=(min(low for low, _ in ranges), max(high for _, high in ranges))) if ranges else None
    return rrb.TimeSeriesView(
        name=title,
        origin="/",
        contents=[f"{root}/{group.path}" for root, group in groups],
        axis_x=time_axis(timeline, runs, _legend_part(names, width) if has_legend else LABEL / width),
        axis_y=axis_y,
        plot_legend=rrb.PlotLegend(corner="RightTop", visible=has_legend),
    )


def _legend_part(names: Sequence[str], width: float) -> float:
    """Return the part of the run's time that the legend of these curves hides in a plot of this width [points]."""
    legend = LEGEND_EDGE + LETTER * max(map(len, names))
    return min(max(legend / max(width - legend, 1.0), LEAST_LEGEND), MOST_LEGEND)


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
