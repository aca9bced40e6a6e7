"""Mechanism files: TOML to Mechanism. Messages state the file, the table, the key and what would be valid."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from kinfmu.drivers import DRIVERS, Driver
from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.joints import JOINTS, Joint
from kinfmu.laws import LAWS, External, Law
from kinfmu.measures import MEASURES, Measure
from kinfmu.mechanism.body import Body, Point, RunSettings, Start
from kinfmu.mechanism.declared import REQUIRED, keys_of
from kinfmu.mechanism.law_table import law_keys, read_law
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.number import read_number
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.toml_tables import (
    check_keys,
    class_of_type,
    member_keys,
    named_tables,
    named_values,
    subtable,
    table_of,
    text_of,
)
from kinfmu.mechanism.valid import check_name, quoted
from kinfmu.units import METRES, Quantity

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
_TABLES = ("name", "title", "units", "parameters", "run", "bodies", "joints", "drivers", "points", "outputs")
_ANGLE, _LENGTH, _TIME = Quantity("angle"), Quantity("length"), Quantity("time")


def read(path: str | Path) -> Mechanism:
    """Return the mechanism of a TOML file; a MechanismError states the file, the table and the key."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)  # a device or a pipe has no size to ask for
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        raise MechanismError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(content) > LARGEST_FILE:
        raise MechanismError(f"{path}: too large for a mechanism file (largest: {LARGEST_FILE} bytes)")
    try:
        return parse(content.decode("utf-8-sig"), str(path), path.parent)
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
    deep = _deep_key(text)
    if deep is not None:
        line = text.count("\n", 0, deep) + 1
        raise MechanismError(f"{where}: not valid: a key of more than {DEEPEST_KEY} parts (at line {line})")
    try:
        document = tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise MechanismError(f"{where}: not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise MechanismError(f"{where}: not valid TOML: {error}") from None
    except ValueError:  # Python refuses whole numbers of thousands of digits
        raise MechanismError(f"{where}: not valid TOML: a number has too many digits") from None
    try:
        return _mechanism(document, None if folder is None else Path(folder))
    except MechanismError as error:
        raise type(error)(f"{where}: {error}", **error.data) from None


def _deep_key(text: str) -> int | None:
    """Return the position of the first key of more than DEEPEST_KEY parts, outside comments and texts."""
    if not _MANY_DOTS.search(text):
        return None
    return next((token.start() for token in _TOKEN.finditer(text) if token.lastgroup), None)


def _mechanism(document: dict[str, Any], folder: Path | None) -> Mechanism:
    check_keys("", document, _TABLES)
    units = table_of(document, "units")
    check_keys("[units]", units, ("length",))
    unit = text_of("[units] length", units.get("length", "m"))
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
    reader = _Reader(_checked_unit(unit), folder)
    return Mechanism(
        name=text_of("name", document["name"]),
        title=text_of("title", document.get("title", "")),
        length_unit=unit,
        bodies=tuple(reader.body(name, body) for name, body in named_tables(document, "bodies")),
        joints=tuple(reader.joint(name, joint) for name, joint in named_tables(document, "joints")),
        drivers=tuple(reader.driver(name, driver) for name, driver in named_tables(document, "drivers")),
        points={
            name: text_of(f"[points] {name}", target, "text such as 'body.point'")
            for name, target in named_values(document, "points")
        },
        coordinates=coordinates,
        parameters={name: _parameter(name, value) for name, value in named_values(document, "parameters")},
        run=reader.run(table_of(document, "run")),
    )


def _checked_unit(unit: str) -> str:
    """Return the unit if it is a unit of length; Mechanism repeats this check for mechanisms written in Python."""
    if unit not in METRES:
        near = suggestion(unit, METRES) if isinstance(unit, str) else ""
        raise MechanismError(f"[units] length = {quoted(unit)} is not a unit of length{near}; known: {listed(METRES)}")
    return unit


class _Reader:
    """Reads tables whose numbers may carry units."""

    def __init__(self, length_unit: str, folder: Path | None) -> None:
        self.length_unit = length_unit
        self.folder = folder

    def number(self, where: str, value: object, quantity: Quantity) -> Any:
        """Return a number, also from text such as '60 deg', or an expression that the mechanism resolves."""
        return read_number(where, value, quantity, self.length_unit)

    def body(self, name: str, table: Mapping[str, Any]) -> Body:
        where = f"[bodies.{name}]"
        check_keys(where, table, ("points", "start"))
        points = {}
        for point, value in subtable(where, table, "points").items():
            check_name(f"{where} points", point)
            if not isinstance(value, list) or len(value) != 2:
                raise MechanismError(f"{where} points.{point} = {quoted(value)} must be two numbers [x, y]")
            points[point] = Point(*(self.number(f"{where} points.{point}", v, _LENGTH) for v in value))
        start = subtable(where, table, "start")
        check_keys(f"{where} start", start, ("x", "y", "phi"))
        quantities = {"x": _LENGTH, "y": _LENGTH, "phi": _ANGLE}
        return Body(
            name, points, Start(**{k: self.number(f"{where} start.{k}", v, quantities[k]) for k, v in start.items()})
        )

    def joint(self, name: str, table: Mapping[str, Any]) -> Joint:
        laws = [law for law in LAWS if law is not External]  # nothing from outside moves a cam
        joint: Joint = self.member(f"[joints.{name}]", name, table, JOINTS, laws)
        return joint

    def driver(self, name: str, table: Mapping[str, Any]) -> Driver:
        driver: Driver = self.member(f"[drivers.{name}]", name, table, DRIVERS, LAWS)
        return driver

    def member(
        self, where: str, name: str, table: Mapping[str, Any], classes: Iterable[Any], laws: Iterable[type[Law]]
    ) -> Any:
        """Return a joint or driver; the keys of its law, if it has one, are in the same table."""
        cls = class_of_type(where, table, "type", classes)
        keys = member_keys(cls)
        values: dict[str, Any] = {}
        if "law" in keys:
            law = class_of_type(where, table, "law", laws)
            check_keys(where, table, ("type", "law", *(key for key in keys if key != "law"), *law_keys(law)))
            values["law"] = read_law(where, table, law, self.folder)
        else:
            check_keys(where, table, ("type", *keys))
        return cls(name=name, **values, **self.values(where, cls, table))

    def run(self, table: Mapping[str, Any]) -> RunSettings:
        check_keys("[run]", table, ("start", "stop", "step"))
        return RunSettings(**{key: self.number(f"[run] {key}", value, _TIME) for key, value in table.items()})

    def values(self, where: str, cls: type, table: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields of a joint, driver or measure from its table, without the law."""
        values: dict[str, Any] = {}
        for key in keys_of(cls):
            if key.takes == "law":
                continue
            if key.name not in table:
                if key.default is REQUIRED:
                    raise MechanismError(f"{where} needs the key '{key.name}'; keys: {listed(member_keys(cls))}")
                continue
            value, spot = table[key.name], f"{where} {key.name}"
            if isinstance(key.measures, Quantity):
                values[key.name] = self.number(spot, value, key.measures)
            elif key.takes == "measure":
                values[key.name] = self.measure(spot, value)
            elif key.takes == "text":
                values[key.name] = text_of(spot, value)
            else:
                if not isinstance(value, list) or len(value) != 2:
                    raise MechanismError(f"{spot} = {quoted(value)} must be two points ['body.point', 'body.point']")
                values[key.name] = tuple(text_of(spot, v, "text such as 'body.point'") for v in value)
        return values

    def measure(self, where: str, table: Any) -> Measure:
        """Return a measure from a table such as { measure = "angle", of = "rocker" }."""
        if not isinstance(table, dict):
            example = '{ measure = "angle", of = "rocker" }'
            raise MechanismError(f"{where} = {quoted(table)} must be a table such as {example}")
        cls = class_of_type(where, table, "measure", MEASURES)
        check_keys(where, table, ("measure", *member_keys(cls)))
        measure: Measure = cls(**self.values(where, cls, table))
        return measure


def _parameter(name: str, value: Any) -> Parameter:
    """Return a parameter from a number, text, or a table { value = ..., description = "..." }."""
    if not isinstance(value, dict):
        return Parameter(value)
    where = f"[parameters.{name}]"
    check_keys(where, value, ("value", "description"))
    if "value" not in value:
        raise MechanismError(f"{where} needs the key 'value'; keys: value, description")
    return Parameter(value["value"], description=text_of(f"{where} description", value.get("description", "")))
