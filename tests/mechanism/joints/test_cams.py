"""Cams and couplings compared with closed forms and 50 digits, and messages about wrong ones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    AngleBetween,
    AngleDriver,
    Body,
    CamOscillating,
    CamRoller,
    CamTranslating,
    ConstantSpeed,
    CoordinateOf,
    Coupling,
    Cycloidal,
    DistanceBetween,
    Harmonic,
    Mechanism,
    MotionSequence,
    Polynomial,
    PositionAlong,
    Revolute,
    Segment,
    SimpleHarmonic,
    Spline,
    Translational,
)
from kinfmu.errors import AssemblyError, MechanismError
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.toml_file import parse
from tests.oracle import cos, fourbar, largest_error, mp, sin, solve
from tests.power_series import Series, atan2

TURN = 2.0 * math.pi
RISE_DWELL_RETURN = MotionSequence(
    (
        Segment("cycloidal", math.radians(120.0), 0.5),
        Segment("dwell", math.radians(60.0)),
        Segment("cycloidal", math.radians(90.0), -0.5),
        Segment("dwell", math.radians(90.0)),
    ),
    repeat=True,
)
u = np.linspace(-7.0, 20.0, 90)


def lifted(joint: Joint, *, axis: float = math.pi / 2.0) -> Mechanism:
    """A cam on a pivot, and a follower that slides along an axis through it; the joint leads the follower."""
    e = (math.cos(axis), math.sin(axis))
    return Mechanism(
        "cam",
        (
            Body("ground", {"O": (0, 0)}),  # type: ignore[dict-item]
            Body("cam", {"O": (0, 0)}, (0, 0, 0)),  # type: ignore[dict-item,arg-type]
            Body("follower", {"R": (0, 0)}, (1.5 * e[0], 1.5 * e[1], 0)),  # type: ignore[dict-item,arg-type]
        ),
        (
            Revolute("O", ("ground.O", "cam.O")),
            Translational("guide", ("ground.O", "follower.R"), axis),
            joint,
        ),
        (AngleDriver("cam", "cam"),),
    )


def swung(joint: Joint) -> Mechanism:
    """A cam and a rocker on pivots 3 apart, the rocker's roller R 2.5 from its pivot; the joint leads the rocker."""
    return Mechanism(
        "swing",
        (
            Body("ground", {"O": (0, 0), "C": (3, 0)}),  # type: ignore[dict-item]
            Body("cam", {"O": (0, 0)}, (0, 0, 0)),  # type: ignore[dict-item,arg-type]
            Body("rocker", {"C": (0, 0), "R": (2.5, 0)}, (3, 0, 2.7)),  # type: ignore[dict-item,arg-type]
        ),
        (Revolute("O", ("ground.O", "cam.O")), Revolute("C", ("ground.C", "rocker.C")), joint),
        (AngleDriver("cam", "cam"),),
    )


def cycloid(x: Series) -> Series:
    return x - sin(2 * mp.pi * x) / (2 * mp.pi)


def lift(angle: float) -> Series:
    """The textbook's rise, dwell and return over the cam's angle, turn after turn, with two derivatives."""
    theta = Series([angle, 1, 0])
    theta = theta - 2 * mp.pi * mp.floor(theta.c[0] / (2 * mp.pi))
    rise, back = 2 * mp.pi / 3, mp.pi / 2
    if theta.c[0] < rise:
        return cycloid(theta / rise) / 2
    if theta.c[0] < mp.pi:
        return theta * 0 + mp.mpf(1) / 2
    if theta.c[0] < mp.pi + back:
        return (1 - cycloid((theta - mp.pi) / back)) / 2
    return theta * 0


def rates(series: list[Series]) -> list[Any]:
    """Positions, rates and accelerations, each (n,)."""
    return [np.array([factor * row.c[order] for row in series]) for order, factor in enumerate((1, 1, 2))]


