"""Channels: which columns of a run are kept, and at which samples; others are not computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase

import numpy as np

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.errors import RequestError, listed, suggestion
from kinfmu.run.axis import TIME
from kinfmu.run.run import Run
from kinfmu.units import CoordinateName, ForceName, SignalName, unit_of

ALWAYS = ("time", "solver.status")  # without them a sample has no meaning
DRAWN = "drawn"
GROUPS_OF_COORDINATES = ("q", "points", "all")
ROUNDING = 1e-9  # of a period: a sample may be early by this


def absent_columns(run: Run, names: Sequence[str] | None) -> frozenset[str]:
    """Return the columns of a run that `names` do not choose.

    Args:
        run: The run, with or without samples.
        names: 'all', 'none'; groups 'inputs', 'q', 'qd', 'qdd', 'points' (of interest, with rates), 'forces' (efforts,
            inertias, energies), 'reactions', 'signals' (of other FMUs), 'residual', 'iterations', 'margin', 'error',
            'watch'; columns such as 'coupler.vx', with * for any letters; 'drawn', the topics of an MCAP file that
            viewers draw by themselves. A minus in front leaves out: ['-error', '-margin'] is all but those. None: all.

    Returns:
        Names of the absent columns. Time and status are always kept, and the inputs of a run over these; for the size
        of a force its components.

    Raises:
        RequestError: A name is unknown.

    """
    if names is None:
        return run.absent
    sizes, kept = run.force_sizes, kept_columns(run, names)
    kept |= {component for size, components in sizes.items() if size in kept for component in components}
    absent = {place.name for place in run.places()} - kept | run.absent
    return frozenset(absent | {size for size, components in sizes.items() if not absent.isdisjoint(components)})


def kept_columns(run: Run, names: Sequence[str]) -> frozenset[str]:
    """Return the columns of a run that `names` choose, with those that are always kept.

    Args:
        run: The run, with or without samples.
        names: As in `absent_columns`.

    Raises:
        RequestError: A name is unknown.

    """
    groups, columns = _groups(run), list(run.column_units())
    for name, value in run.fixed.items():
        if {name, f"-{name}"} & {*names}:
            unit = unit_of(name.quantity(), run.length_unit)
            raise RequestError(f"channel '{name}' is not a column: the joints hold it at {value + 0.0:.9g} {unit}")
    kept = _kept(names, lambda name: _chosen(name, groups, columns))
    minus = (name[1:] for name in names if name.startswith("-"))
    left_out = {column for name in minus for column in _chosen(name, groups, columns)} - kept
    without = {size for size, components in run.force_sizes.items() if not left_out.isdisjoint(components)}
    return frozenset(kept - without) | {*ALWAYS, *_of_axis(run)}


def _of_axis(run: Run) -> tuple[str, ...]:
    """Return the inputs that the axis of a run and its rates depend on."""
    return () if run.axis == TIME else run.input_names


def is_drawn(names: Sequence[str] | None) -> bool:
    """Return True if `names` choose the topics that viewers draw by themselves."""
    return DRAWN in _kept(names, lambda name: {DRAWN} if name in ("all", DRAWN) else set())


def is_all_but(names: Sequence[str] | None) -> bool:
    """Return True if `names` are all columns, without those that they name with a minus."""
    return names is None or bool(names and names[0].startswith("-"))


def _kept(names: Sequence[str] | None, columns_of: Callable[[str], set[str]]) -> set[str]:
    """Return what is kept after each name has added its columns or removed them."""
    kept = set(columns_of("all")) if is_all_but(names) else set()
    for name in names or ():
        found = columns_of(name.removeprefix("-"))
        kept = kept - found if name.startswith("-") else kept | found
    return kept


def kept_samples(t: FloatArray, rate: float | None) -> IntArray:
    """Return the places of the samples kept at a rate: the first in every period, and the last.

    Args:
        t: (n,) times [s].
        rate: Samples kept per second [1/s]; None: all.

    Returns:
        Indices of the samples.

    Raises:
        RequestError: The rate is not positive and finite.

    """
    if rate is None or not len(t):
        return np.arange(len(t))
    if not (np.isfinite(rate) and rate > 0.0):
        raise RequestError(f"rate = {rate:g} samples a second must be positive and finite")
    periods = np.floor((t - t[0]) * rate + ROUNDING)
    is_kept = np.diff(periods, prepend=periods[0] - 1.0) != 0.0
    is_kept[-1] = True
    return np.flatnonzero(is_kept)


def select(run: Run, channels: Sequence[str] | None = None, rate: float | None = None) -> Run:
    """Return a run with the columns and samples of `absent_columns` and `kept_samples`; the rest is not computed.

    Args:
        run: The run.
        channels: Names as in `absent_columns`.
        rate: As in `kept_samples` [1/s].

    Returns:
        The part of the run.

    Raises:
        RequestError: A name is unknown, or the rate is not positive and finite.

    """
    rows = kept_samples(run.t, rate)
    part = run if len(rows) == len(run) else run.part(rows, events=run.events)
    return part.without(absent_columns(run, channels))


def chosen_columns(run: Run, names: Sequence[str]) -> tuple[str, ...]:
    """Return the columns that `names` choose, in the order named; constants by their own names.

    Args:
        run: The run.
        names: As in `absent_columns`; columns that were not kept too.

    Returns:
        Names of the columns.

    Raises:
        RequestError: A name is unknown.

    """
    groups = _groups(run)
    columns = list(run.column_units(kept=False))
    constants = {name.derivative(order) for name in run.fixed for order in range(3)}
    usual = [name for name in columns if name not in ("time", *ALWAYS)]
    kept = dict.fromkeys(usual if is_all_but(names) else ())
    for name in names:
        bare = name.removeprefix("-")
        found = {bare} if bare in constants else _chosen(bare, groups, columns)
        if name.startswith("-"):
            kept = {column: None for column in kept if column not in found}
        else:
            kept |= dict.fromkeys([column for column in columns if column in found] or sorted(found & constants))
    return tuple(kept)


def coordinates(run: Run, names: Sequence[str]) -> tuple[CoordinateName, ...]:
    """Return the coordinates of which `names` choose a column, in the order named.

    Args:
        run: The run.
        names: As in `absent_columns`; 'coupler.vx' chooses 'coupler.x'. Fixed coordinates by their own names.

    Returns:
        Names of the coordinates.

    Raises:
        RequestError: A name is unknown or chooses no coordinate.

    """
    owners = {name.derivative(order): name for order in range(3) for name in (*run.outputs, *run.fixed)}
    groups, columns = _groups(run), list(run.column_units())
    kept = dict.fromkeys(columns if is_all_but(names) else ())
    for name in names:
        if name.startswith("-"):
            left_out = _chosen(name[1:], groups, columns)
            kept = {column: None for column in kept if column not in left_out}
        else:
            found = _of_coordinates(name, owners, groups, columns)
            kept |= dict.fromkeys(column for column in owners if column in found)
    return tuple(dict.fromkeys(owners[column] for column in kept if column in owners))


def forces(run: Run, names: Sequence[str]) -> tuple[ForceName | SignalName, ...]:
    """Return the forces, reactions and signals that `names` choose, in the order of the run.

    Args:
        run: The run.
        names: As in `absent_columns`. None given, or a minus in front of the first: all but reactions.

    """
    every: tuple[ForceName | SignalName, ...] = (
        *run.force_names,
        *run.reaction_names,
        *run.force_sizes,
        *run.signal_names,
    )
    of_text = {str(name): name for name in every}
    known = {column: of_text[column] for column in run.column_units(kept=False) if column in of_text}
    groups = {group: found & known.keys() for group, found in _groups(run).items()}
    usual = {*map(str, run.force_names), *map(str, run.signal_names)}
    kept = usual if not names or names[0].startswith("-") else set()
    for name in names:
        bare = name.removeprefix("-")
        found = groups[bare] if bare in groups else {column for column in known if fnmatchcase(column, bare)}
        kept = kept - found if name.startswith("-") else kept | found
    return tuple(name for column, name in known.items() if column in kept)


def _of_coordinates(
    name: str, owners: Mapping[str, str], groups: dict[str, set[str]], columns: Sequence[str]
) -> set[str]:
    """Return the columns of coordinates that a name chooses, also those not kept; an error if there are none."""
    found = {name} if name in owners else groups.get(name, {column for column in columns if fnmatchcase(column, name)})
    if found.isdisjoint(owners):
        known = dict.fromkeys(owners.values())
        of_forces = groups["forces"] | groups["reactions"] | groups["signals"]
        near = suggestion(name, [*owners, *sorted(of_forces - {name}), *GROUPS_OF_COORDINATES])
        raise RequestError(
            f"the run has no coordinate '{name}'{near}; "
            f"coordinates: {listed(known)}, or {listed(GROUPS_OF_COORDINATES)}, with * for any letters"
        )
    return found


def _groups(run: Run) -> dict[str, set[str]]:
    """Return columns by the name of their group."""
    points = run.outputs[run.coordinate_count :]
    every = set(run.column_units(kept=False))
    return {
        "all": {*every, DRAWN},
        "none": set(),
        "inputs": set(run.input_names),
        **{group: {name.derivative(order) for name in run.names} for order, group in enumerate(("q", "qd", "qdd"))},
        "points": {name.derivative(order) for name in points for order in range(3)},
        **{name: {f"solver.{name}"} for name in ("status", "residual", "iterations", "margin")},
        "error": {f"solver.error_{name}" for name in ("q", "qd", "qdd")},
        "forces": set(run.force_names),
        "reactions": {*run.reaction_names, *run.force_sizes},
        "signals": set(run.signal_names),
        "watch": {f"watch.{name}" for name in run.watch_names},
        DRAWN: {DRAWN},
    }


def _chosen(name: str, groups: dict[str, set[str]], columns: Sequence[str]) -> set[str]:
    """Return the columns of a group, or those that match; an error if there are none."""
    if name in groups:
        return groups[name]
    found = {column for column in columns if fnmatchcase(column, name)}
    if not found:
        example = next(column for column in columns if "." in column)
        raise RequestError(
            f"channel '{name}' is not known{suggestion(name, [*groups, *columns])}; "
            f"channels: {listed(groups)}, or columns such as '{example}', with * for any letters"
        )
    return found
