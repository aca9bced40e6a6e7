"""Differences of two runs: B - A of what both have, and the efforts that differ most."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import LogError
from kinfmu.log.viewer.reactions import reactions
from kinfmu.log.viewer.series import Group, efforts, signals
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.units import CoordinateName, ForceName, SignalName, unit_of

SAME = 1e-9  # of the largest value, a billionth; smaller differences are not visible


class Apart(NamedTuple):
    """The largest difference of a column, with its unit, and relative to the column's largest value."""

    name: str
    largest: float
    unit: str
    part: float


def common(a: Run, b: Run) -> list[CoordinateName]:
    """Return the coordinates that both runs have."""
    return [name for name in a.outputs if name in b.outputs]


def difference_of(a: Run, b: Run) -> Run | None:
    """Return B - A of common coordinates, forces and signals at the times, or driver values, of A; None without any.

    Where the times differ, B is interpolated linearly, with an error of at most h^2 / 8 times the second derivative.
    """
    both = common(a, b)
    if not both or not len(a) or not len(b):
        return None
    at = axis_of(a).values
    tables: dict[str, Any] = {}
    for key in ("values", "rates", "accelerations"):
        tables[key] = _apart(a, b, at, key, [run.outputs for run in (a, b)], both)
    for names_key, key in (("force_names", "forces"), ("reaction_names", "reactions"), ("signal_names", "signals")):
        names = [getattr(run, names_key) for run in (a, b)]
        shared = tuple(name for name in names[0] if name in names[1])
        has_both = getattr(a, key) is not None and getattr(b, key) is not None
        tables[names_key] = shared if has_both else ()
        tables[key] = _apart(a, b, at, key, names, shared) if has_both and shared else None
    absent = a.absent | b.absent
    counted = {"outputs": tuple(both), "coordinate_count": len(both), "absent": absent, "shaking": None}
    return dataclasses.replace(a, **counted, **tables)  # type: ignore[arg-type]  # of several types


def _apart(
    a: Run, b: Run, at: FloatArray, key: str, names: Sequence[Sequence[str]], shared: Sequence[str]
) -> FloatArray:
    """Return B - A of the shared columns of a table."""
    of_a, of_b = ([own.index(name) for name in shared] for own in names)
    of_b_there = _at(at, axis_of(b).values, np.asarray(getattr(b, key))[:, of_b])
    return np.asarray(of_b_there - np.asarray(getattr(a, key))[:, of_a])


def _at(times: FloatArray, t: FloatArray, table: FloatArray) -> FloatArray:
    """Return the columns of a table (n, k), given at t, at other times; NaN outside the range of t."""
    if np.array_equal(times, t):
        return table
    if len(t) > 1 and np.all(np.diff(t) < 0.0):
        t, table = t[::-1], table[::-1]
    if np.any(np.diff(t) <= 0.0):
        raise LogError("the runs have different times, and B cannot be interpolated because its times do not increase")
    return np.column_stack([np.interp(times, t, column, left=np.nan, right=np.nan) for column in table.T])


def loads_of(run: Run) -> list[Group]:
    """Return efforts, energies, reactions and signals of a run, one group for each unit."""
    return [*efforts(run), *reactions(run), *signals(run)]


def moves_apart(group: Group, own: Group | None) -> bool:
    """Return True if a difference of coordinates is visible, compared with the curves of a run itself."""
    return own is None or size_of(group.values) > SAME * max(size_of(own.values), *map(abs, own.shown or (0.0,)))


def loads_apart(differences: Sequence[Group], own: Mapping[str, Group]) -> list[Group]:
    """Return the differences of efforts, reactions and signals that are visible, compared with all of their unit."""
    sizes: dict[str, float] = {}
    for path, group in own.items():
        sizes[_kind(path)] = max(size_of(group.values), sizes.get(_kind(path), 0.0))
    return [one for one in differences if size_of(one.values) > SAME * sizes.get(_kind(one.path), 0.0)]


def _kind(path: str) -> str:
    """Return 'torque' for 'reactions/torque'; the paths of signals are kinds of their own."""
    return path if path.startswith("signals") else path.rpartition("/")[2]


def most_apart(a: Run, difference: Run) -> list[Apart]:
    """Return forces, reactions and signals that differ visibly, those that differ most of their size first."""
    names: tuple[ForceName | SignalName, ...] = (
        *difference.force_names,
        *difference.reaction_names,
        *difference.signal_names,
    )
    found, sizes = [], dict[str, float]()
    for name in names:
        if name in difference.absent:
            continue
        largest, size = (size_of(np.where(a.good, run[name], np.nan)) for run in (difference, a))
        unit = name.unit if isinstance(name, SignalName) else unit_of(name.quantity, a.length_unit)
        kind = name if isinstance(name, SignalName) else unit
        sizes[kind] = max(size, sizes.get(kind, 0.0))
        found.append((kind, Apart(name, largest, unit, largest / size if size else np.inf)))
    visible = [one for kind, one in found if one.largest > SAME * sizes[kind]]
    return sorted(visible, key=lambda one: -one.part)


def size_of(values: FloatArray) -> float:
    """Return the largest size of the numbers among values; 0 without any."""
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
