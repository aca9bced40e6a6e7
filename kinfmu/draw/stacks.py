"""What a plot of a run shows in panels below each other: coordinates with their rates, forces, inputs, diagnostics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kinfmu.errors import RequestError
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.channels import chosen_columns, coordinates, forces
from kinfmu.units import CoordinateName, ForceName, InputName, SignalName, unit_of

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


def stacks_of(run: Run, columns: Sequence[str]) -> list[Stack]:
    """Return what to plot: a stack for each coordinate, and for the forces of each driver or joint."""
    others = _inputs_and_diagnostics(run, columns)
    if others:
        columns = [name for name in columns if not _only_chooses(run, name, others)]
    found = _of_coordinates_and_forces(run, columns) if columns or not others else []
    return found + _of_others(run, others)


def _of_coordinates_and_forces(run: Run, columns: Sequence[str]) -> list[Stack]:
    """Return the stacks of coordinates, forces and signals."""
    chosen = forces(run, columns)
    names = list(columns)
    if chosen and not any(name.startswith("-") for name in names):
        names = [name for name in names if not forces(run, [name]) or _chooses_coordinates(run, name)]
    coordinate_names: Sequence[CoordinateName] = usual_coordinates(run)
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


def usual_coordinates(run: Run) -> list[CoordinateName]:
    """Return the coordinates to plot where none are named: of bodies and points of interest.

    Places of the frames of bodies that turn are left out if there are points of interest: where the frame of a body has
    its origin is a choice of the file, and the points are those that matter.
    """
    points = [name for name in run.outputs[run.coordinate_count :] if name not in run.absent]
    names = run.names or run.outputs
    turning = {name.owner for name in names if name.is_angle and points}
    return [*(name for name in names if name.is_angle or name.owner not in turning), *(points if run.names else ())]


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
