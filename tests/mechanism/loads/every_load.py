"""A four-bar with one load of every kind, and loads drawn at random."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Body, Mechanism, Point, Start
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.loads import Following, ForceAlong, ForceAt, GasSpring, Load, TorqueOn
from kinfmu.mechanism.quantities.placement import Placement
from kinfmu.mechanism.toml_file import parse
from kinfmu.plan.equations.system import placement
from kinfmu.units import METRES
from tests.mechanism.joints.drawn import POINTS, coordinates, members
from tests.mechanisms import FOURBAR_DRIVER, FOURBAR_PINS

FOURBAR = (
    """
name = "four_bar"
title = "Four-bar with loads"
[units]
length = "mm"
[run]
stop = "1 s"
step = "10 ms"
[bodies.ground]
points = { O = [0, 0], C = [200, 0], D = [-90, 160], E = [330, 60], F = [60, -70] }
[bodies.crank]
points = { O = [0, 0], P = [50, 0] }
[bodies.coupler]
points = { P = [0, 0], Q = [200, 0], M = [90, 60] }
start = { x = 50 }
mass = "2 kg"
[bodies.rocker]
points = { C = [0, 0], Q = [120, 0], T = [60, 0] }
start = { x = 200, phi = "70 deg" }
"""
    + FOURBAR_PINS
    + FOURBAR_DRIVER
    + """start = "60 deg"
speed = "60 rpm"
"""
)
GRAVITY = """
[gravity]
x = 0
y = "-9.81 m/s2"
"""
LOADS = """
[loads.coil]
type = "spring"
between = ["ground.D", "coupler.M"]
stiffness = 100
free_length = 50
[loads.oil]
type = "damper"
between = ["ground.D", "coupler.M"]
damping = 10
[loads.strut]
type = "gas_spring"
between = ["ground.E", "rocker.Q"]
extended_length = 400
stroke = 250
extended_force = 100
compressed_force = 150
[loads.muscle]
type = "force_between"
between = ["ground.F", "rocker.T"]
law = "external"
[loads.weight]
type = "force"
at = "coupler.M"
y = -50
[loads.wind]
type = "force_along"
at = "rocker.T"
law = "external"
axes = "rocker"
angle = "-90 deg"
[loads.brake]
type = "torque"
on = "rocker"
law = "constant"
level = -2
[loads.clock]
type = "torsion_spring"
between = ["ground", "crank"]
stiffness = 1
[loads.grease]
type = "torsion_damper"
between = ["coupler", "rocker"]
damping = 1
"""


def fourbar(loads: str = "", *, has_gravity: bool = False) -> Mechanism:
    """Return the four-bar with tables of loads, by default with none."""
    return parse(FOURBAR + GRAVITY * has_gravity + loads, "four_bar.toml")


def every_load() -> Mechanism:
    """Return the four-bar with every kind of load, in gravity."""
    return fourbar(LOADS, has_gravity=True)


# ---------------------------------------------------------------------------------------------------------------- drawn


APART = 0.5  # [length]; the line between nearer points turns quickly


class Acting(NamedTuple):
    """What a load does in one pose: its quantities [m, rad], their rates, its efforts, and ds/dq (k, n)."""

    s: list[Any]
    sd: list[Any]
    efforts: list[Any]
    gradients: FloatArray

    @property
    def power(self) -> Any:
        return sum(effort * rate for effort, rate in zip(self.efforts, self.sd, strict=True))

    @property
    def generalized(self) -> FloatArray:
        """Q, (n,): [N] for lengths in metres, [N m] for angles."""
        return np.array(self.efforts) @ self.gradients


@cache
def loads(cls: type[Load], *, between: bool = False, **given: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Draw loads of a class; between: on two moving bodies, where it has two."""
    if cls in (ForceAt, ForceAlong):
        given = {"axes": st.sampled_from(["left", "right"] if between else ["ground", "left", "right"])} | given
    elif cls is TorqueOn:
        against = st.just("right") if between else st.sampled_from(["ground", "right"])
        given = {"on": st.just("left"), "against": against} | given
    elif between:
        pair = ("left", "right") if "torsion" in cls.type else ("left.P", "right.Q")
        given = {"between": st.just(pair)} | given
    if cls is GasSpring:
        given = {"stroke": st.floats(0.05, 0.1), "compressed_force": st.floats(4.0, 9.0)} | given
    if not issubclass(cls, Following):
        return members(cls, **given)
    if between:
        given = {"over": st.none()} | given
    return members(cls, **given).map(_with_input)


def _with_input(load: Any) -> Any:
    """Return the load without the argument of its law if an input gives its effort."""
    return replace(load, over=None) if isinstance(load.law, External) else load


@st.composite
def mechanisms(draw: st.DrawFn, cls: type[Load], **given: Any) -> Mechanism:
    """A ground and three bodies with a drawn point each, and one drawn load, in m or mm."""
    bodies = [
        Body(
            name,
            {point: Point(draw(coordinates), draw(coordinates))},
            Start() if name == "ground" else Start(0.0, 0.0, 0.0),
        )
        for name, point in POINTS.items()
    ]
    unit = draw(st.sampled_from(["m", "mm"]))
    return Mechanism("drawn", tuple(bodies), loads=(draw(loads(cls, **given)),), length_unit=unit)


def are_apart(mechanism: Mechanism, q: FloatArray) -> bool:
    """True if no points between which a force acts, or whose distance its law is over, are too near each other."""
    (load,) = mechanism.loads
    at = placement(mechanism, list(q))
    pairs = [getattr(load, "between", ()), getattr(getattr(load, "over", None), "between", ())]
    return all(np.hypot(*at.vector(pair)) > APART for pair in pairs if pair and "." in pair[0])


def acting(mechanism: Mechanism, q: FloatArray, qd: FloatArray, x: Any = 0.7) -> Acting:
    """What the load does in a pose; x: time, or its input."""
    (load,) = mechanism.loads
    at = placement(mechanism, list(q))
    s = in_si(mechanism, load.measured(at))
    h = 1e-30
    columns = []
    for k in range(len(q)):
        moved = [complex(value, h if j == k else 0.0) for j, value in enumerate(q)]
        columns.append([complex(one).imag / h for one in in_si(mechanism, load.measured(placement(mechanism, moved)))])
    gradients = np.array(columns).T
    sd = (gradients @ qd).tolist()
    return Acting(s, sd, list(load.efforts(at, s, sd, argument(load, at, x))), gradients)


def argument(load: Load, at: Placement, x: Any) -> Any:
    """Return the argument of a load's law."""
    over = load.argument(at)
    return x if over is None else over


def in_si(mechanism: Mechanism, measured: Any) -> list[Any]:
    """Return the quantities of the load in metres and radians."""
    metre = METRES[mechanism.length_unit]
    kinds = mechanism.loads[0].kinds()
    return [value * metre if kind == "length" else value for value, kind in zip(measured, kinds, strict=True)]
