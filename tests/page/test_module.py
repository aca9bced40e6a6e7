"""The WebAssembly module of a page gives the numbers of the native engine, to the bit. See also tests/stress."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import Status
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism.toml_file import parse
from kinfmu.page.module import _layout, page_module
from tests.page.engines import (
    StepByStep,
    answers,
    drag_call,
    driven_of,
    driven_through,
    needs_node,
    rows_of,
    sweep_call,
    table,
)

MEMBERS = {  # with what their poses are
    "fourbar": {Status.OK, Status.BRIDGED},  # a parallelogram: change points
    "jansen_leg": {Status.OK},
    "excavator": {Status.OK},  # three cylinders
    "triple_rocker": {Status.OK, Status.OUTSIDE},
}
THREE_BARS = parse("""
name = "three_bars"
bodies.ground.points = { O = [0, 0] }
bodies.base = { points = { O = [0, 0], A = [0, 0], B = [2, 0], C = [1, 0] }, mass = 1 }
bodies.crank = { points = { A = [0, 0], P = [1, 0] }, start = { phi = 1 }, mass = 1 }
bodies.rocker = { points = { B = [0, 0], P = [1, 0] }, start = { phi = 1 }, mass = 1, inertia = 0.1 }
bodies.third = { points = { C = [0, 0], P = [1, 0] }, start = { phi = 1 }, mass = 1, inertia = 0.1 }
bodies.bar = { points = { P = [0, 0], Q = [2, 0], R = [1, 0] }, start = { phi = 0 }, mass = 1, inertia = 0.1 }
joints.O = { type = "revolute", between = ["ground.O", "base.O"] }
joints.A = { type = "revolute", between = ["base.A", "crank.A"] }
joints.B = { type = "revolute", between = ["base.B", "rocker.B"] }
joints.C = { type = "revolute", between = ["base.C", "third.C"] }
joints.P = { type = "revolute", between = ["crank.P", "bar.P"] }
joints.Q = { type = "revolute", between = ["rocker.P", "bar.Q"] }
joints.R = { type = "revolute", between = ["third.P", "bar.R"] }
drivers.crank = { type = "angle", of = "crank", law = "constant_speed" }
drivers.base = { type = "angle", of = "base", law = "constant_speed" }
""")
LOADED = "excavator_loaded"  # masses, several drivers
LEG = kinfmu.load("jansen_leg")
OTHER_LEG = {"m": 14.0, "k": 62.5, "crank.speed": 3.0}
TIMES = np.linspace(0.0, 5.0, 41)
NO_LEGS: tuple[dict[str, float], ...] = ({"m": 45.0}, {"e": 3.0}, {"crank.speed": float("nan")})

pytestmark = needs_node


def settings(changed: dict[str, float]) -> list[Any]:
    """Return the values to bind for a leg with other parameters."""
    module = page_module(LEG)
    written = [one.value for one in (*module.plan.parameters, *module.plan.law_constants)]
    values = [changed.get(name, value) for name, value in zip(module.parameters, written, strict=True)]
    return [str(value) if value != value else value for value in values]


@pytest.fixture(scope="module")
def native() -> Callable[[str], StepByStep]:
    return cache(lambda name: StepByStep(kinfmu.load(name)))


@pytest.fixture(scope="module")
def swept(native: Callable[[str], StepByStep], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return run of the native engine and answers of the page's, by member; the last ones are of the leg."""
    runs = {name: driven_through(kinfmu.load(name), native(name)) for name in MEMBERS}
    jobs: list[Any] = []
    for name, run in runs.items():
        module, driven = page_module(kinfmu.load(name)), driven_of(run)
        jobs.append((module, [sweep_call(module, driven), ["restart"], drag_call(driven), ["driven", 0.25]]))
    leg = page_module(LEG)
    binds = [["bind", settings(changed)] for changed in NO_LEGS]
    at_rest = [1.0], [0.0]
    here: list[Any] = [
        ["at", [0.5], *at_rest],
        ["q"],
        ["margin"],
        ["errors"],
        ["at", ["NaN"], *at_rest],
        ["message"],
        ["q"],
    ]
    bound = [
        ["bind", settings(OTHER_LEG)],
        ["points"],
        sweep_call(leg, driven_of(runs["jansen_leg"])),
        ["driven", 0.25],
    ]
    jobs += [(leg, [*here, ["forces"], *binds, ["q"], ["parameters"]]), (leg, [*binds, *bound, *here[:4]])]
    loaded, run = page_module(kinfmu.load(LOADED)), kinfmu.solve(kinfmu.load(LOADED), TIMES)
    first, count = 3 * len(loaded.plan.outputs), len(loaded.forces)
    u, ud, udd = (values.ravel().tolist() for values in driven_of(run))
    columns = list(range(first, first + count))
    calls = [
        ["sweep", u, columns, ud, udd, TIMES.tolist()],
        ["at", u[-3:], ud[-3:], udd[-3:]],
        ["forces", TIMES[-1]],
        ["reactions", TIMES[-1]],
    ]
    jobs.append((loaded, calls))
    bars = page_module(THREE_BARS)
    jobs.append((bars, [["at", [1.0, 0.3], [1.0, 1.0], [0.0, 0.0]], ["reactions", 0.0], ["forces", 0.0]]))
    found = answers(tmp_path_factory.mktemp("page"), jobs)
    return {
        "runs": {**runs, LOADED: run},
        **dict(zip([*MEMBERS, "refused", "bound", LOADED, "three_bars"], found, strict=True)),
    }


