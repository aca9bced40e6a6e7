"""What of a follower touches its cam: a roller, a knife edge or a flat face. It does not change the motion."""

from __future__ import annotations

from typing import Annotated

from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints.joint import Condition
from kinfmu.units import Quantity

RollerRadius = Annotated[
    float | None,
    Quantity("length"),
    "radius of the roller, 0 for a knife edge [length]; default: unknown, and then there is no profile",
]
FaceNormal = Annotated[
    float | None,
    Quantity("angle"),
    "direction of the normal of a flat face, away from the cam, in the follower's frame [rad]; default: no flat face",
]


def roller_conditions(radius: float | None) -> tuple[Condition, ...]:
    """Return the condition on the radius of a roller, none without one."""
    return () if radius is None else (Condition("roller_radius", radius, "0 or more"),)


def check_element(name: str, radius: float | None, normal: float | None = None) -> None:
    """Raise a MechanismError for a negative radius, or for both a roller and a flat face."""
    if radius is not None and not radius >= 0.0:
        raise MechanismError(f"[joints.{name}] roller_radius = {radius!r} must be 0 or more", joint=name)
    if radius is not None and normal is not None:
        raise MechanismError(
            f"[joints.{name}] has both 'roller_radius' and 'normal'; a follower has a roller or a flat face", joint=name
        )
