"""The plan of an FMU, with all outputs, and the stages of its forces."""

from __future__ import annotations

from collections.abc import Mapping

from kinfmu import Mechanism
from kinfmu.fmu.force_variables import chosen_outputs, force_stages
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.forces import ForceSteps, loaded_coordinates


def planned(mechanism: Mechanism) -> tuple[SolvePlan, Mapping[str, ForceSteps]]:
    """Return the plan and the stages that `build` gives the FMU of a mechanism; none without masses and loads."""
    coordinates, names = chosen_outputs(mechanism, None)
    plan = compile_plan(mechanism, coordinates, solved=loaded_coordinates(mechanism) if names else ())
    return plan, force_stages(plan, names, are_default=True) if names else {}
