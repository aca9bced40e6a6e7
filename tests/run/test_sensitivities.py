"""Model.sensitivities: against closed forms in 50 digits, and against central differences of solve."""

from __future__ import annotations

import math
import pickle
import random
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import kinfmu
from kinfmu import Mechanism
from kinfmu.codegen.python import emit
from kinfmu.codegen.python.stage import load_stage
from kinfmu.errors import RequestError
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan import compile_plan
from kinfmu.plan.steps import sensitivity_steps
from kinfmu.run.sensitivities import Sensitivities
from tests import oracle
from tests.fmu.test_parameters import LENGTHS, linkage
from tests.gallery_members import mostly_long
from tests.mechanisms import wheels, with_open_lengths
from tests.oracle import Motion, mp
from tests.stress.sensitivities import NAMES, compared_in_gallery

ANGLES = np.array([0.1, 0.7, 1.9, 2.8, 4.4, 5.6])
STEP = mp.mpf("1e-15")  # of differences in 50 digits: they keep 30
TIGHT = 1e-11  # of the largest number of a column

Form = Callable[..., Motion]


def exact_derivative(form: Form, numbers: dict[str, Any], name: str) -> Motion:
    """Derivatives of a closed form with respect to one of its numbers, by central differences in 50 digits."""
    value = mp.mpf(numbers[name])
    ahead, behind = (form(**numbers | {name: value + sign * STEP}) for sign in (1, -1))
    return Motion(*((a - b) / (2 * STEP) for a, b in zip(ahead, behind, strict=True)))


def assert_equal(found: Sensitivities, exact: Motion, outputs: Sequence[str], parameter: str) -> None:
    """Both derivatives agree with the exact ones, which have one column for each output."""
    rounded = exact.rounded()
    for k, output in enumerate(outputs):
        for mine, theirs in (
            (found.of(output, parameter), rounded.q[:, k]),
            (found.rate_of(output, parameter), rounded.qd[:, k]),
        ):
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=TIGHT * max(1.0, np.abs(theirs).max()))


def test_four_bar_agrees_with_its_closed_form() -> None:
    model = kinfmu.compile(linkage())
    found = model.sensitivities(crank_angle=ANGLES, crank_speed=2.5)
    assert found.parameters == tuple(LENGTHS)
    assert found.values_by.shape == found.rates_by.shape == (len(ANGLES), len(model.outputs), 4)
    assert not found.refused
    numbers = dict(LENGTHS) | {"u": ANGLES.tolist(), "ud": 2.5}
    outputs = ("crank.phi", "coupler.phi", "rocker.phi")
    for name in LENGTHS:
        assert_equal(found, exact_derivative(oracle.fourbar, numbers, name), outputs, name)


def test_derivatives_over_time_include_those_of_law_constants() -> None:
    t = np.array([0.0, 0.9, 3.3, 7.1])
    model = kinfmu.compile(linkage())
    settings = {"coupler": 3.3, "crank.speed": 1.25}
    found = model.sensitivities(t, parameters=settings)
    assert found.parameters == (*LENGTHS, *(constant.name for constant in model.plan.law_constants))

    def form(start: Any, speed: Any, **lengths: Any) -> Motion:
        return oracle.fourbar(**lengths, u=[mp.mpf(start) + mp.mpf(speed) * mp.mpf(x) for x in t.tolist()], ud=speed)

    numbers = dict(LENGTHS) | {"coupler": 3.3, "start": 1.0, "speed": 1.25}
    outputs = ("crank.phi", "coupler.phi", "rocker.phi")
    for name, key in (("crank.start", "start"), ("crank.speed", "speed"), ("coupler", "coupler"), ("ground", "ground")):
        assert_equal(found, exact_derivative(form, numbers, key), outputs, name)


def test_what_is_written_as_an_expression_changes_with_its_parameters() -> None:
    """The coupler's point M is at (coupler / 2, rocker / 6)."""
    found = kinfmu.compile(linkage()).sensitivities(crank_angle=ANGLES)

    def point(**numbers: Any) -> Motion:
        motion = oracle.fourbar(**numbers)
        columns = []
        for q, qd in zip(motion.q, motion.qd, strict=True):
            a, b = mp.mpf(numbers["coupler"]) / 2, mp.mpf(numbers["rocker"]) / 6
            length, (u, phi, _), (speed, rate, _) = mp.mpf(numbers["crank"]), q, qd
            x = a * mp.cos(phi) - b * mp.sin(phi)
            y = a * mp.sin(phi) + b * mp.cos(phi)
            place = [length * mp.cos(u) + x, length * mp.sin(u) + y]
            moved = [-length * mp.sin(u) * speed - y * rate, length * mp.cos(u) * speed + x * rate]
            columns.append([place, moved, place])
        return Motion(*np.moveaxis(np.array(columns, dtype=object), 1, 0))

    for name in LENGTHS:
        exact = exact_derivative(point, dict(LENGTHS) | {"u": ANGLES.tolist()}, name)
        assert_equal(found, exact, ("M.x", "M.y"), name)


