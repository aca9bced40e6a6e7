"""Designs, their measures, and sensitivities as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.display import escaped, html_of, page, table
from kinfmu.motion import DesignMeasures
from kinfmu.notebook.picture import MOST_ROWS, some
from kinfmu.run.designs import Designs
from kinfmu.run.sensitivities import Sensitivities


@html_of.register
def designs_html(designs: Designs) -> str:
    """Return the ranges of the outputs over all designs, and the first designs with gaps with their reasons."""
    count, samples = designs.status.shape
    whole = int(designs.good.all(axis=1).sum())
    return page(
        f"{count} designs at {samples} samples, {whole} of them without gaps",
        table(_ranges(designs.parameters), ("parameter", "smallest", "largest")),
        table(_outputs(designs), ("output", "unit", "smallest", "largest")),
        table(_gaps(designs), ("design", "samples without numbers", "reason")) if designs.reasons else "",
    )


@html_of.register
def design_measures_html(designs: DesignMeasures) -> str:
    """Return the ranges of the parameters and measures, and the first designs without a value with their reasons."""
    units = designs.units
    measures = [(name, units.get(str(name), ""), *ends) for name, *ends in _ranges(designs.values)]
    reasons = [*list(designs.reasons.items())[:MOST_ROWS], *_more(len(designs.reasons), 2)]
    return page(
        f"{len(designs)} designs, {int(designs.good.sum())} of them with all measures",
        table(_ranges(designs.parameters), ("parameter", "smallest", "largest")),
        table(measures, ("measure", "unit", "smallest", "largest")),
        table(reasons, ("design", "reason")) if reasons else "",
    )


def _ranges(columns: Mapping[str, FloatArray]) -> list[Sequence[object]]:
    """Return the range of each of the first columns, of the numbers that are finite."""
    rows: list[Sequence[object]] = []
    for name, values in list(columns.items())[:MOST_ROWS]:
        known = values[np.isfinite(values)]
        rows.append((name, *((float(known.min()), float(known.max())) if len(known) else ("none", "none"))))
    return [*rows, *_more(len(columns), 3)]


def _outputs(designs: Designs) -> list[Sequence[object]]:
    """Return the range of each output over all designs and samples that hold numbers."""
    rows: list[Sequence[object]] = []
    for k, name in enumerate(designs.outputs[:MOST_ROWS]):
        values = designs.values[:, :, k][designs.good]
        ends = (float(values.min()), float(values.max())) if len(values) else ("none", "none")
        rows.append((name, "rad" if name.is_angle else "length", *ends))
    return [*rows, *_more(len(designs.outputs), 4)]


def _gaps(designs: Designs) -> list[Sequence[object]]:
    lost = (~designs.good).sum(axis=1)
    rows = [(number, int(lost[number]), reason) for number, reason in designs.reasons.items()]
    return [*rows[:MOST_ROWS], *_more(len(rows), 3)]


@html_of.register
def sensitivities_html(found: Sensitivities) -> str:
    """Return the largest magnitude of each derivative of a position over the samples."""
    known = found.values_by[np.isfinite(found.values_by).all(axis=(1, 2))]
    parameters, refused = found.parameters[:MOST_ROWS], found.refused
    rows: list[Sequence[object]] = []
    for k, name in enumerate(found.outputs[:MOST_ROWS]):
        largest = np.abs(known[:, k, : len(parameters)]).max(axis=0, initial=0.0)
        rows.append((name, *(float(value) for value in largest)))
    left_out = found.parameters[MOST_ROWS:]
    return page(
        f"Largest |derivative| of positions over {len(known)} of {len(found.t)} samples",
        table([*rows, *_more(len(found.outputs), len(parameters) + 1)], ("output", *(f"by {p}" for p in parameters))),
        f"<p>not shown: {escaped(some(list(left_out)))}</p>" if left_out else "",
        table(refused.items(), ("parameter", "why it cannot change alone")) if refused else "",
    )


def _more(count: int, columns: int) -> list[Sequence[object]]:
    """Return a last row with the number of rows that a table leaves out."""
    return [(f"and {count - MOST_ROWS} more", *[""] * (columns - 1))] if count > MOST_ROWS else []
