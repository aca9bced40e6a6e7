"""How a recording is laid out on the screen: linkage, card and log on the left, plots on the right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from kinfmu.log.blocks import TIMELINE
from kinfmu.log.linkage import view_box
from kinfmu.log.scene import Scene
from kinfmu.log.series import KINDS, ORDERS, Group
from kinfmu.log.verdict import happenings
from kinfmu.run import Run

if TYPE_CHECKING:
    import rerun.blueprint as rrb

MOST_CURVES = 14  # a longer legend would hide the curves
SHORTEST_SHOW, LONGEST_SHOW = 5.0, 30.0  # [s] that playing the whole run takes
EDGE = 0.01  # of the run's time, left free before and after the curves
LEGEND_ROOM = 0.28  # of the run's time, left free behind the curves for the legend


def single(
    run: Run,
    scene: Scene | None,
    curves: Mapping[tuple[str, str], Group],
    accuracy: Sequence[Group],
    iterations: Group,
) -> rrb.Blueprint:
    """One run: what moves on the left, what it measures on the right, one row an order, one column a unit."""
    import rerun.blueprint as rrb

    rows: list[rrb.Container | rrb.View] = []
    for order in ORDERS:
        found = [curves[order, kind] for kind in KINDS if (order, kind) in curves]
        if found:
            rows.append(rrb.Horizontal(*[plot(group.title, [("", group)], [run]) for group in found]))
    rows.append(
        rrb.Horizontal(
            plot(accuracy[0].title, [("", group) for group in accuracy], [run]),
            plot(iterations.title, [("", iterations)], [run]),
        )
    )
    rows.append(status_view([""], [run]))
    text: list[rrb.View] = [card_view()]
    if happenings(run):
        text.append(log_view([""]))
    left = rrb.Vertical(
        linkage_view(["/linkage/**"], [scene] if scene else []),
        rrb.Horizontal(*text, column_shares=[1.0, 1.25][: len(text)]),
        row_shares=[1.7, 1],
    )
    right = rrb.Vertical(*rows, row_shares=[2.0] * (len(rows) - 1) + [1.0])
    return arranged(rrb.Horizontal(left, right, column_shares=[1, 1.25]), [run])


def compared(
    runs: tuple[Run, Run],
    scenes: Sequence[Scene],
    curves: Sequence[Mapping[tuple[str, str], Group]],
    difference: Mapping[tuple[str, str], Group],
) -> rrb.Blueprint:
    """Two runs: overlaid on top, below that the differences of the coordinates that they have in common."""
    import rerun.blueprint as rrb

    rows: list[rrb.Container | rrb.View] = []
    overlaid = []
    for kind in KINDS:
        pair = [
            (root, of["position", kind])
            for root, of in zip(("/a", "/b"), curves, strict=True)
            if ("position", kind) in of
        ]
        if pair:
            overlaid.append(plot(f"{pair[0][1].title} of A (wide) and B", pair, runs))
    rows.append(rrb.Horizontal(*overlaid))
    for order in ORDERS:
        found = [difference[order, kind] for kind in KINDS if (order, kind) in difference]
        if found:
            rows.append(
                rrb.Horizontal(*[plot(f"B - A: {group.title}", [("/difference", group)], runs) for group in found])
            )
    rows.append(status_view(["/a", "/b"], runs))
    text: list[rrb.View] = [card_view()]
    if any(happenings(run) for run in runs):
        text.append(log_view(["/a", "/b"]))
    left = rrb.Vertical(
        linkage_view(["/a/linkage/**", "/b/linkage/**"], scenes),
        rrb.Horizontal(*text, column_shares=[1.0, 1.25][: len(text)]),
        row_shares=[1.4, 1],
    )
    right = rrb.Vertical(*rows, row_shares=[2.0] * (len(rows) - 1) + [1.6])
    return arranged(rrb.Horizontal(left, right, column_shares=[1, 1.25]), runs)


def arranged(content: rrb.Container, runs: Sequence[Run]) -> rrb.Blueprint:
    """The content with Rerun's own panels out of the way, ready to play."""
    import rerun.blueprint as rrb

    length = max((float(run.t.max() - run.t.min()) for run in runs if len(run)), default=0.0)
    show = min(max(length, SHORTEST_SHOW), LONGEST_SHOW)
    return rrb.Blueprint(
        content,
        rrb.TimePanel(
            timeline=TIMELINE,
            state="collapsed",
            play_state="paused",
            loop_mode="all",
            playback_speed=float(f"{length / show:.2g}") or 1.0,
        ),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def time_axis(runs: Sequence[Run], room: float = EDGE) -> rrb.TimeAxis:
    """The time of the whole runs, not the half minute around the cursor that is Rerun's default."""
    import rerun as rr
    import rerun.blueprint as rrb

    start = min((float(run.t.min()) for run in runs if len(run)), default=0.0)
    stop = max((float(run.t.max()) for run in runs if len(run)), default=0.0)
    length = stop - start or 1.0
    boundary = rr.encodings.TimeRangeBoundary.absolute
    shown = rr.TimeRange(start=boundary(seconds=start - EDGE * length), end=boundary(seconds=stop + room * length))
    return rrb.TimeAxis(view_range=shown)


def plot(title: str, groups: Sequence[tuple[str, Group]], runs: Sequence[Run]) -> rrb.TimeSeriesView:
    """The curves of groups over the whole runs, with their names beside them; groups: (root entity, group)."""
    import rerun.blueprint as rrb

    ranges = [group.shown for _, group in groups if group.shown]
    axis_y = rrb.ScalarAxis(range=(min(low for low, _ in ranges), max(high for _, high in ranges))) if ranges else None
    return rrb.TimeSeriesView(
        name=title,
        origin="/",
        contents=[f"{root}/{group.path}" for root, group in groups],
        axis_x=time_axis(runs, LEGEND_ROOM),
        axis_y=axis_y,
        plot_legend=rrb.PlotLegend(
            corner="RightTop", visible=sum(len(group.names) for _, group in groups) <= MOST_CURVES
        ),
    )


def linkage_view(contents: Sequence[str], scenes: Sequence[Scene]) -> rrb.Spatial2DView:
    """The linkage, framed; the view stands at the root so that the flip of the plane takes effect."""
    import rerun.blueprint as rrb

    boxes = [view_box(scene) for scene in scenes]
    bounds = None
    if boxes:
        x = (min(box[0][0] for box in boxes), max(box[0][1] for box in boxes))
        y = (min(box[1][0] for box in boxes), max(box[1][1] for box in boxes))
        bounds = rrb.VisualBounds2D(x_range=x, y_range=y)
    return rrb.Spatial2DView(name="linkage", origin="/", contents=list(contents), visual_bounds=bounds)


def card_view() -> rrb.TextDocumentView:
    """Mechanism, run and verdict."""
    import rerun.blueprint as rrb

    return rrb.TextDocumentView(name="run", origin="/card")


def status_view(roots: Sequence[str], runs: Sequence[Run]) -> rrb.StateTimelineView:
    """A lane of solver states for every run."""
    import rerun.blueprint as rrb

    contents = [f"{root}/solver/status" for root in roots]
    return rrb.StateTimelineView(name="solver status", origin="/", contents=contents, time_view=time_axis(runs))


def log_view(roots: Sequence[str]) -> rrb.TextLogView:
    """What happened when."""
    import rerun.blueprint as rrb

    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    if len(roots) > 1:
        columns = rrb.TextLogColumns(text_log_columns=["EntityPath", "LogLevel", "Body"])
    return rrb.TextLogView(name="log", origin="/", contents=[f"{root}/log" for root in roots], columns=columns)
