"""StudyResult: the rows of a study, its summary and its picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from kinfmu.design.study.rows import StudyRows
from kinfmu.design.study.summary import summary
from kinfmu.display import Displayed

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
