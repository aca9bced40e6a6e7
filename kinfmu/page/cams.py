"""The data with which a page draws cams again after a change: what a cam depends on, and what touches it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints import CamFlatFace, CamRoller, Revolute
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.motion.cams.placed import members_of
from kinfmu.page.opened import number_data

CAM_SHAPES = ("cam", "pitch", "face")  # kinds; a cam with one of them is known


def cam_data(mechanism: Mechanism, joint: Any, numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return a cam: its bodies and points, and the bodies and joints whose numbers determine its curve.

    Args:
        mechanism: The mechanism.
        joint: A joint of a cam whose contact is known.
        numbers: The numbers of points, by 'body.point'.

    """
    cam, follower, touching = members_of(joint)
    if touching is None:
        raise TypeError(f"the contact of cam '{joint.name}' is unknown")
    found: dict[str, Any] = {"name": joint.name, "body": cam, "follower": follower, "point": numbers[touching]}
    for key in ("roller_radius", "normal"):
        value = getattr(joint, key, None)
        if value is not None:
            found[key] = number_data(mechanism, ("joints", joint.name, key), float(value))
    if isinstance(joint, CamRoller | CamFlatFace):  # the file has the curve
        return found | {"centre": numbers[joint.between[0]], "bodies": [], "joints": [joint.name]}
    bodies = joint.bodies()
    among = [one for one in mechanism.joints if {*one.bodies()} <= {*bodies}]
    axle = next(one for one in among if isinstance(one, Revolute) and {*one.bodies()} == {cam, joint.holder()})
    own = next(point for point in axle.between if body_of(point) == cam)
    return found | {"centre": numbers[own], "bodies": list(bodies), "joints": [one.name for one in among]}
