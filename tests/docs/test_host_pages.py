"""docs/hosts.md and the page of each co-simulation tool: commands run, and so does the Python of installed tools."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.fmu.native.hosts_page import HOSTS, PAGE
from tests.fmu.native.test_hosts import ecos_command

DOCS = PAGE.parent
PAGES = sorted(DOCS.glob("host*.md"))
PYTHON = os.environ.get("KINFMU_HOSTS", sys.executable)
NEEDS = {"host-fmpy.md": "fmpy", "host-osp.md": "libcosimpy", "host-ecos.md": "ecospy"}


def _blocks(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def _build(page: Path) -> None:
    """Run every `kinfmu build` of a page in the current folder, without pages of kinfmu play."""
    text = page.read_text(encoding="utf-8")
    for command in dict.fromkeys(re.findall(r"^    kinfmu (build [^#\n]+)", text, re.MULTILINE)):
        words = command.split()
        result = CliRunner().invoke(main, [*words, "--no-page", *([] if "-o" in words else ["-o", "."])])
        assert result.exit_code == 0, (command, result.output)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_and_block_of_a_host_page_is_well_formed(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for line in re.findall(r"^    kinfmu ([^#\n]+)", text, re.MULTILINE):
        command, *words = line.split()
        known = {name for option in main.commands[command].params for name in option.opts}
        assert {word for word in words if re.match("--?[a-z]", word)} <= known, line
    for block in _blocks(page):
        ast.parse(block)


def test_there_is_a_page_for_each_tool_and_it_states_whether_it_was_run() -> None:
    text = PAGE.read_text(encoding="utf-8")
    names = {page.name for page in PAGES} - {PAGE.name}
    assert set(re.findall(r"\((host-\w+\.md)\)", text)) == names
    assert len(names) == 7
    not_run = {page.name for page in PAGES if "Not run by us" in page.read_text(encoding="utf-8")}
    assert names - not_run == {host.page for host in HOSTS} == set(NEEDS)


def test_the_table_of_runs_has_each_host_with_version_date_and_tests() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for host in HOSTS:
        row = rf"\| \[{host.name}\]\({host.page}\) \| {host.package} \d[\w.]+ \| \d{{4}}-\d\d-\d\d \| \d+ passed \| "
        assert re.search(row, text), host.name


@pytest.mark.parametrize("name", NEEDS)
def test_the_python_of_a_host_page_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if subprocess.run([PYTHON, "-c", f"import {NEEDS[name]}"], capture_output=True).returncode:
        pytest.skip(f"{NEEDS[name]} is not installed")
    monkeypatch.chdir(tmp_path)
    _build(DOCS / name)
    code = "\n".join(_blocks(DOCS / name))
    if name == "host-fmpy.md":
        code += "\nassert late < 1e-12"
    done = subprocess.run([PYTHON, "-c", code], capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr


def test_the_commands_of_fmpy_find_no_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "host-fmpy.md").read_text(encoding="utf-8")
    result = CliRunner().invoke(main, ["build", "fourbar", "-o", "fourbar.fmu", "--no-page", "--flavour", "python"])
    assert result.exit_code == 0, result.output
    for command in ("validate", "info"):
        assert f"    fmpy {command} fourbar.fmu" in page
        done = subprocess.run([sys.executable, "-m", "fmpy", command, "fourbar.fmu"], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    assert "crank.phi" in done.stdout


@pytest.mark.skipif(ecos_command() is None, reason="ecospy is not installed: no ecos command")
def test_the_commands_of_ecos_end_in_agreement(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "host-ecos.md").read_text(encoding="utf-8")
    build, simulate, verify = (
        line.split() for line in re.findall(r"^    (?:kinfmu|ecos) [^\n]*crank_rocker[^\n]*", page, re.MULTILINE)
    )
    result = CliRunner().invoke(main, [*build[1:], "--no-page"])
    assert result.exit_code == 0, result.output
    done = subprocess.run([str(ecos_command()), *simulate[1:]], capture_output=True, text=True, timeout=120)
    if "error while loading shared libraries" in done.stderr:
        pytest.skip("the ecos command lacks libtbb12")
    assert done.returncode == 0, done.stdout + done.stderr
    result = CliRunner().invoke(main, verify[1:])
    assert result.exit_code == 0, result.output
    assert "21 outputs at 21 of 21 samples compared" in result.output


def test_the_ssp_of_the_overview_is_built_and_simulated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    commands = re.findall(r"^    kinfmu ((?:build|simulate) engine[^#\n]*)", page, re.MULTILINE)
    assert len(commands) == 4
    for command in commands:
        words = command.split()
        result = CliRunner().invoke(main, [*words, *(["--no-page", "-o", "."] if words[0] == "build" else [])])
        assert result.exit_code == 0, (command, result.output)
