"""Random four-bars, slider-cranks and six-bars against closed forms of 50 digits, wherever they are driven.

A linkage is written once, as circles that meet. The same lines run on floats, to find a stretch of the motion that is
far from singular, and on power series, to tell exactly what happens along it. Whichever coordinate is driven, its exact
value, speed and acceleration go in, and all coordinates must come out.
"""

from __future__ import annotations

import cmath
import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, PointOnLine, Revolute, Run, SlideDriver, Translational
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.units import read_coordinate
from tests.mechanism.gallery import geometry
from tests.oracle import mp
from tests.power_series import Series, sqrt

AGREEMENT = 1e-11  # of the largest magnitude among the columns of a kind
REGULAR = 0.1  # least sin^2 of the angle under which two bars, or a bar and a slide, meet
MOVING = 0.2  # least speed of the driven coordinate per speed of the crank, [rad] or one of the lengths drawn
GRID = 240  # angles of the crank to a turn
EDGE = 4  # angles at either end of a stretch that are left out: between two a limit may be near
SAMPLES = 12  # to a stretch
TURN = 2.0 * math.pi
EXAMPLES = settings().max_examples  # of the profile
PHASES = (Phase.explicit, Phase.generate)  # what fails prints its mechanism; shrinking would take minutes


class UnreachableError(Exception):
    """Two circles that do not meet, or only under a flat angle."""


class OnFloats:
    """Geometry on floats, points as complex numbers; what is near-singular is refused."""

    def at(self, x: float, y: float) -> complex:
        return complex(x, y)

    def turned(self, phi: float, x: float, y: float = 0.0) -> complex:
        return cmath.rect(1.0, phi) * complex(x, y)

    def heading(self, way: complex) -> float:
        return cmath.phase(way)

    def meet(self, a: complex, radius_a: float, b: complex, radius_b: float, side: int) -> complex:
        squared = abs(b - a) ** 2
        if 1.0 - ((radius_a**2 + radius_b**2 - squared) / (2.0 * radius_a * radius_b)) ** 2 < REGULAR:
            raise UnreachableError
        along = (radius_a**2 - radius_b**2 + squared) / (2.0 * squared)
        return a + (b - a) * complex(along, side * math.sqrt(radius_a**2 / squared - along**2))

    def meet_level(self, a: complex, radius: float, y: float, side: int) -> complex:
        if 1.0 - ((y - a.imag) / radius) ** 2 < REGULAR:
            raise UnreachableError
        return complex(a.real + side * math.sqrt(radius**2 - (y - a.imag) ** 2), y)


class OnSeries:
    """Geometry on power series in time."""

    def at(self, x: float, y: float) -> geometry.Vector:
        return geometry.Vector(x, y)

    def turned(self, phi: Series, x: float, y: float = 0.0) -> geometry.Vector:
        return geometry.turned(phi, x, y)

    def heading(self, way: geometry.Vector) -> Series:
        return geometry.heading(way, 0)

    def meet(
        self, a: geometry.Vector, radius_a: float, b: geometry.Vector, radius_b: float, side: int
    ) -> geometry.Vector:
        return geometry.meet(a, radius_a, b, radius_b, side)

    def meet_level(self, a: geometry.Vector, radius: float, y: float, side: int) -> geometry.Vector:
        radius, y = geometry.decimal(radius), geometry.decimal(y)
        return geometry.Vector(a.x + sqrt(radius * radius - (y - a.y) * (y - a.y)) * side, y)


class Pose(NamedTuple):
    """Where a body is: its frame's origin and its angle, in either arithmetic."""

    at: Any
    phi: Any


