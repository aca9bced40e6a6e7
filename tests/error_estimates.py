"""How well a run's error estimates tell its true errors: families of mechanisms against closed forms of 50 digits.

    coverage          share of the numbers with |ours - exact| <= max(estimate, eps * scale)
    overestimation    estimate / max(|ours - exact|, eps * scale), median

ours and exact: the largest error among the columns of a sample, lengths relative to the mechanism's size, for q, qd and
qdd apart; scale: the largest magnitude among them. Exact is the motion at the doubles that the drivers were given, with
the decimal lengths of the mechanism. `measured(family, seed, count)` gives the numbers of a family, `python -m
tests.error_estimates` a table of all families.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

import kinfmu
from kinfmu import AngleDriver, ConstantSpeed, Mechanism
from kinfmu.mechanism.drivers import Driver
from kinfmu.plan import compile_plan
from kinfmu.run import Run
from kinfmu.units import read_coordinate
from tests.mechanism.gallery import geometry
from tests.mechanism.gallery.references import REFERENCES
from tests.power_series import Series, mp
from tests.test_random_mechanisms import (
    TURN,
    Dyad,
    Linkage,
    OnFloats,
    Pose,
    UnreachableError,
    driver_of,
    fourbar,
    slider_crank,
    stephenson,
    watt,
)

EPS = 2.0**-52
ORDERS = ("q", "qd", "qdd")
Exact = Mapping[str, Series]  # every coordinate at a sample, as a series in time
Rng = np.random.Generator


class Number(NamedTuple):
    """One estimate with the true error."""

    family: str
    order: str
    status: int
    error: float
    estimate: float
    scale: float
    place: str  # what reproduces it

    @property
    def is_covered(self) -> bool:
        """True if the estimate, or a rounding of the largest magnitude, is at least the error."""
        return self.error <= max(self.estimate, EPS * self.scale)

    @property
    def overestimation(self) -> float:
        """How many times too large the estimate is; 1 for an estimate of nothing where nothing moves."""
        least = max(self.error, EPS * self.scale)
        return self.estimate / least if least else 1.0 if self.estimate == 0.0 else math.inf

    @property
    def underestimation(self) -> float:
        """How many times too small it is."""
        most = max(self.estimate, EPS * self.scale)
        return self.error / most if most else 0.0 if self.error == 0.0 else math.inf


class Statistics(NamedTuple):
    """Coverage and overestimation of a set of estimates."""

    count: int
    coverage: float
    overestimation: float  # median
    worst: float  # largest error over max(estimate, eps * scale)


def statistics(numbers: Sequence[Number]) -> Statistics:
    """Return coverage and median overestimation."""
    worst = max(number.underestimation for number in numbers)
    return Statistics(
        len(numbers),
        sum(number.is_covered for number in numbers) / len(numbers),
        float(np.median([number.overestimation for number in numbers])),
        worst,
    )


def compared(family: str, place: str, run: Run, size: float, exact: Sequence[Exact]) -> Iterator[Number]:
    """Yield the estimates of a run with its errors; samples without numbers are left out."""
    coordinates = {name: coordinate for name in exact[0] if (coordinate := read_coordinate(name)) is not None}
    columns = {
        name: [run[coordinate.derivative(order)].tolist() for order in range(3)]
        for name, coordinate in coordinates.items()
    }
    for k, motion in enumerate(exact):
        if not run.good[k]:
            continue
        for order in range(3):
            error = scale = mp.zero
            for name, series in motion.items():
                coordinate = coordinates[name]
                unit = 1 if coordinate.is_angle else mp.mpf(size)
                value = mp.factorial(order) * series.c[order]
                gap = mp.mpf(columns[name][order][k]) - value
                if coordinate.is_angle and order == 0:
                    gap -= 2 * mp.pi * mp.nint(gap / (2 * mp.pi))
                    value = mp.mpf(columns[name][0][k])  # with the turns kept
                error, scale = max(error, abs(gap) / unit), max(scale, abs(value) / unit)
            estimate = float(run.error[k, order])
            yield Number(
                family, ORDERS[order], int(run.status[k]), float(error), estimate, float(scale), f"{place}, sample {k}"
            )


# ---------------------------------------------------------------------------------------------------- families


Family = Callable[[Rng], Iterable[Number]]
FAMILIES: dict[str, Family] = {}


def family(make: Family) -> Family:
    """Enter a function that measures one random mechanism."""
    FAMILIES[make.__name__] = make
    return make


def measured(name: str, seed: int, count: int) -> list[Number]:
    """The numbers of `count` random mechanisms of a family."""
    return [
        number._replace(family=name, place=f"{name} seed {seed} mechanism {k}: {number.place}")
        for k in range(count)
        for number in FAMILIES[name](np.random.default_rng([seed, k]))
    ]


def _rates(rng: Rng, reach: float = 1.0) -> tuple[float, float]:
    """Speed and acceleration of a driver, slow ones and fast ones."""
    speed = float(rng.choice([-1, 1]) * 10.0 ** rng.uniform(-2.0, 4.0)) * reach
    return speed, float(rng.choice([0.0, rng.normal() * speed * speed / reach]))


def _solved(
    mechanism: Mechanism, inputs: Mapping[str, Sequence[float]], exact: Sequence[Exact], place: str
) -> Iterator[Number]:
    plan = compile_plan(mechanism)
    yield from compared("", place, kinfmu.solve(plan, **inputs), plan.size, exact)


@family
def gallery(rng: Rng) -> Iterator[Number]:
    """Samples of a mechanism of the gallery at its laws' values, rounded to doubles."""
    name = str(rng.choice(sorted(REFERENCES)))
    member, mechanism = REFERENCES[name], kinfmu.load(name)
    run = mechanism.run
    span = run.stop - run.start
    edge = member.first * run.step
    times = np.sort(rng.uniform(run.start + edge, run.stop - edge, 12)) if span else np.array([run.start])
    inputs: dict[str, list[float]] = {}
    moves = []
    for t in times:
        drives = []
        for driver, series in zip(mechanism.drivers, member.inputs(float(t)).values(), strict=True):
            numbers = [float(mp.factorial(k) * series.c[k]) for k in range(3)]
            drives.append(Series([numbers[0], numbers[1], mp.mpf(numbers[2]) / 2]))
            for column, number in zip(driver.inputs(), numbers, strict=True):
                inputs.setdefault(column, []).append(number)
        constant = Series([0, 0, 0])
        moves.append({name: constant + value for name, value in member.coordinates(*drives).items()})
    yield from _solved(mechanism, inputs, moves, name)


