"""Curves of a run: coordinates grouped by order and unit, and the solver's diagnostics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kinfmu.arrays import FloatArray, finite
from kinfmu.draw.chart import equal_below, repeats_effort
from kinfmu.draw.scene import palette
from kinfmu.run import Run
from kinfmu.run.axis import axis_of, shown_range
from kinfmu.units import Quantity, degrees_of, unit_of

ORDERS = ("position", "velocity", "acceleration")
KINDS = ("angle", "length")
SAME = 1e-9  # difference of two curves that look the same, of the largest value
SMALLEST = 1e-17  # drawn in place of 0 on a logarithmic axis; smaller than round-off
_TITLES_OF = {"angle": ("angle", "angular velocity", "angular acceleration"), "length": ORDERS}
_TITLES = {"force": "joint force", "torque": "joint moment"}
_SHAKING = "shaking_"
_WIDTH, _WIDER = 1.5, 3.0  # [points] of a curve, and more for each equal one above it
_OUTLIERS = (
    99.0  # percent of the samples that the axis shows at least: forces may grow without bound at singular points
)
_BEYOND = 4.0  # an axis that shows all samples is at most so many times longer


@dataclass(frozen=True, eq=False)
class Group:
    """Curves of one unit for one plot: values (n, k), NaN in a gap; shown: range of the axis, None for the default."""

    path: str
    title: str
    names: tuple[str, ...]
    colours: tuple[palette.Colour, ...]
    values: FloatArray
    shown: tuple[float, float] | None = None
    is_stepped: bool = False

    @cached_property
    def extent(self) -> tuple[float, float] | None:
        """The range of the axis before its labels are placed; None for Rerun's own: of diagnostics, and of constants.

        It is `shown`, or contains all values and ends at 2 digits, so that equal motions have equal layouts.
        """
        if self.shown or self.path.startswith("solver/"):
            return self.shown
        known = finite(self.values)
        if not len(known):
            return None
        low, high = float(known.min()), float(known.max())
        if not 0.0 < high - low < np.inf:
            return None
        digit = 10.0 ** (np.floor(np.log10(high - low)) - 1.0)
        return float(np.floor(low / digit - 1.0) * digit), float(np.ceil(high / digit + 1.0) * digit)

    @property
    def unit(self) -> str:
        """The unit in the title, '' without one."""
        return self.title.rpartition("[")[2].rstrip("]") if self.title.endswith("]") else ""

    @cached_property
    def constants(self) -> dict[str, float]:
        """The values of curves of several numbers that are equal to round-off, by name; none of diagnostics."""
        if self.path.startswith("solver/"):
            return {}
        found, usual = dict[str, float](), max(map(abs, self.shown or (0.0,)))
        for name, column in zip(self.names, self.values.T, strict=True):
            known = finite(column)
            largest = float(np.abs(known).max(initial=0.0))
            if len(known) > 1 and np.ptp(known) <= SAME * max(largest, usual):
                found[name] = float(known[0]) if largest > SAME * usual else 0.0
        return found

    @property
    def is_constant(self) -> bool:
        """True if no curve moves, so that a plot would show straight lines only."""
        return len(self.constants) == len(self.names)

    def widths(self) -> list[float]:
        """Return the widths of the curves [points]: wider where a later one looks the same, so that both are seen."""
        return [_WIDTH + _WIDER * below for below in equal_below(list(self.values.T))]

    @property
    def is_scattered(self) -> bool:
        """True if a value has no neighbour, so that a line would not show it."""
        known = np.pad(np.isfinite(self.values).any(axis=1), 1)
        return bool(np.any(known[1:-1] & ~known[:-2] & ~known[2:]))


def groups(run: Run) -> dict[tuple[str, str], Group]:
    """Return coordinates and points of interest by (order, kind), such as ('velocity', 'angle')."""
    colours = _colours(run)
    axis = axis_of(run)
    found = {}
    for kind in KINDS:
        columns = [k for k, name in enumerate(run.outputs) if name.quantity().kind == kind]
        if not columns:
            continue
        size = 0.0
        for order, table in enumerate((run.values, run.rates, run.accelerations)):
            kept = [k for k in columns if run.outputs[k].derivative(order) not in run.absent]
            if not kept:
                continue
            values = np.where(run.good[:, None], table[:, kept], np.nan)
            unit, factor = degrees_of(unit_of(Quantity(kind, order, axis.per), run.length_unit))
            values *= factor
            if order == 0:
                size = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values))) / factor
            found[ORDERS[order], kind] = Group(
                path=f"{ORDERS[order]}/{kind}",
                title=f"{_TITLES_OF[kind][order]} [{unit}]",
                names=tuple(run.outputs[k].derivative(order) for k in kept),
                colours=tuple(colours[run.outputs[k]] for k in kept),
                values=values,
                shown=shown_range(values, factor * size / (axis.span or 1.0) ** order),
            )
    return found


def efforts(run: Run) -> list[Group]:
    """Return efforts, bias efforts and power of the drivers, energies and external loads, one group for each unit.

    A bias effort that equals the effort, as it does at constant speeds, would hide it and is left out.
    """
    found = []
    for kind in ("torque", "force", "power", "energy"):
        columns = [
            k
            for k, name in enumerate(run.force_names)
            if name.quantity.kind == kind and name not in run.absent and not repeats_effort(run, name)
        ]
        if not columns or run.forces is None:
            continue
        values = np.where(run.good[:, None], run.forces[:, columns], np.nan)
        size = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
        found.append(
            Group(
                path=f"forces/{kind}",
                title=f"{run.force_names[columns[0]] if len(columns) == 1 else kind} "  # one curve has no legend
                f"[{unit_of(Quantity(kind), run.length_unit)}]",
                names=tuple(str(run.force_names[k]).removesuffix("_energy") for k in columns),
                colours=tuple(palette.body(place) for place in range(len(columns))),
                values=values,
                shown=shown_range(values, size),
            )
        )
    return found


def signals(run: Run) -> list[Group]:
    """Return the outputs of other FMUs, one group for each unit."""
    found = []
    kept = [name for name in run.signal_names if name not in run.absent]
    for place, unit in enumerate(dict.fromkeys(name.unit for name in kept)):
        own = [name for name in kept if name.unit == unit]
        values = np.where(run.good[:, None], np.column_stack([run[name] for name in own]), np.nan)
        size = float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
        found.append(
            Group(
                path=f"signals/{place}",
                title=f"{own[0] if len(own) == 1 else 'signals'}{'' if unit == '1' else f' [{unit}]'}",
                names=tuple(map(str, own)),
                colours=tuple(palette.body(number) for number in range(len(own))),
                values=values,
                shown=shown_range(values, size),
            )
        )
    return found


def accuracy(run: Run) -> Group | None:
    """Return log10 of the residual and of the largest watch, relative to the mechanism's size; None if not kept."""
    curves = {"residual": run.residual} if "solver.residual" not in run.absent else {}
    if run.watch_names and not {f"watch.{name}" for name in run.watch_names} & run.absent:
        curves["watch" if len(run.watch_names) == 1 else "largest watch"] = np.abs(run.watch).max(axis=1)
    return _logarithmic("accuracy", f"log10 {next(iter(curves))}", curves, 0, SMALLEST) if curves else None


