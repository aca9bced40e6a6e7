"""MotionEquations: the constraint equations along motions, solved for one derivative of the coordinates at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.plan.equations.system import System, placement
from kinfmu.plan.equations.taylor import Taylor

LEAST_MARGIN = 1e-6  # 1 / condition of the scaled Jacobian; below it a third derivative has no digits


class MotionEquations:
    """The constraint equations of a mechanism at n poses, in Taylor numbers.

        Phi_q q^(k) = -Phi^(k) along q + qd t + ... without q^(k), u(t)

    Args:
        mechanism: The mechanism.
        count: n.
        joints: Its joints, those with other laws in place of the mechanism's own. Default: its own.

    """

    def __init__(self, mechanism: Mechanism, count: int, joints: Sequence[Joint] = ()) -> None:
        self.mechanism = mechanism
        self.joints = tuple(joints) or mechanism.joints
        self.count = count
        self.system = System(mechanism)

    def solved(self, q: Sequence[Taylor], targets: Sequence[Taylor], order: int) -> tuple[FloatArray, FloatArray]:
        """Return what a derivative of the coordinates lacks to satisfy the equations.

        Args:
            q: The coordinates; derivatives below the order satisfy the equations, or are close to that for order 0.
            targets: The drivers' values.
            order: 0 to 3.

        Returns:
            (n, coordinates), to be added to the derivative; (n,) 1 / condition of the scaled Jacobian.

        """
        delta = -self._columns(self._evaluate(q, targets), order)  # (n, rows)
        u, sizes, v = self._decomposed(q, targets)
        solved = np.einsum("nij,ni->nj", u, delta / self.system.scales / self.system.size)
        with np.errstate(divide="ignore", invalid="ignore"):
            missing = np.einsum("nij,ni->nj", v, solved / sizes) * self.system.column_scales
            margin = sizes[:, -1] / sizes[:, 0]
        return missing, margin

    def slopes(self, q: Sequence[Taylor], targets: Sequence[Taylor]) -> FloatArray:
        """Return the rates of the coordinates (n, coordinates) that follow from those of the drivers."""
        return self.solved([Taylor.of(3, one.c[0]) for one in q], targets, 1)[0]

    def _decomposed(self, q: Sequence[Taylor], targets: Sequence[Taylor]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the singular values and vectors of the scaled Jacobian."""
        at_rest = [Taylor((target.c[0], 0.0)) for target in targets]
        units = ([Taylor((one.c[0], float(j == k))) for j, one in enumerate(q)] for k in range(len(q)))
        jacobian = np.stack([self._columns(self._evaluate(unit, at_rest), 1) for unit in units], -1)
        scaled = jacobian / self.system.scales[:, None] * self.system.column_scales / self.system.size
        u, sizes, v = np.linalg.svd(np.nan_to_num(scaled), full_matrices=False)
        return u, sizes, v

    def _evaluate(self, q: Sequence[Taylor], targets: Sequence[Taylor]) -> list[Any]:
        at = placement(self.mechanism, q)
        phi = [value for joint in self.joints for value in joint.residual(at)]
        return phi + [one.residual(at, u) for one, u in zip(self.mechanism.drivers, targets, strict=True)]

    def _columns(self, values: Sequence[Any], order: int) -> FloatArray:
        return np.stack([derivative(value, order, self.count) for value in values], -1)


def derivative(value: Any, order: int, count: int) -> FloatArray:
    """Return a derivative of a Taylor number or a float at all of `count` poses."""
    found = value.derivative(order) if isinstance(value, Taylor) else (0.0 if order else value)
    return np.broadcast_to(np.asarray(found, dtype=float), (count,)).copy()


def with_derivative(number: Taylor, order: int, value: FloatArray) -> Taylor:
    """Return a number with a value added to a derivative."""
    added = Taylor.of(3, *(value if k == order else 0.0 for k in range(order + 1)))
    return Taylor((number + added).c, number.side)
