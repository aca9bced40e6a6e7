"""Joints, one a file: each is its residual in plain arithmetic, and everything else follows from that formula.

Adding a joint is one file and one line here.
"""

from __future__ import annotations

from kinfmu.joints.coordinate import Coordinate
from kinfmu.joints.distance import Distance
from kinfmu.joints.joint import GROUND, Joint, Placement, Pose
from kinfmu.joints.revolute import Revolute

JOINTS: tuple[type[Joint], ...] = (Revolute, Distance, Coordinate)

__all__ = ["GROUND", "JOINTS", "Coordinate", "Distance", "Joint", "Placement", "Pose", "Revolute"]