def error_estimates(run: Run) -> Group | None:
    """Return log10 of the estimated errors of q, qd and qdd; None if no sample has any."""
    curves = {name: run.error[:, k] for k, name in enumerate(("q", "qd", "qdd"))}
    if not np.any(run.error > 0.0):  # errors that were not kept are NaN
        return None
    return _logarithmic("error", "log10 error", curves, 2, np.nan)


def margin(run: Run) -> Group | None:
    """Return log10 of the margin, 1 / condition of the worst block: 0 far from singular points, -16 at one."""
    if "solver.margin" in run.absent:
        return None
    return _logarithmic("margin", "log10 margin", {"margin": run.margin}, 1, SMALLEST)


def iterations(run: Run) -> Group | None:
    """Return Newton's iterations as a stepped curve; None if not kept."""
    if "solver.iterations" in run.absent:
        return None
    return Group(
        path="solver/iterations",
        title="Newton iterations",
        names=("iterations",),
        colours=(palette.body(1),),
        values=run.iterations.astype(float)[:, None],
        is_stepped=True,
    )


def _logarithmic(path: str, title: str, curves: Mapping[str, FloatArray], first_colour: int, zero: float) -> Group:
    """Return log10 of the curves; `zero` is drawn in place of 0, and unknown values are a gap."""
    table = np.column_stack(list(curves.values()))
    table[np.isinf(table)] = np.nan
    return Group(
        path=f"solver/{path}",
        title=title,
        names=tuple(curves),
        colours=tuple(palette.body(first_colour + k) for k in range(len(curves))),
        values=np.log10(np.where(table == 0.0, zero, np.maximum(np.abs(table), SMALLEST))),
    )


def _colours(run: Run) -> dict[str, palette.Colour]:
    """Return the colour of each output: that of its body or point, lighter for y."""
    owners: list[str] = []
    for name in (*run.outputs[: run.coordinate_count], *run.fixed, *run.outputs):
        if name.owner not in owners:
            owners.append(name.owner)
    plain = {name: palette.body(owners.index(name.owner)) for name in run.outputs}
    return {name: palette.lighter(colour) if name.axis == "y" else colour for name, colour in plain.items()}


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
