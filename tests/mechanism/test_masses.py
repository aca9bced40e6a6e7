"""Masses, gravity and loads of a mechanism: units, expressions in every unit of length, parameters, messages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from fmpy import read_model_description

import kinfmu
from kinfmu.errors import KinfmuError, MechanismError, RequestError
from kinfmu.fmu.description.common import base_unit
from kinfmu.mechanism import Body, Gravity, Mechanism
from kinfmu.mechanism.loads import ForceAt, Spring
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan import compile_plan
from kinfmu.plan.equations.graph import evaluate
from kinfmu.plan.equations.system import placement
from kinfmu.plan.origin import localized
from kinfmu.plan.trace import Tracer, parameter_symbol
from kinfmu.units import KINDS, METRES, POUND_FORCE, Quantity, every_unit, length_power, unit_of

ARM = """
name = "arm"
[units]
length = "UNIT"
[parameters]
l = "200 mm"
m = "2 kg"
F = "10 N"
M0 = "500 N mm"
c = "3 N s/m"
ratio = 1.5
unused = 1
[bodies.ground]
points = { O = [0, 0], T = ["l", "l"] }
[bodies.arm]
points = { O = [0, 0], P = ["l", 0] }
start = { x = 0, y = 0, phi = 0 }
mass = "m"
center_of_mass = ["l/3", 0]
inertia = "m*l**2/12"
[joints.O]
type = "revolute"
between = ["ground.O", "arm.O"]
[drivers.arm]
type = "angle"
of = "arm"
law = "constant_speed"
[gravity]
x = 0
y = "-9.81 m/s2"
[loads.push]
type = "force"
at = "arm.P"
x = "ratio*F"
y = "F + 2 N"
[loads.motor]
type = "torque"
on = "arm"
law = "constant"
level = "2*M0 - F*l"
[loads.spring]
type = "spring"
between = ["ground.T", "arm.P"]
stiffness = "F/l + 1 N/mm"
free_length = "l/4"
preload = "F"
[loads.dashpot]
type = "damper"
between = ["ground.T", "arm.P"]
damping = "2*c"
"""


def arm(unit: str = "mm", *changes: tuple[str, str]) -> Mechanism:
    """Return the arm in a unit of length, with parts of its file replaced."""
    content = ARM.replace("UNIT", unit)
    for old, new in changes:
        assert old in content
        content = content.replace(old, new, 1)
    return parse(content)


@pytest.mark.parametrize("unit", METRES)
def test_expressions_give_si_units_in_a_file_in_any_unit_of_length(unit: str) -> None:
    mechanism = arm(unit)
    body, (push, motor, spring, dashpot) = mechanism.bodies[1], mechanism.loads
    metre = METRES[unit]
    assert body.mass == 2.0
    assert body.inertia == pytest.approx(2.0 * 0.2**2 / 12.0, rel=1e-15)
    assert body.center_of_mass.x * metre == pytest.approx(0.2 / 3.0, rel=1e-15)
    assert mechanism.gravity is not None
    assert mechanism.gravity.y * metre == pytest.approx(-9.81, rel=1e-15)
    assert isinstance(push, ForceAt)
    assert isinstance(spring, Spring)
    assert (push.x, push.y) == (pytest.approx(15.0, rel=1e-15), pytest.approx(12.0, rel=1e-15))
    assert motor.law.level == pytest.approx(2.0 * 0.5 - 10.0 * 0.2, rel=1e-14)  # type: ignore[attr-defined]
    assert spring.stiffness == pytest.approx(10.0 / 0.2 + 1000.0, rel=1e-15)
    assert spring.free_length * metre == pytest.approx(0.05, rel=1e-15)
    assert spring.preload == 10.0
    assert dashpot.damping == 6.0  # type: ignore[attr-defined]
    (force,) = spring.efforts(placement(mechanism, [0.0, 0.0, 0.0]), [0.2], [0.0], None)
    assert force == pytest.approx(-(10.0 + 1050.0 * 0.15), rel=1e-14)


@pytest.mark.parametrize("unit", ["mm", "in", "m"])
def test_values_of_parameters_have_their_units_and_survive_a_file(unit: str) -> None:
    mechanism = arm(unit)
    values = {name: (parameter.value, parameter.quantity) for name, parameter in mechanism.parameters.items()}
    assert values["F"] == (10.0, Quantity("force"))
    assert values["M0"] == (0.5, Quantity("torque"))
    assert values["c"] == (3.0, Quantity("damping"))
    again = parse(text(mechanism))
    assert again == mechanism
    assert hash(again) == hash(mechanism)
    assert text(again) == text(mechanism)
    assert mechanism.unused_parameters == ("unused",)


def test_other_parameters_give_other_masses_and_loads() -> None:
    mechanism = arm("mm").with_parameters({"F": "20 N", "l": "0.4 m", "m": 3})
    body, push = mechanism.bodies[1], mechanism.loads[0]
    assert (body.mass, body.inertia) == (3.0, pytest.approx(3.0 * 0.4**2 / 12.0))
    assert (push.x, push.y) == (pytest.approx(30.0), pytest.approx(22.0))  # type: ignore[attr-defined]
    back = mechanism.with_parameters({"F": 10, "l": 200, "m": 2})
    assert back == arm("mm")
    with pytest.raises(RequestError, match="unit 'mm' must be one of N, mN, kN"):
        mechanism.with_parameters({"F": "20 mm"})
    with pytest.raises(MechanismError, match=r"^\[bodies\.arm\] mass = -1\.0 must be 0 or more"):
        mechanism.with_parameters({"m": -1})


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_masses_and_loads_are_computed_in_any_arithmetic(unit: str) -> None:
    mechanism = arm(unit)
    tracer = Tracer(mechanism)
    body, spring = tracer.members.bodies[1], tracer.members.loads[2]
    nodes = [tracer.graph.lift(one) for one in (body.mass, body.inertia, body.center_of_mass.x, spring.stiffness)]  # type: ignore[attr-defined]
    parameters = {name: float(mechanism.parameters[name].value) for name in mechanism.own_parameters}
    values = {str(parameter_symbol(name)): value for name, value in parameters.items()}
    written = mechanism.bodies[1]
    expected = [written.mass, written.inertia, written.center_of_mass.x, mechanism.loads[2].stiffness]  # type: ignore[attr-defined]
    assert evaluate(nodes, values) == expected
    doubled = evaluate(nodes, values | {str(parameter_symbol("l")): 2.0 * parameters["l"]})
    assert doubled[1] == pytest.approx(4.0 * written.inertia)


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_a_rod_has_its_centre_and_moment_of_inertia_from_its_ends(unit: str) -> None:
    rod = 'rod = ["O", "P"]'
    mechanism = arm(unit, ('center_of_mass = ["l/3", 0]', rod), ('inertia = "m*l**2/12"\n', ""))
    explicit = arm(unit, ('"l/3"', '"l/2"'))
    got = mechanism.bodies[1].mass_properties(unit)
    assert got == pytest.approx(explicit.bodies[1].mass_properties(unit), rel=1e-15)
    assert mechanism.at({}).bodies[1].rod is None
    assert mechanism.at({"l": 0.5}).bodies[1].inertia == pytest.approx(2.0 * (0.5 * METRES[unit]) ** 2 / 12.0)
    assert 'rod = ["O", "P"]' in text(mechanism)
    assert parse(text(mechanism)) == mechanism


def test_a_mechanism_far_from_the_origin_keeps_masses_and_loads() -> None:
    moved = ('O = [0, 0], T = ["l",', "O = [1000, 0], T = [1000,"), ("x = 0, y = 0, phi", "x = 1000, y = 0, phi")
    far = arm("m", *moved)
    near, origin = localized(far)
    assert origin.x == 1000.0
    assert (near.gravity, near.loads, near.bodies[1].mass) == (far.gravity, far.loads, far.bodies[1].mass)
    over = 'law = "polynomial"\ncoefficients = [1, 2]\nover = { measure = "coordinate", of = "arm.P", axis = "x" }'
    tied = arm("m", *moved, ('law = "constant"\nlevel = "2*M0 - F*l"', over))
    assert localized(tied) == (tied, (0.0, 0.0))


def test_gravity_masses_and_loads_belong_to_the_identity_of_a_mechanism() -> None:
    mechanism = arm()
    others = [
        replace(mechanism, gravity=None),
        replace(mechanism, gravity=Gravity(0.0, -1.62)),
        replace(mechanism, loads=mechanism.loads[1:]),
        replace(mechanism, bodies=(mechanism.bodies[0], replace(mechanism.bodies[1], mass=5.0))),
    ]
    assert len({mechanism, *others}) == 5
    assert all(other != mechanism for other in others)


def test_a_file_without_masses_has_no_lines_about_them() -> None:
    mechanism = kinfmu.load("fourbar")
    assert not mechanism.has_masses
    assert mechanism.gravity is None
    assert not {"mass", "gravity", "loads"} & set(text(mechanism).replace("[", " ").replace("]", " ").split())


def test_gravity_in_python_is_a_pair_of_numbers_or_texts() -> None:
    body = Body("arm", mass="2 lb")  # type: ignore[arg-type]
    mechanism = Mechanism("free", (body,), gravity=(0, "-9.81 m/s2"), length_unit="mm")  # type: ignore[arg-type]
    assert mechanism.gravity == Gravity(0.0, -9810.0)
    assert mechanism.bodies[1].mass == 0.90718474
    with pytest.raises(MechanismError, match=r"^\[gravity\] = 9.81 must be two numbers \(x, y\)"):
        Mechanism("free", (body,), gravity=9.81)  # type: ignore[arg-type]


def test_units_of_forces_are_those_of_tables() -> None:
    """A pound is 0.45359237 kg, standard gravity 9.80665 m/s2."""
    assert POUND_FORCE == 4.4482216152605
    units = every_unit("mm")
    expected = {"lbf ft": 1.3558179483314004, "lb in2": 0.0002926396534292, "lbf/in": 175.12683524647636, "N/mm": 1e3}
    for unit, factor in expected.items():
        assert units[unit][1] == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_a_unit_with_a_mass_has_its_powers_and_one_quantity(kind: str) -> None:
    quantity = Quantity(kind)
    unit = unit_of(quantity, "mm")
    assert unit == KINDS[kind].unit
    assert every_unit("mm")[unit] == (quantity, 1.0)
    assert length_power(quantity) == KINDS[kind].powers[1]
    exponents = {key: int(value) for key, value in base_unit(unit).items()}
    assert tuple(exponents.get(key, 0) for key in ("kg", "m", "s")) == KINDS[kind].powers


def test_a_law_over_a_length_has_its_argument_in_the_unit_of_the_file() -> None:
    law = 'type = "force_between"\nbetween = ["ground.T", "arm.P"]\nlaw = "polynomial"\ncoefficients = [5, C]\n'
    over = 'over = { measure = "distance", between = ["ground.T", "arm.P"] }'
    for written in ("0.5", '"0.5 N/mm"', '"500 N/m"', '"0.05*F/(1 mm)"'):
        content = ARM.replace("UNIT", "mm") + "[loads.law]\n" + law.replace("C", written) + over
        load = parse(content).loads[-1]
        assert load.law.at(20.0) == pytest.approx(15.0, rel=1e-15), written  # type: ignore[attr-defined]


WRONG = {
    "a negative mass": ('"m"\ncenter', "-2\ncenter", "[bodies.arm] mass = -2.0 must be 0 or more"),
    "a negative inertia": (
        '"m*l**2/12"',
        '"-m*l**2/12"',
        "[bodies.arm] inertia = -0.006666666666666667 must be 0 or more (",
    ),
    "inertia without mass": (
        'mass = "m"\ncenter_of_mass = ["l/3", 0]\n',
        "",
        "[bodies.arm] inertia needs a mass, such as mass = '1.2 kg'",
    ),
    "a centre without mass": (
        'mass = "m"\n',
        "",
        "[bodies.arm] center_of_mass needs a mass, such as mass = '1.2 kg'",
    ),
    "mass of the ground": (
        "[bodies.arm]",
        "mass = 1\n[bodies.arm]",
        "[bodies.ground] mass: the ground does not move, so its mass has no effect; remove the key",
    ),
    "a rod and an inertia": (
        'center_of_mass = ["l/3", 0]',
        'rod = ["O", "P"]',
        "[bodies.arm] rod: 'inertia' follows from the rod; remove one of the two keys",
    ),
    "a rod of length 0": (
        'center_of_mass = ["l/3", 0]\ninertia = "m*l**2/12"',
        'rod = ["O", "O"]',
        "[bodies.arm] rod = ['O', 'O'] has length 0; its ends must be two places of the body",
    ),
    "a rod to a missing point": (
        'center_of_mass = ["l/3", 0]\ninertia = "m*l**2/12"',
        'rod = ["O", "p"]',
        "[bodies.arm] rod: body 'arm' has no point 'p'; did you mean 'P'?; its points: O, P",
    ),
    "a rod that is no pair": (
        'center_of_mass = ["l/3", 0]\ninertia = "m*l**2/12"',
        'rod = "O"',
        "[bodies.arm] rod = 'O' must be two points of the body, such as ['A', 'B']",
    ),
    "a mass with a wrong unit": (
        '"m"\ncenter',
        '"2 N"\ncenter',
        "[bodies.arm] mass = '2 N': unit 'N' must be one of kg, g, t, lb",
    ),
    "a mass in words": (
        '"m"\ncenter',
        '"heavy"\ncenter',
        "[bodies.arm] mass must be a mass, such as '1.2 kg': "
        "'heavy', character 1: no parameter 'heavy'; parameters: l, m, F, M0, c, ratio, unused",
    ),
    "an inertia that is a torque": (
        '"m*l**2/12"',
        '"F*l"',
        "[bodies.arm] inertia = 'F*l' is a torque and must be a moment of inertia",
    ),
    "a sum of a mass and a force": (
        '"m"\ncenter',
        '"m + F"\ncenter',
        "[bodies.arm] mass = 'm + F', character 3: '+': a mass and a force cannot be added",
    ),
    "a centre of mass that is a number": (
        '["l/3", 0]',
        "3",
        "[bodies.arm] center_of_mass = 3 must be two numbers [x, y]",
    ),
    "gravity without a direction": (
        "x = 0\ny",
        "y",
        "[gravity] needs the key 'x'; downwards: x = 0, y = '-9.81 m/s2'",
    ),
    "gravity along z": ("x = 0\ny", "x = 0\nz", "[gravity] z: unknown key; keys: x, y"),
    "gravity as a number": ("[gravity]\nx = 0\ny = ", "[units2]\ny = ", "[units2]: unknown key"),
    "a load on a missing point": (
        'at = "arm.P"',
        'at = "arm.Q"',
        "[loads.push] at: body 'arm' has no point 'Q'; its points: O, P",
    ),
    "a load on a missing body": (
        'at = "arm.P"',
        'at = "amr.P"',
        "[loads.push] at: body 'amr' is not in the mechanism; did you mean 'arm'?; bodies: ground, arm",
    ),
    "a load on the ground": (
        'at = "arm.P"',
        'at = "ground.T"',
        "[loads.push] acts on the ground only, which does not move",
    ),
    "a load between points of one body": (
        'type = "spring"\nbetween = ["ground.T", "arm.P"]',
        'type = "spring"\nbetween = ["arm.O", "arm.P"]',
        "[loads.spring] joins body 'arm' to itself",
    ),
    "a load of an unknown type": (
        'type = "damper"',
        'type = "dampr"',
        "[loads.dashpot] type = 'dampr' is not known; did you mean 'damper'?; known: force, force_along, "
        "force_between, torque, spring, damper, gas_spring, torsion_spring, torsion_damper",
    ),
    "an unknown key of a load": (
        "stiffness =",
        "stifness =",
        "[loads.spring] stifness: unknown key; did you mean 'stiffness'?; "
        "keys: type, between, stiffness, free_length, preload",
    ),
    "a spring without a stiffness": (
        'stiffness = "F/l + 1 N/mm"\n',
        "",
        "[loads.spring] needs the key 'stiffness'; keys: between, stiffness, free_length, preload",
    ),
    "a negative stiffness": ('"F/l + 1 N/mm"', "-1", "[loads.spring] stiffness = -1.0 must be 0 or more"),
    "a negative damping": (
        '"2*c"',
        '"-c"',
        "[loads.dashpot] damping = -3.0 must be 0 or more (damping = '-c', c = 3 N s/m)",
    ),
    "an unknown axis of a force": (
        'at = "arm.P"',
        'at = "arm.P"\naxes = "world"',
        "[loads.push] axes: body 'world' is not in the mechanism; bodies: ground, arm",
    ),
    "a force with a wrong unit": (
        '"F + 2 N"',
        '"2 kg"',
        "[loads.push] y = '2 kg': unit 'kg' must be one of N, mN, kN, MN, lbf",
    ),
    "an input with an argument": (
        'law = "constant"\nlevel = "2*M0 - F*l"',
        'law = "external"\nover = { measure = "angle", of = "arm" }',
        "[loads.motor] over: an input gives the torque, as the law is 'external'; remove 'over'",
    ),
    "a load with the name of a driver": (
        "[loads.motor]",
        "[loads.arm]",
        "[loads.arm]: a driver has this name already; give the load another one",
    ),
    "an input with the name of a parameter": (
        'law = "constant"\nlevel = "2*M0 - F*l"',
        'law = "external"\n[parameters2]',
        "[parameters2]: unknown key",
    ),
    "a force without a unit in a file in mm": (
        '"ratio*F"',
        '"2*ratio"',
        "[loads.push] x = '2*ratio' has no unit, and the file is in mm: "
        "give a number or a parameter (ratio) its unit, such as '1 N'",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_an_error_is_one_line_with_table_key_value_and_what_is_valid(case: str) -> None:
    old, new, message = WRONG[case]
    with pytest.raises(MechanismError) as caught:
        arm("mm", (old, new))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_gas_spring_has_the_forces_of_a_data_sheet() -> None:
    table = (
        '[loads.gas]\ntype = "gas_spring"\nbetween = ["ground.T", "arm.P"]\nextended_length = "300 mm"\n'
        'stroke = "100 mm"\nextended_force = "400 N"\ncompressed_force = "1.4*400 N"\n'
    )
    load = parse(ARM.replace("UNIT", "mm") + table).loads[-1]
    at = placement(arm(), [0.0, 0.0, 0.0])
    forces = [load.efforts(at, [s], [0.0], None)[0] for s in (0.3, 0.25, 0.2)]
    assert forces == pytest.approx([400.0, 480.0, 560.0], rel=1e-12)
    assert load.energy([0.2]) == pytest.approx(0.1 * 480.0, rel=1e-12)
    for old, new, message in (
        ('"100 mm"', '"400 mm"', "[loads.gas] stroke = 400.0 must not be above extended_length = 300.0"),
        ("1.4*400", "0.5*400", "[loads.gas] extended_force = 400.0 must not be above compressed_force = 200.0"),
        ('"400 N"', "0", "[loads.gas] extended_force = 0.0 must be positive"),
    ):
        with pytest.raises(MechanismError) as caught:
            parse(ARM.replace("UNIT", "mm") + table.replace(old, new, 1))
        assert message in str(caught.value)


def test_a_spring_whose_points_meet_at_the_start_has_no_direction() -> None:
    mechanism = arm("m", ('T = ["l", "l"]', 'T = ["l", 0]'), ('free_length = "l/4"', "free_length = 0"))
    spring = mechanism.loads[2]
    spring.check_start(placement(mechanism, [0.0, 0.0, 0.1]))
    with pytest.raises(MechanismError) as caught:
        kinfmu.solve(mechanism, [0.0, 0.1])
    assert str(caught.value) == (
        "[loads.spring] between: ground.T and arm.P are in the same place at the start, so the force has no direction; "
        "move a point or the start pose"
    )


def test_the_points_of_a_spring_without_free_length_may_meet_at_the_start() -> None:
    met, apart = ('T = ["l", "l"]', 'T = ["l", 0]'), ("\ndamping", '\nbetween = ["ground.O", "arm.P"]\ndamping')
    dashpot = ('type = "damper"\nbetween = ["ground.T", "arm.P"]', 'type = "damper"')
    mechanism = arm("m", met, dashpot, apart, ('free_length = "l/4"', "free_length = 0"), ('preload = "F"', ""))
    run = kinfmu.solve(mechanism, [0.0, 0.1])
    assert run["potential_energy"][0] == pytest.approx(0.0, abs=1e-15)
    weight, push, motor = 2.0 * 9.81 * 0.2 / 3.0, 12.0 * 0.2, 1.0 - 2.0
    assert run["arm.torque"][0] == pytest.approx(weight - push - motor, rel=1e-12)  # the spring has no force


def test_a_condition_on_a_mass_is_tested_again_when_an_fmu_sets_its_parameter() -> None:
    conditions = {condition.label: condition.required for condition in compile_plan(arm("mm")).conditions}
    assert conditions == {
        "[bodies.arm] mass": "0 or more",
        "[bodies.arm] inertia": "0 or more",
        "[loads.spring] stiffness": "0 or more",
        "[loads.spring] free_length": "0 or more",
        "[loads.dashpot] damping": "0 or more",
    }


def test_an_fmu_declares_units_of_masses_and_refuses_a_negative_mass(tmp_path: Path) -> None:
    fmu = kinfmu.build(arm("mm"), tmp_path / "arm.fmu", flavour="python")
    units = {variable.name: variable.unit for variable in read_model_description(str(fmu)).modelVariables}
    assert (units["m"], units["F"], units["M0"], units["c"]) == ("kg", "N", "N m", "N s/m")
    assert kinfmu.simulate(fmu, parameters={"m": 3.0, "F": 20.0}).good.all()
    with pytest.raises(KinfmuError, match=r"m = -1: \[bodies\.arm\] mass = -1 must be 0 or more"):
        kinfmu.simulate(fmu, parameters={"m": -1.0})


def test_gravity_may_be_a_parameter() -> None:
    base = kinfmu.load("fourbar_loaded")
    written = text(base).replace("y = -9810.0", 'y = "g"').replace("[parameters]", '[parameters]\ng = "-9.81 m/s2"')
    mech = parse(written)
    here, moon = (kinfmu.solve(mech, [0.0, 0.1], parameters={"g": g}) for g in (-9810.0, -1620.0))
    assert here["crank.torque"] == pytest.approx(kinfmu.solve(base, [0.0, 0.1])["crank.torque"], rel=1e-12)
    expected = kinfmu.solve(replace(base, gravity=(0.0, -1620.0)), [0.0, 0.1])
    assert moon["crank.torque"] == pytest.approx(expected["crank.torque"], rel=1e-12)