def _drawn_fourbar(rng: Rng) -> Linkage:
    """A four-bar of any kind that can be assembled."""
    while True:
        bars = [round(float(x), 3) for x in rng.uniform(0.5, 3.0, 4)]
        if max(bars) < sum(bars) - max(bars) - 0.1:
            return fourbar(*bars, int(rng.choice([1, -1])))


def _drawn_slider_crank(rng: Rng) -> Linkage:
    crank, rod, offset = (round(float(rng.uniform(a, b)), 3) for a, b in ((0.3, 2.0), (0.5, 4.0), (-1.0, 1.0)))
    return slider_crank(crank, rod, offset, int(rng.choice([1, -1])), has_block=bool(rng.random() < 0.6))


def _drawn_six_bar(rng: Rng) -> Linkage:
    while True:
        base = _drawn_fourbar(rng)
        angle = _closing(base, rng)
        if angle is None:
            continue
        at = base.poses(OnFloats(), angle)
        r, s = (tuple(round(float(x), 3) for x in rng.uniform(-2.0, 2.0, 2)) for _ in range(2))
        on_coupler = at["coupler"].at + OnFloats().turned(at["coupler"].phi, *r)
        if rng.random() < 0.5:
            on_rocker = at["rocker"].at + OnFloats().turned(at["rocker"].phi, *s)
            dyad = _dyad(rng, on_coupler, on_rocker)
            return watt(base, r, s, dyad)
        return stephenson(base, r, s, _dyad(rng, on_coupler, complex(*s)))


def _dyad(rng: Rng, a: complex, b: complex) -> Dyad:
    while True:
        t = 0.5 * (a + b) + complex(*rng.uniform(-2.5, 2.5, 2))
        if min(abs(t - a), abs(t - b)) > 0.3:
            side = 1 if ((t - a) * (b - a).conjugate()).imag > 0 else -1
            return Dyad(round(abs(t - a), 3), round(abs(t - b), 3), side)


