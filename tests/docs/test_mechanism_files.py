"""docs/mechanism-files.md: its tables are what the classes declare, and its blocks are one mechanism that works."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import MechanismError
from kinfmu.mechanism import RunSettings
from kinfmu.mechanism.checks import MOST_BODIES
from kinfmu.mechanism.drivers import DRIVERS
from kinfmu.mechanism.expression import DEEPEST, LONGEST
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.parameters import MOST_PARAMETERS
from kinfmu.mechanism.toml_document import LARGEST_FILE
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.valid import LARGEST_NUMBER
from tests.docs.key_tables import filled

PATH = Path(__file__).parents[2] / "docs" / "mechanism-files.md"
PAGE = PATH.read_text(encoding="utf-8")
SCREW, LIFT = "[joints.screw]", "[repeat.j]"  # blocks that are not of press.toml
BLOCKS = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
PRESS = "\n".join(block for block in BLOCKS if not block.startswith((SCREW, LIFT)))


def test_the_tables_are_what_the_classes_declare(request: pytest.FixtureRequest) -> None:
    text = filled(PAGE)
    if request.config.getoption("--update"):
        PATH.write_text(text, encoding="utf-8", newline="\n")
    else:
        assert text == PAGE, (
            "the tables of docs/mechanism-files.md are old; pytest tests/docs --update writes them anew"
        )


def test_the_blocks_are_one_mechanism_that_solves() -> None:
    mechanism = parse(PRESS, "docs/mechanism-files.md")
    report = kinfmu.check(mechanism)
    assert report.problem is None
    run = kinfmu.solve(mechanism, [0.0, 1.0, 2.0])
    assert run.good.all()
    assert run.outputs[:3] == ("crank.phi", "slide.x", "rocker.phi")
    assert "tip.x" in run.outputs
    apart = np.hypot(run["mark_2.x"] - run["mark_1.x"], run["mark_2.y"] - run["mark_1.y"])
    np.testing.assert_allclose(apart, 50.0, rtol=1e-12)


def test_the_screw_lifts_its_nut_by_its_lead() -> None:
    (screw,) = (block for block in BLOCKS if block.startswith(SCREW))
    mechanism = parse(f"""
name = "lift"
units.length = "mm"
bodies.ground.points = {{ O = [0, 0] }}
bodies.screw.points = {{ O = [0, 0] }}
bodies.nut = {{ points = {{ P = [0, 0] }}, start = {{ phi = 0 }} }}
joints.O = {{ type = "revolute", between = ["ground.O", "screw.O"] }}
joints.guide = {{ type = "translational", between = ["ground.O", "nut.P"], axis = "90 deg" }}
drivers.crank = {{ type = "angle", of = "screw", law = "constant_speed", speed = "60 rpm" }}
{screw}""")
    run = kinfmu.solve(mechanism, [0.0, 1.0, 2.5])
    np.testing.assert_allclose(run["nut.y"], [0.0, 5.0, 12.5], rtol=0.0, atol=1e-12)


def test_the_repeated_joint_is_that_of_the_scissor_lift() -> None:
    (shown,) = (tomllib.loads(block)["repeat"]["j"] for block in BLOCKS if block.startswith(LIFT))
    lift = (PATH.parents[1] / "examples" / "scissor_lift" / "mechanism.toml").read_text(encoding="utf-8")
    there = tomllib.loads(lift)["repeat"]["j"]
    assert shown == there | {"joints": {"A_{j}": there["joints"]["A_{j}"]}}


def test_the_table_of_inputs_drives_the_press(tmp_path: Path) -> None:
    (table,) = re.findall(r"```text\n(time,.*?)```", PAGE, re.DOTALL)
    (tmp_path / "crank.csv").write_text(table, encoding="utf-8")
    fmu = kinfmu.build(parse(PRESS), tmp_path / "press.fmu", drive="inputs")
    run = kinfmu.simulate(fmu, inputs=tmp_path / "crank.csv", step=0.5)
    np.testing.assert_allclose(np.degrees(run["crank.phi"])[:3], [60.0, 75.0, 75.0 - 15.0 / 7.0], rtol=1e-12)
    assert run.t[-1] == 4.0


def test_the_error_message_of_the_page_is_that_of_a_misspelt_body() -> None:
    (message,) = re.findall(r"```text\nkinfmu: (.*)\.\.\.\n```", PAGE)
    with pytest.raises(MechanismError) as caught:
        parse(
            PRESS.replace('P = { type = "revolute", between = ["crank.', 'P = { type = "revolute", between = ["krank.'),
            "press.toml",
        )
    assert str(caught.value).startswith(message)


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
    assert f"| time | one cycle, else {default.stop:g} s |" in PAGE
    assert f"| time | a 360th of a cycle, else {default.step:g} s |" in PAGE
