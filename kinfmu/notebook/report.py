"""A report of `check`, and values of measures, as tables with the words of the command line."""

from __future__ import annotations

from kinfmu.analysis import Report
from kinfmu.analysis.text import findings, measured_text, title
from kinfmu.display import html_of, page, table
from kinfmu.motion import MeasuredValues


@html_of.register
def report_html(report: Report) -> str:
    """Return the findings as a table of subjects and texts."""
    return page(title(report.mechanism), table(findings(report)))


@html_of.register
def measures_html(values: MeasuredValues) -> str:
    """Return the values of measures as a table; of one without a value the reason."""
    rows = [(value.name, value.type, value.reason or measured_text(value)) for value in values.values()]
    return page("Measures", table(rows, ("measure", "type", "value")))
