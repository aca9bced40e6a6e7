"""The plan of an FMU, with all outputs, and the stages of its forces."""

from __future__ import annotations

from collections.abc import Mapping

from kinfmu import Mechanism
from kinfmu.fmu.force_variables import chosen_outputs, force_stages
from kinfmu.fmu.interface import Drive, Interface
from kinfmu.fmu.native.sources import sources
from kinfmu.fmu.owned_motion import owned_motion
from kinfmu.fmu.variables import interface
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.forces import ForceSteps, loaded_coordinates

TOKEN = "{00000000-0000-0000-0000-000000000000}"  # noqa: S105  a guid


def planned(mechanism: Mechanism) -> tuple[SolvePlan, Mapping[str, ForceSteps]]:
    """Return the plan and the stages that `build` gives the FMU of a mechanism; none without masses and loads."""
    coordinates, names = chosen_outputs(mechanism, None)
    plan = compile_plan(mechanism, coordinates, solved=loaded_coordinates(mechanism) if names else ())
    return plan, force_stages(plan, names, are_default=True) if names else {}


def fmu_sources(mechanism: Mechanism, fmi: int, drive: Drive) -> tuple[dict[str, str], Interface, SolvePlan]:
    """Return the C files of a native FMU with the token TOKEN, its variables, and its plan."""
    plan, forces = planned(mechanism)
    plan, owned = owned_motion(plan) if drive == "torque" else (plan, None)
    starts = owned.starts if owned else ()
    variables = interface(plan, drive, has_time=fmi == 3, has_work=owned is None, forces=forces, starts=starts)
    of_motion = (owned.inertia, owned.laws) if owned else (None, None)
    return sources(plan, variables, f"{fmi}.0", TOKEN, forces, *of_motion), variables, plan
