"""Model descriptions of FMI 2.0."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from kinfmu.fmu.description import common
from kinfmu.fmu.interface import Interface, Variable

ROOT = {"fmiVersion": "2.0", "variableNamingConvention": "structured", "numberOfEventIndicators": "0"}
TOKEN = "guid"  # noqa: S105  # the attribute's name
TYPES = ("Real", "Integer", "Enumeration", "Boolean", "String")


def write(root: Element, interface: Interface, kinds: Mapping[str, dict[str, str]], sources: Sequence[str]) -> None:
    """Everything below the root."""
    for kind, attributes in kinds.items():
        element = SubElement(root, kind, attributes)
        if sources:
            files = SubElement(element, "SourceFiles")
            for name in sources:
                SubElement(files, "File", name=name)
    common.units(root, interface)
    simple = SubElement(SubElement(root, "TypeDefinitions"), "SimpleType", name=common.STATUS_TYPE)
    common.statuses(SubElement(simple, "Enumeration"))
    common.log_categories(root)
    common.experiment(root, interface.experiment)
    common.annotation(SubElement(SubElement(root, "VendorAnnotations"), "Tool", name=common.TOOL), interface)
    references = interface.value_references()
    variables = SubElement(root, "ModelVariables")
    for variable in interface:
        _variable(variables, variable, references)
    _structure(root, interface, references)


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
        kind["declaredType"] = common.STATUS_TYPE
    if variable.unit:
        kind["unit"] = variable.unit
    if variable.display_unit:
        kind["displayUnit"] = variable.display_unit
    kind |= common.limits(variable)
    if variable.derivative_of:
        kind["derivative"] = str(references[variable.derivative_of] + 1)
    SubElement(scalar, variable.type, kind)


def _structure(root: Element, interface: Interface, references: Mapping[str, int]) -> None:
    """Outputs and InitialUnknowns. An index is the place in the list, counted from 1."""
    structure = SubElement(root, "ModelStructure")
    lists: tuple[tuple[str, common.UnknownKind], ...] = (("Outputs", "outputs"), ("InitialUnknowns", "initial"))
    for element, kind in lists:
        parent = SubElement(structure, element)
        for variable, names in common.unknowns(interface, kind):
            unknown = {"index": str(references[variable.name] + 1)}
            if names is not None:
                unknown["dependencies"] = " ".join(str(k) for k in sorted(references[name] + 1 for name in names))
                unknown["dependenciesKind"] = " ".join("dependent" for _ in names)
            SubElement(parent, "Unknown", unknown)


def parts(root: Element) -> Element | None:
    """The annotation that tells our FMUs from others."""
    return root.find(f"VendorAnnotations/Tool[@name='{common.TOOL}']/Parts")


def variables(root: Element) -> list[dict[str, Any]]:
    """The fields of each variable."""
    scalars = list(root.iterfind("ModelVariables/ScalarVariable"))
    names = [scalar.get("name", "") for scalar in scalars]
    outputs = _unknowns(root.iterfind("ModelStructure/Outputs/Unknown"), names)
    initial = _unknowns(root.iterfind("ModelStructure/InitialUnknowns/Unknown"), names)
    found = []
    for name, scalar in zip(names, scalars, strict=True):
        kind = next(child for child in scalar if child.tag in TYPES)
        derivative = kind.get("derivative")
        found.append(
            {
                "attributes": {**scalar.attrib, **kind.attrib},
                "type": kind.tag,
                "derivative_of": None if derivative is None else names[int(derivative) - 1],
                "dependencies": outputs.get(name),
                "initial_dependencies": initial.get(name),
            }
        )
    return found


def _unknowns(elements: Iterable[Element], names: Sequence[str]) -> dict[str, tuple[str, ...] | None]:
    found: dict[str, tuple[str, ...] | None] = {}
    for unknown in elements:
        listed = unknown.get("dependencies")
        depends = None if listed is None else tuple(names[int(index) - 1] for index in listed.split())
        found[names[int(unknown.get("index", "0")) - 1]] = depends
    return found
