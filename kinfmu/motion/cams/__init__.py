"""Cams: pitch curve, profile, pressure angle and curvature, from the joint that leads the follower."""

from __future__ import annotations

from kinfmu.motion.cams.critical import CamExtreme, Critical, Cut, critical_values
from kinfmu.motion.cams.placed import CAM_JOINTS, NO_PROFILE, CamJoint, PlacedCam, placed_cam
from kinfmu.motion.cams.profile import CamProfile, profile_at, turn_of
from kinfmu.motion.cams.traced import pressing_sign

__all__ = [
    "CAM_JOINTS",
    "NO_PROFILE",
    "CamExtreme",
    "CamJoint",
    "CamProfile",
    "Critical",
    "Cut",
    "PlacedCam",
    "critical_values",
    "placed_cam",
    "pressing_sign",
    "profile_at",
    "turn_of",
]