def test_a_translating_follower_rises_dwells_and_returns_by_the_cycloid_turn_after_turn() -> None:
    run = kinfmu.solve(
        lifted(CamTranslating("lift", ("ground.O", "follower.R"), "cam", RISE_DWELL_RETURN, math.pi / 2, offset=1.0)),
        cam_angle=u,
    )
    exact = rates([lift(angle) + 1 for angle in u])
    for name, column, tolerance in zip(("y", "vy", "ay"), exact, (1e-14, 1e-13, 1e-12), strict=True):
        assert largest_error(run[f"follower.{name}"], column) < tolerance
    assert run.fixed["follower.x"] == pytest.approx(0.0, abs=1e-16)


def test_rates_of_a_follower_grow_with_the_speed_of_its_cam() -> None:
    joint = CamTranslating("lift", ("ground.O", "follower.R"), "cam", RISE_DWELL_RETURN, math.pi / 2)
    run = kinfmu.solve(lifted(joint), cam_angle=[1.0], cam_speed=3.0, cam_acceleration=0.5)
    position, slope, second = (float(column[0]) for column in rates([lift(1.0)]))
    assert run["follower.y"] == pytest.approx([position])
    assert run["follower.vy"] == pytest.approx([3.0 * slope])
    assert run["follower.ay"] == pytest.approx([9.0 * second + 0.5 * slope])


def test_an_oscillating_follower_swings_by_its_lift() -> None:
    run = kinfmu.solve(
        swung(CamOscillating("lift", ("ground", "rocker"), "cam", RISE_DWELL_RETURN, offset=2.0)), cam_angle=u
    )
    exact = rates([lift(angle) + 2 for angle in u])
    for name, column, tolerance in zip(("phi", "omega", "alpha"), exact, (1e-14, 1e-13, 1e-12), strict=True):
        assert largest_error(run[f"rocker.{name}"], column) < tolerance


def test_a_cam_turns_relative_to_its_holder() -> None:
    """Turning carrier and cam together gives no lift."""
    mechanism = Mechanism(
        "carried",
        (
            Body("ground", {"O": (0, 0)}),  # type: ignore[dict-item]
            Body("carrier", {"O": (0, 0), "A": (1, 0)}, (0, 0, 0)),  # type: ignore[dict-item,arg-type]
            Body("cam", {"A": (0, 0)}, (1, 0, 0)),  # type: ignore[dict-item,arg-type]
            Body("rocker", {"O": (0, 0)}, (0, 0, 0)),  # type: ignore[dict-item,arg-type]
        ),
        (
            Revolute("O", ("ground.O", "carrier.O")),
            Revolute("A", ("carrier.A", "cam.A")),
            Revolute("B", ("carrier.O", "rocker.O")),
            CamOscillating("lift", ("carrier", "rocker"), "cam", Harmonic(0.3, 1.0)),
        ),
        (AngleDriver("carrier", "carrier"), AngleDriver("cam", "cam")),
    )
    run = kinfmu.solve(mechanism, carrier_angle=[0.0, 0.7, 0.7], cam_angle=[0.0, 0.7, 1.2])
    np.testing.assert_allclose(run["rocker.phi"], [0.0, 0.7, 0.7 + 0.3 * math.sin(0.5)], atol=1e-15)


def test_a_roller_in_line_follows_the_radius_of_the_pitch_curve() -> None:
    """The roller's centre lies at the polar angle pi/2 - phi of the cam's frame."""
    law = Harmonic(0.25, 2.0, 1.25, 0.4)
    run = kinfmu.solve(lifted(CamRoller("roller", ("cam.O", "follower.R"), law)), cam_angle=u)
    exact = rates([mp.mpf(1.25) + sin(2 * (mp.pi / 2 - Series([angle, 1, 0])) + mp.mpf(0.4)) / 4 for angle in u])
    for name, column, tolerance in zip(("y", "vy", "ay"), exact, (1e-14, 1e-13, 1e-12), strict=True):
        assert largest_error(run[f"follower.{name}"], column) < tolerance
    assert run.status.max() == 0


