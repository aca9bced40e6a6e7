"""Generated Python and C against the readable reference and against each other."""

from __future__ import annotations

import ast
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
from kinfmu import AngleDriver, Body, ConstantSpeed, Gear, Mechanism, Revolute, load
from kinfmu.codegen.c import compiler, functions
from kinfmu.codegen.c import emit as emit_c
from kinfmu.codegen.python import emit, load_model, load_module
from kinfmu.errors import CompilerError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.gallery import chains
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.reference import solve_reference
from kinfmu.plan.equations.system import System
from kinfmu.run import native_engine as library
from kinfmu.solver.python import Solver, estimate
from tests.fmu.test_parameters import geared, linkage
from tests.gallery_members import FEW, mostly_long
from tests.mechanisms import bar_as_body, bar_linkage, five_bar, fourbar, reference_fourbar, six_bar, slider_crank
from tests.solver.c.native import SAME_SINES, STRICT, numbers

MECHANISMS = [
    reference_fourbar(),
    load("double_pendulum"),
    bar_as_body(0.5),
    fourbar(4, 1, 3.5, 3),
    six_bar(),
    five_bar(),
    slider_crank(offset=0.4),
    bar_linkage(),
]


@pytest.fixture(params=MECHANISMS, ids=lambda mechanism: mechanism.name)
def plan(request: pytest.FixtureRequest) -> SolvePlan:
    return compile_plan(request.param)


@pytest.mark.few(4)
def test_position_velocity_and_acceleration_equal_the_dense_reference(plan: SolvePlan) -> None:
    system = System(plan.mechanism)
    rows = [*find_redundancy(system).kept, *range(system.joint_row_count, len(system.rows))]
    solver = Solver(load_model(plan))
    places = [system.coordinates.index(name) for name in plan.coordinates]
    rng = np.random.default_rng(7)
    pose, q = solver.anchor, plan.anchor.q
    for step in rng.uniform(-0.05, 0.05, (12, len(plan.drivers))):
        u = tuple((np.array(pose.u) + step).tolist())
        ud, udd = rng.uniform(-2, 2, (2, len(plan.drivers)))
        pose = solver.solve(pose, u)
        exact = solve_reference(system, rows, q, np.array(u), ud, udd)
        q = exact.q
        ours = solver.outputs(pose), solver.rates(pose, tuple(ud)), solver.accelerations(pose, tuple(ud), tuple(udd))
        for values, expected in zip(ours, exact[:3], strict=True):
            np.testing.assert_allclose(values[: plan.coordinate_count], expected[places], rtol=0, atol=2e-12)


def test_motion_is_outputs_rates_and_accelerations_in_a_row(plan: SolvePlan) -> None:
    solver = Solver(load_model(plan))
    ud, udd = (0.7,) * len(plan.drivers), (-0.3,) * len(plan.drivers)
    pose = solver.anchor
    row = (*solver.outputs(pose), *solver.rates(pose, ud), *solver.accelerations(pose, ud, udd))
    np.testing.assert_allclose(solver.motion(pose, ud, udd), row, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("mechanism", [*MECHANISMS, chains.fourbar_chain(20)], ids=lambda mechanism: mechanism.name)
@pytest.mark.few(5)
def test_differences_are_those_of_angles_and_of_lengths_relative_to_the_size(mechanism: Mechanism) -> None:
    plan = compile_plan(mechanism)
    model = load_model(plan)
    there, here = np.random.default_rng(3).standard_normal((2, 3, len(plan.outputs)))
    sizes = [1.0 if name.endswith(".phi") else plan.size for name in plan.outputs]
    expected = (np.abs(there - here) / sizes).max(axis=1)
    found = model.differences(tuple(there.ravel().tolist()), tuple(here.ravel().tolist()))
    assert found == tuple(expected.tolist())


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_infinitely_far_away(value: float) -> None:
    model = load_model(compile_plan(reference_fourbar()))
    n = len(model.OUTPUTS)
    here = (1.0,) * (3 * n)
    there = (*here[: n + 1], value, *here[n + 2 :])
    assert estimate._differences(model, there, here) == (0.0, math.inf, 0.0)
    assert estimate._differences(model, there, there)[0::2] == (0.0, 0.0)


def test_rates_of_points_are_the_derivatives_of_their_positions() -> None:
    plan = compile_plan(slider_crank(offset=0.4))
    solver = Solver(load_model(plan))
    k, h = plan.outputs.index("slider.x"), 1e-3
    poses = [solver.solve(solver.anchor, (1.3 + j * h,)) for j in range(-3, 4)]
    x = [solver.outputs(pose)[k] for pose in poses]
    slope = (x[6] - 9 * x[5] + 45 * x[4] - 45 * x[2] + 9 * x[1] - x[0]) / (60 * h)  # order 6
    assert solver.rates(poses[3], (1.0,))[k] == pytest.approx(slope, abs=1e-11)


@pytest.mark.few(4)
def test_generated_code_is_readable_python_on_the_standard_library(plan: SolvePlan) -> None:
    source = emit(plan)
    tree = ast.parse(source)
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert {"drive", "position", "velocity", "acceleration", "outputs", "rates", "accelerations"} <= functions.keys()
    assert all(ast.get_docstring(function) for function in functions.values())
    imported = [node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert set(imported) <= {"math", "linear"}
    for block in plan.blocks:
        if block.unknowns:
            assert f": {', '.join(block.unknowns)} from {', '.join(block.row_names)}" in source


def test_names_of_bodies_cannot_collide_with_names_of_the_code() -> None:
    plain = fourbar(4, 1, 3.5, 3)
    names = {"crank": "sin_coupler", "coupler": "coupler", "rocker": "cos_coupler", "ground": "ground"}

    def renamed(point: str) -> str:
        body, _, name = point.partition(".")
        return f"{names[body]}.{name}"

    joints = [type(joint)(joint.name, tuple(map(renamed, joint.between))) for joint in plain.joints]  # type: ignore[attr-defined]
    driver = type(plain.drivers[0])("crank", "sin_coupler", plain.drivers[0].law)
    bodies = [Body(names[body.name], body.points, body.start) for body in plain.bodies]
    odd = compile_plan(Mechanism("odd", bodies, joints, [driver]))
    a, b = Solver(load_model(compile_plan(plain))), Solver(load_model(odd))
    assert a.outputs(a.solve(a.anchor, (2.5,))) == b.outputs(b.solve(b.anchor, (2.5,)))


# -------------------------------------------------------------------------------------------------------------------- c


class Compiled:
    """A plan's model in C, called from here."""

    def __init__(self, plan: SolvePlan) -> None:
        files = emit_c(plan) | compiler.sources(compiler.MODEL)
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


@pytest.mark.parametrize("most_stores", [500, 0])
def test_c_gives_the_fixed_coordinates_from_stores_or_from_a_table(
    monkeypatch: pytest.MonkeyPatch, most_stores: int
) -> None:
    monkeypatch.setattr(functions, "MOST_STORES", most_stores)
    plan = compile_plan(kinfmu.load("jansen_leg"))  # some are formulas of parameters
    c, fixed = Compiled(plan), numbers([math.nan] * len(plan.fixed))
    assert c.bind([parameter.value for parameter in plan.parameters]) == ""
    c.library.kf_fixed(c.model, fixed)
    assert list(fixed) == list(plan.fixed.values())


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
    text = emit_c(compile_plan(kinfmu.load("fourbar")))["model.c"]
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
