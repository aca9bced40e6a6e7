"""Start poses that contradict the start of the drivers' laws."""

from __future__ import annotations

from collections.abc import Iterator

from kinfmu.analysis.written import written
from kinfmu.equations.assembly import start_from_poses, start_values
from kinfmu.equations.system import System
from kinfmu.errors import listed


def start_notes(system: System) -> Iterator[str]:
    """Yield one line if the mechanism was assembled at the start of the laws in place of the start poses' values."""
    values = start_values(system)
    if not values.is_moved:
        return
    given, unit = start_from_poses(system).u, system.mechanism.length_unit
    changed = [
        (driver.name, written(there, unit, driver.quantity.kind), written(start, unit, driver.quantity.kind))
        for driver, there, start in zip(system.mechanism.drivers, given.tolist(), values.u.tolist(), strict=True)
        if there != start
    ]
    yield (
        f"the start poses give {listed(f'{name} = {there}' for name, there, _ in changed)}; the law starts at "
        f"{listed(f'{name} = {start}' for name, _, start in changed)}, which cannot be reached from there: "
        "the mechanism is assembled at the start of the law"
    )
