"""The default flavour: native where a compiler is found; the command reports which one and why."""

from __future__ import annotations

import re
import zipfile
from importlib import import_module
from pathlib import Path

import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.codegen.c import compiler
from kinfmu.errors import CompilerError
from kinfmu.fmu.build import default_flavour
from kinfmu.fmu.native.platforms import host

module = import_module("kinfmu.fmu.build")


@pytest.fixture(autouse=True)
def usual(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Restore the default that other tests change."""
    monkeypatch.setattr(module, "default_flavour", default_flavour)
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    def command() -> tuple[str, ...]:
        raise CompilerError("no C compiler: cc, gcc and clang are not found")

    monkeypatch.setattr(compiler, "command", command)


def _is_native(path: Path) -> bool:
    with zipfile.ZipFile(path) as zipped:
        return "sources/model.c" in zipped.namelist()


def test_with_a_compiler_it_is_native_and_the_command_states_the_platforms(tmp_path: Path) -> None:
    assert default_flavour() == "native"
    result = CliRunner().invoke(main, ["build", "fourbar"])
    assert result.exit_code == 0, result.output
    line = rf"fourbar\.fmu: \d+ kB, native FMU for {host().name}, FMI 2\.0 co-simulation and model exchange, "
    assert re.match(line, result.stdout)
    assert _is_native(tmp_path / "fourbar.fmu")
    assert _is_native(kinfmu.build(kinfmu.load("fourbar"), tmp_path / "again.fmu"))


@pytest.mark.usefixtures("no_compiler")
def test_without_a_compiler_it_is_python_and_the_command_states_why(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["build", "fourbar"])
    assert result.exit_code == 0, result.output
    assert ", python FMU for x86_64-linux, x86_64-windows in hosts that contain Python, " in result.stdout
    assert result.stderr == (
        "a native FMU, which every host can load, is not possible here: "
        "no C compiler: cc, gcc and clang are not found\n"
    )
    assert not _is_native(tmp_path / "fourbar.fmu")
    assert not _is_native(kinfmu.build(kinfmu.load("fourbar"), tmp_path / "again.fmu"))


@pytest.mark.usefixtures("no_compiler")
def test_fmi_3_is_refused_without_a_compiler(tmp_path: Path) -> None:
    assert default_flavour(3) == default_flavour(2, "all") == "native"
    with pytest.raises(CompilerError, match="no C compiler"):
        kinfmu.build(kinfmu.load("fourbar"), tmp_path / "three.fmu", fmi=3)


def test_the_python_flavour_can_be_chosen_and_is_the_default_on_unknown_platforms(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert not _is_native(kinfmu.build(kinfmu.load("fourbar"), tmp_path / "py.fmu", flavour="python"))
    monkeypatch.setattr("platform.machine", lambda: "s390x")
    assert default_flavour() == "python"
    assert "no native FMUs are built for s390x" in module.native_obstacle()


def test_simulate_of_a_mechanism_starts_without_a_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def compile_files(*_: object) -> None:
        raise AssertionError("a compiler ran")

    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(compiler, "compile_files", compile_files)
    result = CliRunner().invoke(main, ["simulate", "fourbar", "--stop", "3"])
    assert result.exit_code == 0, result.output
