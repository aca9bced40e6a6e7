"""Arrows of the forces that joints transmit and loads exert, to one scale for the whole run, with a legend."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene
from kinfmu.errors import KinfmuError, MechanismError
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import (
    CamFlatFace,
    CamOscillating,
    CamRoller,
    Distance,
    Fixed,
    Joint,
    PointOnLine,
    Revolute,
    Translational,
)
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement, body_of
from kinfmu.motion.cams import CAM_JOINTS, CamJoint, placed_cam, turn_of
from kinfmu.motion.cams.placed import members_of
from kinfmu.motion.cams.profile import envelope
from kinfmu.motion.cams.traced import pairs, traced
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Run
from kinfmu.run.axis import TIME
from kinfmu.units import METRES

LONGEST = 0.3  # length of the longest arrow, as a part of the linkage's size
_STEPS = (5.0, 2.0, 1.0)  # first digits of the force in the legend
MOST_SAMPLES = 5000  # at which a load is evaluated; of longer runs the nearest of these is shown


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
    forces: dict[str, FloatArray] = {}
    tails: dict[str, FloatArray] = {}
    kept = {name.owner for name in run.reaction_names} - {
        name.owner for name in run.reaction_names if name in run.absent
    }
    for joint in mechanism.joints:
        if joint.name in kept and isinstance(joint, CAM_JOINTS):
            contact = contact_force(run, mechanism, scene, joint)
            if contact is not None and np.isfinite(contact[0]).any():
                forces[f"joints.{joint.name}"], tails[f"joints.{joint.name}"] = contact
            continue
        points = getattr(joint, "between", ())  # or bodies, of joints that have no arrow
        if joint.name not in kept or any(point not in mechanism.body_points for point in points):
            continue
        if any(body_of(point) not in scene.frames for point in points):
            continue
        ends = [world(scene.frames[body_of(point)], mechanism.body_points[point]) for point in points]
        force = _force(run, scene, joint, ends)
        if force is not None and np.isfinite(force).any():
            forces[f"joints.{joint.name}"], tails[f"joints.{joint.name}"] = force, ends[-1]
    for name, at, force in load_forces(run, mechanism, scene):
        if np.isfinite(force).any():
            forces[f"loads.{name}"], tails[f"loads.{name}"] = force, at
    sizes = [np.hypot(*force.T) for force in forces.values()]
    largest = max((float(np.nanpercentile(size, 99.0)) for size in sizes), default=0.0)
    if not (largest > 0.0 and math.isfinite(largest)):
        return None
    scale = LONGEST * scene.size / largest
    tens = 10.0 ** math.floor(math.log10(largest))
    newton = next((step * tens for step in _STEPS if step * tens <= largest), tens)
    longest = 2.0 * LONGEST * scene.size  # of outliers
    drawn = {
        name: force * np.fmin(scale, longest / np.fmax(np.hypot(*force.T), 1e-300))[:, None]
        for name, force in forces.items()
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
        curve = traced(placed, turn_of(placed, angles))
    except MechanismError:
        return None
    out, contact = curve.normal, envelope(placed, curve)
    in_holder = np.exp(1j * angles)
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(joint, CamFlatFace):
            size = run[f"{joint.name}.force"]
        elif isinstance(joint, CamRoller):
            radius = curve.curve - placed.pole
            size = run[f"{joint.name}.force"] / (out * (radius / np.abs(radius)).conj()).real
        elif isinstance(joint, CamOscillating) and placed.pivot is not None:
            arm = curve.curve * in_holder - placed.pivot
            moment = run[f"{joint.name}.moment"] / METRES[mechanism.length_unit]
            size = moment / (arm.conj() * out * in_holder).imag
        else:
            size = run[f"{joint.name}.force"] / (out * in_holder * placed.direction.conjugate()).real
    turn, origin = np.exp(1j * frame[:, 2]), frame[:, 0] + 1j * frame[:, 1]
    return pairs(size * out * turn), pairs(origin + (contact + placed.axle) * turn)


def load_forces(run: Run, mechanism: Mechanism, scene: Scene) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Yield the name of each load that is a force, the points (n, 2) where it acts, and the force (n, 2) [N].

    Of a load between two points it is the force on the second one. Torques have no arrow, and neither have loads whose
    effort is unknown: those by an input, which a run does not hold, and those over time in a run without times.
    """
    rows = np.unique(np.linspace(0, len(run) - 1, min(len(run), MOST_SAMPLES)).round().astype(int))
    nearest = np.abs(np.searchsorted(0.5 * (rows[1:] + rows[:-1]), np.arange(len(run)))) if len(rows) else rows
    for load in mechanism.loads:
        is_posed = all(body in scene.frames or body == GROUND_NAME for body in load.bodies())
        needs_time = getattr(load, "law", None) is not None and getattr(load, "over", None) is None
        if "angle" in load.kinds() or load.inputs() or not is_posed or (needs_time and run.axis != TIME):
            continue
        point = str(getattr(load, "at", "") or load.between[1])  # type: ignore[attr-defined]  # one or the other
        at = world(scene.frames[body_of(point)], mechanism.body_points[point])
        try:
            force = np.array([_force_of_load(run, mechanism, scene, load, int(row)) for row in rows])
        except (KinfmuError, ArithmeticError, ValueError):  # such as rates that were not kept
            continue
        yield load.name, at, force[nearest]


def _force_of_load(run: Run, mechanism: Mechanism, scene: Scene, load: Load, row: int) -> tuple[float, float]:
    """Return the force of a load at a sample [N]; NaN where the sample has no numbers."""
    if not run.good[row]:
        return np.nan, np.nan
    moving, still = {GROUND_NAME: GROUND}, {GROUND_NAME: GROUND}
    for body in {*load.bodies()} - {GROUND_NAME}:
        pose = scene.frames[body][row].tolist()
        rates = [float(run[f"{body}.{rate}"][row]) for rate in ("vx", "vy", "omega")]
        still[body] = BodyFrame.of(*pose)
        moving[body] = BodyFrame.of(*(Taylor.of(1, one, rate) for one, rate in zip(pose, rates, strict=True)))
    place, metre = Placement(still, mechanism.body_points), METRES[mechanism.length_unit]
    quantities = load.measured(Placement(moving, mechanism.body_points))
    s = [metre * one.derivative(0) if isinstance(one, Taylor) else metre * one for one in quantities]
    sd = [metre * one.derivative(1) if isinstance(one, Taylor) else 0.0 for one in quantities]
    over = load.argument(place)
    efforts = load.efforts(place, s, sd, float(run.t[row]) if over is None else over)
    if len(efforts) > 1:
        return float(efforts[0]), float(efforts[1])
    d_x, d_y = place.vector(load.between)  # type: ignore[attr-defined]  # all loads of one length have it
    distance = float(np.hypot(d_x, d_y))
    return float(efforts[0]) * d_x / distance, float(efforts[0]) * d_y / distance
