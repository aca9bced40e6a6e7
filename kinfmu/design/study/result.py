"""StudyResult: the rows of a study, its picture, its summary as text, and the rows of the summary."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from kinfmu.design.study.rows import StudyRows
from kinfmu.display import Displayed, aligned
from kinfmu.errors import listed

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class StudyResult(StudyRows, Displayed):
    """The results of a study; `kinfmu.study` returns them, and `StudyResult.read` reads those of a file.

    Columns are read when they are asked for, so that a million designs need no memory until then.

    Attributes:
        parameters: Names of the parameters that vary.
        measures: Names of the measures.
        units: Units of all columns by name.
        definition: The study as plain data: parameters, sampling, seed, motion.
        nominal: The measures of the design as written, and how tolerances act on them to first order.

    """

    def __repr__(self) -> str:
        return f"<Study of {self.mechanism.name}: {len(self)} designs; {', '.join(self.measures)}>"

    def __str__(self) -> str:
        return summary(self)

    def figure(
        self, path: str | Path | None = None, measures: Sequence[str] | str = (), *, ax: Axes | None = None
    ) -> None:
        """Draw the results into a .svg, .png or .pdf file, or one measure into Axes of matplotlib.

        One grid: the measures over it. Two grids: their contours. Tolerances alone: what each contributes. Any others:
        a scatter matrix. The same results give the same bytes.

        Args:
            path: The file.
            measures: Names of the measures to draw, or one name. Default: all.
            ax: Axes to draw into, in place of a file: one measure over one or two grids or over one parameter, or the
                contributions to it.

        Raises:
            StudyError: A measure is unknown.
            FigureError: The file cannot be written, or its suffix is unknown; neither or both of `path` and `ax` are
                given; the picture needs several Axes.
            MissingPackageError: matplotlib is not installed.

        """
        from kinfmu.design.study.figure import draw

        draw(self, path, ax, (measures,) if isinstance(measures, str) else tuple(measures))


MOST_CONTRIBUTIONS = 5  # of a measure
_HEADER = ("measure", "unit", "nominal", "mean", "deviation", "min", "max", "failures")
DISAGREES = 0.1  # of a deviation; first order and samples that differ by less agree
FEWEST_DESIGNS = 16  # whose deviation says something
CERTAIN = 4.0  # standard errors of a deviation that are not due to chance
ROUNDING = 1e-9  # of the value; smaller deviations are rounding
_FIRST_ORDER = "first order"


def summary(result: StudyRows) -> str:
    """Return the summary table of a study, and for tolerances what each contributes."""
    lines = [about(result), "", *aligned(measure_rows(result), left=2)]
    if result.nominal.reason:
        lines += ["", f"the design as written has no numbers: {result.nominal.reason}"]
    if result.nominal.deviations:
        lines += ["", "contributions to the variance, to first order:"]
        lines += aligned([_contributions(result, name) for name in result.measures], left=3)
    lines += [line for text in (disagreement(result), failures(result)) if text for line in ("", text)]
    return "\n".join(lines)


def disagreement(result: StudyRows) -> str:
    """Return a warning, as a line, of the measures that are not linear within the tolerances; '' if all are.

    Such a measure has a deviation, or a shift of the mean, in the samples that first order does not explain.
    """
    found = []
    for name in result.measures if result.nominal.deviations else ():
        sampled, first = result.statistics[name], result.nominal.deviation(name)
        if sampled.count < FEWEST_DESIGNS or not isfinite(first):
            continue
        nominal, larger = result.nominal.measures[name].value, max(sampled.deviation, first)
        chance = CERTAIN / (2.0 * sampled.count) ** 0.5  # relative, of the deviation of normal samples
        off = max(abs(sampled.deviation - first), abs(sampled.mean - nominal))
        if larger > ROUNDING * abs(nominal) and off > (DISAGREES + chance) * larger:
            found.append(name)
    if not found:
        return ""
    are = "is" if len(found) == 1 else "are"
    return (
        f"warning: {listed(found)} {are} not linear within the tolerances: first order and samples disagree; the "
        "contributions do not hold, the samples do"
    )


def failures(result: StudyRows) -> str:
    """Return how many designs lack a measure, and why the first does, as a line; '' if none does."""
    if result.first_failure is None:
        return ""
    count, first, reason = result.first_failure
    return f"{count} of {len(result)} designs lack a measure, the first is design {first}: {reason}"


def about(result: StudyRows) -> str:
    """Return what was studied, as a line."""
    definition = result.definition
    how = {"grid": "on a grid", "sobol": "Sobol points", "latin_hypercube": "a Latin hypercube"}[definition["sampling"]]
    seed = "" if definition["sampling"] == "grid" else f", seed {definition['seed']}"
    varied = ", ".join(result.parameters)
    count = f"{len(result)} design{'' if len(result) == 1 else 's'}"
    return f"{result.mechanism.name}: {count} ({how}{seed}) over {varied}; {definition['motion']['over']}"


def measure_rows(result: StudyRows) -> list[tuple[str, ...]]:
    """Return the header of the summary table, and a row for each measure."""
    has_tolerances = bool(result.nominal.deviations)
    header = list(_HEADER)
    if has_tolerances:
        header.insert(5, _FIRST_ORDER)
    rows = [tuple(header)]
    for name in result.measures:
        found, (unit, factor) = result.statistics[name], result.display_unit(name)
        row = [name, unit, _short(result.nominal.measures[name].value / factor), _short(found.mean / factor)]
        row.append(_short(found.deviation / factor, 4))
        if has_tolerances:
            row.append(_short(result.nominal.deviation(name) / factor, 4))
        rows.append((*row, _short(found.low / factor), _short(found.high / factor), str(found.missing)))
    return rows


def _contributions(result: StudyRows, measure: str) -> tuple[str, ...]:
    """Return a line: the largest contributions to a measure, and how its derivatives were found."""
    found = result.nominal.contributions(measure)
    method = f"(by {result.nominal.measures[measure].method})"
    if not all(map(isfinite, found.values())):
        return measure, "unknown: a design next to the one as written lacks the measure", method
    shown = [f"{name} {100.0 * part:.1f} %" for name, part in found.items()]
    others = len(shown) - MOST_CONTRIBUTIONS
    if others > 1:
        rest = sum(list(found.values())[MOST_CONTRIBUTIONS:])
        shown = [*shown[:MOST_CONTRIBUTIONS], f"{others} others {100.0 * rest:.1f} %"]
    return measure, ", ".join(shown), method


def _short(number: float, digits: int = 6) -> str:
    return f"{number:.{digits}g}" if isfinite(number) else "-"
