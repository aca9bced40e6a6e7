"""The C of a plan does the same arithmetic as its Python, operation by operation."""

from __future__ import annotations

import ctypes
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Gear, Mechanism, Revolute
from kinfmu.codegen.c import compiler, emit
from kinfmu.codegen.python import load_model, load_module
from kinfmu.errors import CompilerError
from kinfmu.mechanism import gallery
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.run import native_engine as library
from kinfmu.solver.python import Solver
from tests.fmu.test_parameters import geared, linkage
from tests.gallery_members import FEW, mostly_long
from tests.solver.c.native import SAME_SINES, STRICT, numbers


class Compiled:
    """A plan's model in C, called from here."""

    def __init__(self, plan: SolvePlan) -> None:
        files = emit(plan) | compiler.sources(compiler.MODEL)
        self.sizes = {name: int(n) for name, n in re.findall(r"#define KF_(\w+) (\d+)$", files["sizes.h"], re.M)}
        self.library = ctypes.CDLL(str(compiler.shared_library(files, (*STRICT, SAME_SINES))))
        fields = [(name, self.array(size)) for name, size in (("x", "COORDINATES"), ("hold", "HOLD"), ("m", "BLOCKS"))]
        fields += [(name, ctypes.c_double) for name in ("margin", "residual", "moved", "watch")]
        self.found_type = type("Found", (ctypes.Structure,), {"_fields_": [*fields, ("iterations", ctypes.c_int)]})
        self.model = numbers([0.0] * (self.sizes["PARAMETERS"] + self.sizes["DERIVED"] + 2))

    def array(self, size: str) -> Any:
        return ctypes.c_double * max(self.sizes[size], 1)

    def bind(self, values: Sequence[float]) -> str:
        why = ctypes.create_string_buffer(300)
        self.library.kf_bind.restype = ctypes.c_bool
        done = self.library.kf_bind(self.model, numbers(values), why, ctypes.c_size_t(300))
        return "" if done else why.value.decode()

    def position(self, u: Sequence[float], z: Sequence[float]) -> Any:
        found = self.found_type()
        at_rest = numbers([0.0] * len(z))
        arguments = (numbers(u), numbers(z), at_rest, at_rest, ctypes.c_double(0.0), None, ctypes.byref(found))
        assert self.library.kf_position(self.model, *arguments) == -1
        return found

    def rates(self, found: Any, ud: Sequence[float], udd: Sequence[float]) -> tuple[Any, Any]:
        x1, x2 = self.array("COORDINATES")(), self.array("COORDINATES")()
        self.library.kf_velocity(self.model, ctypes.byref(found), numbers(ud), None, None, x1)
        self.library.kf_acceleration(self.model, ctypes.byref(found), numbers(udd), x1, None, None, x2)
        return x1, x2

    def row(self, found: Any, x1: Any, x2: Any, v: float, a: float) -> list[float]:
        rows = [self.array("OUTPUTS")() for _ in range(3)]
        self.library.kf_outputs(self.model, ctypes.byref(found), rows[0])
        self.library.kf_output_rates(self.model, ctypes.byref(found), x1, ctypes.c_double(v), rows[1])
        weights = ctypes.c_double(v), ctypes.c_double(a)
        self.library.kf_output_accelerations(self.model, ctypes.byref(found), x1, x2, *weights, rows[2])
        return [value for row in rows for value in row]


@pytest.mark.parametrize(
    "name", mostly_long([*gallery.names(), "fourbar_chain:60", "open_chain:60"], few=(*FEW, "fourbar_chain:60"))
)
@pytest.mark.few(2)
def test_c_and_python_agree_to_the_bit(name: str) -> None:
    plan = compile_plan(kinfmu.load(name))
    python, c = load_model(plan), Compiled(plan)
    assert c.bind([parameter.value for parameter in plan.parameters]) == ""
    anchor = Solver(python).anchor
    u = tuple(value + 1e-3 for value in anchor.u)
    at_rest = (0.0,) * len(anchor.z)
    z, determinants, margin, residual, iterations, moved, watch, values = python.position(
        u, anchor.z, at_rest, at_rest, 0.0
    )
    found = c.position(u, anchor.z)
    assert tuple(found.x[: len(z)]) == z
    assert tuple(found.m[: len(determinants)]) == determinants
    diagnostics = (found.margin, found.residual, found.iterations, found.moved, found.watch)
    assert diagnostics == (margin, residual, iterations, moved, watch)
    ud, udd = (tuple(a + 0.1 * k for k in range(len(u))) for a in (0.7, -0.3))
    zd = python.velocity(values, ud)
    zdd = python.acceleration(values, ud, udd, zd)
    x1, x2 = c.rates(found, ud, udd)
    assert tuple(x1[: len(z)]) == zd
    assert tuple(x2[: len(z)]) == zdd
    first, second = zd, zdd
    if len(u) == 1:  # outputs by the chain rule
        first, second = python.tangent(values)
        x1, x2 = c.rates(found, (1.0,), (0.0,))
        assert (tuple(x1[: len(z)]), tuple(x2[: len(z)])) == (first, second)
    row = np.array(python.motion(values, ud, udd, first, second))  # some sums are in another order
    np.testing.assert_allclose(c.row(found, x1, x2, ud[0], udd[0]), row, rtol=0, atol=1e-14 * np.abs(row).max())
    for block, jacobian in enumerate(python.jacobians(values)):
        entries = c.array("LARGEST_BLOCK")()
        c.library.kf_jacobian(c.model, ctypes.byref(found), block, entries)
        assert entries[: np.size(jacobian)] == list(np.ravel(jacobian))


