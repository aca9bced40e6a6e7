"""Places of the columns of a run: which column of which table holds what."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any

from kinfmu.units import CoordinateName, ForceName, InputName, SignalName, force_sizes

Place = tuple[str, str, int | None]  # of a column: its name, the table, and the number of the column there
NAMES = ("input_names", "outputs", "force_names", "reaction_names", "signal_names", "watch_names")  # fields of a run


@lru_cache(maxsize=64)  # the runs of a model have the same names
def tables_of(
    input_names: tuple[InputName, ...],
    outputs: tuple[CoordinateName, ...],
    force_names: tuple[ForceName, ...],
    reaction_names: tuple[ForceName, ...],
    signal_names: tuple[SignalName, ...],
    watch_names: tuple[str, ...],
) -> tuple[Place, ...]:
    """Return the places of all columns, in their order; names of equal text have equal places."""
    places: list[Place] = [("time", "t", None)]
    places += [(name, "inputs", k) for k, name in enumerate(input_names)]
    for order, table in enumerate(("values", "rates", "accelerations")):
        places += [(name.derivative(order), table, k) for k, name in enumerate(outputs)]
    places += [(name, "forces", k) for k, name in enumerate(force_names)]
    places += [(name, "reactions", k) for k, name in enumerate(reaction_names)]
    places += [(name, "signals", k) for k, name in enumerate(signal_names)]
    places += [(f"solver.{table}", table, None) for table in ("status", "residual", "iterations", "margin")]
    places += [(f"solver.error_{order}", "error", k) for k, order in enumerate(("q", "qd", "qdd"))]
    return (*places, *((f"watch.{name}", "watch", k) for k, name in enumerate(watch_names)))


@lru_cache(maxsize=64)
def index_of(*names: Any) -> Mapping[str, tuple[str, int | None]]:
    """Return the table and the number of the column by name."""
    return {name: (table, column) for name, table, column in tables_of(*names)}


@lru_cache(maxsize=64)
def sizes_of(reaction_names: tuple[ForceName, ...]) -> Mapping[ForceName, tuple[ForceName, ForceName]]:
    """Return the sizes of forces among the reactions, with their components; they are computed, not kept."""
    return MappingProxyType(force_sizes(reaction_names))
