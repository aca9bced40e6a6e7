"""plot(): coordinates of a run over time or driver values, with velocity and acceleration, and forces, for a report."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, overload

import numpy as np

from kinfmu.arrays import FloatArray, finite
from kinfmu.display import shortened
from kinfmu.draw.chart import (
    LOST,
    SMALL,
    axis_label,
    curves,
    dress,
    gaps,
    label_size,
    numbers,
    powers_of_ten,
    raised,
    repeated,
    repeats_effort,
    round_ticks,
    rows_of,
    span,
    symbol,
)
from kinfmu.draw.overlay import (
    LEAST,
    check_comparable,
    curve_colour,
    is_logarithmic,
    overlay,
    overlay_sheet,
    sheet_title,
    values_of,
)
from kinfmu.draw.scene import palette
from kinfmu.draw.sheet import FONT, GREY, INK, TITLE_EDGE, TITLE_FONT, TITLE_LINE, ink, title_lines, titled_figure
from kinfmu.draw.writing import check_suffix, check_target, write
from kinfmu.errors import FigureError, RequestError, listed
from kinfmu.run import Run
from kinfmu.run.axis import ROUND_OFF, Axis, axis_of, shown_range
from kinfmu.run.channels import chosen_columns, coordinates, forces
from kinfmu.units import CoordinateName, ForceName, InputName, SignalName, degrees_of, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_COORDINATES = 30  # more make a sheet too large to print
MOST_PANELS = 6  # of a plot for which no columns are named
_ABREAST = 3  # columns of panels in a row, at most
_WIDTH, _HEIGHT = 244.0, 96.0  # [pt], of a panel with its margins
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 22.0, 44.0, 34.0  # [pt] around all panels; the last tick has half its number there
_BETWEEN, _GAP, _BLOCK_GAP = 68.0, 14.0, 52.0  # [pt] between coordinates, their panels, and rows of coordinates
_FORCES: palette.Colour = (185, 28, 28)  # that of driving arrows in drawings
_LABEL = 42.0  # [pt] from an axis to its name
_BAND = 0.25  # opacity of bounds
_NOTE = 12.0  # [pt] of a line below all panels
_LONGEST_TITLE = 32  # letters of a name above its panels
_LONGEST = 20  # letters of a name with its unit that fit next to a panel in one line


class Bounding(Protocol):
    """A certificate: bounds of outputs at times or values of a driver."""

    @property
    def driver(self) -> str:
        """What it is over: a driver, or 'time'."""

    def enclosed(self, of: str, x: FloatArray, order: int = 0) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds of an output, its rate or acceleration."""


@overload
def plot(
    run: Run,
    path: str | Path,
    columns: Sequence[str] = (),
    *,
    ax: None = None,
    x: str | Sequence[str] = (),
    overlaid: bool = False,
    polar: bool = False,
    degrees: bool | None = None,
    other: Run | None = None,
    names: tuple[str, str] = ("A", "B"),
    certificate: Bounding | None = None,
) -> None: ...


@overload
def plot(
    run: Run,
    path: None = None,
    columns: Sequence[str] = (),
    *,
    ax: Axes,
    x: str | Sequence[str] = (),
    degrees: bool = False,
) -> Axes: ...


