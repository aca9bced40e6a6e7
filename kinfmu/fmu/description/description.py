"""Model description: an Interface written as modelDescription.xml of FMI 2.0 or 3.0, and read and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, cast
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

from kinfmu.errors import FmuError, KinfmuError, listed
from kinfmu.fmu.description import fmi2, fmi3
from kinfmu.fmu.description.common import document, number, text
from kinfmu.fmu.interface import Interface, InterfacePart, Variable
from kinfmu.mechanism import RunSettings
from kinfmu.mechanism.valid import check_name, quoted
from kinfmu.units import METRES, read_coordinate, read_inputs

FmiVersion = Literal["2.0", "3.0"]
MOST_TAGS = 2**22
_VERSIONS: dict[FmiVersion, Any] = {"2.0": fmi2, "3.0": fmi3}
_FIXED_PARTS = {  # parts with a fixed list of variables
    "residual": ("solver.residual",),
    "margin": ("solver.margin",),
    "errors": ("solver.error_q", "solver.error_qd", "solver.error_qdd"),
    "counts": ("solver.status", "solver.iterations"),
    "message": ("solver.message",),
}


@dataclass(frozen=True)
class Description:
    """A model description: the variables and the identity of the FMU.

    Attributes:
        interface: Variables of the FMU.
        token: Hash of its content: `guid` in FMI 2.0, `instantiationToken` in FMI 3.0.
        model_identifier: Name of the library.
        generation_tool: Program that built the FMU, such as "kinfmu 1.0".
        version: Version of FMI.
        sources: Names of the C files inside, if any.
        metadata: Further attributes, such as `author`.

    """

    interface: Interface
    token: str
    model_identifier: str
    generation_tool: str
    version: FmiVersion = "2.0"
    sources: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)


def write(description: Description, kinds: Mapping[str, Mapping[str, float | bool]]) -> bytes:
    """Return modelDescription.xml.

    It has no date unless the metadata state one: the same content gives the same bytes.

    Args:
        description: Model description.
        kinds: Capabilities such as canGetAndSetFMUstate, by kind of simulation: CoSimulation, ModelExchange.

    """
    interface = description.interface
    version = _VERSIONS[description.version]
    root = Element(
        "fmiModelDescription",
        {"fmiVersion": description.version, "modelName": interface.name, version.TOKEN: description.token}
        | {"description": interface.title or interface.name, "generationTool": description.generation_tool}
        | dict(description.metadata)
        | version.ROOT,
    )
    attributes = {
        kind: {"modelIdentifier": description.model_identifier, **{name: text(flag) for name, flag in flags.items()}}
        for kind, flags in kinds.items()
    }
    version.write(root, interface, attributes, description.sources)
    return document(root)


def read(data: bytes, where: str) -> Description:
    """Return the description of an FMU of kinfmu.

    Args:
        data: modelDescription.xml.
        where: Name of the file, for messages.

    Raises:
        FmuError: If the description is damaged, is of another version of FMI, or is not of an FMU of kinfmu.

    """
    if data.count(b"<") > MOST_TAGS:  # a tree takes a hundred times the memory of its shortest tags
        raise FmuError(f"{where}: modelDescription.xml has more than {MOST_TAGS} tags")
    try:
        root = ET.fromstring(data)  # noqa: S314  # the stdlib parser loads no external entities
    except ET.ParseError as error:
        raise FmuError(f"{where}: modelDescription.xml is not XML ({error})") from None
    declared = root.get("fmiVersion", "unknown")
    if declared not in _VERSIONS:
        raise FmuError(f"{where}: FMI version {quoted(declared)[1:-1]}; kinfmu simulates FMI 2.0 and 3.0")
    version = _VERSIONS[declared]
    parts = version.parts(root)
    simulation = root.find("CoSimulation")
    if parts is None or simulation is None:
        tool = quoted(root.get("generationTool", "an unknown tool"))[1:-1]
        raise FmuError(f"{where}: made by {tool}; this needs a co-simulation FMU that kinfmu built")
    try:
        interface = _interface(root, parts, [_variable(**fields) for fields in version.variables(root)])
        about = Description(
            interface,
            token=root.get(version.TOKEN, ""),
            model_identifier=simulation.get("modelIdentifier", ""),
            generation_tool=root.get("generationTool", ""),
            version=declared,
            sources=tuple(file.get("name", "") for file in simulation.iterfind("SourceFiles/File")),
        )
        check_name("modelName", interface.name)
        check_name("modelIdentifier", about.model_identifier)  # a part of the library's path
        _check(interface)
    except KeyError as error:
        raise FmuError(f"{where}: modelDescription.xml is damaged: {error} is not known") from None
    except (ValueError, StopIteration, OverflowError, KinfmuError) as error:
        reason = str(error) or "a variable has no type"
        raise FmuError(f"{where}: modelDescription.xml is damaged: {reason}") from None
    return about


def _interface(root: Element, parts: Element, variables: Sequence[Variable]) -> Interface:
    groups, first = [], 0
    for part in parts:
        count = int(part.get("variables", "0"))
        groups.append(InterfacePart(part.get("name", ""), tuple(variables[first : first + count])))
        first += count
    title, name = root.get("description", ""), root.get("modelName", "")
    return Interface(
        name=name,
        title="" if title == name else title,
        length_unit=parts.get("lengthUnit", "m"),
        experiment=_experiment(root.find("DefaultExperiment")),
        coordinate_count=int(parts.get("coordinates", "0")),
        parts=tuple(groups),
    )


def _experiment(element: Element | None) -> RunSettings:
    attributes = {} if element is None else element.attrib
    start = float(attributes.get("startTime", "0"))
    return RunSettings(start, float(attributes.get("stopTime", start)), float(attributes.get("stepSize", "0.01")))


def _variable(attributes: Mapping[str, str], **fields: Any) -> Variable:
    start = attributes.get("start")
    return Variable(
        name=attributes.get("name", ""),
        causality=cast("Any", attributes.get("causality", "local")),
        variability=cast("Any", attributes.get("variability", "continuous")),
        description=attributes.get("description", ""),
        initial=cast("Any", attributes.get("initial")),
        unit=attributes.get("unit"),
        start=start == "true" if start in ("true", "false") else number(start),
        minimum=number(attributes.get("min")),
        maximum=number(attributes.get("max")),
        nominal=number(attributes.get("nominal")),
        declared_type=attributes.get("declaredType"),
        display_length=_display_length(attributes.get("unit", ""), attributes.get("displayUnit", "")),
        **fields,
    )


def _display_length(unit: str, shown: str) -> str | None:
    """Return 'mm' for the unit 'm/s' and the display unit 'mm/s'; None if they state no other unit of length."""
    base, length = unit.partition("/")[0], shown.partition("/")[0]
    return length if base == "m" and length in METRES else None


def _check(interface: Interface) -> None:
    """Raise an FmuError for an interface that differs in structure from those of `interface`."""
    if interface.length_unit not in METRES:
        raise FmuError(f"unit of length {quoted(interface.length_unit)} is not one of {listed(METRES)}")
    for name, variables in _FIXED_PARTS.items():
        if not set(variables) <= set(_names(interface.part(name))):
            raise FmuError(f"part {name} does not hold {listed(variables)}")
    owns = bool(interface.part("states"))
    switches = interface.part("drive")
    if not owns and [(variable.type, type(variable.start)) for variable in switches] != [("Boolean", bool)]:
        raise FmuError("part drive must be one Boolean variable with a start value")
    _check_motion(interface)


def _check_motion(interface: Interface) -> None:
    """Raise an FmuError unless the outputs are coordinates, with their rates, and every driver has three inputs."""
    outputs = _names(interface.part("values"))
    coordinates = []
    for name in (*outputs, *_names(interface.part("fixed"))):
        coordinate = read_coordinate(name)
        if coordinate is None:
            raise FmuError(f"{quoted(name)} is no coordinate such as 'crank.phi'")
        coordinates.append(coordinate)
    for order, part in enumerate(("values", "rates", "accelerations")):
        if _names(interface.part(part)) != [name.derivative(order) for name in coordinates[: len(outputs)]]:
            raise FmuError(f"part {part} does not hold the derivatives of the outputs")
    if not 0 <= interface.coordinate_count <= len(outputs):
        raise FmuError(f"{interface.coordinate_count} of {len(outputs)} outputs cannot be coordinates")
    motion = _names(interface.motion)
    if read_inputs(motion) is None:
        raise FmuError("part inputs, or states, does not hold three variables for each driver")
    if interface.part("states"):
        if 3 * len(interface.part("efforts")) != len(motion) or 3 * len(interface.derivatives) != 2 * len(motion):
            raise FmuError("parts states and efforts do not hold value, speed, acceleration and effort of each driver")
    elif _names(interface.part("driven")) != [f"driven.{name}" for name in motion]:
        raise FmuError("part driven does not hold the inputs, three for each driver")
    for name in _names(interface.part("watch")):
        if not name.startswith("watch."):
            raise FmuError(f"{quoted(name)} is no name of a watch such as 'watch.rod.length'")


def _names(variables: Sequence[Variable]) -> list[str]:
    return [variable.name for variable in variables]
