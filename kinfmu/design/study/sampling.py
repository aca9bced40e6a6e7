"""How parameters vary over the designs of a study, and the parameters of every design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.errors import MechanismError, listed, valid_names
from kinfmu.mechanism import LawConstant, Mechanism
from kinfmu.mechanism.number import read_constant, unit_advice
from kinfmu.mechanism.parameters import NUMBER
from kinfmu.mechanism.toml_document import check_keys
from kinfmu.mechanism.valid import is_number, quoted
from kinfmu.units import unit_of

_TOGETHER = {  # keys that go with the one that makes the kind of variation
    "values": ("values",),
    "from": ("from", "to", "count"),
    "tolerance": ("tolerance", "distribution", "deviations", "nominal"),
}
KEYS = tuple(chain(*_TOGETHER.values()))
DISTRIBUTIONS = ("normal", "uniform")
MOST_DESIGNS = 10**9
MOST_OF_A_GRID = 10**6  # values, which are part of the definition of the study
_EXAMPLE = '{ from = 1, to = 2, count = 5 }, { from = 1, to = 2 } or { tolerance = 0.1, distribution = "normal" }'


@dataclass(frozen=True)
class _Varied:
    """A parameter or law constant, its unit, and the one in which people wrote its numbers."""

    name: str
    unit: str
    display_unit: str = field(default="", compare=False, kw_only=True)


@dataclass(frozen=True)
class Grid(_Varied):
    """A parameter that takes given values, in this order."""

    values: tuple[float, ...]

    def as_json(self) -> dict[str, Any]:
        return {"unit": self.unit, "values": list(self.values)}


@dataclass(frozen=True)
class UniformRange(_Varied):
    """A parameter that is sampled evenly between two values."""

    low: float
    high: float

    def at(self, points: FloatArray) -> FloatArray:
        """Return the values at points of the unit interval."""
        return self.low + points * (self.high - self.low)

    def as_json(self) -> dict[str, Any]:
        return {"unit": self.unit, "from": self.low, "to": self.high}


@dataclass(frozen=True)
class Tolerance(_Varied):
    """A parameter that scatters about its nominal value, within nominal - tolerance to nominal + tolerance.

    distribution: 'normal', or 'uniform' over this zone; deviations: of a normal one, how many standard deviations the
    tolerance is.
    """

    nominal: float
    tolerance: float
    distribution: Literal["normal", "uniform"]
    deviations: float

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        return self.tolerance / (math.sqrt(3.0) if self.distribution == "uniform" else self.deviations)

    def at(self, points: FloatArray) -> FloatArray:
        """Return the values at points of the open unit interval: the inverse of the distribution function."""
        if self.distribution == "uniform":
            return self.nominal + (2.0 * points - 1.0) * self.tolerance
        from scipy.special import ndtri

        return np.asarray(self.nominal + self.deviation * ndtri(points))

    def as_json(self) -> dict[str, Any]:
        own = {key: getattr(self, key) for key in ("unit", "nominal", "tolerance", "distribution")}
        return own | ({"deviations": self.deviations} if self.distribution == "normal" else {})


Variation = Grid | UniformRange | Tolerance


def read_variation(where: str, name: str, table: Mapping[str, Any], mechanism: Mechanism) -> Variation:
    """Return how a parameter varies, from a table of a study file or of a call.

    Raise a MechanismError if a key or a value is invalid, a RequestError if the mechanism has no such parameter.

    where: The table in messages, such as '[parameters.crank]'. name: The parameter or law constant. table: Its keys:
    `values`; or `from`, `to` and `count`; or `from` and `to`; or `tolerance`, `distribution`, `deviations` and
    `nominal`. Numbers are bare or have units, as in mechanism files.
    """
    settable = mechanism.settable
    if not isinstance(name, str):
        raise MechanismError(f"{where}: parameters have names, not {quoted(name)}")
    settable.check_name(name)
    if not isinstance(table, Mapping):
        raise MechanismError(f"{where} = {quoted(table)} must be a table such as {_EXAMPLE}")
    check_keys(where, table, KEYS)
    setting = settable[name]
    quantity, length = setting.quantity or NUMBER, mechanism.length_unit
    is_positive = isinstance(setting, LawConstant) and setting.is_positive

    def number(key: str, value: object, *, above: float | None = None) -> float:
        with unit_advice(name, setting.value, length):
            found = read_constant(f"{where} {key}", value, quantity, length)
        if above is not None and not found > above:
            raise MechanismError(f"{where} {key} = {quoted(value)} must be more than {above:g}")
        if is_positive and not found > 0.0:
            raise MechanismError(f"{where} {key} = {quoted(value)} must be positive")
        return found

    unit = unit_of(quantity, length)
    values = table.get("values", ())
    given = [table.get(key) for key in ("from", "to", "tolerance", "nominal")]
    shown = settable.display_unit(name, [*(values if isinstance(values, list | tuple) else ()), *given]).unit
    kinds = [key for key in _TOGETHER if key in table]
    if len(kinds) != 1:
        several = f"has {' and '.join(kinds)}, which exclude each other"
        what = several if kinds else "needs 'values', 'from' or 'tolerance'"
        raise MechanismError(f"{where} {what}; give one of {_EXAMPLE}")
    (kind,) = kinds
    for key in table:
        if key not in _TOGETHER[kind]:
            keys = listed(sorted(_TOGETHER[kind]))
            raise MechanismError(f"{where} {key}: does not go with '{kind}'; keys with it: {keys}")
    if kind == "values":
        if not isinstance(values, list | tuple | np.ndarray) or not len(values):
            raise MechanismError(f"{where} values = {quoted(values)} must be a list of numbers")
        return Grid(name, unit, tuple(number("values", value) for value in values), display_unit=shown)
    if kind == "from":
        if "to" not in table:
            raise MechanismError(f"{where} needs the key 'to'")
        low, high = number("from", table["from"]), number("to", table["to"])
        if "count" in table:
            count = whole_number(f"{where} count", table["count"], 2, MOST_OF_A_GRID)
            return Grid(name, unit, tuple(np.linspace(low, high, count).tolist()), display_unit=shown)
        if low == high:
            raise MechanismError(f"{where}: 'from' and 'to' are equal: {low:.9g}")
        return UniformRange(name, unit, min(low, high), max(low, high), display_unit=shown)
    nominal = number("nominal", table.get("nominal", float(setting.value)))
    tolerance = number("tolerance", table["tolerance"], above=0.0)
    distribution = table.get("distribution", "normal")
    if distribution not in DISTRIBUTIONS:
        raise MechanismError(
            f"{where} distribution = {quoted(distribution)} is not known{valid_names(str(distribution), DISTRIBUTIONS)}"
        )
    deviations = table.get("deviations", 3.0)
    if not (is_number(deviations) and deviations > 0.0 and math.isfinite(deviations)):
        raise MechanismError(f"{where} deviations = {quoted(deviations)} must be a positive number")
    if "deviations" in table and distribution != "normal":
        raise MechanismError(f"{where} deviations: only a normal distribution has them")
    return Tolerance(name, unit, nominal, tolerance, distribution, float(deviations), display_unit=shown)


def whole_number(where: str, value: object, least: int, most: int = MOST_DESIGNS) -> int:
    """Return a whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        raise MechanismError(f"{where} = {quoted(value)} must be a whole number from {least} to {most}")
    return int(value)


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