def plot(
    run: Run,
    path: str | Path | None = None,
    columns: Sequence[str] = (),
    *,
    ax: Axes | None = None,
    x: str | Sequence[str] = (),
    overlaid: bool = False,
    polar: bool = False,
    degrees: bool | None = None,
    other: Run | None = None,
    names: tuple[str, str] = ("A", "B"),
    certificate: Bounding | None = None,
) -> Axes | None:
    """Draw `run` over its axis, usually time, or over any column, into a file or into Axes of matplotlib.

    In a file, each coordinate has three panels: position, velocity and acceleration, in deg and the mechanism's unit of
    length; so has each driver whose inputs are named. Diagnostics that are named have a panel each; residuals, margin
    and errors on a scale of powers of ten. With masses or loads, efforts and energies have a panel each, and so have
    reactions that are named, in SI units. Constants have no panels: a line below states their values. Samples without
    numbers are gaps on a tinted background; a panel of a column that was not kept has the text "not kept". The same run
    gives the same bytes. Into Axes, each column is a curve with its name as the label, in your settings of matplotlib;
    several calls draw several runs into the same Axes.

    With `x`, `overlaid` or `polar` the named columns themselves are the curves, those of one unit in one panel. Angles
    along the horizontal axis are in degrees. Positions over positions, such as coupler curves, have equal
    scales, and so have velocities over velocities, accelerations over accelerations and forces over forces.

    Args:
        run: The run.
        path: The .svg, .png or .pdf file.
        columns: Of a file: names such as 'coupler.x', 'coupler.*', 'q', '-crank.phi' or 'reactions', as in tables.
            Default: six panels, of points of interest, sliding and turning bodies and the first effort, and a line that
            names what else moves. With `ax`: columns of one unit, such as
            'coupler.vx', with * for any letters. Default: all generalized coordinates, if they have one unit.
        ax: Axes to draw into, in place of a file.
        x: The column along the horizontal axis, or one for each curve. Default: time, or the driver's value.
        overlaid: True: curves of one unit in one panel.
        polar: True: the horizontal axis, an angle, is the polar angle.
        degrees: True: angles in deg, and angular rates in deg/s and deg/s2; False: in rad. Default: True in a file.
        other: A second run, drawn narrow over the first one, which is wide.
        names: Of the two runs, for the title.
        certificate: Of the run, `certify(mechanism, over="run")`: panels of a file have its bounds as a band, which is
            wide with tolerances.

    Returns:
        `ax`; None for a file.

    Raises:
        RequestError: A name is not a column, or chooses nothing that moves.
        KinfmuError: A run does not hold a column.
        FigureError: There are too many curves for one sheet, the run has no samples, the suffix is unknown, or the file
            cannot be written; neither or both of `path` and `ax` are given; curves for `ax` have two units; a polar
            plot has no angle; the two runs have different units or axes.
        MissingPackageError: matplotlib is not installed.

    """
    check_target("plot", path, ax)
    xs = (x,) if isinstance(x, str) else tuple(x)
    if ax is not None:
        if overlaid or polar or other is not None or len(xs) > 1 or certificate:
            raise FigureError(
                "overlaid, polar, other, certificate and several x are for files; call plot again to add curves to ax"
            )
        return curves(ax, run, columns, *xs, degrees=bool(degrees))
    path = Path(str(path))
    check_suffix(path)
    runs = (run,) if other is None else (run, other)
    check_comparable(runs)
    degrees = degrees is not False
    if certificate is not None and (
        not axis_of(run).is_time or certificate.driver != "time" or xs or overlaid or polar
    ):
        raise FigureError("a band needs panels over the run and its certificate: certify(mechanism, over='run')")
    if xs or overlaid or polar:
        shown = overlay(runs, names, columns, xs, degrees=degrees, polar=polar)
        write(path, lambda: overlay_sheet(shown))
    else:
        stacks, notes = _chosen(runs, columns, path, degrees=degrees)
        write(path, lambda: _sheet(runs, stacks, names, notes, degrees=degrees, certificate=certificate))
    return None


