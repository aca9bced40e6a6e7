"""The sheet of a figure: paper of the mechanism's proportions, lines in world coordinates, and what they cover."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.palette import Colour, tint
from kinfmu.draw.scene.strokes import BAR, STROKES, Painted, Sizes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOVE, _LINE, _CLOSE = 1, 2, 79  # codes of a path of matplotlib
INK: Colour = palette.INK
GREY: Colour = (110, 110, 110)
INCH = 72.0  # [pt]
FONT = 9.0  # [pt]
LINE = 11.0  # [pt], from line to line of a name in several lines
_WIDEST, _HIGHEST = 470.0, 380.0  # [pt], of the drawing
_SMALLEST = 120.0  # [pt]
_LONG, _LONGEST_STRIP = 6.0, 2.5  # width to height from which a drawing, such as a chain, may be wider; largest factor
_MARGIN = 34.0  # [pt]; for supports and names
_MARGIN_PART = 0.15  # of the shorter side of given axes, at most
_LEFT, _RIGHT, _BOTTOM, _TOP = 46.0, 12.0, 40.0, 28.0  # [pt] around the axes
_EDGE = 12.0  # [pt], margin left and below without axes
_SPACING = 3.0  # [pt] between the dots that record what is covered
_MATTERS = 0.8  # weight of a line for names; pins have more
TITLE_FONT = 11.0  # [pt]
TITLE_LINE = 15.0  # [pt], from line to line
TITLE_EDGE = 8.0  # [pt] around the title of a figure
MOST_LINES = 2  # of a title
_NOTE_FONT = 8.0  # [pt]
_THINNEST = 2.0  # [pt], width of the narrowest letters, i and l


class Sheet:
    """A sheet for a mechanism within `extent` (k, 2), whose links have the factor `fine` of the usual width.

    unit: of the axes, None for a sheet without axes and names, as in animations; given: Axes of another figure to draw
    into, which keep their size; point: length of a printer's point (1/72 inch) in the world.
    """

    def __init__(
        self, extent: FloatArray, fine: float, unit: str | None, title: str, given: Axes | None = None
    ) -> None:
        low, high = extent.min(axis=0), extent.max(axis=0)
        paper, scale = _paper_for(high - low) if given is None else _paper_of(given, high - low)
        self.point = float(1.0 / scale)
        self.sizes = Sizes(self.point, fine)
        self.low: FloatArray = (low + high) / 2.0 - paper / 2.0 / scale
        self.high: FloatArray = (low + high) / 2.0 + paper / 2.0 / scale
        self._has_names = unit is not None
        self._layer = 1.0
        self._dots: list[FloatArray] = []  # (k, 3): x, y [pt], weight
        self.axes = _new_axes(paper, bool(unit), title) if given is None else given
        _dress(self.axes, self.low, self.high, unit, title_lines(title, float(paper[0])), float(paper[1]))
        if given is not None:
            given.set_aspect("equal", adjustable="box")  # also after the figure is laid out anew

    @property
    def figure(self) -> Figure:
        """The figure of the sheet's own axes."""
        return cast("Figure", self.axes.figure)

    def to_paper(self, points: ArrayLike) -> FloatArray:
        """Return world coordinates (..., 2) as printer's points from the lower left corner."""
        return np.asarray((np.asarray(points, dtype=float) - self.low) / self.point)

    @property
    def bar(self) -> float:
        """Width of a link [pt]."""
        return BAR * self.sizes.fine

    @property
    def beyond(self) -> FloatArray:
        """Space for names beyond the upper right corner, (2,) [pt]."""
        return np.array([_RIGHT - 2.0, 0.0])

    @property
    def covered(self) -> FloatArray:
        """Dots (k, 3) on what is drawn so far: x, y [pt] from the lower left corner, and weight."""
        return np.vstack([np.empty((0, 3)), *self._dots])

    def line(
        self,
        points: ArrayLike,
        width: float,
        colour: Colour,
        *,
        matters: float = 1.0,
        closed: bool = False,
        fill: Colour | None = None,
        style: Any = "solid",
    ) -> None:
        """Draw a line of `width` [pt] through points (k, 2) with round ends; matters: its weight for names."""
        points = np.asarray(points, dtype=float)
        route = np.vstack([points, points[:1]]) if closed else points
        codes = [_MOVE, *[_LINE] * (len(route) - 1)]
        if closed:
            codes[-1] = _CLOSE
        self._add(route, codes, width, colour, fill, linestyle=style, capstyle="round", joinstyle="round")
        if matters:
            self.cover(route, matters, width)

    def paint(self, one: Painted) -> None:
        """Paint a stroke of a mechanism that is placed in the world."""
        colour, fill = one.colours()
        style = (0, one.stroke.dash) if one.stroke.dash else "solid"
        look: dict[str, Any] = {"closed": one.is_closed, "fill": fill, "style": style}
        self.line(
            one.points, self.sizes.width(one.stroke) / self.point, colour, matters=_MATTERS * one.is_first, **look
        )

    def dot(self, key: str, at: FloatArray, colour: Colour = INK) -> None:
        """Paint a pin or point (2,) as its row in the table of strokes has it."""
        (stroke,) = STROKES[key]
        fill = tint(stroke.fill, colour)
        line = tint(stroke.line, colour)
        self.circle(at, self.sizes.radius(stroke), stroke.width, line, fill=fill, matters=2.0)

    def circle(
        self,
        centre: ArrayLike,
        radius: float,
        width: float,
        colour: Colour,
        *,
        matters: float = 1.0,
        fill: Colour | None = None,
    ) -> None:
        """Draw a circle of `radius` [length] with a line of `width` [pt]."""
        from matplotlib.path import Path as Outline

        unit = Outline.unit_circle()
        centre = np.asarray(centre, dtype=float)
        self._add(centre + radius * np.asarray(unit.vertices), unit.codes, width, colour, fill)
        if matters:
            self.cover(arc(centre, radius, 0.0, 2.0 * np.pi), matters, width)

    def _add(
        self, points: FloatArray, codes: Any, width: float, colour: Colour, fill: Colour | None = None, **look: Any
    ) -> None:
        """Add a path of matplotlib, which covers all earlier ones."""
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path as Outline

        face = ink(fill) if fill else "none"
        path = Outline(points, codes)
        self.axes.add_artist(
            PathPatch(path, linewidth=width, edgecolor=ink(colour), facecolor=face, zorder=self._next(), **look)
        )

    def track(self, points: FloatArray, width: float, colour: Colour) -> None:
        """Draw the path of a point of a colour through points (n, 2), with gaps where they are NaN."""
        line = ink(tint(STROKES["path"][0].line, colour))
        self.axes.plot(*points.T, linewidth=width, color=line, zorder=self._next(), solid_capstyle="round")
        known = points[np.isfinite(points).all(axis=1)]
        if len(known) > 1:
            self.cover(known, 0.35, width)

    def cover(self, route: FloatArray, matters: float, width: float = 0.0) -> None:
        """Record that a line of `width` [pt] covers a route (k, 2), which names avoid."""
        if not self._has_names:
            return
        paper = self.to_paper(route)
        dots = [paper[:1]]
        for a, b in pairwise(paper):
            length = float(np.hypot(*(b - a)))
            if length == 0.0:
                continue
            count = max(int(np.ceil(length / _SPACING)), 1)
            along = a + (b - a) * (np.arange(1, count + 1) / count)[:, None]
            dots.append(along)
            if width > 2.0 * _SPACING:
                across = np.array([a[1] - b[1], b[0] - a[0]]) * (width / 2.0 / length)
                dots += [along + across, along - across]
        self._dots.append(np.column_stack([found := np.vstack(dots), np.full(len(found), matters)]))

    def text(self, at: ArrayLike, text: str, colour: Colour, *, italic: bool = False) -> None:
        """Write a name, of one or several lines, with its middle at `at` [pt from the lower left corner]."""
        x, y = self.low + np.asarray(at, dtype=float) * self.point
        look: dict[str, Any] = {"color": ink(colour), "fontsize": FONT, "parse_math": False, "zorder": 1000.0}
        look |= {"ha": "center", "va": "center" if "\n" in text else "center_baseline"}
        look["linespacing"] = 1.2  # of the height of a letter, which gives LINE
        self.axes.text(x, y, text, fontstyle="italic" if italic else "normal", **look)

    def note(self, text: str) -> None:
        """Write a sentence below the right end of the title's line."""
        if not text:
            return
        width = float((self.high - self.low)[0]) / self.point
        text = "\n".join(title_lines(text, width * TITLE_FONT / _NOTE_FONT))
        self.axes.text(
            1.0, 1.0, text, fontsize=_NOTE_FONT, ha="right", va="top", transform=self.axes.transAxes, color=ink(GREY)
        )

    def _next(self) -> float:
        """Return the next layer, which covers all earlier ones."""
        self._layer += 0.001
        return self._layer