def named(mechanism: Mechanism, numbers: dict[str, float], places: dict[str, str]) -> Mechanism:
    """The mechanism with parameters; places: parts of its text, and what they become."""
    written = text(mechanism)
    for old, new in places.items():
        assert old in written
        written = written.replace(old, new)
    lines = [f'{name} = "{value!r} {mechanism.length_unit}"' for name, value in numbers.items()]
    return parse(written.replace("[bodies.ground]", "\n".join(["[parameters]", *lines, "", "[bodies.ground]"])))


def test_slider_crank_agrees_with_its_closed_form() -> None:
    numbers = {"crank": 30.0, "rod": 100.0, "offset": 20.0}
    places = {
        "P = [30.0,": 'P = ["crank",',
        "S = [100.0,": 'S = ["rod",',
        "slot = [0.0, 20.0]": 'slot = [0.0, "offset"]',
    }
    model = kinfmu.compile(named(kinfmu.load("offset_slider_crank"), numbers, places))
    found = model.sensitivities(crank_angle=ANGLES, outputs=["slider.x", "crank.phi"])
    assert found.outputs == ("slider.x", "crank.phi")
    for name in numbers:
        exact = exact_derivative(oracle.slider_crank, numbers | {"u": ANGLES.tolist()}, name)
        assert_equal(found, Motion(*(table[:, [2, 0]] for table in exact)), found.outputs, name)


def test_two_drivers_agree_with_fifty_digits() -> None:
    numbers = {"ground": 100.0, "left": 120.0, "right": 120.0, "one": 160.0, "other": 160.0}
    places = {
        "B = [100.0,": 'B = ["ground",',
        " P = [120.0,": ' P = ["left",',
        " Q = [120.0,": ' Q = ["right",',
        "{ P = [0.0, 0.0], T = [160.0,": '{ P = [0.0, 0.0], T = ["one",',
        "{ Q = [0.0, 0.0], T = [160.0,": '{ Q = [0.0, 0.0], T = ["other",',
    }
    model = kinfmu.compile(named(kinfmu.load("five_bar"), numbers, places))
    u = [(2.3, 0.8), (2.0, 1.0), (2.6, 0.4)]
    speeds = (0.7, -1.3)
    inputs = {"left_angle": [a for a, _ in u], "right_angle": [b for _, b in u]}
    found = model.sensitivities(**inputs, left_speed=speeds[0], right_speed=speeds[1])
    outputs = ("left_forearm.phi", "right_forearm.phi")
    guesses = model.solve(**inputs)
    guess = np.stack([guesses[name] for name in outputs], axis=1)

    def form(ground: Any, left: Any, right: Any, one: Any, other: Any) -> Motion:
        def residual(q: Any, u: Any) -> list[Any]:
            cos, sin = oracle.cos, oracle.sin
            x = left * cos(u[0]) + one * cos(q[0]) - ground - right * cos(u[1]) - other * cos(q[1])
            y = left * sin(u[0]) + one * sin(q[0]) - right * sin(u[1]) - other * sin(q[1])
            return [x, y]

        return oracle.solve(residual, guess, u, speeds, (0.0, 0.0))

    for name in numbers:
        assert_equal(found, exact_derivative(form, {key: mp.mpf(x) for key, x in numbers.items()}, name), outputs, name)


