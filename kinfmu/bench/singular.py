"""The neighbourhood of singular points: error at shrinking distances, exactly at the point, and beyond it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from kinfmu import gallery
from kinfmu.bench.accuracy import Tell, prepared, quietly
from kinfmu.bench.case import Case, along_driver
from kinfmu.bench.exact_fourbar import exact_fourbar
from kinfmu.bench.engines import ENGINES, Engine, Way
from kinfmu.bench.rounds import Spread, samples_in_turn, spread
from kinfmu.drivers import AngleDriver
from kinfmu.joints import Revolute, Translational
from kinfmu.joints.laws import ConstantSpeed
from kinfmu.mechanism import Body, Mechanism
from kinfmu.plan import compile_plan
from kinfmu.run import FloatArray

DISTANCES = tuple(10.0 ** (-0.5 * k) for k in range(2, 17))  # [rad], 1e-1 to 1e-8
STEP = math.radians(2.0)  # of the way there
ROUNDS = 7


class Point(NamedTuple):
    """A singular point that a mechanism passes, and its motion there in closed form."""

    title: str
    mechanism: Callable[[], Mechanism]
    columns: tuple[str, ...]
    centre: float  # [rad]
    start: float  # [rad]
    closed_form: Callable[[float], FloatArray]


class Near(NamedTuple):
    """One engine in its usual setting near one point.

    before, beyond: (k, 3) error of q, qd, qdd [rad, length, at 1 rad/s] at each of DISTANCES on either side; at: (3,)
    exactly at the point; NaN where it gave no numbers. The samples are taken in this order: before, at, beyond.
    """

    point: str
    engine: str
    before: FloatArray
    at: FloatArray
    beyond: FloatArray
    microseconds: Spread  # a sample of the whole way


def _parallelogram(u: float) -> FloatArray:
    """crank.phi, coupler.x, coupler.y, coupler.phi, rocker.phi of the reference four-bar; the same motion throughout."""
    s, c = math.sin(u), math.cos(u)
    return np.array([[u, 1.0 + c, s, 0.0, u], [1.0, -s, c, 0.0, 1.0], [0.0, -c, -s, 0.0, 0.0]])


def _isosceles(u: float) -> FloatArray:
    """crank.phi, rod.x, rod.y, rod.phi, piston.x of a slider-crank whose rod is as long as its crank, 1."""
    s, c = math.sin(u), math.cos(u)
    return np.array([[u, c, s, -u, 2.0 * c], [1.0, -s, c, -1.0, -2.0 * s], [0.0, -c, -s, 0.0, -2.0 * c]])


def equal_slider_crank() -> Mechanism:
    """A slider-crank with crank and rod of length 1: at 90 degrees the piston is at the crank's pivot and may stay."""
    return Mechanism(
        "equal_slider_crank",
        [
            Body("ground", {"O": (0.0, 0.0)}),
            Body("crank", {"O": (0.0, 0.0), "P": (1.0, 0.0)}, (0.0, 0.0, 0.5)),
            Body("rod", {"P": (0.0, 0.0), "S": (1.0, 0.0)}, (0.88, 0.48, -0.5)),
            Body("piston", {"S": (0.0, 0.0)}, (1.76, 0.0, 0.0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "rod.P")),
            Revolute("S", ("rod.S", "piston.S")),
            Translational("bore", ("ground.O", "piston.S")),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(0.5, 1.0))],
    )


def change_point_fourbar() -> Mechanism:
    """Ground 4, crank 1, coupler 3, rocker 2: at 180 degrees coupler and rocker are stretched and two branches cross."""
    return Mechanism(
        "change_point_fourbar",
        [
            Body("ground", {"O": (0.0, 0.0), "C": (4.0, 0.0)}),
            Body("crank", {"O": (0.0, 0.0), "P": (1.0, 0.0)}, (0.0, 0.0, 1.0)),
            Body("coupler", {"P": (0.0, 0.0), "Q": (3.0, 0.0)}, (0.54, 0.84, 0.3)),
            Body("rocker", {"C": (0.0, 0.0), "Q": (2.0, 0.0)}, (4.0, 0.0, 1.9)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "coupler.P")),
            Revolute("Q", ("coupler.Q", "rocker.Q")),
            Revolute("C", ("ground.C", "rocker.C")),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(1.0, 1.0))],
    )


FOURBAR = ("crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi")
POINTS = (
    Point(
        "four-bar 4-1-3-2 at 180 deg",
        change_point_fourbar,
        FOURBAR,
        math.pi,
        1.0,
        lambda u: exact_fourbar(4, 1, 3, 2, u),
    ),
    Point(
        "reference four-bar at 180 deg",
        lambda: gallery.load("fourbar"),
        FOURBAR,
        math.pi,
        math.radians(60.0),
        _parallelogram,
    ),
    Point(
        "slider-crank, rod = crank, at 90 deg",
        equal_slider_crank,
        ("crank.phi", "rod.x", "rod.y", "rod.phi", "piston.x"),
        0.5 * math.pi,
        0.5,
        _isosceles,
    ),
)


def case_of(point: Point) -> Case:
    """The way from the start past the point: steps of STEP, then the DISTANCES before, the point, those beyond."""
    first, last = point.start, point.centre - 2.0 * DISTANCES[0]
    way = np.linspace(first, last, math.ceil((last - first) / STEP) + 1).tolist()
    before = [point.centre - d for d in DISTANCES]
    beyond = [point.centre + d for d in reversed(DISTANCES)]
    u = [*way, *before, point.centre, *beyond]
    plan = compile_plan(point.mechanism(), point.columns)
    return along_driver(point.title, plan, u, range(len(way), len(u)), point.closed_form)


def measure(
    rounds: int = ROUNDS, tell: Tell = lambda _: None, engines: Sequence[Engine] = ENGINES
) -> tuple[tuple[Near, ...], tuple[str, ...]]:
    """Every engine in its usual setting past every point; and a line for each engine that is not installed."""
    found: list[Near] = []
    absent: dict[str, None] = {}
    for point in POINTS:
        case = case_of(point)
        ways: list[tuple[Engine, Way]] = []
        for engine in engines:
            way = prepared(engine, case, engine.usual, absent)
            if way is not None:
                ways.append((engine, quietly(way)))
        k = len(DISTANCES)
        errors = []
        for engine, way in ways:
            errors.append(case.errors(way(len(case.t))))
            tell(f"{point.title}: {engine.name}")
        times = samples_in_turn([_whole(way, len(case.t)) for _, way in ways], rounds, 1, fewest=1)
        for (engine, _), error, seconds in zip(ways, errors, times, strict=True):
            microseconds = spread([value / len(case.t) for value in seconds])
            found.append(Near(point.title, engine.name, error[:k], error[k], error[:k:-1], microseconds))
    return tuple(found), tuple(absent)


def _whole(way: Way, n: int) -> Callable[[int], object]:
    """The whole way, counted as one sample."""
    return lambda _: way(n)


def steps(engines: Sequence[Engine] = ENGINES) -> int:
    """How often `measure` tells something, at most."""
    return len(POINTS) * len(engines)
