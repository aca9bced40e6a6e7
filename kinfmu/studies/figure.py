"""The picture of a study, by how its parameters vary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.draw.contours import contours
from kinfmu.draw.contributions import Contributed, contributions
from kinfmu.draw.response import response
from kinfmu.draw.scatter import MOST_COLUMNS, scatter_matrix
from kinfmu.draw.study_panels import Quantities
from kinfmu.draw.writing import check_suffix, write
from kinfmu.errors import FigureError, StudyError, listed, suggestion
from kinfmu.readings import counted_from
from kinfmu.studies.rows import StudyRows


def draw(result: StudyRows, path: Path, measures: tuple[str, ...]) -> None:
    """Draw the results of a study into a file; measures: which, default: all."""
    check_suffix(path)
    write(path, lambda: figure_of(result, measures))


def figure_of(result: StudyRows, measures: tuple[str, ...] = ()) -> Any:
    """Return the Figure of matplotlib that shows the results of a study.

    Raises:
        StudyError: A measure is unknown.
        FigureError: There are too many columns for a scatter matrix.

    """
    for name in measures:
        if name not in result.measures:
            near = suggestion(name, result.measures)
            raise StudyError(f"the study has no measure '{name}'{near}; measures: {listed(result.measures)}")
    measures = measures or result.measures
    kind = picture_of(result)
    count = len(result.parameters) + len(measures)
    if kind == "scatter" and count > MOST_COLUMNS:
        raise FigureError(
            f"a scatter matrix holds {MOST_COLUMNS} parameters and measures, and these are {count}: choose measures, "
            f"on the command line with --measures"
        )
    title = result.mechanism.title or result.mechanism.name
    if kind == "contributions":
        return contributions([_contributed(result, name) for name in measures], f"{title}: tolerances")
    parameters = [_column(result, name) for name in result.parameters]
    if kind == "contours":
        grids = [np.array(one["values"]) for one in result.definition["parameters"].values()]
        factors = [result.display_unit(name).factor for name in result.parameters]
        x, y = (p._replace(values=grid / f) for p, grid, f in zip(parameters, grids, factors, strict=True))
        sorted_x, sorted_y = np.argsort(x.values), np.argsort(y.values)
        shape = (len(x.values), len(y.values))
        fields = [
            one._replace(values=one.values.reshape(shape)[np.ix_(sorted_x, sorted_y)])
            for one in (_column(result, name) for name in measures)
        ]
        return contours(x._replace(values=x.values[sorted_x]), y._replace(values=y.values[sorted_y]), fields, title)
    columns = [_column(result, name) for name in measures]
    if kind == "response":
        return response(parameters[0], columns, title)
    return scatter_matrix(parameters, columns, f"{title}: {len(result)} designs")


def picture_of(result: StudyRows) -> str:
    """Return 'response', 'contours', 'contributions' or 'scatter'."""
    if result.nominal.deviations:
        return "contributions"
    grids = ["values" in one for one in result.definition["parameters"].values()]
    return {1: "response", 2: "contours"}.get(len(grids), "scatter") if all(grids) else "scatter"


def _column(result: StudyRows, name: str) -> Quantities:
    unit, factor = result.display_unit(name)
    kinds = {reading.name: reading.type for reading in result.mechanism.measures}
    return Quantities(name, unit, result[name] / factor, counted_from(kinds.get(name, "")))


def _contributed(result: StudyRows, name: str) -> Contributed:
    parts = result.nominal.contributions(name)
    known = parts if np.isfinite(list(parts.values())).all() else {}
    unit, factor = result.display_unit(name)
    return Contributed(
        name, unit, result.nominal.deviation(name) / factor, result.statistics[name].deviation / factor, known
    )
