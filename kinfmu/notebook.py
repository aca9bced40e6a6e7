"""What notebooks show of mechanisms, runs, reports, designs, sensitivities, studies and fits: pictures and tables."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from kinfmu.analysis import Report
from kinfmu.analysis.summary import measure_cells
from kinfmu.arrays import FloatArray
from kinfmu.design.fit import FitResult
from kinfmu.design.fit.picture import content_of
from kinfmu.design.fit.text import parameter_rows
from kinfmu.design.study import StudyResult
from kinfmu.design.study.figure import figure_of
from kinfmu.design.study.result import about, disagreement, failures, measure_rows
from kinfmu.display import escaped, html_of, page, svg_of, table, widget_of
from kinfmu.draw import fitted
from kinfmu.draw.chart import overview, shown_outputs
from kinfmu.draw.drawing import sheet_of
from kinfmu.draw.instant import instant
from kinfmu.draw.writing import svg_text
from kinfmu.errors import KinfmuError, some
from kinfmu.mechanism import Mechanism
from kinfmu.motion import DesignMeasures, MeasuredValues
from kinfmu.plan import localized, require_solvable
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.system import System
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.designs import Designs
from kinfmu.run.sensitivities import Sensitivities
from kinfmu.run.verdict import notable_events, sentence

_LARGEST = 300  # coordinates; mobility and plan of larger mechanisms take seconds
_KEPT = 8  # drawings
_DARK = ":is([data-jp-theme-light=false], .vscode-dark, [data-theme=dark])"  # pages of dark notebooks: Jupyter, VS Code
_DIGITS = 6  # of values with units


def title(mechanism: Mechanism) -> str:
    """Return the name and the title of a mechanism."""
    return f"{mechanism.name}: {mechanism.title}" if mechanism.title else mechanism.name


@html_of.register
def mechanism_html(mechanism: Mechanism) -> str:
    """Return the drawing of a mechanism, or the reason why there is none, and the table of its parts."""
    name = title(mechanism)
    return page(name, picture(lambda: drawing(mechanism), f"Drawing of {name}"), table(_parts(mechanism)))


@svg_of.register
def drawing(mechanism: Mechanism) -> str:
    """Return the drawing of a mechanism as SVG; AssemblyError if it does not close."""
    return svg_text("this picture", lambda: sheet_of(instant(mechanism)).figure)


@widget_of.register
def live(mechanism: Mechanism) -> Any:
    """Return the live mechanism; None without anywidget, and for large ones, whose page takes long."""
    if len(mechanism.coordinate_names) > _LARGEST or not find_spec("anywidget"):
        return None
    from kinfmu.page.player import play

    return play(mechanism)


@lru_cache(maxsize=_KEPT)
def _parts(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Yield what is counted, and its names."""
    yield "moving bodies", f"{len(mechanism.moving_bodies)}: {some([body.name for body in mechanism.moving_bodies])}"
    kinds: dict[str, list[str]] = {}
    for joint in mechanism.joints:
        kinds.setdefault(joint.type, []).append(joint.name)
    yield "joints", "\n".join(f"{len(names)} {kind}: {some(names)}" for kind, names in kinds.items()) or "0"
    drivers = [f"{driver.name}: {driver.type}, {driver.law.type}" for driver in mechanism.drivers]
    yield "drivers", "\n".join(drivers) or "0"
    if mechanism.points:
        yield "points of interest", some([f"{name} = {point}" for name, point in mechanism.points.items()])
    if mechanism.parameters:
        values = [f"{name} = {parameter.value:.6g}" for name, parameter in mechanism.parameters.items()]
        yield "parameters", some(values)
    yield "unit of length", mechanism.length_unit
    if len(mechanism.coordinate_names) <= _LARGEST:
        yield from _mobility(mechanism)


