"""Parameters set in a mechanism, with its start pose followed from the parameters as written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

from kinfmu.codegen.python import load_module
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Body, Mechanism, Start
from kinfmu.mechanism.members import COORDINATES
from kinfmu.mechanism.number import in_unit_of
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.solver.python import Solver, UnsolvableModel, with_parameters
from kinfmu.solver.python.pose import Pose, Status, failed
from kinfmu.units import Quantity

Settings = Mapping[str, float | str]


class Continued(NamedTuple):
    """A mechanism with parameters set.

    message: the reason if continuation does not reach them and the mechanism is assembled anew from its start poses;
    empty if it does.
    """

    mechanism: Mechanism
    message: str = ""


def continued(mechanism: Mechanism, settings: Settings) -> Continued:
    """Return the mechanism with other parameters and law constants, started in the pose that the written one becomes.

    The start poses are replaced by the pose that is followed, first to the parameters with the drivers at rest, then to
    the start of the laws, as an FMU does. A mechanism that does not assemble as it is written, or that cannot be
    followed, keeps its start poses.

    Raise a RequestError if a name is unknown, a MechanismError if a value is invalid.
    """
    changed = mechanism.with_parameters(settings)
    if not any(name in mechanism.parameters for name in settings) and law_starts(changed) == law_starts(mechanism):
        return Continued(changed)
    plan = _plan_of_poses(settable(mechanism, settings))
    if plan is None:
        return Continued(changed)
    solver = with_parameters(load_module(plan), bound_values(plan, changed))
    pose = at_law_start(solver, changed)
    if not pose.good:
        return Continued(changed, anew(pose.message))
    pose = pose if pose.status == Status.OK else solver.anchor
    start: dict[str, float] = dict(zip(plan.outputs, solver.outputs(pose), strict=True))
    bodies = tuple(body if body.is_ground else _started(body, start, changed.length_unit) for body in changed.bodies)
    return Continued(replace(changed, bodies=bodies))


def _started(body: Body, pose: Mapping[str, float], length_unit: str) -> Body:
    """Return a body that starts in a pose, with its coordinates in the units of its file."""
    found = [
        in_unit_of(old, pose[f"{body.name}.{c}"], Quantity("angle" if c == "phi" else "length"), length_unit)
        for c, old in zip(COORDINATES, body.start, strict=True)
    ]
    return replace(body, start=Start(*found))


@lru_cache(maxsize=4)
def _plan_of_poses(mechanism: Mechanism) -> SolvePlan | None:
    """Return the plan of all coordinates; None if the mechanism cannot be solved as written."""
    try:
        return compile_plan(replace(mechanism, coordinates="all", points={}))
    except KinfmuError:
        return None


def settable(mechanism: Mechanism, settings: Settings) -> Mechanism:
    """Return the mechanism as written, with numbers for the expressions of parameters that are set."""
    derived = [name for name, parameter in mechanism.parameters.items() if parameter.expression and name in settings]
    return mechanism.with_parameters({name: float(mechanism.parameters[name].value) for name in derived})


def bound_values(plan: SolvePlan, mechanism: Mechanism) -> tuple[float, ...]:
    """Return the values that a mechanism has for the parameters of a plan."""
    return tuple(float(mechanism.parameters[parameter.name].value) for parameter in plan.parameters)


def anew(message: str) -> str:
    """Return the note about parameters that continuation does not reach."""
    return f"{message}; the mechanism is assembled anew from its start poses"


def law_starts(mechanism: Mechanism) -> tuple[float, ...]:
    """Return the driver values at which the laws start."""
    return tuple(float(driver.law.at(mechanism.run.start)) for driver in mechanism.drivers)


def at_law_start(solver: Solver, mechanism: Mechanism) -> Pose:
    """Return the pose at the start of the laws, followed from the anchor; without numbers if that fails."""
    start = law_starts(mechanism)
    return (
        failed(solver.anchor, start, Status.OUTSIDE, solver.message)
        if isinstance(solver, UnsolvableModel)
        else solver.solve(solver.anchor, start)
    )
