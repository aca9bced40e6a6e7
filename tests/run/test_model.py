"""Models: planned once, parameters as arguments, equal to `solve` in every way of using them."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, Run
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.plan import compile_plan
from tests.test_parameters_by_every_way import TIMES, drawn, linkage

ANGLES = np.linspace(0.0, 7.0, 40)


def leg() -> Mechanism:
    return kinfmu.load("jansen_leg")


def assert_equal(run: Run, wanted: Run) -> None:
    for table in ("values", "rates", "accelerations", "status", "residual", "margin", "error"):
        np.testing.assert_array_equal(getattr(run, table), getattr(wanted, table), err_msg=table)


@pytest.mark.parametrize("name", ["fourbar", "crank_rocker", "five_bar", "cam_roller", "jansen_leg"])
@pytest.mark.few(3)
def test_a_model_solves_as_solve_does(name: str) -> None:
    mechanism = kinfmu.load(name)
    model = kinfmu.compile(mechanism)
    assert_equal(model.solve(), kinfmu.solve(compile_plan(mechanism)))
    assert model.outputs == model.solve([0.0]).outputs


def test_columns_keep_the_order_of_the_mechanism() -> None:
    model = kinfmu.compile(kinfmu.load("crank_rocker"), ["rocker.phi", "coupler.x"])
    assert model.outputs == ("coupler.x", "rocker.phi")


def test_parameters_are_arguments_in_any_order_of_calls() -> None:
    model = kinfmu.compile(leg())
    sets: list[dict[str, float | str]] = [{"a": 38.0 + k, "crank.speed": "30 rpm"} for k in range(4)]
    for values in [*sets, *reversed(sets)]:
        assert_equal(model.solve(parameters=values), kinfmu.solve(compile_plan(leg()), parameters=values))


def test_the_run_holds_the_mechanism_with_its_parameters() -> None:
    run = kinfmu.compile(leg()).solve([0.0, 0.1], parameters={"a": "39 mm", "b": 41.0})
    assert run.mechanism is not None
    assert run.mechanism.parameters["a"].value == 39.0
    assert run.info["a"] == "39.0"
    assert run.info["b"] == "41.0"


def test_the_run_holds_the_mechanism_with_its_law_constants() -> None:
    values: dict[str, float | str] = {"crank.speed": "30 rpm", "a": 39.0}
    run = kinfmu.compile(leg()).solve([0.0, 0.1], parameters=values)
    values["a"] = 37.0  # which no longer concerns the run
    assert run.mechanism is not None
    assert run.mechanism.settable.constants["crank.speed"].value == pytest.approx(np.pi)
    assert run.mechanism.parameters["a"].value == 39.0


def test_parameters_by_expressions_follow_the_others_in_the_run() -> None:
    run = kinfmu.compile(leg()).solve([0.0], parameters={"a": 39.0})
    assert run.mechanism is not None
    for name, parameter in run.mechanism.parameters.items():
        assert float(run.info[name]) == pytest.approx(float(parameter.value), abs=1e-12)


def test_named_parameters_alone_stay_arguments() -> None:
    model = kinfmu.compile(leg(), parameters=["b", "a"])
    assert model.parameters == ("a", "b")
    np.testing.assert_allclose(
        model.solve(crank_angle=ANGLES, parameters={"b": 41.0}).values,
        kinfmu.compile(leg()).solve(crank_angle=ANGLES, parameters={"b": 41.0}).values,
        rtol=0,
        atol=1e-12,
    )
    with pytest.raises(
        RequestError, match=r"c is a number of the model; compile\(mechanism, parameters=\['c'\]\) makes it an argument"
    ):
        model.solve(parameters={"c": 40.0})


def test_a_parameter_by_an_expression_can_be_an_argument_too() -> None:
    mechanism = leg()
    name = next(name for name, parameter in mechanism.parameters.items() if parameter.expression)
    value = float(mechanism.parameters[name].value) + 0.5
    with pytest.raises(RequestError, match=f"{name} follows from '.*'; compile"):
        kinfmu.compile(mechanism).solve(parameters={name: value})
    own = kinfmu.compile(mechanism, parameters=[name]).solve([0.0, 0.3], parameters={name: value})
    np.testing.assert_allclose(
        own.values, kinfmu.solve(mechanism, [0.0, 0.3], parameters={name: value}).values, rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("engine", ["auto", "python", "native"])
@pytest.mark.few(2)
def test_models_travel_between_processes(engine: str) -> None:
    model = kinfmu.compile(leg(), ["foot.x", "foot.y"], parameters=["a", "c"], engine=engine)
    there = pickle.loads(pickle.dumps(model))  # noqa: S301  our own
    assert (there.outputs, there.parameters, there.engine) == (model.outputs, ("a", "c"), engine)
    values = {"a": 38.5, "c": 39.0}
    assert_equal(there.solve(parameters=values), model.solve(parameters=values))


@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_model_serves_several_threads(engine: str) -> None:
    model = kinfmu.compile(leg(), engine=engine)
    values = [{"a": 37.0 + 0.05 * k} for k in range(40)]
    alone = [model.solve(crank_angle=ANGLES, parameters=given) for given in values]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda given: model.solve(crank_angle=ANGLES, parameters=given), values))
    for run, wanted in zip(together, alone, strict=True):
        assert_equal(run, wanted)


def test_parameters_that_continuation_does_not_reach_are_assembled_anew_or_refused() -> None:
    mechanism = linkage()
    model = kinfmu.compile(mechanism)
    anew = kept = 0
    for values in drawn(14, seed=19):
        try:
            run = model.solve(TIMES, parameters=values)
        except KinfmuError:
            continue
        if run.events and run.events[0].level == "info":
            anew += 1
            assert "assembled anew" in run.events[0].text
            with pytest.raises(KinfmuError):
                model.solve(TIMES, parameters=values, anew=False)
        else:
            kept += 1
            assert_equal(model.solve(TIMES, parameters=values, anew=False), run)
    assert min(anew, kept) > 0


def test_what_is_read_later_is_computed_then() -> None:
    run = kinfmu.compile(leg()).solve(crank_angle=ANGLES)
    lazy = ("margin", "error", "inputs", "info", "axis", "fixed")
    assert all(callable(run.__dict__[name]) for name in lazy)
    assert run.axis == "crank_angle"
    assert run.inputs.shape == (40, 3)
    assert run.margin.shape == (40,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"engine": "fortran"}, "engine 'fortran' is not known"),
        ({"outputs": ["foot"]}, "outputs: 'foot' is not one"),
        ({"parameters": ["aa"]}, "there is no parameter 'aa'; did you mean 'a'"),
    ],
)
def test_a_wrong_request_is_refused_in_one_line(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(RequestError, match=message):
        kinfmu.compile(leg(), **arguments)


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        ({"aa": 1.0}, RequestError, "there is no parameter 'aa'; did you mean 'a'"),
        ({"a": "1 rpm"}, RequestError, "unit 'rpm' must be one of m, mm"),
        ({"a": float("nan")}, RequestError, "must be a finite number"),
        ({"crank.speed": "fast"}, RequestError, "crank.speed = 'fast' must be a number"),
    ],
)
def test_wrong_parameters_are_refused_in_one_line(
    values: dict[str, float | str], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        kinfmu.compile(leg()).solve(parameters=values)


def test_solve_plans_an_equal_mechanism_once(monkeypatch: pytest.MonkeyPatch) -> None:
    first = kinfmu.solve(leg(), [0.0, 0.1])
    monkeypatch.setattr("kinfmu.plan.compile.plan_from", None)
    assert_equal(kinfmu.solve(leg(), [0.0, 0.1]), first)
