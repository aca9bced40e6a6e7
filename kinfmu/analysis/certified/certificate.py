"""Certificates: what is proved of a motion over the whole range of its driver, or over its run."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinfmu.analysis.certified.bounds import EnclosedQuantity, ExtremeBounds, bounds
from kinfmu.analysis.certified.cells import Prover
from kinfmu.analysis.certified.cover import Cover, Guess, cover
from kinfmu.analysis.certified.formulas import Formulas
from kinfmu.analysis.certified.intervals import Intervals, around
from kinfmu.analysis.driver_path import DriverPath, follow, place_text
from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.errors import KinfmuError, RequestError, listed
from kinfmu.files import errors_of_writing, write_whole
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.opened import opened
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.trace import parameter_symbol
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.limit import Limit

WIDTH = 0.1  # [rad, sizes] of the driver; of the first cells
LEAST = 1e-9  # [rad, sizes]; narrower cells are given up
_ENCLOSED = 2e-10  # [rad, sizes] of the driver, about; how closely a dead centre is enclosed
_WINDOWS = (0.03, 0.003, 0.0003)  # [rad, sizes] from a dead centre along the path, where cells over that way begin
_PARTS = 6  # of the way to a dead centre
_MEET = 1e-9  # of the driver; what is covered up to this distance from the end of the range counts as covered


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
        wide = self.cover.tubes.wide
        return float((wide.high / self.prover.unit[:, None]).min(initial=math.inf))

    def __str__(self) -> str:
        """The certificate as lines of the report of `kinfmu check`."""
        unit = "s"
        if self.driver != "time":
            kind = self.mechanism.drivers[0].quantity.kind
            unit = "rad" if kind == "angle" else self.mechanism.length_unit
        turns = f"; the poses come back after {_turns_text(self.turns)}" if self.turns else ""
        lines = [
            f"certified   {self.driver} from {place_text(self.low, unit)} to {place_text(self.high, unit)}, "
            f"{100.0 * self.share:.9g} % of it in {len(self.cover.cells)} cells: the loops close, no other pose is "
            f"within {self.tube:.2g} rad or sizes, no block is singular{turns}"
        ]
        if not len(self.cover.cells):
            lines = [f"certified   {self.driver}: nothing"]
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
        from kinfmu.analysis.certified.stored import written

        with errors_of_writing(path, KinfmuError):
            write_whole(path, written(self))

    def bounds(self, output: str, order: int = 0) -> ExtremeBounds:
        """Return the bounds of an output (order 0), its rate (1) or acceleration (2) over all that is proved.

        Rates are per unit of the driver, over a run per second.

        Args:
            output: The output.
            order: Of the derivative.

        Raises:
            RequestError: There is no such output.

        """
        return bounds(self.prover, self.cover.cells, self.cover.tubes, self._node(output), order)

    def enclosed(self, output: str, x: FloatArray, order: int = 0) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds of an output, its rate or acceleration, at values of the driver or at times.

        NaN where nothing is proved.

        Args:
            output: The output.
            x: Values of the driver, or times, (n,).
            order: Of the derivative.

        Raises:
            RequestError: There is no such output.

        """
        x = np.asarray(x, dtype=float)
        node, cells = self._node(output), self.cover.cells
        k = np.clip(np.searchsorted(cells.low, x, "right") - 1, 0, max(len(cells) - 1, 0))
        known = np.flatnonzero((cells.low[k] <= x) & (x <= cells.high[k])) if len(cells) else np.array([], dtype=int)
        k, low, high = k[known], np.full_like(x, np.nan), np.full_like(x, np.nan)
        value = EnclosedQuantity(self.prover, node, order).at(
            cells[k], self.cover.tubes[k], Intervals(x[known]) - cells.u[k]
        )
        low[known], high[known] = value.low, value.high
        return low, high

    def _node(self, output: str) -> Node:
        names: list[str] = list(self.prover.formulas.plan.outputs)
        if output not in names:
            raise RequestError(f"'{output}' is no output; outputs: {listed(names)}")
        return self.prover.formulas.outputs[names.index(output)][0]


