"""`solve`: a mechanism at many samples, as a Run. Models of mechanisms solved lately are kept."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.errors import RequestError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.run import Run
from kinfmu.run.arguments import Settings
from kinfmu.run.engine import Tables, require_engine
from kinfmu.run.model import Model
from kinfmu.solver.python.solver import TOLERANCE
from kinfmu.units import in_turns

MODELS_KEPT = 16
_FEWEST, _WIDE = 4, 30.0  # whole numbers and their range [rad] from which angles are probably in degrees


def solve(
    mechanism: Mechanism | SolvePlan,
    t: ArrayLike | None = None,
    *,
    parameters: Settings | None = None,
    outputs: Sequence[str] | None = None,
    engine: str = "auto",
    tolerance: float = TOLERANCE,
    wrap: bool = False,
    anew: bool = True,
    out: Tables | None = None,
    **inputs: ArrayLike,
) -> Run:
    """Solve positions, velocities and accelerations at times, or at driver values.

    Samples that cannot be reached are NaN with a status of 3 to 5 and an event with the reason; the run continues from
    the last good sample. The plans of the last mechanisms are kept: another call for an equal mechanism, with whatever
    parameters, only solves; `compile` keeps one for good.

    Args:
        mechanism: The mechanism, or its plan from `compile_plan`.
        t: (n,) times [s] for the laws of the file; default: those of the file's run, unless inputs are given.
        parameters: Values of parameters and law constants, such as {"crank_length": 0.2, "crank.speed": "30 rpm"}.
            Other geometry is reached by continuation from the pose of the geometry as written.
        outputs: Names of the outputs to solve for; default: all. What they do not depend on is not solved.
            Columns keep the order of the mechanism.
        engine: 'python'; 'native', generated C, compiled on first use and then cached; or 'auto', native if there are
            enough samples to pay for compiling and a compiler is found.
        tolerance: Residual relative to the size above which a sample is not ok; positive.
        wrap: Unwrap angles given as inputs: a jump from 2 pi to 0 goes on forwards. Without it such a jump turns back.
        anew: If continuation does not reach the parameters, assemble the mechanism anew from its start poses, as a file
            with these parameters is, with an event of level "info". False: that is an error.
        out: Three arrays (n, outputs) for values, rates and accelerations; by outputs (order="F") is faster.
        **inputs: Driver values in place of t, such as crank_angle=(n,) [rad] with crank_speed= and crank_acceleration=,
            arrays or numbers. Default speed: 1, default acceleration: 0, so that rates are per unit of the driver. The
            run's t then counts the samples, and its axis is the driver's value. Angles that are whole numbers over many
            turns give a UserWarning: they are probably degrees.

    Returns:
        The run, with a status for every sample.

    Raises:
        RequestError: A name is unknown or a value is invalid.
        KinfmuError: The mechanism cannot be solved, as `compile_plan` reports it.
        CompilerError: The engine is 'native' and no compiler is found, or it fails.

    """
    require_engine(engine)
    if isinstance(mechanism, SolvePlan):
        if outputs is not None:
            raise RequestError("outputs are chosen when a plan is compiled: compile_plan(mechanism, outputs)")
        model = Model(mechanism, engine)
    else:
        require_mechanism(mechanism, "solve")
        set_ones = frozenset(parameters or ())
        derived = [name for name, p in mechanism.parameters.items() if p.expression and name in set_ones]
        chosen = outputs if outputs is None or isinstance(outputs, str) else tuple(outputs)
        model = kept_model(mechanism, chosen, tuple(derived), engine)
    run = model.solve(t, parameters=parameters, tolerance=tolerance, wrap=wrap, anew=anew, out=out, **inputs)
    for driver in model.plan.drivers if inputs and not wrap else ():
        if driver.quantity.kind == "angle" and driver.inputs[0] in inputs:
            _warn_of_degrees(driver.inputs[0], inputs[driver.inputs[0]])
    return run


def _warn_of_degrees(name: str, angles: ArrayLike) -> None:
    """Warn of an array of whole numbers over many turns: degrees, where radians are needed."""
    if np.ndim(angles) != 1 or len(angles) < _FEWEST:  # type: ignore[arg-type]  # it is an array
        return
    low, high = float(np.min(angles)), float(np.max(angles))
    if high - low >= _WIDE and bool(np.all(np.mod(angles, 1.0) == 0.0)):
        warnings.warn(
            f"{name}: {low:g} to {high:g} rad, {in_turns(high - low)}, in whole numbers: inputs of angles are in "
            f"radians; for degrees give {name}=np.radians(...)",
            stacklevel=3,
        )


@lru_cache(maxsize=MODELS_KEPT)
def kept_model(mechanism: Mechanism, outputs: Sequence[str] | None, derived: Sequence[str], engine: str) -> Model:
    """Return a model whose arguments are the parameters written as numbers, and those derived ones."""
    own = [name for name, parameter in mechanism.parameters.items() if not parameter.expression]
    return Model(compile_plan(mechanism, outputs, [*own, *derived]), engine)
