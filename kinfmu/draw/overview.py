"""overview(): the outputs of a run in a small figure, lengths and angles side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinfmu.draw.chart import dress
from kinfmu.draw.curves import curves
from kinfmu.run import Run
from kinfmu.units import CoordinateName

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_CURVES = 4  # of a panel
_WIDTH, _HEIGHT = 4.4, 2.4  # [in] of a panel


def overview(run: Run) -> Figure:
    """Return a figure of the first outputs of a run with samples, with a panel for each unit; needs matplotlib."""
    from matplotlib.figure import Figure

    by_unit = [[name for name in shown_outputs(run) if name.is_angle == is_angle] for is_angle in (False, True)]
    panels = [names for names in by_unit if names]
    figure = Figure(figsize=(_WIDTH * max(len(panels), 1), _HEIGHT), layout="constrained", facecolor="white")
    for index, names in enumerate(panels, start=1):
        axes = figure.add_subplot(1, len(panels), index)
        curves(axes, run, names[:MOST_CURVES])
        dress(axes, "")
        axes.set_ylabel("rad" if names[0].is_angle else run.length_unit)
        more = f"and {len(names) - MOST_CURVES} more" if len(names) > MOST_CURVES else None
        axes.legend(
            title=more, fontsize=7.0, title_fontsize=7.0, frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0)
        )
    return figure


def shown_outputs(run: Run) -> list[CoordinateName]:
    """Return the outputs that a run holds, points of interest first."""
    outputs = [*run.outputs[run.coordinate_count :], *run.names]
    return [name for name in outputs if name not in run.absent]
