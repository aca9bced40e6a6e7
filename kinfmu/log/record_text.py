"""Reading and checking the texts of a record: a foreign file may hold anything under a valid checksum."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from typing import Any

from kinfmu.errors import LogError, listed
from kinfmu.mechanism.valid import is_line, quoted
from kinfmu.run import MOST_SAMPLES, Event
from kinfmu.run.axis import SAMPLE, TIME
from kinfmu.units import METRES, ForceName, SignalName, read_coordinate, read_force, read_inputs

MOST_COLUMNS = 500_000  # three times those of the largest mechanism
ESTIMATES = ("solver.margin", "solver.error_q", "solver.error_qd", "solver.error_qdd")
LEVELS = ("info", "warning", "error")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,199}(?:\.[a-z]{1,5})?")


def lists_of(texts: Mapping[str, str]) -> dict[str, Any]:
    """Return the values in the texts of `record.description`: names by kind, units, constants, counts.

    Raises:
        LogError: A value is missing, of another type or invalid, or a list is too long.

    """
    kinds: dict[str, tuple[Callable[[Any], bool], str]] = {
        "columns": (_are_lines, "names"),
        "units": (_are_texts, "texts by name"),
        "absent": (_are_lines, "names"),
        "outputs": (_are_coordinates, "coordinates"),
        "coordinate_count": (_is_count, "a count"),
        "fixed": (_are_constants, "numbers by coordinate"),
        "input_names": (_are_inputs, "inputs, three for each driver"),
        "watch_names": (_are_lines, "names"),
        "length_unit": (lambda value: isinstance(value, str) and value in METRES, f"one of {listed(METRES)}"),
    }
    found = {}
    for key, (is_valid, valid) in kinds.items():
        found[key] = value = _value(texts, key)
        if isinstance(value, list | dict) and len(value) > MOST_COLUMNS:
            raise LogError(f"{key} of the record: {len(value)} entries; {MOST_COLUMNS} at most")
        if not is_valid(value):
            raise LogError(f"{key} of the record = {quoted(value)} must be {valid}")
    found["axis"] = axis = _value(texts, "axis") if "axis" in texts else TIME  # older records have no axis
    if not isinstance(axis, str):
        raise LogError(f"axis of the record = {quoted(axis)} must be the name of an input, or {TIME} or {SAMPLE}")
    found["computed"] = later = _value(texts, "computed") if "computed" in texts else []  # older records hold estimates
    if not (_are_lines(later) and set(later) <= set(ESTIMATES)):
        raise LogError(f"computed of the record = {quoted(later)} must be names among {listed(ESTIMATES)}")
    found |= {table: _forces(texts, table) for table in ("forces", "reactions")}
    found["signals"] = _signals(texts)
    if found["coordinate_count"] > len(found["outputs"]):
        raise LogError(f"coordinate_count of the record = {found['coordinate_count']} is more than its outputs")
    if len(set(found["columns"])) < len(found["columns"]):
        raise LogError("columns of the record hold a name twice")
    return found


def _forces(texts: Mapping[str, str], key: str) -> tuple[ForceName, ...]:
    """Return the names of forces or of reactions; none in records of mechanisms without masses and loads."""
    kinds = _value(texts, key) if key in texts else {}
    names = [read_force(*entry) for entry in kinds.items()] if _are_texts(kinds) and _are_lines(list(kinds)) else [None]
    if None in names or len(names) > MOST_COLUMNS:
        raise LogError(f"{key} of the record = {quoted(kinds)} must be kinds of quantities, such as 'torque', by name")
    return tuple(name for name in names if name is not None)


def _signals(texts: Mapping[str, str]) -> tuple[SignalName, ...]:
    """Return the names of the outputs of other FMUs; older records have none."""
    units = _value(texts, "signals") if "signals" in texts else {}
    if not (_are_texts(units) and _are_lines(list(units)) and len(units) <= MOST_COLUMNS):
        raise LogError(f"signals of the record = {quoted(units)} must be units by name")
    return tuple(SignalName(*entry) for entry in units.items())


def samples_of(texts: Mapping[str, str]) -> int:
    """Return the number of samples in the texts of `record.ending`; raise a LogError if it is missing or invalid."""
    count = _value(texts, "samples")
    if not _is_count(count):
        raise LogError(f"samples of the record = {quoted(count)} must be a count")
    return int(count)


def events_of(texts: Mapping[str, str]) -> tuple[Event, ...]:
    """Return the events in the texts of `record.ending`; raise a LogError for entries that are not events."""
    entries = _value(texts, "events")
    if not isinstance(entries, list):
        raise LogError(f"events of the record = {quoted(entries)} must be a list")
    for entry in entries:
        if not _is_event(entry):
            raise LogError(f"events of the record: {quoted(entry)} must be [time, level, text]")
    return tuple(Event(float(t), level, text) for t, level, text in entries)


def whole_number(texts: Mapping[str, str], key: str) -> int:
    """Return a whole number that is written as text, default 0; raise a LogError for any other text."""
    text = texts.get(key, "0")
    if not re.fullmatch(r"[+-]?[0-9]{1,12}", text):
        raise LogError(f"{key} of the record = {quoted(text)} must be a whole number")
    return int(text)


def _value(texts: Mapping[str, str], key: str) -> Any:
    """Return the JSON value of a text."""
    if key not in texts:
        raise LogError(f"{key} of the record is missing")
    try:
        return json.loads(texts[key])
    except RecursionError:
        raise LogError(f"{key} of the record is nested too deeply") from None
    except ValueError as error:
        raise LogError(f"{key} of the record is not JSON ({error})") from None


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_SAMPLES


def _is_number(value: Any) -> bool:
    """Return True for a number that a double can hold; Python's JSON has infinity and NaN as well."""
    return isinstance(value, float) or (isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1e300)


def _are_texts(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(text, str) for text in value.values())


def _are_lines(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) and is_line(name) for name in value)


def _are_coordinates(value: Any) -> bool:
    return _are_lines(value) and all(_NAME.fullmatch(name) and read_coordinate(name) for name in value)


def _are_constants(value: Any) -> bool:
    return isinstance(value, dict) and _are_coordinates(list(value)) and all(map(_is_number, value.values()))


def _are_inputs(value: Any) -> bool:
    return _are_lines(value) and all(map(_NAME.fullmatch, value)) and read_inputs(value) is not None


def _is_event(entry: Any) -> bool:
    return (
        isinstance(entry, list)
        and len(entry) == 3
        and _is_number(entry[0])
        and entry[1] in LEVELS
        and isinstance(entry[2], str)
        and not any("\ud800" <= character <= "\udfff" for character in entry[2])
    )
