"""How a recording is laid out on the screen: linkage, card and log on the left, plots on the right."""

from __future__ import annotations

from collections.abc import Sequence
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
EDGE = 0.01  # of the run's time, left free on either side of the curves


def single(run: Run, scene: Scene | None, curves: Sequence[Group], diagnostics: Group) -> rrb.Blueprint:
    """One run: what moves on the left, what it measures on the right, one row an order, one column a unit."""
    import rerun.blueprint as rrb

    axis = time_axis([run])
    by_path = {group.path: group for group in curves}
    rows: list[rrb.Container | rrb.View] = []
    for order in ORDERS:
        plots = [plot(group, "", axis) for kind in KINDS if (group := by_path.get(f"{order}/{kind}"))]
        rows.append(rrb.Horizontal(*plots))
    rows.append(
        rrb.Horizontal(
            plot(diagnostics, "", axis),
            rrb.TimeSeriesView(
                name="Newton iterations",
                origin="/solver/iterations",
                axis_x=axis,
                plot_legend=rrb.PlotLegend(visible=False),
            ),
        )
    )
    rows.append(rrb.StateTimelineView(name="solver status", origin="/solver/status", time_view=axis))
    left: list[rrb.Container | rrb.View] = [linkage_view(["/linkage/**"], [scene] if scene else [])]
    text: list[rrb.View] = [rrb.TextDocumentView(name="run", origin="/card")]
    if happenings(run):
        text.append(log_view("/log"))
    left.append(rrb.Horizontal(*text))
    return arranged(
        rrb.Horizontal(
            rrb.Vertical(*left, row_shares=[2.2, 1]),
            rrb.Vertical(*rows, row_shares=[2, 2, 2, 2, 1]),
            column_shares=[1, 1.25],
        ),
        [run],
    )


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
            playback_speed=length / show or 1.0,
        ),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def time_axis(runs: Sequence[Run]) -> rrb.TimeAxis:
    """The time of the whole runs, not the half minute around the cursor that is Rerun's default."""
    import rerun as rr
    import rerun.blueprint as rrb

    start = min((float(run.t.min()) for run in runs if len(run)), default=0.0)
    stop = max((float(run.t.max()) for run in runs if len(run)), default=0.0)
    edge = EDGE * (stop - start) or 0.5
    boundary = rr.encodings.TimeRangeBoundary.absolute
    return rrb.TimeAxis(
        view_range=rr.TimeRange(start=boundary(seconds=start - edge), end=boundary(seconds=stop + edge))
    )


def plot(group: Group, root: str, axis: rrb.TimeAxis) -> rrb.TimeSeriesView:
    """The curves of a group over the whole run."""
    import rerun.blueprint as rrb

    legend = rrb.PlotLegend(corner="LeftTop", visible=len(group.names) <= MOST_CURVES)
    return rrb.TimeSeriesView(name=group.title, origin=f"{root}/{group.path}", axis_x=axis, plot_legend=legend)


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


def log_view(origin: str) -> rrb.TextLogView:
    """What happened when."""
    import rerun.blueprint as rrb

    return rrb.TextLogView(name="log", origin=origin)
