"""Cylinders: the barrel and the rod of a driven distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinfmu.drivers import DistanceDriver
from kinfmu.run import FloatArray
from kinfmu.scene.instant import Instant

_BARREL, _OF_SHORTEST = 0.62, 0.9  # of the usual length, and at most of the shortest one
_SMALLEST = 0.3  # of the usual length, where it gets very short
_GUIDED = 0.1  # of the barrel, in which the rod stays at the longest


@dataclass(frozen=True, eq=False)
class CylinderShape:
    """A driven distance over the run: driver, its two points 'body.point', barrel at the first and rod at the second.

    barrel, rod: their lengths. The rod is as long as the longest pose asks for, so that at a pose shorter than that it
    stands out behind.
    """

    driver: str
    between: tuple[str, str]
    barrel: float
    rod: float


def cylinder_shapes(shown: Instant) -> list[CylinderShape]:
    """All driven distances."""
    return [_shape(shown, driver) for driver in shown.drivers if isinstance(driver, DistanceDriver)]


def _shape(shown: Instant, driver: DistanceDriver) -> CylinderShape:
    tracks = [shown.track(end) for end in driver.between]
    lengths: FloatArray = np.hypot(*(tracks[1] - tracks[0]).T)
    lengths = lengths[1:] if np.isfinite(lengths[1:]).any() else lengths  # of the run, whatever pose is drawn
    usual, shortest, longest = (float(of(lengths)) for of in (np.nanmedian, np.nanmin, np.nanmax))
    barrel = max(min(_OF_SHORTEST * shortest, _BARREL * usual), _SMALLEST * usual)
    return CylinderShape(driver.name, driver.between, barrel, max(longest - (1.0 - _GUIDED) * barrel, 0.0))
