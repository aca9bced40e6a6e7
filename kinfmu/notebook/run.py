"""A run: its verdict, a small plot of its outputs, its events, and the ranges of its outputs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kinfmu.display import escaped, html_of, page, svg_of, table
from kinfmu.draw.overview import overview, shown_outputs
from kinfmu.draw.writing import svg_text
from kinfmu.notebook.picture import MOST_ROWS, picture
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.verdict import notable_events, sentence
from kinfmu.units import CoordinateName

_MOST_EVENTS = 5


@html_of.register
def run_html(run: Run) -> str:
    """Return the verdict, the plot and the tables of a run."""
    title = run.info.get("title") or run.info.get("name") or "run"
    verdict = f"<p>{escaped('; '.join(filter(None, (axis_of(run).range(), sentence(run)))))}</p>"
    shown = picture(lambda: plot(run), f"Plot of {title}") if len(run) and shown_outputs(run) else ""
    return page(title, verdict, shown, _events(run), _ranges(run))


@svg_of.register
def plot(run: Run) -> str:
    """Return the plot of a run's outputs, with a panel for each unit, as SVG.

    Raises:
        MissingPackageError: matplotlib is not installed.

    """
    return svg_text("this picture", lambda: overview(run))


def _events(run: Run) -> str:
    """Return the first events as a table; '' without events."""
    events, axis = notable_events(run), axis_of(run)
    rows = [(axis.place(event.t), event.level, event.text) for event in events[:_MOST_EVENTS]]
    if len(events) > _MOST_EVENTS:
        rows.append(("", "", f"and {len(events) - _MOST_EVENTS} more"))
    return table(rows, ("at", "level", "event")) if rows else ""


def _ranges(run: Run) -> str:
    """Return the ranges of the outputs as a table."""
    names = shown_outputs(run)
    rows: list[Sequence[object]] = [(name, *_range(run, name)) for name in names[:MOST_ROWS]]
    if len(names) > MOST_ROWS:
        rows.append((f"and {len(names) - MOST_ROWS} more", "", "", "", ""))
    return table(rows, ("output", "unit", "first", "smallest", "largest"))


def _range(run: Run, name: CoordinateName) -> Iterator[object]:
    """Yield the unit, and the first, smallest and largest value of the samples that hold numbers."""
    values = run[name][run.good]
    yield "rad" if name.is_angle else run.length_unit
    yield from ([float(values[0]), float(np.min(values)), float(np.max(values))] if len(values) else ["none"] * 3)
