"""Pose: an assembled pose of a mechanism at given driver values, and how it is found by Newton."""

from __future__ import annotations

from typing import Any

from .status import Status

Vector = tuple[float, ...]
ALONE: Vector = (1.0,)  # the direction of a single driver: derivatives are with respect to it
AT_REST: Vector = (0.0,)
Model = Any  # a generated module: see kinfmu.backends.python.emit


class Pose:
    """A value; what is derived from it is computed when first asked for.

    u: driver values; z: unknowns of all blocks; determinants: one a block, 1 far from singular; residual: largest,
    relative to the size; moved: largest correction of the prediction, in radians and sizes; values: numbers of the
    position stage that later stages use; held: bit a block whose z was interpolated; bridges: singular stretches met on
    the way here. status and message: see Status.
    """

    __slots__ = (
        "_tangent",
        "bridge",
        "bridges",
        "determinants",
        "held",
        "iterations",
        "message",
        "moved",
        "residual",
        "status",
        "u",
        "values",
        "z",
    )

    def __init__(self, u: Vector, found: tuple[Any, ...], bridges: tuple[Any, ...] = ()) -> None:
        self.u = u
        self.z, self.determinants, self.residual, self.iterations, self.moved, self.values = found
        self.bridges = bridges
        self.bridge: Any = None  # the Bridge that this pose was interpolated by
        self.held = 0
        self.status: int = Status.OK
        self.message = ""
        self._tangent: tuple[Vector, Vector, Vector] | None = None

    @property
    def good(self) -> bool:
        """True if the pose holds numbers."""
        return self.status <= Status.BRIDGED

    def margin(self) -> float:
        """Smallest |determinant| over the blocks: 1 far from singular, 0 at a singular point."""
        return min(map(abs, self.determinants), default=1.0)

    def tangent(self, model: Model, direction: Vector) -> tuple[Vector, Vector]:
        """First and second derivative of z when the drivers move at a steady rate: zd, zdd for ud = direction."""
        cached = self._tangent
        if cached is None or cached[0] != direction:
            at_rest = (0.0,) * len(direction)
            zd = model.velocity(self.values, direction)
            cached = self._tangent = (direction, zd, model.acceleration(self.values, direction, at_rest, zd))
        return cached[1], cached[2]

    def with_tangent(self, direction: Vector, zd: Vector, zdd: Vector) -> Pose:
        """The same pose with a tangent that is known already."""
        self._tangent = (direction, zd, zdd)
        return self


    def found(self) -> tuple[Any, ...]:
        """What `position` gave for this pose."""
        return self.z, self.determinants, self.residual, self.iterations, self.moved, self.values


def failed(start: Pose, u: Vector, status: Status, message: str) -> Pose:
    """A pose without numbers: what could not be reached from `start`, and why."""
    pose = Pose(u, start.found(), start.bridges)
    pose.status = status
    pose.message = message
    return pose


def evaluated(model: Model, u: Vector, z: Vector, held: int = -1) -> tuple[Any, ...]:
    """What `position` gives for unknowns that are known: held blocks (all, if nothing is said) are not solved for.

    s = -0.0 at rest leaves z as it is, to the bit.
    """
    rest = (0.0,) * len(z)
    return tuple(model.position(u, z, rest, rest, -0.0, held))


def corrected(model: Model, u: Vector, pose: Pose, direction: Vector, s: float) -> Pose | None:
    """The pose that Newton finds at u from the second-order prediction a way s along the direction, or None."""
    zd, zdd = pose.tangent(model, direction)
    try:
        return Pose(u, model.position(u, pose.z, zd, zdd, s), pose.bridges)
    except (ArithmeticError, ValueError):  # singular, diverged, or the sine of an overflow
        return None
