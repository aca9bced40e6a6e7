"""The solver in C under sanitizers, valgrind and other compilers: no byte is read unwritten or out of bounds."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path

import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.codegen.c import compiler, emit
from kinfmu.plan import compile_plan
from tests.fmu.test_parameters import linkage
from tests.gallery_members import mostly_long
from tests.mechanisms import six_bar
from tests.solver.c.native import STRICT

C99 = ("-std=c99", "-ffp-contract=off", *STRICT)
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g")
WALK = (Path(__file__).with_name("walk.c")).read_text("utf-8")
MECHANISMS: dict[str, Callable[[], Mechanism]] = {
    "bridges": lambda: kinfmu.load("fourbar"),
    "limits": lambda: kinfmu.load("double_pendulum"),
    "parameters": linkage,
    "two drivers": lambda: kinfmu.load("five_bar"),
    "a block of four": six_bar,
}


def walker(name: str, folder: Path, cc: Sequence[str], *flags: str) -> Path:
    """A program that walks a mechanism about."""
    files = emit(compile_plan(MECHANISMS[name]())) | compiler.sources(compiler.SOLVER) | {"walk.c": WALK}
    program = folder / "walk"
    compiler.compile_files(cc, files, (*C99, *flags), program)
    return program


def run(*command: str | Path) -> list[int]:
    """How many poses had which status; standard error must stay empty."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return [int(count) for count in done.stdout.split()]


@pytest.mark.parametrize("name", mostly_long(MECHANISMS, few=("bridges",)))
def test_sanitizers_find_nothing(name: str, tmp_path: Path) -> None:
    try:
        program = walker(name, tmp_path, compiler.command(), "-O0", *SANITIZERS)
    except kinfmu.KinfmuError as error:
        if "sanitize" in str(error) or "asan" in str(error):
            pytest.skip(f"the compiler has no sanitizers: {error}")
        raise
    counts = run(program)
    assert counts[0] > 100
    met = {"bridges": 2, "limits": 3, "parameters": 4, "two drivers": 3, "a block of four": 3}[name]
    assert counts[met] > 0


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
@pytest.mark.long
def test_valgrind_finds_nothing(tmp_path: Path) -> None:
    """With bridges; parameters are set under valgrind in tests/fmu/native/test_memory.py."""
    program = walker("bridges", tmp_path, compiler.command(), "-O1", "-g")
    assert run("valgrind", "-q", "--error-exitcode=9", "--leak-check=full", program)[0] > 100


@pytest.mark.skipif(find_spec("ziglang") is None, reason="ziglang is not installed")
@pytest.mark.long
def test_zig_compiles_without_a_warning_and_finds_the_same(tmp_path: Path) -> None:
    (tmp_path / "zig").mkdir()
    zig = walker("limits", tmp_path / "zig", (sys.executable, "-m", "ziglang", "cc"), "-O2")
    assert run(zig) == run(walker("limits", tmp_path, compiler.command(), "-O0"))
