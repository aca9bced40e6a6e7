"""Mechanism files: TOML to Mechanism. Messages state the file, the table, the key and what would be valid."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError, listed
from kinfmu.mechanism.body import MASS_KEYS, RUN_TIMES, Body, Gravity, RunSettings, Start
from kinfmu.mechanism.checks import NO_DRIVER
from kinfmu.mechanism.declared import REQUIRED, Takes, keys_of
from kinfmu.mechanism.drivers import DRIVERS, SAMPLES_PER_TURN
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS, RISES, External, Law, Segment, Spline
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.measures import READINGS, Reading
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.quantities import POSE_QUANTITIES, PoseQuantity
from kinfmu.mechanism.repeats import COUNTS, REPEAT, expanded
from kinfmu.mechanism.toml_document import (
    LARGEST_FILE,
    check_keys,
    class_of_type,
    document_of,
    named_tables,
    named_values,
    read_table,
    refuse_other_kind,
    subtable,
    table_keys,
    table_of,
    text_in,
    text_of,
)
from kinfmu.mechanism.valid import MOST_PARTS, check_name, quoted

_QUANTITY = '{ measure = "angle", of = "rocker" }'  # in messages
_SEGMENT = ("law", "rise", "duration")
_TABLES = (
    *("name", "title", "units", "parameters", "run", "bodies", "joints", "drivers", "gravity", "loads", "points"),
    *("outputs", "measures", COUNTS, REPEAT),
)


def read(path: str | Path) -> Mechanism:
    """Return the mechanism of a TOML file; a MechanismError states the file, the table and the key."""
    path = Path(path)
    return parse(text_in(path, "a mechanism file"), str(path), path.parent)


def parse(text: str, where: str = "mechanism", folder: str | Path | None = None) -> Mechanism:
    """Return the mechanism that TOML text describes.

    Args:
        text: The content of a mechanism file.
        where: Name of the text in messages.
        folder: Where relative paths of files start. Default: files are refused, as in text inside an FMU or a record.

    Raises:
        MechanismError: The text is not TOML or not a mechanism; the message states table and key.

    """
    if len(text) > LARGEST_FILE:
        raise MechanismError(f"{where}: too large for a mechanism (largest: {LARGEST_FILE} characters)")
    document = document_of(text, where)
    try:
        return mechanism_of(document, None if folder is None else Path(folder))
    except MechanismError as error:
        raise type(error)(f"{where}: {error}", **error.data) from None


def mechanism_of(document: dict[str, Any], folder: Path | None) -> Mechanism:
    """Return the mechanism of the tables of a file; folder: where relative paths start, None refuses files."""
    refuse_other_kind(document, "mechanism", _TABLES)
    check_keys("", document, _TABLES)
    document = expanded(document)
    units = table_of(document, "units")
    check_keys("[units]", units, ("length",))
    outputs = table_of(document, "outputs")
    check_keys("[outputs]", outputs, ("coordinates",))
    coordinates = outputs.get("coordinates", "moving")
    if isinstance(coordinates, list):
        coordinates = tuple(text_of("[outputs] coordinates", name, "text such as 'crank.phi'") for name in coordinates)
    elif not isinstance(coordinates, str):
        raise MechanismError(
            f"[outputs] coordinates = {quoted(coordinates)} must be 'moving', 'all' or a list of names"
        )
    if "name" not in document:
        raise MechanismError("name is missing; the first line should be such as name = 'fourbar'")
    laws_of_joints = [law for law in LAWS if law is not External]  # nothing from outside moves a cam
    run = table_of(document, "run")
    check_keys("[run]", run, (*RUN_TIMES, "over"))
    if is_cycle := not {"stop", "step"} & run.keys():
        run = {"stop": run.get("start", 0.0), **run}  # until its driver is known
    mechanism = Mechanism(
        name=text_of("name", document["name"]),
        title=text_of("title", document.get("title", "")),
        length_unit=text_of("[units] length", units.get("length", "m")),
        bodies=tuple(_body(name, body) for name, body in named_tables(document, "bodies")),
        joints=_members(document, "joints", JOINTS, laws_of_joints, folder),
        drivers=_members(document, "drivers", DRIVERS, LAWS, folder),
        points={
            name: text_of(f"[points] {name}", target, "text such as 'body.point'")
            for name, target in named_values(document, "points")
        },
        coordinates=coordinates,
        parameters={name: _parameter(name, value) for name, value in named_values(document, "parameters", MOST_PARTS)},
        run=RunSettings(**run),
        measures=read_measures(document, folder),
        gravity=_gravity(document),
        loads=_members(document, "loads", LOADS, LAWS, folder),
    )
    return _with_cycle(mechanism) if is_cycle else mechanism


def _with_cycle(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose run is one cycle of a single driver that moves in cycles, else that of `RunSettings`."""
    cycle = mechanism.drivers[0].cycle if len(mechanism.drivers) == 1 else 0.0
    stop, step = RunSettings.stop, RunSettings.step
    if 0.0 < cycle < math.inf:
        step = float(f"{cycle / SAMPLES_PER_TURN:.12g}")
        stop = mechanism.run.start + float(f"{cycle:.12g}")
    return replace(mechanism, run=replace(mechanism.run, stop=stop, step=step))


