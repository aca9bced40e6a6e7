"""Uniform bodies: masses from a density and a shape, against closed forms, with parameters; messages."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import MechanismError
from kinfmu.mechanism import Body, Point
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text

STEEL = {"density": 7850.0, "thickness": 0.01}


def properties(points: list[tuple[float, float]], **given: object) -> np.ndarray:
    names = [f"P{k}" for k in range(len(points))]
    body = Body("body", dict(zip(names, points, strict=True)), plate=tuple(names), **given)  # type: ignore[arg-type]
    return np.array(body.mass_properties("m"))


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("away", [(0.0, 0.0), (100.0, -70.0)])
def test_a_triangle_and_a_rectangle_have_their_closed_forms(turn: int, away: tuple[float, float]) -> None:
    """I = m (a^2 + b^2 + c^2) / 36 of a triangle with these sides; m (a^2 + b^2) / 12 of a rectangle."""
    corners = [np.array(corner) for corner in ((0.0, 0.0), (0.5, 0.1), (0.2, 0.4))]
    mass = 78.5 * 0.5 * (0.5 * 0.4 - 0.2 * 0.1)
    sides = sum(float(np.sum((corners[k] - corners[k - 1]) ** 2)) for k in range(3))
    x, y = np.mean(corners, axis=0) + away
    found = properties([tuple(corner + away) for corner in corners][::turn], **STEEL)
    np.testing.assert_allclose(found, [mass, x, y, mass * sides / 36], rtol=1e-11)
    rectangle = [(away[0] + x, away[1] + y) for x, y in ((0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.0, 0.2))]
    found = properties(rectangle[::turn], areal_density=50.0)
    np.testing.assert_allclose(found, [3.0, away[0] + 0.15, away[1] + 0.1, 3.0 * (0.09 + 0.04) / 12], rtol=1e-11)


def test_a_plate_with_a_notch_is_the_sum_of_its_rectangles() -> None:
    corners = [(0.0, 0.0), (0.4, 0.0), (0.4, 0.1), (0.1, 0.1), (0.1, 0.3), (0.0, 0.3)]
    parts = [(0.4 * 0.1, 0.2, 0.05, 0.4, 0.1), (0.1 * 0.2, 0.05, 0.2, 0.1, 0.2)]  # area, centre, sides
    mass = 2.0
    areas = np.array([part[0] for part in parts])
    centers = np.array([part[1:3] for part in parts])
    center = (areas[:, None] * centers).sum(axis=0) / areas.sum()
    masses = mass * areas / areas.sum()
    inertia = sum(
        m * ((a * a + b * b) / 12 + ((at - center) ** 2).sum())
        for m, at, (*_, a, b) in zip(masses, centers, parts, strict=True)
    )
    np.testing.assert_allclose(properties(corners, mass=mass), [mass, *center, inertia], rtol=1e-13)


PENDULUM = """
name = "pendulum"
[units]
length = "mm"
[parameters]
l = "400 mm"
rho = "2.7 g/cm3"
[gravity]
x = 0
y = "-9.81 m/s2"
[bodies.ground]
points = { O = [0, 0] }
[bodies.arm]
points = { O = [0, 0], P = ["l", 0], Q = ["l/2", "l/4"] }
SHAPE
[joints]
O = { type = "revolute", between = ["ground.O", "arm.O"] }
[drivers]
arm = { type = "angle", of = "arm", law = "harmonic", amplitude = "60 deg", frequency = "1 Hz" }
"""
WIDE = 'rod = ["O", "P"]\ndensity = "rho"\nthickness = "8 mm"\nwidth = "l/10"'
PLATE = 'plate = ["O", "P", "Q"]\ndensity = "rho"\nthickness = "8 mm"'


@pytest.mark.parametrize("shape", [WIDE, PLATE])
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(2)
def test_lengths_and_densities_as_parameters_change_the_mass(shape: str, engine: str) -> None:
    mechanism = parse(PENDULUM.replace("SHAPE", shape), "pendulum")
    assert parse(text(mechanism), "again") == mechanism
    model = kinfmu.compile(mechanism, engine=engine)
    times = np.linspace(0.0, 1.0, 400 if engine == "native" else 21)
    for length, density in ((400.0, 2700.0), (300.0, 7850.0)):
        run = model.solve(times, parameters={"l": length, "rho": density})
        long = 1e-3 * length
        if shape is WIDE:
            mass, center = density * 0.008 * long * long / 10, np.array([long / 2, 0.0])
            inertia = mass * (long**2 + (long / 10) ** 2) / 12
        else:
            mass, center = density * 0.008 * long * long / 8, np.array([long / 2, long / 12])
            inertia = mass * (long**2 + 2 * (long**2 / 4 + long**2 / 16)) / 36
        assert run["arm.reduced_inertia"] == pytest.approx(inertia + mass * center @ center, rel=1e-12)
        arm = center[0] * np.cos(run["arm.phi"]) - center[1] * np.sin(run["arm.phi"])
        torque = (inertia + mass * center @ center) * run["arm.alpha"] + 9.81 * mass * arm
        np.testing.assert_allclose(run["arm.torque"], torque, rtol=0, atol=1e-12 * np.abs(torque).max())


def test_a_thin_rod_is_slender_and_a_width_alone_adds_its_inertia() -> None:
    body = Body("rod", {"A": Point(1.0, 2.0), "B": Point(4.0, 6.0)}, mass=3.0, rod=("A", "B"))
    assert body.mass_properties("m") == pytest.approx((3.0, 2.5, 4.0, 3.0 * 25.0 / 12.0), rel=1e-15)
    assert replace(body, width=0.6).mass_properties("m")[3] == pytest.approx(3.0 * 25.36 / 12.0, rel=1e-15)
    thin = replace(body, mass=0.0, width=1e-7, areal_density=3.0 / 5e-7)
    assert thin.mass_properties("m") == pytest.approx(body.mass_properties("m"), rel=1e-13)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('plate = ["O", "P"]', "plate = ['O', 'P'] must be three or more points of the body, such as ['A', 'B', 'C']"),
        (PLATE.replace('"Q"', '"R"'), "plate: body 'arm' has no point 'R'"),
        (PLATE.replace('"Q"', '"O"'), "plate = ['O', 'P', 'O'] has no area; its corners must not lie on one line"),
        (PLATE + "\nmass = 2", "'density' and 'mass' exclude each other; remove one of the two keys"),
        (PLATE + '\nareal_density = "20 kg/m2"', "'areal_density' and 'density' exclude each other"),
        (PLATE + '\nrod = ["O", "P"]', "'plate' and 'rod' exclude each other"),
        (PLATE + '\ninertia = "1 kg m2"', "plate: 'inertia' follows from the plate; remove one of the two keys"),
        (
            'density = "rho"\nthickness = 3',
            "density needs a shape: plate = ['A', 'B', 'C'], or rod = ['A', 'B'] with a width",
        ),
        ('plate = ["O", "P", "Q"]\ndensity = "rho"', "density needs a thickness, such as thickness = '10 mm'"),
        ('plate = ["O", "P", "Q"]', "plate needs a mass, such as mass = '1.2 kg'"),
        ('rod = ["O", "P"]\nareal_density = 8', "areal_density: a rod needs a width, such as width = '30 mm'"),
        (WIDE.replace('"rho"', "-1"), "density = -1.0 must be positive"),
        (WIDE.replace('"rho"', '"3 kg"'), "density"),
        ("mass = 1\nwidth = 3", "width needs a rod, such as rod = ['A', 'B']"),
    ],
)
def test_wrong_keys_get_one_clear_line(keys: str, message: str) -> None:
    with pytest.raises(MechanismError, match=re.escape(message)) as error:
        parse(PENDULUM.replace("SHAPE", keys), "pendulum")
    assert "[bodies.arm]" in str(error.value)
    assert "\n" not in str(error.value)


def test_edges_of_a_plate_that_cross_are_named() -> None:
    keys = 'plate = ["O", "P", "Q", "S"]\nmass = 1'
    file = PENDULUM.replace("SHAPE", keys).replace('Q = ["l/2", "l/4"]', "Q = [0, 50], S = [400, 60]")
    message = "plate = ['O', 'P', 'Q', 'S']: its edges P-Q and S-O meet; list its corners in order around it"
    with pytest.raises(MechanismError, match=re.escape(message)):
        parse(file, "pendulum")
