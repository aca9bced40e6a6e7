"""Arrows of the forces that joints transmit and loads exert, to one scale for the whole run, with a legend."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.contacts import contact_force
from kinfmu.draw.scene.loads import load_forces
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene
from kinfmu.mechanism.joints import Distance, Fixed, Joint, PointOnLine, Revolute, Translational
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.motion.cams import CAM_JOINTS
from kinfmu.run import Run

LONGEST = 0.3  # length of the longest arrow, as a part of the linkage's size
_STEPS = (5.0, 2.0, 1.0)  # first digits of the force in the legend


@dataclass(frozen=True, eq=False)
class Arrows:
    """Forces: of the first body of a joint on the second, and of loads, from where they act.

    at: tails (n, 2) by name, such as 'joints.pin' or 'loads.gas' [length]; along: (n, 2) by name, drawn to scale
    [length], NaN where unknown; newton: the force in the legend [N]; length: of an arrow of that force [length].
    """

    at: Mapping[str, FloatArray]
    along: Mapping[str, FloatArray]
    newton: float
    length: float

    @property
    def legend(self) -> str:
        """The force of the arrow in the legend: '500 N'."""
        return f"{self.newton:g} N"


def arrows(run: Run, mechanism: Mechanism, scene: Scene) -> Arrows | None:
    """Return the arrows of loads and of all reactions that the run holds; None if there are none.

    The scale is that of the largest force, without outliers: forces may grow without bound at a singular point.
    """
    known: dict[str, FloatArray] = {}
    tails: dict[str, FloatArray] = {}
    kept = {name.owner for name in run.reaction_names} - {
        name.owner for name in run.reaction_names if name in run.absent
    }
    for joint in mechanism.joints:
        if joint.name in kept and isinstance(joint, CAM_JOINTS):
            contact = contact_force(run, mechanism, scene, joint)
            if contact is not None and np.isfinite(contact[0]).any():
                known[f"joints.{joint.name}"], tails[f"joints.{joint.name}"] = contact
            continue
        points = getattr(joint, "between", ())  # or bodies, of joints that have no arrow
        if joint.name not in kept or any(point not in mechanism.body_points for point in points):
            continue
        if any(body_of(point) not in scene.frames for point in points):
            continue
        ends = [world(scene.frames[body_of(point)], mechanism.body_points[point]) for point in points]
        force = _force(run, scene, joint, ends)
        if force is not None and np.isfinite(force).any():
            known[f"joints.{joint.name}"], tails[f"joints.{joint.name}"] = force, ends[-1]
    for name, at, force in load_forces(run, mechanism, scene):
        if np.isfinite(force).any():
            known[f"loads.{name}"], tails[f"loads.{name}"] = force, at
    sizes = [np.hypot(*force.T) for force in known.values()]
    largest = max((float(np.nanpercentile(size, 99.0)) for size in sizes), default=0.0)
    if not (largest > 0.0 and math.isfinite(largest)):
        return None
    scale = LONGEST * scene.size / largest
    tens = 10.0 ** math.floor(math.log10(largest))
    newton = next((step * tens for step in _STEPS if step * tens <= largest), tens)
    longest = 2.0 * LONGEST * scene.size  # of outliers
    drawn = {
        name: force * np.fmin(scale, longest / np.fmax(np.hypot(*force.T), 1e-300))[:, None]
        for name, force in known.items()
    }
    return Arrows(tails, drawn, newton, newton * scale)


def _force(run: Run, scene: Scene, joint: Joint, ends: list[FloatArray]) -> FloatArray | None:
    """Return the force of the first body on the second (n, 2) [N]; None for joints without such an arrow."""
    if isinstance(joint, Revolute | Fixed):
        return np.column_stack([run[f"{joint.name}.force_x"], run[f"{joint.name}.force_y"]])
    if isinstance(joint, Distance):
        along = ends[1] - ends[0]
        return np.asarray(run[f"{joint.name}.force"][:, None] * along / np.hypot(*along.T)[:, None])
    if isinstance(joint, Translational | PointOnLine):
        turn = float(joint.axis) + scene.frames[body_of(joint.between[0])][:, 2]
        return np.asarray(run[f"{joint.name}.force"][:, None] * np.column_stack([-np.sin(turn), np.cos(turn)]))
    return None
