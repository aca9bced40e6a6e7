"""Units: what a number in a mechanism file may carry, and what every variable declares. Names of variables.

Lengths keep the mechanism's unit everywhere; angles are radians inside, and files may use degrees. Masses, forces and
what is made of them are in SI units, whatever the unit of length is. Variables are named `<body>.x .y .phi`, their
rates `.vx .vy .omega`, their accelerations `.ax .ay .alpha`; points likewise.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Annotated, NamedTuple


class Quantity(NamedTuple):
    """The kind of a number: what it measures and which derivative it is; default: of order 0, with respect to time."""

    kind: str  # "length", "angle", "time", "number", or a key of KINDS such as "force"
    order: int = 0  # 0 position, 1 speed, 2 acceleration
    per: str = "time"  # or "angle", "length": the variable of the derivative


Length = Annotated[float, Quantity("length")]
Radians = Annotated[float, Quantity("angle")]  # inside; files may write degrees
Number = Annotated[float, Quantity("number")]
Force = Annotated[float, Quantity("force")]
Stiffness = Annotated[float, Quantity("stiffness")]
TorsionalStiffness = Annotated[float, Quantity("torsional_stiffness")]
Damping = Annotated[float, Quantity("damping")]
TorsionalDamping = Annotated[float, Quantity("torsional_damping")]

METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "km": 1e3, "in": 0.0254, "ft": 0.3048}
ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "rev": 2.0 * math.pi}
SECONDS = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
OTHER_SPELLINGS = {"\N{DEGREE SIGN}": "deg", "inch": "in"}  # also accepted, but not listed in messages
HIGHEST_ORDER = 7  # of a derivative with a unit

POUND = 0.45359237  # [kg]
POUND_FORCE = POUND * 9.80665  # [N]
INCH = METRES["in"]
KILOGRAMS = {"kg": 1.0, "g": 1e-3, "t": 1e3, "lb": POUND}
INERTIAS = {"kg m2": 1.0, "kg cm2": 1e-4, "kg mm2": 1e-6, "g cm2": 1e-7, "g mm2": 1e-9, "lb in2": POUND * INCH**2}
DENSITIES = {"kg/m3": 1.0, "g/cm3": 1e3, "kg/dm3": 1e3, "t/m3": 1e3, "lb/in3": POUND / INCH**3}
NEWTONS = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "lbf": POUND_FORCE}
TORQUES = {
    "N m": 1.0, "Nm": 1.0, "mN m": 1e-3, "mNm": 1e-3, "kN m": 1e3, "kNm": 1e3, "N mm": 1e-3, "Nmm": 1e-3, "N cm": 1e-2,
    "lbf in": POUND_FORCE * INCH, "lbf ft": POUND_FORCE * METRES["ft"],
}  # fmt: skip
STIFFNESSES = {
    "N/m": 1.0, "N/mm": 1e3, "N/cm": 1e2, "kN/m": 1e3, "kN/mm": 1e6, "lbf/in": POUND_FORCE / INCH,
}  # fmt: skip
DAMPINGS = {"N s/m": 1.0, "Ns/m": 1.0, "N s/mm": 1e3, "kN s/m": 1e3}


class QuantityKind(NamedTuple):
    """A quantity with a mass in it.

    Attributes:
        unit: The unit used inside and declared by variables.
        units: Every unit that files accept, with its factor into `unit`.
        powers: Powers of mass, length and time.
        meaning: The quantity in messages.

    """

    unit: str
    units: dict[str, float]
    powers: tuple[int, int, int]
    meaning: str


def _per_angle(units: dict[str, float], word: str = "") -> dict[str, float]:
    """Return the units of a torque per angle, or with the word ' s' per angular speed."""
    angles = {"rad": 1.0, "deg": ANGLES["deg"]}
    return {f"{unit}{word}/{per}": factor / size for unit, factor in units.items() for per, size in angles.items()}


KINDS = {
    "mass": QuantityKind("kg", KILOGRAMS, (1, 0, 0), "a mass"),
    "inertia": QuantityKind("kg m2", INERTIAS, (1, 2, 0), "a moment of inertia"),
    "density": QuantityKind("kg/m3", DENSITIES, (1, -3, 0), "a density"),
    "areal_density": QuantityKind("kg/m2", {"kg/m2": 1.0, "g/cm2": 10.0, "g/m2": 1e-3}, (1, -2, 0), "a mass by area"),
    "force": QuantityKind("N", NEWTONS, (1, 1, -2), "a force"),
    "torque": QuantityKind("N m", TORQUES, (1, 2, -2), "a torque"),
    "mass_moment": QuantityKind("kg m", {"kg m": 1.0, "kg mm": 1e-3, "g mm": 1e-6}, (1, 1, 0), "a mass times a length"),
    "stiffness": QuantityKind("N/m", STIFFNESSES, (1, 0, -2), "a stiffness"),
    "torsional_stiffness": QuantityKind("N m/rad", _per_angle(TORQUES), (1, 2, -2), "a torsional stiffness"),
    "damping": QuantityKind("N s/m", DAMPINGS, (1, 0, -1), "a damping coefficient"),
    "torsional_damping": QuantityKind(
        "N m s/rad", _per_angle(TORQUES, " s"), (1, 2, -1), "a torsional damping coefficient"
    ),
    "energy": QuantityKind("J", {"J": 1.0, "mJ": 1e-3, "kJ": 1e3}, (1, 2, -2), "an energy"),
    "power": QuantityKind("W", {"W": 1.0, "mW": 1e-3, "kW": 1e3}, (1, 2, -3), "a power"),
}


def length_power(quantity: Quantity) -> int:
    """Return the power of length that a quantity in SI units has, 0 for quantities in the file's unit of length."""
    return KINDS[quantity.kind].powers[1] if quantity.kind in KINDS else 0


