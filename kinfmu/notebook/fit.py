"""The result of a fit: its picture, its unknowns, and what its targets and constraints say."""

from __future__ import annotations

from kinfmu.design.fit import FitResult
from kinfmu.design.fit.picture import content_of
from kinfmu.design.fit.text import parameter_rows
from kinfmu.display import html_of, page, svg_of, table
from kinfmu.draw.fitted import figure_of
from kinfmu.draw.writing import svg_text
from kinfmu.notebook.picture import picture


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
    """Return the picture of a fit as SVG.

    Raises:
        MissingPackageError: matplotlib is not installed.

    """
    return svg_text("this picture", lambda: figure_of(content_of(result)))