def _closing(linkage: Linkage, rng: Rng) -> float | None:
    """A crank angle where a linkage closes, far from singular."""
    for angle in rng.uniform(0.0, TURN, 30):
        try:
            linkage.poses(OnFloats(), float(angle))
        except UnreachableError:
            continue
        return float(angle)
    return None


def _driven(linkage: Linkage, rng: Rng, draw: Sequence[str], place: str, size: float = 1.0) -> Iterator[Number]:
    """A linkage driven at one of its coordinates along a stretch of its motion, turns away too."""
    coordinate = str(rng.choice(draw))
    stretches = linkage.stretches(float(rng.uniform(0.0, TURN)), coordinate)
    if not stretches:
        return
    angles = max(stretches, key=len)
    chosen = sorted(rng.choice(angles, 6, replace=False).tolist())
    driver = driver_of(coordinate, 0.0)
    turns = int(rng.choice([0, 0, 0, 1, 30])) if len(angles) > 225 and coordinate.endswith(".phi") else 0
    exact, inputs = [], {name: [] for name in driver.inputs()}  # type: dict[str, list[float]]
    previous = None
    for angle in chosen:
        value = linkage.exact(Series([angle, 0, 0]))[coordinate].c[0]
        if previous is not None and coordinate.endswith(".phi"):
            value += 2 * mp.pi * mp.nint((previous - value) / (2 * mp.pi))
        previous = value
        numbers = (float(value + 2 * mp.pi * turns), *_rates(rng, size if coordinate.endswith(".x") else 1.0))
        exact.append(_at(linkage, angle, coordinate, numbers))
        for column, number in zip(inputs, numbers, strict=True):
            inputs[column].append(number)
    mechanism = _closed(linkage, chosen[0], driver_of(coordinate, inputs[driver.inputs()[0]][0]))
    yield from _solved(mechanism, inputs, exact, f"{place} {coordinate} driven, {turns} turns")


def _at(linkage: Linkage, angle: float, coordinate: str, wanted: tuple[float, float, float]) -> Exact:
    """The motion in which the driven coordinate is exactly what was given in doubles: Newton on series of the crank."""
    target = Series([wanted[0], wanted[1], mp.mpf(wanted[2]) / 2])
    crank = Series([angle, 0, 0])
    if coordinate == "crank.phi":
        return linkage.exact(target)
    for _ in range(9):
        slope = linkage.exact(Series([crank.c[0], 1, 0]))[coordinate].c[1]
        gap = linkage.exact(crank)[coordinate] - target
        if coordinate.endswith(".phi"):
            gap = gap - 2 * mp.pi * mp.nint(gap.c[0] / (2 * mp.pi))
        crank = crank - gap / slope
        if max(abs(x) for x in (gap / slope).c) < mp.mpf(10) ** -60 * (1 + max(abs(x) for x in target.c)):
            break
    return linkage.exact(crank)


@family
def four_bars(rng: Rng) -> Iterator[Number]:
    """Four-bars of every kind, driven at any body."""
    yield from _driven(_drawn_fourbar(rng), rng, ["crank.phi", "coupler.phi", "rocker.phi"], "")


@family
def slider_cranks(rng: Rng) -> Iterator[Number]:
    """Slider-cranks driven at the crank, the rod or the block: rates in radians and in lengths."""
    linkage = _drawn_slider_crank(rng)
    yield from _driven(
        linkage, rng, ["crank.phi", "rod.phi", *(["block.x"] * 2 if "block" in linkage.points else [])], ""
    )


@family
def six_bars(rng: Rng) -> Iterator[Number]:
    """Watt and Stephenson six-bars."""
    linkage = _drawn_six_bar(rng)
    last = "right.phi" if "right" in linkage.points else "output.phi"
    yield from _driven(linkage, rng, ["crank.phi", "rocker.phi", last], "")