def _chosen(runs: Sequence[Run], columns: Sequence[str], path: Path, *, degrees: bool) -> tuple[list[Stack], list[str]]:
    """Return the stacks of panels to plot, and lines on what has no panel."""
    run = runs[0]
    found = stacks_of(run, columns, *runs[1:])
    wanted = [panel.column for stack in found for panel in stack.panels]
    if not len(run) or not found:
        raise FigureError(f"{path}: the run has no {'samples' if found else 'coordinates'} to plot")
    if all(column in run.absent for column in wanted):
        raise FigureError(
            f"{path}: the run does not keep {listed(wanted[:3])}{', ...' if len(wanted) > 3 else ''}; "
            "keep them: --channels all, or their names"
        )
    stacks, constant = moving(runs, found, keeps_one=bool(columns))
    notes = [_constants(run, constant, degrees=degrees)]
    if not columns:
        stacks, others = main_panels(run, stacks or found)
        notes.append(not_drawn(run, others, *runs[1:]))
    if len(stacks) > MOST_COORDINATES:
        what = (
            "coordinates" if all(isinstance(s.panels[0].name, CoordinateName) for s in stacks) else "columns of panels"
        )
        raise FigureError(
            f"{path}: {len(stacks)} {what} are too many for one sheet, which holds {MOST_COORDINATES}; choose some "
            f"of them by name, such as {stacks[0].panels[0].column}"
        )
    return stacks, [*filter(None, notes)]


def not_drawn(run: Run, names: Sequence[str], *others: Run) -> str:
    """Return 'not drawn: crank.φ, slider.x (= piston.x)' for names and what repeats another curve; '' without any."""
    equal = [f"{symbol(name)} (= {symbol(other)})" for name, other in _usual_and_repeated(run, *others)[1].items()]
    left = [*map(symbol, names), *equal]
    return f"not drawn: {', '.join(left)}" if left else ""


def moving(runs: Sequence[Run], stacks: Sequence[Stack], *, keeps_one: bool) -> tuple[list[Stack], list[Panel]]:
    """Return stacks without the panels of constants, and the first of these of each stack.

    keeps_one: True: a stack of constants alone keeps its first panel.
    """
    found, constant = [], []
    for stack in stacks:
        held = [all(_is_constant(run, panel) for run in runs) for panel in stack.panels]
        panels = tuple(panel for panel, is_held in zip(stack.panels, held, strict=True) if not is_held)
        if not panels and keeps_one:
            panels = stack.panels[:1]
        elif any(held):
            constant.append(stack.panels[held.index(True)])
        if panels:
            found.append(stack._replace(panels=panels))
    return found, constant


def _is_constant(run: Run, panel: Panel) -> bool:
    """Return True for a column of several numbers that are equal to round-off."""
    known = finite(values_of(run, panel.column)) if panel.column not in run.absent else np.empty(0)
    if len(known) < 2:
        return False
    size = max(float(np.abs(known).max()), _usual(run, axis_of(run), panel))
    return bool(np.ptp(known) <= ROUND_OFF * size)


def _constants(run: Run, panels: Sequence[Panel], *, degrees: bool) -> str:
    """Return 'constant: crank.ω = 6 deg/s, rod.φ = 0 deg', '' without any."""
    found = []
    for panel in panels:
        unit, factor = degrees_of(panel.unit) if degrees else (panel.unit, 1.0)
        value = float(finite(values_of(run, panel.column))[0])
        value *= abs(value) > ROUND_OFF * _usual(run, axis_of(run), panel)
        if panel.order and value == 1.0 and axis_of(run).per != "time":
            continue  # of the driver over itself
        text = f"{float(f'{value * factor + 0.0:.4g}'):.12g}".replace("-", "\N{MINUS SIGN}")
        found.append(f"{symbol(panel.column)} = {text} {raised('' if unit == '1' else unit)}".rstrip())
    return f"constant: {', '.join(found)}" if found else ""


def main_panels(run: Run, stacks: Sequence[Stack]) -> tuple[list[Stack], list[str]]:
    """Return the stacks of at most MOST_PANELS panels that show most of a motion, and names of what else moves.

    First are points of interest, then bodies that slide, turn, or do both; last is what follows a driver at a constant
    ratio. The first effort has its place behind the first coordinate.
    """
    kept = [stack._replace(panels=panels) for stack in stacks if (panels := _kept_panels(run, stack))]
    coordinates = ranked(run, kept)
    forces = [one for one in kept if not _is_coordinate(one)]
    first = [forces[0]._replace(panels=forces[0].panels[:2])] if forces else []
    shown: list[Stack] = []
    for stack in (*coordinates[:1], *first, *coordinates[1:], *forces[len(first) :]):
        free = MOST_PANELS - sum(len(one.panels) for one in shown)
        if free:
            shown.append(stack._replace(panels=stack.panels[:free]))
    drawn = {panel.column for stack in shown for panel in stack.panels}
    names = [stack.title if _is_coordinate(stack) else panel.column for stack in kept for panel in stack.panels]
    columns = [panel.column for stack in kept for panel in stack.panels]
    left = dict.fromkeys(name for name, column in zip(names, columns, strict=True) if column not in drawn)
    return shown, [name for name in left if name not in drawn]