@dataclass(frozen=True)
class Linkage:
    """A linkage as a mechanism and as closed forms of its crank's angle."""

    points: Mapping[str, Mapping[str, tuple[float, float]]]  # by body; bodies that share a name of a point share a pin
    poses: Callable[[Any, Any], dict[str, Pose]]  # (geometry, crank's angle) -> poses of the moving bodies
    sliding: tuple[Joint, ...] = ()

    def mechanism(self, crank: float, driver: Driver) -> Mechanism:
        """The mechanism, started roughly at an angle of its crank."""
        poses = self.poses(OnFloats(), crank)
        bodies = [Body("ground", self.points["ground"])]
        for name, (at, phi) in poses.items():
            bodies.append(Body(name, self.points[name], (round(at.real, 2), round(at.imag, 2), round(phi, 2))))
        return Mechanism("drawn", bodies, (*self._pins(), *self.sliding), [driver])

    def exact(self, crank: Series) -> dict[str, Series]:
        """Every coordinate over time, where the crank moves so."""
        constant = Series([0, 0, 0])
        return {
            f"{name}.{letter}": constant + value
            for name, (at, phi) in self.poses(OnSeries(), crank).items()
            for letter, value in (("x", at.x), ("y", at.y), ("phi", phi))
        }

    def stretches(self, start: float, driven: str) -> list[list[float]]:
        """Angles of the crank, over a turn from a start on, along which nothing is near-singular.

        Each stretch ends before a pose that does not close well, or from which on the driven coordinate hardly moves.
        """
        found: list[list[float]] = [[]]
        last = before = math.nan
        for k in range(GRID):
            angle = start + TURN * k / GRID
            try:
                value = self._value(driven, angle)
            except UnreachableError:
                value = math.nan
            way = math.remainder(value - last, TURN) if driven.endswith(".phi") else value - last
            if math.isnan(value) or abs(way) < MOVING * TURN / GRID or way * before < 0.0:
                found.append([])
                before = math.nan
            else:
                found[-1].append(angle)
                before = way
            last = value
        return [stretch[EDGE:-EDGE] for stretch in found if len(stretch) > SAMPLES + 2 * EDGE]

    def _value(self, coordinate: str, crank: float) -> float:
        body, _, letter = coordinate.partition(".")
        at, phi = self.poses(OnFloats(), crank)[body]
        return {"x": at.real, "y": at.imag, "phi": phi}[letter]

    def _pins(self) -> tuple[Revolute, ...]:
        ends: dict[str, list[str]] = {}
        for body, points in self.points.items():
            for point in points:
                ends.setdefault(point, []).append(f"{body}.{point}")
        return tuple(Revolute(name, (pair[0], pair[1])) for name, pair in ends.items() if len(pair) == 2)


# ------------------------------------------------------------------------------------------------------- linkages


def fourbar(ground: float, crank: float, coupler: float, rocker: float, side: int) -> Linkage:
    """A four-bar, its crank's pivot at (0, 0) and its rocker's at (ground, 0)."""

    def poses(plane: Any, u: Any) -> dict[str, Pose]:
        c = plane.at(ground, 0.0)
        p = plane.turned(u, crank)
        q = plane.meet(p, coupler, c, rocker, side)
        return {
            "crank": Pose(plane.at(0.0, 0.0), u),
            "coupler": Pose(p, plane.heading(q - p)),
            "rocker": Pose(c, plane.heading(q - c)),
        }

    points = {
        "ground": {"O": (0.0, 0.0), "C": (ground, 0.0)},
        "crank": {"O": (0.0, 0.0), "P": (crank, 0.0)},
        "coupler": {"P": (0.0, 0.0), "Q": (coupler, 0.0)},
        "rocker": {"C": (0.0, 0.0), "Q": (rocker, 0.0)},
    }
    return Linkage(points, poses)


def slider_crank(crank: float, rod: float, offset: float, side: int, *, has_block: bool) -> Linkage:
    """A slider-crank whose rod ends on y = offset, in a block that slides or as a pin in a slot."""

    def poses(plane: Any, u: Any) -> dict[str, Pose]:
        p = plane.turned(u, crank)
        s = plane.meet_level(p, rod, offset, side)
        moving = {"crank": Pose(plane.at(0.0, 0.0), u), "rod": Pose(p, plane.heading(s - p))}
        return {**moving, "block": Pose(s, 0.0)} if has_block else moving

    points: dict[str, dict[str, tuple[float, float]]] = {
        "ground": {"O": (0.0, 0.0), "way": (0.0, offset)},
        "crank": {"O": (0.0, 0.0), "P": (crank, 0.0)},
        "rod": {"P": (0.0, 0.0), "S": (rod, 0.0)},
    }
    if has_block:
        points["block"] = {"S": (0.0, 0.0)}
        return Linkage(points, poses, (Translational("slide", ("ground.way", "block.S")),))
    return Linkage(points, poses, (PointOnLine("slot", ("ground.way", "rod.S")),))