@family
def chains(rng: Rng) -> Iterator[Number]:
    """Loops one after another, each rocker the next loop's crank: nearly parallelograms, some of them just that."""
    n = int(rng.choice([2, 3, 5, 8, 20, 60]))
    loops = []
    for ground, crank in _cranks(rng, n):
        more = rng.choice([0.0, 1.0]) * rng.uniform(-0.02, 0.02, 2)
        loops.append((ground, crank, round(ground + float(more[0]), 3), round(crank + float(more[1]), 3)))
    yield from _crank_turned(_chain(loops), rng, rng.uniform(0.9, 2.2, 4), 1.5, f"{n} loops")


@family
def parallel_chains(rng: Rng) -> Iterator[Number]:
    """Parallelograms in a row: every prediction is exact, so that rounding leaves next to no error to estimate."""
    n = int(rng.choice([2, 3, 5, 8, 20, 60]))
    loops = [(ground, crank, ground, crank) for ground, crank in _cranks(rng, n)]
    yield from _crank_turned(_chain(loops), rng, rng.uniform(0.4, 2.7, 4), 1.0, f"{n} loops")


def _cranks(rng: Rng, n: int) -> list[tuple[float, float]]:
    """Ground and crank of n loops of a chain."""
    return [(round(float(rng.uniform(1.5, 3.0)), 3), round(float(rng.uniform(0.8, 1.2)), 3)) for _ in range(n)]


def _chain(loops: Sequence[tuple[float, float, float, float]]) -> Linkage:
    """Four-bars in a row; ground, crank, coupler, rocker of each, the rocker's bar being the next one's crank."""

    def poses(plane: Any, u: Any) -> dict[str, Pose]:
        moving = {"crank": Pose(plane.at(0.0, 0.0), u)}
        angle, x = u, 0.0
        for k, (ground, crank, coupler, rocker) in enumerate(loops):
            here = plane.at(x, 0.0)
            x = round(x + ground, 3)
            there = plane.at(x, 0.0)
            p = here + plane.turned(angle, crank)
            q = plane.meet(p, coupler, there, rocker, 1)
            angle = plane.heading(q - there)
            moving[f"coupler{k}"] = Pose(p, plane.heading(q - p))
            moving[f"rocker{k}"] = Pose(there, angle)
        return moving

    points: dict[str, dict[str, tuple[float, float]]] = {"ground": {"O": (0.0, 0.0)}, "crank": {"O": (0.0, 0.0)}}
    x, before = 0.0, "crank"
    for k, (ground, crank, coupler, rocker) in enumerate(loops):
        x = round(x + ground, 3)
        points["ground"][f"C{k}"] = (x, 0.0)
        points[before][f"P{k}"] = (crank, 0.0)
        points[f"coupler{k}"] = {f"P{k}": (0.0, 0.0), f"Q{k}": (coupler, 0.0)}
        points[f"rocker{k}"] = {f"C{k}": (0.0, 0.0), f"Q{k}": (rocker, 0.0)}
        before = f"rocker{k}"
    return Linkage(points, poses)


@family
def near_dead_centres(rng: Rng) -> Iterator[Number]:
    """Four-bars and slider-cranks just before the limit of their crank."""
    while True:
        if rng.random() < 0.5:
            a, b, c, d = (round(float(x), 3) for x in rng.uniform(0.5, 3.0, 4))  # ground, crank, coupler, rocker
            if not (a + b > c + d + 0.05 and abs(a - b) < c + d - 0.2 and abs(a - b) > abs(c - d) + 0.05):
                continue
            side = int(rng.choice([1, -1]))
            lengths = [mp.mpf(repr(x)) for x in (a, b, c, d)]
            cosine = (lengths[0] ** 2 + lengths[1] ** 2 - (lengths[2] + lengths[3]) ** 2) / (
                2 * lengths[0] * lengths[1]
            )
            limit, linkage = mp.acos(cosine), fourbar(a, b, c, d, side)
        else:
            crank, rod = round(float(rng.uniform(1.0, 2.0)), 3), round(float(rng.uniform(0.5, 0.9)), 3)
            side = int(rng.choice([1, -1]))
            linkage = slider_crank(crank, rod, 0.0, side, has_block=True)
            limit = mp.asin(mp.mpf(repr(rod)) / mp.mpf(repr(crank)))
        break
    angles = [float(limit - mp.mpf(10) ** -k) for k in sorted(rng.uniform(1.0, 12.0, 6))]
    yield from _crank_turned(linkage, rng, angles, float(limit) - 0.4, f"before {float(limit)!r}")


