"""Several FMUs linked into one program from their sources: every name has the FMU's prefix, none collides."""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path

import pytest

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.fmu.native.sources import headers, sources
from kinfmu.fmu.variables import interface
from kinfmu.plan import compile_plan

CC, NM = shutil.which("gcc") or shutil.which("clang"), shutil.which("nm")
LINKED = {"first": ("fourbar", "2.0"), "second": ("double_pendulum", "2.0"), "third": ("fourbar", "3.0")}


NO_PREFIX = "#define fmi2FullName(name) name\n"  # fmpy's copy of FMI 2.0's header leaves the prefix out
PREFIX = """\
#if defined(FMI2_FUNCTION_PREFIX)
#define fmi2Paste(a, b) a##b
#define fmi2PasteB(a, b) fmi2Paste(a, b)
#define fmi2FullName(name) fmi2PasteB(FMI2_FUNCTION_PREFIX, name)
#else
#define fmi2FullName(name) name
#endif
"""


def _headers(version: str) -> dict[str, str]:
    """The headers of FMI, with the prefix as the standard's own copy has it."""
    return {name: text.replace(NO_PREFIX, PREFIX) for name, text in headers(version).items()}


def _objects(folder: Path, prefix: str) -> list[Path]:
    """Object files of an FMU whose names begin with the prefix."""
    name, version = LINKED[prefix]
    plan = compile_plan(kinfmu.load(name))
    files = sources(plan, interface(plan, "inputs", has_time=version == "3.0"), version, f"{{{prefix}}}")
    folder.mkdir()
    for file, text in (files | _headers(version)).items():
        (folder / file).write_text(text, "utf-8")
    units = compiler.units(files)
    define = f"-DFMI{version[0]}_FUNCTION_PREFIX={prefix}_"
    command = [str(CC), "-std=c99", "-O0", "-Wall", "-Wextra", "-Werror", "-c", define, *units]
    subprocess.run(command, cwd=folder, check=True)
    return [folder / unit.replace(".c", ".o") for unit in units]


@pytest.mark.skipif(CC is None or NM is None, reason="a compiler or nm is not there")
@pytest.mark.long
def test_fmus_of_both_versions_are_linked_into_one_program(tmp_path: Path) -> None:
    objects = {prefix: _objects(tmp_path / prefix, prefix) for prefix in LINKED}
    for prefix, files in objects.items():
        listed = subprocess.run([str(NM), "-g", "--defined-only", *files], capture_output=True, text=True, check=True)
        names = [line.split()[-1] for line in listed.stdout.splitlines() if len(line.split()) == 3]
        assert len(names) > 100
        assert [name for name in names if not name.startswith(f"{prefix}_")] == []
    for name, text in (_headers("2.0") | _headers("3.0")).items():
        (tmp_path / name).write_text(text, "utf-8")
    host = Path(__file__).with_name("linked.c")
    program = tmp_path / "linked"
    every = [str(file) for files in objects.values() for file in files]
    subprocess.run([str(CC), f"-I{tmp_path}", str(host), *every, "-o", str(program), "-lm"], check=True)
    done = subprocess.run([str(program)], capture_output=True, text=True, check=True)
    wanted = [0.0, 0.5, math.cos(5.5), 0.75]  # crank.phi, upper.x, crank.phi
    assert [float(word) for word in done.stdout.split()] == pytest.approx(wanted, abs=1e-14)
