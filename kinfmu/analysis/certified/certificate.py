"""Certificates: what is proved of a motion over the whole range of its driver, or over its run."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinfmu.analysis.certified.bounds import EnclosedQuantity, ExtremeBounds, bounds
from kinfmu.analysis.certified.cells import Prover
from kinfmu.analysis.certified.cover import Cover
from kinfmu.analysis.certified.intervals import Intervals, angle, interval, root
from kinfmu.analysis.driver_path import place_text
from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError, RequestError, listed
from kinfmu.files import errors_of_writing, write_whole
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.measures.transfer import TransmissionAngle
from kinfmu.mechanism.quantities import PoseQuantity
from kinfmu.mechanism.toml_text import text
from kinfmu.motion.quantities import quantity_nodes
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.units import degrees_of, unit_of
from kinfmu.version import VERSION

HALF_TURN = 3.1415926535897936  # above pi
FORMAT = "kinfmu certificate 1"


class Gap(NamedTuple):
    """Driver values or times for which nothing is proved, and why."""

    low: float
    high: float
    reason: str


class DeadCentre(NamedTuple):
    """A driver value at which the branch turns back: no pose of it lies beyond.

    Attributes:
        low: Lower bound of the value.
        high: Upper bound.
        is_high: True at the upper end of the range.

    """

    low: float
    high: float
    is_high: bool


@dataclass(frozen=True)
class PathEnd:
    """The path to a dead centre, over its way: proved cells before the one in which it turns back, and that one."""

    prover: Prover
    cover: Cover
    inner: int

    def bounds(self, node: Node) -> ExtremeBounds:
        """Return the bounds of a quantity on the path; in the cell where it turns back its values are enclosed."""
        cells, tubes = self.cover.cells, self.cover.tubes
        least, most = bounds(self.prover, cells[: self.inner], tubes[: self.inner], node, 0)
        last = slice(self.inner, self.inner + 1)
        value = EnclosedQuantity(self.prover, node, 0).at(cells[last], tubes[last], cells[last].s)
        return ExtremeBounds(
            (min(least[0], float(value.low[0])), least[1]), (most[0], max(most[1], float(value.high[0])))
        )


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proved of one motion.

    Attributes:
        mechanism: The mechanism.
        driver: Its driver, or 'time'.
        low: Begin of what was asked for: of the driver's range, or of the run.
        high: Its end.
        turns: Number of turns after which the same poses come back, if that is proved, else None.
        cover: Proved cells.
        dead_centres: Ends of the range that are proved.
        gaps: What is not proved.
        prover: What has proved the cells.
        redundant: Bounds of the redundant rows by name, relative to the size: how far they close at most.
        ends: Paths to the dead centres.
        tolerances: As given to `certify`.

    """

    mechanism: Mechanism
    driver: str
    low: float
    high: float
    turns: int | None
    cover: Cover
    dead_centres: tuple[DeadCentre, ...]
    gaps: tuple[Gap, ...]
    prover: Prover
    redundant: Mapping[str, float]
    ends: tuple[PathEnd, ...] = ()
    tolerances: float | Mapping[str, float] | None = None

    @property
    def is_complete(self) -> bool:
        """True if nothing is left unproved."""
        return not self.gaps

    @property
    def share(self) -> float:
        """Part of the range that is proved."""
        return 1.0 - sum(gap.high - gap.low for gap in self.gaps) / (self.high - self.low)

    @cached_property
    def tube(self) -> float:
        """The narrowest tube of all cells [rad, sizes], within which no other pose is near a pose of the run."""
        clear = self.cover.tubes.wide.high - self.cover.tubes.narrow.magnitude
        return float((clear / self.prover.unit[:, None]).min(initial=math.inf) * (1.0 - 1e-12))

    def __str__(self) -> str:
        """The certificate as lines of the report of `kinfmu check`."""
        unit = "s"
        if self.driver != "time":
            kind = self.mechanism.drivers[0].quantity.kind
            unit = "rad" if kind == "angle" else self.mechanism.length_unit
        apart = f"no other pose is within {self.tube:.2g} rad or sizes, " if math.isfinite(self.tube) else ""
        turns = f"; the poses come back after {_turns_text(self.turns)}" if self.turns else ""
        lines = [
            f"certified   {self.driver} from {place_text(self.low, unit)} to {place_text(self.high, unit)}, "
            f"{100.0 * self.share:.9g} % of it in {len(self.cover.cells)} cells: the loops close, "
            f"{apart}no block is singular{turns}"
        ]
        if not len(self.cover.cells):
            lines = [f"certified   {self.driver}: nothing"]
        if self.redundant:
            bounds_text = listed(f"{name} within {limit:.1g}" for name, limit in self.redundant.items())
            lines.append(f"            redundant rows close, relative to the size: {bounds_text}")
        if self.tolerances is not None:
            lines.append(f"            for all mechanisms with {self._tolerances_text()}")
        for low, high, _ in self.dead_centres:
            lines.append(
                f"            dead centre at {self.driver} = {place_text(0.5 * (low + high), unit)}, within "
                f"{high - low:.1g} {unit}: no pose of this branch lies beyond"
            )
        for low, high, reason in self.gaps:
            lines.append(
                f"not proved  {self.driver} = {place_text(0.5 * (low + high), unit)}, over {high - low:.1g} {unit}: "
                f"{reason}"
            )
        return "\n".join(f"  {line}" for line in lines)

    def _tolerances_text(self) -> str:
        if not isinstance(self.tolerances, Mapping):
            return f"every length within {100.0 * float(self.tolerances or 0.0):.4g} %"
        parts = []
        for name, size in self.tolerances.items():
            one = self.mechanism.parameters.get(name)
            known = "" if one is None or one.quantity is None else unit_of(one.quantity, self.mechanism.length_unit)
            unit, factor = degrees_of(known)
            value = "" if one is None else f" = {float(one.value) * factor:.9g} {unit}".rstrip()
            parts.append(f"{name}{value} within {size * factor:.4g} {unit}".rstrip())
        return listed(parts)

    def as_json(self) -> dict[str, Any]:
        """The certificate as values of JSON: angles in rad, lengths in the unit of the file."""
        return {
            "mechanism": self.mechanism.name,
            "driver": self.driver,
            "low": self.low,
            "high": self.high,
            "turns": self.turns,
            "complete": self.is_complete,
            "share": self.share,
            "tube": self.tube if math.isfinite(self.tube) else None,
            "cells": len(self.cover.cells),
            "redundant_rows": dict(self.redundant),
            "dead_centres": [centre._asdict() for centre in self.dead_centres],
            "not_proved": [gap._asdict() for gap in self.gaps],
        }

    def write(self, path: str | Path) -> None:
        """Write the certificate as JSON, from which `kinfmu verify` proves it again.

        Args:
            path: The file.

        Raises:
            KinfmuError: It cannot be written.

        """
        with errors_of_writing(path, KinfmuError):
            write_whole(path, json.dumps(self._content()).encode())

    def bounds(self, of: str | PoseQuantity, order: int = 0) -> ExtremeBounds:
        """Return the bounds of an output (order 0), its rate (1) or acceleration (2) over all that is proved.

        Rates are per unit of the driver, over a run per second.

        Args:
            of: An output; a measure of the file that is a transmission angle, of which this angle is bounded [rad]; or
                a quantity of the pose, such as `CosineBetween`.
            order: Of the derivative.

        Raises:
            RequestError: There is no such output, or the range ends at a dead centre where it is not bounded.

        """
        if isinstance(of, str) and of in self._transmissions:
            found = self.bounds(self._transmissions[of], order)
            least, most = (_angles_of_cosines(*ends, of, order) for ends in (found.most, found.least))
            return ExtremeBounds(least, most)
        node = self._node(of)
        parts = [bounds(self.prover, self.cover.cells, self.cover.tubes, node, order)]
        for end in self.ends:
            known = {end.prover.formulas.x, *end.prover.formulas.unknowns, *end.prover.formulas.constants}
            if order or not {symbol.name for symbol in symbols([node])} <= known:
                raise RequestError(
                    f"the range of {self.driver} ends at a dead centre, up to which "
                    f"{'rates grow without bound' if order else 'only what its block moves is bounded'}; use over = "
                    "'run'"
                )
            parts.append(end.bounds(node))
        (a, b), (c, d) = (zip(*ends, strict=True) for ends in zip(*parts, strict=True))
        return ExtremeBounds((min(a), min(b)), (max(c), max(d)))

    def enclosed(self, of: str | PoseQuantity, x: FloatArray, order: int = 0) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds of an output, its rate or acceleration, at values of the driver or at times.

        NaN where nothing is proved.

        Args:
            of: As for `bounds`.
            x: Values of the driver, or times, (n,).
            order: Of the derivative.

        Raises:
            RequestError: There is no such output.

        """
        if isinstance(of, str) and of in self._transmissions:
            low, high = self.enclosed(self._transmissions[of], x, order)
            return _angles_of_cosines(low, high, of, order)
        x = np.asarray(x, dtype=float)
        node, cells = self._node(of), self.cover.cells
        k = np.clip(np.searchsorted(cells.low, x, "right") - 1, 0, max(len(cells) - 1, 0))
        known = np.flatnonzero((cells.low[k] <= x) & (x <= cells.high[k])) if len(cells) else np.array([], dtype=int)
        k, low, high = k[known], np.full_like(x, np.nan), np.full_like(x, np.nan)
        value = EnclosedQuantity(self.prover, node, order).at(
            cells[k], self.cover.tubes[k], Intervals(x[known]) - cells.u[k]
        )
        low[known], high[known] = value.low, value.high
        return low, high

    @cached_property
    def _transmissions(self) -> dict[str, PoseQuantity]:
        """Cosines of the transmission angles among the measures, by name."""
        readings = (one for one in self.mechanism.measures if isinstance(one, TransmissionAngle))
        return {one.name: one.quantities()[0] for one in readings}

    def _node(self, of: str | PoseQuantity) -> Node:
        formulas = self.prover.formulas
        if isinstance(of, PoseQuantity):
            return formulas.inlined(quantity_nodes(formulas.plan, [of]))[0]
        names: list[str] = list(formulas.plan.outputs)
        if of not in names:
            known = [*names, *self._transmissions]
            raise RequestError(f"'{of}' is no output; outputs: {listed(known)}")
        return formulas.outputs[names.index(of)][0]

    def _content(self) -> dict[str, Any]:
        """The values of its file: mechanism, what it states, and centre, prediction and tube of each cell."""
        cells, tubes = self.cover.cells, self.cover.tubes
        radii = [
            (tubes.wide.high[block.place] / self.prover.unit[block.place]).tolist()
            for block in self.prover.formulas.blocks
        ]
        return {
            "format": FORMAT,
            "version": VERSION,
            "mechanism": text(self.mechanism),
            "over": "run" if self.driver == "time" else "range",
            "tolerances": dict(self.tolerances) if isinstance(self.tolerances, Mapping) else self.tolerances,
            "states": self.as_json(),
            "cells": {name: getattr(cells, name).tolist() for name in ("low", "high", "u", "path")} | {"radii": radii},
        }


def _turns_text(turns: int) -> str:
    return "a turn" if turns == 1 else f"{turns} turns"


def _angles_of_cosines(low: Any, high: Any, name: str, order: int) -> tuple[Any, Any]:
    """Return bounds of angles from 0 to pi [rad] from their cosines c: tan^2(angle / 2) = (1 - c) / (1 + c)."""
    if order:
        raise RequestError(f"'{name}' is an angle of transmission, whose rates are not bounded")
    cosine = Intervals(np.fmax(low, -1.0), np.fmin(high, 1.0))
    squares = interval(1.0) - cosine, cosine + 1.0
    found = 2.0 * angle(*(root(Intervals(np.maximum(one.low, 0.0), one.high)) for one in squares))
    ends = (np.maximum(found.low, 0.0), np.minimum(found.high, HALF_TURN))
    least, most = (np.where(np.isnan(low), np.nan, end) for end in ends)
    return (least, most) if np.ndim(least) else (float(least), float(most))