@pytest.mark.long
def test_random_four_bars_agree_with_fifty_digits() -> None:
    rng = random.Random(15)  # noqa: S311
    checked = 0
    for _ in range(60):
        lengths = {name: round(rng.uniform(1.0, 4.0), 3) for name in ("ground", "crank", "coupler", "rocker")}
        numbers = {name: mp.mpf(value) for name, value in lengths.items()}
        angle = rng.uniform(0.0, 2.0 * math.pi)
        try:
            q = oracle.fourbar(**lengths, u=[angle]).rounded().q[0]
        except ValueError:
            continue
        if abs(math.sin(q[1] - q[2])) < 0.1:
            continue
        mechanism = started(lengths, angle, q, (0.0, 0.0))
        found = kinfmu.compile(mechanism).sensitivities(crank_angle=[angle], crank_speed=1.7)
        for name in lengths:
            exact = exact_derivative(oracle.fourbar, numbers | {"u": [angle], "ud": 1.7}, name)
            assert_equal(found, exact, ("crank.phi", "coupler.phi", "rocker.phi"), name)
        checked += 1
    assert checked >= 25


def started(lengths: dict[str, float], angle: float, q: NDArray[np.float64], at: tuple[float, float]) -> Mechanism:
    """A four-bar of these lengths, at a place of the world, that starts at a pose of the closed form."""
    x, y = at
    tip = (x + lengths["crank"] * math.cos(angle), y + lengths["crank"] * math.sin(angle))
    poses = iter([(x, y, angle), (*tip, q[1]), (x + lengths["ground"], y, q[2])])

    def start(_: re.Match[str]) -> str:
        a, b, phi = map(float, next(poses))
        return f"start = {{ x = {a!r}, y = {b!r}, phi = {phi!r} }}"

    written = re.sub(r"start = \{.*\}", start, text(linkage(lengths)))
    written = written.replace("start = 1.0\n", f"start = {angle!r}\n")
    ground = f'O = [{x!r}, {y!r}], C = ["{x!r} + ground", {y!r}]'
    assert 'O = [0.0, 0.0], C = ["ground", 0.0]' in written
    return parse(written.replace('O = [0.0, 0.0], C = ["ground", 0.0]', ground))


PARALLELOGRAM = {
    "P = [1.0, 0.0]": 'P = ["r", 0.0]',
    "Q = [1.0, 0.0]": 'Q = ["r", 0.0]',
    "length = 1.0": 'length = "r"',
    "C = [1.0, 0.0], B = [2.0, 0.0]": 'C = ["s", 0.0], B = ["2*s", 0.0]',
    "P = [-1.0, 0.0]": 'P = ["-s", 0.0]',
    "A = [1.0, 0.0]": 'A = ["s", 0.0]',
}


def test_reference_four_bar_with_its_redundant_row() -> None:
    """Lengths that keep the parallelogram have derivatives: x2 = s + r cos phi1, y2 = r sin phi1."""
    model = kinfmu.compile(named(kinfmu.load("fourbar"), {"r": 1.0, "s": 1.0}, PARALLELOGRAM))
    assert model.plan.watches
    angles = np.concatenate([ANGLES, [math.pi]])
    found = model.sensitivities(crank_angle=angles, crank_speed=3.0)
    assert found.status.tolist() == [0] * len(ANGLES) + [2]
    assert not found.refused
    c, s = np.cos(angles), np.sin(angles)
    expected = {"coupler.x": (c, -3.0 * s), "coupler.y": (s, 3.0 * c), "coupler.phi": (0.0, 0.0), "A.x": (c, -3.0 * s)}
    for output, (value, rate) in expected.items():
        np.testing.assert_allclose(found.of(output, "r"), value + 0.0 * c, atol=1e-12)
        np.testing.assert_allclose(found.rate_of(output, "r")[:-1], (rate + 0.0 * c)[:-1], atol=1e-12)
        np.testing.assert_allclose(found.rate_of(output, "r")[-1], (rate + 0.0 * c)[-1], atol=1e-10)  # interpolated
    np.testing.assert_allclose(found.of("coupler.x", "s"), 1.0, atol=1e-12)
    np.testing.assert_allclose(found.of("A.x", "s"), 2.0, atol=1e-12)
    np.testing.assert_allclose(found.values[-1], model.solve(crank_angle=[math.pi]).values[0], atol=1e-12)


