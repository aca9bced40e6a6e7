"""What pictures of studies share: panels with names and units, and colours of measures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL, dress
from kinfmu.draw.scene import palette
from kinfmu.draw.sheet import FONT, GREY, INCH, INK, TITLE_FONT, TITLE_LINE, ink, title_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

EDGE = 8.0  # [pt] around the title


class Quantities(NamedTuple):
    """A column of a study: its name, its unit and its numbers (m,); datum: ' from 90 deg' where it is a deviation."""

    name: str
    unit: str
    values: FloatArray
    datum: str = ""

    @property
    def label(self) -> str:
        """'swing [rad]'; a pure number without its unit."""
        unit = "" if self.unit == "1" else f" [{self.unit.replace('2', chr(0xB2))}]"
        return f"{self.name}{self.datum}{unit}"


class PanelGrid(NamedTuple):
    """Panels on a sheet, all in points.

    rows, columns: Number of panels. width, height: Of a panel. between: Horizontal and vertical distance of panels.
    left, right, bottom: Margins.
    """

    rows: int
    columns: int
    width: float
    height: float
    between: tuple[float, float]
    left: float = 64.0
    right: float = 16.0
    bottom: float = 40.0


def sheet_of(layout: PanelGrid, title: str) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure with a title and its panels, row by row."""
    from matplotlib.figure import Figure

    across, down = layout.between
    width = layout.left + layout.columns * layout.width + (layout.columns - 1) * across + layout.right
    lines = title_lines(title, width - 2.0 * EDGE)
    top = EDGE + len(lines) * TITLE_LINE + 14.0
    height = top + layout.rows * layout.height + (layout.rows - 1) * down + layout.bottom
    made = Figure(figsize=(width / INCH, height / INCH), dpi=INCH, facecolor="white")
    look: dict[str, Any] = {"fontsize": TITLE_FONT, "va": "top", "color": ink(INK), "parse_math": False}
    made.text(EDGE / width, 1.0 - EDGE / height, "\n".join(lines), **look)
    panels = []
    for row in range(layout.rows):
        low = height - top - (row + 1) * layout.height - row * down
        left = [layout.left + column * (layout.width + across) for column in range(layout.columns)]
        size = (layout.width / width, layout.height / height)
        panels.append([made.add_axes((x / width, low / height, *size)) for x in left])
    for axes in (one for row in panels for one in row):
        dress(axes, "")
    return made, panels


def name_axes(axes: Axes, x: str, y: str) -> None:
    """Write the names of both axes; '' for none."""
    look: dict[str, Any] = {"fontsize": SMALL, "color": ink(GREY), "labelpad": 3.0, "parse_math": False}
    axes.set_xlabel(x, **look)
    axes.set_ylabel(y, **look)


def titled(axes: Axes, text: str) -> None:
    """Write the title of a panel."""
    axes.set_title(text, fontsize=FONT, loc="left", color=ink(INK), parse_math=False)


def colour_of(index: int) -> palette.Colour:
    """Return the colour of a measure by its place."""
    order = (5, 4, 2, 3, 0, 1)
    return palette.on_white(palette.BODIES[order[index % len(order)]])


def few_ticks(axes: Axes, x: int | None, y: int | None) -> None:
    """Limit the number of intervals between ticks."""
    if x is not None:
        axes.locator_params(axis="x", nbins=x)
    if y is not None:
        axes.locator_params(axis="y", nbins=y)