PLAUSIBLE_TURN = 2.0 * math.pi * (1.0 + 1e-9)  # [rad]; larger angles of a pose are probably in degrees


def looks_like_degrees(angle: float) -> bool:
    """Return True for an angle [rad] that is probably in degrees: 30, 45, 60, 75, ..., of either sign."""
    return abs(angle) >= 30.0 and angle % 15.0 == 0.0


def in_turns(angle: float) -> str:
    """Return an angle [rad] in turns, for messages: '57.3 turns' for 360 rad."""
    return f"{abs(angle) / ANGLES['rev']:.3g} turns"


def angular_speed(speed: float) -> str:
    """Return a speed of an angle as text: in rad/s, or in rpm if that is rounder, '600 rpm' for 62.8318530718 rad/s."""
    rad, rpm = f"{speed:.6g}", f"{speed * 60.0 / ANGLES['rev']:.6g}"
    return f"{rpm} rpm" if len(rpm) + 2 <= len(rad) else f"{rad} rad/s"


_OTHER_SPELLING = re.compile("|".join(rf"(?<![^\W\d]){one}(?!\w)" for one in OTHER_SPELLINGS))


def spelled(unit: str) -> str:
    """Return a unit in the spelling of kinfmu: 'deg/s' for '\N{DEGREE SIGN}/s', 'lbf/in' for 'lbf/inch'."""
    return _OTHER_SPELLING.sub(lambda found: OTHER_SPELLINGS[found[0]], unit)


def unit_of(quantity: Quantity, length_unit: str) -> str:
    """Return the unit that a variable of this quantity declares, such as `rad/s` or `mm/s2`."""
    units = {"length": length_unit, "angle": "rad", "time": "s", "number": "1"}
    per = f"/{_power(units[quantity.per], quantity.order)}" if quantity.order else ""
    return (KINDS[quantity.kind].unit if quantity.kind in KINDS else units[quantity.kind]) + per


def quantity_in(unit: str, length_unit: str) -> Quantity:
    """Return the quantity of a declared unit, the inverse of `unit_of`; an unknown unit gives a number."""
    known = every_unit(length_unit)
    return known[unit][0] if unit in known else Quantity("number")


def _power(unit: str, order: int) -> str:
    """Return 's' or 's2'."""
    return unit if order == 1 else f"{unit}{order}"


def _bases(kind: str, length_unit: str) -> dict[str, float]:
    """Return the units of a kind of quantity with their factors into the unit used inside."""
    if kind in KINDS:
        return KINDS[kind].units
    if kind != "length":
        return ANGLES if kind == "angle" else SECONDS
    return {unit: metres / METRES[length_unit] for unit, metres in METRES.items()} | {length_unit: 1.0}


