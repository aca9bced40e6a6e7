"""FitProblem: a mechanism, its unknowns, what it shall do, and the conditions it shall meet; also from a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.argument import Argument, argument_of
from kinfmu.design.fit.lengths import Lengths
from kinfmu.design.fit.measuring import Measuring, measuring_of
from kinfmu.design.fit.sampled import Sampled, TracedPoints, sampled
from kinfmu.design.fit.targets import (
    CONSTRAINTS,
    TARGETS,
    Bounds,
    Constraint,
    FunctionTarget,
    GrashofConstraint,
    MeasureTarget,
    PathTarget,
    Target,
    read_bounds,
)
from kinfmu.errors import MechanismError, RequestError, listed
from kinfmu.files import suffix_of
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.gallery.load import load_named_in
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.mechanism.number import unit_advice
from kinfmu.mechanism.parameters import NUMBER
from kinfmu.mechanism.toml_document import (
    check_keys,
    class_of_type,
    document_of,
    named_tables,
    read_table,
    refuse_other_kind,
    table_of,
    text_in,
    text_of,
)
from kinfmu.mechanism.valid import check_name, quoted
from kinfmu.units import CoordinateName, Quantity

ANGLE = Quantity("angle")
KEYS = ("mechanism", "over", "unknowns", "targets", "constraints")
_WITH_FILE = (PathTarget, FunctionTarget)  # their points can be in a CSV file


@dataclass(frozen=True, eq=False)
class FitProblem:
    """Parameters of a mechanism that are to be found, and what they are to bring about.

    Args:
        mechanism: The mechanism; its parameters as written are the first start.
        unknowns: Bounds (low, high) of parameters by name, as numbers or text with a unit. Over time also law
            constants such as 'crank.speed'.
        targets: What the mechanism shall do.
        constraints: Conditions it shall meet. Default: none.
        over: What the samples go by: 'driver' or 'time'. Default: the driver, if there is one only.

    Attributes:
        argument: What the samples go by.
        traced: The mechanism with the points of the targets as points of interest.
        bounds: Bounds of all unknowns as numbers, also of starts and offsets such as 'curve.start'.
        sampled: Paths, functions and poses in one form.
        measuring: Measures with values or limits; None: there are none.
        lengths: Grashof's conditions.

    Raises:
        MechanismError: A name or a value is invalid; the message states table and key.
        RequestError: An unknown is not a parameter that can be set.

    """

    mechanism: Mechanism
    unknowns: Mapping[str, Any]
    targets: Sequence[Target]
    constraints: Sequence[Constraint] = ()
    over: str | None = None

    argument: Argument = field(init=False)
    traced: Mechanism = field(init=False)
    bounds: Mapping[str, Bounds] = field(init=False)
    sampled: tuple[Sampled, ...] = field(init=False)
    measuring: Measuring | None = field(init=False)
    lengths: tuple[Lengths, ...] = field(init=False)

    def __post_init__(self) -> None:
        require_mechanism(self.mechanism, "fit")
        names = [*self._names("targets", self.targets, TARGETS)]
        names += self._names("constraints", self.constraints, CONSTRAINTS)
        if not self.targets:
            raise MechanismError("a fit needs targets: write a table such as [targets.curve]")
        doubled = next((name for k, name in enumerate(names) if name in names[:k]), None)
        if doubled is not None:
            raise MechanismError(f"two targets or constraints have the name '{doubled}'")
        unit, traced = self.mechanism.length_unit, TracedPoints(self.mechanism)
        argument = argument_of(self.mechanism, self.over)
        of_points = [CoordinateName(point, axis) for point in self.mechanism.points for axis in "xy"]
        outputs: dict[str, CoordinateName] = {name: name for name in (*self.mechanism.coordinate_names, *of_points)}
        samples = [
            sampled(target, f"[targets.{target.name}]", traced, outputs, argument, unit)
            for target in self.targets
            if not isinstance(target, MeasureTarget)
        ]
        bounds = self._parameter_bounds(argument)
        for prepared in samples:
            bounds |= prepared.free
        lengths = [
            Lengths.of(constraint, f"[constraints.{constraint.name}]", self.mechanism)
            for constraint in self.constraints
            if isinstance(constraint, GrashofConstraint)
        ]
        prepared_fields = {
            "argument": argument,
            "traced": replace(self.mechanism, points=traced.points),
            "bounds": bounds,
            "sampled": tuple(samples),
            "measuring": measuring_of(self.mechanism, argument, self.targets, self.constraints),
            "lengths": tuple(lengths),
            "targets": tuple(self.targets),
            "constraints": tuple(self.constraints),
        }
        for key, value in prepared_fields.items():
            object.__setattr__(self, key, value)

    def __reduce__(self) -> tuple[Callable[..., FitProblem], tuple[Any, ...]]:
        from kinfmu.mechanism import toml_text

        text = toml_text.text(self.mechanism)
        return _from_text, (text, dict(self.unknowns), self.targets, self.constraints, self.over)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The unknowns that are parameters or law constants of the mechanism."""
        return tuple(self.unknowns)

    def of(self, mechanism: Mechanism) -> FitProblem:
        """Return the same problem of another mechanism.

        Args:
            mechanism: A mechanism that has the unknowns and outputs of this problem.

        Returns:
            The problem, checked anew.

        Raises:
            MechanismError: An unknown or an output is missing, or a value is invalid.

        """
        return FitProblem(mechanism, self.unknowns, self.targets, self.constraints, self.over)

    def written(self) -> dict[str, float | None]:
        """Return the values of the unknowns as written, within their bounds; starts and offsets have none."""
        settable = self.mechanism.settable
        values: dict[str, float | None] = dict.fromkeys(self.bounds)
        for name in self.parameters:
            values[name] = min(max(float(settable[name].value), self.bounds[name].low), self.bounds[name].high)
        return values

    @property
    def turns(self) -> FloatArray:
        """(n,) a whole turn as part of the range of each unknown that is an angle; inf for others."""
        return np.array(
            [
                math.tau / (b.high - b.low) if self.quantity(name) == ANGLE else math.inf
                for name, b in self.bounds.items()
            ]
        )

    def quantity(self, name: str) -> Quantity:
        """Return the quantity of an unknown.

        Args:
            name: The unknown, such as 'crank', 'crank.speed' or 'curve.start'.

        """
        if name in self.unknowns:
            return self.mechanism.settable[name].quantity or NUMBER
        target, _, key = name.rpartition(".")
        sampled = next(one for one in self.sampled if one.name == target)
        return sampled.argument if key == "start" else Quantity("angle" if sampled.angles[0] else "length")

    def vector(self, z: FloatArray) -> dict[str, float]:
        """Return the unknowns by name.

        Args:
            z: (n,) each 0 to 1: part of the range between the bounds of an unknown.

        Returns:
            Values in the mechanism's unit of length and rad.

        """
        return {
            name: b.low + float(part) * (b.high - b.low) for (name, b), part in zip(self.bounds.items(), z, strict=True)
        }

    @staticmethod
    def _names(table: str, members: Sequence[Any], classes: Any) -> list[str]:
        for one in members:
            if not isinstance(one, classes):
                kinds = listed(cls.__name__ for cls in classes)
                raise RequestError(f"{table}: {type(one).__name__} is not one of {kinds}")
            check_name(f"[{table}]", one.name)
            over = getattr(one, "over", None)
            for key, value in (("of", getattr(one, "of", "")), ("over", "" if over is None else over)):
                if not isinstance(value, str | Reading):
                    raise MechanismError(f"[{table}.{one.name}] {key} = {quoted(value)} must be a name")
        return [one.name for one in members]

    def _parameter_bounds(self, argument: Argument) -> dict[str, Bounds]:
        """Return the bounds of parameters and law constants."""
        settable = self.mechanism.settable
        if not self.unknowns:
            raise MechanismError("a fit needs unknowns: write bounds of parameters in [unknowns], such as a = [20, 50]")
        bounds = {}
        for name, value in self.unknowns.items():
            parameter, constant = self.mechanism.parameters.get(name), settable.constants.get(name)
            if constant in self.mechanism.law_constants and argument.input:
                raise RequestError(f"[unknowns] {name} is a law constant, which acts over time: write over = 'time'")
            if constant is None and (parameter is None or parameter.expression is not None):
                raise RequestError(f"[unknowns] {settable.unknown(name, settable.names)}")
            setting: Any = constant or parameter
            where = f"[unknowns] {name}"
            with unit_advice(name, setting.value, self.mechanism.length_unit):
                bounds[name] = read_bounds(where, value, setting.quantity or NUMBER, self.mechanism.length_unit)
        return bounds