@dataclass(frozen=True)
class Dyad:
    """Two bars that meet in T: their lengths, and on which side of the line between their other ends."""

    first: float
    second: float
    side: int


def watt(base: Linkage, r: tuple[float, float], s: tuple[float, float], dyad: Dyad) -> Linkage:
    """Watt I: a four-bar with two more bars, from a third pin of its coupler and of its rocker."""

    def poses(plane: Any, u: Any) -> dict[str, Pose]:
        moving = base.poses(plane, u)
        at_r, at_s = (
            moving[body].at + plane.turned(moving[body].phi, *point) for body, point in (("coupler", r), ("rocker", s))
        )
        t = plane.meet(at_r, dyad.first, at_s, dyad.second, dyad.side)
        return {**moving, "left": Pose(at_r, plane.heading(t - at_r)), "right": Pose(at_s, plane.heading(t - at_s))}

    points = {body: dict(points) for body, points in base.points.items()}
    points["coupler"]["R"], points["rocker"]["S"] = r, s
    points["left"] = {"R": (0.0, 0.0), "T": (dyad.first, 0.0)}
    points["right"] = {"S": (0.0, 0.0), "T": (dyad.second, 0.0)}
    return Linkage(points, poses)


def stephenson(base: Linkage, r: tuple[float, float], d: tuple[float, float], dyad: Dyad) -> Linkage:
    """Stephenson III: a four-bar with a link from a third pin of its coupler to an output on a third ground pivot."""

    def poses(plane: Any, u: Any) -> dict[str, Pose]:
        moving = base.poses(plane, u)
        at_d, at_r = plane.at(*d), moving["coupler"].at + plane.turned(moving["coupler"].phi, *r)
        t = plane.meet(at_r, dyad.first, at_d, dyad.second, dyad.side)
        return {**moving, "link": Pose(at_r, plane.heading(t - at_r)), "output": Pose(at_d, plane.heading(t - at_d))}

    points = {body: dict(points) for body, points in base.points.items()}
    points["ground"]["D"], points["coupler"]["R"] = d, r
    points["link"] = {"R": (0.0, 0.0), "T": (dyad.first, 0.0)}
    points["output"] = {"D": (0.0, 0.0), "T": (dyad.second, 0.0)}
    return Linkage(points, poses)


# ----------------------------------------------------------------------------------------------- what is drawn


def lengths(low: float, high: float) -> st.SearchStrategy[float]:
    """Lengths in thousandths, so that they read well."""
    return st.integers(round(1000 * low), round(1000 * high)).map(lambda n: n / 1000)


def places(reach: float) -> st.SearchStrategy[tuple[float, float]]:
    """Points of a square about the origin."""
    return st.tuples(lengths(-reach, reach), lengths(-reach, reach))


SIDES = st.sampled_from([1, -1])
ANGLES = st.floats(0.0, TURN)
RATES = st.tuples(st.floats(0.2, 2.0), st.floats(-2.0, 2.0))  # [rad/s] and [rad/s2] of the crank

KINDS = ("double crank", "crank-rocker", "double rocker", "rocker-crank", "triple rocker")