def ranked(run: Run, stacks: Sequence[Stack]) -> list[Stack]:
    """Return the stacks of coordinates, those that show most of a motion first."""
    return sorted((one for one in stacks if _is_coordinate(one)), key=lambda stack: _rank(run, stack))


def _is_coordinate(stack: Stack) -> bool:
    return isinstance(stack.panels[0].name, CoordinateName)


def _kept_panels(run: Run, stack: Stack) -> tuple[Panel, ...]:
    """Return the panels of a stack that the run keeps, without bias efforts that repeat their efforts."""
    return tuple(
        panel
        for panel in stack.panels
        if panel.column not in run.absent
        and not (isinstance(panel.name, ForceName) and repeats_effort(run, panel.name))
    )


def _rank(run: Run, stack: Stack) -> tuple[bool, int]:
    """Return the rank of a coordinate: lower ones are drawn first."""
    name = next(output for output in run.outputs if output == stack.title)
    is_point = name in run.outputs[run.coordinate_count :] and bool(run.names)
    turns = any(other.is_angle and other.owner == name.owner for other in run.names)
    follows = len(stack.panels) == 1 and not is_point and name.derivative(1) not in run.absent
    return follows, 0 if is_point else 2 if name.is_angle else 3 if turns else 1


def _sheet(
    runs: Sequence[Run],
    stacks: Sequence[Stack],
    names: tuple[str, str] = ("A", "B"),
    notes: Sequence[str] = (),
    *,
    degrees: bool = False,
    certificate: Bounding | None = None,
) -> Figure:
    axis = axis_of(runs[0])
    abreast = -(-len(stacks) // -(-len(stacks) // _ABREAST))  # rows of about the same length
    rows = [stacks[k : k + abreast] for k in range(0, len(stacks), abreast)]
    blocks = [max(len(stack.panels) for stack in row) * _HEIGHT + _BLOCK_GAP for row in rows]
    width = _LEFT + abreast * _WIDTH - _BETWEEN + _RIGHT
    title = title_lines(sheet_title(runs, names), width - 2.0 * TITLE_EDGE)
    below = [line for note in notes for line in title_lines(note, (width - 2.0 * TITLE_EDGE) * TITLE_FONT / SMALL)]
    above = _TOP + max(len(title) - 1, 0) * TITLE_LINE
    height = above + sum(blocks) - _BLOCK_GAP - _GAP + _BOTTOM + len(below) * _NOTE
    made = titled_figure(width, height, title)
    if below:
        look: dict[str, Any] = {"fontsize": SMALL, "va": "bottom", "color": ink(GREY), "parse_math": False}
        made.text(TITLE_EDGE / width, 0.5 * TITLE_EDGE / height, "\n".join(below), linespacing=1.25, **look)
    for index, stack in enumerate(stacks):
        row, column = divmod(index, abreast)
        left = _LEFT + column * _WIDTH
        panels: list[Axes] = []
        for place, panel in enumerate(stack.panels):
            top = height - above - sum(blocks[:row]) - place * _HEIGHT
            size = ((_WIDTH - _BETWEEN) / width, (_HEIGHT - _GAP) / height)
            axes = made.add_axes((left / width, (top - _HEIGHT + _GAP) / height, *size))
            panels.append(axes)
            band = _band(runs[0], panel, certificate)
            _panel(axes, runs, panel, degrees=degrees, band=band)
        for axes in panels[:-1]:
            axes.tick_params(labelbottom=False)
        name = shortened(symbol(stack.title), _LONGEST_TITLE)
        panels[0].set_title(name, fontsize=FONT + 1.0, loc="left", color=ink(INK), parse_math=False)
        panels[-1].set_xlabel(axis.label, fontsize=SMALL, color=ink(GREY), labelpad=1.0)
        for axes in panels:
            axes.yaxis.set_label_coords(-_LABEL / (_WIDTH - _BETWEEN), 0.5)
    return made


def _band(run: Run, panel: Panel, certificate: Bounding | None) -> tuple[FloatArray, FloatArray] | None:
    """Return the bounds of a coordinate at the samples of a run; None of what has none."""
    if certificate is None or not isinstance(panel.name, CoordinateName):
        return None
    with suppress(RequestError):  # another mechanism's, or what never moves
        return certificate.enclosed(panel.name, run.t, panel.order)
    return None


def _panel(
    axes: Axes,
    runs: Sequence[Run],
    panel: Panel,
    *,
    degrees: bool,
    band: tuple[FloatArray, FloatArray] | None = None,
) -> None:
    """Draw one curve over each whole run; band: lower and upper bounds of the first one."""
    is_force = isinstance(panel.name, (ForceName, SignalName))
    is_log = is_logarithmic(panel.column)
    unit, factor = degrees_of(panel.unit) if degrees else (panel.unit, 1.0)
    colour = _FORCES if is_force else curve_colour((0, 2, 1)[panel.order])
    everything = []
    for number, run in enumerate(runs):
        is_wide = number + 1 < len(runs)
        values = np.full(len(run), np.nan)
        if panel.column not in run.absent:
            values = values_of(run, panel.column)
        everything.append(values[np.isfinite(values)])
        shown = np.maximum(np.abs(values), LEAST) if is_log else values * factor
        rows = rows_of(values)
        look: dict[str, Any] = {"color": ink(palette.lighter(colour) if is_wide else colour)}
        look |= {"linewidth": 3.6 if is_wide else 1.2, "solid_joinstyle": "round"}
        if len(everything[-1]) < 2:
            look |= {"marker": "o", "markersize": 3.0}
        axes.plot(axis_of(run).values[rows], shown[rows], **look)
    if band is not None:
        shade: dict[str, Any] = {"color": ink(colour), "alpha": _BAND, "linewidth": 0.0, "zorder": 1.0}
        axes.fill_between(axis_of(runs[0]).values, band[0] * factor, band[1] * factor, **shade)
        everything += [end[np.isfinite(end)] for end in band]
    dress(axes, "")
    run, axis, known = runs[0], axis_of(runs[0]), np.concatenate(everything)
    axes.set_xlim(*span(np.concatenate([axis_of(one).values for one in runs]), 0.01))
    round_ticks(axes.xaxis, 6, axis.unit)
    if is_log:
        powers_of_ten(axes, np.maximum(np.abs(known), LEAST))
    else:
        limits = _shown(run, axis, panel, known)
        if limits:
            axes.set_ylim(limits[0] * factor, limits[1] * factor)
        round_ticks(axes.yaxis, 5, unit)
        unit = numbers(axes, unit)
    label = axis_label(symbol(panel.label), unit, _LONGEST)
    axes.set_ylabel(label, fontsize=label_size(label, _LONGEST, SMALL), color=ink(GREY), labelpad=3.0)
    is_kept = all(panel.column not in one.absent for one in runs)
    if not is_kept or (is_force and not len(known)):
        words = "not determined" if is_kept else "not kept"
        axes.text(0.5, 0.5, words, fontsize=SMALL, ha="center", transform=axes.transAxes, color=ink(GREY))
    for one in runs:
        for first, last in gaps(one, axis_of(one).values):
            axes.axvspan(first, last, color=ink(LOST), linewidth=0.0, zorder=0.0)


def _shown(run: Run, axis: Axis, panel: Panel, known: FloatArray) -> tuple[float, float] | None:
    """Return the range of an axis, so that noise about a constant is a straight line; None for matplotlib's default."""
    if not len(known):
        return -1.0, 1.0
    usual = _usual(run, axis, panel)
    if np.ptp(known) <= ROUND_OFF * np.abs(known).max():
        middle = float(known.mean())
        half = 0.5 * abs(middle) or usual or 1.0
        return middle - half, middle + half
    return shown_range(known, usual)


def _usual(run: Run, axis: Axis, panel: Panel) -> float:
    """Return the size of what is like a curve: positions with their derivatives, or efforts of the same quantity."""
    name = panel.name
    if not isinstance(name, (CoordinateName, ForceName)):
        return float(np.max(np.abs(run[name]), initial=0.0, where=np.isfinite(run[name])))
    if isinstance(name, ForceName):
        tables = ((run.force_names, run.forces), (run.reaction_names, run.reactions))
        names, table = tables[name not in run.force_names]  # the size of a force is like its components
        like = np.asarray(table)[:, [other.quantity == name.quantity for other in names]]
    else:
        like = run.values[run.good][:, [other.is_angle == name.is_angle for other in run.outputs]]
    size = float(np.max(np.abs(like), initial=0.0, where=np.isfinite(like)))
    return size if isinstance(name, ForceName) else size / (axis.span or 1.0) ** panel.order


_PANELS = 3  # of a stack, at most
_DIAGNOSTICS = ("solver.", "watch.")


class Panel(NamedTuple):
    """A panel: a column, its name on the axis, its unit, order of derivative, and the coordinate, force, ... it is."""

    column: str
    label: str
    unit: str
    order: int
    name: CoordinateName | ForceName | SignalName | InputName | str  # a diagnostic is only a str


class Stack(NamedTuple):
    """Panels below each other, with a title."""

    title: str
    panels: tuple[Panel, ...]


def stacks_of(run: Run, columns: Sequence[str], *compared: Run) -> list[Stack]:
    """Return what to plot: a stack for each coordinate, and for the forces of each driver or joint.

    compared: runs drawn with it, in which places must repeat too to be left out.
    """
    others = _inputs_and_diagnostics(run, columns)
    if others:
        columns = [name for name in columns if not _only_chooses(run, name, others)]
    found = _of_coordinates_and_forces(run, columns, compared) if columns or not others else []
    return found + _of_others(run, others)


def _of_coordinates_and_forces(run: Run, columns: Sequence[str], compared: Sequence[Run]) -> list[Stack]:
    """Return the stacks of coordinates, forces and signals."""
    chosen = forces(run, columns)
    names = list(columns)
    if chosen and not any(name.startswith("-") for name in names):
        names = [name for name in names if not forces(run, [name]) or _chooses_coordinates(run, name)]
    coordinate_names: Sequence[CoordinateName] = usual_coordinates(run, *compared)
    if columns:
        coordinate_names = coordinates(run, names) if names else ()
    per = axis_of(run).per
    found = []
    for name in coordinate_names:
        nouns = [name.derivative(order) for order in range(3)]
        units = [unit_of(name.quantity(order, per), run.length_unit) for order in range(3)]
        panels = [
            Panel(column, column.removeprefix(f"{name.owner}."), unit, order, name)
            for order, (column, unit) in enumerate(zip(nouns, units, strict=True))
        ]
        found.append(Stack(name, tuple(panels)))
    for title in dict.fromkeys(map(_title_of, chosen)):
        panels = [_of_force(name, run.length_unit) for name in chosen if _title_of(name) == title]
        found += _stacked(title, panels)
    return found


def usual_coordinates(run: Run, *others: Run) -> list[CoordinateName]:
    """Return the coordinates to plot where none are named: of bodies and points of interest.

    Places of the frames of bodies that turn are left out if there are points of interest: where the frame of a body has
    its origin is a choice of the file, and the points are those that matter. So are places that another one repeats.
    """
    usual, left_out = _usual_and_repeated(run, *others)
    return [name for name in usual if name not in left_out]


def _usual_and_repeated(run: Run, *others: Run) -> tuple[list[CoordinateName], dict[CoordinateName, CoordinateName]]:
    """Return usual coordinates, and which repeat another one in all runs, a point of interest if there is one."""
    points = [name for name in run.outputs[run.coordinate_count :] if name not in run.absent]
    names = run.names or run.outputs
    turning = {name.owner for name in names if name.is_angle and points}
    bodies = [name for name in names if name.is_angle or name.owner not in turning]
    points = points if run.names else []
    equal = repeated(run, [*points, *bodies])
    for other in others:
        equal = {
            name: first
            for name, first in equal.items()
            if {name, first} <= {*other.outputs} and name in repeated(other, [first, name])
        }
    return [*bodies, *points], equal


def _title_of(name: ForceName | SignalName) -> str:
    """Return the title of the stack of a force or a signal: its driver or joint; external loads belong to 'loads'."""
    if isinstance(name, SignalName):
        return name.owner or "signals"
    if name.owner or name.quantity.kind == "energy":
        return name.owner or "energy"
    return "shaking" if name.noun.startswith("shaking") else "loads"


def _stacked(title: str, panels: Sequence[Panel]) -> list[Stack]:
    """Return stacks of about the same height, at most _PANELS; those after the first continue it."""
    count = -(-len(panels) // _PANELS)
    high = -(-len(panels) // count)
    parts = [tuple(panels[k : k + high]) for k in range(0, len(panels), high)]
    return [Stack(title if k == 0 else f"{title}, continued", part) for k, part in enumerate(parts)]


def _inputs_and_diagnostics(run: Run, columns: Sequence[str]) -> list[str]:
    """Return the inputs and diagnostics that names choose; none if the first name begins with a minus."""
    if not columns or columns[0].startswith("-"):
        return []
    known = {*run.input_names, *(place.name for place in run.places(kept=False) if place.name.startswith(_DIAGNOSTICS))}
    chosen: list[str] = []
    for name in columns:
        try:
            found = set(chosen_columns(run, [name]))
        except RequestError:
            continue  # reported with the coordinates
        chosen += [column for column in chosen_columns(run, [name]) if column in found & known and name != "all"]
    return list(dict.fromkeys(chosen))


def _only_chooses(run: Run, name: str, others: Sequence[str]) -> bool:
    """Return True if all columns that a name chooses are among others."""
    try:
        return set(chosen_columns(run, [name])) <= {*others}
    except RequestError:
        return False


def _of_others(run: Run, columns: Sequence[str]) -> list[Stack]:
    """Return a stack for each driver whose inputs are chosen, and stacks of diagnostics."""
    found = []
    units = {place.name: place.unit for place in run.places(kept=False)}
    inputs = [name for name in run.input_names if name in columns]
    for driver in dict.fromkeys(name.driver for name in inputs):
        own = [name for name in inputs if name.driver == driver]
        label = {name: name.removeprefix(f"{driver}_") for name in own}
        panels = [Panel(name, label[name], units[name], name.quantity.order, name) for name in own]
        found.append(Stack(driver, tuple(panels)))
    for owner in ("solver", "watch"):
        of_owner = [column for column in columns if column.startswith(f"{owner}.")]
        panels = [Panel(column, column.removeprefix(f"{owner}."), units[column], 0, column) for column in of_owner]
        if panels:
            found += _stacked(owner, panels)
    return found


def _of_force(name: ForceName | SignalName, length_unit: str) -> Panel:
    """Return the panel of a force or a signal."""
    if isinstance(name, SignalName):
        return Panel(name, name.removeprefix(f"{name.owner}."), name.unit, 0, name)
    return Panel(name, name.noun, unit_of(name.quantity, length_unit), 0, name)


def _chooses_coordinates(run: Run, name: str) -> bool:
    """Return True if a name of columns chooses coordinates."""
    try:
        return bool(coordinates(run, [name]))
    except RequestError:
        return False
