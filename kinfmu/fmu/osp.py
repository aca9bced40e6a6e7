"""OspModelDescription.xml of an FMU, for libcosim and other tools of the Open Simulation Platform.

It names groups of variables that belong together, so that a system structure connects groups, by name, in place of
variables. libcosim reads the file next to the FMU, by the name of the model: fourbar_OspModelDescription.xml.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element, SubElement

from kinfmu.errors import FmuError
from kinfmu.files import write_whole
from kinfmu.fmu import description
from kinfmu.fmu.description.common import base_unit
from kinfmu.fmu.interface import Interface, Variable
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, text_in, unpacked
from kinfmu.units import Quantity, unit_of

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


def osp_text(interface: Interface) -> str:
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
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def write_osp(fmu: Path) -> Path:
    """Write <model>_OspModelDescription.xml next to an FMU of kinfmu and return its path.

    Raises:
        FmuError: The FMU cannot be read, or the file cannot be written.

    """
    with unpacked(fmu) as folder:
        text = text_in(fmu, folder, DESCRIPTION, LARGEST_DESCRIPTION)
    interface = description.read(text.encode(), str(fmu)).interface
    path = fmu.with_name(f"{interface.name}_OspModelDescription.xml")
    try:
        write_whole(path, osp_text(interface).encode())
    except OSError as error:
        raise FmuError(f"{path}: cannot be written ({error.strerror})") from None
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
