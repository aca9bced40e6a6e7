"""The curves and charts of a fit's figure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.design.fit.outcome import FitOutcome, TargetErrors
from kinfmu.design.fit.sampled import Sampled
from kinfmu.draw.fitted import Chart, Curve, Fitted, fitted
from kinfmu.run.solve import solve
from kinfmu.units import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES = 361


def draw(result: FitOutcome, path: str | Path | None, ax: Axes | None) -> None:
    """Draw the targets and the mechanism of a result; errors as in `kinfmu.draw.figure`."""
    fitted(path, ax, lambda: content_of(result))


def content_of(result: FitOutcome) -> Fitted:
    """Return what the figure of a result shows."""
    argument = result.problem.argument
    curves, charts, at = [], [], None
    for target, errors in zip(result.problem.sampled, result.errors, strict=False):
        if target.type == "function":
            charts.append(_chart(result, target, errors))
        else:
            low, high = float(errors.at.min()), float(errors.at.max())
            is_whole = target.is_timed or (target.begin is None and target.end is None)
            values = argument.values(target.begin, target.end, _SAMPLES)
            if target.is_timed:
                values = np.linspace(low, max(high, low + argument.end - argument.begin), _SAMPLES)
            elif is_whole and argument.is_turn:
                values = np.linspace(argument.begin, argument.end, _SAMPLES)
            whole = _outputs(result, target.outputs[:2], values)
            curves.append(Curve(target.name, errors.wanted[:, :2], errors.reached[:, :2], whole))
        if at is None and argument.input:
            at = float(errors.at[0])
    return Fitted(result.mechanism, at, curves, charts)


def _outputs(result: FitOutcome, names: tuple[str, ...], values: FloatArray) -> FloatArray:
    """Return outputs of the mechanism found (n, names)."""
    mechanism = replace(result.mechanism, points=result.problem.traced.points)
    run = solve(mechanism, **result.problem.argument.keywords(values))
    return np.column_stack([run[name] for name in names])


def _chart(result: FitOutcome, target: Sampled, errors: TargetErrors) -> Chart:
    """Return a function over the driver or another output, angles in degrees."""
    argument = result.problem.argument
    low, high = float(errors.at.min()), float(errors.at.max())
    reach = 0.05 * (high - low)
    values = np.linspace(low - reach, high + reach, _SAMPLES)
    names = (target.over or target.outputs[0], target.outputs[0])
    table = _outputs(result, names, values)
    x = table[:, 0] if target.over else values
    start = result.parameters.get(f"{target.name}.start", target.start)
    wanted_x = target.at + start  # type: ignore[operator]  # functions have values, and a start
    unit = unit_of(target.argument, result.problem.mechanism.length_unit)
    y = table[:, 1] - (errors.reached - errors.errors - errors.wanted)[0, 0]
    scale = [np.degrees(1.0) if one == "rad" else 1.0 for one in (unit, errors.units[0])]
    shown = ["deg" if one == "rad" else one for one in (unit, errors.units[0])]
    curve = Curve(
        target.name,
        np.column_stack([wanted_x, errors.wanted[:, 0]]) * scale,
        np.column_stack([wanted_x, errors.wanted[:, 0] + errors.errors[:, 0]]) * scale,
        np.column_stack([x, y]) * scale,
    )
    return Chart(curve, (f"{target.over or argument.name} [{shown[0]}]", f"{target.outputs[0]} [{shown[1]}]"))
