"""Laws in mechanism files: from the keys of a table to a Law, and back; constants of laws by their names."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from kinfmu.drivers import Driver
from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.laws import RISES, Law, Segment, Spline
from kinfmu.mechanism.declared import REQUIRED, Takes, keys_of
from kinfmu.mechanism.members import NumberPath
from kinfmu.mechanism.table_file import read_table
from kinfmu.mechanism.toml_tables import text_of
from kinfmu.mechanism.valid import quoted
from kinfmu.units import Quantity

_SEGMENT_KEYS = ("law", "rise", "duration")


def law_keys(law: type[Law]) -> list[str]:
    """Return the names of the keys of a law, without `law` itself."""
    return [key.name for key in keys_of(law)] + (["file"] if law is Spline else [])


def read_law(where: str, table: Mapping[str, Any], law: type[Law], folder: Path | None) -> Law:
    """Return the law of a class from the table of its driver or joint.

    Args:
        where: The table in messages, such as '[drivers.crank]'.
        table: Keys and values of the table; numbers stay as written, the mechanism converts them.
        law: The class.
        folder: Where a relative path to a file in the table starts; None: files are refused.

    Raises:
        MechanismError: A key is missing or has an invalid value.

    """
    values: dict[str, Any] = {}
    for key in keys_of(law):
        if key.name in table:
            values[key.name] = _read(f"{where} {key.name}", table[key.name], key.takes)
    if law is Spline and "file" in table:
        if "points" in values:
            raise MechanismError(f"{where} has both 'points' and 'file'; the table is one or the other")
        values["points"] = read_table(f"{where} file", table["file"], folder)
    for key in keys_of(law):
        if key.name not in values and key.default is REQUIRED:
            or_file = " or 'file'" if key.name == "points" else ""
            raise MechanismError(f"{where} needs the key '{key.name}'{or_file}; keys: {listed(law_keys(law))}")
    return law(**values)


def _read(where: str, value: Any, takes: Takes) -> Any:
    """Return the value of one key of a law."""
    if takes == "numbers":
        if not isinstance(value, list):
            raise MechanismError(f"{where} = {quoted(value)} must be a list of numbers [c0, c1, ...]")
        return tuple(value)
    if takes == "truth" and not isinstance(value, bool):
        raise MechanismError(f"{where} = {quoted(value)} must be true or false")
    if takes == "segments":
        return _segments(where, value)
    if takes == "text":
        return text_of(where, value)
    if takes == "points":
        if not isinstance(value, list) or any(not isinstance(point, list) or len(point) != 2 for point in value):
            raise MechanismError(f"{where} = {quoted(value)} must be a list of points [[x, u], [x, u], ...]")
        return tuple(tuple(point) for point in value)
    return value


def _segments(where: str, value: Any) -> tuple[Segment, ...]:
    example = '{ law = "cycloidal", rise = 1, duration = 2 }'
    if not isinstance(value, list) or any(not isinstance(segment, dict) for segment in value):
        raise MechanismError(f"{where} = {quoted(value)} must be a list of tables such as {example}")
    return tuple(_segment(f"{where}, segment {k}:", table) for k, table in enumerate(value, start=1))


def _segment(where: str, table: Mapping[str, Any]) -> Segment:
    for key in table:
        if key not in _SEGMENT_KEYS:
            near = suggestion(key, _SEGMENT_KEYS)
            raise MechanismError(f"{where} {quoted(key)} is not a key{near}; keys: {listed(_SEGMENT_KEYS)}")
    text_of(f"{where} law", table.get("law", ""))
    words = [rise.type for rise in RISES]
    needed = ("law", "duration") if table.get("law") not in words else _SEGMENT_KEYS
    for key in needed:
        if key not in table:
            raise MechanismError(f"{where} needs the key '{key}'; keys: {listed(_SEGMENT_KEYS)}")
    return Segment(table["law"], table["duration"], table.get("rise", 0.0))


def law_lines(law: Law, written: Callable[[Any], str]) -> Iterable[str]:
    """Yield the lines of a law in a mechanism file; `written` converts a value to TOML."""
    yield f"law = {written(law.type)}"
    for key in keys_of(type(law)):
        value = getattr(law, key.name)
        if key.name == "segments":
            yield "segments = ["
            for segment in value:
                rise = f"rise = {written(segment.rise)}, " if segment.law != "dwell" else ""
                yield f"    {{ law = {written(segment.law)}, {rise}duration = {written(segment.duration)} }},"
            yield "]"
        else:
            yield f"{key.name} = {written(value)}"


class LawConstant(NamedTuple):
    """A constant of a law of motion, settable under its name `<driver>.<key>`."""

    name: str
    value: float
    quantity: Quantity
    is_positive: bool = False  # other values are refused


def law_constants(drivers: Sequence[Driver], computed: Collection[NumberPath]) -> Iterator[LawConstant]:
    """Yield the constants of all drivers' laws in file order, without those given by an expression (`computed`)."""
    for driver in drivers:
        for key, (value, said) in driver.law.constants().items():
            if ("drivers", driver.name, "law", key) not in computed:
                quantity = said.quantity(*driver.law_kinds)
                yield LawConstant(f"{driver.name}.{key}", float(value), quantity, said.is_positive)


def with_law_constants(drivers: Sequence[Driver], values: Mapping[str, float]) -> tuple[Driver, ...]:
    """Return the drivers with other values of some of those constants."""

    def changed(driver: Driver) -> Driver:
        named = {key: f"{driver.name}.{key}" for key in driver.law.constants()}
        new: dict[tuple[str | int, ...], float] = {
            (key,): values[name] for key, name in named.items() if name in values
        }
        return replace(driver, law=driver.law.with_numbers(new)) if new else driver  # type: ignore[type-var]

    return tuple(map(changed, drivers))