def certify(
    mechanism: Mechanism,
    *,
    over: str | None = None,
    tolerances: float | Mapping[str, float] | None = None,
    width: float = WIDTH,
) -> Certificate:
    """Prove that a motion is what it says, between its samples too.

    For every cell of the range the certificate proves: the loops close; the pose is the only one in a tube around it,
    so that the branch is continuous; no block of the plan is singular. Cells that fail are halved.

    Args:
        mechanism: The mechanism.
        over: "range": all values that the only driver can take from the start pose; "run": the times of the run.
            Default: the range of one driver, the run of several.
        tolerances: For a certificate of all mechanisms whose numbers differ from those of the file by at most this: a
            part of every length, such as 0.001, or numbers [rad or the file's unit of length] by the names of
            parameters and of places such as "bodies.crank.points.P.x". Default: none.
        width: Width of the first cells [rad or sizes of the mechanism; over a run: steps of it].

    Raises:
        RequestError: `over` is not known, or there are several drivers and it is "range"; a tolerance is of no number.
        KinfmuError: The mechanism cannot be solved.

    """
    over = over or ("range" if len(mechanism.drivers) == 1 else "run")
    plan, box = prepared(mechanism, over, tolerances)
    certificate = _over_run(plan, box) if over == "run" else _over_range(follow(plan, 0), width, box)
    return replace(certificate, mechanism=mechanism, tolerances=tolerances)


def prepared(
    mechanism: Mechanism, over: str, tolerances: float | Mapping[str, float] | None
) -> tuple[SolvePlan, dict[str, Intervals]]:
    """Return the plan of all coordinates, and the box of its parameters; arguments as of `certify`."""
    if over not in ("range", "run"):
        raise RequestError(f"over = '{over}' is not known; known are 'range' and 'run'")
    if over == "range" and len(mechanism.drivers) > 1:
        raise RequestError("several drivers have no range in common; use over = 'run'")
    mechanism = replace(mechanism, coordinates="all")
    made, varied = (mechanism, {}) if tolerances is None else _varied(mechanism, tolerances)
    plan = compile_plan(made)
    box: dict[str, Intervals] = {
        parameter_symbol(one.name): around(np.array(one.value), np.array(varied[one.name]))
        for one in plan.parameters
        if one.name in varied
    }
    return plan, box


def _varied(mechanism: Mechanism, tolerances: float | Mapping[str, float]) -> tuple[Mechanism, dict[str, float]]:
    """Return the mechanism with its numbers as parameters, and the tolerances of these by name."""
    made = opened(mechanism)
    names = {label: name for name, label in made.labels.items()} | {name: name for name in mechanism.parameters}
    if isinstance(tolerances, Mapping):
        for name in tolerances:
            if name not in names:
                raise RequestError(
                    f"tolerance of '{name}': not a number of this mechanism, such as {listed(list(names)[:3])}"
                )
        return made.mechanism, {names[name]: abs(float(value)) for name, value in tolerances.items()}
    given = made.mechanism.parameters.items()
    lengths = {name: one for name, one in given if one.quantity is not None and one.quantity.kind == "length"}
    return made.mechanism, {name: abs(tolerances * float(one.value)) for name, one in lengths.items()}


def _over_range(path: DriverPath, width: float, box: Mapping[str, Intervals]) -> Certificate:
    plan = path.plan
    prover = Prover(formulas_of(plan, varied=box), box)
    unit = 1.0 if path.kind == "angle" else plan.size
    low = path.low.u[0] if path.low else path.poses[0].u[0]
    high = path.high.u[0] if path.high else path.poses[-1].u[0]
    edges = np.linspace(low, high, max(2, math.ceil((high - low) / (width * unit)) + 1))
    poses = {pose.u[0]: pose for pose in path.poses}
    found = of_branch(cover(prover, edges, _guess(path.solver, poses, lambda u: (u,)), LEAST * unit), poses)
    return of_range(path, prover, found)