@st.composite
def fourbars(draw: st.DrawFn, kind: str | None = None) -> Linkage:
    """A four-bar of one of Grashof's kinds, or of any."""
    kind = draw(st.sampled_from(KINDS)) if kind is None else kind
    shortest, second, third = sorted(draw(st.lists(lengths(0.5, 3.0), min_size=3, max_size=3, unique=True)))
    edge = second + third - shortest  # of the longest: beyond it the linkage is not Grashof's any more
    if kind == "triple rocker":
        low, high = max(third, edge + 0.1), edge + 2 * shortest - 0.1
    else:
        low, high = third, edge - 0.1
    assume(low + 0.001 < high)
    others = draw(st.permutations([second, third, draw(lengths(low, high))]))
    place = draw(st.integers(0, 3)) if kind == "triple rocker" else KINDS.index(kind)  # ground, crank, coupler, rocker
    bars = [*others[:place], shortest, *others[place:]]
    return fourbar(*bars, draw(SIDES))


@st.composite
def dyads(draw: st.DrawFn, a: complex, b: complex) -> Dyad:
    """Two bars so long that they join two points."""
    t = 0.5 * (a + b) + complex(*draw(places(2.5)))
    assume(min(abs(t - a), abs(t - b)) > 0.3)
    return Dyad(round(abs(t - a), 3), round(abs(t - b), 3), 1 if ((t - a) * (b - a).conjugate()).imag > 0 else -1)


@st.composite
def closed(draw: st.DrawFn, linkage: Linkage) -> dict[str, Pose]:
    """A pose of a linkage, far from singular."""
    stretches = linkage.stretches(0.0, "crank.phi")
    assume(stretches)
    return linkage.poses(OnFloats(), draw(st.sampled_from([angle for stretch in stretches for angle in stretch])))


def _world(pose: Pose, point: tuple[float, float]) -> complex:
    return pose.at + OnFloats().turned(pose.phi, *point)


@st.composite
def watts(draw: st.DrawFn) -> Linkage:
    """A Watt I six-bar."""
    base, r, s = draw(fourbars()), draw(places(2.0)), draw(places(2.0))
    at = draw(closed(base))
    return watt(base, r, s, draw(dyads(_world(at["coupler"], r), _world(at["rocker"], s))))


@st.composite
def stephensons(draw: st.DrawFn) -> Linkage:
    """A Stephenson III six-bar."""
    base, r, d = draw(fourbars()), draw(places(2.0)), draw(places(3.0))
    return stephenson(base, r, d, draw(dyads(_world(draw(closed(base))["coupler"], r), complex(*d))))


# ------------------------------------------------------------------------------------------------------- the tests