def crossing(scaled: bool) -> Mechanism:
    """A four-bar with a change point where 4 + 2 = 3 + 3: all lengths by a factor, or each by itself."""
    lengths = {"ground": 4.0, "crank": 1.0, "coupler": 3.0, "rocker": 2.0}
    q = oracle.fourbar(**lengths, u=[1.0]).rounded().q[0]
    written = text(started(lengths, 1.0, q, (0.0, 0.0)))
    if scaled:
        for name, value in lengths.items():
            written = re.sub(rf'(?m)^{name} = ".*"$', f'{name} = "{value!r} * scale"', written)
        written = written.replace("[parameters]", '[parameters]\nscale = "1 m"')
    return parse(written)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_parameters_that_keep_a_change_point_have_derivatives_there(engine: str) -> None:
    """A factor of all lengths changes no angle; lengths by themselves remove the change point."""
    angles = np.array([0.5, 3.1, math.pi - 1e-3, math.pi, math.pi + 1e-9, 3.2, 4.0])
    for scaled in (True, False):
        model = kinfmu.compile(crossing(scaled), engine=engine)
        found = model.sensitivities(crank_angle=angles, crank_speed=1.5)
        bridged = found.status == 2
        assert 3 <= bridged.sum() <= 5
        assert not found.refused
        run = model.solve(crank_angle=angles, crank_speed=1.5)
        if not scaled:
            for name in ("ground", "coupler"):
                assert np.isnan(found.of("coupler.phi", name)[bridged]).all()
                assert np.isfinite(found.of("coupler.phi", name)[~bridged]).all()
            np.testing.assert_allclose(found.of("coupler.x", "crank"), np.cos(angles), atol=1e-11)
            continue
        for angle, speed in (("coupler.phi", "coupler.omega"), ("rocker.phi", "rocker.omega")):
            np.testing.assert_allclose(found.of(angle, "scale"), 0.0, atol=1e-9)
            np.testing.assert_allclose(found.rate_of(angle, "scale"), 0.0, atol=1e-8)
            np.testing.assert_allclose(found.rates[:, found.outputs.index(angle)], run[speed], rtol=0, atol=1e-8)
        for name, rate in (("M.x", "M.vx"), ("M.y", "M.vy")):
            np.testing.assert_allclose(found.of(name, "scale"), run[name], rtol=0, atol=1e-9)
            np.testing.assert_allclose(found.rate_of(name, "scale"), run[rate], rtol=0, atol=1e-8)


@pytest.mark.parametrize("engine", ["python", "native"])
def test_the_memory_of_an_earlier_result_holds_the_numbers_of_the_next(engine: str) -> None:
    model = kinfmu.compile(crossing(scaled=False), engine=engine)
    first, second = np.linspace(0.1, 3.0, 130), np.linspace(-3.0, 0.5, 130)
    reused = model.sensitivities(crank_angle=first)
    reused.values_by[:] = np.pi  # by the user, whose arrays they are
    for angles in (second, first, second):
        wanted, arrays = model.sensitivities(crank_angle=angles), reused.rates_by
        reused = model.sensitivities(crank_angle=angles, reuse=reused)
        assert np.shares_memory(reused.rates_by, arrays)
        for name in ("values", "rates", "values_by", "rates_by"):
            np.testing.assert_array_equal(getattr(reused, name), getattr(wanted, name))
        with pytest.raises(ValueError, match="read-only"):
            reused.values_by[0] = 1.0


def test_a_result_of_other_names_or_samples_is_left_alone() -> None:
    model = kinfmu.compile(kinfmu.load("jansen_leg"), ["foot.x"], engine="python")
    for other in ({"crank_angle": np.zeros(3)}, {"crank_angle": np.zeros(2), "wrt": model.parameters[:1]}):
        earlier = model.sensitivities(crank_angle=np.array([0.1, 0.2]))
        kept = earlier.values_by.copy()
        again = model.sensitivities(**other, reuse=earlier)
        np.testing.assert_array_equal(earlier.values_by, kept)
        assert not np.shares_memory(again.values, earlier.values)
    with pytest.raises(RequestError, match="reuse must be a result of sensitivities or None, not int"):
        model.sensitivities(crank_angle=np.zeros(2), reuse=1)  # type: ignore[arg-type]


def test_law_constants_have_derivatives_at_a_change_point() -> None:
    """z(u), u = start + speed t: derivatives are those over the driver value."""
    model = kinfmu.compile(crossing(False))
    t = (math.pi - 1.0) / model.plan.law_constants[1].value + np.array([-0.01, 0.0, 1e-6, 0.02])
    run = model.solve(t)
    found = model.sensitivities(t, wrt=["crank.start", "crank.speed"])
    assert (found.status == 2).all()
    names = [constant.name for constant in model.plan.law_constants]
    speed = model.plan.law_constants[names.index("crank.speed")].value
    by_driver = run["coupler.omega"] / speed
    np.testing.assert_allclose(found.of("coupler.phi", "crank.start"), by_driver, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.of("coupler.phi", "crank.speed"), by_driver * t, rtol=0, atol=1e-8)
    bend = run["coupler.alpha"] / speed
    np.testing.assert_allclose(found.rate_of("coupler.phi", "crank.start"), bend, rtol=0, atol=1e-7)