def test_laws_of_c_and_python_agree() -> None:
    plan = compile_plan(kinfmu.load("cam_roller"))
    python, c = load_model(plan), Compiled(plan)
    constants = [value for _, value in python.LAW_CONSTANTS]
    for t in np.linspace(-0.3, 2.7, 31):
        rows = [numbers([0.0]) for _ in range(3)]
        c.library.kf_drive(c.model, ctypes.c_double(t), numbers(constants), *rows)
        assert tuple(tuple(row) for row in rows) == python.drive(float(t), tuple(constants))


def test_laws_depend_on_the_bound_parameters() -> None:
    plan = compile_plan(geared())
    values = (3.5, 40.0, 2.0)  # the last is a pace: durations are 1 / pace
    python, c = load_module(plan).bound(values), Compiled(plan)
    assert c.bind(values) == ""
    constants = [value for _, value in python.LAW_CONSTANTS]
    for t in (0.1, 0.4, 0.6):
        rows = [numbers([0.0]) for _ in range(3)]
        c.library.kf_drive(c.model, ctypes.c_double(t), numbers(constants), *rows)
        assert tuple(tuple(row) for row in rows) == python.drive(t, tuple(constants))


def test_parameters_are_bound_or_refused() -> None:
    plan = compile_plan(linkage())
    c = Compiled(plan)
    assert c.bind([4.2, 1.3, 3.1, 3.3]) == ""
    model = load_model(plan)
    assert len(c.model[:4]) == len(plan.parameters)
    assert list(c.model[:4]) == [4.2, 1.3, 3.1, 3.3]
    assert model.PARAMETERS[0][0] == "ground"


def test_a_parameter_that_only_a_condition_reads_is_bound_or_refused() -> None:
    gears = Mechanism(
        "gears",
        [
            Body("ground", {"O": (0, 0), "C": (4, 0)}),
            Body("gear", {"O": (0, 0)}),
            Body("pinion", {"C": (0, 0)}, (4, 0)),
        ],
        [
            Revolute("O", ("ground.O", "gear.O")),
            Revolute("C", ("ground.C", "pinion.C")),
            Gear("mesh", ("gear", "pinion"), ratio="teeth"),
        ],
        [AngleDriver("crank", "gear", ConstantSpeed(0.0, 1.0))],
        parameters={"teeth": 2.0},
    )
    c = Compiled(compile_plan(gears))
    assert c.bind([3.0]) == ""
    assert c.bind([0.0]) == "[joints.mesh] ratio = 0 must be other than 0"
    assert c.bind([math.inf]) == "they lead to numbers that are not finite"


def test_the_same_plan_gives_the_same_bytes_whatever_the_hash_seed() -> None:
    code = (
        "import hashlib, kinfmu; from kinfmu.codegen.c import emit; from kinfmu.plan import compile_plan;"
        "print(hashlib.sha256(str(emit(compile_plan(kinfmu.load('jansen_leg')))).encode()).hexdigest())"
    )
    seeds = ({**os.environ, "PYTHONHASHSEED": seed} for seed in ("1", "2"))
    runs = [subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, env=env) for env in seeds]
    assert runs[0].stdout == runs[1].stdout


def test_a_block_names_the_rows_it_solves() -> None:
    text = emit(compile_plan(kinfmu.load("fourbar")))["model.c"]
    assert "/* coupler.phi, rocker.phi from Q.x, Q.y */" in text


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Looks for compilers on another path."""

    def search(path: str) -> None:
        compiler.command.cache_clear()
        monkeypatch.setenv("PATH", path)
        monkeypatch.delenv("CC", raising=False)
        monkeypatch.setattr(compiler, "find_spec", lambda _: None)

    return search


def test_without_a_compiler_one_line_has_the_command_that_installs_one(
    fresh: Callable[[str], None], tmp_path: Path
) -> None:
    fresh(str(tmp_path))
    with pytest.raises(CompilerError, match=r"no C compiler: cc, gcc and clang are not found; pip install 'kinfmu"):
        compiler.command()
    compiler.command.cache_clear()


def test_errors_of_the_compiler_are_reported() -> None:
    with pytest.raises(CompilerError, match=r"cannot compile the generated C: .*error"):
        compiler.shared_library({"a.c": "int f(void) { return x; }\n"})


def test_messages_are_equally_long_in_python_and_c() -> None:
    (length,) = re.findall(r"#define KF_MESSAGE (\d+)", compiler.sources(("solver.h",))["solver.h"])
    assert int(length) == library.MESSAGE


def test_a_library_is_compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"a.c": "int f(void);\nint f(void) { return 7; }\n"}
    library = compiler.shared_library(files)
    assert ctypes.CDLL(str(library)).f() == 7
    monkeypatch.setattr(compiler, "compile_files", None)
    assert compiler.shared_library(files) == library