def _from_text(text: str, *rest: Any) -> FitProblem:
    """Return a problem from its mechanism's text: how problems arrive in other processes."""
    from kinfmu.mechanism import toml_file

    return FitProblem(toml_file.parse(text, "the mechanism of the fit"), *rest)


def read_problem(path: str | Path) -> FitProblem:
    """Return the problem of a fit file.

    Args:
        path: The file (.toml). A relative path of a mechanism in it starts in its folder.

    Raises:
        MechanismError: The file cannot be read or is invalid; the message states file, table and key.

    """
    path = Path(path)
    document = document_of(text_in(path, "a fit file"), str(path))
    try:
        return _problem(document, path.parent)
    except (MechanismError, RequestError) as error:
        raise MechanismError(f"{path}: {error}", **error.data) from None


def mechanism_file(path: Path) -> Path | None:
    """Return the mechanism file that a fit file names; None for a mechanism of the gallery."""
    name = document_of(text_in(path, "a fit file"), str(path)).get("mechanism")
    return path.parent / name if isinstance(name, str) and suffix_of(name) == ".toml" else None


def _problem(document: Mapping[str, Any], folder: Path) -> FitProblem:
    refuse_other_kind(document, "fit", KEYS)
    check_keys("", document, KEYS)
    over = document.get("over")
    return FitProblem(
        load_named_in(document, folder),
        table_of(document, "unknowns"),
        tuple(_members(document, "targets", TARGETS, folder)),
        tuple(_members(document, "constraints", CONSTRAINTS, folder)),
        None if over is None else text_of("over", over),
    )


def _members(document: Mapping[str, Any], table: str, classes: Iterable[Any], folder: Path) -> Iterable[Any]:
    """Yield the targets or constraints."""
    for name, values in named_tables(document, table):
        where = f"[{table}.{name}]"
        cls = class_of_type(where, values, "type", classes)
        declared = [key for key in fields(cls) if key.name != "name"]
        with_file = cls in _WITH_FILE
        check_keys(where, values, ("type", *(key.name for key in declared), *(("file",) if with_file else ())))
        keys = {key: value for key, value in values.items() if key not in ("type", "file")}
        if with_file and "file" in values:
            if "points" in values:
                raise MechanismError(f"{where} has both 'points' and 'file'; give one of them")
            keys["points"] = read_table(f"{where} file", values["file"], folder)
        for key in declared:
            if key.default is MISSING and key.name not in keys:
                names = listed(other.name for other in declared)
                or_file = " or 'file'" if key.name == "points" else ""
                raise MechanismError(f"{where} needs the key '{key.name}'{or_file}; keys: {names}")
        yield cls(name=name, **keys)
