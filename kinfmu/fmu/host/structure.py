"""The structure of a system: components, connections and given values, of an SSP or of one FMU."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from kinfmu.errors import FmuError, listed, suggestion, valid_names
from kinfmu.fmu import description
from kinfmu.fmu.description import Description
from kinfmu.fmu.host.ports import Port, ports_of, read_description, unlogged
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, MECHANISM, text_in, unpacked
from kinfmu.mechanism import RunSettings
from kinfmu.mechanism.valid import quoted

STRUCTURE = "SystemStructure.ssd"
STEPS = 1000  # of a run whose FMUs state no step


@dataclass(frozen=True, eq=False)
class Component:
    """An FMU of a system.

    Attributes:
        name: Name in the system; '' of a single FMU.
        path: Its file, for messages.
        folder: Folder into which it is unpacked.
        about: fmpy's model description.
        ports: Variables that hold one number, by name.
        own: kinfmu's description if kinfmu built the FMU, else None.
        mechanism: Text of its mechanism file, '' without one.
        values: Given values of parameters and inputs, by name.

    """

    name: str
    path: Path
    folder: Path
    about: Any
    ports: Mapping[str, Port]
    own: Description | None
    mechanism: str
    values: Mapping[str, float]

    def column(self, port: str) -> str:
        """Return the name of a variable in the system, such as 'motor.current'."""
        return f"{self.name}.{port}" if self.name else port

    def of(self, causality: str) -> list[Port]:
        """Return the variables of a causality, such as 'output'."""
        return [port for port in self.ports.values() if port.causality == causality]

    @property
    def experiment(self) -> Any:
        """fmpy's default experiment, None without one."""
        return self.about.defaultExperiment


@dataclass(frozen=True, eq=False)
class Connection:
    """A value that goes from an output to an input: factor * value + offset."""

    source: Component
    output: Port
    target: Component
    input: Port
    factor: float = 1.0
    offset: float = 0.0

    def __str__(self) -> str:
        return f"{self.source.column(self.output.name)} -> {self.target.column(self.input.name)}"


@dataclass(frozen=True, eq=False)
class SystemStructure:
    """Components and connections of a system.

    Attributes:
        name: Name of the system.
        title: Its description in one line, '' without one.
        components: The FMUs.
        connections: Connections of outputs with inputs.
        inputs: Inputs of the system by name: those of its connectors and all that are not connected.
        experiment: Default start, stop and step [s]; stop is NaN if none is stated.
        notes: What is not recorded, in sentences.

    """

    name: str
    title: str
    components: tuple[Component, ...]
    connections: tuple[Connection, ...]
    inputs: Mapping[str, tuple[tuple[Component, Port], ...]]
    experiment: RunSettings
    notes: tuple[str, ...]


def component(name: str, path: Path, folder: Path) -> Component:
    """Return an unpacked FMU as a component."""
    about = read_description(path, folder)
    is_own = (folder / MECHANISM).is_file() and "kinfmu" in str(about.generationTool)
    text = text_in(path, folder, DESCRIPTION, LARGEST_DESCRIPTION) if is_own else ""
    own = description.read(text.encode(), str(path)) if is_own else None
    mechanism = text_in(path, folder, MECHANISM) if is_own else ""
    return Component(name, path, folder, about, ports_of(about), own, mechanism, {})


def of_fmu(path: Path, folder: Path) -> SystemStructure:
    """Return the system of a single unpacked FMU."""
    only = component("", path, folder)
    name = str(only.about.modelName or path.stem)
    return _structure((name, str(only.about.description or name)), (only,), (), {}, None)


def of_ssp(path: Path, folder: Path, opened: Any) -> SystemStructure:
    """Return the system of an unpacked SSP; opened: an ExitStack that keeps the unpacked FMUs.

    Raises:
        FmuError: The file is no SSP, holds what is not supported, or its connections do not fit.

    """
    from fmpy.ssp.ssd import Component as FmpyComponent
    from fmpy.ssp.ssd import read_ssd

    try:
        root = ET.parse(folder / STRUCTURE).getroot()  # noqa: S314  # the stdlib parser loads no external entities
        is_old = root.get("version", "").startswith("1.")  # fmpy has the schemas of SSP 1.0 only
        described = read_ssd(BytesIO(path.read_bytes()), validate=is_old)  # fmpy leaves files of an invalid SSP open
    except Exception as error:  # fmpy and lxml raise bare exceptions
        raise FmuError(f"{path}: {STRUCTURE} is not valid: {' '.join(str(error).split())[:300]}") from None
    system = described.system
    components = {}
    for element in system.elements:
        if not isinstance(element, FmpyComponent):
            raise FmuError(f"{path}: element '{element.name}' is no component; nested systems are not supported")
        file = (folder / str(element.source)).resolve()
        if not file.is_relative_to(folder.resolve()) or not file.is_file():
            raise FmuError(f"{path}: component '{element.name}': the SSP holds no file {quoted(str(element.source))}")
        inside = Path(f"{path}, {element.source}")
        made = component(element.name, inside, opened.enter_context(unpacked(file)))
        values = dict(_values(path, element, made))
        components[element.name] = replace(made, values=values)
    if not components:
        raise FmuError(f"{path}: the system has no components")
    for binding in system.parameterBindings:
        for parameter in _parameters(path, binding):
            owner, _, rest = parameter.name.partition(".")
            if owner not in components:
                raise FmuError(f"{path}: parameter '{parameter.name}' of the system names no component")
            values = {rest: _value(path, components[owner], rest, parameter), **components[owner].values}
            components[owner] = replace(components[owner], values=values)
    inner: list[Connection] = []
    ends: dict[str, list[tuple[Component, Port]]] = {
        connector.name: [] for connector in system.connectors if connector.kind == "input"
    }
    for wire in system.connections:
        if wire.startElement is None:
            if wire.startConnector not in ends:
                raise FmuError(f"{path}: the system has no input {quoted(str(wire.startConnector))}")
            target = _component(path, components, wire.endElement)
            ends[wire.startConnector].append((target, _port(path, target, wire.endConnector, "input")))
        elif wire.endElement is not None:
            inner.append(_connection(path, components, wire))
    outer = {name: tuple(found) for name, found in ends.items() if found}
    span = root.find("{*}DefaultExperiment")
    name = str(described.name or system.name or path.stem)
    return _structure(
        (name, str(system.description or name)), tuple(components.values()), tuple(inner), outer, span, path
    )


