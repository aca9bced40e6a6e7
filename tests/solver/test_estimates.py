"""Error estimates: at least the true error in 99 % of random samples, and not far more than it in the median."""

from __future__ import annotations

import math
import pickle
from fractions import Fraction

import numpy as np
import pytest

import kinfmu
from kinfmu import Body, Point, Run
from kinfmu.solver.python import Pose, Solver, Status
from tests.error_estimates import FAMILIES, ORDERS, Number, measured, statistics
from tests.mechanisms import fourbar as fourbar_of_bars

SEED = 1989
COUNTS = {"gallery": 15, "chains": 3, "parallel_chains": 2, "turned_far": 2}  # mechanisms drawn; six of the others


@pytest.fixture(scope="module")
def numbers() -> list[Number]:
    """Estimates compared with true errors, from every family of mechanisms."""
    return [number for name in FAMILIES for number in measured(name, SEED, COUNTS.get(name, 6))]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.few(1)
def test_the_estimate_is_at_least_the_error_in_99_percent_and_1000_times_too_large_at_most(
    numbers: list[Number], order: str
) -> None:
    result = statistics([number for number in numbers if number.order == order])
    assert result.count > 150
    assert result.coverage >= 0.99
    assert result.overestimation <= 1000.0


@pytest.mark.parametrize("order", ORDERS)
def test_along_a_chain_estimates_grow_no_faster_than_errors(numbers: list[Number], order: str) -> None:
    """Of 2 to 60 loops, each known to what the loops before it leave."""
    result = statistics([number for number in numbers if number.family == "chains" and number.order == order])
    assert result.coverage == 1.0
    assert result.overestimation <= 100.0


def test_every_kind_of_sample_is_among_them(numbers: list[Number]) -> None:
    assert {number.family for number in numbers} == set(FAMILIES)
    assert {number.status for number in numbers} == {Status.OK, Status.NEAR_SINGULAR, Status.BRIDGED}


def test_estimates_grow_toward_a_limit_as_errors_do() -> None:
    locked_at_90_degrees = fourbar_of_bars(4.0, 3.0, 2.5, 2.5)
    run = kinfmu.solve(locked_at_90_degrees, crank_angle=math.pi / 2 - np.logspace(-1, -9, 9))
    assert run.good.all()
    assert (np.diff(run.error, axis=0) > 0.0).all()
    growth = run.error[-1] / run.error[0]
    np.testing.assert_allclose(np.log10(growth), [4.0, 12.0, 20.0], atol=1.0)  # m^-1, m^-3, m^-5; m^2 is the way


def test_estimates_are_in_radians_and_sizes_whatever_the_unit_of_length() -> None:
    runs = [kinfmu.solve(_slider_crank(scale), crank_angle=[1.0, 2.0, 4.0], crank_speed=7.0) for scale in (1.0, 1e3)]
    np.testing.assert_allclose(runs[1].error, runs[0].error, rtol=0.5)


def test_they_grow_with_the_speed_and_with_its_square() -> None:
    mechanism = kinfmu.load("crank_rocker")
    slow, fast = (kinfmu.solve(mechanism, crank_angle=[2.0], crank_speed=speed) for speed in (1.0, 1000.0))
    np.testing.assert_allclose(fast.error / slow.error, [[1.0, 1e3, 1e6]], rtol=0.01)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("ratio", [7.3, -3.7])
