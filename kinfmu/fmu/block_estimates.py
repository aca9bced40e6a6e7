"""Margins and estimated errors of many samples at once, with the functions that a python FMU has for one sample.

They follow from driver values, unknowns and rates, which a run records, so a run does not read them in every step. The
FMU's own modules compute them here, with numpy arrays in place of numbers. All operations round in the same way, and
sines and cosines come from the same library, so the results are equal to the bit.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.fmu.layout import UNKNOWN_ERROR, Numbers

Array = NDArray[np.float64]

ENTRY = "resources/slavemodule.txt"  # in a python FMU
ROWS = 1024  # samples computed at once: their arrays stay in the cache
MOST_BLOCKS = 2  # of larger blocks, and of sums over more blocks, the order of operations depends on the values
MOST_UNKNOWNS = 2
LEAST_MARGIN = 0.0125  # smallest determinant of samples computed at once: the functions branch near singular poses


class BlockEstimates:
    """Margins and estimated errors of samples of status ok, from columns of a run.

    Args:
        folder: Folder of the unpacked FMU, which runs in this process.
        parameters: Values of the mechanism's parameters.

    Raises:
        LookupError: If the FMU's functions do not take arrays: blocks are too large, a cam is in the equations, or
            another version of kinfmu built the FMU.

    """

    def __init__(self, folder: Path, parameters: Numbers) -> None:
        package = (folder / ENTRY).read_text().strip().removesuffix("_slave")
        names = [f"{package}.solver.{name}" for name in ("model", "estimate", "worst_case_step", "linear", "pose")]
        model, estimate, steps, linear, pose = (sys.modules[name] for name in names)
        sizes = [high - low for low, high in model.BLOCKS]
        if len(sizes) > MOST_BLOCKS or max(sizes, default=0) > MOST_UNKNOWNS or model.TALL:
            raise LookupError(f"blocks of {sizes} unknowns")
        self.unknowns: tuple[str, ...] = model.UNKNOWNS
        self._pose = pose.Pose
        self._model, self._arrays = model, _with_arrays(model, folder)
        if model.PARAMETERS:
            self._model, self._arrays = model.bound(parameters), self._arrays.bound(parameters)
        self._estimate, self._evaluated = estimate, pose.evaluated
        condition = _with_arrays(linear, folder).reciprocal_condition
        step = _with_arrays(steps, folder, {"choose": _choose}).worst_case_step
        others = {"evaluated": _evaluated, "worst_case_step": step, "reciprocal_condition": condition}
        self._of_arrays = _with_arrays(estimate, folder, others)
        self._check()

    def _check(self) -> None:
        """Raise a LookupError if arrays and numbers give different results at the anchor."""
        u, z = self._model.ANCHOR
        drive = u, (1.0,) * len(u), (0.0,) * len(u)
        try:
            by_numbers = self._of_one(*drive, z)
            by_arrays = self._of_part(*(np.array([row, row]) for row in (*drive, z)))
        except (ArithmeticError, AttributeError, TypeError, ValueError) as error:
            raise LookupError(f"no arrays: {error}") from None
        if not (np.isfinite(by_arrays).all() and (by_arrays == by_numbers).all()):
            raise LookupError(f"at the anchor arrays give {by_arrays[0]}, numbers {by_numbers}")

    def __call__(self, u: Array, ud: Array, udd: Array, z: Array) -> Array:
        """Return margin, error_q, error_qd and error_qdd of samples of status ok.

        Args:
            u: (n, drivers) driver values.
            ud: (n, drivers) their rates.
            udd: (n, drivers) their accelerations.
            z: (n, unknowns) solved unknowns.

        Returns:
            (n, 4) columns in this order.

        """
        columns = u, ud, udd, z
        found = np.empty((len(u), 4))
        for low in range(0, len(u), ROWS):
            rows = slice(low, low + ROWS)
            found[rows] = self._of_part(*(column[rows] for column in columns))
        for k in np.flatnonzero(~np.isfinite(found).all(axis=1)):
            found[k] = self._of_one(*(tuple(column[k].tolist()) for column in columns))
        return np.minimum(found, UNKNOWN_ERROR)

    def _of_part(self, u: Array, ud: Array, udd: Array, z: Array) -> Array:
        """Return the four columns (n, 4), not finite where a sample has to be computed alone."""
        found = np.full((len(u), 4), np.nan)
        model, at = self._arrays, _columns(u)
        try:
            with np.errstate(divide="raise", over="raise", invalid="raise"):
                pose = self._pose(at, _evaluated(model, at, _columns(z)))
                margin = self._of_arrays.margin_of(model, pose)
                pose.margin = float(np.min(pose.margin))
                if pose.margin >= LEAST_MARGIN and np.min(margin) > 0.0:
                    errors = self._of_arrays.estimated_errors(model, pose, _columns(ud), _columns(udd))
                    for k, column in enumerate((margin, *errors)):
                        found[:, k] = column
        except ArithmeticError:
            pass
        return found

    def _of_one(self, u: Numbers, ud: Numbers, udd: Numbers, z: Numbers) -> Numbers:
        pose = self._pose(u, self._evaluated(self._model, u, z))
        return self._estimate.margin_of(self._model, pose), *self._estimate.estimated_errors(self._model, pose, ud, udd)


def block_estimates(folder: Path, parameters: Numbers) -> BlockEstimates | None:
    """Return the estimates of an unpacked FMU that runs in this process, or None if they must be read from the FMU."""
    try:
        return BlockEstimates(folder, parameters)
    except (OSError, LookupError):
        return None


# Replacements, for arrays, of the functions of numbers


class _Every:
    """A bound that every array meets: `array <= EVERY` is true, while `array <= number` has no truth value."""

    __array_ufunc__ = None

    def __ge__(self, _other: object) -> bool:
        return True


EVERY = _Every()


def _columns(table: Array) -> tuple[Array, ...]:
    return tuple(np.ascontiguousarray(table.T))


def _evaluated(model: Any, u: Sequence[Array], z: Sequence[Array]) -> Any:
    """Return what `position` gives for known unknowns, as kinfmu.solver.python.pose.evaluated does."""
    rest = (0.0,) * len(z)
    return model.position(u, z, rest, rest, -0.0, -1, EVERY)


def _choose(number: Any, if_positive: Any, otherwise: Any) -> Any:
    return np.where(number >= 0.0, if_positive, otherwise)


def _first_of(is_better: Callable[[Any, Any], Any]) -> Callable[..., Any]:
    """Return Python's `max` or `min` for arrays: a later value replaces an earlier one only if it is better."""

    def chosen(*values: Any, default: Any = None) -> Any:
        found, *more = values if len(values) > 1 else (list(values[0]) or [default])
        for value in more:
            found = np.where(is_better(value, found), value, found)
        return found

    return chosen


