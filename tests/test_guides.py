"""Guides whose axis is nearly, not exactly, a world axis: slides, slots and rails against equations in 50 digits."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, PointOnLine, Revolute, Run, SlideDriver, Translational
from kinfmu.mechanism.toml_file import parse
from tests import oracle
from tests.oracle import Residual, largest_error, mp

AGREEMENT = 1e-14  # of lengths about 1 and angles
OFF = [10.0**-k for k in range(3, 17)] + [0.3e-3, 2e-3, 5e-3]  # [rad] from a world axis, to 0.3 deg
AXES = [math.pi / 2 * (k % 5 - 1) + (-1) ** k * off for k, off in enumerate(OFF)] + [3.1416, 1.5708]
FEW = AXES[1::6]
PLACE = complex(0.35, -0.21)  # a ground point of the guide
CRANK, ROD = 1.0, 2.5


class Guided(NamedTuple):
    """A mechanism, which moves for 1 s, with its equations for q in the order of its coordinates."""

    mechanism: Mechanism
    residual: Residual


def along(axis: float, d: Sequence[Any]) -> Any:
    return mp.cos(axis) * d[0] + mp.sin(axis) * d[1]


def across(axis: float, d: Sequence[Any]) -> Any:
    return mp.cos(axis) * d[1] - mp.sin(axis) * d[0]


def from_to(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, Any]:
    return b[0] - a[0], b[1] - a[1]


def turned(phi: Any, x: float, at: Sequence[Any] = (0.0, 0.0)) -> tuple[Any, Any]:
    """The point (x, 0) of a frame."""
    return at[0] + oracle.cos(phi) * x, at[1] + oracle.sin(phi) * x


def ground(**more: complex) -> Body:
    points = {"O": 0j, "G": PLACE, **more}
    return Body("ground", {name: (at.real, at.imag) for name, at in points.items()})


def body(name: str, at: complex, phi: float, **points: float) -> Body:
    return Body(name, {key: (x, 0.0) for key, x in points.items()}, (at.real, at.imag, phi))


G = (PLACE.real, PLACE.imag)


def table(axis: float) -> Guided:
    """Two rails, the second on the first."""
    other = axis + math.pi / 2
    u = 0.2, -0.3
    a = PLACE + cmath.rect(u[0], axis)
    b = a + cmath.rect(u[1], other)
    mechanism = Mechanism(
        "table",
        [ground(), body("saddle", a, 0.0, p=0.0), body("plate", b, 0.0, p=0.0)],
        [Translational("x", ("ground.G", "saddle.p"), axis), Translational("y", ("saddle.p", "plate.p"), other)],
        [
            SlideDriver("feed", ("ground.G", "saddle.p"), axis, ConstantSpeed(u[0], 0.5)),
            SlideDriver("infeed", ("saddle.p", "plate.p"), other, ConstantSpeed(u[1], -0.4)),
        ],
        coordinates=("saddle.x", "saddle.y", "plate.x", "plate.y"),
    )

    def residual(q: Sequence[Any], u: Sequence[Any]) -> list[Any]:
        first, second = from_to(G, q[:2]), from_to(q[:2], q[2:])
        return [across(axis, first), across(other, second), along(axis, first) - u[0], along(other, second) - u[1]]

    return Guided(mechanism, residual)


def bar_in_slot(axis: float) -> Guided:
    """A bar with both pins in one slot, pushed along it."""
    u, length = 0.2, 0.7
    mechanism = Mechanism(
        "bar_in_slot",
        [ground(), body("bar", PLACE + cmath.rect(u, axis), axis, p=0.0, q=length)],
        [PointOnLine(pin, ("ground.G", f"bar.{pin}"), axis) for pin in ("p", "q")],
        [SlideDriver("push", ("ground.G", "bar.p"), axis, ConstantSpeed(u, 0.5))],
        coordinates=("bar.x", "bar.y", "bar.phi"),
    )

    def residual(q: Sequence[Any], u: Any) -> list[Any]:
        first, second = from_to(G, q), from_to(G, turned(q[2], length, q))
        return [across(axis, first), across(axis, second), along(axis, first) - u]

    return Guided(mechanism, residual)


def slider_crank(axis: float) -> Guided:
    """A slider-crank driven at its slider."""
    t = axis + 0.5
    tip = cmath.rect(CRANK, t)
    level = (PLACE * cmath.rect(1.0, -axis)).imag
    rod = axis + math.asin((level - CRANK * math.sin(0.5)) / ROD)
    slider = tip + cmath.rect(ROD, rod)
    u = ((slider - PLACE) * cmath.rect(1.0, -axis)).real
    mechanism = Mechanism(
        "slider_crank",
        [
            ground(),
            body("crank", 0j, t, O=0.0, P=CRANK),
            body("rod", tip, rod, P=0.0, S=ROD),
            body("slider", slider, 0.0, S=0.0),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "rod.P")),
            Revolute("S", ("rod.S", "slider.S")),
            Translational("rail", ("ground.G", "slider.S"), axis),
        ],
        [SlideDriver("slide", ("ground.G", "slider.S"), axis, ConstantSpeed(u, -0.4))],
        coordinates=("crank.phi", "rod.x", "rod.y", "rod.phi", "slider.x", "slider.y"),
    )

    def residual(q: Sequence[Any], u: Any) -> list[Any]:
        pins = *from_to(turned(q[0], CRANK), q[1:3]), *from_to(turned(q[3], ROD, q[1:3]), q[4:])
        way = from_to(G, q[4:])
        return [*pins, across(axis, way), along(axis, way) - u]

    return Guided(mechanism, residual)


def yoke(axis: float) -> Guided:
    """A Scotch yoke: a rail, and a slot across it in which the crank's pin slides."""
    other, t = axis + math.pi / 2, axis + 0.5
    start = PLACE + cmath.rect(((cmath.rect(CRANK, t) - PLACE) * cmath.rect(1.0, -axis)).real, axis)
    mechanism = Mechanism(
        "yoke",
        [ground(), body("crank", 0j, t, O=0.0, P=CRANK), body("yoke", start, 0.0, p=0.0)],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Translational("rail", ("ground.G", "yoke.p"), axis),
            PointOnLine("slot", ("yoke.p", "crank.P"), other),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(t, 6.0))],
        coordinates=("crank.phi", "yoke.x", "yoke.y"),
    )

    def residual(q: Sequence[Any], u: Any) -> list[Any]:
        return [q[0] - u, across(axis, from_to(G, q[1:])), across(other, from_to(q[1:], turned(q[0], CRANK)))]

    return Guided(mechanism, residual)


