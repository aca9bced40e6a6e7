"""The driver in whose values places of a cam are reported, and its values at angles of the cam."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from kinfmu.analysis.driver_path import DriverPath, follow
from kinfmu.arrays import FloatArray
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.quantities import AngleBetween
from kinfmu.motion.cams import PlacedCam
from kinfmu.motion.cams.profile import TURN
from kinfmu.plan import SolvePlan
from kinfmu.solver.python import Pose

_SAME_ANGLE = 1e-7  # [rad]; closer angles are equal


@dataclass(frozen=True, eq=False)
class CamDriver:
    """A driver of a cam. name: its name; transmission: between it and the cam, None if its value is the cam's angle."""

    name: str
    transmission: Transmission | None = None

    @property
    def is_backward(self) -> bool:
        """True if the angle of the cam falls while the driver's value grows."""
        return self.transmission is not None and self.transmission.travel < 0.0

    def at(self, angle: float) -> float:
        """Return the driver's value at an angle of the cam [rad]: the first one in its period."""
        return angle if self.transmission is None else self.transmission.first(angle)

    def parts(self, begin: float, end: float) -> tuple[tuple[float, float], ...]:
        """Return the parts of a period of the driver in which the cam is between two angles.

        Each is from begin to end in the direction of growing values of the driver; its end is less than its begin where
        it goes on past the period. begin: Angle of the cam [rad], from which the part goes on in the direction of
        growing angles. end: Angle of the cam [rad] at most a turn further, or less than `begin`: the part goes on past
        the turn.
        """
        if self.transmission is None:
            return (_in_period(begin, end, TURN),)
        return self.transmission.parts(begin, end)


@dataclass(frozen=True, eq=False)
class Transmission:
    """The angle of a cam over the path of a driver that repeats; the cam always turns in one direction."""

    path: DriverPath
    placed: PlacedCam

    @cached_property
    def angles(self) -> FloatArray:
        """Angles of the cam at the poses of the path (n,) [rad]."""
        return np.array([self._angle(pose) for pose in self.path.poses])

    @property
    def is_whole(self) -> bool:
        """True if the cam makes a turn, always in one direction."""
        steps = np.diff(self.angles)
        return bool((np.all(steps > 0.0) or np.all(steps < 0.0)) and abs(self.travel) > TURN - 1e-6)

    @property
    def travel(self) -> float:
        """Angle by which the cam turns over the path [rad], negative if it turns backwards."""
        return float(self.angles[-1] - self.angles[0])

    @property
    def turns(self) -> int:
        """Turns of the cam in a period of the driver."""
        return round(abs(self.travel) / TURN)

    @property
    def period(self) -> float:
        """The driver's period [rad]."""
        return (self.path.turns or 1) * TURN

    def first(self, angle: float) -> float:
        """Return the least value of the driver in [0, period) at an angle of the cam."""
        return min(_begin(self._value(angle + turn * TURN), self.period) for turn in range(self.turns))

    def parts(self, begin: float, end: float) -> tuple[tuple[float, float], ...]:
        """Return the parts of a period in which the cam is between two angles, as CamDriver.parts."""
        width = end - begin if 0.0 < end - begin <= TURN else (end - begin) % TURN
        if width > TURN - _SAME_ANGLE:
            return ((0.0, self.period),)
        found = []
        for turn in range(self.turns):
            ends = self._value(begin + turn * TURN), self._value(begin + width + turn * TURN)
            first, last = ends if self.travel > 0.0 else ends[::-1]
            found.append(_in_period(first, last, self.period))
        return tuple(sorted(found))

    def _value(self, angle: float) -> float:
        """Return the value of the driver on its path at an angle of the cam, modulo the turns of a period."""
        low, high = float(self.angles.min()), float(self.angles.max())
        wanted = min(low + (angle - low) % (self.turns * TURN), high)
        for (before, after), (a, b) in zip(pairwise(self.path.poses), pairwise(self.angles.tolist()), strict=True):
            if min(a, b) <= wanted <= max(a, b):
                return self.path.zero(lambda pose: self._angle(pose) - wanted, before, after).u[0]
        return math.nan

    def _angle(self, pose: Pose) -> float:
        q = self.path.coordinates(pose)
        held = 0.0 if self.placed.holder == GROUND_NAME else q[f"{self.placed.holder}.phi"]
        return float(q[f"{self.placed.cam}.phi"] - held)


def _begin(value: float, period: float) -> float:
    """Return a value in [0, period), 0 for one that rounding leaves below the period."""
    value %= period
    return 0.0 if period - value < _SAME_ANGLE else value


def _in_period(begin: float, end: float, period: float) -> tuple[float, float]:
    """Return the ends of a part, begin in [0, period) and end in (0, period]."""
    end %= period
    return _begin(begin, period), period if end < _SAME_ANGLE else end


def cam_driver(plan: SolvePlan, placed: PlacedCam, paths: Sequence[DriverPath] | None) -> CamDriver:
    """Return the driver that turns a cam; the cam itself where no single driver turns it all the way round.

    paths: Of the drivers; None: the path is followed where it is needed.
    """
    drivers = plan.mechanism.drivers
    direct = _turns(drivers, placed)
    if direct is not None:
        return CamDriver(direct.name)
    if len(drivers) == 1 and drivers[0].quantity.kind == "angle":
        path = follow(plan, 0) if paths is None else next(iter(paths), None)
        if path is not None and path.turns is not None:
            transmission = Transmission(path, placed)
            if transmission.is_whole:
                return CamDriver(drivers[0].name, transmission)
    return CamDriver(placed.cam)


def _turns(drivers: Sequence[Driver], placed: PlacedCam) -> Driver | None:
    """Return the driver whose value is the angle of the cam against its holder."""
    for driver in drivers:
        quantity = driver.measured()
        is_of_cam = isinstance(quantity, AngleBetween) and quantity.of == placed.cam
        if is_of_cam and (getattr(quantity, "to", None) or GROUND_NAME) == placed.holder:
            return driver
    return None
