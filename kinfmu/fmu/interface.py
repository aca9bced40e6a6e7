"""The list of an FMU's variables, from which model description, value references and channels of a run follow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from kinfmu.errors import FmuError
from kinfmu.mechanism import RunSettings
from kinfmu.units import METRES, display_units

Drive = Literal["time", "inputs", "torque"]
DRIVES: tuple[Drive, ...] = ("time", "inputs", "torque")
STATUS_TYPE, RATES_TYPE = "Status", "Rates"  # names of the enumerations' types

_ANGLES_SHOWN_IN_DEGREES = ("rad", "rad/s", "rad/s2")
_QUANTITIES = {  # names of Modelica's SI units, by unit and the power of time in it
    "rad": {"": "Angle", "s": "AngularVelocity", "s2": "AngularAcceleration"},
    "m": {"": "Length", "s": "Velocity", "s2": "Acceleration"},
    "s": {"": "Time"},
    "kg": {"": "Mass"},
    "kg m2": {"": "MomentOfInertia"},
    "N": {"": "Force"},
    "N m": {"": "Torque"},
    "J": {"": "Energy"},
    "W": {"": "Power"},
}


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU, in FMI's terms.

    Attributes:
        name: Name, such as "coupler.vx".
        type: FMI 2.0's type.
        causality: FMI's causality.
        variability: FMI's variability.
        description: One line for the user of the FMU.
        initial: FMI's attribute `initial`, if any.
        unit: Unit, such as "rad/s".
        start: Start value.
        minimum: Smallest valid value.
        maximum: Largest valid value.
        nominal: Usual magnitude; None if it is 1 or unknown.
        derivative_of: Variable of which this is the time derivative.
        declared_type: Name of the type of an Enumeration.
        display_length: Unit of length in which tools show a variable in m, m/s, ... by default; None: m.
        dependencies: Inputs that an output depends on structurally; None if FMI lists none.
        linear_in: Those of them whose factor depends on fixed parameters alone.
        initial_dependencies: Inputs and parameters that it depends on during initialization.

    """

    name: str
    type: Literal["Real", "Integer", "Enumeration", "Boolean", "String"]
    causality: Literal["input", "output", "parameter", "calculatedParameter", "local", "independent"]
    variability: Literal["constant", "fixed", "tunable", "discrete", "continuous"]
    description: str
    initial: Literal["exact", "calculated"] | None = None
    unit: str | None = None
    start: float | bool | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    derivative_of: str | None = None
    declared_type: str | None = None
    display_length: str | None = None
    dependencies: tuple[str, ...] | None = None
    linear_in: tuple[str, ...] = ()
    initial_dependencies: tuple[str, ...] | None = None

    @property
    def quantity(self) -> str | None:
        """FMI's name of the physical quantity, such as 'AngularVelocity'; None if the unit does not state it."""
        base, _, per = (self.unit or "").partition("/")
        by_rate = _QUANTITIES.get("m" if base in METRES else base)
        return None if by_rate is None else by_rate.get(per)

    @property
    def display_unit(self) -> str | None:
        """The unit in which tools show the value by default: degrees for angles, `display_length` for lengths."""
        if self.unit in _ANGLES_SHOWN_IN_DEGREES:
            return next(iter(display_units(self.unit)))
        base, slash, per = (self.unit or "").partition("/")
        return f"{self.display_length}{slash}{per}" if self.display_length and base == "m" else None

    @property
    def display_units(self) -> dict[str, float]:
        """The display units of its unit with their factors."""
        return display_units(self.unit or "1", self.display_length or "mm")


@dataclass(frozen=True)
class InterfacePart:
    """Neighbouring variables that a slave computes together, such as the rates of all outputs.

    Attributes:
        name: Name, such as "rates".
        variables: Variables, none if the FMU does not have what the part is for.

    """

    name: str
    variables: tuple[Variable, ...]

    @property
    def type(self) -> str:
        """Type of the variables; 'Real' if there are none, 'Time' of the independent variable."""
        first = self.variables[0] if self.variables else None
        return "Real" if first is None else "Time" if first.causality == "independent" else first.type

    @property
    def starts(self) -> tuple[float | bool, ...]:
        """Start values, 0 of a variable without one; none if no variable has one."""
        starts = [variable.start for variable in self.variables]
        return tuple([0.0 if start is None else start for start in starts]) if starts.count(None) < len(starts) else ()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(variable.name for variable in self.variables)


@dataclass(frozen=True)
class Interface:
    """All variables of an FMU, part by part; the value reference of a variable is its place in the list, from 1.

    Dependencies are places counted from 1 in FMI 2.0, and value references in FMI 3.0. The two are the same numbers
    here, so a host that takes one for the other reads the same dependencies.

    Attributes:
        name: Name of the mechanism.
        title: Title of the mechanism.
        length_unit: Unit of length.
        experiment: Default start, stop and step [s].
        coordinate_count: Number of outputs that are generalized coordinates (they come first).
        parts: Variables by part.

    """

    name: str
    title: str
    length_unit: str
    experiment: RunSettings
    coordinate_count: int
    parts: tuple[InterfacePart, ...]

    def __post_init__(self) -> None:
        twice = [name for name, count in Counter(variable.name for variable in self).items() if count > 1]
        if twice:
            raise FmuError(f"mechanism '{self.name}': two variables of the FMU would be named '{twice[0]}'")

    def __iter__(self) -> Iterator[Variable]:
        for part in self.parts:
            yield from part.variables

    def displayed_in(self, length: str | None) -> Interface:
        """Return the interface with a unit in which tools show its lengths in m; itself for None and its own unit."""
        if length in (None, self.length_unit):
            return self

        def shown(variable: Variable) -> Variable:
            is_length = (variable.unit or "").partition("/")[0] == "m"
            return replace(variable, display_length=length) if is_length else variable

        parts = tuple(replace(part, variables=tuple(map(shown, part.variables))) for part in self.parts)
        return replace(self, parts=parts)

    def part(self, name: str) -> tuple[Variable, ...]:
        """Return the variables of a part, none if the FMU does not have that part."""
        return next((part.variables for part in self.parts if part.name == name), ())

    def inputs(self, name: str) -> tuple[Variable, ...]:
        """Return the inputs of a part: the part `loads` also holds parameters, the constants of the laws of loads."""
        return tuple(variable for variable in self.part(name) if variable.causality == "input")

    @property
    def motion(self) -> tuple[Variable, ...]:
        """Value, speed and acceleration of each driver: inputs, or, if the FMU owns the motion, states."""
        return self.part("states") or self.part("inputs")

    @property
    def derivatives(self) -> tuple[Variable, ...]:
        """The derivatives of the continuous states, in their order."""
        return tuple(variable for variable in self.part("states") if variable.derivative_of)

    def value_references(self) -> dict[str, int]:
        """Return the value references by name."""
        return {variable.name: reference for reference, variable in enumerate(self, start=1)}
