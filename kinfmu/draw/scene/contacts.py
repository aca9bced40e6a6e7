"""Contact forces of cams with a known profile: where they act and which way, for their arrows."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.scene import Scene
from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints import CamFlatFace, CamOscillating, CamRoller
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.motion.cams import CamJoint, placed_cam, turn_of
from kinfmu.motion.cams.placed import members_of
from kinfmu.motion.cams.profile import envelope
from kinfmu.motion.cams.traced import ComplexArray, traced
from kinfmu.run import Run
from kinfmu.units import METRES


def contact_force(
    run: Run, mechanism: Mechanism, scene: Scene, joint: CamJoint
) -> tuple[FloatArray, FloatArray] | None:
    """Return the force of a cam on its follower (n, 2) [N], and the contact (n, 2) [length]; None if it is unknown."""
    cam, _, _ = members_of(joint)
    good = np.flatnonzero(run.good)
    if not len(good) or any(body not in scene.frames for body in joint.bodies()):
        return None
    try:
        poses = {name: tuple(frames[good[0]].tolist()) for name, frames in scene.frames.items()}
        placed = placed_cam(mechanism, joint, poses)
        if not placed.is_known:
            return None
        frame, holder = scene.frames[cam], scene.frames[placed.holder]
        angles = np.where(run.good, frame[:, 2] - holder[:, 2], placed.turn)
        found = traced(placed, turn_of(placed, angles))
    except MechanismError:
        return None
    out, contact = found.normal, envelope(placed, found)
    in_holder = np.exp(1j * angles)
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(joint, CamFlatFace):
            size = run[f"{joint.name}.force"]
        elif isinstance(joint, CamRoller):
            radius = found.curve - placed.pole
            size = run[f"{joint.name}.force"] / (out * (radius / np.abs(radius)).conj()).real
        elif isinstance(joint, CamOscillating) and placed.pivot is not None:
            arm = found.curve * in_holder - placed.pivot
            moment = run[f"{joint.name}.moment"] / METRES[mechanism.length_unit]
            size = moment / (arm.conj() * out * in_holder).imag
        else:
            size = run[f"{joint.name}.force"] / (out * in_holder * placed.direction.conjugate()).real
    turn, origin = np.exp(1j * frame[:, 2]), frame[:, 0] + 1j * frame[:, 1]
    return _pairs(size * out * turn), _pairs(origin + (contact + placed.axle) * turn)


def _pairs(points: ComplexArray) -> FloatArray:
    return np.column_stack([points.real, points.imag])
