"""Forces as outputs of FMUs: equal to those of runs, with exact dependencies, lazy, and part of the protocol."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.codegen.forces import STAGES
from kinfmu.errors import RequestError
from kinfmu.fmu.description import read
from kinfmu.fmu.interface import Variable
from kinfmu.fmu.unpacked import text_in, unpacked
from kinfmu.mechanism import toml_file
from tests.fmu.host import DISCARD, OK, Host, answer
from tests.gallery_members import mostly_long
from tests.run.test_forces import MEETING, MET, loaded, met
from tests.run.test_reactions import LOCOMOTIVE, coupled

FLAVOURS = [("python", 2), ("native", 2), ("native", 3)]
of_each_flavour = pytest.mark.parametrize(("flavour", "fmi"), FLAVOURS)
PRESS = """
name = "press"
[parameters]
ram_mass = "3 kg"
[units]
length = "mm"
[run]
start = 0
stop = 1
step = 0.01
[gravity]
x = 0
y = "-9.81 m/s2"
[bodies.ground]
points = { O = [0, 0], spring = [500, 40] }
[bodies.crank]
points = { O = [0, 0], P = [100, 0] }
start = { x = 0, y = 0, phi = "40 deg" }
mass = 1.5
center_of_mass = [30, 5]
inertia = "0.01 kg m2"
[bodies.rod]
points = { P = [0, 0], S = [300, 0] }
start = { phi = "-10 deg" }
mass = "0.8 kg"
rod = ["P", "S"]
[bodies.ram]
points = { S = [0, 0] }
start = { x = 380, y = 0, phi = 0 }
mass = "ram_mass"
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
S = { type = "revolute", between = ["rod.S", "ram.S"] }
guide = { type = "translational", between = ["ground.O", "ram.S"] }
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
start = "10 deg"
speed = "250 deg/s"
[loads.work]
type = "force_along"
at = "ram.S"
law = "external"
[loads.return]
type = "spring"
between = ["ground.spring", "ram.S"]
stiffness = "2 N/mm"
free_length = 150
[loads.oil]
type = "damper"
between = ["ground.spring", "ram.S"]
damping = "20 N s/m"
[loads.ramp]
type = "torque"
on = "rod"
law = "constant_speed"
start = 1
speed = 2
"""


@cache
def press() -> Mechanism:
    return toml_file.parse(PRESS, "press")


@pytest.fixture
def start(fmu_of: Callable[..., Path], opened: Callable[..., Host]) -> Callable[..., Host]:
    """`start(flavour, fmi)`: a slave of the press that inputs drive, initialized at 0."""

    def get(flavour: str, fmi: int, angle: float = 0.7) -> Host:
        host = opened(fmu_of(press(), flavour, fmi, "inputs"))
        host.set({"rates": 2, "crank_angle": angle})
        host.initialize(0.0)
        return host

    return get


def force_outputs(host: Host) -> tuple[Variable, ...]:
    """All outputs that are forces: efforts and energies, reactions, shaking force and moment."""
    return tuple(variable for stage in STAGES for variable in host.about.interface.part(stage))


def assert_forces_equal(run: kinfmu.Run, reference: kinfmu.Run) -> None:
    determined = [name for name in reference.reaction_names if not np.isnan(reference[name]).all()]
    assert list(run.reaction_names) == determined
    for name in determined:
        largest = np.nanmax(np.abs(reference[name]))
        np.testing.assert_allclose(run[name], reference[name], rtol=0, atol=1e-12 * (1.0 + largest))
    assert run.force_names == reference.force_names
    assert run.force_names
    assert np.isfinite(reference.forces).all(axis=1).tolist() == run.good.tolist()
    largest = np.abs(reference.forces).max(axis=0)
    assert np.nanmax(np.abs(run.forces - reference.forces) / (1.0 + largest)) < 1e-12


@of_each_flavour
@pytest.mark.parametrize("name", mostly_long(["fourbar", "five_bar", "excavator"], few=("excavator",)))
@pytest.mark.few(1)
def test_forces_equal_those_of_a_run(fmu_of: Callable[..., Path], flavour: str, fmi: int, name: str) -> None:
    mechanism = loaded(name)
    run = kinfmu.simulate(fmu_of(mechanism, flavour, fmi))
    assert_forces_equal(run, kinfmu.solve(mechanism, run.t))


@of_each_flavour
@pytest.mark.few(1)
def test_external_loads_laws_over_time_and_masses_equal_those_of_a_run(
    fmu_of: Callable[..., Path], flavour: str, fmi: int
) -> None:
    t = np.linspace(0.0, 1.0, 41)
    force = -200.0 * (1.0 + np.sin(9.0 * t))
    run = kinfmu.simulate(
        fmu_of(press(), flavour, fmi),
        inputs={"time": t, "work_force": force},
        step=t[1],
        parameters={"ram_mass": "4.5 kg"},
    )
    np.testing.assert_allclose(run.t, t, atol=1e-12)
    reference = kinfmu.compile(press()).solve(run.t, parameters={"ram_mass": 4.5}, work_force=force)
    assert_forces_equal(run, reference)


@of_each_flavour
@pytest.mark.few(1)
def test_declared_dependencies_are_those_that_count(start: Callable[..., Host], flavour: str, fmi: int) -> None:
    host = start(flavour, fmi)
    at = {"crank_angle": 0.7, "crank_speed": 3.0, "crank_acceleration": 20.0, "work_force": -150.0}
    forces = force_outputs(host)
    names = [variable.name for variable in forces]
    assert {"crank.torque", "guide.moment", "shaking_moment"} <= set(names)
    host.set(at)
    before = np.array(host.get(*names))
    for changed, value in at.items():
        host.set({changed: value * 1.01})
        change = np.abs(np.array(host.get(*names)) - before) / (1.0 + np.abs(before))
        host.set(at)
        for variable, difference in zip(forces, change, strict=True):
            assert (changed in (variable.dependencies or ())) == (difference > 1e-13), (variable.name, changed)
    units = {variable.name: variable.unit for variable in forces}
    assert units["crank.torque"] == units["crank.bias_torque"] == "N m"
    assert units["crank.reduced_inertia"] == "kg m2"
    assert (units["crank.power"], units["kinetic_energy"]) == ("W", "J")
    assert (units["O.force_x"], units["guide.moment"], units["shaking_moment"]) == ("N", "N m", "N m")


@of_each_flavour
def test_effort_is_reduced_inertia_times_acceleration_plus_bias(
    start: Callable[..., Host], flavour: str, fmi: int
) -> None:
    host = start(flavour, fmi)
    host.set({"crank_speed": 3.0, "crank_acceleration": 20.0, "work_force": -150.0})
    torque, bias, inertia, power = host.get("crank.torque", "crank.bias_torque", "crank.reduced_inertia", "crank.power")
    assert torque == pytest.approx(bias + inertia * 20.0, rel=1e-14)
    assert power == pytest.approx(torque * 3.0, rel=1e-14)
    host.set({"crank_acceleration": 0.0})
    assert host.get("crank.torque", "crank.bias_torque") == pytest.approx([bias, bias], rel=1e-13)


@of_each_flavour
def test_states_keep_external_loads_to_the_bit(start: Callable[..., Host], flavour: str, fmi: int) -> None:
    host = start(flavour, fmi)
    host.set({"crank_angle": 0.8, "crank_speed": 1.0, "work_force": -150.0})
    assert host.step(0.0, 0.1) == OK
    before = host.outputs()
    state = host.state()
    data = host.serialize(state)
    host.set({"crank_angle": 1.1, "work_force": 20.0})
    assert host.step(0.1, 0.1) == OK
    assert host.outputs() != before
    host.restore(state)
    assert host.outputs() == before
    assert host.get("work_force") == [-150.0]
    other = start(flavour, fmi)
    again = other.deserialize(data)
    other.restore(again)
    assert other.outputs() == before
    host.free_state(state)
    other.free_state(again)


@of_each_flavour
def test_a_load_that_is_no_number_is_refused(start: Callable[..., Host], flavour: str, fmi: int) -> None:
    host = start(flavour, fmi)
    host.set({"work_force": -150.0})
    text = host.refusal({"work_force": math.nan})
    assert re.fullmatch(r"work_force = nan is not a finite number; -150(\.0)? stays", text)
    assert host.get("work_force") == [-150.0]
    assert host.step_after_refusal(0.0, 0.1) == OK


def test_an_unreachable_sample_keeps_the_forces_of_the_last_good_one(
    fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    host = opened(fmu_of(loaded("triple_rocker"), "python", 2, "inputs"))
    name = host.about.interface.part("inputs")[0].name
    host.set({"rates": 2})
    host.initialize(0.0)
    assert host.step(0.0, 0.1) == OK
    before = host.get(*(variable.name for variable in host.about.interface.part("forces")))
    host.set({name: host.get(name)[0] + math.pi})
    assert host.status() > 2
    assert host.get(*(variable.name for variable in host.about.interface.part("forces"))) == before
    assert host.step(0.1, 0.1) == DISCARD


def test_a_native_fmu_discards_forces_of_an_unreachable_sample(
    fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    host = opened(fmu_of(loaded("triple_rocker"), "native", 2, "inputs"))
    name = host.about.interface.part("inputs")[0].name
    host.set({"rates": 2})
    host.initialize(0.0)
    host.set({name: host.get(name)[0] + math.pi})
    assert host.status() > 2
    assert answer(host.get, "potential_energy") == DISCARD


@pytest.mark.parametrize(
    ("flavour", "outputs", "stages"),
    [
        ("python", ["ram.x"], []),
        ("python", ["ram.x", "crank.torque"], ["forces"]),
        ("python", ["crank.torque"], ["forces"]),
        ("native", ["guide.moment", "shaking_moment"], ["reactions", "shaking"]),
    ],
)
@pytest.mark.few(2)
def test_outputs_choose_forces(flavour: str, outputs: Sequence[str], stages: Sequence[str], tmp_path: Path) -> None:
    """What no output asks for is not generated."""
    path = kinfmu.build(press(), tmp_path, flavour=flavour, outputs=outputs)
    with unpacked(path) as folder:
        interface = read(text_in(path, folder, "modelDescription.xml").encode(), str(path)).interface
        places = ("resources/*/solver/python/*.py", "sources/*.c")
        generated = {file.stem for place in places for file in folder.glob(place)}
    assert generated & set(STAGES) == set(stages)
    coordinates = [name for name in outputs if name == "ram.x"]
    assert [variable.name for variable in interface.part("values")] == coordinates
    found = [variable.name for stage in STAGES for variable in interface.part(stage)]
    assert found == [name for name in outputs if name not in coordinates]
    run = kinfmu.simulate(path)
    reference = kinfmu.solve(press(), run.t)
    for name in outputs:
        np.testing.assert_allclose(run[name], reference[name], rtol=0, atol=1e-11)


def test_outputs_that_an_fmu_cannot_have(tmp_path: Path) -> None:
    message = "outputs: 'crank.torqe' is not one; did you mean 'crank.torque'?"
    with pytest.raises(RequestError, match=re.escape(message)):
        kinfmu.build(press(), tmp_path, flavour="python", outputs=["ram.x", "crank.torqe"])
    message = "outputs: 'AB.force' is undetermined: rows AB.length, "
    with pytest.raises(RequestError, match=re.escape(message)):
        kinfmu.build(loaded("fourbar"), tmp_path, flavour="python", outputs=["AB.force"])


@pytest.mark.parametrize(("flavour", "fmi"), FLAVOURS[:2])
@pytest.mark.few(1)
def test_determined_reactions_of_redundant_rows_and_nan_on_a_bridge(
    flavour: str, fmi: int, fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    """Wheels whose rods are solved by least squares, and a parallelogram at its change point."""
    wheels = coupled(LOCOMOTIVE)
    path = fmu_of(wheels, flavour, fmi, "inputs")
    t = np.linspace(0.0, 1.0, 9)
    given = {"crank_angle": 5.0 * t, "crank_speed": 5.0 + 0.0 * t, "crank_acceleration": 0.0 * t}
    run = kinfmu.simulate(path, inputs={"time": t, **given}, step=t[1], parameters={"rates": 2})
    assert_forces_equal(run, kinfmu.solve(wheels, **given))
    assert set(run.reaction_names) < set(kinfmu.solve(wheels, **given).reaction_names)

    parallelogram = loaded("fourbar")
    bare = replace(parallelogram, joints=tuple(joint for joint in parallelogram.joints if joint.name != "AB"))
    host = opened(fmu_of(bare, flavour, fmi, "inputs"))
    host.set({"rates": 2, "crank_angle": 3.0, "crank_speed": 1.0})
    host.initialize(0.0)
    host.set({"crank_angle": math.pi})
    names = ("crank.torque", "shaking_force_y", "O.force_x")
    torque, shaking, reaction = host.get(*names)
    assert host.status() == 2
    reference = kinfmu.solve(bare, crank_angle=[3.0, math.pi], crank_acceleration=0.0)
    assert [torque, shaking] == pytest.approx([reference[name][1] for name in names[:2]], rel=1e-9)
    assert math.isnan(reaction)
    assert np.isnan(reference["O.force_x"][1])


@pytest.mark.parametrize("fmi", [2, 3])
def test_directional_derivatives_of_forces_are_exact(start: Callable[..., Host], fmi: int) -> None:
    host = start("native", fmi)
    at = {"crank_angle": 0.7, "crank_speed": 3.0, "crank_acceleration": 20.0, "work_force": -150.0}
    host.set(at)
    host.get("crank.torque")
    (inertia,) = host.get("crank.reduced_inertia")
    assert host.slopes(["crank.torque"], ["crank_acceleration"], [1.0])[0] == pytest.approx(inertia, rel=1e-13)
    assert host.slopes(["crank.bias_torque"], ["crank_acceleration"], [1.0])[0] == pytest.approx(0.0, abs=1e-12)
    names = [variable.name for variable in force_outputs(host)]
    for known, value in at.items():
        slopes = np.array(host.slopes(names, [known], [1.0]))
        h = 1e-3 * max(1.0, abs(value))
        weighed = np.zeros(len(names))
        for j, weight in ((1, 45.0), (2, -9.0), (3, 1.0)):
            for sign in (-1, 1):
                host.set({known: value + sign * j * h})
                weighed += sign * weight / (60.0 * h) * np.array(host.get(*names))
        host.set(at)
        np.testing.assert_allclose(slopes, weighed, rtol=1e-9, atol=1e-8)


def test_adjoint_derivatives_of_forces(start: Callable[..., Host]) -> None:
    host = start("native", 3)
    host.set({"crank_speed": 3.0, "crank_acceleration": 20.0, "work_force": -150.0})
    torque, work = (
        host.slopes(["crank.torque"], ["work_force"], [1.0]),
        host.adjoint(["crank.torque"], ["work_force", "crank_acceleration"], [1.0]),
    )
    assert work == pytest.approx([torque[0], host.get("crank.reduced_inertia")[0]], rel=1e-12)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.few(1)
def test_model_exchange_has_the_forces_of_a_run(
    fmu_of: Callable[..., Path], fmi: int, opened: Callable[..., Host]
) -> None:
    host = opened(fmu_of(press(), "native", fmi), model_exchange=True)
    host.set({"work_force": -150.0})
    host.initialize(0.0)
    host.fmu.enterContinuousTimeMode()
    names = [variable.name for variable in force_outputs(host)]
    t = np.linspace(0.0, 1.0, 21)
    reference = kinfmu.solve(press(), t, work_force=-150.0)
    for k, time in enumerate(t):
        host.fmu.setTime(time)
        np.testing.assert_allclose(host.get(*names), [reference[name][k] for name in names], rtol=1e-12, atol=1e-11)


RESTING = {"crank_angle": 0.7, "crank_speed": 3.0, "crank_acceleration": 0.0, "work_force": -150.0}


def resting_forces(names: Sequence[str], t: float) -> list[float]:
    """Forces of the press at time t, with its inputs as in RESTING."""
    passing = {"crank.start": 0.7 - 3.0 * t, "crank.speed": 3.0}
    run = kinfmu.compile(press()).solve([t], parameters=passing, work_force=-150.0)
    return [run[name][0] for name in names]


@pytest.mark.parametrize("fmi", [2, 3])
def test_loads_follow_the_time_that_model_exchange_sets_while_inputs_rest(
    fmu_of: Callable[..., Path], fmi: int, tmp_path: Path
) -> None:
    host = Host(fmu_of(press(), "native", fmi, "inputs"), tmp_path / "model", model_exchange=True)
    host.set(RESTING)
    host.initialize(0.0)
    host.fmu.enterContinuousTimeMode()
    names = [variable.name for variable in force_outputs(host)]
    for t in (0.0, 0.25, 1.0, 0.5):
        host.fmu.setTime(t)
        np.testing.assert_allclose(host.get(*names), resting_forces(names, t), rtol=1e-12, atol=1e-11)
    host.free()


@of_each_flavour
def test_loads_follow_the_time_of_steps_while_inputs_rest(start: Callable[..., Host], flavour: str, fmi: int) -> None:
    """The sample of a step is at its begin; an input that is set again is a sample at the end of the last step."""
    host = start(flavour, fmi)
    host.set(RESTING)
    names = [variable.name for variable in force_outputs(host)]
    for t in (0.0, 0.25, 0.5):
        assert host.step(t, 0.25) == OK
        np.testing.assert_allclose(host.get(*names), resting_forces(names, t), rtol=1e-12, atol=1e-11)
    host.set(RESTING)
    np.testing.assert_allclose(host.get(*names), resting_forces(names, 0.75), rtol=1e-12, atol=1e-11)


def sixth_order(value_at: Callable[[float], float], h: float) -> float:
    weights = ((1, 45.0), (2, -9.0), (3, 1.0))
    return sum(weight / (60.0 * h) * (value_at(j * h) - value_at(-j * h)) for j, weight in weights)


def test_derivatives_of_forces_with_respect_to_time_and_masses(
    fmu_of: Callable[..., Path], opened: Callable[..., Host]
) -> None:
    host = opened(fmu_of(press(), "native", 3))
    host.enter(0.0)
    model = kinfmu.compile(press())

    def torque(t: float, mass: float) -> float:
        return float(model.solve([t], parameters={"ram_mass": mass}, work_force=-150.0)["crank.torque"][0])

    host.set({"work_force": -150.0})
    of_mass, of_time = (host.slopes(["crank.torque"], [name], [1.0])[0] for name in ("ram_mass", "time"))
    assert of_mass == pytest.approx(sixth_order(lambda d: torque(0.0, 3.0 + d), 0.1), rel=1e-9)
    assert of_time == pytest.approx(sixth_order(lambda d: torque(d, 3.0), 1e-3), rel=1e-8)
    host.fmu.exitInitializationMode()


def test_the_example_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parents[2] / "docs" / "fmu.md").read_text(encoding="utf-8")
    (block,) = (block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "press.toml" in block)
    monkeypatch.chdir(tmp_path)
    Path("press.toml").write_text(PRESS, encoding="utf-8")
    columns = "time,crank_angle,crank_speed,crank_acceleration,work_force"
    rows = [f"{0.01 * k},{0.02 * k},2.0,0.0,-150.0" for k in range(101)]
    Path("crank.csv").write_text("\n".join([columns, *rows]), encoding="utf-8")
    names: dict[str, float] = {}
    exec(block, names)  # noqa: S102  our page
    same = {"crank.start": 0.0, "crank.speed": 2.0}  # the law that gives these angles
    run = kinfmu.compile(press()).solve(0.01 * np.arange(101), parameters=same, work_force=-150.0)
    assert names["peak"] == pytest.approx(np.abs(run["crank.torque"]).max(), rel=1e-9)


def test_potential_energy_counts_from_the_origin_of_the_world(tmp_path: Path) -> None:
    text = PRESS
    for near, far in (
        ("O = [0, 0], spring = [500, 40] }", "O = [100000, 200000], spring = [100500, 200040] }"),
        ('x = 0, y = 0, phi = "40 deg"', 'x = 100000, y = 200000, phi = "40 deg"'),
        ("x = 380, y = 0, phi = 0", "x = 100380, y = 200000, phi = 0"),
    ):
        assert near in text
        text = text.replace(near, far)
    mechanism = toml_file.parse(text.replace('"press"', '"far_press"'), "far_press")
    t = np.linspace(0.0, 1.0, 5)
    lifted = kinfmu.solve(press(), t)["potential_energy"] + (1.5 + 0.8 + 3.0) * 9.81 * 200.0
    run = kinfmu.solve(mechanism, t)
    np.testing.assert_allclose(run["potential_energy"], lifted, rtol=1e-12)
    for flavour in ("python", "native"):
        fmu = kinfmu.build(mechanism, tmp_path / f"{flavour}.fmu", flavour=flavour)
        assert_forces_equal(kinfmu.simulate(fmu, step=0.25), run)


@of_each_flavour
@pytest.mark.few(1)
def test_ends_that_meet_are_reported_in_the_log(flavour: str, fmi: int, tmp_path: Path) -> None:
    fmu = kinfmu.build(met(MEETING[0]), tmp_path / "met.fmu", flavour=flavour, fmi=fmi)
    run = kinfmu.simulate(fmu, stop=1.0, step=0.05)
    nothing = np.arange(21) == 10
    np.testing.assert_array_equal(np.isnan(run["crank.torque"]), nothing)
    np.testing.assert_array_equal(np.isnan(run["S.force_x"]), nothing)
    assert np.isfinite(run["potential_energy"]).all()
    assert np.isfinite(run["shaking_force_x"]).all()
    assert (run.status == 0).all()
    text = "forces have no value: the ends of spring 'return' are in the same place, so that it has no direction"
    assert {(event.level, event.text) for event in run.events} == {("warning", text)}


@of_each_flavour
@pytest.mark.few(1)
def test_the_ends_of_a_spring_without_free_length_may_meet(flavour: str, fmi: int, tmp_path: Path) -> None:
    fmu = kinfmu.build(toml_file.parse(MET), tmp_path / "met.fmu", flavour=flavour, fmi=fmi)
    run = kinfmu.simulate(fmu, stop=1.0, step=0.05)
    assert run["crank.torque"][10] == pytest.approx(-0.5 * 9.81 * 0.04, rel=1e-9)
    assert not run.events
