"""Model description: an Interface as modelDescription.xml of FMI 2.0, and read back from it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import cast
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element, SubElement

from kinfmu.errors import FmuError
from kinfmu.fmu.interface import Interface, Part, Variable
from kinfmu.mechanism import RunSettings
from kinfmu.solver.status import Status
from kinfmu.units import METRES, display_units

TOOL = "kinfmu"  # name of the vendor annotation that tells our FMUs from others
STATUS_TYPE = "Status"
LOG_CATEGORIES = {
    "logStatusWarning": "What the host may have meant otherwise",
    "logStatusDiscard": "Steps that cannot be done: driver, value and limit",
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


@dataclass(frozen=True)
class Description:
    """A model description: the variables and who the FMU is. token: hash of its content, the guid in FMI's words."""

    interface: Interface
    token: str
    model_identifier: str
    generation_tool: str


def write(description: Description, capabilities: Mapping[str, bool]) -> bytes:
    """modelDescription.xml; capabilities: the flags of a flavour, such as canGetAndSetFMUstate.

    It carries no date: the same content gives the same bytes.
    """
    interface = description.interface
    root = Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=interface.name,
        guid=description.token,
        description=interface.title or interface.name,
        generationTool=description.generation_tool,
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    flags = {name: _text(flag) for name, flag in capabilities.items()}
    SubElement(root, "CoSimulation", {"modelIdentifier": description.model_identifier, **flags})
    _units(root, interface)
    _status_type(root)
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    _experiment(root, interface.experiment)
    _annotation(root, interface)
    references = interface.value_references()
    variables = SubElement(root, "ModelVariables")
    for variable in interface:
        _variable(variables, variable, references)
    _structure(root, interface, references)
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _text(value: float | bool) -> str:
    """A number so that it reads back bitwise, a truth value as XML writes it."""
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _units(root: Element, interface: Interface) -> None:
    definitions = SubElement(root, "UnitDefinitions")
    for name in sorted({variable.unit for variable in interface if variable.unit}):
        unit = SubElement(definitions, "Unit", name=name)
        SubElement(unit, "BaseUnit", _base_unit(name))
        for display, factor in display_units(name).items():
            SubElement(unit, "DisplayUnit", name=display, factor=_text(factor))


def _base_unit(name: str) -> dict[str, str]:
    """Exponents of SI base units and factor: `mm/s2` is m=1, s=-2, factor=0.001."""
    base, _, per = name.partition("/")
    exponents = {"s": -int(per[1:] or 1) if per else 0}
    factor = 1.0
    if base == "rad":
        exponents = {"rad": 1, **exponents}
    elif base in METRES:
        exponents, factor = {"m": 1, **exponents}, METRES[base]
    elif base == "s":
        exponents["s"] += 1
    attributes = {key: str(exponent) for key, exponent in exponents.items() if exponent}
    return attributes if factor == 1.0 else {**attributes, "factor": _text(factor)}


def _status_type(root: Element) -> None:
    simple = SubElement(SubElement(root, "TypeDefinitions"), "SimpleType", name=STATUS_TYPE)
    enumeration = SubElement(simple, "Enumeration")
    for status in Status:
        item = {"name": status.name.lower(), "value": str(int(status)), "description": _STATUS_WORDS[status]}
        SubElement(enumeration, "Item", item)


def _experiment(root: Element, experiment: RunSettings) -> None:
    attributes = {"startTime": _text(float(experiment.start))}
    if experiment.stop > experiment.start:  # FMI wants stopTime > startTime
        attributes["stopTime"] = _text(float(experiment.stop))
    SubElement(root, "DefaultExperiment", attributes, stepSize=_text(float(experiment.step)))


def _annotation(root: Element, interface: Interface) -> None:
    tool = SubElement(SubElement(root, "VendorAnnotations"), "Tool", name=TOOL)
    parts = SubElement(tool, "Parts", coordinates=str(interface.coordinate_count), lengthUnit=interface.length_unit)
    for part in interface.parts:
        SubElement(parts, "Part", name=part.name, variables=str(len(part.variables)))


def _variable(parent: Element, variable: Variable, references: Mapping[str, int]) -> None:
    attributes = {
        "name": variable.name,
        "valueReference": str(references[variable.name]),
        "description": variable.description,
        "causality": variable.causality,
        "variability": variable.variability,
    }
    if variable.initial:
        attributes["initial"] = variable.initial
    scalar = SubElement(parent, "ScalarVariable", attributes)
    kind: dict[str, str] = {}
    if variable.type == "Enumeration":
        kind["declaredType"] = STATUS_TYPE
    if variable.unit:
        kind["unit"] = variable.unit
    if variable.display_unit:
        kind["displayUnit"] = variable.display_unit
    for key, value in (("min", variable.minimum), ("max", variable.maximum), ("start", variable.start)):
        if value is not None:
            kind[key] = _text(float(value)) if variable.type == "Real" else _text(_whole(value))
    if variable.derivative_of:
        kind["derivative"] = str(references[variable.derivative_of] + 1)
    SubElement(scalar, variable.type, kind)