def test_a_roller_on_a_rocker_follows_a_limacon_to_50_digits() -> None:
    """Residuals by hand: Phi = |d|^2 - f(angle)^2 with the rocker's roller at (3, 0) + 2.5 (cos, sin)."""

    def residual(q: Any, angle: Any) -> list[Any]:
        (phi,) = q
        x, y = 3 + mp.mpf(2.5) * cos(phi), mp.mpf(2.5) * sin(phi)
        radius = mp.mpf(1.25) + sin(atan2(y, x) - angle + mp.mpf(0.3)) * mp.mpf(0.25)
        return [x * x + y * y - radius * radius]

    run = kinfmu.solve(swung(CamRoller("roller", ("cam.O", "rocker.R"), Harmonic(0.25, 1.0, 1.25, 0.3))), cam_angle=u)
    exact = solve(residual, run["rocker.phi"][:, None], list(u))
    assert run.status.max() == 0
    assert largest_error(run["rocker.phi"], exact.q[:, 0]) < 1e-14
    assert largest_error(run["rocker.omega"], exact.qd[:, 0]) < 1e-13
    assert largest_error(run["rocker.alpha"], exact.qdd[:, 0]) < 1e-12


def eccentric_circle(count: int) -> Spline:
    """Radius 1 about a centre 0.25 from the pole, as a table of `count` points."""
    points = []
    for k in range(count + 1):
        angle = TURN * k / count
        points.append((angle, 0.25 * math.cos(angle) + math.sqrt(1.0 - (0.25 * math.sin(angle)) ** 2)))
    return Spline(tuple(points), "periodic")


def test_an_eccentric_circle_moves_its_follower_like_a_fourbar() -> None:
    """The roller keeps the distance 1 from the circle's centre: crank 0.25, coupler 1, rocker 2.5, ground 3.

    The circle is a spline here, so what is left is the spline's error; it falls with the fourth power of the spacing.
    """
    angles = np.linspace(0.1, 6.0, 40)
    exact = fourbar(3, "0.25", 1, "2.5", list(angles)).q[:, 2]
    errors = []
    for count in (90, 180, 720):
        joint = CamRoller("roller", ("cam.O", "rocker.R"), eccentric_circle(count))
        run = kinfmu.solve(swung(joint), cam_angle=angles)
        errors.append(largest_error(run["rocker.phi"], exact, modulo_turns=True))
    assert errors[2] < 1e-11
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.3)


def test_the_gap_of_a_roller_is_its_radial_distance_to_the_pitch_curve() -> None:
    joint = CamRoller("roller", ("cam.O", "follower.R"), Polynomial((1.25,)))
    (phi,) = joint.residual(placed({"cam": (0.0, 0.0, 0.4), "follower": (0.9, 1.2, 0.0)}))
    assert joint.gaps((phi,)) == pytest.approx((0.25,))


def placed(poses: dict[str, tuple[float, float, float]]) -> Any:
    from kinfmu.mechanism.quantities.placement import BodyFrame, Placement

    return Placement(
        {name: BodyFrame.of(*pose) for name, pose in poses.items()}, {"cam.O": (0.0, 0.0), "follower.R": (0.0, 0.0)}
    )


@pytest.mark.parametrize(
    ("measure", "law", "way"),
    [
        (CoordinateOf("follower.R", "y"), Polynomial((0.0, 0.5, 0.1)), lambda x: 0.5 * x + 0.1 * x * x),
        (PositionAlong(("ground.O", "follower.R"), math.pi / 2.0), ConstantSpeed(1.0, 0.25), lambda x: 1.0 + 0.25 * x),
        (DistanceBetween(("ground.O", "follower.R")), Harmonic(0.5, 1.0, 2.0), lambda x: 2.0 + 0.5 * sin(x)),
    ],
    ids=["coordinate", "position", "distance"],
)
def test_a_coupling_relates_any_two_measures_by_any_law(measure: Any, law: Law, way: Any) -> None:
    run = kinfmu.solve(lifted(Coupling("screw", AngleBetween("cam"), measure, law)), cam_angle=u[:40])
    exact = rates([way(Series([angle, 1, 0])) for angle in u[:40]])
    for name, column, tolerance in zip(("y", "vy", "ay"), exact, (1e-13, 1e-13, 1e-12), strict=True):
        assert largest_error(run[f"follower.{name}"], column) < tolerance


