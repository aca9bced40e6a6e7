"""Parts of model descriptions that both versions of FMI share."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element, SubElement

from kinfmu.fmu.interface import RATES_TYPE, STATUS_TYPE, Interface, Variable
from kinfmu.fmu.slave.estimated_rates import Rates
from kinfmu.mechanism import RunSettings
from kinfmu.solver.python.pose import Status
from kinfmu.units import KINDS, METRES

TOOL = "kinfmu"  # name of the annotation that identifies FMUs of kinfmu
LOG_CATEGORIES = {
    "logStatusWarning": "Settings that the host may not have intended",
    "logStatusDiscard": "Steps to unreachable poses: driver, value and limit",
    "logStatusError": "Values that were refused",
}
_STATUS_WORDS = {
    Status.OK: "converged to round-off",
    Status.NEAR_SINGULAR: "right, but with fewer digits",
    Status.BRIDGED: "interpolated across a singular point",
    Status.OUTSIDE: "the drivers cannot take the mechanism there",
    Status.INCONSISTENT: "a constraint set aside as redundant does not hold",
    Status.NOT_CONVERGED: "no solution found",
}
_RATES_WORDS = {
    Rates.AUTO: "estimated until the input is first other than 0, or a derivative of the driver's value is given",
    Rates.ESTIMATED: "estimated from the driver's values; inputs of rates have no effect",
    Rates.WIRED: "the inputs as they are, 0 too",
}
ENUMERATIONS: dict[str, Mapping[Any, str]] = {  # by name of the type: items and their meanings
    STATUS_TYPE: _STATUS_WORDS,
    RATES_TYPE: _RATES_WORDS,
}
DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>\n'
UnknownKind = Literal["outputs", "derivatives", "initial"]
Unknowns = dict[
    str, tuple[tuple[str, str], ...] | None
]  # by name: dependencies with their kinds, or None if not listed


def document(root: Element) -> bytes:
    """Return an indented XML document."""
    ET.indent(root)
    return f"{DECLARATION}{ET.tostring(root, encoding='unicode')}\n".encode()


def text(value: float | bool) -> str:
    """Return a number as text that reads back to the bit, or a truth value as XML writes it."""
    return str(value).lower() if isinstance(value, bool) else repr(value)


def number(value: str | None) -> float | None:
    """Return the number in an attribute, or None if it is missing."""
    return None if value is None else float(value)


def limits(variable: Variable) -> dict[str, str]:
    """Return those of the attributes min, max and start that a variable has."""
    given = (("min", variable.minimum), ("max", variable.maximum), ("start", variable.start))
    return {
        key: text(float(value)) if variable.type == "Real" else text(value if isinstance(value, bool) else int(value))
        for key, value in given
        if value is not None
    }


def units(root: Element, interface: Interface) -> None:
    """Write UnitDefinitions: every unit that a variable has."""
    definitions = SubElement(root, "UnitDefinitions")
    shown = {variable.unit: variable.display_units for variable in interface if variable.unit}
    for name in sorted(shown):
        unit = SubElement(definitions, "Unit", name=name)
        SubElement(unit, "BaseUnit", base_unit(name))
        for display, factor in shown[name].items():
            SubElement(unit, "DisplayUnit", name=display, factor=text(factor))


def base_unit(name: str) -> dict[str, str]:
    """Return exponents of SI base units and factor: `mm/s2` is m=1, s=-2, factor=0.001; `N/rad` has rad=-1."""
    known = {kind.unit: kind.powers for kind in KINDS.values()}
    base, _, per = (name, "", "") if name in known else name.partition("/")
    powers = dict(zip(("kg", "m", "s"), known.get(base, (0, 0, 0)), strict=True))
    factor = 1.0
    for unit, sign in ((base, 1), (per.rstrip("23456789"), -1)):
        power = sign * int(per[len(unit) :] or 1) if sign < 0 and per else sign
        key = "m" if unit in METRES else unit
        if key in ("rad", "m", "s"):
            powers[key] = powers.get(key, 0) + power
            factor *= METRES.get(unit, 1.0) ** power
    attributes = {key: str(powers[key]) for key in ("kg", "m", "s", "rad") if powers.get(key)}
    return attributes if factor == 1.0 else {**attributes, "factor": text(factor)}


def items(enumeration: Element, name: str) -> None:
    """Write the items of the enumeration type of that name."""
    for item, meaning in ENUMERATIONS[name].items():
        SubElement(enumeration, "Item", name=item.name.lower(), value=str(int(item)), description=meaning)


def log_categories(root: Element) -> None:
    """Write LogCategories with their meanings."""
    categories = SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=meaning)


def experiment(root: Element, settings: RunSettings) -> None:
    """Write DefaultExperiment."""
    attributes = {"startTime": text(float(settings.start))}
    if settings.stop > settings.start:  # FMI requires stopTime > startTime
        attributes["stopTime"] = text(float(settings.stop))
    SubElement(root, "DefaultExperiment", attributes, stepSize=text(float(settings.step)))


def annotation(parent: Element, interface: Interface) -> None:
    """Write the parts of the list of variables, for `read`."""
    parts = SubElement(parent, "Parts", coordinates=str(interface.coordinate_count), lengthUnit=interface.length_unit)
    for part in interface.parts:
        SubElement(parts, "Part", name=part.name, variables=str(len(part.variables)))


def attributes(variable: Variable, references: Mapping[str, int]) -> dict[str, str]:
    """Return the attributes that variables of all types have."""
    found = {
        "name": variable.name,
        "valueReference": str(references[variable.name]),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    return found | ({"initial": variable.initial} if variable.initial else {})


def shown(variable: Variable, kinds: Collection[str], interface: Interface) -> Variable:
    """Return the variable as a description with these kinds of simulation lists it.

    With model exchange or states only derivatives of states are declared as derivatives: some importers, OMSimulator
    among them, take every derivative for one of these.
    """
    hides = ("ModelExchange" in kinds or bool(interface.derivatives)) and variable not in interface.derivatives
    return replace(variable, derivative_of=None) if hides else variable


def typed(variable: Variable) -> dict[str, str]:
    """Return the attributes that depend on the type, except `derivative`."""
    found: dict[str, str] = {}
    if variable.declared_type:
        found["declaredType"] = variable.declared_type
    if variable.quantity:
        found["quantity"] = variable.quantity
    if variable.unit:
        found["unit"] = variable.unit
    if variable.display_unit:
        found["displayUnit"] = variable.display_unit
    if variable.nominal is not None:
        found["nominal"] = text(variable.nominal)
    return found | limits(variable)


def unknowns(
    interface: Interface, kind: UnknownKind, places: Mapping[str, int]
) -> list[tuple[Variable, dict[str, str]]]:
    """Return the unknowns of the model structure with the attributes of their dependencies.

    These are the outputs, or the derivatives of continuous states; the initial unknowns are the outputs that are
    calculated, and calculated parameters. The kind `fixed` states that the
    factor depends on fixed parameters alone, `driven_by_time` among them; for initial unknowns FMI allows only
    `dependent` and `constant`.

    Args:
        interface: Variables of the FMU.
        kind: "outputs", "derivatives" or "initial".
        places: Number by which dependencies are listed, by name of the variable.

    """
    is_initial = kind == "initial"
    causalities = ("output", "calculatedParameter") if is_initial else ("output",)
    found = []
    for variable in interface.derivatives if kind == "derivatives" else interface:
        if variable.causality in causalities and not (is_initial and variable.initial == "exact"):
            names = variable.initial_dependencies if is_initial else variable.dependencies
            linear_in = () if is_initial else variable.linear_in
            listed: dict[str, str] = {}
            if names is not None:
                ordered = sorted(names, key=places.__getitem__)
                listed["dependencies"] = " ".join(str(places[name]) for name in ordered)
                listed["dependenciesKind"] = " ".join("fixed" if name in linear_in else "dependent" for name in ordered)
            found.append((variable, listed))
    return found


def read_unknowns(elements: Iterable[Element], place: str, names: Mapping[str, str]) -> Unknowns:
    """Return the unknowns in the model structure; place: attribute of the unknown's number, names: by number."""
    found: Unknowns = {}
    for unknown in elements:
        listed = unknown.get("dependencies")
        depends = None
        if listed is not None:
            kinds = unknown.get("dependenciesKind", "").split()
            depends = tuple((names[one], kind) for one, kind in zip(listed.split(), kinds, strict=True))
        found[names[unknown.get(place, "")]] = depends
    return found


def dependencies(name: str, outputs: Unknowns, initial: Unknowns) -> dict[str, tuple[str, ...] | None]:
    """Return the fields of a variable that hold its dependencies."""
    now, first = outputs.get(name), initial.get(name)
    return {
        "dependencies": None if now is None else tuple(one for one, _ in now),
        "linear_in": tuple(one for one, kind in now or () if kind == "fixed"),
        "initial_dependencies": None if first is None else tuple(one for one, _ in first),
    }
