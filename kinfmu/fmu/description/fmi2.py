"""Model descriptions of FMI 2.0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from kinfmu.fmu.description import common
from kinfmu.fmu.interface import Interface, Variable

ROOT = {"fmiVersion": "2.0", "variableNamingConvention": "structured", "numberOfEventIndicators": "0"}
TOKEN = "guid"  # noqa: S105  # the attribute's name
TYPES = ("Real", "Integer", "Enumeration", "Boolean", "String")


def write(root: Element, interface: Interface, kinds: Mapping[str, dict[str, str]], sources: Sequence[str]) -> None:
    """Write everything below the root."""
    for kind, attributes in kinds.items():
        element = SubElement(root, kind, attributes)
        if sources:
            files = SubElement(element, "SourceFiles")
            for name in sources:
                SubElement(files, "File", name=name)
    common.units(root, interface)
    definitions = SubElement(root, "TypeDefinitions")
    for name in common.ENUMERATIONS:
        common.items(SubElement(SubElement(definitions, "SimpleType", name=name), "Enumeration"), name)
    common.log_categories(root)
    common.experiment(root, interface.experiment)
    common.annotation(SubElement(SubElement(root, "VendorAnnotations"), "Tool", name=common.TOOL), interface)
    references = interface.value_references()
    variables = SubElement(root, "ModelVariables")
    for variable in interface:
        _variable(variables, common.shown(variable, kinds, interface), references)
    _structure(root, interface, references)


def _variable(parent: Element, variable: Variable, references: Mapping[str, int]) -> None:
    scalar = SubElement(parent, "ScalarVariable", common.attributes(variable, references))
    kind = common.typed(variable)
    if variable.derivative_of:
        kind["derivative"] = str(references[variable.derivative_of])
    SubElement(scalar, variable.type, kind)


def _structure(root: Element, interface: Interface, references: Mapping[str, int]) -> None:
    """Write Outputs, Derivatives of states, and InitialUnknowns.

    Indices, like value references, are places in the list, from 1.
    """
    structure = SubElement(root, "ModelStructure")
    lists: tuple[tuple[str, common.UnknownKind], ...] = (
        ("Outputs", "outputs"),
        ("Derivatives", "derivatives"),
        ("InitialUnknowns", "initial"),
    )
    for element, kind in lists:
        if kind == "derivatives" and not interface.derivatives:
            continue
        parent = SubElement(structure, element)
        for variable, depends in common.unknowns(interface, kind, references):
            SubElement(parent, "Unknown", {"index": str(references[variable.name])} | depends)


def parts(root: Element) -> Element | None:
    """Return the annotation that identifies FMUs of kinfmu, or None."""
    return root.find(f"VendorAnnotations/Tool[@name='{common.TOOL}']/Parts")


def variables(root: Element) -> list[dict[str, Any]]:
    """Return the fields of each variable."""
    scalars = list(root.iterfind("ModelVariables/ScalarVariable"))
    names = [scalar.get("name", "") for scalar in scalars]
    places = {str(k): name for k, name in enumerate(names, start=1)}
    outputs = common.read_unknowns(root.iterfind("ModelStructure/Outputs/Unknown"), "index", places)
    initial = common.read_unknowns(root.iterfind("ModelStructure/InitialUnknowns/Unknown"), "index", places)
    found = []
    for name, scalar in zip(names, scalars, strict=True):
        kind = next(child for child in scalar if child.tag in TYPES)
        fields = {
            "attributes": {**scalar.attrib, **kind.attrib},
            "type": kind.tag,
            "derivative_of": places.get(kind.get("derivative", "none")),
        }
        found.append(fields | common.dependencies(name, outputs, initial))
    return found
