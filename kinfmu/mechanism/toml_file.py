"""Mechanism files: TOML to Mechanism. Messages state the file, the table, the key and what would be valid."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from kinfmu.errors import MechanismError, listed
from kinfmu.mechanism.body import MASS_KEYS, RUN_TIMES, Body, Gravity, RunSettings, Start
from kinfmu.mechanism.declared import REQUIRED, Takes, keys_of
from kinfmu.mechanism.drivers import DRIVERS
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS, RISES, External, Law, Segment, Spline
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.measures import READINGS, Reading
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.quantities import POSE_QUANTITIES, PoseQuantity
from kinfmu.mechanism.repeats import COUNTS, REPEAT, expanded
from kinfmu.mechanism.table_file import read_table
from kinfmu.mechanism.toml_hints import explained
from kinfmu.mechanism.toml_tables import (
    check_keys,
    class_of_type,
    named_tables,
    named_values,
    refuse_other_kind,
    subtable,
    table_keys,
    table_of,
    text_of,
)
from kinfmu.mechanism.valid import check_name, quoted

LARGEST_FILE = 4_000_000  # [bytes]; a chain of ten thousand links has less
DEEPEST_KEY = 50  # parts of a dotted key; the time that the standard library takes grows with their square
_MANY_DOTS = re.compile(rf"^(?:[^.\n]*+\.){{{DEEPEST_KEY}}}", re.MULTILINE)  # what a line with such a key holds
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"?+|'[^'\n]*+'?+)"""  # of a key, or a text on one line
_TOKEN = re.compile(
    r"#[^\n]*+"  # a comment
    r'|"""(?:[^"\\]++|\\.|"(?!""))*(?:"{3,5}|\Z)'  # texts on several lines
    r"|'''(?:[^']++|'(?!''))*(?:'{3,5}|\Z)"  # before 3.11.5, Python's possessive groups of alternatives fail
    rf"|(?P<deep>(?:{_PART}[ \t]*+\.[ \t]*+){{{DEEPEST_KEY}}})"
    rf"|(?:{_PART}[ \t]*+(?:\.[ \t]*+)?+)++"  # other keys and values
    r"""|[^\w"'#-]++""",
    re.DOTALL,
)
_QUANTITY = '{ measure = "angle", of = "rocker" }'  # in messages
_SEGMENT = ("law", "rise", "duration")
_TABLES = (
    "name",
    "title",
    "units",
    "parameters",
    "run",
    "bodies",
    "joints",
    "drivers",
    "gravity",
    "loads",
    "points",
    "outputs",
    "measures",
    COUNTS,
    REPEAT,
)


def read(path: str | Path) -> Mechanism:
    """Return the mechanism of a TOML file; a MechanismError states the file, the table and the key."""
    path = Path(path)
    return parse(text_in(path, "a mechanism file"), str(path), path.parent)


def text_in(path: Path, what: str) -> str:
    """Return the text of a file, or raise a MechanismError; what: 'a mechanism file'."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)  # a device or a pipe has no size to ask for
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        raise MechanismError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(content) > LARGEST_FILE:
        raise MechanismError(f"{path}: too large for {what} (largest: {LARGEST_FILE} bytes)")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MechanismError(f"{path}: not a text file (byte {error.start} is not UTF-8)") from None


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


def document_of(text: str, where: str) -> dict[str, Any]:
    """Return the tables of TOML text; a MechanismError states the line."""
    deep = _deep_key(text)
    if deep is not None:
        line = text.count("\n", 0, deep) + 1
        raise MechanismError(f"{where}: not valid: a key of more than {DEEPEST_KEY} parts (at line {line})")
    try:
        return tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise MechanismError(f"{where}: not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise MechanismError(f"{where}: not valid TOML: {explained(text, error)}") from None
    except ValueError:  # Python refuses whole numbers of thousands of digits
        raise MechanismError(f"{where}: not valid TOML: a number has too many digits") from None


def _deep_key(text: str) -> int | None:
    """Return the position of the first key of more than DEEPEST_KEY parts, outside comments and texts."""
    if not _MANY_DOTS.search(text):
        return None
    return next((token.start() for token in _TOKEN.finditer(text) if token.lastgroup), None)


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
    return Mechanism(
        name=text_of("name", document["name"]),
        title=text_of("title", document.get("title", "")),
        length_unit=text_of("[units] length", units.get("length", "m")),
        bodies=tuple(_body(name, body) for name, body in named_tables(document, "bodies")),
        joints=tuple(
            _member(f"[joints.{name}]", name, joint, JOINTS, laws_of_joints, folder)
            for name, joint in named_tables(document, "joints")
        ),
        drivers=tuple(
            _member(f"[drivers.{name}]", name, driver, DRIVERS, LAWS, folder)
            for name, driver in named_tables(document, "drivers")
        ),
        points={
            name: text_of(f"[points] {name}", target, "text such as 'body.point'")
            for name, target in named_values(document, "points")
        },
        coordinates=coordinates,
        parameters={name: _parameter(name, value) for name, value in named_values(document, "parameters")},
        run=_run(table_of(document, "run")),
        measures=read_measures(document, folder),
        gravity=_gravity(document),
        loads=tuple(
            _member(f"[loads.{name}]", name, load, LOADS, LAWS, folder)
            for name, load in named_tables(document, "loads")
        ),
    )


def read_measures(document: Mapping[str, Any], folder: Path | None) -> tuple[Reading, ...]:
    """Return the measures of the tables [measures.NAME]; a mechanism checks them."""
    return tuple(
        _member(f"[measures.{name}]", name, reading, READINGS, (), folder)
        for name, reading in named_tables(document, "measures")
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


def _run(table: Mapping[str, Any]) -> RunSettings:
    check_keys("[run]", table, (*RUN_TIMES, "over"))
    return RunSettings(**table)


def _parameter(name: str, value: Any) -> Parameter:
    """Return a parameter from a number, text, or a table { value = ..., description = "..." }."""
    if not isinstance(value, dict):
        return Parameter(value)
    where = f"[parameters.{name}]"
    check_keys(where, value, ("value", "description"))
    if "value" not in value:
        raise MechanismError(f"{where} needs the key 'value'; keys: value, description")
    return Parameter(value["value"], description=text_of(f"{where} description", value.get("description", "")))
