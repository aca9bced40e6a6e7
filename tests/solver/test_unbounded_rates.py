"""Places where rates have no bound, and change points that lengths miss: estimates and status report them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from fmpy import read_model_description

import kinfmu
from kinfmu import Body, ConstantSpeed, DistanceDriver, Mechanism, Revolute
from kinfmu.errors import AssemblyError, RequestError
from kinfmu.solver.python.pose import Status
from tests import oracle
from tests.fmu.host import DISCARD, OK, Host
from tests.mechanisms import fourbar

ENGINES = ("python", "native")


def cylinder(arm: float, start: float = 0.5) -> Mechanism:
    """An arm about O, moved by a cylinder from a pivot at distance 1 to its end."""
    phi = math.acos((1.0 + arm * arm - start * start) / (2.0 * arm))
    return Mechanism(
        "cylinder",
        [
            Body("ground", {"O": (0.0, 0.0), "C": (1.0, 0.0)}),
            Body("arm", {"O": (0.0, 0.0), "P": (arm, 0.0)}, (0, 0, phi)),
        ],
        [Revolute("O", ("ground.O", "arm.O"))],
        [DistanceDriver("cylinder", ("ground.C", "arm.P"), ConstantSpeed(start, 1.0))],
    )


def exact_arm(arm: float, length: float) -> tuple[mp.mpf, mp.mpf, mp.mpf] | None:
    """The arm's angle with its derivatives over the length by the law of cosines; None where there is no pose."""
    with mp.workdps(50):
        r, u = mp.mpf(arm), mp.mpf(length)
        cosine = (1 + r * r - u * u) / (2 * r)
        if abs(cosine) > 1:
            return None
        if abs(cosine) == 1:  # no rate has a bound
            return mp.acos(cosine), mp.inf, mp.inf
        phi = mp.acos(cosine)
        first = u / (r * mp.sin(phi))
        return phi, first, (1 / r - mp.cos(phi) * first**2) / mp.sin(phi)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("arm", [1.0 + 1e-7, 1.0 - 3e-8, 1.0 + 1e-4, 0.7, 0.5, 1.75])
@pytest.mark.few(3)
def test_close_to_the_shortest_and_longest_reach_of_a_cylinder_estimates_hold(engine: str, arm: float) -> None:
    shortest, longest = abs(1.0 - arm), 1.0 + arm
    near = [0.0, 1e-17, 1e-15, 1e-13, 1e-10, 1e-7, 5e-8, 1e-4]
    lengths = [0.5 * (shortest + longest), *(shortest + x for x in near), *(longest - x for x in near)]
    lengths += [0.5 * shortest, 0.0, longest + 1e-9]
    run = kinfmu.solve(cylinder(arm, lengths[0]), engine=engine, cylinder_length=lengths)
    for k, length in enumerate(lengths):
        exact = exact_arm(arm, length)
        if run.status[k] > 2:
            assert exact is None or min(length - shortest, longest - length) < 1e-14, length
            continue
        assert exact is not None, length
        found = run["arm.phi"][k], run["arm.omega"][k], run["arm.alpha"][k]
        for value, wanted, error in zip(found, exact, run.error[k], strict=True):
            assert abs(value - wanted) <= error, (length, value)
        if min(length - shortest, longest - length) < 1e-6:
            assert run.status[k] == 1


@pytest.mark.parametrize("engine", ENGINES)
def test_a_cylinder_whose_length_passes_zero_exactly_ends_there(engine: str) -> None:
    """Arm and pivots are equal, so the arm reaches length 0, smoothly; below there is no length."""
    lengths = [0.5, 1e-3, 2e-7, 0.0, -1e-9, -0.5, 0.5]
    run = kinfmu.solve(cylinder(1.0), engine=engine, cylinder_length=lengths)
    assert (run.status <= 2).tolist() == [True, True, True, True, False, False, True]
    assert run["arm.phi"][:4] == pytest.approx([2.0 * math.asin(0.5 * length) for length in lengths[:4]], abs=1e-13)
    assert "cylinder = -1e-09 m: a distance cannot be negative" in [event.text for event in run.events]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_negative_distance_is_refused_among_many_samples(engine: str) -> None:
    lengths = np.linspace(0.9, -0.3, 1201)
    run = kinfmu.solve(cylinder(1.0), engine=engine, cylinder_length=lengths)
    assert ((run.status <= 2) == (lengths >= 0.0)).all()


