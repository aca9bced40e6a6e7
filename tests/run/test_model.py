"""Compiled models: calls with other parameters, and batches of designs."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, Run
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.toml_file import parse
from kinfmu.plan import compile_plan
from kinfmu.run.designs import parts_of
from tests.gallery_members import mostly_long
from tests.mechanisms import with_open_lengths
from tests.test_every_way import TIMES, drawn, linkage

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


# -------------------------------------------------------------------------------------------------------------- designs


COUNT, SAMPLES = 12, 70


def drawn_lengths(mechanism: Mechanism, count: int, spread: float) -> dict[str, np.ndarray]:
    """Return random lengths: some designs as written but for one, others with all lengths changed."""
    rng = np.random.default_rng(5)
    names = [name for name in mechanism.own_parameters if float(mechanism.parameters[name].value) != 0.0]
    values = {name: np.full(count, float(mechanism.parameters[name].value)) for name in names}
    for k in range(count):
        chosen = names if k % 2 else [names[k % len(names)]]
        for name in chosen:
            values[name][k] *= np.exp(rng.normal(0.0, spread))
    return values


def assert_as_solved(model: kinfmu.Model, designs: kinfmu.Designs, **arguments: object) -> None:
    """Check every design against `solve` of it: values to round-off, status, reasons."""
    for k in range(len(designs)):
        values = {name: float(array[k % len(array)]) for name, array in designs.parameters.items()}
        run = reason = None
        try:
            run = model.solve(parameters=values, **arguments)  # type: ignore[arg-type]
        except KinfmuError as error:
            reason = str(error)
        if run is None:
            assert designs.reasons[k] == reason
            assert np.isnan(designs.values[k]).all()
            assert (designs.status[k] == 4).all()
            continue
        np.testing.assert_array_equal(designs.status[k], run.status)
        assert (k in designs.anew) == any(event.level == "info" for event in run.events)
        assert (k in designs.reasons) == (not run.good.all())
        tables = (designs.values, designs.rates, designs.accelerations)
        for table, wanted, close in zip(
            tables, (run.values, run.rates, run.accelerations), (1e-12, 1e-10, 1e-8), strict=True
        ):
            if table is not None:
                size = np.maximum(np.nanmax(np.abs(wanted), axis=0, initial=1.0), 1.0)
                np.testing.assert_array_less(np.nan_to_num(np.abs(table[k] - wanted) / size), close)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize(
    "name", mostly_long(["crank_rocker", "fourbar", "five_bar", "slider_crank"], few=("fourbar", "five_bar"))
)
@pytest.mark.few(1)
def test_designs_equal_solve_of_each(name: str, engine: str) -> None:
    mechanism = with_open_lengths(kinfmu.load(name))
    model = kinfmu.compile(mechanism, engine=engine)
    inputs = {driver.inputs()[0]: driver.law.at(0.0) + np.linspace(0.0, 1.5, SAMPLES) for driver in mechanism.drivers}
    count = (
        3 if name == "fourbar" else COUNT
    )  # its redundant bar fits no other lengths: each is assembled anew, in vain
    designs = model.solve_designs(drawn_lengths(mechanism, count, 0.03), **inputs)
    assert designs.status.shape == (count, SAMPLES)
    assert designs.good.any() == (name != "fourbar")
    assert_as_solved(model, designs, **inputs)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_parameters_that_are_not_given_follow_from_those_that_are(engine: str) -> None:
    crank_rocker = with_open_lengths(kinfmu.load("crank_rocker"))
    values = {name: float(parameter.value) for name, parameter in crank_rocker.parameters.items()}
    first, second = [name for name, length in values.items() if length != 0.0][1:3]
    ratio = values[second] / values[first]
    derived = replace(crank_rocker, parameters={**crank_rocker.parameters, second: f"{first}*{ratio!r}"})
    model = kinfmu.compile(derived, parameters=[first, second], engine=engine)
    value, angles = values[first], np.linspace(0.0, 1.5, 5)
    designs = model.solve_designs({first: [value, 1.02 * value, np.nan]}, crank_angle=angles)
    assert designs.good.all(axis=1).tolist() == [True, True, False]
    for k, factor in enumerate((1.0, 1.02)):
        run = kinfmu.compile(derived, model.outputs).solve(crank_angle=angles, parameters={first: factor * value})
        np.testing.assert_allclose(designs.values[k], run.values, rtol=0, atol=1e-12)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_laws_drive_designs_with_constants_of_their_own(engine: str) -> None:
    mechanism = with_open_lengths(kinfmu.load("crank_rocker"))
    model = kinfmu.compile(mechanism, engine=engine)
    values: dict[str, object] = {**drawn_lengths(mechanism, 6, 0.02), "crank.speed": np.linspace(1.0, 9.0, 6)}
    t = np.linspace(0.0, 1.0, SAMPLES)
    designs = model.solve_designs(values, t)  # type: ignore[arg-type]
    np.testing.assert_allclose(designs["crank.omega"], np.linspace(1.0, 9.0, 6)[:, None] + 0.0 * t, rtol=1e-14)
    assert_as_solved(model, designs, t=t)


@pytest.mark.parametrize("engine", ["python", "native"])
def test_what_cannot_be_solved_has_a_status_and_a_reason_and_ends_nothing(engine: str) -> None:
    mechanism = with_open_lengths(kinfmu.load("crank_rocker"))
    model = kinfmu.compile(mechanism, engine=engine)
    base = next(name for name, parameter in mechanism.parameters.items() if parameter.value == 40.0)
    lengths = np.array([40.0, np.nan, 400.0, np.inf, 41.0])
    designs = model.solve_designs({base: lengths}, crank_angle=np.linspace(0.0, 1.0, SAMPLES))
    assert designs.good[[0, 4]].all()
    assert not designs.good[[1, 2, 3]].any()
    assert set(designs.reasons) == {1, 2, 3}
    assert "must be a finite number" in designs.reasons[1]
    assert "does not close" in designs.reasons[2]
    assert np.isnan(designs.values[1:4]).all()
    given_up = model.solve_designs({base: lengths}, crank_angle=np.linspace(0.0, 1.0, SAMPLES), anew=False)
    assert set(given_up.reasons) == {1, 2, 3}
    np.testing.assert_array_equal(given_up.status, designs.status)


def test_each_design_may_have_inputs_of_its_own() -> None:
    mechanism = with_open_lengths(kinfmu.load("crank_rocker"))
    angles = np.linspace(0.0, 1.0, SAMPLES) + np.arange(3.0)[:, None]
    for engine in ("python", "native"):
        model = kinfmu.compile(mechanism, engine=engine)
        designs = model.solve_designs({"p1": [40.0, 40.5, 41.0]}, crank_angle=angles, crank_speed=2.0)
        np.testing.assert_allclose(designs["crank.phi"], angles, rtol=0, atol=1e-15)
        run = model.solve(parameters={"p1": 41.0}, crank_angle=angles[2], crank_speed=2.0)
        np.testing.assert_allclose(designs["coupler.omega"][2], run["coupler.omega"], rtol=0, atol=1e-12)


def test_threads_and_pieces_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    mechanism = with_open_lengths(kinfmu.load("crank_rocker"))
    model = kinfmu.compile(mechanism, engine="native")
    values = drawn_lengths(mechanism, 40, 0.02)
    alone = model.solve_designs(values, crank_angle=np.linspace(0.0, 6.0, SAMPLES))
    monkeypatch.setattr("kinfmu.run.designs.SAMPLES_AT_ONCE", 3 * SAMPLES)
    for workers in (1, 3):
        other = model.solve_designs(values, crank_angle=np.linspace(0.0, 6.0, SAMPLES), workers=workers)
        np.testing.assert_array_equal(other.values, alone.values)
        np.testing.assert_array_equal(other.accelerations, alone.accelerations)
        np.testing.assert_array_equal(other.status, alone.status)
        assert other.reasons == alone.reasons


def test_derivatives_that_are_not_requested_are_not_computed() -> None:
    model = kinfmu.compile(kinfmu.load("jansen_leg"), ["foot.x", "foot.y"])
    designs = model.solve_designs({"a": [38.0, 38.5]}, crank_angle=[0.0, 0.1], derivatives=0)
    assert designs.rates is None
    assert designs["foot.x"].shape == (2, 2)
    with pytest.raises(KinfmuError, match=r"the designs have no column 'foot.vx'"):
        designs["foot.vx"]


@pytest.mark.parametrize(
    ("values", "arguments", "message"),
    [
        ({"aa": [1.0]}, {}, "there is no parameter 'aa'"),
        (
            {"a": [1.0, 2.0], "b": [1.0, 2.0, 3.0]},
            {},
            r"must have equal lengths or be single numbers: a \(2\), b \(3\)",
        ),
        ({"a": [[1.0]]}, {}, r"parameter 'a' must be a number or \(m,\), not of shape \(1, 1\)"),
        ({"a": ["1 mm", "2 mm"]}, {}, "parameter 'a' must be numbers"),
        ({"a": [True, 1.0]}, {}, "parameter 'a' must be numbers, or text .*, not true or false"),
        ({"a": np.array([True])}, {}, "parameter 'a' must be numbers, or text .*, not true or false"),
        ({"a": np.array([1.0, 1j])}, {}, "parameter 'a' must be numbers, or text .*, not complex"),
        (
            {"a": [38.0, 39.0], "crank.speed": [1.0, 2.0]},
            {"crank_angle": [0.0]},
            "crank.speed: the laws of drivers have no effect where crank_angle is given; leave them out, or give times",
        ),
        ({"a": 1.0}, {"derivatives": 3}, "derivatives = 3 must be 0, 1 or 2"),
        (None, {}, "parameters must be arrays by name, such as"),
        ({"a": 1.0}, {"workers": 0}, "workers = 0 must be a positive whole number"),
        ({"a": [1.0, 2.0]}, {"crank_angle": np.zeros((3, 4))}, r"crank_angle must be of shape \(n,\) or \(2, n\)"),
        ({"a": 1.0}, {"t": [0.0], "crank_angle": [0.0]}, "give times or inputs, not both"),
    ],
)
@pytest.mark.few(9)
def test_a_wrong_request_of_designs_is_refused_in_one_line(
    values: dict[str, object], arguments: dict[str, object], message: str
) -> None:
    with pytest.raises(RequestError, match=message):
        kinfmu.compile(kinfmu.load("jansen_leg")).solve_designs(values, **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
@pytest.mark.parametrize("designs", [1, 2, 7, 1000, 10_000])
@pytest.mark.parametrize("most", [1, 415])
@pytest.mark.few(15)
def test_parts_hold_all_designs_and_every_thread_gets_as_many(designs: int, most: int, threads: int) -> None:
    parts = parts_of(designs, most, threads)
    assert [k for part in parts for k in range(part.start, part.stop)] == list(range(designs))
    sizes = [part.stop - part.start for part in parts]
    assert max(sizes) <= most
    if designs >= 1000:
        assert len(parts) % threads == 0 or max(sizes) == 1
        assert threads == 1 or len(parts) >= 4 * threads


def test_no_designs_have_no_parts() -> None:
    assert parts_of(0, 10, 2) == []


@pytest.mark.parametrize("engine", ["python", "native"])
def test_what_follows_an_angle_among_the_parameters_turns_with_it(engine: str) -> None:
    """A slide tilted by t: rod.phi = t - asin(a sin(u - t) / l), continuous in t over whole turns."""
    text = (gallery.folder() / "slider_crank/mechanism.toml").read_text(encoding="utf-8")
    text = text.replace('"ground.O", "piston.S"] }', '"ground.O", "piston.S"], axis = "tilt" }').replace(
        "[run]", '[parameters]\ntilt = "10 deg"\n\n[run]'
    )
    tilts = np.radians([10.0, 100.0, 190.0, 191.0, 280.0, 350.0, 369.0, 370.0, 371.0, 1000.0, -170.0, -349.0, -351.0])
    model = kinfmu.compile(parse(text), ["rod.phi", "piston.x"], engine=engine)
    designs = model.solve_designs({"tilt": tilts}, crank_angle=[0.3], anew=False)
    np.testing.assert_array_equal(designs.status, 0)
    side = tilts - np.arcsin(45.0 / 144.0 * np.sin(0.3 - tilts))
    np.testing.assert_allclose(
        designs.values[:, 0, designs.outputs.index("rod.phi")], side, rtol=0, atol=1e-13 * np.abs(tilts).max()
    )