def test_a_length_that_opens_a_redundant_row_is_refused_with_its_name() -> None:
    places = PARALLELOGRAM | {"Q = [1.0, 0.0]": 'Q = ["rocker_length", 0.0]'}
    model = kinfmu.compile(named(kinfmu.load("fourbar"), {"r": 1.0, "s": 1.0, "rocker_length": 1.0}, places))
    found = model.sensitivities(crank_angle=ANGLES)
    assert found.refused["rocker_length"] == (
        "'rocker_length' cannot change by itself: redundant row AB.length would not close"
    )
    assert set(found.refused) == {"r", "rocker_length"}
    assert np.isnan(found.of("coupler.x", "rocker_length")).all()
    np.testing.assert_allclose(found.of("coupler.x", "s"), 1.0, atol=1e-12)


def test_a_block_solved_by_least_squares_has_its_consistent_derivative() -> None:
    """Two wheels that two rods couple: every pin is at r (cos, sin) of its angle, rods are parallel to the ground."""
    rods = {"A": (0, 1, 0.0), "B": (0, 1, math.pi / 2)}
    written = wheels(rods)
    near = {"[0.5, 0.0]": '["r", 0.0]', "0.5]": '"r"]', "[2.0, 0.0]": '["s", 0.0]'}
    model = kinfmu.compile(named(written, {"r": 0.5, "s": 2.0}, near))
    assert any(len(block.residuals) > len(block.unknowns) for block in model.plan.blocks)
    for angles in (ANGLES, ANGLES[:2]):
        found = model.sensitivities(crank_angle=angles, crank_speed=2.0)
        assert not found.refused
        np.testing.assert_allclose(found.of("rodA.x", "r"), np.cos(angles), atol=1e-12)
        np.testing.assert_allclose(found.rate_of("rodA.x", "r"), -2.0 * np.sin(angles), atol=1e-12)
        np.testing.assert_allclose(found.of("rodB.y", "r"), np.cos(angles), atol=1e-12)
        for output in ("wheel1.phi", "rodA.phi", "rodB.phi"):
            np.testing.assert_allclose(found.of(output, "r"), 0.0, atol=1e-12)
            np.testing.assert_allclose(found.of(output, "s"), 0.0, atol=1e-12)
    alone = kinfmu.compile(named(written, {"pin": 0.5}, {"QA = [0.5,": 'QA = ["pin",'}))
    refused = alone.sensitivities(crank_angle=ANGLES).refused
    assert list(refused) == ["pin"]
    assert "would not close" in refused["pin"]


TENTH = (5 / 6, -5 / 21, 5 / 84, -5 / 504, 1 / 1260)  # weights of central differences of order 10
EIGHTH = (4 / 5, -1 / 5, 4 / 105, -1 / 280)


@pytest.mark.parametrize("name", mostly_long(NAMES))
@pytest.mark.few(2)
def test_gallery_with_open_lengths_agrees_with_fifty_digits(name: str) -> None:
    """Seven lengths at one sample; all lengths at more samples: `python -m tests.stress.sensitivities --gallery`."""
    found = compared_in_gallery(name, lengths=7, samples=slice(1, 2))
    assert found.faults == []
    assert found.compared > 0
    assert found.worst <= 1e-12


def test_a_cam_with_open_lengths_agrees_with_central_differences() -> None:
    mechanism = with_open_lengths(kinfmu.load("cam_roller"))
    model = kinfmu.compile(mechanism, engine="python")
    start, stop = mechanism.run.start, mechanism.run.stop
    t = start + (stop - start) * np.array([0.031, 0.117, 0.36, 0.57, 0.81])
    found = model.sensitivities(t)
    assert (found.status < 2).all()
    lengths = [parameter for parameter in model.parameters if parameter not in found.refused]
    assert len(lengths) >= 4
    close = total = 0
    for parameter in lengths:
        numbers = differences(model, t, parameter)
        if numbers is None:
            continue
        difference, error = numbers
        k = found.parameters.index(parameter)
        exact = np.stack([found.values_by[:, :, k], found.rates_by[:, :, k]])
        scale = np.maximum(1.0, np.abs(exact).max(axis=(1, 2), keepdims=True))
        assert (np.abs(exact - difference) <= 1e-10 * scale + 3.0 * error.max(axis=2, keepdims=True)).all(), parameter
        close += int((error <= 1e-9 * scale).sum())
        total += error.size
    assert close >= 0.5 * total > 0  # the differences themselves are good enough to tell