def trammel(axis: float) -> Guided:
    """An elliptic trammel: a bar with a pin in each of two slots, pushed along one of them."""
    other, u = axis + math.pi / 2, 0.7
    up = math.sqrt(ROD**2 - u**2)
    mechanism = Mechanism(
        "trammel",
        [ground(), body("bar", PLACE + cmath.rect(u, axis), axis + math.atan2(up, -u), p=0.0, q=ROD)],
        [PointOnLine("p", ("ground.G", "bar.p"), axis), PointOnLine("q", ("ground.G", "bar.q"), other)],
        [SlideDriver("push", ("ground.G", "bar.p"), axis, ConstantSpeed(u, 0.8))],
        coordinates=("bar.x", "bar.y", "bar.phi"),
    )

    def residual(q: Sequence[Any], u: Any) -> list[Any]:
        first, second = from_to(G, q), from_to(G, turned(q[2], ROD, q))
        return [across(axis, first), across(other, second), along(axis, first) - u]

    return Guided(mechanism, residual)


GUIDED: list[Callable[[float], Guided]] = [table, bar_in_slot, slider_crank, yoke, trammel]


def assert_exact(guided: Guided, run: Run) -> None:
    assert (run.status == 0).all(), run.status
    drivers = len(guided.mechanism.drivers)
    inputs: Any = run.inputs.reshape(len(run.t), drivers, 3).transpose(2, 0, 1).tolist()
    u = [[tuple(row) if drivers > 1 else row[0] for row in one] for one in inputs]
    exact = oracle.solve(guided.residual, run.q, *u)
    for ours, wanted in zip((run.q, run.qd, run.qdd), exact, strict=True):
        assert largest_error(ours, wanted) <= AGREEMENT * max(1.0, float(np.abs(ours).max()))


@pytest.mark.parametrize("guided", GUIDED)
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_guides_close_to_a_world_axis(guided: Callable[[float], Guided], engine: Literal["python", "native"]) -> None:
    for axis in AXES if engine == "python" else FEW:
        one = guided(axis)
        assert_exact(one, kinfmu.solve(one.mechanism, np.linspace(0.0, 1.0, 7), engine=engine))


TILTED = """name = "tilted"
[parameters]
tilt = "10 deg"
[bodies.ground]
points = { O = [0.35, -0.21] }
[bodies.bar]
points = { p = [0, 0], q = [0.7, 0] }
start = { x = 0.55, y = -0.17, phi = "10 deg" }
[joints]
a = { type = "point_on_line", between = ["ground.O", "bar.p"], axis = "tilt" }
b = { type = "point_on_line", between = ["ground.O", "bar.q"], axis = "tilt" }
[drivers.push]
type = "slide"
between = ["ground.O", "bar.p"]
axis = "tilt"
law = "constant_speed"
start = 0.2
speed = 0.5
"""


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_the_axis_of_a_guide_may_be_a_parameter(engine: Literal["python", "native"]) -> None:
    tilt = np.concatenate([axis + sign * np.array(OFF) for axis in np.arange(-1, 3) * math.pi / 2 for sign in (1, -1)])
    u = np.array([0.2, 0.5, -0.3])
    designs = kinfmu.compile(parse(TILTED), engine=engine).solve_designs({"tilt": tilt}, push_position=u)
    assert (designs.status == 0).all()
    found = dict(zip(designs.outputs, np.moveaxis(designs.values, 2, 0), strict=True))
    np.testing.assert_allclose(found["bar.x"], PLACE.real + np.cos(tilt)[:, None] * u, atol=AGREEMENT)
    np.testing.assert_allclose(found["bar.y"], PLACE.imag + np.sin(tilt)[:, None] * u, atol=AGREEMENT)
    np.testing.assert_allclose(np.sin(found["bar.phi"] - tilt[:, None]), 0.0, atol=AGREEMENT)


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])
@pytest.mark.few(1)
def test_fmus_of_guides_close_to_a_world_axis(flavour: str, fmi: int, tmp_path: Path) -> None:
    one = bar_in_slot(3.1416)
    assert_exact(
        one, kinfmu.simulate(kinfmu.build(one.mechanism, tmp_path, flavour=flavour, fmi=fmi), step=0.125, stop=1.0)
    )