def _structure(
    names: tuple[str, str],
    components: tuple[Component, ...],
    connections: tuple[Connection, ...],
    outer: Mapping[str, tuple[tuple[Component, Port], ...]],
    span: Any,
    path: Path | None = None,
) -> SystemStructure:
    """Return the structure after checking that every input has one source."""
    taken = [(wire.target.name, wire.input.name) for wire in connections]
    taken += [(target.name, port.name) for ends in outer.values() for target, port in ends]
    twice = [f"{owner}.{port}" for (owner, port), count in Counter(taken).items() if count > 1]
    if twice:
        raise FmuError(f"{path}: input {listed(twice)} has two sources; an input has one")
    free = {
        one.column(port.name): ((one, port),)
        for one in components
        for port in one.of("input")
        if (one.name, port.name) not in taken
    }
    notes = [
        f"{one.column(name)} is not recorded: texts, arrays and clocks are not"
        for one in components
        for name in unlogged(one.about, one.ports)
        if one.own is None
    ]
    return SystemStructure(
        *names, components, connections, {**outer, **free}, _experiment(components, span), tuple(notes)
    )


def _experiment(components: tuple[Component, ...], span: Any) -> RunSettings:
    """Return the default experiment: that of the system, else the longest of its FMUs, with the smallest step."""
    known = [one.experiment for one in components if one.experiment is not None]

    def all_of(key: str) -> list[float]:
        return [float(value) for value in (getattr(one, key) for one in known) if value is not None]

    attributes = {} if span is None else span.attrib
    start = float(attributes.get("startTime", min(all_of("startTime"), default=0.0)))
    stop = float(attributes.get("stopTime", max(all_of("stopTime"), default=float("nan"))))
    return RunSettings(start, stop, min(all_of("stepSize"), default=(stop - start) / STEPS))


def _parameters(path: Path, binding: Any) -> Iterator[Any]:
    """Yield the parameters of a binding."""
    if binding.parameterMapping:
        raise FmuError(f"{path}: parameter mappings are not supported; name the parameters as the FMU does")
    for values in binding.parameterValues:
        for parameter in values.parameters:
            parameter.name = f"{binding.prefix or ''}{parameter.name}"
            yield parameter


def _values(path: Path, element: Any, made: Component) -> Iterator[tuple[str, float]]:
    for binding in element.parameterBindings:
        for parameter in _parameters(path, binding):
            yield parameter.name, _value(path, made, parameter.name, parameter)


def _value(path: Path, one: Component, name: str, parameter: Any) -> float:
    """Return the value of a parameter or input of an SSP in the unit of the FMU."""
    if name not in one.ports:
        raise FmuError(f"{path}: component '{one.name}' has no parameter {quoted(name)}{suggestion(name, one.ports)}")
    truth = {"true": 1.0, "false": 0.0}.get(str(parameter.value).lower())
    unit = getattr(parameter, "unit", None)
    text = f"{parameter.value} {unit}" if unit else str(parameter.value)
    return truth if truth is not None else one.ports[name].number(f"{path}: {one.name}.{name}", text)


def _component(path: Path, components: Mapping[str, Component], name: str) -> Component:
    if name not in components:
        raise FmuError(
            f"{path}: a connection names component {quoted(name)}{valid_names(name, components, 'components')}"
        )
    return components[name]


def _port(path: Path, one: Component, name: str, causality: str) -> Port:
    """Return a connected variable, which must be of this causality."""
    port = one.ports.get(name)
    if port is None:
        raise FmuError(f"{path}: {one.path.name} has no variable {quoted(name)}{suggestion(name, one.ports)}")
    if port.causality != causality:
        raise FmuError(f"{path}: {one.name}.{name} is connected as {causality}, but is of causality {port.causality}")
    return port


def _connection(path: Path, components: Mapping[str, Component], wire: Any) -> Connection:
    """Return a connection after checking causality, type and unit of both ends."""
    source, target = (_component(path, components, name) for name in (wire.startElement, wire.endElement))
    output = _port(path, source, wire.startConnector, "output")
    port = _port(path, target, wire.endConnector, "input")
    ends = f"{source.name}.{output.name} -> {target.name}.{port.name}"
    if output.kind != port.kind and (output.kind, port.kind) != ("integer", "real"):
        raise FmuError(f"{path}: connection {ends}: {output.type} does not fit {port.type}")
    change = getattr(wire, "linearTransformation", None)
    if change is not None:
        return Connection(source, output, target, port, change.factor, change.offset)
    if output.unit == port.unit or "1" in (output.unit, port.unit):
        return Connection(source, output, target, port)
    if output.base is None or port.base is None or output.base[0] != port.base[0]:
        raise FmuError(f"{path}: connection {ends}: unit {quoted(output.unit)} does not fit {quoted(port.unit)}")
    (_, from_factor, from_offset), (_, to_factor, to_offset) = output.base, port.base
    return Connection(source, output, target, port, from_factor / to_factor, (from_offset - to_offset) / to_factor)
