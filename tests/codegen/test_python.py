"""The generated Python against the readable reference, which shares neither trace nor plan with it."""

from __future__ import annotations

import ast
import math

import numpy as np
import pytest

from kinfmu import Body, Mechanism, load
from kinfmu.codegen.python import emit, load_model
from kinfmu.mechanism.gallery import chains
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.reference import solve_reference
from kinfmu.plan.equations.system import System
from kinfmu.solver.python import Solver, estimate
from tests.mechanisms import bar_as_body, bar_linkage, five_bar, fourbar, reference_fourbar, six_bar, slider_crank

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
