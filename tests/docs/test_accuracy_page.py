"""docs/accuracy.md: the files it names exist, its tolerances are those of the code, its tables are complete."""

from __future__ import annotations

import csv
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.accuracy import MECHANISMS
from benchmarks.charts import LOOKS, NEAR_SINGULAR, SUFFIXES, WORK_PRECISION
from benchmarks.engines import ENGINES
from benchmarks.page import PARTS, SETTINGS, SETTINGS_COLUMNS, begin, end, row_head
from benchmarks.singular_points import POINTS
from kinfmu.cli import main
from kinfmu.solver.python import Status

DOCS = Path(__file__).parents[2] / "docs"
ROOT = DOCS.parent
PAGE = (DOCS / "accuracy.md").read_text(encoding="utf-8")
SETTINGS_TABLE = (DOCS / SETTINGS).read_text(encoding="utf-8")
PEERS = ("CasADi", "pylinkage", "kimech")  # rows of theirs are there if they were installed
ANEW = "scripts/bench writes it again"


def part(name: str) -> str:
    return PAGE.split(begin(name))[1].split(end(name))[0].strip()


def rows(table: str) -> Iterator[list[str]]:
    """Cells of the lines of a Markdown table, without the ruler."""
    for line in table.splitlines():
        if line.startswith("|") and not line.startswith("|---"):
            yield [cell.strip() for cell in line.strip("|").split("|")]


def test_every_file_and_command_of_the_page_exists() -> None:
    files = re.findall(r"`((?:tests|kinfmu|scripts)/[\w/.]+)", PAGE)
    assert len(files) > 10
    for name in files:
        assert (ROOT / name).exists(), name
    for command in re.findall(r"`kinfmu (\w+)", PAGE):
        assert command in main.commands


def test_every_guarantee_names_its_test_or_command() -> None:
    (table,) = re.findall(r"## Guarantees\n\n(.*?)\n\n", PAGE, re.DOTALL)
    head, *guarantees = rows(table)
    assert head == ["", "within", "shown by"]
    assert len(guarantees) > 6
    for guarantee in guarantees:
        assert re.search(r"`(tests|scripts)/|`kinfmu ", guarantee[2]), guarantee[0]


def test_the_tolerances_are_those_of_the_code() -> None:
    found = re.findall(r"\| ([\de.-]+) \| `kinfmu/([\w/]+)\.py: (\w+)` \|", PAGE)
    assert len(found) >= 7
    for value, module, name in found:
        assert float(value) == getattr(importlib.import_module(f"kinfmu.{module.replace('/', '.')}"), name), name


def test_every_status_is_explained_under_its_number() -> None:
    explained = re.findall(r"^\| (\d) `(\w+)` \|", PAGE, re.MULTILINE)
    assert explained == [(str(int(status)), status.name.lower()) for status in Status]


def test_the_tables_of_the_page_hold_every_engine_and_point() -> None:
    assert [name for name in PARTS if part(name)] == list(PARTS)
    head, *lines = rows(part("engines"))
    assert head[1:] == [f"[`{name}`](../fmus/{name}/README.md)" for name in MECHANISMS], ANEW
    present = [line[0] for line in lines]
    assert [name for name in present if name not in PEERS] == [e.name for e in ENGINES if e.name not in PEERS], ANEW
    points, *_ = rows(part("singular points"))
    assert points[1:] == [point.title for point in POINTS], ANEW
    assert "median of" in part("conditions")


def test_kinfmu_is_as_exact_in_the_tables_as_guaranteed() -> None:
    (ours,) = (line[1:] for line in rows(part("engines")) if line[0] == "kinfmu")
    assert max(float(cell.split(", ")[1]) for cell in ours) <= 1e-11
    (at_points,) = (line[1:] for line in rows(part("singular points")) if line[0] == "kinfmu")
    assert len(at_points) == len(POINTS)
    q, qd, qdd = zip(*(map(float, cell.split(", ")) for cell in at_points), strict=True)
    assert (max(q) <= 1e-12, max(qd) <= 1e-10, max(qdd) <= 1e-8) == (True, True, True)


@pytest.mark.parametrize("name", MECHANISMS)
def test_the_table_of_settings_holds_every_setting_of_every_engine(name: str) -> None:
    head, *lines = csv.reader(SETTINGS_TABLE.splitlines())
    assert tuple(head) == SETTINGS_COLUMNS
    for engine in ENGINES:
        expected = [row_head(name, engine.name, one, is_usual=one == engine.usual) for one in engine.settings]
        found = [tuple(line[:6]) for line in lines if line[:2] == [name, engine.name]]
        assert found == expected or (engine.name in PEERS and not found), ANEW


def test_the_charts_are_in_the_folder_of_the_page_with_text_as_text() -> None:
    for chart in (WORK_PRECISION, NEAR_SINGULAR):
        for suffix in SUFFIXES:
            assert (DOCS / f"{chart}{suffix}").is_file(), ANEW
        assert f"]({chart}.svg)" in PAGE
        drawn = (DOCS / f"{chart}.svg").read_text(encoding="utf-8")
        for engine in (name for name in LOOKS if name not in PEERS):
            assert f">{engine}<" in drawn, ANEW
