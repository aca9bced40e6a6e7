"""docs/mechanism-files.md: its tables are what the classes declare, and its blocks are one mechanism that works."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.drivers import DRIVERS
from kinfmu.joints import JOINTS
from kinfmu.laws import LAWS
from kinfmu.loads import LOADS
from kinfmu.mechanism import RunSettings
from kinfmu.mechanism.checks import MOST_BODIES
from kinfmu.mechanism.expression_text import DEEPEST, LONGEST
from kinfmu.mechanism.resolve import MOST_PARAMETERS
from kinfmu.mechanism.toml_file import LARGEST_FILE, parse
from kinfmu.mechanism.valid import LARGEST_NUMBER
from tests.docs.key_tables import filled

PATH = Path(__file__).parents[2] / "docs" / "mechanism-files.md"
PAGE = PATH.read_text(encoding="utf-8")
BLOCKS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


def test_the_tables_are_what_the_classes_declare(request: pytest.FixtureRequest) -> None:
    text = filled(PAGE)
    if request.config.getoption("--update"):
        PATH.write_text(text, encoding="utf-8", newline="\n")
    else:
        assert text == PAGE, (
            "the tables of docs/mechanism-files.md are old; pytest tests/docs --update writes them anew"
        )


def test_the_blocks_are_one_mechanism_that_solves() -> None:
    mechanism = parse("\n".join(BLOCKS), "docs/mechanism-files.md")
    report = kinfmu.check(mechanism)
    assert report.problem is None
    run = kinfmu.solve(mechanism, [0.0, 1.0, 2.0])
    assert run.good.all()
    assert run.outputs[:3] == ("crank.phi", "slide.x", "rocker.phi")
    assert "tip.x" in run.outputs
    apart = np.hypot(run["mark_2.x"] - run["mark_1.x"], run["mark_2.y"] - run["mark_1.y"])
    np.testing.assert_allclose(apart, 50.0, rtol=1e-12)


def test_every_table_of_the_format_is_on_the_page() -> None:
    named = ("bodies.NAME", "joints.NAME", "drivers.NAME")
    tables = ("units", "parameters", *named, "gravity", "loads.NAME", "points", "outputs", "run", "measures.NAME")
    tables += ("repeat.NAME",)
    assert [re.sub(r"[`\[\]]", "", line[3:]) for line in PAGE.splitlines() if line.startswith("## `[")] == list(tables)


def test_the_page_lists_every_type_and_no_other() -> None:
    section = PAGE.partition("\n## Types\n")[2].partition("\n## ")[0]
    rows = dict(re.findall(r"^\| (\w+) \|(.*)\|$", section, re.MULTILINE))
    for table, classes in (("joints", JOINTS), ("drivers", DRIVERS), ("loads", LOADS), ("laws", LAWS)):
        assert re.findall(r"`([^`]+)`", rows[table]) == [cls.type for cls in classes]


def test_the_limits_are_those_of_the_code() -> None:
    words = " ".join(PAGE.split())
    assert f"at most {LARGEST_NUMBER:g} in size".replace("e+", "e") in words
    assert f"at most {LONGEST} characters and {DEEPEST} parentheses" in words
    assert f"at most {LARGEST_FILE / 1e6:g} MB, {MOST_BODIES} bodies and {MOST_PARAMETERS} parameters" in words
    default = RunSettings()
    assert f"| time | {default.start:g} |" in PAGE
    assert f"| time | {default.stop:g} s |" in PAGE
    assert f"| time | {default.step:g} s |" in PAGE