def read_measures(document: Mapping[str, Any], folder: Path | None) -> tuple[Reading, ...]:
    """Return the measures of the tables [measures.NAME]; a mechanism checks them."""
    return _members(document, "measures", READINGS, (), folder)


def _members(
    document: Mapping[str, Any], table: str, classes: Iterable[Any], laws: Iterable[type[Law]], folder: Path | None
) -> tuple[Any, ...]:
    """Return the joints, drivers, loads or measures of the tables [table.NAME]."""
    return tuple(
        _member(f"[{table}.{name}]", name, member, classes, laws, folder)
        for name, member in named_tables(document, table)
    )


def _body(name: str, table: Mapping[str, Any]) -> Body:
    where = f"[bodies.{name}]"
    check_keys(where, table, ("points", "start", *MASS_KEYS))
    points, start = subtable(where, table, "points"), subtable(where, table, "start")
    for point in points:
        check_name(f"{where} points", point)
    check_keys(f"{where} start", start, Start._fields)
    return Body(name, points, Start(**start), **{key: table[key] for key in MASS_KEYS if key in table})


def _gravity(document: Mapping[str, Any]) -> Gravity | None:
    if "gravity" not in document:
        return None
    table = table_of(document, "gravity")
    check_keys("[gravity]", table, Gravity._fields)
    for key in Gravity._fields:
        if key not in table:
            raise MechanismError(f"[gravity] needs the key '{key}'; downwards: x = 0, y = '-9.81 m/s2'")
    return Gravity(**table)


def _member(
    where: str,
    name: str,
    table: Mapping[str, Any],
    classes: Iterable[Any],
    laws: Iterable[type[Law]],
    folder: Path | None,
) -> Any:
    """Return a joint, driver, load or measure; the keys of its law, if it has one, are in the same table."""
    cls = class_of_type(where, table, "type", classes)
    keys = table_keys(cls)
    values: dict[str, Any] = {}
    if "law" in keys:
        law = class_of_type(where, table, "law", laws)
        check_keys(where, table, ("type", "law", *(key for key in keys if key != "law"), *table_keys(law)))
        values["law"] = law(**_values(where, law, table, folder))
    else:
        check_keys(where, table, ("type", *keys))
    return cls(name=name, **values, **_values(where, cls, table, folder))