def test_a_start_at_a_negative_distance_is_refused() -> None:
    mechanism = cylinder(0.7)
    law = ConstantSpeed(-0.5, 1.0)
    drivers = [DistanceDriver("cylinder", ("ground.C", "arm.P"), law)]
    started = [mechanism.bodies[0], Body("arm", {"O": (0.0, 0.0), "P": (0.7, 0.0)}, (0.0, 0.0, None))]
    with pytest.raises(AssemblyError, match=r"\[drivers.cylinder\] starts at a length of -0.5 m; a distance cannot be"):
        kinfmu.solve(Mechanism("m", started, mechanism.joints, drivers), [0.0])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("miss", [8e-13, -8e-13, 1e-13, -1e-13])
@pytest.mark.few(3)
def test_a_change_point_that_lengths_miss_counts_in_the_estimate(engine: str, miss: float) -> None:
    """Oracle: the closed form in 50 digits, where the loop with these very lengths closes."""
    rocker = 1.0 + miss
    mechanism = fourbar(2.0, 1.0, 2.0, rocker, start=1.0)
    angles = [math.pi - x for x in (4e-2, 1e-2, 1e-3, 1e-4, 1e-5, 3e-6)] + [math.pi]
    run = kinfmu.solve(mechanism, engine=engine, crank_angle=angles)
    assert (run.status == 2).all()
    checked = 0
    for k, angle in enumerate(angles):
        try:
            exact = oracle.fourbar(2.0, 1.0, 2.0, rocker, [angle], 1.0, 0.0, branch=1)
        except ValueError:  # the loop does not close there
            continue
        for order, suffix in enumerate(("phi", "omega", "alpha")):
            found = [run[f"{body}.{suffix}"][k] for body in ("crank", "coupler", "rocker")]
            off = [abs(a - b) for a, b in zip(found, exact[order][0], strict=True)]
            assert max(off) <= run.error[k, order], (angle, suffix)
        checked += 1
    assert checked >= 5
    assert run.error[-1, 0] > 0.3 * math.sqrt(abs(miss))


@pytest.mark.parametrize("engine", ENGINES)
def test_an_exact_change_point_keeps_its_small_estimate(engine: str) -> None:
    run = kinfmu.solve(fourbar(2.0, 1.0, 2.0, 1.0, start=1.0), engine=engine, crank_angle=[math.pi - 1e-3, math.pi])
    assert run.error.max() < 1e-10


@pytest.mark.parametrize("engine", ENGINES)
def test_a_speed_whose_square_no_float_holds_is_refused(engine: str) -> None:
    mechanism = kinfmu.load("crank_rocker")
    with pytest.raises(RequestError, match=r"^crank_speed = 1e\+155 at sample 1: the largest value is 1e\+100$"):
        kinfmu.solve(mechanism, engine=engine, crank_angle=[1.0, 1.1], crank_speed=[1.0, 1e155])
    assert np.isfinite(kinfmu.solve(mechanism, engine=engine, crank_angle=[1.0], crank_speed=1e99).accelerations).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_estimates_of_rates_are_for_the_driver_values_and_do_not_count_their_rounding(
    engine: str,
) -> None:
    """As docs/accuracy.md states. Oracle: the closed form in 50 digits at the exact angle of the law."""
    lengths, start, speed, angle = (2.0, 0.7, 1.9, 1.5), 0.3, 0.7, 1e4
    mechanism = fourbar(*lengths)
    law = replace(mechanism.drivers[0], law=ConstantSpeed(start, speed))
    times = [0.0, *(angle / speed + 0.9 * k + 0.0137 * k * k for k in range(5))]
    run = kinfmu.solve(replace(mechanism, drivers=(law,)), times, engine=engine)
    branch = 1 if run["coupler.phi"][0] > 0.0 else -1
    worst = {"exact": [0.0, 0.0], "rounded": [0.0, 0.0]}  # of the estimates, by order
    for k, t in enumerate(times[1:], start=1):
        with mp.workdps(50):
            places = {"exact": mp.mpf(start) + mp.mpf(speed) * mp.mpf(t), "rounded": mp.mpf(float(run["crank.phi"][k]))}
            for kind, place in places.items():
                motion = oracle.fourbar(*lengths, [place], speed, 0.0, branch=branch)
                for order, suffix in enumerate(("phi", "omega")):
                    found = [mp.mpf(float(run[f"{body}.{suffix}"][k])) for body in ("crank", "coupler", "rocker")]
                    off = [abs(a - b) for a, b in zip(found, motion[order][0], strict=True)]
                    off = [abs(mp.sin(one)) for one in off] if order == 0 else off  # without turns
                    worst[kind][order] = max(worst[kind][order], float(max(off) / run.error[k, order]))
    assert max(*worst["rounded"], worst["exact"][0]) < 1.0
    speeds = worst["exact"][1] * run.error[1:, 1].max()
    assert run.error[1:, 1].max() < speeds < np.spacing(2.0 * angle)
    assert np.spacing(1e6) == pytest.approx(1e-10, rel=0.2)


