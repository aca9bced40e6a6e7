"""Cylinders: barrel and rod of a driven distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.drivers import DistanceDriver
from kinfmu.run import FloatArray
from kinfmu.scene.instant import Instant

_BARREL, _OF_SHORTEST = 0.62, 0.9  # length of the barrel: of the usual length, and at most of the shortest one
_SMALLEST = 0.3  # of the usual length, smallest barrel if the shortest length is very small
_GUIDED = 0.1  # of the barrel, in which the rod stays at the longest pose


@dataclass(frozen=True, eq=False)
class CylinderShape:
    """A driven distance over the run: driver, and its two points 'body.point', of the barrel and of the rod.

    barrel, rod: their lengths. The rod's length follows from the longest pose, so it may project behind the barrel in
    shorter ones.
    """

    driver: str
    between: tuple[str, str]
    barrel: float
    rod: float


def cylinder_shapes(shown: Instant) -> list[CylinderShape]:
    """Return all driven distances."""
    return [_shape(shown, driver) for driver in shown.drivers if isinstance(driver, DistanceDriver)]


def _shape(shown: Instant, driver: DistanceDriver) -> CylinderShape:
    tracks = [shown.track(end) for end in driver.between]
    lengths: FloatArray = np.hypot(*(tracks[1] - tracks[0]).T)
    lengths = lengths[1:] if np.isfinite(lengths[1:]).any() else lengths  # of the run, without the drawn pose
    usual, shortest, longest = (float(of(lengths)) for of in (np.nanmedian, np.nanmin, np.nanmax))
    barrel = max(min(_OF_SHORTEST * shortest, _BARREL * usual), _SMALLEST * usual)
    return CylinderShape(driver.name, driver.between, barrel, max(longest - (1.0 - _GUIDED) * barrel, 0.0))
