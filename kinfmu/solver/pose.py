"""Pose: an assembled pose of a mechanism at given driver values, and how it is found by Newton."""

from __future__ import annotations

from typing import Any

from .status import Status

Vector = tuple[float, ...]
Model = Any  # a generated module: see kinfmu.backends.python.emit


class Pose:
    """A value; what is derived from it is computed when first asked for.

    u: driver values; z: unknowns of all blocks; determinants: one a block, 1 far from singular; residual: largest,
    relative to the size; values: numbers of the position stage that later stages use; held: bit a block whose z was
    interpolated; bridges: singular stretches met on the way here. status and message: see Status.
    """

    __slots__ = (
        "_tangent",
        "bridge",
        "bridges",
        "determinants",
        "held",
        "iterations",
        "message",
        "residual",
        "status",
        "u",
        "values",
        "z",
    )

    def __init__(self, u: Vector, found: tuple[Any, ...], bridges: tuple[Any, ...] = ()) -> None:
        self.u = u
        self.z, self.determinants, self.residual, self.iterations, self.values = found
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


def failed(start: Pose, u: Vector, status: Status, message: str) -> Pose:
    """A pose without numbers: what could not be reached from `start`, and why."""
    pose = Pose(u, (start.z, start.determinants, start.residual, start.iterations, start.values), start.bridges)
    pose.status = status
    pose.message = message
    return pose


def predicted(model: Model, pose: Pose, direction: Vector, s: float) -> Vector:
    """Taylor's second-order prediction of z after a way s along the direction."""
    zd, zdd = pose.tangent(model, direction)
    half = 0.5 * s
    return tuple([z + s * (d + half * dd) for z, d, dd in zip(pose.z, zd, zdd)])  # noqa: B905  equal by construction


def corrected(model: Model, u: Vector, guess: Vector, bridges: tuple[Any, ...]) -> Pose | None:
    """The pose that Newton finds from a guess, or None if it finds none."""
    try:
        return Pose(u, model.position(u, guess), bridges)
    except (ArithmeticError, ValueError):  # singular, diverged, or the sine of an overflow
        return None