@pytest.mark.few(2)
def test_rates_of_gears_are_estimated_by_their_own_size(engine: str, ratio: float) -> None:
    """A train that only speeds up: its last gear turns up to ratio^2 times as fast as the driver."""
    names = ["first", "second", "third"]
    ground = Body("ground", {name: Point(float(k), 0.0) for k, name in enumerate(names)})
    mechanism = kinfmu.Mechanism(
        "train",
        (ground, *(Body(name, {"O": Point(0.0, 0.0)}) for name in names)),
        (
            *(kinfmu.Revolute(f"pin_{name}", (f"ground.{name}", f"{name}.O")) for name in names),
            kinfmu.Gear("low", ("first", "second"), ratio),
            kinfmu.Gear("high", ("second", "third"), ratio),
        ),
        (kinfmu.AngleDriver("motor", "first"),),
    )
    rng = np.random.default_rng(7)
    u, v, a = rng.uniform(-3.0, 3.0, (3, 200))
    run = kinfmu.solve(mechanism, engine=engine, motor_angle=u, motor_speed=v, motor_acceleration=a)
    exact = [[Fraction(ratio) ** 2 * Fraction(x) for x in column.tolist()] for column in (u, v, a)]
    found = [run["third.phi"], run["third.omega"], run["third.alpha"]]
    for order in range(3):
        errors = [abs(float(Fraction(x) - true)) for x, true in zip(found[order].tolist(), exact[order], strict=True)]
        assert max(errors) > 0.0
        assert (errors <= run.error[:, order]).all()
        assert (run.error[:, order] <= 1e-13).all()


def test_nothing_is_estimated_before_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def counting(name: str) -> None:
        compute = getattr(Solver, name)

        def counted(*args: object) -> object:
            read.append(name)
            return compute(*args)

        monkeypatch.setattr(Solver, name, counted)

    counting("errors")
    counting("margin")
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=[1.0, 2.0])
    assert run["coupler.x"].shape == (2,)
    assert not read
    assert run.error.shape == (2, 3)
    assert read == ["errors"] * 2
    assert run.margin.shape == (2,)
    assert run.error is run.error
    assert read == ["errors"] * 2 + ["margin"] * 2


def test_a_run_that_travels_has_its_estimates_with_it() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=[1.0, np.pi])
    there: Run = pickle.loads(pickle.dumps(run))  # noqa: S301
    np.testing.assert_array_equal(there.error, run.error)
    np.testing.assert_array_equal(there.margin, run.margin)
    assert there.mechanism == run.mechanism


def test_a_run_has_the_estimates_of_its_poses(fourbar: Solver) -> None:
    angles = [1.0, 3.1, np.pi, 3.3]
    run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=angles, outputs=list(fourbar.model.OUTPUTS))
    pose = fourbar.anchor
    for k, angle in enumerate(angles):
        pose = fourbar.solve(pose, (angle,))
        assert tuple(run.error[k]) == fourbar.errors(pose, (1.0,), (0.0,))
        assert run.margin[k] == fourbar.margin(pose)
    assert set(run.status) == {Status.OK, Status.BRIDGED}


def test_an_unknown_error_is_infinite(fourbar: Solver) -> None:
    pose = fourbar.solve(fourbar.anchor, (1.0,))
    flat = Pose((0.0,), fourbar.model.position((0.0,), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), -0.0, -1))
    flat.tangent = fourbar.model.tangent(pose.values)
    assert fourbar.errors(flat, (1.0,), (0.0,)) == (np.inf,) * 3


def _slider_crank(scale: float) -> kinfmu.Mechanism:
    return kinfmu.Mechanism(
        "slider_crank",
        [
            kinfmu.Body("ground", {"O": (0, 0), "way": (0, 0)}),
            kinfmu.Body("crank", {"O": (0, 0), "P": (scale, 0)}, (0, 0, 1.0)),
            kinfmu.Body("rod", {"P": (0, 0), "S": (3 * scale, 0)}, (0.54 * scale, 0.84 * scale, -0.28)),
            kinfmu.Body("block", {"S": (0, 0)}, (3.42 * scale, 0, 0)),
        ],
        [
            kinfmu.Revolute("O", ("ground.O", "crank.O")),
            kinfmu.Revolute("P", ("crank.P", "rod.P")),
            kinfmu.Revolute("S", ("rod.S", "block.S")),
            kinfmu.Translational("slide", ("ground.way", "block.S")),
        ],
        [kinfmu.AngleDriver("crank", "crank", kinfmu.ConstantSpeed(1.0, 1.0))],
    )
