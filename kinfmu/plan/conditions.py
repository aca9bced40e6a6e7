"""Conditions of a plan: what joints and drivers must keep, and parameters that are set at run time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from kinfmu.errors import AssemblyError, InconsistentError, MobilityError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.joints.joint import Condition
from kinfmu.mechanism.members import NumberPath, path_text
from kinfmu.mechanism.quantities import DistanceBetween
from kinfmu.plan.anchor import does_not_close
from kinfmu.plan.equations.assembly import Assembled
from kinfmu.plan.equations.closing import close, motion_samples, null_space
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.redundancy import Redundancy
from kinfmu.plan.equations.start_poses import StartValues
from kinfmu.plan.equations.system import System, placement
from kinfmu.plan.trace import Tracer
from kinfmu.units import Quantity


class PlanCondition(NamedTuple):
    """A condition on a number: its name in messages, its node (of parameters alone), and what is required."""

    label: str
    node: Node
    required: str


def find_conditions(mechanism: Mechanism, tracer: Tracer) -> tuple[PlanCondition, ...]:
    """Return the conditions on numbers written as expressions; others are checked when the file is read."""
    members = tracer.members
    written = [(f"[joints.{joint.name}]", joint.conditions()) for joint in members.joints]
    written += [(f"[loads.{load.name}]", load.conditions()) for load in members.loads]
    written += [
        (
            f"[bodies.{body.name}]",
            tuple(Condition(key, getattr(body, key), "0 or more") for key in ("mass", "inertia")),
        )
        for body in members.bodies
    ]
    found = [
        PlanCondition(f"{table} {key}", value, required)
        for table, conditions in written
        for key, value, required in conditions
        if isinstance(value, Node) and value.constant is None
    ]
    laws = {("joints", joint.name): getattr(joint, "law", None) for joint in mechanism.joints}
    laws |= {("drivers", driver.name): driver.law for driver in mechanism.drivers}
    laws |= {("loads", load.name): getattr(load, "law", None) for load in mechanism.loads}

    def look(place: NumberPath, value: Any, _: Quantity) -> Any:
        if len(place) > 2 and place in mechanism.expressions and isinstance(value, Node) and value.constant is None:
            table, name, key, *path = place
            law = laws.get((str(table), str(name)))
            if key == "law" and law is not None and law.numbers()[tuple(path)].measures.is_positive:
                found.append(PlanCondition(path_text(place), value, "positive"))
        return value

    members.changed(look)
    return tuple(found)


def refuse_inconsistent(system: System, redundancy: Redundancy) -> None:
    """Raise the InconsistentError of the first row that contradicts the others."""
    for dependent in redundancy.inconsistent:
        unit = system.gap_unit(dependent.row)
        raise InconsistentError(
            f"[joints.{dependent.row.owner}] contradicts the other joints: with "
            f"{listed(dependent.implied_by_joints) if dependent.implied_by_joints else 'all of them'} closed, row "
            f"'{dependent.row.label}' does not close: gap {abs(dependent.gap):.6g} {unit} in every pose; "
            f"change a dimension by that gap or remove the joint",
            joint=dependent.row.owner,
            gap=dependent.gap,
        )


def refuse_mobility(system: System, redundancy: Redundancy) -> None:
    """Raise a MobilityError if there are not as many drivers as degrees of freedom.

    Joints with more independent rows than there are coordinates close in no pose: then an AssemblyError.
    """
    names = [driver.name for driver in system.mechanism.drivers]
    mobility = redundancy.mobility
    if len(names) == mobility > 0:
        return
    if len(names) < mobility:
        missing = mobility - len(names)
        raise MobilityError(
            f"[drivers] mobility is {mobility} but there {_are(names)}: "
            f"{listed(_loose(system, redundancy))} can still move; "
            f"add {missing} {'driver' if missing == 1 else 'drivers'}, or joints",
            mobility=mobility,
        )
    if mobility < 0 and redundancy.assembly.pose is None:
        raise does_not_close(system, redundancy.assembly.start, redundancy.kept)
    if mobility <= 0:
        raise MobilityError(
            f"[drivers] mobility is {mobility}: the joints leave no motion, so there is nothing to drive",
            mobility=mobility,
        )
    raise MobilityError(
        f"[drivers] mobility is {mobility} but there {_are(names)}: remove {len(names) - mobility}",
        mobility=mobility,
    )


def refuse_negative_distances(system: System, start: StartValues) -> None:
    """Raise an AssemblyError if a driver starts at a distance below 0."""
    for driver, value in zip(system.mechanism.drivers, start.u, strict=True):
        if isinstance(driver.measured(), DistanceBetween) and value < 0.0:
            unit = system.mechanism.length_unit
            raise AssemblyError(
                f"[drivers.{driver.name}] starts at a length of {value:.6g} {unit}; a distance cannot be negative"
            )


def refuse_undefined_loads(system: System, start: StartValues, anchor: Assembled) -> None:
    """Raise a MechanismError for a load without a direction in the closed start pose; anchor: that pose, or near it."""
    if system.mechanism.loads:
        is_start = np.array_equal(anchor.u, start.u)
        at = placement(system.mechanism, (anchor.q if is_start else close(system, start.q, start.u)[0]).tolist())
        for load in system.mechanism.loads:
            load.check_start(at)


def _loose(system: System, redundancy: Redundancy) -> list[str]:
    """Return the bodies that joints and drivers together do not hold."""
    rows = [*redundancy.kept, *range(system.joint_row_count, len(system.rows))]
    start = redundancy.assembly.start.q
    pose = next(iter(motion_samples(Part(system, redundancy.kept), start, 1)), start)
    free = null_space(system.scaled_jacobian(pose)[rows])
    moves = {name.owner for name, move in zip(system.coordinates, free, strict=True) if abs(move).max() > 1e-6}
    return [body.name for body in system.mechanism.moving_bodies if body.name in moves]


def _are(drivers: Sequence[str]) -> str:
    """Return 'is no driver', 'is 1 driver (crank)' or 'are 2 drivers (crank, lift)'."""
    if not drivers:
        return "is no driver"
    return f"is 1 driver ({drivers[0]})" if len(drivers) == 1 else f"are {len(drivers)} drivers ({listed(drivers)})"
