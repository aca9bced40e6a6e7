"""A mechanism as TOML text, which `toml_file` reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any

from kinfmu.errors import MechanismError
from kinfmu.mechanism.body import RUN_TIMES
from kinfmu.mechanism.declared import keys_of
from kinfmu.mechanism.expression import Computed
from kinfmu.mechanism.laws.sequence import DWELL
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.number import NumberWithUnit, read_number
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.units import Quantity, unit_of


def text(mechanism: Mechanism, *, as_written: bool = False) -> str:
    """Return the mechanism as TOML; `parse(text(m)) == m`, numbers to the last bit.

    as_written: Write numbers in the units of its file. Default: in the units used inside, so that equal mechanisms have
    equal texts.
    """
    parts = mechanism.members
    if as_written:
        parts = parts.changed(lambda _, value, quantity: _as_written(value, quantity, mechanism.length_unit))
    lines = [f"name = {toml_value(mechanism.name)}"]
    if mechanism.title:
        lines.append(f"title = {toml_value(mechanism.title)}")
    lines += _table("units", {"length": mechanism.length_unit})
    if mechanism.parameters:
        lines += ["", "[parameters]"]
        lines += [_parameter(name, one, mechanism, as_written) for name, one in mechanism.parameters.items()]
    keys = (*RUN_TIMES, "over") if parts.run.over else RUN_TIMES
    lines += _table("run", {key: getattr(parts.run, key) for key in keys})
    for body in parts.bodies:
        lines += ["", f"[bodies.{body.name}]"]
        points = ", ".join(f"{name} = {toml_value(point)}" for name, point in body.points.items())
        lines.append(f"points = {{ {points} }}" if points else "points = {}")
        start = ", ".join(
            f"{key} = {toml_value(value)}" for key, value in body.start._asdict().items() if value is not None
        )
        if start:
            lines.append(f"start = {{ {start} }}")
        lines += [f"{key} = {toml_value(value)}" for key, value in body.given_masses.items()]
    lines += _tables("joints", parts.joints)
    lines += _tables("drivers", parts.drivers)
    lines += _table("gravity", parts.gravity._asdict()) if parts.gravity else []
    lines += _tables("loads", parts.loads)
    lines += _table("points", mechanism.points) if mechanism.points else []
    lines += _table("outputs", {"coordinates": mechanism.coordinates})
    lines += _tables("measures", parts.measures)
    return "\n".join(lines) + "\n"


def _table(name: str, values: Mapping[str, object]) -> list[str]:
    return ["", f"[{name}]", *(f"{key} = {toml_value(value)}" for key, value in values.items())]


def _tables(table: str, members: Iterable[Any]) -> Iterator[str]:
    """Yield the lines of joints, drivers, loads or measures."""
    for member in members:
        yield from ("", f"[{table}.{member.name}]", f"type = {toml_value(member.type)}", *_keys(member))


def _keys(member: Any) -> Iterator[str]:
    """Yield the lines of a joint, a driver or its law, or a measure."""
    cls: object = type(member)  # object: mypy does not take type[Any] for hashable
    for key in keys_of(cls):
        value = getattr(member, key.name)
        if key.takes == "law":
            yield f"law = {toml_value(value.type)}"
            yield from _keys(value)
        elif key.takes == "segments":
            yield "segments = ["
            for law, duration, rise in value:
                of_rise = f"rise = {toml_value(rise)}, " if law != DWELL else ""
                yield f"    {{ law = {toml_value(law)}, {of_rise}duration = {toml_value(duration)} }},"
            yield "]"
        elif value is not None:
            yield f"{key.name} = {toml_value(value)}"


def _as_written(value: Any, quantity: Quantity | None, length_unit: str) -> Any:
    """Return the text with a unit that gave a number, if it still gives it; else the value."""
    if isinstance(value, NumberWithUnit):
        with suppress(MechanismError):
            return value.text if read_number("", value.text, quantity, length_unit) == value else value
    return value


def _parameter(name: str, parameter: Parameter, mechanism: Mechanism, as_written: bool) -> str:
    """Return the line of a parameter: its expression, or its number with its unit."""
    value: object = parameter.value
    if as_written:
        value = _as_written(value, parameter.quantity, mechanism.length_unit)
    if isinstance(value, str):
        pass
    elif parameter.expression is None and parameter.quantity and parameter.kind != "number":
        value = f"{float(parameter.value)!r} {unit_of(parameter.quantity, mechanism.length_unit)}"
    name = f'"{name}"' if "." in name else name
    if not parameter.description:
        return f"{name} = {toml_value(value)}"
    return f"{name} = {{ value = {toml_value(value)}, description = {toml_value(parameter.description)} }}"


def toml_value(value: object) -> str:
    """Return a value of a key as TOML."""
    if isinstance(value, Computed):
        value = value.expression.text
    if isinstance(value, PoseQuantity):
        keys = {key.name: getattr(value, key.name) for key in keys_of(type(value))}
        table = {"measure": value.type} | {key: part for key, part in keys.items() if part is not None}
        return "{ " + ", ".join(f"{key} = {toml_value(part)}" for key, part in table.items()) + " }"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in escaped) + '"'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(float(value))  # type: ignore[arg-type]  # all else is a number; numpy's print their type
