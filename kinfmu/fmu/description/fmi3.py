"""Model descriptions of FMI 3.0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from kinfmu.fmu.description import common
from kinfmu.fmu.interface import Interface, Variable

ROOT = {"fmiVersion": "3.0", "variableNamingConvention": "structured"}
TOKEN = "instantiationToken"  # noqa: S105  # the attribute's name
TYPES = {
    "Real": "Float64",
    "Integer": "Int32",
    "Enumeration": "Enumeration",
    "Boolean": "Boolean",
    "String": "String",
}
_TYPES_BACK = {theirs: ours for ours, theirs in TYPES.items()}


def write(root: Element, interface: Interface, kinds: Mapping[str, dict[str, str]], _sources: Sequence[str]) -> None:
    """Write everything below the root; sources are listed in sources/buildDescription.xml."""
    for kind, attributes in kinds.items():
        SubElement(root, kind, attributes)
    common.units(root, interface)
    definitions = SubElement(root, "TypeDefinitions")
    for name in common.ENUMERATIONS:
        common.items(SubElement(definitions, "EnumerationType", name=name), name)
    common.log_categories(root)
    common.experiment(root, interface.experiment)
    references = interface.value_references()
    variables = SubElement(root, "ModelVariables")
    for variable in interface:
        _variable(variables, common.shown(variable, kinds, interface), references)
    _structure(root, interface, references)
    common.annotation(SubElement(SubElement(root, "Annotations"), "Annotation", type=common.TOOL), interface)


def _variable(parent: Element, variable: Variable, references: Mapping[str, int]) -> None:
    attributes = common.attributes(variable, references) | common.typed(variable)
    if variable.derivative_of:
        attributes["derivative"] = str(references[variable.derivative_of])
    SubElement(parent, TYPES[variable.type], attributes)


def _structure(root: Element, interface: Interface, references: Mapping[str, int]) -> None:
    """Write Output, ContinuousStateDerivative and InitialUnknown elements, by value references."""
    structure = SubElement(root, "ModelStructure")
    lists: tuple[tuple[str, common.UnknownKind], ...] = (
        ("Output", "outputs"),
        ("ContinuousStateDerivative", "derivatives"),
        ("InitialUnknown", "initial"),
    )
    for element, kind in lists:
        for variable, depends in common.unknowns(interface, kind, references):
            SubElement(structure, element, {"valueReference": str(references[variable.name])} | depends)


def parts(root: Element) -> Element | None:
    """Return the annotation that identifies FMUs of kinfmu, or None."""
    return root.find(f"Annotations/Annotation[@type='{common.TOOL}']/Parts")


def variables(root: Element) -> list[dict[str, Any]]:
    """Return the fields of each variable."""
    elements = list(root.iterfind("ModelVariables/*"))
    names = {element.get("valueReference", ""): element.get("name", "") for element in elements}
    outputs = common.read_unknowns(root.iterfind("ModelStructure/Output"), "valueReference", names)
    initial = common.read_unknowns(root.iterfind("ModelStructure/InitialUnknown"), "valueReference", names)
    return [
        {
            "attributes": element.attrib,
            "type": _TYPES_BACK[element.tag],
            "derivative_of": names.get(element.get("derivative", "none")),
        }
        | common.dependencies(element.get("name", ""), outputs, initial)
        for element in elements
    ]