@family
def near_change_points(rng: Rng) -> Iterator[Number]:
    """Four-bars that stretch flat, or almost: crossed by bridges, or passed near by on one branch."""
    g, a = round(float(rng.uniform(2.0, 3.0)), 3), round(float(rng.uniform(0.6, 1.0)), 3)
    b = round(float(rng.uniform(1.2, 2.0)), 3)
    miss = float(f"{10.0 ** rng.uniform(-9.0, -1.5):.3g}") if rng.random() < 0.5 else 0.0
    c = round(g + a - b, 3)  # flat at crank = pi: ground + crank = coupler + rocker
    if abs(b - c) > g - a - 0.2:
        c, b = b, round(g + a - b, 3)
        if abs(b - c) > g - a - 0.2:
            return
    c = float(repr(round(c + miss, 15)))
    side = int(rng.choice([1, -1]))
    linkage, beyond = fourbar(g, a, b, c, side), fourbar(g, a, b, c, side if miss else -side)
    angles = [
        float(mp.pi + mp.mpf("0.5") * int(rng.choice([1, -1])) * mp.mpf(10) ** -k) for k in rng.uniform(0.0, 6.0, 8)
    ]

    def exact(u: Series) -> Exact:
        return (beyond if u.c[0] > mp.pi else linkage).exact(u)

    yield from _crank_turned(linkage, rng, angles, 2.2, f"missed by {miss!r}, sides {side}", exact)


@family
def scaled(rng: Rng) -> Iterator[Number]:
    """Linkages of all sizes from 1e-6 to 1e6 times those above."""
    scale = 10.0 ** int(rng.integers(-6, 7))
    bars = [float(f"{x * scale:.4g}") for x in rng.uniform(0.5, 3.0, 4)]
    side = int(rng.choice([1, -1]))
    if rng.random() < 0.4:
        linkage = slider_crank(bars[0], bars[1] + 2.0 * scale, 0.0, side, has_block=True)
        yield from _driven(linkage, rng, ["crank.phi", "block.x"], f"scale {scale:g}", scale)
    elif max(bars) < sum(bars) - max(bars) - 0.1 * scale:
        yield from _driven(fourbar(*bars, side), rng, ["crank.phi", "rocker.phi"], f"scale {scale:g}", scale)


@family
def long_and_short(rng: Rng) -> Iterator[Number]:
    """Cranks and rockers up to 10 000 times shorter than ground and coupler, or than a rod."""
    ratio = 10.0 ** rng.uniform(1.0, 4.0)
    side = int(rng.choice([1, -1]))
    crank, rocker = (round(float(x), 3) for x in rng.uniform(0.5, 2.0, 2))
    ground = round(ratio + float(rng.uniform(-0.5, 0.5)), 3)
    if rng.random() < 0.5:
        linkage = slider_crank(crank, round(ratio, 3), 0.0, side, has_block=True)
        yield from _driven(linkage, rng, ["crank.phi", "block.x"], f"ratio {ratio:g}")
    else:
        coupler = round(ratio + float(rng.uniform(-0.5, 0.5)), 3)
        yield from _driven(fourbar(ground, crank, coupler, rocker, side), rng, ["crank.phi"], f"ratio {ratio:g}")


@family
def turned_far(rng: Rng) -> Iterator[Number]:
    """Thousands of turns away from the start pose."""
    turns = int(10.0 ** rng.uniform(1.0, 3.7))
    shortest, rest = round(float(rng.uniform(0.5, 1.0)), 3), [round(float(x), 3) for x in rng.uniform(1.5, 2.2, 3)]
    bars = [shortest, *rest] if rng.random() < 0.5 else [rest[0], shortest, *rest[1:]]  # double crank, crank-rocker
    if max(rest) + shortest > sum(rest) - max(rest) - 0.1:
        return
    linkage = fourbar(*bars, int(rng.choice([1, -1])))
    yield from _crank_turned(linkage, rng, rng.uniform(0.0, TURN, 3) + TURN * turns, 1.0, f"{turns} turns")


