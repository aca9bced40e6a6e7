"""Joints: each is its residual in plain arithmetic, and everything else follows from that formula.

To add a joint, write a file and add a line here.
"""

from __future__ import annotations

from kinfmu.mechanism.joints.cam import CamFlatFace, CamOscillating, CamRoller, CamTranslating
from kinfmu.mechanism.joints.coupling import Coupling
from kinfmu.mechanism.joints.fixed import Fixed
from kinfmu.mechanism.joints.gear import Gear, RackAndPinion
from kinfmu.mechanism.joints.held import Angle, Coordinate, Distance, Held, PointOnLine, RelativeAngle
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.joints.revolute import Revolute
from kinfmu.mechanism.joints.translational import Translational

JOINTS: tuple[type[Joint], ...] = (
    Revolute,
    Translational,
    Fixed,
    Distance,
    PointOnLine,
    Coordinate,
    Angle,
    RelativeAngle,
    Gear,
    RackAndPinion,
    CamTranslating,
    CamOscillating,
    CamRoller,
    CamFlatFace,
    Coupling,
)

__all__ = [
    "JOINTS",
    "Angle",
    "CamFlatFace",
    "CamOscillating",
    "CamRoller",
    "CamTranslating",
    "Coordinate",
    "Coupling",
    "Distance",
    "Fixed",
    "Gear",
    "Held",
    "Joint",
    "PointOnLine",
    "RackAndPinion",
    "RelativeAngle",
    "Revolute",
    "Translational",
]
