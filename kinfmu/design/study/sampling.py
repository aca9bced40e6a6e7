"""The parameters of every design of a study, decided by the seed and the number of the design alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.design.study.variation import Grid, Tolerance, UniformRange, Variation

METHODS = ("sobol", "latin_hypercube")
_BITS = 30  # of a number of a Sobol point


@dataclass(frozen=True)
class Sampling:
    """The designs of a study: all points of its grids, each with the same samples of the other parameters.

        design = k_1 (c_2 c_3 ... n) + k_2 (c_3 ... n) + ... + sample

    The last grid changes fastest, and samples faster than grids. Samples are points of the unit cube, scrambled Sobol
    points (Owen 1998) or a Latin hypercube of `scipy.stats.qmc`, taken through the inverse of each distribution.

    Attributes:
        variations: How the parameters vary.
        method: 'sobol' or 'latin_hypercube'.
        samples: Number of samples at each point of the grids; 1 if all parameters are on grids.
        seed: Of the random numbers.

    """

    variations: tuple[Variation, ...]
    method: str
    samples: int
    seed: int

    def __len__(self) -> int:
        return self.grid_points * self.samples

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The parameters on grids."""
        return tuple(one for one in self.variations if isinstance(one, Grid))

    @property
    def sampled(self) -> tuple[UniformRange | Tolerance, ...]:
        """The parameters that are sampled."""
        return tuple(one for one in self.variations if not isinstance(one, Grid))

    @property
    def tolerances(self) -> tuple[Tolerance, ...]:
        """All variations, if they all are tolerances; else none."""
        found = tuple(one for one in self.variations if isinstance(one, Tolerance))
        return found if len(found) == len(self.variations) else ()

    @property
    def grid_points(self) -> int:
        """Number of points of all grids together."""
        return math.prod(len(grid.values) for grid in self.grids)

    def values(self, first: int, count: int) -> dict[str, FloatArray]:
        """Return the parameters of designs `first` to `first + count - 1` by name, (count,) each.

        The numbers of a design do not depend on `first` and `count`.
        """
        designs = np.arange(first, first + count)
        found: dict[str, FloatArray] = {}
        step = self.samples
        for grid in reversed(self.grids):
            found[grid.name] = np.array(grid.values)[designs // step % len(grid.values)]
            step *= len(grid.values)
        if self.sampled:
            points = self._points(designs % self.samples)
            for one, column in zip(self.sampled, points.T, strict=True):
                found[one.name] = one.at(column)
        return {one.name: found[one.name] for one in self.variations}

    def _points(self, samples: NDArray[np.int64]) -> FloatArray:
        """Return points of the unit cube, (count, dimensions), of samples by their numbers."""
        if self.method == "latin_hypercube":
            return np.asarray(self._hypercube[samples])
        first, last = int(samples.min()), int(samples.max())
        return np.asarray(self._sobol(first, last + 1 - first)[samples - first])

    def _sobol(self, first: int, count: int) -> FloatArray:
        """Return Sobol points, moved by half of their resolution so that none is on the edge of the cube."""
        from scipy.stats import qmc

        engine = qmc.Sobol(len(self.sampled), scramble=True, bits=_BITS, seed=np.random.default_rng(self.seed))
        if first:
            engine.fast_forward(first)
        whole = count if first else 1 << (count - 1).bit_length()  # from the first point on, it warns of other numbers
        return np.asarray(engine.random(whole)[:count] + 0.5**_BITS / 2.0)

    @cached_property
    def _hypercube(self) -> FloatArray:
        from scipy.stats import qmc

        engine = qmc.LatinHypercube(len(self.sampled), seed=np.random.default_rng(self.seed))
        points: FloatArray = engine.random(self.samples)
        return np.clip(points, 0.5**53, 1.0 - 0.5**53)