def of_range(path: DriverPath, prover: Prover, found: Cover) -> Certificate:
    """Return the certificate of a range: with the dead centres at its ends, and what the cells leave unproved."""
    unit = 1.0 if path.kind == "angle" else path.plan.size
    low = path.low.u[0] if path.low else path.poses[0].u[0]
    high = path.high.u[0] if path.high else path.poses[-1].u[0]
    centres, reasons = [], []
    for limit, is_high in ((path.low, False), (path.high, True)):
        if limit is None:
            continue
        centre = dead_centre(prover, found, limit, is_high=is_high)
        if isinstance(centre, DeadCentre):
            centres.append(centre)
        else:
            reasons.append((limit.u[0], centre))
    for centre in centres:
        low, high = (low, centre.high) if centre.is_high else (centre.low, high)
    gaps = _gaps(found, low, high, centres, reasons, _MEET * unit)
    turns = path.turns if path.turns is not None and not gaps and _closes(found, path.turns) else None
    return Certificate(path.plan.mechanism, path.name, low, high, turns, found, tuple(centres), tuple(gaps), prover)


def _over_run(plan: SolvePlan, box: Mapping[str, Intervals]) -> Certificate:
    run = plan.mechanism.run
    prover = Prover(formulas_of(plan, over_time=True, varied=box), box)
    edges = np.unique([*np.arange(run.start, run.stop, run.step), run.stop, *_jumps(plan, run.start, run.stop)])
    solver, poses, values = poses_at(plan, edges)
    found = cover(prover, edges, _guess(solver, poses, values), LEAST * (run.stop - run.start))
    return of_run(plan, prover, of_branch(found, poses))


def of_run(plan: SolvePlan, prover: Prover, found: Cover) -> Certificate:
    """Return the certificate of a run: with what the cells leave unproved."""
    start, stop = float(plan.mechanism.run.start), float(plan.mechanism.run.stop)
    gaps = _gaps(found, start, stop, [], [], 0.0)
    return Certificate(plan.mechanism, "time", start, stop, None, found, (), tuple(gaps), prover)


Values = Callable[[float], tuple[float, ...]]  # of the drivers


def poses_at(plan: SolvePlan, times: FloatArray) -> tuple[Solver, dict[float, Pose], Values]:
    """Return the solver, its good poses at times of the run, and the values of the drivers at a time."""
    solver = Solver(load_model(plan))

    def values(t: float) -> tuple[float, ...]:
        return tuple(float(driver.law.at(t)) for driver in plan.mechanism.drivers)

    poses: dict[float, Pose] = {}
    pose = solver.anchor
    for t in times.tolist():
        arrived = solver.solve(pose, values(t))
        if arrived.good:
            pose = poses[t] = arrived
    return solver, poses, values


def of_branch(found: Cover, poses: Mapping[float, Pose]) -> Cover:
    """Return the pieces of the branch that the solver follows."""
    known = {x: pose for x, pose in poses.items() if not pose.status}
    return found.with_poses(np.array(list(known)), np.array([pose.z for pose in known.values()]).T)


def formulas_of(plan: SolvePlan, *, over_time: bool = False, varied: Collection[str] = ()) -> Formulas:
    for block in plan.blocks:
        if len(block.residuals) > len(block.unknowns):
            raise RequestError(
                f"{listed(block.unknowns)}: solved with redundant rows ({listed(block.row_names)}); such blocks cannot "
                "be certified yet"
            )
    return Formulas(plan, over_time=over_time, varied=varied)


def _jumps(plan: SolvePlan, start: float, stop: float) -> list[float]:
    """Return the times within a run at which laws jump."""
    found = []
    for driver in plan.mechanism.drivers:
        at, period = driver.law.own_breaks()
        for value in at:
            time = float(value)
            if period:
                time += float(period) * math.ceil((start - time) / float(period))
            while start < time < stop:
                found.append(time)
                if not period:
                    break
                time += float(period)
    return found


