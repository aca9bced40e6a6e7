"""terminalsAndIcons.xml of FMI 3.0: one terminal for each driver, with what is connected to a drive."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element, SubElement

from kinfmu.fmu.interface import Interface
from kinfmu.plan import SolvePlan

FOLDER = "terminalsAndIcons"
KIND = "org.kinfmu.driver"
_SIDE = "100"  # of the icon, from its middle
_EDGES = {"x1": f"-{_SIDE}", "y1": f"-{_SIDE}", "x2": _SIDE, "y2": _SIDE}


def terminals(plan: SolvePlan, variables: Interface) -> bytes:
    """Return terminalsAndIcons.xml of the FMU of a plan.

    A terminal is a bus: members connect by name, and need not all be connected. Its inputs are named by what they hold:
    angle (position, length), speed, acceleration; its outputs as in the FMU: torque, bias_torque, reduced_inertia.
    """
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = SubElement(root, "GraphicalRepresentation")
    SubElement(graphics, "CoordinateSystem", _EDGES | {"suggestedScalingFactorTo_mm": "0.1"})
    SubElement(graphics, "Icon", _EDGES)
    if plan.drivers:
        drivers = SubElement(root, "Terminals")
        for driver in plan.drivers:
            about = f"Driver {driver.name}: its motion, and with masses its effort, bias and reduced inertia"
            terminal = SubElement(
                drivers, "Terminal", name=driver.name, matchingRule="bus", terminalKind=KIND, description=about
            )
            for variable, member in _members(driver.name, variables):
                SubElement(
                    terminal,
                    "TerminalMemberVariable",
                    variableName=variable,
                    memberName=member,
                    variableKind="signal",
                )
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()


def _members(driver: str, variables: Interface) -> Iterator[tuple[str, str]]:
    """Yield variables and the names of members."""
    for variable in (*variables.part("inputs"), *variables.part("states"), *variables.part("efforts")):
        owner, _, noun = variable.name.rpartition("_")
        if owner == driver:
            yield variable.name, noun
    for variable in variables.part("forces"):
        owner, _, noun = variable.name.partition(".")
        if owner == driver:
            yield variable.name, noun
