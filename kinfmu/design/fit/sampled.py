"""Sampled targets: paths, functions and poses in one form, a curve P(u) of some outputs and its wanted rows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.argument import Argument
from kinfmu.design.fit.targets import Bounds, FunctionTarget, PathTarget, PoseTarget, read_free, read_rows, read_weights
from kinfmu.errors import MechanismError, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.valid import quoted
from kinfmu.units import CoordinateName, Quantity

LENGTH, ANGLE = Quantity("length"), Quantity("angle")


@dataclass(frozen=True, eq=False)
class Sampled:
    """A path, a function or poses: m wanted rows of d outputs.

    Attributes:
        name: Name of the target.
        type: Its type in files.
        outputs: Names of the d outputs.
        shown: The same as the user named them.
        angles: (d,) which of them are angles.
        wanted: (m, d), without `offset`.
        scale: (d,) factors of the errors: 1, of an angle among lengths a length.
        roots: (m, 1) square roots of the weights.
        at: (m,) values of the argument, or of `over`, counted from `start`; None: the nearest point counts.
        argument: What the values of `at` measure: a value of `over` or of the argument of the motion.
        start: Value at which `at` begins, or its bounds.
        offset: Added to the wanted values, or its bounds.
        over: The output whose values `at` are; '' for the argument of the motion.
        begin: Where the motion begins that points or values of `over` are looked for in; None: the whole motion.
        end: The last value of the argument there; None: of the whole motion.

    """

    name: str
    type: str
    outputs: tuple[str, ...]
    shown: tuple[str, ...]
    angles: tuple[bool, ...]
    wanted: FloatArray
    scale: FloatArray
    roots: FloatArray
    at: FloatArray | None
    argument: Quantity
    start: float | Bounds
    offset: float | Bounds
    over: str
    begin: float | None
    end: float | None

    @property
    def free(self) -> dict[str, Bounds]:
        """The unknowns of the target itself, by name."""
        both = {f"{self.name}.start": self.start, f"{self.name}.offset": self.offset}
        return {name: value for name, value in both.items() if isinstance(value, Bounds)}

    @property
    def periods(self) -> FloatArray:
        """(d,) a whole turn for angles, inf for lengths."""
        return np.where(self.angles, math.tau, math.inf)

    @property
    def is_timed(self) -> bool:
        """Whether the argument of each row is known without the motion."""
        return self.at is not None and not self.over


class TracedPoints:
    """Names of the outputs of points; points that the mechanism does not list as outputs are added to it."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._written = mechanism
        self.points = dict(mechanism.points)

    def outputs(self, where: str, of: str) -> tuple[CoordinateName, ...]:
        """Return the names of a point's coordinates; raise a MechanismError if there is no such point."""
        known = self._written.body_points
        if of in self.points:
            return tuple(CoordinateName(of, axis) for axis in "xy")
        if of not in known:
            names = [*self._written.points, *known]
            raise MechanismError(f"{where} = {quoted(of)} is not a point{valid_names(of, names, 'points')}")
        name = next((name for name, target in self.points.items() if target == of), "")
        if not name:
            taken = {*self.points, *(body.name for body in self._written.bodies)}
            name = next(name for k in range(len(taken) + 1) if (name := f"traced_{k}") not in taken)
            self.points[name] = of
        return tuple(CoordinateName(name, axis) for axis in "xy")


