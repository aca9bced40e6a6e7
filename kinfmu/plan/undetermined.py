"""Forces without a value.

Reactions: redundant rows share their load, or they carry the unknown contact force of a cam. Loads along the line
between two points: where these are in the same place, the load has no direction.
"""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.mechanism.force_names import reaction_names_of
from kinfmu.mechanism.joints.cam import Cam
from kinfmu.plan.equations.closing import motion_samples, null_space
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.system import System
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.origin import localized
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.reactions import follower_of, known_contacts, supports
from kinfmu.plan.steps import needed_steps
from kinfmu.units import ForceName, Quantity

_POSES = 4  # of the motion, as a row may happen to carry nothing at a single pose
_CARRIES = 1e-7  # weight of a row in a balance of unit size from which on it takes part


def undetermined_reactions(plan: SolvePlan) -> tuple[ForceName, ...]:
    """Return the reactions that have no value, in the order of `reaction_names_of`."""
    undetermined = {*shared_reactions(plan)}.union(*unknown_contacts(plan).values())
    return tuple(name for name in reaction_names_of(plan.mechanism) if name in undetermined)


def shared_reactions(plan: SolvePlan) -> dict[ForceName, tuple[str, ...]]:
    """Return the reactions that redundant rows leave undetermined, each with the rows that share its load."""
    shared: dict[str, tuple[str, ...]] = {}
    for rows in plan.load_sharing:
        for row in rows:
            shared[row] = tuple(dict.fromkeys((*shared.get(row, ()), *rows)))
    joints = plan.mechanism.joints
    for number, carriers in known_contacts(joints):
        cam = joints[number]
        for row in shared.get(f"{cam.name}.{cam.labels[0]}", ()):
            for carrier in carriers:
                for label in joints[carrier].labels:
                    carried = f"{joints[carrier].name}.{label}"
                    shared[carried] = tuple(dict.fromkeys((*shared.get(carried, ()), row)))
    return {
        name: shared[row]
        for row, name in zip(row_names(plan), reaction_names_of(plan.mechanism), strict=False)
        if row in shared
    }


def row_names(plan: SolvePlan) -> list[str]:
    """Return the names of the joints' rows, in the order of `reaction_names_of`."""
    return [f"{joint.name}.{label}" for joint in plan.mechanism.joints for label in joint.labels]


def unknown_contacts(plan: SolvePlan) -> dict[str, tuple[ForceName, ...]]:
    """Return the reactions that depend on the unknown direction of a contact force, by the cam's joint.

    The contact can exert any force on the follower, and its opposite on the cam, that does no work. Reactions are those
    of the rows that balance such forces. The reaction of the joint itself is the force along the lift or its moment,
    which has the same value for all of them.
    """
    mechanism = plan.mechanism
    names = reaction_names_of(mechanism)
    cams = [joint for joint in mechanism.joints if isinstance(joint, Cam) and why_unknown(plan, joint)]
    if not names or not cams:
        return {}
    system = System(localized(mechanism)[0])
    part = Part(system, range(system.joint_row_count))
    poses = list(motion_samples(part, plan.anchor.q, _POSES)) or [plan.anchor.q]
    rows, shared = row_names(plan), shared_reactions(plan)
    loaded = {}
    for cam in cams:
        carrying = np.zeros(len(rows), dtype=bool)
        for pose in poses:
            matrix = np.vstack([part.jacobian(pose), _pushes(system, cam, pose)])
            balances = null_space(matrix.T)  # (rows and pushes, k); also those of redundant rows alone
            carrying |= (np.abs(balances[: len(rows)]) > _CARRIES).any(axis=1)
        carrying[rows.index(f"{cam.name}.{cam.labels[0]}")] = False
        rows_of_cam = zip(names, carrying.tolist(), strict=False)
        loaded[cam.name] = tuple(name for name, carries in rows_of_cam if carries and name not in shared)
    return {cam: reactions for cam, reactions in loaded.items() if reactions}


def why_unknown(plan: SolvePlan, cam: Cam) -> str:
    """Return what is missing for the contact force of a cam with a lift law; '' if it is known."""
    if not cam.is_contact_known:
        keys = "'roller_radius' or 'normal'"
        return f"the key {keys} is missing" if cam.touching() else f"the keys 'contact' and {keys} are missing"
    if supports(plan.mechanism.joints, cam) is None:
        return f"no joint holds the cam '{cam.cam}', or the follower '{follower_of(cam)}', directly at '{cam.holder()}'"
    return ""


def _pushes(system: System, cam: Cam, pose: FloatArray) -> FloatArray:
    """Return forces between follower and cam through the origin along x and y, and a moment, (3, n)."""
    pushes = np.zeros((3, len(system.coordinates)))
    number = {body.name: k for k, body in enumerate(system.mechanism.moving_bodies)}
    for body, sense in ((follower_of(cam), 1.0), (cam.cam, -1.0)):
        if body in number:
            k = 3 * number[body]
            x, y, _ = pose[k : k + 3] / system.size
            pushes[:, k : k + 3] = sense * np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    return pushes


def distance_steps(plan: SolvePlan) -> ForceSteps:
    """Return the steps to the distances [m] between the ends of loads that need a direction; 0: they have none."""
    mechanics = Mechanics(plan, coefficients="given")
    loads = [load for load in mechanics.members.loads if load.needs_direction]
    nodes = [node for load in loads for node in mechanics.measured(load)]
    names = tuple(ForceName(load.name, "distance", Quantity("length")) for load in loads)
    return ForceSteps(needed_steps(nodes, mechanics.steps), names, nodes)


def meeting_messages(plan: SolvePlan, steps: ForceSteps) -> tuple[str, ...]:
    """Return what is reported where the distance is 0, for each load of `distance_steps`."""
    types = {load.name: load.type.replace("_", " ") for load in plan.mechanism.loads}
    return tuple(
        f"forces have no value: the ends of {types[name.owner]} '{name.owner}' are in the same place, "
        f"so that it has no direction"
        for name in steps.names
    )
