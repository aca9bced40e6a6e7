"""docs/adding-a-joint.md, followed word for word in a copy of the project."""

from __future__ import annotations

import csv
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.docs.blocks import blocks as page_blocks
from tests.docs.blocks import commands

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "adding-a-joint.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in which the page has been followed."""
    copy = tmp_path_factory.mktemp("project")
    skipped = shutil.ignore_patterns("__pycache__", "*.fmu")
    for folder in ("kinfmu", "tests", "fmus"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=skipped)
    shutil.copy(ROOT / "pyproject.toml", copy)
    joint, export = blocks("python")
    (named,) = re.findall(r"`kinfmu/mechanism/joints/(opposed\.py)`:", PAGE)
    (copy / "kinfmu" / "mechanism" / "joints" / named).write_text(joint, encoding="utf-8")
    package = copy / "kinfmu" / "mechanism" / "joints" / "__init__.py"
    text = package.read_text(encoding="utf-8")
    text = text.replace("from kinfmu.mechanism.joints.revolute", f"{export}from kinfmu.mechanism.joints.revolute", 1)
    text = text.replace("\n)\n\n__all__", "\n    Opposed,\n)\n\n__all__", 1)
    text = text.replace('    "PointOnLine",\n', '    "Opposed",\n    "PointOnLine",\n', 1)
    assert text.count("Opposed") == 3
    package.write_text(text, encoding="utf-8")
    return copy


def run(project: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(project)}
    return subprocess.run(
        [sys.executable, *arguments], cwd=project, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.long
def test_the_contract_tests_pick_the_new_joint_up_and_pass(project: Path) -> None:
    files = ("tests/mechanism/joints/test_contract.py", "tests/mechanism/test_mechanism.py")
    done = run(project, "-m", "pytest", *files, "-q", "-k", "opposed")
    assert done.returncode == 0, done.stdout + done.stderr
    (passed,) = re.findall(r"(\d+) passed", done.stdout)
    assert int(passed) >= 7


@pytest.mark.long
def test_the_mechanism_of_the_page_solves_as_the_page_says(project: Path) -> None:
    (mechanism,) = blocks("toml")
    (project / "vice.toml").write_text(mechanism, encoding="utf-8")
    of_the_tests, *lines = (line for block in page_blocks(PAGE) if block.kind == "commands" for line in commands(block))
    assert of_the_tests == "scripts/test tests/mechanism/joints"  # the test above runs those of the joint
    for line in lines:
        program, *words = line.split()
        assert program == "kinfmu"
        done = run(project, "-m", program, *words)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
    with (project / "vice.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    t, left, right = (np.array([float(row[name]) for row in rows]) for name in ("time", "left_jaw.x", "right_jaw.x"))
    assert len(t) == 21
    np.testing.assert_allclose(left, t - 3.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose(right, 3.0 - t, rtol=0, atol=1e-14)
    assert {float(row["right_jaw.vx"]) for row in rows} == {-1.0}


def test_a_wrong_value_is_reported_in_one_line(project: Path) -> None:
    (mechanism,) = blocks("toml")
    (project / "wrong.toml").write_text(
        mechanism.replace('other = "right_jaw.P"', 'other = "ground.O"'), encoding="utf-8"
    )
    done = run(project, "-m", "kinfmu", "check", "wrong.toml")
    assert done.returncode == 1
    assert done.stderr == ("kinfmu: wrong.toml: [joints.spindle] other = 'ground.O' must be a point of a third body\n")
