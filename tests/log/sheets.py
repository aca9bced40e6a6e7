"""Workbooks (.xlsx) read with the standard library alone."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

_SHEET = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"


def read_xlsx(path: Path) -> dict[str, np.ndarray]:
    """Return the columns by the texts of the first row; NaN where a cell is empty. Other texts are refused."""
    with zipfile.ZipFile(path) as book:
        sheet = ET.fromstring(book.read("xl/worksheets/sheet1.xml"))  # noqa: S314  written by the test
    first, *rows = sheet.iter(f"{_SHEET}row")
    names = {_column(cell): "".join(cell.itertext()) for cell in first}
    table = {name: np.full(len(rows), np.nan) for name in names.values()}
    for number, row in enumerate(rows):
        for cell in row:
            assert cell.get("t", "n") == "n", "a number is a number, not a text"
            table[names[_column(cell)]][number] = float("".join(cell.itertext()))
    (pane,) = sheet.iter(f"{_SHEET}pane")
    assert (pane.get("ySplit"), pane.get("state")) == ("1", "frozen")
    return table


def _column(cell: ET.Element) -> str:
    """Return 'AB' of 'AB12'."""
    return re.sub(r"\d", "", cell.get("r", ""))