def _mobility(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Yield the mobility, redundant joints, and the problem that prevents solving."""
    system = System(localized(mechanism)[0])
    redundancy = find_redundancy(system)
    yield "mobility", str(redundancy.mobility)
    if redundancy.redundant:
        yield "redundant", ", ".join(dict.fromkeys(row.row.owner for row in redundancy.redundant))
    try:
        require_solvable(system, redundancy)
    except KinfmuError as problem:
        yield "problem", str(problem)


_MOST_EVENTS = 5


@html_of.register
def run_html(run: Run) -> str:
    """Return the verdict, the plot and the tables of a run."""
    name = run.info.get("title") or run.info.get("name") or "run"
    verdict = f"<p>{escaped('; '.join(filter(None, (axis_of(run).range(), sentence(run)))))}</p>"
    shown = picture(lambda: plot(run), f"Plot of {name}") if len(run) and shown_outputs(run) else ""
    return page(name, verdict, shown, _events(run), _column_ranges(run))


@svg_of.register
def plot(run: Run) -> str:
    """Return the plot of a run's outputs, with a panel for each unit, as SVG."""
    return svg_text("this picture", lambda: overview(run))


def _events(run: Run) -> str:
    """Return the first events as a table; '' without events."""
    events, axis = notable_events(run), axis_of(run)
    rows = [(axis.place(event.t), event.level, event.text) for event in events[:_MOST_EVENTS]]
    if len(events) > _MOST_EVENTS:
        rows.append(("", "", f"and {len(events) - _MOST_EVENTS} more"))
    return table(rows, ("at", "level", "event")) if rows else ""


def _column_ranges(run: Run) -> str:
    """Return the ranges of the outputs as a table."""
    names = shown_outputs(run)
    rows: list[Sequence[object]] = []
    for name in names[:MOST_ROWS]:
        values = run[name][run.good]
        first = float(values[0]) if len(values) else "none"
        rows.append((name, "rad" if name.is_angle else run.length_unit, first, *_ends(values)))
    return table([*rows, *_more(len(names), 5)], ("output", "unit", "first", "smallest", "largest"))


def _ends(values: FloatArray) -> tuple[object, object]:
    """Return the smallest and the largest of the numbers that are finite."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if len(known) else ("none", "none")


@html_of.register
def report_html(report: Report) -> str:
    """Return the verdicts and tables of a report."""
    return page(title(report.mechanism), report.summary().html())


@html_of.register
def measures_html(values: MeasuredValues) -> str:
    """Return the values of measures as a table; of one without a value the reason."""
    rows = [
        (value.name, value.type, *((value.reason, "") if value.reason else measure_cells(value, _DIGITS)))
        for value in values.values()
    ]
    drivers = dict.fromkeys(value.driver for value in values.values() if value.at)
    return page("Measures", table(rows, ("measure", "type", "value", f"at {some(drivers)}" if drivers else "")))


@html_of.register
def designs_html(designs: Designs) -> str:
    """Return the ranges of the outputs over all designs, and the first designs with gaps with their reasons."""
    count, samples = designs.status.shape
    whole, lost = int(designs.good.all(axis=1).sum()), (~designs.good).sum(axis=1)
    gaps = [(number, int(lost[number]), reason) for number, reason in designs.reasons.items()]
    rows = [*gaps[:MOST_ROWS], *_more(len(gaps), 3)]
    return page(
        f"{count} designs at {samples} samples, {whole} of them without gaps",
        table(_ranges(designs.parameters), ("parameter", "smallest", "largest")),
        table(_outputs(designs), ("output", "unit", "smallest", "largest")),
        table(rows, ("design", "samples without numbers", "reason")) if gaps else "",
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
    """Return the range of each of the first columns."""
    rows = [(name, *_ends(values)) for name, values in list(columns.items())[:MOST_ROWS]]
    return [*rows, *_more(len(columns), 3)]


def _outputs(designs: Designs) -> list[Sequence[object]]:
    """Return the range of each output over all designs and samples that hold numbers."""
    rows = [
        (name, "rad" if name.is_angle else "length", *_ends(designs.values[:, :, k][designs.good]))
        for k, name in enumerate(designs.outputs[:MOST_ROWS])
    ]
    return [*rows, *_more(len(designs.outputs), 4)]


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


@html_of.register
def study_html(result: StudyResult) -> str:
    """Return the summary, the picture, a warning and the first failure of a study."""
    header, *rows = measure_rows(result)
    texts = [f"<p>{escaped(text)}</p>" for text in (disagreement(result), failures(result)) if text]
    shown = picture(lambda: study_svg(result), f"Picture of the study of {result.mechanism.name}")
    return page(about(result), table(rows, header), shown, *texts)


@svg_of.register
def study_svg(result: StudyResult) -> str:
    """Return the picture of a study as SVG; FigureError for too many parameters and measures."""
    return svg_text("this picture", lambda: figure_of(result, result.measures))


@html_of.register
def fit_html(result: FitResult) -> str:
    """Return the picture of a fit, its unknowns, and the errors of its targets and constraints."""
    errors = []
    for one in result.errors:
        unit, factor = one.display[0]
        errors.append((one.name, one.type, one.rms / factor, one.largest / factor, unit))
    constraints = [(one.name, "holds" if one.holds else "violated", one.text) for one in result.constraints]
    return page(
        f"{result.mechanism.name}: sum of squares {result.squares:.6g}, rms residual {result.rms:.6g}",
        picture(lambda: fit_svg(result), f"Picture of the fit of {result.mechanism.name}"),
        table(parameter_rows(result), ("unknown", "value", "unit", "bounds", "")),
        table(errors, ("target", "type", "rms error", "largest error", "unit")),
        table(constraints, ("constraint", "", "value")) if constraints else "",
    )


@svg_of.register
def fit_svg(result: FitResult) -> str:
    """Return the picture of a fit as SVG."""
    return svg_text("this picture", lambda: fitted.figure_of(content_of(result)))


MOST_ROWS = 12  # of a table


def picture(draw: Callable[[], str], alternative: str) -> str:
    """Return the SVG text of `draw` as an image, which styles of the page do not change; of an error the reason.

    alternative: Text for readers who do not see the image.
    """
    try:
        image = b64encode(draw().encode()).decode()
    except KinfmuError as reason:
        return f"<p>{escaped(reason)}</p>"
    shown = f'<img class="kinfmu" alt="{escaped(alternative)}" style="max-width: 100%" src="data:image/svg+xml;base64,'
    return f'<style>{_DARK} img.kinfmu {{ color-scheme: dark }}</style><p>{shown}{image}"></p>'
