"""docs/hosts.md and the page of each co-simulation tool: the pages of installed tools run."""

from __future__ import annotations

import re
import subprocess
from importlib import import_module
from pathlib import Path

import pytest

from tests.docs.blocks import blocks
from tests.docs.follow import PYTHON, follow, page_text, run_in_host, typed
from tests.fmu.native.hosts_page import HOSTS, PAGE
from tests.fmu.native.test_hosts import ecos_command

RUN = {"host-fmpy.md", "host-osp.md", "host-ecos.md"}
SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
<BaseStepSize>0.01</BaseStepSize><Algorithm>fixedStep</Algorithm>
<Simulators>
{simulator}<Simulator name="motor" source="motor/toggle_press.fmu"/>
<Simulator name="press" source="press/toggle_press.fmu"/>
</Simulators>
<Connections>
{connection}</Connections>
</OspSystemStructure>
"""
STEPS = """
from libcosimpy.CosimExecution import CosimExecution
execution = CosimExecution.from_osp_config_file("OspSystemStructure.xml")
print("steps:", sum(execution.step() for _ in range(5)))
"""


def _needs(module: str) -> None:
    if subprocess.run([PYTHON, "-c", f"import {module}"], capture_output=True).returncode:
        pytest.skip(f"{module} is not installed")


def test_there_is_a_page_for_each_tool_and_it_states_whether_it_was_run() -> None:
    pages = {page.name: page.read_text(encoding="utf-8") for page in PAGE.parent.glob("host-*.md")}
    assert set(re.findall(r"\((host-\w+\.md)\)", PAGE.read_text(encoding="utf-8"))) == set(pages)
    assert len(pages) == 7
    not_run = {name for name, text in pages.items() if "Not run by us" in text}
    assert {
        name for name, text in pages.items() if "stop time" not in text
    } == set()  # at a limit tools may end silently
    assert set(pages) - not_run == {host.page for host in HOSTS} == RUN


def test_the_table_of_runs_has_each_host_with_version_date_and_tests() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for host in HOSTS:
        row = rf"\| \[{host.name}\]\({host.page}\) \| {host.package} \d[\w.]+ \| \d{{4}}-\d\d-\d\d \| \d+ passed \| "
        assert re.search(row, text), host.name


@pytest.fixture(autouse=True)
def native_fmus(monkeypatch: pytest.MonkeyPatch) -> None:
    """FMUs are of the flavour that users get: pythonfmu's library may abort the process of a host at its end."""
    monkeypatch.setattr(import_module("kinfmu.fmu.build"), "default_flavour", lambda *_of, **_more: "native")


@pytest.mark.long
def test_the_page_of_fmpy_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    followed = follow("host-fmpy.md", tmp_path)
    assert "No problems found." in followed.outputs["fmpy validate fourbar.fmu"]
    assert "crank.phi" in followed.outputs["fmpy info fourbar.fmu"]
    monkeypatch.chdir(tmp_path)
    run_in_host(f"{followed.in_host}\nassert late < 1e-12")


def test_the_page_of_libcosim_runs(tmp_path: Path) -> None:
    _needs("libcosimpy")
    follow("host-osp.md", tmp_path)


@pytest.mark.long
def test_libcosim_steps_a_system_of_the_parts_that_its_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _needs("libcosimpy")
    monkeypatch.chdir(tmp_path)
    simulator, connection = (block.text for block in blocks(page_text("host-osp.md")) if block.kind == "xml")
    typed("kinfmu build fourbar --fmi 2 -o fourbar.fmu")
    for folder, drive in (("motor", "torque"), ("press", "inputs")):
        typed(f"kinfmu build toggle_press --drive {drive} --osp -o {folder}/toggle_press.fmu")
    assert 'name="shaft"' in connection  # the group of a motor; here another press moves the press
    system = SYSTEM.format(simulator=simulator, connection=connection.replace("shaft", "crank"))
    Path("OspSystemStructure.xml").write_text(system, encoding="utf-8")
    assert "steps: 5" in run_in_host(STEPS).splitlines()  # among the log of libcosim


@pytest.mark.long
def test_the_page_of_ecos_runs_and_ends_in_agreement(tmp_path: Path) -> None:
    command = ecos_command()
    if command is None:
        pytest.skip("ecospy is not installed: no ecos command")
    if "error while loading shared libraries" in subprocess.run([command], capture_output=True, text=True).stderr:
        pytest.skip("the ecos command lacks libtbb12")
    followed = follow("host-ecos.md", tmp_path)
    verified = followed.outputs["kinfmu verify crank_rocker.fmu --results crank_rocker.csv --tolerance 1e-5"]
    assert "21 outputs at 21 of 21 samples compared" in verified