def test_forces_are_those_of_a_run(swept: dict[str, Any]) -> None:
    run, (sweep, status, forces, _) = swept["runs"][LOADED], swept[LOADED]
    found = table(sweep["values"], len(run.force_names))
    assert status == Status.OK
    assert np.abs(found - run.forces).max() < 1e-12 * np.abs(run.forces).max()
    assert np.abs(forces - run.forces[-1]).max() < 1e-12 * np.abs(run.forces).max()
    assert swept["refused"][7] is None  # a leg without masses


def test_reactions_and_shaking_force_are_those_of_a_run(swept: dict[str, Any]) -> None:
    run, reactions = swept["runs"][LOADED], swept[LOADED][-1]
    names = page_module(kinfmu.load(LOADED)).reactions
    assert names == run.reaction_names
    assert names[-3:] == ("shaking_force_x", "shaking_force_y", "shaking_moment")
    assert np.abs(reactions - run.reactions[-1]).max() < 1e-12 * np.abs(run.reactions).max()


def test_reactions_that_need_a_system_of_three_unknowns(swept: dict[str, Any]) -> None:
    inputs = {"crank_angle": [1.0], "base_angle": [0.3], "crank_speed": 1.0, "base_speed": 1.0}
    run, (status, reactions, forces) = kinfmu.solve(THREE_BARS, **inputs), swept["three_bars"]
    known = np.isfinite(run.reactions[0])  # redundant rows share a load
    assert status == Status.OK
    assert page_module(THREE_BARS).reactions == tuple(np.array(run.reaction_names)[known])
    assert np.abs(reactions - run.reactions[0, known]).max() < 1e-12 * np.abs(run.reactions[0, known]).max()
    assert np.abs(forces - run.forces[0]).max() < 1e-12 * np.abs(run.forces[0]).max()


def test_a_mechanism_that_is_too_large_is_refused_with_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    most, structures = _layout()
    assert most["UNKNOWNS"] == 512
    monkeypatch.setattr("kinfmu.page.module._layout", lambda: (most | {"UNKNOWNS": 5}, structures))
    with pytest.raises(RequestError, match="jansen_leg' is too large for a page: it has 6 unknowns, at most 5 fit"):
        page_module(LEG)


@pytest.mark.parametrize("name", MEMBERS)
def test_sweeps_and_steps_equal_the_native_engine_to_the_bit(swept: dict[str, Any], name: str) -> None:
    run, (sweep, _, drag, _) = swept["runs"][name], swept[name]
    expected = rows_of(run)
    assert set(run.status.tolist()) == MEMBERS[name]
    assert sweep["status"] == drag["statuses"] == run.status.tolist()
    assert np.array_equal(table(sweep["values"], expected.shape[1]), expected, equal_nan=True)
    good = run.status <= Status.BRIDGED  # dragged beyond a limit, the last good pose stays
    rows = np.array(drag["rows"])
    assert np.array_equal(rows[good], expected[good])
    for k in np.flatnonzero(~good):
        assert np.array_equal(rows[k], rows[k - 1])


def test_laws_drive_the_page_as_the_mechanism(swept: dict[str, Any]) -> None:
    run = kinfmu.solve(kinfmu.load("excavator"), [0.25])
    found = swept["excavator"][3]
    assert [[found[key][k] for key in ("u", "ud", "udd")] for k in range(3)] == run.inputs.reshape(3, 3).tolist()


def test_margin_and_errors_are_those_of_a_run(swept: dict[str, Any], native: Callable[[str], StepByStep]) -> None:
    status, q, margin, errors, *_ = swept["refused"]
    run = native("jansen_leg").solve(crank_angle=np.array([0.5]))
    assert (status, margin) == (0, run.margin[0])
    assert q == run.values[0].tolist()
    assert errors == run.error[0].tolist()


def test_an_unreachable_pose_leaves_the_last_one(swept: dict[str, Any]) -> None:
    _, q, _, _, status, message, after, *_ = swept["refused"]
    assert status == Status.OUTSIDE
    assert message == "crank = nan rad (nan deg) is not a finite number"
    assert after == q


def test_bound_parameters_equal_the_native_engine_to_the_bit(
    swept: dict[str, Any], native: Callable[[str], StepByStep]
) -> None:
    bind, points, sweep, driven, status, *_ = swept["bound"][len(NO_LEGS) :]
    start = swept["runs"]["jansen_leg"]
    u, ud, udd = driven_of(start)
    given = {"crank_angle": u[:, 0], "crank_speed": ud[:, 0], "crank_acceleration": udd[:, 0]}
    expected = native("jansen_leg").solve(parameters=OTHER_LEG, **given)
    assert bind == {"ok": True, "result": "bound", "message": ""}
    assert np.array_equal(table(sweep["values"], 3 * expected.values.shape[1]), rows_of(expected))
    assert driven == {"u": [0.75], "ud": [3.0], "udd": [0.0]}
    assert status == Status.OK
    changed = LEG.with_parameters(OTHER_LEG)
    assert np.array_equal(table(points, 2), list(changed.body_points.values()))


@pytest.mark.parametrize(("number", "changed"), [*enumerate(NO_LEGS)])
def test_parameters_without_a_solution_leave_those_before(
    swept: dict[str, Any], native: Callable[[str], StepByStep], number: int, changed: dict[str, float]
) -> None:
    _, q, *_ = swept["refused"]
    *_, first, second, third, after, parameters = swept["refused"]
    bind = (first, second, third)[number]
    if all(value == value for value in changed.values()):
        with pytest.raises(KinfmuError) as caught:
            native("jansen_leg").solve(np.zeros(1), parameters=changed)
        assert bind == {"ok": False, "result": "refused", "message": str(caught.value)}
    else:
        assert bind == {
            "ok": False,
            "result": "refused",
            "message": "crank.speed = nan must be a number of at most 1e+30",
        }
    assert (after, parameters) == (q, settings({}))