def _whole(value: float | bool) -> int | bool:
    return value if isinstance(value, bool) else int(value)


def _structure(root: Element, interface: Interface, references: Mapping[str, int]) -> None:
    """Outputs, and InitialUnknowns: outputs and what follows from parameters.

    An index is the place in the list, counted from 1.
    """
    structure = SubElement(root, "ModelStructure")
    listed = {"Outputs": ("output",), "InitialUnknowns": ("output", "calculatedParameter")}
    for element, causalities in listed.items():
        parent = SubElement(structure, element)
        for variable in interface:
            if variable.causality not in causalities:
                continue
            names = variable.dependencies if element == "Outputs" else variable.initial_dependencies
            unknown = {"index": str(references[variable.name] + 1)}
            if names is not None:
                unknown["dependencies"] = " ".join(str(k) for k in sorted(references[name] + 1 for name in names))
                unknown["dependenciesKind"] = " ".join("dependent" for _ in names)
            SubElement(parent, "Unknown", unknown)


def read(text: bytes, where: str) -> Description:
    """The description in modelDescription.xml of one of our FMUs; `where` names the file in messages."""
    try:
        root = ET.fromstring(text)  # noqa: S314  # the stdlib parser loads no external entities
    except ET.ParseError as error:
        raise FmuError(f"{where}: modelDescription.xml is not XML ({error})") from None
    version = root.get("fmiVersion", "unknown")
    if version != "2.0":
        raise FmuError(f"{where}: FMI version {version}; kinfmu simulates FMI 2.0")
    parts = root.find(f"VendorAnnotations/Tool[@name='{TOOL}']/Parts")
    simulation = root.find("CoSimulation")
    if parts is None or simulation is None:
        tool = root.get("generationTool", "an unknown tool")
        raise FmuError(f"{where}: made by {tool}; kinfmu simulates the co-simulation FMUs that kinfmu built")
    variables = _read_variables(root)
    groups, first = [], 0
    for part in parts:
        count = int(part.get("variables", "0"))
        groups.append(Part(part.get("name", ""), tuple(variables[first : first + count])))
        first += count
    title, name = root.get("description", ""), root.get("modelName", "")
    interface = Interface(
        name=name,
        title="" if title == name else title,
        length_unit=parts.get("lengthUnit", "m"),
        experiment=_read_experiment(root.find("DefaultExperiment")),
        coordinate_count=int(parts.get("coordinates", "0")),
        parts=tuple(groups),
    )
    identifier = simulation.get("modelIdentifier", "")
    return Description(interface, root.get("guid", ""), identifier, root.get("generationTool", ""))


def _read_experiment(element: Element | None) -> RunSettings:
    attributes = {} if element is None else element.attrib
    start = float(attributes.get("startTime", "0"))
    return RunSettings(start, float(attributes.get("stopTime", start)), float(attributes.get("stepSize", "0.01")))


def _read_variables(root: Element) -> list[Variable]:
    scalars = list(root.iterfind("ModelVariables/ScalarVariable"))
    names = [scalar.get("name", "") for scalar in scalars]
    outputs = _read_unknowns(root.iterfind("ModelStructure/Outputs/Unknown"), names)
    initial = _read_unknowns(root.iterfind("ModelStructure/InitialUnknowns/Unknown"), names)
    variables = []
    for name, scalar in zip(names, scalars, strict=True):
        kind = next(child for child in scalar if child.tag in ("Real", "Integer", "Enumeration", "Boolean", "String"))
        start, derivative = kind.get("start"), kind.get("derivative")
        fields = {
            "name": name,
            "type": kind.tag,
            "causality": scalar.get("causality", "local"),
            "variability": scalar.get("variability", "continuous"),
            "description": scalar.get("description", ""),
            "initial": scalar.get("initial"),
            "unit": kind.get("unit"),
            "start": start == "true" if start in ("true", "false") else _number(start),
            "minimum": _number(kind.get("min")),
            "maximum": _number(kind.get("max")),
            "derivative_of": None if derivative is None else names[int(derivative) - 1],
            "dependencies": outputs.get(name),
            "initial_dependencies": initial.get(name),
        }
        variables.append(Variable(**cast("dict[str, str]", fields)))  # type: ignore[arg-type]
    return variables


def _number(text: str | None) -> float | None:
    return None if text is None else float(text)


def _read_unknowns(unknowns: Iterable[Element], names: list[str]) -> dict[str, tuple[str, ...] | None]:
    found: dict[str, tuple[str, ...] | None] = {}
    for unknown in unknowns:
        listed = unknown.get("dependencies")
        depends = None if listed is None else tuple(names[int(index) - 1] for index in listed.split())
        found[names[int(unknown.get("index", "0")) - 1]] = depends
    return found