def factors(quantity: Quantity, length_unit: str) -> dict[str, float]:
    """Return every unit that files accept for `quantity`, with its factor into the unit used inside."""
    if quantity.kind == "number" or quantity.order > HIGHEST_ORDER:
        return {}
    base = _bases(quantity.kind, length_unit)
    if quantity.order == 0:
        return dict(base)
    below = _bases(quantity.per, length_unit)
    if quantity.per == "time":
        below = {"s": 1.0, "min": 60.0} if quantity.order == 1 else {"s": 1.0}
    written = {
        f"{unit}/{_power(per, quantity.order)}": factor / size**quantity.order
        for unit, factor in base.items()
        for per, size in below.items()
    }
    if quantity == Quantity("angle", 1):
        written |= {"rpm": 2.0 * math.pi / 60.0, "Hz": 2.0 * math.pi}
    return written


def display_units(unit: str, length: str = "mm") -> dict[str, float]:
    """Return the display units of a declared unit with their factors (display value = factor * value), for FMI.

    Args:
        unit: Unit that a variable declares.
        length: Unit in which lengths in m are shown. Default: mm, which is always defined.

    """
    base, slash, per = unit.partition("/")
    if base == "rad":
        return {f"deg{slash}{per}": 180.0 / math.pi}
    if base == "m":
        return {f"{shown}{slash}{per}": 1.0 / METRES[shown] for shown in dict.fromkeys(("mm", length)) if shown != "m"}
    return {}


@cache
def every_unit(length_unit: str) -> dict[str, tuple[Quantity, float]]:
    """Return every unit that files accept, with its quantity and its factor into the unit used inside.

    Units of two quantities belong to the last one: 'N/m' is the unit of a stiffness.
    """
    pairs = (("length", "time"), ("angle", "time"), ("length", "angle"), ("angle", "length"))
    rates = [Quantity(kind, order, per) for kind, per in pairs for order in range(1, HIGHEST_ORDER + 1)]
    rates += [Quantity(kind, 1, per) for kind in ("force", "torque") for per in ("time", "angle", "length")]
    return {
        unit: (quantity, factor)
        for quantity in (Quantity("length"), Quantity("angle"), Quantity("time"), *rates, *map(Quantity, KINDS))
        for unit, factor in factors(quantity, length_unit).items()
    }


_DERIVATIVES = {"x": ("x", "vx", "ax"), "y": ("y", "vy", "ay"), "phi": ("phi", "omega", "alpha")}


class CoordinateName(str):
    """The name of a coordinate, such as 'coupler.x', with the facts that it states.

    It is made from these facts, so that no code reads them from the text again. It is a `str` since columns, FMU
    variables and symbols of formulas go by this name.

    Args:
        owner: The body or the point of interest.
        axis: 'x', 'y' or 'phi'.

    Attributes:
        owner: As given.
        axis: As given.
        is_angle: True for an angle [rad], False for a length.

    """

    __slots__ = ("axis", "is_angle", "owner")
    owner: str
    axis: str
    is_angle: bool

    def __new__(cls, owner: str, axis: str) -> CoordinateName:
        name = super().__new__(cls, f"{owner}.{axis}")
        name.owner, name.axis, name.is_angle = owner, axis, axis == "phi"
        return name

    def __getnewargs__(self) -> tuple[str, str]:  # type: ignore[override]  # for copies: what `__new__` takes
        return self.owner, self.axis

    def quantity(self, order: int = 0, per: str = "time") -> Quantity:
        """Return the quantity of the coordinate, or of its derivative of an order."""
        return Quantity("angle" if self.is_angle else "length", order, per)

    def derivative(self, order: int) -> str:
        """Return 'coupler.vx' for 'coupler.x' and order 1; order 0 gives the name itself."""
        return f"{self.owner}.{_DERIVATIVES[self.axis][order]}" if order else self


class InputName(str):
    """The name of an input, such as 'crank_angle' or 'crank_speed', with the facts that it states.

    Args:
        driver: The driver, or the load.
        noun: What the driver drives: 'angle', 'position' or 'length'; of a load 'force' or 'torque'.
        order: 0 for the value, 1 for its speed, 2 for its acceleration.

    Attributes:
        driver: As given.
        noun: As given.
        quantity: The quantity of the input.

    """

    __slots__ = ("driver", "noun", "quantity")
    driver: str
    noun: str
    quantity: Quantity

    def __new__(cls, driver: str, noun: str, order: int = 0) -> InputName:
        name = super().__new__(cls, f"{driver}_{(noun, 'speed', 'acceleration')[order]}")
        name.driver, name.noun = driver, noun
        name.quantity = Quantity(noun if noun in ("angle", "force", "torque") else "length", order)
        return name

    def __getnewargs__(self) -> tuple[str, str, int]:  # type: ignore[override]  # for copies: what `__new__` takes
        return self.driver, self.noun, self.quantity.order

    def derivative(self, order: int) -> InputName:
        """Return the input of the same driver for its value, speed or acceleration."""
        return InputName(self.driver, self.noun, order)