def differences(
    model: kinfmu.Model, t: NDArray[np.float64], parameter: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Central differences of values and rates, and their estimated error; None where `solve` fails on the way."""
    written = {one.name: one.value for one in model.plan.parameters}[parameter]
    h = 2e-3 * model.plan.size
    there = {}
    for k in range(-5, 6):
        run = model.solve(t, parameters={parameter: written + k * h})
        if any("assembled anew" in event.text for event in run.events) or not run.good.all():
            return None
        there[k] = np.stack([run.values, run.rates])
    tenth, eighth = (
        sum(weight * (there[k] - there[-k]) for k, weight in enumerate(weights, start=1)) / h
        for weights in (TENTH, EIGHTH)
    )
    return tenth, np.abs(tenth - eighth) + 1e-14 * np.abs(there[0]) / h


def test_samples_one_by_one_equal_samples_as_arrays() -> None:
    for name in ("jansen_leg", "stephenson_six_bar"):  # the second has a block of more than two unknowns
        model = kinfmu.compile(with_open_lengths(kinfmu.load(name)))
        plan = model.plan
        assert name == "jansen_leg" or any(len(block.unknowns) > 2 for block in plan.blocks)
        t = np.linspace(0.0, plan.mechanism.run.stop, 40)
        whole = model.sensitivities(t)
        one = model.sensitivities(t[7:9])
        scale = np.abs(whole.rates_by).max()
        np.testing.assert_allclose(one.values_by, whole.values_by[7:9], rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(one.rates_by, whole.rates_by[7:9], rtol=0, atol=1e-11 * scale)
        np.testing.assert_array_equal(whole.values, model.solve(t).values)


@pytest.mark.parametrize("name", ["stephenson_six_bar", "cam_roller", "five_bar"])
@pytest.mark.few(1)
def test_native_and_python_engine_give_the_same(name: str) -> None:
    """Blocks of one and two unknowns, of more, and curves."""
    mechanism = with_open_lengths(kinfmu.load(name))
    t = np.linspace(0.0, 0.9 * mechanism.run.stop, 50)
    one, other = (kinfmu.compile(mechanism, engine=engine).sensitivities(t) for engine in ("python", "native"))
    np.testing.assert_array_equal(one.status, other.status)
    for mine, theirs in ((one.values_by, other.values_by), (one.rates_by, other.rates_by)):
        scale = np.maximum(1.0, np.abs(mine).max(axis=(0, 1)))
        assert (np.abs(mine - theirs) <= 1e-11 * scale).all()


def test_nothing_is_printed_before_it_is_asked_for_and_the_plan_stays_as_it_is() -> None:
    mechanism = with_open_lengths(kinfmu.load("watt_six_bar"))
    model = kinfmu.compile(mechanism)
    assert "_sensitivity_model" not in vars(model)
    model.sensitivities([0.1])
    untouched = compile_plan(mechanism)
    assert model.plan.text == untouched.text
    assert emit(model.plan) == emit(untouched)


def test_stages_have_only_what_their_outputs_need() -> None:
    plan = kinfmu.compile(linkage()).plan
    steps = sensitivity_steps(plan, ["crank.phi"], ["coupler"], by_law=False)
    assert steps.steps
    assert all(step.name.startswith("crank") for step in steps.steps)  # type: ignore[union-attr]
    assert load_stage(steps).places == (0, 1)


def test_a_model_of_few_outputs_gives_their_derivatives() -> None:
    """Its unknowns are not among its outputs; far from the world's origin no digits are lost."""
    whole = kinfmu.compile(linkage()).sensitivities(crank_angle=ANGLES)
    few = kinfmu.compile(linkage(), ["M.x"]).sensitivities(crank_angle=ANGLES)
    assert few.outputs == ("M.x",)
    for name in LENGTHS:
        np.testing.assert_allclose(few.of("M.x", name), whole.of("M.x", name), rtol=1e-12)
    q = oracle.fourbar(**LENGTHS, u=[1.0]).rounded().q[0]
    far = kinfmu.compile(started(LENGTHS, 1.0, q, (1e6, 2e6)))
    assert far.plan.origin != (0.0, 0.0)
    found = far.sensitivities(crank_angle=ANGLES)
    for name in LENGTHS:
        np.testing.assert_allclose(found.of("M.x", name), whole.of("M.x", name), rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.rate_of("M.x", name), whole.rate_of("M.x", name), rtol=0, atol=1e-12)


def test_samples_that_are_not_reached_are_nan() -> None:
    model = kinfmu.compile(linkage({**LENGTHS, "crank": 3.2}))
    found = model.sensitivities(crank_angle=np.linspace(1.0, 4.0, 30))
    good = found.status < 2
    assert 0 < good.sum() < 30
    assert np.isfinite(found.values_by[good]).all()
    assert np.isfinite(found.rates_by[good]).all()
    assert np.isnan(found.values_by[~good]).all()
    assert np.isnan(found.rates[~good]).all()


def test_a_model_from_another_process_gives_the_same() -> None:
    model = kinfmu.compile(linkage())
    model.sensitivities(crank_angle=ANGLES)
    other = pickle.loads(pickle.dumps(model))  # noqa: S301
    np.testing.assert_array_equal(
        model.sensitivities(crank_angle=ANGLES).values_by, other.sensitivities(crank_angle=ANGLES).values_by
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"wrt": ["couplr"]}, "wrt: 'couplr' is not known; did you mean 'coupler'?"),
        ({"wrt": "coupler"}, "wrt: 'coupler' must be a list of names"),
        ({"outputs": ["M.z"]}, "outputs: 'M.z' is not known"),
        (
            {"wrt": ["crank.speed"], "crank_angle": [1.0]},
            "wrt: 'crank.speed' is a law constant, which acts over time; give t in place of driver values",
        ),
        ({"parameters": {"couplr": 1.0}}, "there is no parameter 'couplr'; did you mean 'coupler'?"),
    ],
)
@pytest.mark.few(2)
def test_what_is_not_known_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(RequestError, match=re.escape(message)):
        kinfmu.compile(linkage()).sensitivities(**arguments)


