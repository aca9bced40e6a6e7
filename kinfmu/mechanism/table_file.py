"""Tables of two columns in CSV files: the points of a spline."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path
from typing import Any

from kinfmu.errors import MechanismError
from kinfmu.mechanism.valid import quoted

LARGEST_TABLE = 4_000_000  # [bytes]


def read_table(where: str, name: Any, folder: Path | None) -> tuple[tuple[Any, Any], ...]:
    """Return the rows of a CSV file of two columns, x and u, as numbers, or as text where the header gives a unit.

    The first line may be a header with units in brackets: `angle [deg], lift [mm]`. Columns are separated by commas,
    semicolons or tabs; empty lines and lines that begin with # are skipped.

    Args:
        where: The key in messages.
        name: Path of the file.
        folder: Where a relative path starts; None: files are refused.

    Raises:
        MechanismError: The file cannot be read, or a line is wrong; the message states file and line.

    """
    if not isinstance(name, str):
        raise MechanismError(f"{where} = {quoted(name)} must be the name of a CSV file")
    where = f"{where} = {quoted(name)}"
    if folder is None:
        raise MechanismError(f"{where}: only a mechanism file can name a file; text needs the points themselves")
    try:
        with (folder / name).open("rb") as file:
            content = file.read(LARGEST_TABLE + 1)
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        raise MechanismError(f"{where} cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(content) > LARGEST_TABLE:
        raise MechanismError(f"{where} is too large for a table (largest: {LARGEST_TABLE} bytes)")
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise MechanismError(f"{where} is not a text file (byte {error.start} is not UTF-8)") from None
    numbered = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    units, rows = ("", ""), []
    for place, (k, line) in enumerate(numbered):
        delimiter = next((mark for mark in ("\t", ";") if mark in line), ",")
        try:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        except csv.Error as error:
            raise MechanismError(f"{where}, line {k}: {error}") from None
        if len(cells) != 2:
            raise MechanismError(f"{where}, line {k}: {len(cells)} columns; there must be two")
        if place == 0 and not any(map(_DECIMAL.fullmatch, cells)):
            units = (_unit(cells[0]), _unit(cells[1]))
        else:
            rows.append((_number(where, k, cells[0], units[0]), _number(where, k, cells[1], units[1])))
    return tuple(rows)


def _unit(title: str) -> str:
    """Return 'deg' of 'angle [deg]'."""
    _, bracket, unit = title.removesuffix("]").rpartition("[")
    return unit.strip() if bracket and title.endswith("]") and "]" not in unit else ""


def _number(where: str, line: int, cell: str, unit: str) -> float | str:
    try:
        number = read_decimal(cell)
    except ValueError:
        raise MechanismError(f"{where}, line {line}: {quoted(cell)} must be a number") from None
    if not math.isfinite(number):
        raise MechanismError(f"{where}, line {line}: {cell} must be a finite number")
    return f"{number!r} {unit}" if unit else number


_DECIMAL = re.compile(r"\s*+[+-]?+(?:(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?+|nan|inf)\s*+")


def read_decimal(text: str) -> float:
    """Return the number of a plain decimal such as '-1.5e3', also of nan and inf.

    Raises a ValueError for other text. Python's `float` takes more: '1_000', digits of other scripts, 'Infinity'.
    """
    if not _DECIMAL.fullmatch(text):
        raise ValueError("not a plain decimal number")
    return float(text)