def _guess(solver: Solver, poses: Mapping[float, Pose], values: Values) -> Guess:
    """Return what finds poses by the solver, each followed from the nearest known one."""
    known = np.array(sorted(poses))

    def guess(x: FloatArray) -> FloatArray:
        found = np.full((len(solver.anchor.z), len(x)), np.nan)
        for k, at in enumerate(x.tolist()):
            start = poses[float(known[np.argmin(abs(known - at))])]
            pose = solver.solve(start.base or start, values(at))
            if pose.good:
                found[:, k] = pose.z
        return found

    return guess


def _closes(found: Cover, turns: int) -> bool:
    """Return whether the pose at the end of whole turns is the one at their begin, angles moved by whole turns."""
    first, last = found.cells[:1], found.cells[-1:]
    begin, end = first.at(Intervals(first.low) - first.u), last.at(Intervals(last.high) - last.u)
    whole = np.rint((end - begin).middle / math.tau) * math.tau
    inside = end + found.tubes[-1:].narrow - Intervals(whole, np.nextafter(whole, np.inf)) - begin
    return turns > 0 and bool(inside.is_inside(found.tubes[:1].wide).all())


def _gaps(
    found: Cover,
    low: float,
    high: float,
    centres: Sequence[DeadCentre],
    reasons: Sequence[tuple[float, str]],
    near: float,
) -> list[Gap]:
    """Return what the joined cells and the dead centres leave uncovered, with the reason that is nearest."""
    pieces = [(float(found.cells.low[a]), float(found.cells.high[b])) for a, b in found.pieces]
    starts = [low, *(end for _, end in pieces)]
    ends = [*(begin for begin, _ in pieces), high]
    gaps = []
    for k, (begin, end) in enumerate(zip(starts, ends, strict=True)):
        is_end = [centre for centre in centres if (centre.is_high if k == len(pieces) else not centre.is_high)]
        if k in (0, len(pieces)) and (is_end or end - begin <= near):
            continue
        if 0 < k < len(pieces) and begin < end and _changes_sign(found, k):
            gaps.append(Gap(begin, end, "branches cross: a change point"))
            continue
        if begin == end:
            gaps.append(Gap(begin, end, "the cells on both sides are not joined"))
            continue
        at = min(reasons, key=lambda reason: abs(reason[0] - 0.5 * (begin + end)), default=None)
        is_near = at is not None and begin - near <= at[0] <= end + near
        gaps.append(Gap(begin, end, at[1] if at is not None and is_near else "not proved"))
    return gaps


def _changes_sign(found: Cover, piece: int) -> bool:
    """Return whether the determinant of a block has other signs before and after a gap, the one before a piece."""
    before, after = found.pieces[piece - 1][1], found.pieces[piece][0]
    return bool((found.tubes.sign[:, before] != found.tubes.sign[:, after]).any())


def dead_centre(prover: Prover, found: Cover, limit: Limit, *, is_high: bool) -> DeadCentre | str:
    """Return a dead centre with the proof that the branch turns back there; or why there is no proof.

    Near it the driver is a function of the way x along the direction in which the unknowns move there. Cells over x
    prove the only curve through a window; its second derivative has one sign in all cells, and its first derivative
    changes its sign within the one whose values of the driver are returned. The curve begins at a pose of the proved
    cells.
    """
    found_there: DeadCentre | str = ""
    for within in _WINDOWS:
        found_there = _dead_centre(prover, found, limit, within, is_high=is_high)
        if isinstance(found_there, DeadCentre):
            break
    return found_there


