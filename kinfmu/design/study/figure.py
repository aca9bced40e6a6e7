"""The picture of a study, by how its parameters vary."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.design.study.rows import StudyRows
from kinfmu.draw.chart import dress
from kinfmu.draw.study import (
    MOST_COLUMNS,
    Contributed,
    Quantities,
    contours,
    contours_into,
    contributions,
    contributions_into,
    response,
    response_into,
    scatter_into,
    scatter_matrix,
)
from kinfmu.draw.writing import check_suffix, check_target, write
from kinfmu.errors import FigureError, StudyError, listed, valid_names
from kinfmu.mechanism.measures import counted_from

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(result: StudyRows, path: str | Path | None, ax: Axes | None, measures: tuple[str, ...]) -> None:
    """Draw the results of a study into a file or into Axes; measures: which, default: all.

    Raises:
        StudyError: A measure is unknown.
        FigureError: Neither or both of `path` and `ax` are given, one of them is invalid, the Axes cannot hold the
            picture, or there are too many columns for a scatter matrix.

    """
    check_target("figure", path, ax)
    if ax is not None:
        _draw_into(ax, result, _known(result, measures))
        return
    path = Path(str(path))
    check_suffix(path)
    write(path, lambda: figure_of(result, measures))


def figure_of(result: StudyRows, measures: tuple[str, ...] = ()) -> Any:
    """Return the Figure of matplotlib that shows the results of a study.

    Raise a StudyError if a measure is unknown, a FigureError if there are too many columns for a scatter matrix.
    """
    measures = _known(result, measures)
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
    if kind == "contours":
        return contours(*_fields(result, measures), title)
    parameters = [_column(result, name) for name in result.parameters]
    columns = [_column(result, name) for name in measures]
    if kind == "response":
        return response(parameters[0], columns, title)
    return scatter_matrix(parameters, columns, f"{title}: {len(result)} designs")


def _draw_into(ax: Axes, result: StudyRows, measures: tuple[str, ...]) -> None:
    """Draw one measure into Axes, or raise a FigureError if the picture has several panels."""
    kind = picture_of(result)
    if len(measures) > 1:
        raise FigureError(
            f"Axes show one measure, and these are {len(measures)}: {listed(measures)}; choose one, such as "
            f"measures=('{measures[0]}',), or give a path"
        )
    if kind == "scatter" and len(result.parameters) > 1:
        raise FigureError(
            f"designs that vary {listed(result.parameters)} are drawn as a matrix of several Axes: give a path in "
            f"place of ax"
        )
    (name,) = measures
    dress(ax, "")
    if kind == "contributions":
        contributions_into(ax, _contributed(result, name))
    elif kind == "contours":
        x, y, (field,) = _fields(result, measures)
        contours_into(ax, x, y, field)
    else:
        into = response_into if kind == "response" else scatter_into
        into(ax, _column(result, result.parameters[0]), _column(result, name))


def _known(result: StudyRows, measures: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the measures to draw, or raise a StudyError for an unknown one."""
    for name in measures:
        if name not in result.measures:
            raise StudyError(f"the study has no measure '{name}'{valid_names(name, result.measures, 'measures')}")
    return tuple(measures) or tuple(result.measures)


def _fields(result: StudyRows, measures: tuple[str, ...]) -> tuple[Quantities, Quantities, list[Quantities]]:
    """Return two parameters with their ascending values (p,) and (q,), and the measures (p, q) on their grid."""
    grids = [np.array(one["values"]) for one in result.definition["parameters"].values()]
    columns = [(_column(result, name), result.display_unit(name).factor) for name in result.parameters]
    x, y = (column._replace(values=grid / factor) for (column, factor), grid in zip(columns, grids, strict=True))
    sorted_x, sorted_y = np.argsort(x.values), np.argsort(y.values)
    shape = (len(x.values), len(y.values))
    fields = [
        one._replace(values=one.values.reshape(shape)[np.ix_(sorted_x, sorted_y)])
        for one in (_column(result, name) for name in measures)
    ]
    return x._replace(values=x.values[sorted_x]), y._replace(values=y.values[sorted_y]), fields


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