@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data(), start=ANGLES, rates=RATES)
@settings(max_examples=EXAMPLES // 3, phases=PHASES)
@pytest.mark.few(2)
def test_four_bars_of_every_kind_move_as_the_closed_form_says(
    kind: str, data: st.DataObject, start: float, rates: tuple[float, float]
) -> None:
    linkage = data.draw(fourbars(kind))
    driven = data.draw(st.sampled_from(["crank.phi", "coupler.phi", "rocker.phi"]))
    assert_moves_exactly(linkage, start, driven, rates)


@given(
    crank=lengths(0.3, 2.0),
    rod=lengths(0.5, 4.0),
    offset=lengths(-1.5, 1.5),
    side=SIDES,
    has_block=st.booleans(),
    data=st.data(),
    start=ANGLES,
    rates=RATES,
)
@settings(max_examples=EXAMPLES, phases=PHASES)
def test_slider_cranks_move_as_the_closed_form_says(
    crank: float,
    rod: float,
    offset: float,
    side: int,
    has_block: bool,
    data: st.DataObject,
    start: float,
    rates: tuple[float, float],
) -> None:
    linkage = slider_crank(crank, rod, offset, side, has_block=has_block)
    driven = data.draw(st.sampled_from(["crank.phi", "rod.phi", *(["block.x"] if has_block else [])]))
    assert_moves_exactly(linkage, start, driven, rates)


@given(data=st.data(), start=ANGLES, rates=RATES)
@settings(max_examples=2 * EXAMPLES // 3, phases=PHASES)
def test_watt_six_bars_move_as_the_closed_form_says(
    data: st.DataObject, start: float, rates: tuple[float, float]
) -> None:
    linkage = data.draw(watts())
    assert_moves_exactly(linkage, start, data.draw(st.sampled_from(["crank.phi", "rocker.phi", "right.phi"])), rates)


@given(data=st.data(), start=ANGLES, rates=RATES)
@settings(max_examples=2 * EXAMPLES // 3, phases=PHASES)
def test_stephenson_six_bars_move_as_the_closed_form_says(
    data: st.DataObject, start: float, rates: tuple[float, float]
) -> None:
    linkage = data.draw(stephensons())
    assert_moves_exactly(linkage, start, data.draw(st.sampled_from(["crank.phi", "output.phi"])), rates)


def test_what_is_drawn_is_of_the_kind_asked_for() -> None:
    seen: Counter[str] = Counter()

    @given(data=st.data(), kind=st.sampled_from(KINDS))
    @settings(max_examples=40)
    def draw(data: st.DataObject, kind: str) -> None:
        points = data.draw(fourbars(kind)).points
        bars = [points["ground"]["C"][0], points["crank"]["P"][0], points["coupler"]["Q"][0], points["rocker"]["Q"][0]]
        shortest, longest = min(bars), max(bars)
        is_grashof = shortest + longest < sum(bars) - shortest - longest
        assert (KINDS[bars.index(shortest)] if is_grashof else "triple rocker") == kind
        seen[kind] += 1

    draw()
    assert set(seen) == set(KINDS)


def assert_moves_exactly(linkage: Linkage, start: float, driven: str, rates: tuple[float, float]) -> None:
    """Along a stretch of the motion, there and back, every coordinate is what the closed forms say."""
    stretches = linkage.stretches(start, driven)
    assume(stretches)
    angles = max(stretches, key=len)
    step = len(angles) // SAMPLES
    along = angles[len(angles) // 2 :: step] + angles[:: -3 * step]  # from the middle to the end, and all the way back
    moves = [linkage.exact(Series([angle, rates[0], rates[1] / 2])) for angle in along]
    inputs = [_unrolled([move[driven].c[0] for move in moves], driven)]
    inputs += [[float(mp.factorial(k) * move[driven].c[k]) for move in moves] for k in (1, 2)]
    driver = driver_of(driven, inputs[0][0])
    mechanism = linkage.mechanism(along[0], driver)
    run = kinfmu.solve(mechanism, **dict(zip(driver.inputs(), inputs, strict=True)))
    assert run.good.all(), run.mechanism_text
    for order in range(3):
        exact = {name: [mp.factorial(order) * move[name].c[order] for move in moves] for name in moves[0]}
        for letters in (("x", "y"), ("phi",)):
            columns = [name for name in exact if name.rpartition(".")[2] in letters]
            _assert_close(run, {name: exact[name] for name in columns}, order, rates[0] ** order)


def _assert_close(run: Run, exact: Mapping[str, list[Any]], order: int, least: float) -> None:
    """Columns of a kind agree; `least` is their largest magnitude where they stand still."""
    largest = max(least, *(abs(value) for column in exact.values() for value in column))
    for name, column in exact.items():
        coordinate = read_coordinate(name)
        assert coordinate is not None
        for ours, value in zip(run[coordinate.derivative(order)], column, strict=True):
            gap = mp.mpf(float(ours)) - value
            if name.endswith(".phi") and order == 0:
                gap -= 2 * mp.pi * mp.nint(gap / (2 * mp.pi))
            assert abs(gap) <= AGREEMENT * largest, (name, order, run.mechanism_text)


def _unrolled(values: list[Any], driven: str) -> list[float]:
    """Values as doubles; of an angle those turns that make it continuous."""
    if not driven.endswith(".phi"):
        return [float(value) for value in values]
    unrolled = [values[0]]
    for value in values[1:]:
        unrolled.append(value + 2 * mp.pi * mp.nint((unrolled[-1] - value) / (2 * mp.pi)))
    return [float(value) for value in unrolled]


def driver_of(driven: str, start: float) -> Driver:
    law = ConstantSpeed(start, 1.0)
    if driven == "block.x":
        return SlideDriver("drive", ("ground.way", "block.S"), law=law)
    return AngleDriver("drive", driven.partition(".")[0], law)