@family
def loops_after_a_limit(rng: Rng) -> Iterator[Number]:
    """Loops driven through one that is nearly locked: what it loses they lose too."""
    while True:
        a, b, c, d = (round(float(x), 3) for x in rng.uniform(0.5, 2.0, 4))
        if a + b > c + d + 0.05 and abs(a - b) < c + d - 0.3 and abs(a - b) > abs(c - d) + 0.05:
            break
    lengths = [mp.mpf(repr(x)) for x in (a, b, c, d)]
    cosine = (lengths[0] ** 2 + lengths[1] ** 2 - (lengths[2] + lengths[3]) ** 2) / (2 * lengths[0] * lengths[1])
    limit = mp.acos(cosine)
    loops = [(a, b, c, d)] + [(round(3 * d, 3), d, round(3.2 * d, 3), round(1.7 * d, 3))] * int(rng.choice([1, 2, 4]))
    linkage = _chain(loops)
    angles = [float(limit - mp.mpf(10) ** -k) for k in rng.uniform(0.5, 8.0, 5)]
    try:
        linkage.poses(OnFloats(), float(limit) - 0.4)
    except UnreachableError:
        return
    yield from _crank_turned(linkage, rng, angles, float(limit) - 0.4, f"before {float(limit)!r}")


@family
def bridged_chains(rng: Rng) -> Iterator[Number]:
    """Parallelograms in a row where they all lie flat."""
    n = int(rng.choice([1, 2, 3, 5]))
    loops = [(ground, crank, ground, crank) for ground, crank in _cranks(rng, n)]
    linkage = _chain(loops)
    turns = int(rng.choice([0, 0, 1, 50]))
    angles = TURN * turns + rng.choice([0.0, math.pi], 5) + rng.choice([1, -1, 0], 5) * 10.0 ** rng.uniform(-9, -1, 5)

    def exact(u: Series) -> Exact:
        x, moving = 0.0, {"crank.x": u * 0, "crank.y": u * 0, "crank.phi": u}
        for k, (ground, crank, _, _) in enumerate(loops):
            pin = geometry.turned(u, crank)
            moving |= {f"coupler{k}.x": pin.x + mp.mpf(repr(x)), f"coupler{k}.y": pin.y, f"coupler{k}.phi": u * 0}
            x = round(x + ground, 3)
            moving |= {f"rocker{k}.phi": u}
        return moving

    yield from _crank_turned(linkage, rng, angles, 1.0, f"{n} loops, {turns} turns", exact)


def _crank_turned(
    linkage: Linkage,
    rng: Rng,
    angles: Iterable[float],
    start: float,
    place: str,
    exact: Callable[[Series], Exact] | None = None,
) -> Iterator[Number]:
    """A linkage driven at its crank, at given angles, from a start angle on."""
    asked = [(float(angle), *_rates(rng)) for angle in angles]
    moves = [(exact or linkage.exact)(Series([u, v, mp.mpf(w) / 2])) for u, v, w in asked]
    driver = driver_of("crank.phi", start)
    inputs = dict(zip(driver.inputs(), map(list, zip(*asked, strict=True)), strict=True))
    yield from _solved(_closed(linkage, start, driver), inputs, moves, place)


def _closed(linkage: Linkage, crank: float, driver: Driver) -> Mechanism:
    """The mechanism started at an angle of its crank, closed to round-off."""
    bodies = [kinfmu.Body("ground", linkage.points["ground"])]
    for name, (at, phi) in linkage.poses(OnFloats(), crank).items():
        bodies.append(kinfmu.Body(name, linkage.points[name], (at.real, at.imag, phi)))
    return Mechanism("drawn", bodies, linkage.mechanism(crank, driver).joints, [driver])


