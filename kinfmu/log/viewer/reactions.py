"""Curves of the forces and moments that joints transmit, and of those on the ground."""

from __future__ import annotations

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene import palette
from kinfmu.log.viewer.series import Group
from kinfmu.run import Run
from kinfmu.run.axis import shown_range
from kinfmu.units import Quantity, unit_of

_TITLES = {"force": "joint force", "torque": "joint moment"}
_SHAKING = "shaking_"
_OUTLIERS = (
    99.0  # percent of the samples that the axis shows at least: forces may grow without bound at singular points
)
_BEYOND = 4.0  # an axis that shows all samples is at most so many times longer


def reactions(run: Run) -> list[Group]:
    """Return the size of the force of each joint, and their moments, with shaking force and moment.

    Reactions that redundant rows leave undetermined are left out, as they have no numbers.
    """
    found = []
    for kind, title in _TITLES.items():
        curves = {name: values for name, values in _curves(run, kind).items() if np.isfinite(values).any()}
        if curves:
            values = np.column_stack(list(curves.values()))
            found.append(
                Group(
                    path=f"reactions/{kind}",
                    title=f"{title} [{unit_of(Quantity(kind), run.length_unit)}]",
                    names=tuple(curves),
                    colours=tuple(palette.body(place) for place in range(len(curves))),
                    values=values,
                    shown=_range(values),
                )
            )
    return found


def _curves(run: Run, kind: str) -> dict[str, FloatArray]:
    """Return sizes of forces, or moments, (n,) by joint; those of the ground are 'shaking'."""
    parts: dict[str, list[FloatArray]] = {}
    for name in run.reaction_names:
        if name.quantity.kind == kind and name not in run.absent:
            owner = name.owner or _SHAKING.rstrip("_")
            parts.setdefault(owner, []).append(np.where(run.good, run[name], np.nan))
    return {
        owner: np.hypot.reduce(columns) if kind == "force" else columns[0]  # a joint has one moment at most
        for owner, columns in parts.items()
    }


def _range(values: FloatArray) -> tuple[float, float] | None:
    """Return the range of the axis; None for the default. Peaks at singular points are cut off."""
    sizes = np.abs(values[np.isfinite(values)])
    usual = float(np.percentile(sizes, _OUTLIERS))
    if 0.0 < _BEYOND * usual < float(sizes.max()):
        return (-1.1 * usual if (values < 0.0).any() else 0.0), 1.1 * usual
    return shown_range(values, float(sizes.max()))