def ink(colour: Colour) -> tuple[float, float, float]:
    """Return a colour for matplotlib."""
    red, green, blue = (value / 255.0 for value in colour)
    return red, green, blue


def arc(centre: ArrayLike, radius: float, first: float, last: float) -> FloatArray:
    """Return points (k, 2) on a circle from one angle [rad] to another."""
    angles = np.linspace(first, last, max(int(abs(last - first) / 0.1), 2) + 1)
    return np.asarray(centre, dtype=float) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _paper_for(size: FloatArray) -> tuple[FloatArray, float]:
    """Return the size of the paper (2,) [pt] for a drawing of `size` (2,) [length], and the scale [pt/length]."""
    width, height = size
    side = float(max(width, height)) or 1.0
    strip = min(max(1.0, width / max(_LONG * height, 1e-9 * side)), _LONGEST_STRIP)
    scale = min(strip * _WIDEST / max(width, 1e-9 * side), _HIGHEST / max(height, 1e-9 * side))
    return np.maximum(size * scale, _SMALLEST) + 2.0 * _MARGIN, float(scale)


def _paper_of(given: Axes, size: FloatArray) -> tuple[FloatArray, float]:
    """Return the size of Axes (2,) [pt], and the scale [pt/length] at which a drawing of `size` (2,) fits into them."""
    box = given.get_window_extent()
    paper = np.array([box.width, box.height]) * INCH / given.figure.dpi
    free = paper - 2.0 * min(_MARGIN, _MARGIN_PART * float(paper.min()))
    side = float(size.max()) or 1.0
    return paper, float((free / np.maximum(size, 1e-9 * side)).min())


