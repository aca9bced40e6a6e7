"""Drivers: arrows, with name and drawn value."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.names import Mark, Name
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.sheet import Sheet, arc
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import CoordinateDriver, DistanceDriver, Driver, SlideDriver
from kinfmu.mechanism.quantities.placement import body_of, unit_vector
from kinfmu.plan.equations.system import size_of

COLOUR: palette.Colour = (185, 28, 28)
_RADII, _TURN = (19.0, 32.0), math.radians(95.0)  # [pt] and [rad], of a curved arrow; the larger one around torques
_PUSH, _DISTANCE = 30.0, 13.0  # [pt]; length of a straight arrow, and its distance from its point
_HEAD, _HALF_HEAD = 7.0, 2.8  # [pt]
_STROKE = 1.4  # [pt]
_TRIES = 12  # places for an arrow that are compared


@dataclass(frozen=True, eq=False)
class Turn(Mark):
    """A curved arrow about a pin; sense: 1.0 counter-clockwise, -1.0 clockwise; heading: of the driven body [rad]."""

    text: str
    centre: FloatArray
    sense: float
    heading: float

    def extent(self) -> FloatArray:
        return self.centre[None]

    def draw(self, sheet: Sheet) -> list[Name]:
        route = self._route(sheet)
        _arrow(sheet, route)
        return [Name(self.text, route[[len(route) // 2, -1, 0]], 4.0, COLOUR, rank=1)]

    def _route(self, sheet: Sheet) -> FloatArray:
        """Return the arc that covers least; the first one compared begins just ahead of the body."""
        radii = [radius * sheet.ornament for radius in _RADII]
        starts = [self.heading + self.sense * (math.radians(25.0) + k * math.tau / _TRIES) for k in range(_TRIES)]
        return _freest(
            sheet, [arc(self.centre, radius, start, start + self.sense * _TURN) for radius in radii for start in starts]
        )


@dataclass(frozen=True, eq=False)
class Push(Mark):
    """A straight arrow next to a point that is driven along a unit vector."""

    text: str
    at: FloatArray
    along: FloatArray

    def extent(self) -> FloatArray:
        return self.at[None]

    def draw(self, sheet: Sheet) -> list[Name]:
        route = self._route(sheet)
        _arrow(sheet, route)
        return [Name(self.text, np.array([route.mean(axis=0), *route[::-1]]), 4.0, COLOUR, rank=1)]

    def _route(self, sheet: Sheet) -> FloatArray:
        size = sheet.ornament
        across = np.array([-self.along[1], self.along[0]])
        half = 0.5 * _PUSH * size * self.along
        shaft = np.array([part * half for part in (-1.0, -0.5, 0.0, 0.5, 1.0)]) + self.at
        offsets = [way * side * across for way in (1.0, 1.6) for side in (1.0, -1.0)]
        return _freest(sheet, [shaft + _DISTANCE * size * offset for offset in offsets])


@dataclass(frozen=True, eq=False)
class Length(Mark):
    """The name and value of a cylinder: ends (2, 2)."""

    text: str
    ends: FloatArray

    def extent(self) -> FloatArray:
        return self.ends

    def draw(self, sheet: Sheet) -> list[Name]:  # noqa: ARG002  it is only a name
        anchors = np.array([self.ends[0] + part * (self.ends[1] - self.ends[0]) for part in (0.4, 0.55, 0.25, 0.75)])
        return [Name(self.text, anchors, 8.0, COLOUR, rank=1)]


def motion(shown: Instant) -> list[Mark]:
    """Return one mark for each driver."""
    return [_mark(shown, driver) for driver in shown.drivers]


def _mark(shown: Instant, driver: Driver) -> Mark:
    value, direction = shown.value(driver.name), shown.directions[driver.name]
    text = f"{driver.name} = {value_text(shown, driver, value)}"
    if isinstance(driver, DistanceDriver):
        return Length(text, np.array([shown.point(end) for end in driver.between]))
    if isinstance(driver, SlideDriver):
        a, b = driver.between
        e = np.array(unit_vector(driver.axis))
        ends = shown.placed(body_of(a), np.array([[0.0, 0.0], e]))
        return Push(text, shown.point(b), direction * (ends[1] - ends[0]))
    if isinstance(driver, CoordinateDriver):
        along = np.array([1.0, 0.0] if driver.axis == "x" else [0.0, 1.0])
        return Push(text, shown.point(driver.of), direction * along)
    *held, body = driver.bodies()
    pin = shown.pivot(body, held[0] if held else GROUND_NAME)
    centre = shown.point(pin) if pin else np.asarray(shown.poses[body][0, :2])
    return Turn(text, centre, direction, _heading(shown, body, centre))


def value_text(shown: Instant, driver: Driver, value: float) -> str:
    """Return a driver's value with its unit, to a tenth of a degree or to four digits of the mechanism's size."""
    if driver.quantity.kind == "angle":
        return f"{round(math.degrees(value), 1) + 0.0:.6g}\N{DEGREE SIGN}"
    finest = 4 - math.ceil(math.log10(size_of(shown.mechanism)))
    return f"{round(value, finest) + 0.0:.6g} {shown.mechanism.length_unit}"


def _heading(shown: Instant, body: str, centre: FloatArray) -> float:
    """Return the angle [rad] of the line from a pin to the point of the body furthest from it."""
    found = next(one for one in shown.mechanism.bodies if one.name == body)
    vectors = [shown.point(f"{body}.{name}") - centre for name in found.points]
    furthest = max(vectors, key=lambda vector: float(np.hypot(*vector)), default=np.zeros(2))
    return math.atan2(furthest[1], furthest[0]) if furthest.any() else shown.angle(body)


def _freest(sheet: Sheet, routes: list[FloatArray]) -> FloatArray:
    """Return the route that covers least; of nearly equal ones the first."""
    covered = sheet.covered
    costs = []
    for k, route in enumerate(routes):
        dots = sheet.to_paper(route)
        near = np.hypot(*(covered[None, :, :2] - dots[:, None, :]).transpose(2, 0, 1)) < 5.0  # [pt]
        costs.append(round(float((near * covered[:, 2]).sum()), 6) + 0.6 * k)
    return routes[int(np.argmin(costs))]


def _arrow(sheet: Sheet, route: FloatArray) -> None:
    """Draw a line with an arrow head at its end."""
    size = sheet.ornament
    tip, before = route[-1], route[-2]
    along = (tip - before) / np.hypot(*(tip - before))
    across = np.array([-along[1], along[0]])
    base = tip - _HEAD * size * along
    sheet.line([*route[:-1], base], _STROKE, COLOUR, matters=1.5)
    head = [tip, base + _HALF_HEAD * size * across, base - _HALF_HEAD * size * across]
    sheet.line(head, 0.4, COLOUR, closed=True, fill=COLOUR, matters=1.5)
