"""The variables of any co-simulation FMU: their types, units and dependencies, as fmpy reads them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kinfmu.errors import FmuError, RequestError, listed, suggestion
from kinfmu.mechanism.valid import quoted
from kinfmu.units import factors, quantity_in, spelled

VERSIONS = ("2.0", "3.0")
_REALS = ("Real", "Float64", "Float32")
_INTEGERS = ("Integer", "Enumeration", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))
_NUMBER = re.compile(r"\s*+([+-]?+(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?+)\s*+(.*?)\s*+")
_BASES = ("kg", "m", "s", "A", "K", "mol", "cd")  # without rad: an angle has no dimension


@dataclass(frozen=True, eq=False)
class Port:
    """A variable of an FMU that holds one number.

    Attributes:
        name: Name in the FMU.
        reference: Value reference.
        type: FMI's type, such as 'Real' or 'Boolean'.
        causality: FMI's causality.
        unit: Unit, '1' without one.
        base: Exponents of the SI units, factor and offset into them; None if the FMU does not state them.
        items: Numbers of an enumeration by name.
        dependencies: Names of the variables that an output follows at once; None: all inputs.

    """

    name: str
    reference: int
    type: str
    causality: str
    unit: str = "1"
    base: tuple[tuple[int, ...], float, float] | None = None
    items: Mapping[str, int] | None = None
    dependencies: frozenset[str] | None = None

    @property
    def kind(self) -> str:
        """'real', 'integer' or 'boolean'."""
        return "real" if self.type in _REALS else "integer" if self.type in _INTEGERS else "boolean"

    def units(self) -> dict[str, float]:
        """Return the units in which a value may be given, with their factors into the unit of the variable."""
        return factors(quantity_in(self.unit, "m"), "m") | {self.unit: 1.0}

    def number(self, name: str, value: float | str | bool) -> float:
        """Return a value that was given as a number, as text with a unit, or as an item of an enumeration.

        Args:
            name: Name of the variable in messages.
            value: The value.

        Raises:
            RequestError: The value is none of these.

        """
        if not isinstance(value, str):
            return float(value)
        items = dict(self.items or {})
        if value in items:
            return float(items[value])
        stated = _NUMBER.fullmatch(value)
        if stated is None:
            valid = f"one of {listed(items)}" if items else f"a number, such as '1 {self.unit}'"
            raise RequestError(f"{name} = {quoted(value)} must be {valid}")
        number, unit = float(stated[1]), stated[2] or self.unit
        unit = unit if unit in self.units() else spelled(unit)
        if unit not in self.units():
            known = self.units()
            raise RequestError(f"{name}: unit {quoted(unit)} must be one of {listed(known)}{suggestion(unit, known)}")
        return number * self.units()[unit]


def read_description(path: Path, folder: Path) -> Any:
    """Return fmpy's model description of an unpacked FMU that has a co-simulation.

    Raises:
        FmuError: It cannot be read, is of another version of FMI, or has no co-simulation.

    """
    from fmpy import read_model_description

    try:
        about = read_model_description(folder, validate=False)
    except Exception as error:  # fmpy and lxml raise many kinds
        raise FmuError(f"{path}: modelDescription.xml is damaged: {' '.join(str(error).split())[:200]}") from None
    version = next((known for known in VERSIONS if str(about.fmiVersion).startswith(known)), None)
    if version is None:
        raise FmuError(f"{path}: FMI version {about.fmiVersion}; kinfmu simulates FMI 2.0 and 3.0")
    if about.coSimulation is None:
        raise FmuError(f"{path}: the FMU has no co-simulation; kinfmu steps FMUs for co-simulation")
    return about


def ports_of(about: Any) -> dict[str, Port]:
    """Return the variables of an FMU that hold one number, by name; texts, arrays and clocks are left out."""
    units = {unit.name: unit.baseUnit for unit in about.unitDefinitions}
    known = {unknown.variable.name: unknown.dependencies for unknown in about.outputs}
    found = {}
    for variable in about.modelVariables:
        if variable.type not in (*_REALS, *_INTEGERS, "Boolean") or variable.dimensions:
            continue
        declared = variable.declaredType
        unit = variable.unit or (declared.unit if declared is not None else None)
        base = units.get(unit)
        exponents = None if base is None else tuple(int(getattr(base, name) or 0) for name in _BASES)
        needs = known.get(variable.name)
        items = getattr(declared, "items", None) or ()
        found[variable.name] = Port(
            name=variable.name,
            reference=variable.valueReference,
            type=variable.type,
            causality=variable.causality or "local",
            unit=unit or "1",
            base=None if base is None or exponents is None else (exponents, float(base.factor), float(base.offset)),
            items={item.name: int(item.value) for item in items},
            dependencies=None if needs is None else frozenset(other.name for other in needs),
        )
    return found


def unlogged(about: Any, ports: Mapping[str, Port]) -> list[str]:
    """Return the names of outputs that hold no single number."""
    return [v.name for v in about.modelVariables if v.causality == "output" and v.name not in ports]