def titled_figure(width: float, height: float, title: Sequence[str], edge: float = TITLE_EDGE) -> Figure:
    """Return a figure of a size [pt] with the lines of a title, `edge` [pt] from its upper left corner."""
    from matplotlib.figure import Figure

    made = Figure(figsize=(width / INCH, height / INCH), dpi=INCH, facecolor="white")
    look: dict[str, Any] = {"fontsize": TITLE_FONT, "va": "top", "color": ink(INK), "parse_math": False}
    made.text(edge / width, 1.0 - edge / height, "\n".join(title), **look)
    return made


def _new_axes(paper: FloatArray, has_names: bool, title: str) -> Axes:
    """Return axes of size `paper` [pt] in a new figure."""
    from matplotlib.figure import Figure

    left, bottom = (_LEFT, _BOTTOM) if has_names else (_EDGE, _EDGE)
    lines = title_lines(title, float(paper[0]))
    width = paper[0] + left + _RIGHT
    height = paper[1] + bottom + _TOP + max(len(lines) - 1, 0) * TITLE_LINE
    made = Figure(figsize=(width / INCH, height / INCH), dpi=INCH, facecolor="white")
    return made.add_axes((left / width, bottom / height, paper[0] / width, paper[1] / height))


def _dress(
    axes: Axes, low: FloatArray, high: FloatArray, unit: str | None, title: Sequence[str], height: float
) -> None:
    """Give axes of a height [pt] their limits, their title, and scales in the mechanism's unit of length."""
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    if not unit:
        axes.set_axis_off()
        axes.set_xticks([])  # placing ticks takes long, even if they are invisible
        axes.set_yticks([])
        above: Any = {"va": "bottom", "transform": axes.transAxes}
        axes.text(
            0.0, 1.0 + 6.0 / height, "\n".join(title), fontsize=TITLE_FONT, color=ink(INK), parse_math=False, **above
        )
        return
    grey = ink(GREY)
    axes.tick_params(labelsize=8.0, length=3.0, width=0.6, color=grey, labelcolor=grey)
    axes.set_xlabel(f"x [{unit}]", fontsize=8.0, color=grey, labelpad=2.0)
    axes.set_ylabel(f"y [{unit}]", fontsize=8.0, color=grey, labelpad=2.0)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_linewidth(0.6)
        spine.set_color(grey)
    axes.set_title("\n".join(title), fontsize=TITLE_FONT, loc="left", color=ink(INK), parse_math=False)


@lru_cache(maxsize=64)
def title_lines(title: str, width: float) -> list[str]:
    """Return the lines of a title, at most MOST_LINES, none wider than `width` [pt]; none if the title is ''."""
    title = title[: 2 * MOST_LINES * max(int(width / _THINNEST), 1)]  # the lines cannot hold more
    for count in range(max(min(len(title), int(width / _THINNEST)), 1), 1, -1):
        lines = textwrap.wrap(title, count)
        if len(lines) > MOST_LINES:
            lines = [*lines[: MOST_LINES - 1], f"{lines[MOST_LINES - 1]}\N{HORIZONTAL ELLIPSIS}"]
        if all(text_width(line, TITLE_FONT) <= width for line in lines):
            return lines
    return [title] if title else []


def text_width(line: str, size: float, style: Literal["normal", "italic"] = "normal") -> float:
    """Return the width of a line of text [pt]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size, style=style)
    return float(text_to_path.get_text_width_height_descent(line, font, ismath=False)[0])
