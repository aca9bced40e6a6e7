"""Constants of the laws of loads, set like those of drivers: forces by closed forms, both engines, FMUs, messages."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Cycloidal, ForceAlong, Mechanism, Revolute, TorqueOn
from kinfmu.cli.group import main
from kinfmu.errors import RequestError
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.measures import Range
from kinfmu.mechanism.quantities import AngleBetween
from tests.fmu.host import OK, Host

G, MASS, LENGTH = 9.81, 2.0, 0.5  # [m/s2, kg, m]
WRITTEN = {
    "gas.start": 3.0,
    "gas.speed": 0.5,
    "push.rise": 4.0,
    "push.duration": 0.5,
    "push.begin": 0.2,
    "push.start": 0.0,
}
CHANGED = {
    "gas.start": -6.0,
    "gas.speed": 2.0,
    "push.rise": 7.0,
    "push.duration": 0.4,
    "push.begin": 0.35,
    "push.start": -1.5,
}
FLAVOURS = [("native", 2), ("native", 3), ("python", 2)]
of_each_flavour = pytest.mark.parametrize(("flavour", "fmi"), FLAVOURS)


def pendulum() -> Mechanism:
    """A point mass on a rod, pushed over time and loaded by a vertical force over its angle."""
    return Mechanism(
        "pendulum",
        [
            Body("ground", {"O": (0, 0)}),
            Body("rod", {"O": (0, 0), "T": (LENGTH, 0)}, (0, 0, 0), mass=MASS, center_of_mass=(LENGTH, 0)),
        ],
        [Revolute("O", ("ground.O", "rod.O"))],
        [AngleDriver("crank", "rod", ConstantSpeed(0.3, 2.0))],
        gravity=(0, -G),
        loads=(
            ForceAlong("gas", "rod.T", ConstantSpeed(3.0, 0.5), math.pi / 2, over=AngleBetween("rod", "ground")),
            TorqueOn("push", "rod", Cycloidal(rise=4.0, duration=0.5, begin=0.2)),
            TorqueOn("wind", "rod", External()),
        ),
        measures=(Range("spread", "crank.torque"),),
    )


def torque(t: float, u: float, constants: dict[str, float]) -> float:
    """The torque of the drive at constant speed: virtual work, by hand."""
    x = min(max((t - constants["push.begin"]) / constants["push.duration"], 0.0), 1.0)
    push = constants["push.start"] + constants["push.rise"] * (x - math.sin(2.0 * math.pi * x) / (2.0 * math.pi))
    gas = constants["gas.start"] + constants["gas.speed"] * u
    return (MASS * G - gas) * LENGTH * math.cos(u) - push


def assert_torque(run: kinfmu.Run, constants: dict[str, float]) -> None:
    found = [torque(t, u, constants) for t, u in zip(run.t, run["crank_angle"], strict=True)]
    np.testing.assert_allclose(run["crank.torque"], found, rtol=0, atol=1e-13 * MASS * G)
    assert np.ptp(run["crank.torque"]) > 1.0  # the test can fail


@pytest.mark.parametrize("engine", ["python", "native"])
def test_forces_follow_the_constants(engine: str) -> None:
    t = np.linspace(0.0, 1.0, 41)
    assert_torque(kinfmu.solve(pendulum(), t, engine=engine), WRITTEN)
    model = kinfmu.compile(pendulum(), engine=engine)
    some = {"push.rise": CHANGED["push.rise"]}
    for given in (CHANGED, {}, some):
        run = model.solve(t, parameters=given)
        assert_torque(run, WRITTEN | given)
        assert run.good.all()
        assert run.mechanism is not None
        assert {one.name: one.value for one in run.mechanism.load_constants} == WRITTEN | given
        assert run.info["push.rise"] == repr((WRITTEN | given)["push.rise"])
    with_units = model.solve(t, parameters={"push.duration": "400 ms", "push.rise": "7000 N mm"})
    assert_torque(with_units, WRITTEN | {"push.duration": 0.4, "push.rise": 7.0})
    assert_torque(kinfmu.solve(pendulum().with_parameters(CHANGED), t, engine=engine), CHANGED)


def test_batches_take_arrays_of_them() -> None:
    t, rises = np.linspace(0.0, 1.0, 81), np.array([0.0, 4.0, 9.0])
    model = kinfmu.compile(pendulum())
    table = kinfmu.measure_designs(model, {"gas.start": 1.5, "push.rise": rises}, t=t)
    for k, rise in enumerate(rises):
        changed = kinfmu.measure(kinfmu.solve(pendulum().with_parameters({"gas.start": 1.5, "push.rise": rise}), t))
        assert table["spread"][k] == pytest.approx(changed["spread"].value, abs=1e-12)
    assert len(set(table["spread"])) == 3
    designs = model.solve_designs({"push.duration": np.array([0.5, 0.0])}, t)
    assert designs.good.all(axis=1).tolist() == [True, False]
    assert "push.duration = 0.0 must be positive" in designs.reasons[1]


@of_each_flavour
@pytest.mark.few(1)
def test_an_fmu_has_them_as_tunable_parameters(
    fmu_of: Callable[..., Path], flavour: str, fmi: int, opened: Callable[..., Host]
) -> None:
    path = fmu_of(pendulum(), flavour, fmi, "time")
    assert_torque(kinfmu.simulate(path), WRITTEN)
    run = kinfmu.simulate(path, parameters=CHANGED)
    assert_torque(run, CHANGED)
    assert "push.rise" not in run.force_names
    host = opened(path)
    variables = {variable.name: variable for variable in host.about.interface}
    assert [variables[name].variability for name in WRITTEN] == ["tunable"] * 6
    assert (variables["push.rise"].unit, variables["push.begin"].unit) == ("N m", "s")
    assert set(WRITTEN) <= set(variables["crank.torque"].initial_dependencies or ())
    assert not set(WRITTEN) & set(variables["rod.phi"].initial_dependencies or ())
    host.initialize(0.0)
    assert host.step(0.0, 0.5) == OK
    host.set(CHANGED)  # they may change between steps
    (found,) = host.get("crank.torque")
    assert found == pytest.approx(torque(0.5, 1.3, CHANGED), abs=1e-12)
    refusal = host.refusal({"push.duration": 0.0})
    assert re.fullmatch(r"push\.duration = 0(\.0)? must be positive; 0\.4\d* stays", refusal)
    if flavour == "native" and fmi == 3:
        h = 1e-6
        for name, value in CHANGED.items():
            (slope,) = host.slopes(["crank.torque"], [name], [1.0])
            high, low = (torque(0.5, 1.3, CHANGED | {name: value + by}) for by in (h, -h))
            assert slope == pytest.approx((high - low) / (2.0 * h), abs=1e-6)


def driven_by_push(t: float, begin: float, duration: float, rise: float) -> tuple[float, float]:
    """Angle and speed from rest under the push alone, over the inertia: integrals of the cycloidal rise."""
    x, after = min(max((t - begin) / duration, 0.0), 1.0), max(t - begin - duration, 0.0)
    turn = 2.0 * math.pi
    speed = rise * duration * (x * x / 2.0 + (math.cos(turn * x) - 1.0) / turn**2)
    angle = rise * duration**2 * (x**3 / 6.0 + math.sin(turn * x) / turn**3 - x / turn**2)
    inertia = MASS * LENGTH**2
    return (angle + speed * after + rise * after * after / 2.0) / inertia, (speed + rise * after) / inertia


@of_each_flavour
@pytest.mark.few(1)
def test_fmus_driven_by_torques_keep_them(fmu_of: Callable[..., Path], flavour: str, fmi: int) -> None:
    weightless = {"gas.start": MASS * G, "gas.speed": 0.0}  # the force carries the mass
    path = fmu_of(pendulum(), flavour, fmi, "torque")
    for push in ({}, {"push.rise": -2.0, "push.duration": 0.31, "push.begin": 0.123}):
        parameters = weightless | push | {"integrator.tolerance": 1e-12}
        run = kinfmu.simulate(path, start=0.0, stop=1.0, step=0.25, parameters=parameters, state={"crank_speed": 0.0})
        values = WRITTEN | push
        wanted = driven_by_push(1.0, values["push.begin"], values["push.duration"], values["push.rise"])
        assert run["crank_angle"][-1] - run["crank_angle"][0] == pytest.approx(wanted[0], abs=1e-10)
        assert run["crank_speed"][-1] == pytest.approx(wanted[1], abs=1e-10)
        same = kinfmu.simulate(
            pendulum(),
            drive="torque",
            start=0.0,
            stop=1.0,
            step=0.25,
            parameters=weightless | push,
            tolerance=1e-12,
            state={"crank_speed": 0.0},
        )
        np.testing.assert_allclose(run["crank_speed"], same["crank_speed"], rtol=0, atol=1e-9)


def test_mistakes_have_messages(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match=re.escape("there is no parameter 'push.rize'; did you mean 'push.rise'?")):
        kinfmu.solve(pendulum(), parameters={"push.rize": 1.0})
    with pytest.raises(RequestError, match=re.escape("push.rise = '2 mm': unit 'mm' must be one of N m")):
        kinfmu.solve(pendulum(), parameters={"push.rise": "2 mm"})
    with pytest.raises(RequestError, match=re.escape("push.duration = 0.0 must be positive")):
        kinfmu.compile(pendulum()).solve(parameters={"push.duration": 0.0})
    file = tmp_path / "pendulum.toml"
    kinfmu.save(pendulum(), file)
    written = file.read_text().replace("rise = 4.0", 'rise = "2*pull"') + '\n[parameters]\npull = "2 N m"\n'
    file.write_text(written)
    with pytest.raises(RequestError, match=re.escape("push.rise follows from '2*pull'; set the parameters in it")):
        kinfmu.solve(kinfmu.load(file), parameters={"push.rise": 1.0})
    assert_torque(
        kinfmu.solve(kinfmu.load(file), np.linspace(0, 1, 9), parameters={"pull": 3.5}), WRITTEN | {"push.rise": 7.0}
    )
    result = CliRunner().invoke(
        main, ["solve", str(file), "-o", str(tmp_path / "a.csv"), "--angle", "0:1:5", "--set", "gas.start=-6N"]
    )
    assert result.exit_code == 0, result.output  # the law of a load acts though driver values are given


def test_poses_do_not_depend_on_them() -> None:
    found = kinfmu.compile(pendulum()).sensitivities([0.0, 0.4], wrt=["push.rise", "crank.speed"])
    assert found.values_by[:, 0, :].tolist() == [[0.0, 0.0], [0.0, 0.4]]