FLAVOURS = [("python", 2), ("native", 2), ("native", 3)]


@pytest.fixture
def cylinder_fmu(fmu_of: Callable[..., Path]) -> Callable[[str, int], tuple[Path, float, float]]:
    """`cylinder_fmu(flavour, fmi)`: path of the FMU, and the declared shortest and longest length."""

    def get(flavour: str, fmi: int) -> tuple[Path, float, float]:
        path = fmu_of(cylinder(0.7), flavour, fmi, "inputs")
        variables = read_model_description(str(path)).modelVariables
        (length,) = [one for one in variables if one.name == "cylinder_length"]
        return path, float(length.min), float(length.max)

    return get


@pytest.mark.parametrize(("flavour", "fmi"), FLAVOURS)
@pytest.mark.few(1)
def test_in_fmus_estimates_hold_at_the_longest_reach_that_is_declared(
    flavour: str, fmi: int, cylinder_fmu: Callable[[str, int], tuple[Path, float, float]], opened: Callable[..., Host]
) -> None:
    """At the first sample as at a later one."""
    path, _, longest = cylinder_fmu(flavour, fmi)
    at_longest = {"cylinder_length": longest, "cylinder_speed": 1.0}
    exact = exact_arm(0.7, longest)
    for is_first in (True, False):
        host = opened(path)
        host.set(at_longest if is_first else {"cylinder_length": 1.0, "cylinder_speed": 1.0})
        host.initialize(0.0)
        host.set(at_longest)
        assert host.status() == 1
        values, errors = host.get("arm.phi", "arm.omega"), host.get("solver.error_q", "solver.error_qd")
        bounds = [
            abs(value - wanted) <= error for value, wanted, error in zip(values, exact or (), errors, strict=False)
        ]
        assert bounds == [True, True]


@pytest.mark.parametrize(("flavour", "fmi"), FLAVOURS)
@pytest.mark.parametrize("has_moved", [False, True])
@pytest.mark.few(3)
def test_in_fmus_a_cylinder_beyond_its_declared_range_is_outside(
    flavour: str,
    fmi: int,
    has_moved: bool,
    cylinder_fmu: Callable[[str, int], tuple[Path, float, float]],
    opened: Callable[..., Host],
) -> None:
    """At the declared ends, and 1e-9 within, it is near_singular; beyond there is no pose, from far and from near."""
    path, shortest, longest = cylinder_fmu(flavour, fmi)
    host = opened(path)
    host.initialize(0.0)
    time = 0.0
    for end, sign in ((shortest, -1.0), (longest, 1.0)):
        if has_moved:
            for inside in (1e-2, 1e-6):
                host.set({"cylinder_length": end - sign * inside})
                assert host.step(time, 0.1) == OK
                time += 0.1
        for beyond in (-1e-9, 0.0):
            host.set({"cylinder_length": end + sign * beyond})
            assert host.status() == Status.NEAR_SINGULAR, beyond
            assert host.get("arm.phi") == pytest.approx([0.0 if sign < 0.0 else math.pi], abs=2e-4)
        for beyond in (3e-12, 1e-9, 1e-6, 1e-2, 10.0):
            host.set({"cylinder_length": end + sign * beyond})
            assert host.status() == Status.OUTSIDE, beyond
            assert host.step(time, 0.1) == DISCARD
        host.set({"cylinder_length": end - sign * 1e-2})
        assert host.status() == Status.OK
        assert host.step(time, 0.1) == OK
        time += 0.1