def test_a_wheel_rolls_by_a_coupling_of_its_own_coordinate_and_angle() -> None:
    wheel = Mechanism(
        "wheel",
        (Body("ground"), Body("wheel", {"M": (0, 0), "P": (0, -2)}, (0, 2, 0))),  # type: ignore[dict-item,arg-type]
        (
            kinfmu.Coordinate("axle", "wheel.M", "y", 2.0),
            Coupling("roll", AngleBetween("wheel"), CoordinateOf("wheel.M", "x"), ConstantSpeed(0.0, -2.0)),
        ),
        (AngleDriver("wheel", "wheel"),),
        points={"P": "wheel.P"},
    )
    run = kinfmu.solve(wheel, wheel_angle=u)
    np.testing.assert_allclose(run["P.x"], -2.0 * (u - np.sin(u)), atol=1e-14)
    np.testing.assert_allclose(run["P.y"], 2.0 * (1.0 - np.cos(u)), atol=1e-14)


def test_a_coupling_of_a_coordinate_holds_far_from_the_origin_too() -> None:
    """The joint depends on the world's origin, so the plan keeps that origin."""
    far = Mechanism(
        "far",
        (
            Body("ground", {"O": (100, 50)}),  # type: ignore[dict-item]
            Body("cam", {"O": (0, 0)}, (100, 50, 0)),  # type: ignore[dict-item,arg-type]
            Body("follower", {"R": (0, 0)}, (100, 51, 0)),  # type: ignore[dict-item,arg-type]
        ),
        (
            Revolute("O", ("ground.O", "cam.O")),
            Translational("guide", ("ground.O", "follower.R"), math.pi / 2.0),
            Coupling("screw", AngleBetween("cam"), CoordinateOf("follower.R", "y"), ConstantSpeed(51.0, 0.5)),
        ),
        (AngleDriver("cam", "cam"),),
    )
    assert kinfmu.solve(far, cam_angle=[0.0, 3.0])["follower.y"] == pytest.approx([51.0, 52.5], abs=1e-13)


def test_an_indexer_advances_turn_after_turn() -> None:
    law = MotionSequence((Segment("modified_sine", math.pi, math.pi / 4.0), Segment("dwell", math.pi)), repeat=True)
    index = Coupling("index", AngleBetween("cam"), AngleBetween("rocker", "ground"), law)
    run = kinfmu.solve(swung(index), cam_angle=[-0.1, 0.0, 3.2, 6.2, 12.5])
    np.testing.assert_allclose(run["rocker.phi"], np.array([0.0, 0.0, 1.0, 1.0, 2.0]) * math.pi / 4.0, atol=1e-14)
    np.testing.assert_allclose(run["rocker.omega"], 0.0, atol=1e-14)


def test_a_roller_that_starts_on_the_pole_is_reported() -> None:
    mechanism = lifted(CamRoller("roller", ("cam.O", "follower.R"), Harmonic(0.25, 1.0, 1.25)))
    bodies = (*mechanism.bodies[:2], Body("follower", {"R": (0, 0)}, (0, 0, 0)))  # type: ignore[dict-item,arg-type]
    at_pole = Mechanism("cam", bodies, mechanism.joints, mechanism.drivers)
    with pytest.raises(
        AssemblyError, match=r"does not close: gap 1.25 m at 'roller' with the others closed; check start poses"
    ):
        kinfmu.solve(at_pole)


