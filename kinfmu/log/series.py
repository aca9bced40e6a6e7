"""The curves of a run: coordinates grouped by what they measure, and the solver's accuracy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kinfmu.log import palette
from kinfmu.naming import derivative_name, quantity_of
from kinfmu.run import FloatArray, Run
from kinfmu.units import Quantity, unit_of

ORDERS = ("position", "velocity", "acceleration")
KINDS = ("angle", "length")
SMALLEST = 1e-17  # drawn in the place of 0 on a logarithmic axis, below all round-off


@dataclass(frozen=True, eq=False)
class Group:
    """Curves of one unit that belong into one plot: values (n, k), NaN in a gap."""

    path: str
    title: str
    names: tuple[str, ...]
    colours: tuple[palette.Colour, ...]
    values: FloatArray


def groups(run: Run) -> dict[tuple[str, str], Group]:
    """Coordinates and points of interest by (order, kind), such as ('velocity', 'angle'); kinds that occur."""
    colours = _colours(run)
    found = {}
    for order, (word, table) in enumerate(zip(ORDERS, (run.values, run.rates, run.accelerations), strict=True)):
        for kind in KINDS:
            columns = [k for k, name in enumerate(run.outputs) if quantity_of(name).kind == kind]
            if columns:
                unit = unit_of(Quantity(kind, order), run.length_unit)
                found[word, kind] = Group(
                    path=f"{word}/{kind}",
                    title=f"{'angular ' if kind == 'angle' else ''}{word} [{unit}]".replace(
                        "angular position", "angle"
                    ),
                    names=tuple(derivative_name(run.outputs[k], order) for k in columns),
                    colours=tuple(colours[run.outputs[k]] for k in columns),
                    values=np.where(run.good[:, None], table[:, columns], np.nan),
                )
    return found


def accuracy(run: Run) -> Group:
    """log10 of the residual and of the largest watch, both relative to the mechanism's size."""
    curves = {"residual": run.residual}
    if run.watch_names:
        curves["watch" if len(run.watch_names) == 1 else "largest watch"] = np.abs(run.watch).max(axis=1)
    return _logarithmic("accuracy", curves, 0, SMALLEST)


def error_estimates(run: Run) -> Group | None:
    """log10 of the estimated errors of q, qd, qdd, which samples near singular points have; None if there are none."""
    curves = {f"error of {name}": run.error[:, k] for k, name in enumerate(("q", "qd", "qdd"))}
    return _logarithmic("error", curves, 2, np.nan) if np.any(run.error > 0.0) else None


def _logarithmic(path: str, curves: Mapping[str, FloatArray], first_colour: int, zero: float) -> Group:
    """log10 of the curves; `zero` is drawn in the place of 0."""
    table = np.column_stack(list(curves.values()))
    return Group(
        path=f"solver/{path}",
        title="log10 of residual, watch, estimated error",
        names=tuple(curves),
        colours=tuple(palette.body(first_colour + k) for k in range(len(curves))),
        values=np.log10(np.where(table > 0.0, np.maximum(table, SMALLEST), zero)),
    )


def _colours(run: Run) -> dict[str, palette.Colour]:
    """Colour of each output: that of its body or point, lighter for y."""
    owners: list[str] = []
    for name in (*run.outputs[: run.coordinate_count], *run.fixed, *run.outputs):
        owner = name.rpartition(".")[0]
        if owner not in owners:
            owners.append(owner)
    plain = {name: palette.body(owners.index(name.rpartition(".")[0])) for name in run.outputs}
    return {name: palette.lighter(colour) if name.endswith(".y") else colour for name, colour in plain.items()}