def sampled(
    target: PathTarget | FunctionTarget | PoseTarget,
    where: str,
    traced: TracedPoints,
    coordinates: Mapping[str, CoordinateName],
    argument: Argument,
    unit: str,
) -> Sampled:
    """Return a target, as declared, in the common form; raise a MechanismError if a value is invalid.

    where: Its table in messages, such as '[targets.foot]'. traced: Names of the outputs of points. coordinates: Known
    outputs, by their names. argument: What the samples go by. unit: Unit of length.
    """
    common: dict[str, Any] = {
        "name": target.name,
        "type": target.type,
        "over": "",
        "argument": argument.quantity,
        "offset": 0.0,
        "begin": _optional(f"{where} begin", target.begin, argument, unit),
        "end": _optional(f"{where} end", target.end, argument, unit),
    }
    if isinstance(target, FunctionTarget):
        return _function(target, where, coordinates, argument, unit, common)
    if isinstance(target, PathTarget):
        outputs = traced.outputs(f"{where} of", target.of)
        wanted = read_rows(f"{where} points", target.points, (LENGTH, LENGTH), unit, "[[x, y], ...]")
        scale = np.ones(2)
    else:
        outputs = tuple(CoordinateName(str(target.of), axis) for axis in ("x", "y", "phi"))
        if outputs[2] not in coordinates:
            bodies = sorted({name.owner for name in coordinates.values() if name.is_angle})
            raise MechanismError(
                f"{where} of = {quoted(target.of)} is not a moving body{valid_names(target.of, bodies, 'bodies')}"
            )
        wanted = read_rows(f"{where} poses", target.poses, (LENGTH, LENGTH, ANGLE), unit, "[[x, y, phi], ...]")
        length = read_constant(f"{where} length", target.length, LENGTH, unit)
        if not length > 0.0:
            raise MechanismError(f"{where} length = {quoted(target.length)} must be positive")
        scale = np.array([1.0, 1.0, length])
    at, start = _timing(where, target, len(wanted), argument, unit)
    return Sampled(
        **common,
        outputs=outputs,
        shown=tuple(f"{target.of}.{name.axis}" for name in outputs),
        angles=tuple(name.is_angle for name in outputs),
        wanted=wanted,
        scale=scale,
        roots=_roots(where, target.weight, len(wanted)),
        at=at,
        start=start,
    )


def _function(
    target: FunctionTarget,
    where: str,
    coordinates: Mapping[str, CoordinateName],
    argument: Argument,
    unit: str,
    common: Mapping[str, Any],
) -> Sampled:
    """Return a function in the common form."""
    for key, name in (("of", target.of), ("over", target.over)):
        if name is not None and name not in coordinates:
            valid = valid_names(name, coordinates, "valid")
            raise MechanismError(f"{where} {key} = {quoted(name)} is not an output{valid}")
    x = argument.quantity if target.over is None else coordinates[target.over].quantity()
    of = coordinates[target.of]
    y = of.quantity()
    points = read_rows(f"{where} points", target.points, (x, y), unit, "[[x, y], ...]")
    if target.over is None and (target.begin is not None or target.end is not None):
        raise MechanismError(f"{where} begin and end are for a function over another output: write 'over'")
    more = {
        "over": target.over or "",
        "argument": x,
        "start": read_free(f"{where} start", target.start, x, unit),
        "offset": read_free(f"{where} offset", target.offset, y, unit),
    }
    return Sampled(
        **{**common, **more},
        outputs=(of,),
        shown=(of,),
        angles=(of.is_angle,),
        wanted=points[:, 1:],
        scale=np.ones(1),
        roots=_roots(where, target.weight, len(points)),
        at=points[:, 0],
    )


def _optional(where: str, value: object, argument: Argument, unit: str) -> float | None:
    return None if value is None else read_constant(where, value, argument.quantity, unit)


def _roots(where: str, weight: Any, count: int) -> FloatArray:
    return np.sqrt(read_weights(f"{where} weight", weight, count))[:, None]


def _timing(
    where: str, target: PathTarget | PoseTarget, count: int, argument: Argument, unit: str
) -> tuple[FloatArray | None, float | Bounds]:
    """Return the values of the argument counted from the start, None for an untimed target, and the start."""
    if target.at is not None and target.step is not None:
        raise MechanismError(f"{where} has both 'at' and 'step'; give one of them")
    if target.at is None and target.step is None:
        if target.start is not None:
            raise MechanismError(f"{where} start needs 'at' or 'step'; without them the nearest points count")
        return None, 0.0
    if target.begin is not None or target.end is not None:
        raise MechanismError(f"{where} begin and end are for points without 'at' and 'step'")
    start = read_free(f"{where} start", target.start, argument.quantity, unit)
    if target.step is not None:
        step = read_constant(f"{where} step", target.step, argument.quantity, unit)
        if not step:
            raise MechanismError(f"{where} step = {quoted(target.step)} must not be 0")
        return np.asarray(step * np.arange(count), dtype=float), start
    at: Any = target.at
    if isinstance(at, str) or not isinstance(at, Sequence | np.ndarray) or len(at) != count:
        raise MechanismError(f"{where} at must be a list of {count} values of {argument.name}, one for each point")
    return np.array([read_constant(f"{where} at", one, argument.quantity, unit) for one in at]), start
