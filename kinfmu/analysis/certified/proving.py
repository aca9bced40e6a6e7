"""Proving a motion: the range of a driver or a run is covered by cells, and what they leave is named."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from kinfmu.analysis.certified.bounds import closing
from kinfmu.analysis.certified.cells import Cells, Prover
from kinfmu.analysis.certified.certificate import Certificate, DeadCentre, Gap, PathEnd
from kinfmu.analysis.certified.cover import Cover, Guess, cover, joined
from kinfmu.analysis.certified.dead_centre import dead_centre
from kinfmu.analysis.certified.formulas import Formulas
from kinfmu.analysis.certified.intervals import Intervals, around, jumping
from kinfmu.analysis.certified.poses import is_whole, turns_of
from kinfmu.analysis.driver_path import DriverPath, follow
from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.errors import RequestError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.opened import opened
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.equations.closing import CONSISTENT
from kinfmu.plan.trace import parameter_symbol
from kinfmu.solver.python import Pose, Solver
from kinfmu.solver.python.solver import TOLERANCE

WIDTH = 0.1  # [rad, sizes] of the driver; of the first cells
LEAST = 1e-9  # [rad, sizes]; narrower cells are given up
_NEAR_CENTRE = 1e3  # times _MEET before a dead centre: there its own cells prove the block that turns back
_MEET = 1e-9  # of the driver; what is covered up to this distance from the end of the range counts as covered
_CLEAR = 1e-4  # of the range; width of cells that are not close to a change point
_SMOOTH = 0.01  # rad or sizes of an unknown per rad or size of the driver, within which directions agree
_GRADE = 0.5  # of distances from a singular place: ends of cells next to each other
_WORTH = 1e-6  # of the range; narrower pieces, as between branches that cross, are not looked at
_TURN = (6.283185307179586, 6.283185307179587)  # [rad], with 2 pi between them


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
    redundant = [*plan.watch_names, *(row for block in plan.blocks for row in block.row_names[len(block.unknowns) :])]
    if varied and redundant:
        raise RequestError(
            f"redundant rows ({listed(redundant)}) close for the numbers of the file only: there is no certificate of "
            "tolerances"
        )
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
            if name in mechanism.parameters and mechanism.parameters[name].expression is not None:
                raise RequestError(f"tolerance of '{name}': it follows from other parameters; give theirs")
        return made.mechanism, {names[name]: abs(float(value)) for name, value in tolerances.items()}
    given = made.mechanism.parameters.items()
    lengths = {name: one for name, one in given if one.quantity is not None and one.quantity.kind == "length"}
    return made.mechanism, {name: abs(tolerances * float(one.value)) for name, one in lengths.items()}


def _over_range(path: DriverPath, width: float, box: Mapping[str, Intervals]) -> Certificate:
    plan = path.plan
    prover = Prover(Formulas(plan, varied=box), box)
    unit = prover.formulas.unit_of_x
    low = path.low.u[0] if path.low else path.poses[0].u[0]
    high = path.high.u[0] if path.high else path.poses[-1].u[0]
    singular = [limit.u[0] for limit in (path.low, path.high) if limit]
    singular += [bridge.centre for bridge in path.bridges]
    edges = _graded(low, high, width * unit, singular, LEAST * unit)
    poses = {pose.u[0]: pose for pose in path.poses}
    guess = guess_of(path.solver, poses, lambda u: (u,))
    return of_range(path, prover, of_branch(cover(prover, edges, guess, LEAST * unit), poses, guess))


def _graded(low: float, high: float, width: float, singular: Sequence[float], least: float) -> FloatArray:
    """Return ends of cells of a width; towards singular places cells are narrower, as those that are proved there."""
    edges = np.linspace(low, high, max(2, math.ceil((high - low) / width) + 1))
    offsets = width * _GRADE ** np.arange(math.ceil(math.log(least / width) / math.log(_GRADE)))
    for place in singular:
        near = np.concatenate((place - offsets, place + offsets))
        edges = edges[(abs(edges - place) > width) | (edges == low) | (edges == high)]
        edges = np.concatenate((edges, near[(low < near) & (near < high)]))
    return np.unique(edges)


def of_range(path: DriverPath, prover: Prover, found: Cover) -> Certificate:
    """Return the certificate of a range: with the dead centres at its ends, and what the cells leave unproved."""
    unit = prover.formulas.unit_of_x
    low = path.low.u[0] if path.low else path.poses[0].u[0]
    high = path.high.u[0] if path.high else path.poses[-1].u[0]
    found, limits, reasons = with_redundant_rows(prover, found)
    centres: list[DeadCentre] = []
    ends: list[PathEnd] = []
    for limit, is_high in ((path.low, False), (path.high, True)):
        if limit is None:
            continue
        proved = dead_centre(prover, found, limit, is_high=is_high)
        if isinstance(proved, str):
            reasons.append((limit.u[0], proved))
        else:
            centres.append(proved[0])
            ends.append(proved[1])
    for centre in centres:
        low, high = (low, centre.high) if centre.is_high else (centre.low, high)
    gaps = _gaps(prover, found, low, high, centres, reasons, _MEET * unit)
    if path.stopped:
        at = high if path.is_stopped_high else low
        gaps.append(Gap(at, at, f"the motion is not followed farther: {path.stopped}"))
    turns = path.turns if path.turns is not None and not gaps and _closes(prover, found, path.turns) else None
    return Certificate(
        path.plan.mechanism,
        path.name,
        low,
        high,
        turns,
        found,
        tuple(centres),
        tuple(gaps),
        prover,
        limits,
        tuple(ends),
    )


def _over_run(plan: SolvePlan, box: Mapping[str, Intervals]) -> Certificate:
    run = plan.mechanism.run
    prover = Prover(Formulas(plan, over_time=True, varied=box), box)
    edges = np.unique([*np.arange(run.start, run.stop, run.step), run.stop, *_jumps(plan, run.start, run.stop)])
    solver, poses, values = poses_at(plan, edges)
    guess = guess_of(solver, poses, values)
    found = cover(prover, edges, guess, LEAST * (run.stop - run.start))
    return of_run(plan, prover, of_branch(found, poses, guess))


def of_run(plan: SolvePlan, prover: Prover, found: Cover) -> Certificate:
    """Return the certificate of a run: with what the cells leave unproved."""
    start, stop = float(plan.mechanism.run.start), float(plan.mechanism.run.stop)
    found, limits, reasons = with_redundant_rows(prover, found)
    gaps = _gaps(prover, found, start, stop, [], reasons, 0.0)
    return Certificate(plan.mechanism, "time", start, stop, None, found, (), tuple(gaps), prover, limits)


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


def of_branch(found: Cover, poses: Mapping[float, Pose], guess: Guess) -> Cover:
    """Return the pieces of the branch that the solver follows; guess: its poses, where a piece is between two poses."""
    known = {x: pose for x, pose in poses.items() if not pose.status}
    x, z = np.array(list(known)), np.array([pose.z for pose in known.values()]).T
    ends = [(found.cells.low[first], found.cells.high[last]) for first, last in found.pieces]
    worth = _WORTH * (found.cells.high.max(initial=0.0) - found.cells.low.min(initial=0.0))
    more = np.array(
        [0.5 * (a + b) for a, b in ends if b - a > worth and not ((x >= a) & (x <= b)).any()],
        dtype=float,
    )
    at = guess(more)
    is_known = np.isfinite(at).all(axis=0)
    return found.with_poses(np.append(x, more[is_known]), np.concatenate((z, at[:, is_known]), axis=1))


def with_redundant_rows(prover: Prover, found: Cover) -> tuple[Cover, dict[str, float], list[tuple[float, str]]]:
    """Return the cells in which all redundant rows are shown to close, their bounds there, and where one is not."""
    rows = prover.formulas.redundant
    if not rows:
        return found, {}, []
    limits, is_open, is_unsure = closing(prover, found.cells, found.tubes, [*rows.values()], TOLERANCE)
    reasons = [
        (float(u), f"the redundant row {name} {what}")
        for what, table in (("does not close", is_open), (f"is not shown to close within {TOLERANCE:g}", is_unsure))
        for name, where in zip(rows, table, strict=True)
        for u in found.cells.u[where]
    ]
    kept = ~(is_open | is_unsure).any(axis=0)
    found = found if kept.all() else joined([(found.cells[kept], found.tubes[kept])])
    return found, dict(zip(rows, limits.tolist(), strict=True)), reasons


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


def guess_of(solver: Solver, poses: Mapping[float, Pose], values: Values) -> Guess:
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


def _closes(prover: Prover, found: Cover, turns: int) -> bool:
    """Return whether the poses come back after turns of the driver: all rows and outputs do, and the pose at the end.

    That is the pose of the first cell, angles moved by whole turns.
    """
    formulas, first, last = prover.formulas, found.cells[:1], found.cells[-1:]
    is_angle = np.array([name.is_angle for name in formulas.plan.unknowns], dtype=bool)[:, None]
    begin, end = first.at(Intervals(first.low) - first.u), last.at(Intervals(last.high) - last.u)
    count = np.where(is_angle, np.rint((end - begin).middle / math.tau), 0.0)
    off = end + found.tubes[-1:].narrow - Intervals(*_TURN) * count - begin
    outputs = [motion[0] for motion in formulas.outputs]
    rows = [node for block in formulas.blocks for node in block.rows[0]]
    changes = turns_of(
        [*rows, *outputs],
        {formulas.x: float(turns)} | dict(zip(formulas.unknowns, count.ravel().tolist(), strict=True)),
    )
    names = formulas.plan.outputs
    return (
        turns > 0
        and all(changes[row] == 0.0 for row in rows)
        and all(
            is_whole(changes[node]) if name.is_angle else changes[node] == 0.0
            for name, node in zip(names, outputs, strict=True)
        )
        and bool(off.is_inside(found.tubes[:1].wide).all())
    )


def _gaps(
    prover: Prover,
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
        if k in (0, len(pieces)) and end - begin <= (_NEAR_CENTRE * near if is_end else near):
            continue
        if 0 < k < len(pieces) and begin < end and _changes_sign(found, k):
            gaps.append(Gap(begin, end, f"branches cross: a change point; {path_across(prover, found, k)}"))
            continue
        at = min(reasons, key=lambda reason: abs(reason[0] - 0.5 * (begin + end)), default=None)
        if at is not None and begin - near <= at[0] <= end + near:
            reason = at[1]
        elif 0 < k < len(pieces) and _jumps_within(prover, found, k):
            reason = "a law begins anew, or an angle passes half a turn"
        else:
            reason = "the cells on both sides are not joined" if begin == end else "not proved"
        gaps.append(Gap(begin, end, reason))
    return gaps


def _changes_sign(found: Cover, piece: int) -> bool:
    """Return whether the determinant of a block has other signs before and after a gap, the one before a piece."""
    before, after = found.pieces[piece - 1][1], found.pieces[piece][0]
    return bool((found.tubes.sign[:, before] != found.tubes.sign[:, after]).any())


@np.errstate(all="ignore")  # of rows far from the cell
def _jumps_within(prover: Prover, found: Cover, piece: int) -> bool:
    """Return whether a law may begin anew in the gap before a piece, or an angle pass half a turn: rows jump there."""
    before, after = found.pieces[piece - 1][1], found.pieces[piece][0]
    cell, tube = found.cells[before : before + 1], found.tubes[before : before + 1]
    s = Intervals(found.cells.high[[before]], found.cells.low[[after]]) - cell.u
    values = prover.deviated(prover.over(cell, s), tube)
    return any(bool(jumping(block.rows[0], values, (1,))[0]) for block in prover.formulas.blocks)


@np.errstate(all="ignore")  # of rates that are not known
def path_across(prover: Prover, found: Cover, piece: int) -> str:
    """Return how well all rows close along a path through the gap before a piece, from its pose before to that after.

    That they close exactly is a property of exact numbers: a change of a length by as little as rounding parts the
    branches. So it is not proved, and the branch through the gap is not either.
    """
    before, after = found.pieces[piece - 1][1], found.pieces[piece][0]
    ends = [(before, found.cells.high[before]), (after, found.cells.low[after])]
    poses = []
    for k, u in ends:
        cell = found.cells[k : k + 1]
        poses.append((cell.at(Intervals(np.array([u])) - cell.u) + found.tubes[k : k + 1].narrow).middle)
    (_, low), (_, high) = ends
    wide = np.flatnonzero(found.cells.high - found.cells.low > _CLEAR * (found.cells.high[-1] - found.cells.low[0]))
    nearest = [wide[np.argmin(abs(found.cells.u[wide] - u))] for _, u in ends if len(wide)]
    bend = found.cells.path[2][:, nearest].mean(axis=1, keepdims=True) if nearest else 0.0 * poses[0]
    rate = (poses[1] - poses[0]) / (high - low)
    middle = 0.5 * (poses[0] + poses[1]) - bend * (0.125 * (high - low) ** 2)
    window = Cells(np.array([low]), np.array([high]), np.array([0.5 * (low + high)]), np.array([middle, rate, bend]))
    for k, u in ends:
        cell = found.cells[k : k + 1]
        off = window.at(Intervals(np.array([u])) - window.u) - cell.at(Intervals(np.array([u])) - cell.u)
        if not off.is_inside(found.tubes[k : k + 1].wide).all():
            return "no path joins the poses before and after"
    most = prover.most_along(window)
    if most > CONSISTENT:
        return f"on the path from the pose before to that after rows are open by {most:.1g} of the size"
    turn = _turn_across(prover, found, piece)
    if not turn < _SMOOTH:
        return "the direction after it is not shown to be that before it"
    return (
        f"a path joins the poses before and after, along which all rows close within {most:.1g} of the size; its "
        f"direction changes by less than {turn:.1g}"
    )


def _turn_across(prover: Prover, found: Cover, piece: int) -> float:
    """Return by how much the rates before a piece differ at most from those of it, near the gap between them.

    Close to the gap rates are known less well, farther away they change: the cells where both are least are taken.
    """
    unit = prover.unit[:, None]
    sides = []
    for number, is_before in ((piece - 1, True), (piece, False)):
        first, last = found.pieces[number]
        k = np.arange(first, last + 1)
        cells, tubes = found.cells[k], found.tubes[k]
        u = cells.high if is_before else cells.low
        s = Intervals(u) - cells.u
        tubes = prover.closer(cells, tubes, s)
        rates = Intervals(cells.path[1]) + Intervals(cells.path[2]) * s + tubes.rates
        doubt = (rates.radius / unit).max(axis=0) + abs(u - u[-1 if is_before else 0]) / prover.formulas.unit_of_x
        sides.append(rates[:, np.argmin(doubt)])
    return float(((sides[1] - sides[0]).magnitude * prover.formulas.unit_of_x / unit[:, 0]).max())
