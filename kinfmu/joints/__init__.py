"""Joints, one per file: each is its residual in plain arithmetic, and everything else follows from that formula.

To add a joint, write a file and add a line here.
"""

from __future__ import annotations

from kinfmu.joints.angle import Angle
from kinfmu.joints.cam_oscillating import CamOscillating
from kinfmu.joints.cam_roller import CamRoller
from kinfmu.joints.cam_translating import CamTranslating
from kinfmu.joints.coordinate import Coordinate
from kinfmu.joints.coupling import Coupling
from kinfmu.joints.distance import Distance
from kinfmu.joints.fixed import Fixed
from kinfmu.joints.gear import Gear
from kinfmu.joints.joint import Held, Joint
from kinfmu.joints.point_on_line import PointOnLine
from kinfmu.joints.rack_and_pinion import RackAndPinion
from kinfmu.joints.relative_angle import RelativeAngle
from kinfmu.joints.revolute import Revolute
from kinfmu.joints.translational import Translational

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
    Coupling,
)

__all__ = [
    "JOINTS",
    "Angle",
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
