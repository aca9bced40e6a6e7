"""Mechanisms written by hand in frames along their bars, and their motion against that of an imported file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute, RunSettings
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.toml_file import parse

SAMPLES = 25
AGREEMENT = 1e-9  # of lengths about 1 to 100 and angles

Members = Callable[["Drawn"], Iterable[Joint | Driver]]


def places_of(text: str) -> dict[str, tuple[float, float]]:
    """'O 0 0, A 1 0' as places by name."""
    return {name: (float(x), float(y)) for name, x, y in (part.split() for part in text.split(","))}


def words_of(text: str) -> dict[str, list[str]]:
    """'crank O A, rod A B' as lists by name."""
    return {name: words for name, *words in (part.split() for part in text.split(",") if part.strip())}


@dataclass
class Drawn:
    """A drawing in words: where its points are, which bars hold them, what pins join; and what else there is.

    turns: body and speed [rpm, counter-clockwise]; others: further joints and drivers.
    """

    places: dict[str, tuple[float, float]]
    bars: dict[str, list[str]]
    pins: str
    turns: dict[str, float] = field(default_factory=dict)
    others: Members = lambda _: ()
    stop: float = 0.0
    unit: str = "cm"

    def angle(self, body: str) -> float:
        """Angle of the frame of a body in the drawing."""
        if body == "ground":
            return 0.0
        first, *others = (self.places[point] for point in self.bars[body])
        return math.atan2(others[0][1] - first[1], others[0][0] - first[0]) if others else 0.0

    def body(self, name: str) -> Body:
        turn, (x, y) = self.angle(name), self.places[self.bars[name][0]]
        points = {}
        for point, place in self.places.items():
            d = complex(place[0] - x, place[1] - y) * complex(math.cos(turn), -math.sin(turn))
            points[point] = (d.real, d.imag)
        return Body(name, points, (x, y, turn))

    def distance(self, a: str, b: str) -> float:
        return math.dist(self.places[a], self.places[b])

    def mechanism(self) -> Mechanism:
        others = list(self.others(self))
        joints = [
            Revolute(f"{pin}_{k}", (f"{bodies[0]}.{pin}", f"{other}.{pin}"))
            for pin, bodies in words_of(self.pins).items()
            for k, other in enumerate(bodies[1:])
        ]
        drivers: list[Driver] = [
            AngleDriver(body, body, ConstantSpeed(self.angle(body), rpm * math.pi / 30.0))
            for body, rpm in self.turns.items()
        ]
        speeds = [abs(rpm) for rpm in self.turns.values() if rpm]
        return Mechanism(
            "by_hand",
            (Body("ground", self.places), *map(self.body, self.bars)),
            (*joints, *(other for other in others if isinstance(other, Joint))),
            (*drivers, *(other for other in others if isinstance(other, Driver))),
            run=RunSettings(0.0, self.stop or 60.0 / min(speeds), 0.01),
            length_unit=self.unit,
        )


def assert_moves_as(text: str, drawn: Drawn) -> Mechanism:
    """The points that a mechanism file shares with bars by hand have the same places, speeds and accelerations."""
    imported, by_hand = parse(text), drawn.mechanism()
    assert imported.length_unit == by_hand.length_unit
    points = {point: f"{body}.{point}" for body, held in drawn.bars.items() for point in held}
    holders = {
        point: f"{body.name}.{point}"
        for body in sorted(imported.moving_bodies, key=lambda body: body.name in drawn.bars)
        for point in body.points
        if point in drawn.bars.get(body.name, [point])
    }
    shared = [point for point in points if point in holders]
    assert shared
    settings = RunSettings(0.0, by_hand.run.stop, by_hand.run.stop / SAMPLES)
    runs = [
        kinfmu.solve(replace(one, points={f"at_{point}": of[point] for point in shared}, run=settings))
        for one, of in ((imported, holders), (by_hand, points))
    ]
    assert all(run.good.all() for run in runs)
    for point in shared:
        for column in ("x", "y", "vx", "vy", "ax", "ay"):
            ours, theirs = (run[f"at_{point}.{column}"] for run in runs)
            size = max(1.0, float(np.abs(theirs).max()))
            assert np.abs(ours - theirs).max() <= AGREEMENT * size, (point, column)
    return imported


def assert_checks(mechanism: Mechanism) -> None:
    """`kinfmu check` finds no problem."""
    assert kinfmu.check(mechanism).problem is None