def test_a_roller_without_a_start_pose_is_assembled_away_from_the_pole() -> None:
    mechanism = lifted(CamRoller("roller", ("cam.O", "follower.R"), Harmonic(0.25, 1.0, 1.25)))
    bodies = (*mechanism.bodies[:2], Body("follower", {"R": (0, 0)}))  # type: ignore[dict-item]
    run = kinfmu.solve(Mechanism("cam", bodies, mechanism.joints, mechanism.drivers), cam_angle=[0.0, 0.5])
    expected = -1.25 + 0.25 * np.cos([0.0, 0.5])  # below the pole, where the cam is nearest to it
    np.testing.assert_allclose(run["follower.y"], expected, rtol=0.0, atol=1e-14)


WRONG: dict[str, tuple[Joint, str]] = {
    "a sequence that is no turn": (
        CamTranslating("c", ("ground.O", "follower.R"), "cam", MotionSequence((Segment("dwell", 3.0),), repeat=True)),
        "[joints.c] law: the durations of its sequence add up to 171.887339 deg, not to a turn of 360 deg; "
        "188.112661 deg are missing: add a dwell",
    ),
    "a sequence that does not come back": (
        CamTranslating(
            "c", ("ground.O", "follower.R"), "cam", MotionSequence((Segment("cycloidal", TURN, 1.0),), repeat=True)
        ),
        "[joints.c] law: the rises of its sequence add up to 1, not to 0; "
        "a follower that goes on turn after turn needs a coupling",
    ),
    "a rise in degrees without a unit": (
        CamOscillating(
            "c",
            ("ground", "follower"),
            "cam",
            MotionSequence(
                (Segment("cycloidal", 3.0, 15.0), Segment("3-4-5", TURN - 3.0, -math.pi / 12.0)), repeat=True
            ),
        ),
        "[joints.c] law: the rises of its sequence add up to 844.436693 deg, not to 0 (859.437 deg, -15 deg); "
        "a bare angle is in radians: write '15 deg' for degrees",
    ),
    "a swing that does not come back": (
        CamOscillating(
            "c", ("ground", "follower"), "cam", MotionSequence((Segment("cycloidal", TURN, 0.5),), repeat=True)
        ),
        "[joints.c] law: the rises of its sequence add up to 28.6478898 deg, not to 0; "
        "a follower that goes on turn after turn needs a coupling",
    ),
    "a cam that is its own follower": (
        CamOscillating("c", ("ground", "cam"), "cam", Cycloidal(1.0, 1.0)),
        "[joints.c] cam = 'cam' must be another body than the follower and what holds it",
    ),
    "an invalid law": (
        CamOscillating("c", ("ground", "follower"), "cam", SimpleHarmonic(1.0, 0.0)),
        "[joints.c] duration = 0.0 must be positive",
    ),
    "a pitch curve that does not close": (
        CamRoller("c", ("cam.O", "follower.R"), Harmonic(0.1, 1.5, 1.0)),
        "[joints.c] law: frequency = 1.5 must be a whole number of waves in a turn; a pitch curve must close",
    ),
    "a pitch curve through its pole": (
        CamRoller("c", ("cam.O", "follower.R"), Harmonic(1.0, 1.0)),
        "[joints.c] law: the radius of the pitch curve is 0 at 0 deg; it must be positive",
    ),
    "a coupling of a body that is not there": (
        Coupling("c", AngleBetween("cm"), AngleBetween("follower"), ConstantSpeed()),
        "[joints.c] input.of: body 'cm' is not in the mechanism; did you mean 'cam'?; bodies: ground, cam, follower",
    ),
    "a coupling of the ground": (
        Coupling("c", AngleBetween("ground"), CoordinateOf("ground.O", "x"), ConstantSpeed()),
        "[joints.c] acts on the ground only, which does not move",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_cam_or_coupling_is_refused(case: str) -> None:
    joint, expected = WRONG[case]
    with pytest.raises(MechanismError) as caught:
        lifted(joint)
    assert str(caught.value) == expected


FILE = """name = "cam"
[units]
length = "mm"
[bodies.ground]
points = { O = [0, 0] }
[bodies.cam]
points = { O = [0, 0] }
[bodies.follower]
points = { R = [0, 0] }
[joints.c]
"""


def joint_of(table: str) -> Joint:
    return parse(FILE + table).joints[0]


def test_laws_of_cams_and_couplings_have_units_of_output_over_input() -> None:
    cam = 'type = "cam_translating"\nbetween = ["ground.O", "follower.R"]\ncam = "cam"\n'
    lead = 'law = "constant_speed"\nstart = "1 cm"\nspeed = "36 mm/rev"'
    joint = CamTranslating("c", ("ground.O", "follower.R"), "cam", ConstantSpeed(10.0, 36.0 / TURN))
    assert joint_of(cam + lead) == joint
    swing = 'type = "cam_oscillating"\nbetween = ["ground", "follower"]\ncam = "cam"\n'
    wave = 'law = "harmonic"\namplitude = "10 deg"\nfrequency = 2\nphase = "90 deg"'
    assert joint_of(swing + wave) == CamOscillating(
        "c", ("ground", "follower"), "cam", Harmonic(math.radians(10.0), 2.0, phase=math.pi / 2.0)
    )
    coupled = (
        'type = "coupling"\ninput = { measure = "position", between = ["ground.O", "follower.R"], axis = "90 deg" }\n'
        'output = { measure = "angle", of = "cam", to = "follower" }\nlaw = "polynomial"\n'
        'coefficients = ["1 rev", "10 deg/cm", "1 rad/mm2"]'
    )
    assert joint_of(coupled) == Coupling(
        "c",
        PositionAlong(("ground.O", "follower.R"), math.pi / 2.0),
        AngleBetween("cam", "follower"),
        Polynomial((TURN, math.radians(1.0), 1.0)),
    )


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        (
            'type = "coupling"\nlaw = "constant_speed"\noutput = 1',
            "[joints.c] needs the key 'input'; keys: input, output, law",
        ),
        (
            'type = "coupling"\nlaw = "constant_speed"\ninput = "cam"',
            '[joints.c] input = \'cam\' must be a table such as { measure = "angle", of = "rocker" }',
        ),
        (
            'type = "coupling"\nlaw = "constant_speed"\ninput = { of = "cam" }',
            "[joints.c] input needs the key 'measure', one of angle, coordinate, distance, position, offset",
        ),
        (
            'type = "coupling"\nlaw = "constant_speed"\ninput = { measure = "angel", of = "cam" }',
            "[joints.c] input measure = 'angel' is not known; did you mean 'angle'?; "
            "known: angle, coordinate, distance, position, offset",
        ),
        (
            'type = "coupling"\nlaw = "constant_speed"\ninput = { measure = "angle", off = "cam" }',
            "[joints.c] input off: unknown key; did you mean 'of'?; keys: measure, of, to",
        ),
        (
            'type = "cam_roller"\nbetween = ["cam.O", "follower.R"]\nlaw = "external"',
            "[joints.c] law = 'external' is not known; known: constant_speed, constant, polynomial, harmonic, "
            "simple_harmonic, cycloidal, modified_sine, modified_trapezoid, 3-4-5, 4-5-6-7, spline, sequence",
        ),
        (
            'type = "cam_oscillating"\nbetween = ["ground", "follower"]\ncam = "cam"\nlaw = "3-4-5"\n'
            'rise = "1 mm"\nduration = 1',
            "[joints.c] rise = '1 mm': unit 'mm' must be one of rad, deg, rev",
        ),
        (
            'type = "cam_oscillating"\nbetween = ["ground", "follower"]\ncam = "cam"\nlaw = "3-4-5"\n'
            'rise = 1\nduration = "1 s"',
            "[joints.c] duration = '1 s': unit 's' must be one of rad, deg, rev",
        ),
    ],
    ids=lambda value: "" if "type" in value else value[11:40],
)
def test_a_wrong_table_of_a_cam_or_coupling_is_reported(table: str, expected: str) -> None:
    with pytest.raises(MechanismError) as caught:
        joint_of(table)
    assert str(caught.value) == f"mechanism: {expected}"