def _dead_centre(prover: Prover, found: Cover, limit: Limit, within: float, *, is_high: bool) -> DeadCentre | str:
    """Return what `dead_centre` does, for cells over the way that begin within a distance."""
    if prover.formulas.varied:
        return "a dead centre, whose place depends on the tolerances"
    if limit.block < 0 or limit.crosses or limit.pole >= 0 or not len(found.cells):
        return "the path ends: not at a dead centre"
    formulas = prover.formulas
    block = formulas.blocks[limit.block]
    own = slice(block.place, block.place + block.size)
    toward = 1.0 if is_high else -1.0
    speeds = np.linalg.norm(found.cells.path[1, own] / prover.unit[own, None], axis=0)
    ways = 2.0 * abs(limit.u[0] - found.cells.u) * speeds
    first, last = found.pieces[-1 if is_high else 0]
    near = first + np.flatnonzero(ways[first : last + 1] < within)
    if not len(near):
        return "a dead centre: cells end before it"
    k = int(near[np.argmax(ways[near])])
    cell = found.cells[k : k + 1]
    unscaled = cell.path[1, own, 0] / prover.unit[own] * toward
    direction = unscaled / np.linalg.norm(unscaled) / prover.unit[own]
    way = float(ways[k])
    turned = Prover(formulas.turned(limit.block, direction.tolist(), cell.path[0, own, 0].tolist()))
    solved = [formulas.blocks[number] for number in formulas.behind(limit.block)]
    places = [place for one in solved for place in range(one.place, one.place + one.size)]
    u0, apart = float(cell.u[0]), limit.u[0] - float(cell.u[0])

    def guess(x: FloatArray) -> FloatArray:
        rows = np.repeat(cell.path[0, places], len(x), 1)
        rows[-block.size :] += direction[:, None] * prover.unit[own, None] ** 2 * x
        return np.vstack((u0 + apart * (1.0 - (1.0 - x / way) ** 2), rows))

    top = way
    for _ in range(8):
        at, converged = turned.cells(np.array([top]), np.array([top]), guess(np.array([top])))
        if not converged[0] or at.path[2, 0, 0] == 0.0:
            return "a dead centre: Newton does not converge there"
        top -= float(at.path[1, 0, 0] / at.path[2, 0, 0])
    if not 0.2 * way < top < 5.0 * way:
        return "a dead centre: the path does not turn back where it was expected"
    bend_there = abs(float(at.path[2, 0, 0])) / turned.unit[0]
    small = min(math.sqrt(_ENCLOSED / bend_there), 0.1 * top)
    edges = np.array([*np.linspace(0.0, top - small, _PARTS), *np.linspace(top + small, 2.0 * top, _PARTS)])
    window = cover(turned, edges, guess, 0.01 * small)
    if window.pieces != [(0, len(window.cells) - 1)] or window.cells.low[0] != 0.0:
        return "a dead centre: the path through it is not proved"
    bend = (Intervals(window.cells.path[2, 0]) + window.tubes.accelerations[0]) * -toward
    begins = turned_rate(window, window.cells.low) * toward
    ends = turned_rate(window, window.cells.high) * toward
    inner = int(np.searchsorted(window.cells.low, top, "right")) - 1
    if not ((bend.low > 0.0).all() and begins.low[inner] > 0.0 and ends.high[inner] < 0.0):
        return "a dead centre: its curvature is not proved"
    pose = window.cells.at(Intervals(window.cells.low) - window.cells.u) + window.tubes.narrow
    if not _lies_in(pose[:, :1], found, k, places):
        return "a dead centre: the path to it is not joined to the cells"
    value = window.cells.at(window.cells.s) + window.tubes.narrow
    return DeadCentre(float(value.low[0, inner]), float(value.high[0, inner]), is_high)


def turned_rate(window: Cover, x: FloatArray) -> Intervals:
    """Return the driver's rate along the way, at one place of each cell."""
    cells = window.cells
    return Intervals(cells.path[1, 0]) + Intervals(cells.path[2, 0]) * (Intervals(x) - cells.u) + window.tubes.rates[0]


def _turns_text(turns: int) -> str:
    return "a turn" if turns == 1 else f"{turns} turns"


def _lies_in(pose: Intervals, found: Cover, k: int, places: Sequence[int]) -> bool:
    """Return whether a driver value with its unknowns lies in the tube of a cell."""
    cell = found.cells[k : k + 1]
    u = pose[0]
    if not (cell.low[0] <= u.low[0] and u.high[0] <= cell.high[0]):
        return False
    off = pose[1:] - cell.at(u - cell.u)[places]
    return bool(off.is_inside(found.tubes[k : k + 1].wide[places]).all())