def test_a_parameter_that_is_not_open_is_refused_with_how_to_open_it() -> None:
    model = kinfmu.compile(linkage(), parameters=["coupler"])
    with pytest.raises(RequestError, match=re.escape("compile(mechanism, parameters=['rocker']) makes it an argument")):
        model.sensitivities(wrt=["rocker"])
    assert model.sensitivities(crank_angle=ANGLES).parameters == ("coupler",)


def test_an_argument_written_as_an_expression_follows_unless_given() -> None:
    mechanism = linkage({**LENGTHS, "rocker": "0.75*ground"})
    model = kinfmu.compile(mechanism, parameters=["ground", "rocker"])
    every = kinfmu.compile(linkage()).sensitivities(crank_angle=ANGLES, parameters={"rocker": 3.0})
    follows = model.sensitivities(crank_angle=ANGLES)
    given = model.sensitivities(crank_angle=ANGLES, parameters={"rocker": 3.0})
    for output in ("coupler.phi", "M.x"):
        both = every.of(output, "ground") + 0.75 * every.of(output, "rocker")
        np.testing.assert_allclose(follows.of(output, "ground"), both, rtol=0, atol=1e-13)
        np.testing.assert_allclose(given.of(output, "ground"), every.of(output, "ground"), rtol=0, atol=1e-13)
        np.testing.assert_allclose(follows.of(output, "rocker"), every.of(output, "rocker"), rtol=0, atol=1e-13)


def test_a_model_without_parameters_is_reported() -> None:
    with pytest.raises(RequestError, match="the model has no parameters"):
        kinfmu.compile(kinfmu.load("fourbar")).sensitivities(crank_angle=ANGLES)


def test_an_unknown_name_is_reported_with_those_that_are_known() -> None:
    found = kinfmu.compile(kinfmu.load("jansen_leg"), ["foot.x"]).sensitivities([0.0, 0.1], wrt=["a", "b"])
    with pytest.raises(RequestError, match=r"the sensitivities have no output 'foot\.y'.*; outputs: foot\.x$"):
        found.of("foot.y", "a")
    with pytest.raises(RequestError, match=r"the sensitivities have no parameter 'c'.*; parameters: a, b$"):
        found.rate_of("foot.x", "c")