VariableName = CoordinateName | InputName  # what has a derivative with a name of its own


def read_coordinate(text: str) -> CoordinateName | None:
    """Return the coordinate that a name in a file states; None if the text is no such name."""
    owner, _, axis = text.rpartition(".")
    return CoordinateName(owner, axis) if owner and axis in _DERIVATIVES else None


def is_of_angle(text: str) -> bool:
    """Return whether a name in a file, such as 'rocker.omega', is of an angle or a derivative of one."""
    return text.rpartition(".")[2] in _DERIVATIVES["phi"]


def read_inputs(texts: Sequence[str]) -> tuple[InputName, ...] | None:
    """Return the inputs that names in a file state, three for each driver; None if the texts are no such names."""
    inputs: list[InputName] = []
    for value in texts[::3]:
        driver, _, noun = value.rpartition("_")
        if not driver or noun not in ("angle", "position", "length"):
            return None
        inputs += [InputName(driver, noun, order) for order in range(3)]
    return tuple(inputs) if inputs == list(texts) else None


def degrees_of(unit: str) -> tuple[str, float]:
    """Return the unit in degrees for angles and their rates in time, and its factor; other units as they are."""
    if unit == "rad" or unit.startswith("rad/s"):
        return unit.replace("rad", "deg", 1), 1.0 / ANGLES["deg"]
    return unit, 1.0


class ForceName(str):
    """The name of a force, an inertia or an energy of a mechanism, such as 'crank.torque', with the facts it states.

    Args:
        owner: The driver or joint; empty for what belongs to the whole mechanism.
        noun: What it is: 'torque', 'reduced_inertia', 'kinetic_energy'.
        quantity: Its quantity.

    Attributes:
        owner: As given.
        noun: As given.
        quantity: As given.

    """

    __slots__ = ("noun", "owner", "quantity")
    owner: str
    noun: str
    quantity: Quantity

    def __new__(cls, owner: str, noun: str, quantity: Quantity) -> ForceName:
        name = super().__new__(cls, f"{owner}.{noun}" if owner else noun)
        name.owner, name.noun, name.quantity = owner, noun, quantity
        return name

    def __getnewargs__(self) -> tuple[str, str, Quantity]:  # type: ignore[override]  # for copies: what `__new__` takes
        return self.owner, self.noun, self.quantity


def force_sizes(names: Iterable[ForceName]) -> dict[ForceName, tuple[ForceName, ForceName]]:
    """Return the sizes of forces with two components, such as 'pin.force', each with its components.

    Args:
        names: Names of reactions, such as 'pin.force_x' and 'pin.force_y'.

    Returns:
        Components along x and y by the name of the size.

    """
    known = {str(name): name for name in names}
    found = {}
    for name in known.values():
        other = known.get(f"{name.removesuffix('_x')}_y")
        if name.noun.endswith("force_x") and other is not None:
            found[ForceName(name.owner, name.noun.removesuffix("_x"), name.quantity)] = (name, other)
    return found


class SignalName(str):
    """The name of an output of an FMU that is not kinfmu's, such as 'motor.current', with its unit.

    Args:
        name: The name; in a system of several FMUs it begins with that of the component.
        unit: The unit that the FMU declares, '1' without one.

    Attributes:
        unit: As given.

    """

    __slots__ = ("unit",)
    unit: str

    def __new__(cls, name: str, unit: str = "1") -> SignalName:
        made = super().__new__(cls, name)
        made.unit = unit
        return made

    def __getnewargs__(self) -> tuple[str, str]:  # type: ignore[override]  # for copies: what `__new__` takes
        return str(self), self.unit

    @property
    def owner(self) -> str:
        """The component, '' of a single FMU; a bracket begins a name such as 'der(x.y)'."""
        return self.partition("(")[0].partition(".")[0] if "." in self.partition("(")[0] else ""


_OF_FORCES = {*KINDS, "length", "angle"}  # of the columns of forces; springs have a length or an angle


def read_force(text: str, kind: str) -> ForceName | None:
    """Return the force, inertia, energy or length that a name in a file states; None if the text is no such name."""
    owner, _, noun = text.partition(".") if "." in text else ("", "", text)
    return ForceName(owner, noun, Quantity(kind)) if noun and text[0] != "." and kind in _OF_FORCES else None
