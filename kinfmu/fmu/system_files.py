"""Files for tools that connect FMUs: an FMU of kinfmu as an SSP, and its groups of variables for libcosim.

System Structure and Parameterization 1.0 or 2.0, a system of one component:

    SystemStructure.ssd          the component, its connectors with units, the default experiment
    resources/<name>.fmu
    resources/<name>.ssv         all parameters, with the values that the FMU starts with

Enumerations, the parameter `rates` and the output `solver.status`, are in 2.0 alone: libcosim and Ecos, which read 1.0,
end at the first one.

OspModelDescription.xml, of the Open Simulation Platform, names groups of variables that belong together, so that a
system structure connects groups, by name, in place of variables. libcosim reads the file next to the FMU, by the name
of the model: fourbar_OspModelDescription.xml.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from kinfmu.fmu import description
from kinfmu.fmu.archive import write, zipped
from kinfmu.fmu.description import Description
from kinfmu.fmu.description.common import ENUMERATIONS, base_unit, document, text
from kinfmu.fmu.interface import Interface, Variable
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, text_in, unpacked
from kinfmu.units import Quantity, unit_of

STRUCTURE = "SystemStructure.ssd"
PARAMETER_SET = "initialValues"  # the name that libcosim reads by default
_COMMON = "http://ssp-standard.org/SSP1/SystemStructureCommon"
_SSD = {"xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription", "xmlns:ssc": _COMMON}
_SSV = {"xmlns:ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues", "xmlns:ssc": _COMMON}
_CAUSALITIES = ("input", "output", "parameter", "calculatedParameter")
NAMESPACE = "https://open-simulation-platform.com/OspModelDescription/1.0.1"
_KINDS = {  # of a driver: word of its value, and the groups of OSP-IS for value, speed, acceleration, effort and port
    "angle": ("AngularDisplacement", "AngularVelocity", "AngularAcceleration", "Torque", "AngularMechanicalPort"),
    "length": ("LinearDisplacement", "LinearVelocity", "LinearAcceleration", "Force", "LinearMechanicalPort"),
}
_TORQUE = Quantity("torque")
_ORDER = (  # in which the schema wants the groups
    *("Generic", "Force", "Torque", "LinearVelocity", "AngularVelocity", "LinearDisplacement", "AngularDisplacement"),
    *("LinearAcceleration", "AngularAcceleration", "LinearMechanicalPort", "AngularMechanicalPort"),
)


def write_ssp(fmu: Path, path: Path, version: int = 1) -> Path:
    """Write the SSP of an FMU of kinfmu and return its path; the same FMU gives the same bytes.

    Args:
        fmu: The FMU.
        path: The .ssp to write.
        version: Version of SSP, 1 or 2.

    Raises:
        FmuError: The FMU cannot be read, or the file cannot be written.

    """
    about = _description_of(fmu)
    name = about.interface.name
    contents = {
        STRUCTURE: structure(about, version),
        f"resources/{name}.fmu": fmu.read_bytes(),
        f"resources/{name}.ssv": parameter_set(about.interface, version),
    }
    write(path, zipped(contents, STRUCTURE))
    return path


def _description_of(fmu: Path) -> Description:
    with unpacked(fmu) as folder:
        return description.read(text_in(fmu, folder, DESCRIPTION, LARGEST_DESCRIPTION).encode(), str(fmu))


def structure(about: Description, version: int = 1) -> bytes:
    """Return SystemStructure.ssd: the FMU as the only component, with all its inputs, outputs and parameters."""
    interface = about.interface
    root = Element("ssd:SystemStructureDescription", _SSD, version=f"{version}.0", name=interface.name)
    root.set("generationTool", about.generation_tool)
    system = SubElement(root, "ssd:System", name=interface.name, description=interface.title or interface.name)
    elements = SubElement(system, "ssd:Elements")
    component = SubElement(
        elements,
        "ssd:Component",
        name=interface.name,
        type="application/x-fmu-sharedlibrary",
        source=f"resources/{interface.name}.fmu",
    )
    connectors = SubElement(component, "ssd:Connectors")
    seen = [variable for variable in interface if _is_shown(variable, version)]
    for variable in seen:
        connector = SubElement(connectors, "ssd:Connector", name=variable.name, kind=variable.causality)
        declared = {"name": variable.declared_type} if variable.declared_type else {}
        SubElement(connector, f"ssc:{variable.type}", {"unit": variable.unit} if variable.unit else declared)
    bindings = SubElement(component, "ssd:ParameterBindings")
    SubElement(bindings, "ssd:ParameterBinding", source=f"resources/{interface.name}.ssv")
    if version > 1:
        definitions = SubElement(root, "ssd:Enumerations")
        for name, items in ENUMERATIONS.items():
            enumeration = SubElement(definitions, "ssc:Enumeration", name=name)
            for item in items:
                SubElement(enumeration, "ssc:Item", name=item.name.lower(), value=str(int(item)))
    units = SubElement(root, "ssd:Units")
    for name in sorted({variable.unit for variable in seen if variable.unit}):
        SubElement(SubElement(units, "ssc:Unit", name=name), "ssc:BaseUnit", base_unit(name))
    experiment = SubElement(root, "ssd:DefaultExperiment", startTime=text(float(interface.experiment.start)))
    if interface.experiment.stop > interface.experiment.start:
        experiment.set("stopTime", text(float(interface.experiment.stop)))
    return document(root)


def parameter_set(interface: Interface, version: int = 1) -> bytes:
    """Return the parameter set of an FMU: all its parameters with their start values and units.

    Args:
        interface: Variables of the FMU.
        version: Version of SSP: 2 with enumerations. The set itself is of version 1.0, which both read.

    """
    root = Element("ssv:ParameterSet", _SSV, version="1.0", name=PARAMETER_SET)
    parameters = SubElement(root, "ssv:Parameters")
    for variable in interface:
        if variable.causality == "parameter" and variable.start is not None and _is_shown(variable, version):
            parameter = SubElement(parameters, "ssv:Parameter", name=variable.name)
            if variable.type == "Real":
                value = SubElement(parameter, "ssv:Real", value=text(float(variable.start)))
                if variable.unit:
                    value.set("unit", variable.unit)
            elif variable.declared_type:
                item = next(one for one in ENUMERATIONS[variable.declared_type] if one == variable.start)
                SubElement(parameter, "ssv:Enumeration", value=item.name.lower())
            else:
                start = variable.start if variable.type == "Boolean" else int(variable.start)
                SubElement(parameter, f"ssv:{variable.type}", value=text(start))
    return document(root)


def _is_shown(variable: Variable, version: int) -> bool:
    return variable.causality in _CAUSALITIES and (version > 1 or variable.type != "Enumeration")


class VariableGroup(NamedTuple):
    """A group of variables: a quantity with its variables, or a port with its quantities."""

    kind: str
    name: str
    members: tuple[Variable | VariableGroup, ...]


def groups(interface: Interface) -> list[VariableGroup]:
    """Return the groups of the drivers of an FMU.

    A driver `crank` with forces has the port `crank`, of its effort and its speed, whose causalities are opposite: an
    FMU that takes the speed returns the torque, and one that takes the torque returns the speed. Value, acceleration
    and, without forces, the speed are groups of their own: `crank angle`, `crank acceleration`, `crank speed`. A
    generic group, `crank coupling`, holds what the coupling by bias and reduced inertia needs. External loads are
    groups of their own name.
    """
    found: list[VariableGroup] = []
    by_name = {variable.name: variable for variable in interface}
    motion = interface.motion
    for k in range(0, len(motion), 3):
        value, speed, acceleration = motion[k : k + 3]
        driver, _, noun = value.name.rpartition("_")
        kind = "angle" if value.unit == "rad" else "length"
        displacement, velocity, rate, effort_kind, port = _KINDS[kind]
        effort_noun = effort_kind.lower()
        effort = by_name.get(f"{driver}_{effort_noun}") or by_name.get(f"{driver}.{effort_noun}")
        found.append(VariableGroup(displacement, f"{driver} {noun}", (value,)))
        of_speed = VariableGroup(velocity, f"{driver} speed", (speed,))
        if effort is None:
            found.append(of_speed)
        else:
            of_effort = VariableGroup(effort_kind, f"{driver} {effort_noun}", (effort,))
            found.append(VariableGroup(port, driver, (of_effort, of_speed)))
        found.append(VariableGroup(rate, f"{driver} acceleration", (acceleration,)))
        coupled = [by_name.get(f"{driver}.{name}") for name in (f"bias_{effort_noun}", "reduced_inertia")]
        if all(coupled):
            members = (value, speed, acceleration, *(one for one in coupled if one is not None))
            found.append(VariableGroup("Generic", f"{driver} coupling", members))
    for variable in interface.part("loads"):
        kind = "Torque" if variable.unit == unit_of(_TORQUE, "m") else "Force"
        found.append(VariableGroup(kind, variable.name, (variable,)))
    return sorted(found, key=lambda group: _ORDER.index(group.kind))


def osp_text(interface: Interface) -> bytes:
    """Return OspModelDescription.xml of an FMU with these variables, of version 1.0.1 of its schema."""
    root = Element("OspModelDescription", xmlns=NAMESPACE, version="1.0")
    found = groups(interface)
    units = sorted({variable.unit for group in found for variable in _variables(group) if variable.unit})
    definitions = SubElement(root, "UnitDefinitions")
    for unit in units:
        SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", base_unit(unit))
    described = SubElement(root, "VariableGroups")
    for group in found:
        _write(described, group)
    return document(root)


def write_osp(fmu: Path) -> Path:
    """Write <model>_OspModelDescription.xml next to an FMU of kinfmu and return its path.

    Raises:
        FmuError: The FMU cannot be read, or the file cannot be written.

    """
    interface = _description_of(fmu).interface
    path = fmu.with_name(f"{interface.name}_OspModelDescription.xml")
    write(path, osp_text(interface))
    return path


def _variables(group: VariableGroup) -> Iterator[Variable]:
    for member in group.members:
        if isinstance(member, VariableGroup):
            yield from _variables(member)
        else:
            yield member


def _write(parent: Element, group: VariableGroup) -> None:
    element = SubElement(parent, group.kind, name=group.name)
    for member in group.members:
        if isinstance(member, VariableGroup):
            _write(element, member)
        else:
            attributes = {"ref": member.name} | ({"unit": member.unit} if member.unit else {})
            SubElement(element, "Variable", attributes)
