"""Grashof's condition as a residual of the parameters alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.targets import GrashofConstraint, read_weights
from kinfmu.errors import MechanismError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.number import read_constant, read_number
from kinfmu.mechanism.parameters import Parameter, parameter_values
from kinfmu.mechanism.valid import quoted
from kinfmu.units import Quantity

LENGTH = Quantity("length")
_STEP = 1e-30  # of a complex-step derivative, which is exact to round-off


@dataclass(frozen=True, eq=False)
class Lengths:
    """The conditions on four lengths: p + q - s - l >= gap and, if the shortest is named, others - shortest >= 0.

    If the shortest is named, each of the others is taken for the longest in turn: the same, with conditions that have
    derivatives where two lengths are equal.

    Attributes:
        name: Name of the constraint.
        links: The lengths as expressions.
        shortest: Which of them shall be the shortest; None: any.
        gap: Smallest p + q - s - l [length].
        size: Mean of the lengths as written, of which a violation is a part.
        root: Square root of the weight.
        parameters: All parameters of the mechanism.

    """

    name: str
    links: tuple[Expression, ...]
    shortest: int | None
    gap: float
    size: float
    root: float
    parameters: Mapping[str, Parameter]

    @classmethod
    def of(cls, constraint: GrashofConstraint, where: str, mechanism: Mechanism) -> Lengths:
        """Return the conditions of a constraint.

        Raise a MechanismError if a length is not an expression of parameters, or there are not four.
        """
        links, unit = constraint.links, mechanism.length_unit
        if isinstance(links, str) or not isinstance(links, Sequence) or len(links) != 4:
            raise MechanismError(f"{where} links = {quoted(links)} must be four lengths, such as ['a', 'b', 'c', 'd']")
        shortest = constraint.shortest
        if shortest is not None and shortest not in links:
            raise MechanismError(f"{where} shortest = {quoted(shortest)} must be one of links, {quoted(list(links))}")
        known = {name: float(parameter.value) for name, parameter in mechanism.parameters.items()}
        read = []
        for text in links:
            link = read_number(f"{where} links", text, LENGTH, unit)
            link = link if isinstance(link, Expression) else Expression(f"{link!r}", unit)
            link.refuse_unknown(known)
            read.append(link)
        gap = read_constant(f"{where} gap", constraint.gap, LENGTH, unit)
        if gap < 0.0:
            raise MechanismError(f"{where} gap = {quoted(constraint.gap)} must be 0 or more")
        return cls(
            constraint.name,
            tuple(read),
            None if shortest is None else list(links).index(shortest),
            gap,
            sum(abs(float(link.value(known))) for link in read) / 4.0 or 1.0,
            float(read_weights(f"{where} weight", constraint.weight, 1)[0]) ** 0.5,
            mechanism.parameters,
        )

    @property
    def count(self) -> int:
        """Number of conditions."""
        return 1 if self.shortest is None else 6

    @property
    def gaps(self) -> int:
        """How many of them, the first ones, are conditions of the gap."""
        return 1 if self.shortest is None else 3

    def excess(self, values: Mapping[str, float], names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
        """Return by how much each condition is met (count,), and its derivatives by parameters (count, names)."""
        lengths = np.array([float(link.value(self._known(values))) for link in self.links])
        slopes = np.zeros((4, len(names)))
        for k, name in enumerate(names):
            if name in self.parameters:
                known = self._known({**values, name: values[name] + 1j * _STEP})  # type: ignore[dict-item]
                slopes[:, k] = [complex(link.value(known)).imag / _STEP for link in self.links]
        signs, limits = np.zeros((self.count, 4)), np.zeros(self.count)
        limits[: self.gaps] = self.gap
        s = self.shortest
        if s is None:
            signs[0, np.argsort(lengths, kind="stable")] = [-1.0, 1.0, 1.0, -1.0]
        else:
            for row, k in enumerate(k for k in range(4) if k != s):
                signs[row] = 1.0
                signs[row, [k, s]] = -1.0
                signs[row + 3, [k, s]] = 1.0, -1.0
        return signs @ lengths - limits, signs @ slopes

    def _known(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return all parameters, those that follow from others too."""
        own = {name: value for name, value in values.items() if name in self.parameters}
        return dict(parameter_values(self.parameters, own))
