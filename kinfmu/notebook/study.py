"""The results of a study: its summary, and its picture."""

from __future__ import annotations

from kinfmu.design.study import StudyResult
from kinfmu.design.study.figure import figure_of
from kinfmu.design.study.summary import about, disagreement, failures, measure_rows
from kinfmu.display import escaped, html_of, page, svg_of, table
from kinfmu.draw.writing import svg_text
from kinfmu.notebook.picture import picture


@html_of.register
def study_html(result: StudyResult) -> str:
    """Return the summary, the picture, a warning and the first failure of a study."""
    header, *rows = measure_rows(result)
    texts = [f"<p>{escaped(text)}</p>" for text in (disagreement(result), failures(result)) if text]
    shown = picture(lambda: study_svg(result), f"Picture of the study of {result.mechanism.name}")
    return page(about(result), table(rows, header), shown, *texts)


@svg_of.register
def study_svg(result: StudyResult) -> str:
    """Return the picture of a study as SVG.

    Raises:
        MissingPackageError: matplotlib is not installed.
        FigureError: There are too many parameters and measures for one picture.

    """
    return svg_text("this picture", lambda: figure_of(result, result.measures))