def _each(function: Callable[[float], float]) -> Callable[[Any], Any]:
    """Return a function of the C library applied to each element: numpy's own functions round differently."""

    def of_each(values: Any) -> Any:
        return np.array(list(map(function, values.tolist()))) if isinstance(values, np.ndarray) else function(values)

    return of_each


_FUNCTIONS: dict[str, Any] = {
    "sin": _each(math.sin),
    "cos": _each(math.cos),
    "sqrt": np.sqrt,
    "copysign": np.copysign,
    "isfinite": lambda values: bool(np.isfinite(values).all()),
    "any": lambda conditions: bool(np.any([np.any(condition) for condition in conditions])),
    "max": _first_of(np.greater),
    "min": _first_of(np.less),
}


def _with_arrays(module: ModuleType, folder: Path, others: Mapping[str, Any] | None = None) -> Any:
    """Return a second copy of a module of the FMU, in which functions of arrays replace those of numbers."""
    path = folder.joinpath("resources", *module.__name__.split(".")).with_suffix(".py")
    spec = spec_from_file_location(module.__name__, path)
    if spec is None or spec.loader is None:
        raise LookupError(f"no module at {path}")
    copy = module_from_spec(spec)
    spec.loader.exec_module(copy)
    vars(copy).update(_FUNCTIONS | dict(others or {}))
    return copy
