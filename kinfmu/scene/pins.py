"""Where joints hold bodies by pins."""

from __future__ import annotations

from kinfmu.joints import CamRoller, Coordinate, Distance, Fixed, PointOnLine, Revolute
from kinfmu.joints.joint import Joint


def pins_of(joint: Joint) -> tuple[str, ...]:
    """Points 'body.point' where a joint has a pin; those of a revolute joint coincide, a block that slides has none."""
    if isinstance(joint, Revolute | Fixed):
        return joint.between[:1]
    if isinstance(joint, Distance):
        return joint.between
    if isinstance(joint, PointOnLine | CamRoller):
        return joint.between[1:]
    return (joint.of,) if isinstance(joint, Coordinate) else ()


def supported(joint: Joint) -> tuple[str, ...]:
    """Points 'body.point' that a joint loads, each on its own body: supports, where they are the ground's."""
    return joint.between if isinstance(joint, Revolute | Fixed) else pins_of(joint)
