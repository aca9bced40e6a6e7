"""Style of charts, their horizontal axis, curves of a run with gaps for missing samples; overview(): its outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, finite
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.palette import Colour
from kinfmu.draw.sheet import FONT, GREY, INK, ink
from kinfmu.errors import FigureError, RequestError, suggestion
from kinfmu.run import Run
from kinfmu.run.axis import DEGREE, ROUND_OFF, axis_of, rates_per
from kinfmu.units import CoordinateName, ForceName, degrees_of, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

LIGHT: Colour = (228, 228, 228)
SMALL = 8.0  # [pt]
_PLAIN = (-2, 5)  # powers of ten of the largest number from which and below which axes have plain numbers
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_DEGREES = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0, 360.0, 720.0, 1440.0)  # steps of ticks


_GREEK = {"phi": "φ", "omega": "ω", "alpha": "\N{GREEK SMALL LETTER ALPHA}"}


class Look(NamedTuple):
    """Style of the curves of one engine."""

    colour: Colour
    width: float = 1.4  # [pt]
    marker: str = "o"


def dress(axes: Axes, title: str) -> None:
    """Give axes grey scales, a faint grid and no frame."""
    grey = ink(GREY)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_linewidth(0.6)
        spine.set_color(grey)
    axes.tick_params(labelsize=SMALL, length=3.0, width=0.6, color=grey, labelcolor=grey)
    axes.tick_params(which="minor", length=0.0)
    axes.grid(visible=True, which="major", linewidth=0.5, color=ink(LIGHT))
    axes.set_axisbelow(True)
    axes.set_title(title, fontsize=FONT + 1.0, loc="left", color=ink(INK), parse_math=False)


def span(values: FloatArray, edge: float) -> tuple[float, float]:
    """Return the ends of an axis for values (n,); edge: part of their range that it is longer on either side."""
    low, high = float(values.min()), float(values.max())
    more = edge * (high - low) or 0.5
    return low - more, high + more


def powers_of_ten(axes: Axes, values: FloatArray) -> None:
    """Give axes a vertical scale of whole powers of ten around positive values."""
    known = values[np.isfinite(values)]
    axes.set_yscale("log")
    if len(known):
        low, high = np.floor(np.log10(known.min())), np.ceil(np.log10(known.max()))
        axes.set_ylim(10.0**low, 10.0 ** max(high, low + 1.0))
    axes.yaxis.set_minor_formatter(lambda *_: "")


def numbers(axes: Axes, unit: str) -> str:
    """Give a vertical axis plain numbers, and return their unit: with a power of ten if they are tiny or huge."""
    size = float(np.abs(axes.get_ylim()).max())
    power = int(np.floor(np.log10(size))) if size > 0.0 else 0
    power = 0 if _PLAIN[0] <= power < _PLAIN[1] else 3 * (power // 3)

    def text(value: float, _: object = None) -> str:
        ticks = np.asarray(axes.yaxis.get_majorticklocs()) / 10.0**power
        step = float(np.diff(ticks).max(initial=0.0))
        digits = next((d for d in range(15) if (np.abs(ticks.round(d) - ticks) <= 1e-6 * step).all()), 15)
        shown = f"{round(value / 10.0**power, digits) + 0.0:.{digits}f}"
        return (shown.rstrip("0").rstrip(".") if digits else shown).replace("-", "\N{MINUS SIGN}")

    axes.yaxis.set_major_formatter(text)
    return unit if power == 0 else f"10{str(power).translate(_RAISED)} {'' if unit == '1' else unit}".rstrip()


def named(axes: Axes, at: tuple[float, float], text: str, colour: Colour, **where: Any) -> None:
    """Write a name next to its curve, in its colour, on a white background."""
    look: dict[str, Any] = {"color": ink(colour), "fontsize": SMALL, "parse_math": False, "zorder": 10.0}
    look["bbox"] = {"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8}
    offset = where.pop("offset", (0.0, 0.0))
    axes.annotate(text, at, xytext=offset, textcoords="offset points", **look, **where)


@dataclass(frozen=True, eq=False)
class Abscissa:
    """Values along the horizontal axis.

    name: of the axis or column; unit: as shown, '' without one; values: (n,) in this unit; is_axis: True for the axis
    of the run, on which gaps have a place.
    """

    name: str
    unit: str
    values: FloatArray
    is_axis: bool

    @property
    def label(self) -> str:
        """The name with its unit, such as 'crank.φ [deg]'."""
        return labelled(symbol(self.name), self.unit)

    @property
    def is_angle(self) -> bool:
        """True for an angle in degrees."""
        return self.unit == "deg"

    @property
    def angles(self) -> FloatArray:
        """The values as angles [rad], for polar plots; FigureError if they are no angles."""
        if self.unit not in ("deg", "rad"):
            raise FigureError(f"a polar plot needs an angle, not {self.label}")
        return self.values * DEGREE if self.is_angle else self.values


def abscissa(run: Run, name: str = "") -> Abscissa:
    """Return the horizontal axis for a column of a run, or for the axis of the run if no name is given."""
    if not name:
        axis = axis_of(run)
        return Abscissa(axis.name, axis.unit, axis.values, True)
    unit = unit_in(run, name)
    shown, factor = degrees_of(unit)
    return Abscissa(name, shown, np.asarray(run[name], dtype=float) * factor, False)


def unit_in(run: Run, name: str) -> str:
    """Return the unit of a column, also of one that never moves; KinfmuError for an unknown name."""
    units = run.column_units(kept=False)
    if name not in units:
        per = rates_per(run)
        held = {one.derivative(order): one.quantity(order, per) for one in run.fixed for order in range(3)}
        run[name]  # reports an unknown name
        return unit_of(held[name], run.length_unit)
    return units[name]


def symbol(column: str) -> str:
    """Return the name of a column with Greek letters, such as 'crank.φ' for 'crank.phi'."""
    owner, dot, noun = column.rpartition(".")
    return f"{owner}{dot}{_GREEK.get(noun, noun)}"


def labelled(name: str, unit: str) -> str:
    """Return 'coupler.ax [m/s2]' with a raised 2; numbers have no unit."""
    return f"{name} [{raised(unit)}]" if unit not in ("", "1") else name


def axis_label(name: str, unit: str, longest: int) -> str:
    """Return a name with its unit, on two lines if both have more letters than `longest`.

    The unit is on a line of its own, or else the name is broken behind a dot or underscore.
    """
    text = labelled(name, unit)
    if len(text) <= longest:
        return text
    if text != name and len(name) <= longest:
        return f"{name}\n{text.removeprefix(name).lstrip()}"
    breaks = [k + 1 for k, letter in enumerate(name) if letter in "._"] or [len(text)]
    at = min(breaks, key=lambda k: max(k, len(text) - k))
    return f"{text[:at]}\n{text[at:]}".rstrip("\n")


def label_size(label: str, longest: int, size: float) -> float:
    """Return the size of the letters [pt] with which the lines of a label are no longer than `longest` letters are."""
    return size * min(1.0, longest / max(1, *map(len, label.split("\n"))))


def degree_ticks(axis: Axis, most: int) -> None:
    """Give an axis of degrees at most this many steps, such as 30, 45 or 90 deg."""
    from matplotlib.ticker import MultipleLocator

    low, high = axis.get_view_interval()
    step = next((step for step in _DEGREES if abs(high - low) <= most * step), 0.0)
    if step and abs(high - low) >= 2.0 * step:  # else those that matplotlib chooses
        axis.set_major_locator(MultipleLocator(step))


def round_ticks(axis: Axis, most: int, unit: str) -> None:
    """Give an axis with a linear scale at most this many steps of 1, 2 or 5 times a power of ten, or as of degrees."""
    from matplotlib.ticker import MaxNLocator

    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10], min_n_ticks=3))
    if unit == "deg":
        degree_ticks(axis, most)


def raised(unit: str) -> str:
    """Return a unit with raised digits."""
    return unit.replace("2", "\N{SUPERSCRIPT TWO}").replace("3", "\N{SUPERSCRIPT THREE}")


def repeats_effort(run: Run, name: ForceName) -> bool:
    """Return True for a bias effort that equals its effort to round-off, as at constant speeds, in a run with both."""
    effort = f"{name.owner}.{name.noun.removeprefix('bias_')}"
    if not name.noun.startswith("bias_") or {name, effort} & run.absent:
        return False
    own, other = run[name], run[effort]
    largest = float(np.max(np.abs(other), initial=0.0, where=np.isfinite(other)))
    return bool(np.all(~run.good | (np.abs(own - other) <= ROUND_OFF * largest) | ~np.isfinite(own)))


def repeated(run: Run, names: Sequence[CoordinateName]) -> dict[CoordinateName, CoordinateName]:
    """Return which of the places named move as one before them does, to round-off, and that one.

    Angles never repeat one another: each belongs to its own body.
    """
    columns = {name: run[name][run.good] for name in names if not name.is_angle and name not in run.absent}
    near = ROUND_OFF * max((float(np.abs(values).max(initial=0.0)) for values in columns.values()), default=0.0)
    moving = {name: values for name, values in columns.items() if len(values) and np.ptp(values) > near}
    found: dict[CoordinateName, CoordinateName] = {}
    for name, values in moving.items():
        for other in moving:
            if other == name:
                break
            is_like = other.axis == name.axis and other not in found and abs(moving[other][0] - values[0]) <= near
            if is_like and np.abs(moving[other] - values).max() <= near:
                found[name] = other
                break
    return found


def equal_below(curves: Sequence[FloatArray]) -> list[int]:
    """Return for each curve (n,) how many later ones look the same; drawn wider by these, it stays visible."""
    known = np.concatenate([finite(values) for values in curves])
    seen = _SEEN * float(np.ptp(known)) if len(known) else 0.0

    def are_equal(one: FloatArray, other: FloatArray) -> bool:
        apart = np.abs(one - other)
        return bool(np.array_equal(np.isnan(one), np.isnan(other)) and np.all(apart[np.isfinite(apart)] <= seen))

    step = max(len(curves[0]) // _FEW, 1)  # a few samples tell most curves apart
    return [
        sum(are_equal(one[::step], other[::step]) and are_equal(one, other) for other in curves[k + 1 :])
        for k, one in enumerate(curves)
    ]


LOST: palette.Colour = (246, 222, 222)
_SEEN = 2e-3  # of the range of all curves, by which two must differ to be seen apart
_FEW = 50  # samples
_BINS = 1500  # of a long run; each shows its least and its greatest value
MOST_CURVES = 4  # of a panel
WIDTH, HEIGHT = 4.4, 2.4  # [in] of a panel


def curves(axes: Axes, run: Run, columns: Sequence[str] = (), x: str = "", *, degrees: bool = False) -> Axes:
    """Draw columns of a run into `axes` and return it; arguments and errors as in `plot` with `ax`."""
    names = _columns(run, columns)
    units = run.column_units()
    for name in names[1:]:
        if units[name] != units[names[0]]:
            raise FigureError(
                f"Axes show one unit, but '{names[0]}' is in {units[names[0]]} and '{name}' in {units[name]}; "
                "name columns of one unit"
            )
    if not len(run) or not names:
        raise FigureError(f"the run has no {'samples' if names else 'coordinates'} to plot")
    across = abscissa(run, x)
    shown, factor = degrees_of(units[names[0]]) if degrees else (units[names[0]], 1.0)
    for name in names:
        values = np.where(run.good, np.asarray(run[name], dtype=float), np.nan) * factor
        rows = np.union1d(rows_of(values), rows_of(across.values))
        is_curve = np.isfinite(values).sum() > 1
        axes.plot(across.values[rows], values[rows], marker="" if is_curve else "o", label=name)
    axes.set_xlabel(labelled(across.name, across.unit))
    unit = raised(shown)
    label = f"{names[0]} [{unit}]" if len(names) == 1 else f"[{unit}]"
    axes.set_ylabel(label if axes.get_ylabel() in ("", label) else f"[{unit}]")
    if len(axes.lines) > 1:
        axes.legend()
    for first, last in gaps(run, across.values) if across.is_axis else ():
        axes.axvspan(first, last, color=ink(LOST), linewidth=0.0, zorder=0.0)
    return axes


def _columns(run: Run, wanted: Sequence[str]) -> list[str]:
    """Return the names of the columns that were asked for."""
    if isinstance(wanted, str):
        raise RequestError(f"columns: '{wanted}' must be a list of names, such as ['{wanted}']")
    known = list(run.column_units())
    names: dict[str, None] = {}
    for name in wanted or run.names or run.outputs:
        found = [column for column in known if fnmatchcase(column, name)]
        if not found:
            run[name]  # reports why: unknown, or not kept
            raise RequestError(f"'{name}' does not move, so there is no curve{suggestion(name, known)}")
        names |= dict.fromkeys(found)
    return list(names)


def rows_of(values: FloatArray) -> NDArray[np.int64]:
    """Return samples that give the same picture as all: of long runs the extremes of short intervals, and gaps."""
    count = len(values)
    if count <= 4 * _BINS:
        return np.arange(count)
    found = [np.array([0, count - 1]), np.flatnonzero(np.diff(np.isfinite(values))) + np.array([[0], [1]])]
    edges = np.linspace(0, count, _BINS + 1).astype(int)
    for first, last in pairwise(edges):
        part = values[first:last]
        if np.isfinite(part).any():
            found.append(first + np.array([np.nanargmin(part), np.nanargmax(part)]))
    return np.unique(np.concatenate([rows.ravel() for rows in found]))


def gaps(run: Run, values: FloatArray) -> list[tuple[float, float]]:
    """Return for each gap the last sample with numbers before it and the first one after it."""
    turns = np.flatnonzero(np.diff(np.r_[True, run.good, True].astype(int)))  # first of a gap, first after it, ...
    last = len(run) - 1
    return [
        (float(values[max(begin - 1, 0)]), float(values[min(end, last)]))
        for begin, end in zip(turns[::2], turns[1::2], strict=True)
    ]


def overview(run: Run) -> Figure:
    """Return a figure of the first outputs of a run with samples, with a panel for each unit; needs matplotlib."""
    from matplotlib.figure import Figure

    outputs = shown_outputs(run)
    names = [name for name in outputs if name not in repeated(run, outputs)]
    by_unit = [[name for name in names if name.is_angle == is_angle] for is_angle in (False, True)]
    panels = [names for names in by_unit if names]
    figure = Figure(figsize=(WIDTH * max(len(panels), 1), HEIGHT), layout="constrained", facecolor="white")
    for index, names in enumerate(panels, start=1):
        axes = figure.add_subplot(1, len(panels), index)
        curves(axes, run, names[:MOST_CURVES], degrees=True)
        dress(axes, "")
        unit = "deg" if names[0].is_angle else run.length_unit
        axes.set_ylabel(unit)
        round_ticks(axes.xaxis, 6, axis_of(run).unit)
        round_ticks(axes.yaxis, 6, unit)
        more = f"and {len(names) - MOST_CURVES} more" if len(names) > MOST_CURVES else None
        axes.legend(
            labels=[symbol(name) for name in names[:MOST_CURVES]],
            title=more,
            fontsize=7.0,
            title_fontsize=7.0,
            frameon=False,
            loc="upper left",
            bbox_to_anchor=(1.0, 1.0),
        )
    return figure


def shown_outputs(run: Run) -> list[CoordinateName]:
    """Return the outputs that a run holds, points of interest first."""
    outputs = [*run.outputs[run.coordinate_count :], *run.names]
    return [name for name in outputs if name not in run.absent]