@family
def five_bars(rng: Rng) -> Iterator[Number]:
    """Two cranks driven, two bars that join their tips."""
    while True:
        ground, left, right = (round(float(x), 3) for x in rng.uniform(0.5, 2.0, 3))
        first, second = (round(float(x), 3) for x in rng.uniform(1.0, 3.0, 2))
        u = rng.uniform(0.0, TURN, 2)
        side = int(rng.choice([1, -1]))
        plane = OnFloats()
        p, r = plane.turned(u[0], left), plane.at(ground, 0.0) + plane.turned(u[1], right)
        try:
            q = plane.meet(p, first, r, second, side)
            ends = u + rng.uniform(-0.15, 0.15, 2)
            plane.meet(
                plane.turned(ends[0], left), first, plane.at(ground, 0.0) + plane.turned(ends[1], right), second, side
            )
        except UnreachableError:
            continue
        break
    points = {
        "ground": {"O": (0.0, 0.0), "C": (ground, 0.0)},
        "left": {"O": (0.0, 0.0), "P": (left, 0.0)},
        "right": {"C": (0.0, 0.0), "R": (right, 0.0)},
        "first": {"P": (0.0, 0.0), "Q": (first, 0.0)},
        "second": {"R": (0.0, 0.0), "Q": (second, 0.0)},
    }
    bodies = [kinfmu.Body("ground", points["ground"])]
    starts = {
        "left": (0.0, 0.0, u[0]),
        "right": (ground, 0.0, u[1]),
        "first": (p.real, p.imag, plane.heading(q - p)),
        "second": (r.real, r.imag, plane.heading(q - r)),
    }
    bodies += [kinfmu.Body(name, points[name], tuple(round(float(x), 2) for x in at)) for name, at in starts.items()]
    pins = {"O": ("ground.O", "left.O"), "C": ("ground.C", "right.C"), "P": ("left.P", "first.P")}
    pins |= {"R": ("right.R", "second.R"), "Q": ("first.Q", "second.Q")}
    joints = [kinfmu.Revolute(name, ends) for name, ends in pins.items()]
    drivers = [
        AngleDriver(name, name, ConstantSpeed(float(a), 1.0)) for name, a in zip(("left", "right"), u, strict=True)
    ]
    mechanism = kinfmu.Mechanism("five", bodies, joints, drivers)
    exact: list[Exact] = []
    inputs: dict[str, list[float]] = {name: [] for driver in drivers for name in driver.inputs()}
    for s in rng.uniform(0.0, 1.0, 5):
        at = (u + s * (ends - u)).tolist()
        rates = [_rates(rng), _rates(rng)]
        a, b = (Series([x, v, mp.mpf(w) / 2]) for x, (v, w) in zip(at, rates, strict=True))
        here, there = geometry.turned(a, left), geometry.Vector(ground, 0) + geometry.turned(b, right)
        pin = geometry.meet(here, first, there, second, side)
        exact.append(
            {
                "left.phi": a,
                "right.phi": b,
                "first.x": here.x,
                "first.y": here.y,
                "first.phi": geometry.heading(pin - here, 0),
                "second.x": there.x,
                "second.y": there.y,
                "second.phi": geometry.heading(pin - there, 0),
            }
        )
        for k, driver in enumerate(drivers):
            for column, number in zip(driver.inputs(), (at[k], *rates[k]), strict=True):
                inputs[column].append(number)
    yield from _solved(mechanism, inputs, exact, "")


def main(seed: int, count: int, names: Sequence[str]) -> None:
    print(f"seed {seed}, {count} mechanisms a family")
    print(f"{'family':<20}{'':<5}{'numbers':>9}{'covered':>9}{'median over':>13}{'90 %':>10}{'worst under':>13}")
    every: list[Number] = []
    for name in names or FAMILIES:
        numbers = measured(name, seed, count)
        every += numbers
        for order in ORDERS:
            _line(name, order, [number for number in numbers if number.order == order])
    for order in ORDERS:
        _line("all", order, [number for number in every if number.order == order])
    print("the most underestimated:")
    for number in sorted(every, key=lambda number: -number.underestimation)[:5]:
        print(f"  {number.order}: error {number.error:.2g}, estimate {number.estimate:.2g}: {number.place}")


def _line(name: str, order: str, numbers: list[Number]) -> None:
    result = statistics(numbers)
    ninety = float(np.quantile([number.overestimation for number in numbers], 0.9))
    print(
        f"{name:<20}{order:<5}{result.count:>9}{result.coverage:>9.2%}{result.overestimation:>13.3g}"
        f"{ninety:>10.3g}{result.worst:>13.3g}"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 0, int(sys.argv[2]) if len(sys.argv) > 2 else 20, sys.argv[3:])
