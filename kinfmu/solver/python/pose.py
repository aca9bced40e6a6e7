"""Pose: an assembled pose of a mechanism at given driver values, its status, and how it is found by Newton."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

Vector = tuple[float, ...]
Model = Any  # a generated module: see kinfmu.codegen.python.emit
Found = tuple[Any, ...]  # result of its `position`

EPS = 2.220446049250313e-16
POLISHED = 0.1  # determinant below which Newton goes on until the residual no longer falls
UNDECIDED = 1e-6  # determinant below which a path ends: lengths within 1e-12 of a change point give such a determinant
STEEP = 100.0  # slope of an unknown over the driver, both in radians or sizes; right before a dead centre it is more
UNIT_SPEED: Vector = (1.0,)  # of a single driver: derivatives are then with respect to its value
AT_REST: Vector = (0.0,)


class Status(IntEnum):
    """Status of a sample: 0 to 2 hold numbers, 3 to 5 do not."""

    OK = 0
    NEAR_SINGULAR = 1  # right, but with fewer digits: see the error estimate
    BRIDGED = 2  # interpolated across a singular point; the interpolated pose closes
    OUTSIDE = 3  # the drivers cannot take the mechanism there
    INCONSISTENT = 4  # a watch (a redundant row that is monitored) does not close there
    NOT_CONVERGED = 5


class Pose:
    """An assembled pose at given driver values; derivatives are computed when first used.

    u: driver values; z: unknowns of all blocks; determinants: one for each block, 1 far from singular, 0 at a singular
    point; margin: the smallest of their sizes; residual: the largest length of a block's residuals, relative to the
    size; moved: largest correction of the prediction, in radians and sizes; watch: largest residual of the *watches*
    (redundant rows, which are not solved but monitored), relative to the size; values: numbers of the position stage
    that later stages use; singularities: the map known here; bridge: the one by which this pose was interpolated;
    status and message: see Status.
    """

    __slots__ = (
        "base",
        "bridge",
        "determinants",
        "iterations",
        "margin",
        "message",
        "moved",
        "residual",
        "singularities",
        "status",
        "tangent",
        "tracks",
        "u",
        "values",
        "watch",
        "z",
    )

    def __init__(self, u: Vector, found: Found, singularities: Any = None) -> None:
        self.u = u
        (
            self.z,
            self.determinants,
            self.margin,
            self.residual,
            self.iterations,
            self.moved,
            self.watch,
            self.values,
        ) = found
        self.singularities = singularities  # a SingularityMap; with several drivers one for each; None: none known
        self.bridge: Any = None
        self.base: Pose | None = None  # the pose that the next path starts from, if not this one: see advance
        self.status: int = 0
        self.message = ""
        self.tracks: tuple[tuple[Any, Pose], ...] = ()  # with several drivers: each track, and its pose
        self.tangent: tuple[Vector, Vector] | None = None  # of a single driver: see tangent_of

    @property
    def is_bridged(self) -> bool:
        """Whether unknowns of the pose are interpolated."""
        if not self.tracks:
            return self.bridge is not None
        return any(own.bridge is not None for _, own in self.tracks)

    @property
    def good(self) -> bool:
        """Whether the pose holds numbers."""
        return self.status <= 2

    def found(self) -> Found:
        """Return the result of `position` for this pose."""
        return (
            self.z,
            self.determinants,
            self.margin,
            self.residual,
            self.iterations,
            self.moved,
            self.watch,
            self.values,
        )


def tangent_of(model: Model, pose: Pose) -> tuple[Vector, Vector]:
    """Return first and second derivative of z with respect to the only driver."""
    tangent = pose.tangent
    if tangent is None:
        tangent = pose.tangent = model.tangent(pose.values)
    return tangent


def directed(model: Model, pose: Pose, direction: Vector) -> tuple[Vector, Vector]:
    """Return first and second derivative of z on a straight path of the drivers."""
    if len(direction) == 1:
        return tangent_of(model, pose)
    zd = model.velocity(pose.values, direction)
    return zd, model.acceleration(pose.values, direction, (0.0,) * len(direction), zd)


def failed(start: Pose, u: Vector, status: Status, message: str) -> Pose:
    """Return a pose without numbers, with the reason why `u` cannot be reached from `start`."""
    pose = Pose(u, start.found(), start.singularities)
    pose.status = status
    pose.message = message
    return pose


def with_map(pose: Pose, singularities: Any) -> Pose:
    """Return the same pose with another singularity map."""
    other = Pose(pose.u, pose.found(), singularities)
    other.tangent = pose.tangent
    return other


def position(model: Model, u: Vector, z: Vector, zd: Vector, zdd: Vector, s: float, held: int = 0) -> Found:
    """Return the result of the model's `position`; near a singular pose Newton goes on while the residual falls."""
    found: Found = model.position(u, z, zd, zdd, s, held)
    return found if found[2] >= POLISHED or held < 0 else polished(model, u, found, held)


def polished(model: Model, u: Vector, found: Found, held: int = 0) -> Found:
    """Continue Newton from a pose near a singular one; return the pose as it is where that gains nothing."""
    if held and not any(abs(size) < POLISHED and not held >> k & 1 for k, size in enumerate(found[1])):
        return found  # the blocks near a singular pose are not solved for
    rest = (0.0,) * len(found[0])
    try:
        better: Found = model.position(u, found[0], rest, rest, -0.0, held, 0.0)
    except (ArithmeticError, ValueError):
        return found
    if not better[3] <= found[3]:
        return found
    return (*better[:4], found[4] + better[4], found[5], *better[6:])


def evaluated(model: Model, u: Vector, z: Vector, held: int = -1) -> Found:
    """Return the result of `position` at given unknowns; held blocks (default: all) are not solved for.

    With s = -0.0 and zero rates z stays as it is, to the bit.
    """
    rest = (0.0,) * len(z)
    return position(model, u, z, rest, rest, -0.0, held)