def _values(where: str, cls: Any, table: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """Return the fields of a joint, driver, load, measure or law from its table, without `law`.

    Numbers stay as written; the mechanism converts and checks them.
    """
    values: dict[str, Any] = {}
    has_file = cls is Spline and "file" in table
    if has_file and "points" in table:
        raise MechanismError(f"{where} has both 'points' and 'file'; the table is one or the other")
    for key in keys_of(cls):
        if key.name in table and key.takes != "law":
            values[key.name] = _value(f"{where} {key.name}", table[key.name], key.takes)
        elif key.name == "points" and has_file:
            values[key.name] = read_table(f"{where} file", table["file"], folder)
        elif key.default is REQUIRED and key.takes != "law":
            or_file = " or 'file'" if key.name == "points" else ""
            raise MechanismError(f"{where} needs the key '{key.name}'{or_file}; keys: {listed(table_keys(cls))}")
    return values


def _value(where: str, value: Any, takes: Takes) -> Any:
    """Return the value of one key, lists as tuples."""
    if takes == "text":
        return text_of(where, value)
    if takes == "truth" and not isinstance(value, bool):
        raise MechanismError(f"{where} = {quoted(value)} must be true or false")
    if takes == "measured" and not isinstance(value, dict):
        return text_of(where, value, "a coordinate such as 'rocker.phi' or a table such as " + _QUANTITY)
    if takes in ("measure", "measured"):
        return _pose_quantity(where, value)
    if takes == "segments":
        return _segments(where, value)
    if takes == "pair":
        if not isinstance(value, list) or len(value) != 2:
            raise MechanismError(f"{where} = {quoted(value)} must be two points ['body.point', 'body.point']")
        return tuple(text_of(where, one, "text such as 'body.point'") for one in value)
    if takes == "numbers":
        if not isinstance(value, list):
            raise MechanismError(f"{where} = {quoted(value)} must be a list of numbers [c0, c1, ...]")
        return tuple(value)
    if takes == "points":
        if not isinstance(value, list) or any(not isinstance(point, list) or len(point) != 2 for point in value):
            raise MechanismError(f"{where} = {quoted(value)} must be a list of points [[x, u], [x, u], ...]")
        return tuple(map(tuple, value))
    return value


def _pose_quantity(where: str, table: Any) -> PoseQuantity:
    """Return a quantity of a pose from a table such as { measure = "angle", of = "rocker" }."""
    if not isinstance(table, dict):
        raise MechanismError(f"{where} = {quoted(table)} must be a table such as {_QUANTITY}")
    cls = class_of_type(where, table, "measure", POSE_QUANTITIES)
    check_keys(where, table, ("measure", *table_keys(cls)))
    quantity: PoseQuantity = cls(**_values(where, cls, table, None))
    return quantity


def _segments(where: str, value: Any) -> tuple[Segment, ...]:
    example = '{ law = "cycloidal", rise = 1, duration = 2 }'
    if not isinstance(value, list) or any(not isinstance(segment, dict) for segment in value):
        raise MechanismError(f"{where} = {quoted(value)} must be a list of tables such as {example}")
    return tuple(_segment(f"{where}, segment {k}:", table) for k, table in enumerate(value, start=1))


def _segment(where: str, table: Mapping[str, Any]) -> Segment:
    check_keys(where, table, _SEGMENT)
    text_of(f"{where} law", table.get("law", ""))
    is_rise = table.get("law") in [rise.type for rise in RISES]
    for key in _SEGMENT if is_rise else ("law", "duration"):
        if key not in table:
            raise MechanismError(f"{where} needs the key '{key}'; keys: {listed(_SEGMENT)}")
    return Segment(**table)


def _parameter(name: str, value: Any) -> Parameter:
    """Return a parameter from a number, text, or a table { value = ..., description = "..." }."""
    if not isinstance(value, dict):
        return Parameter(value)
    where = f"[parameters.{name}]"
    check_keys(where, value, ("value", "description"))
    if "value" not in value:
        raise MechanismError(f"{where} needs the key 'value'; keys: value, description")
    return Parameter(value["value"], description=text_of(f"{where} description", value.get("description", "")))


_MASSES = "masses"  # of bodies, which have no table of their own
_STEPS = (  # what is left out, until the rest is valid
    ("measures",),
    ("measures", "loads", "gravity", _MASSES),
    ("measures", "loads", "gravity", _MASSES, "drivers", "run", "points", "outputs"),
)
_FORCES = ("loads", "gravity", _MASSES)  # all or none of them where a mass or gravity is invalid
_ENTRY = re.compile(rf"(?:{re.escape(NO_DRIVER)})?" r"\[(?:(measures|drivers|loads)\.|(points)\] )([\w-]+)")
_TABLE = re.compile(rf"\[(?:bodies\.[\w-]+\] (?:{'|'.join(MASS_KEYS)})\b|(loads|gravity|run|outputs)\b)")
_MOST_ENTRIES = 20  # left out one by one


class PartialFile(NamedTuple):
    """The valid part of a mechanism file, and names of what is left out, such as '[measures.peak]' and 'masses'."""

    mechanism: Mechanism
    left_out: tuple[str, ...]


def read_partially(path: str | Path) -> PartialFile | None:
    """Return the valid part of a mechanism file that `toml_file.read` refuses; None if bodies or joints are invalid."""
    path = Path(path)
    try:
        document = expanded(document_of(text_in(path, "a mechanism file"), str(path)))
    except MechanismError:
        return None
    found = _without_entries(document, path.parent)
    if found is not None:
        return found
    for names in _STEPS:
        there = _present(document, names)
        try:
            mechanism = mechanism_of(_without(document, there), path.parent)
        except MechanismError:
            continue
        return PartialFile(mechanism, tuple(map(_title, there)))
    return None


def _without_entries(document: Mapping[str, Any], folder: Path) -> PartialFile | None:
    """Return a file without the measures, drivers, loads, points and tables that its errors name; None for others."""
    left_out: list[str] = []
    rest = dict(document)
    for _ in range(_MOST_ENTRIES):
        try:
            return PartialFile(mechanism_of(rest, folder), tuple(left_out))
        except MechanismError as problem:
            message = str(problem)
        if entry := _ENTRY.match(message):
            table, name = entry[1] or entry[2], entry[3]
            entries = rest.get(table)
            if not isinstance(entries, Mapping) or name not in entries:
                return None
            rest[table] = {key: value for key, value in entries.items() if key != name}
            left_out.append(f"[points] {name}" if table == "points" else f"[{table}.{name}]")
        elif part := _TABLE.match(message):
            names = ("run", "measures") if part[1] == "run" else ("outputs",) if part[1] == "outputs" else _FORCES
            there = _present(rest, names)
            if not there:
                return None
            rest = _without(rest, there)
            left_out += map(_title, there)
        else:
            return None
    return None


def _present(document: Mapping[str, Any], names: Collection[str]) -> list[str]:
    """Return those of the tables that a document has."""
    has_masses = any(key in body for body in _bodies(document).values() for key in MASS_KEYS)
    return [name for name in names if name in document or (name == _MASSES and has_masses)]


def _title(name: str) -> str:
    return name if name == _MASSES else f"[{name}]"


def _bodies(document: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    bodies = document.get("bodies")
    found = bodies.items() if isinstance(bodies, Mapping) else ()
    return {name: body for name, body in found if isinstance(body, Mapping)}


def _without(document: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    """Return the document without some tables, and without masses if they are among the names."""
    kept = {name: table for name, table in document.items() if name not in names}
    if _MASSES in names:
        lighter = {
            name: {key: value for key, value in body.items() if key not in MASS_KEYS}
            for name, body in _bodies(document).items()
        }
        kept["bodies"] = {**document["bodies"], **lighter}
    return kept
