"""Advice on a mechanism that does not move as meant: small changes of its file, each tried before it is shown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from kinfmu.analysis.remedies import (
    LARGEST,
    Case,
    Remedy,
    additions,
    law_starts,
    open_at_start,
    other_drivers,
    other_ends,
    other_starts,
    removals,
    scalings,
    swaps,
)
from kinfmu.errors import KinfmuError, MobilityError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.edits import Edit, Put, edited
from kinfmu.mechanism.toml_file import mechanism_of
from kinfmu.mechanism.toml_text import toml_value
from kinfmu.plan import SolvePlan, localized, plan_from
from kinfmu.plan.equations.assembly import COMFORTABLE_WITHOUT_BRIDGES, NEAR
from kinfmu.plan.equations.closing import close, closed_up_to
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.redundancy import Redundancy, find_redundancy
from kinfmu.plan.equations.start_poses import ROUGH, distance_from_start, start_from_poses
from kinfmu.plan.equations.system import System
from kinfmu.run.solve import solve

MOST = 3  # pieces of advice
_REGULAR = 1e-4  # least over largest singular value of all rows; less is singular
_SAMPLES = 25  # of the run of a changed mechanism
_TRIALS = 600  # coordinates of all the mechanisms that are planned for one piece of advice
_LOOKS = 6000  # coordinates of all those that are looked at
_STILL = 1e-9  # [rad, sizes]; a coordinate that changes less stands still
_FITS = 2.0 * ROUGH  # [rad, sizes]; start poses that are nearer to the assembled pose are those of a sketch
_STOPS = 1.2  # cost of a run that does not go on after its start; less by the part that it reaches
_IDLE = 1.0  # cost of bodies that stand still over the run, by their share


class Advice(NamedTuple):
    """A change of a mechanism file after which its mechanism moves.

    Attributes:
        text: What to do and why, in one line.
        edits: The change, for `kinfmu.mechanism.edits.edited`.
        leads_to: What the changed mechanism does.

    """

    text: str
    edits: tuple[Edit, ...]
    leads_to: str

    def as_json(self) -> dict[str, Any]:
        """Return the advice as plain data: edits are {"put": [keys], "value": ...} and {"remove": [keys]}."""
        edits = [
            {"put": list(edit.place), "value": edit.value} if isinstance(edit, Put) else {"remove": list(edit.place)}
            for edit in self.edits
        ]
        return {"text": self.text, "edits": edits, "leads_to": self.leads_to}

    def toml_lines(self) -> list[str]:
        """Return the change as lines of TOML: tables and keys to write, and what to remove as comments."""
        lines = []
        for edit in self.edits:
            if not isinstance(edit, Put):
                lines.append(f"# remove [{'.'.join(edit.place)}]")
            elif isinstance(edit.value, dict):
                lines.append(f"[{'.'.join(edit.place)}]")
                lines += [f"{key} = {_toml(value)}" for key, value in edit.value.items()]
            else:
                table, keys = edit.place[:2], edit.place[2:]
                if len(edit.place) == 2:
                    table, keys = edit.place[:1], edit.place[1:]
                header = f"[{'.'.join(table)}]"
                lines += [] if header in lines else [header]
                lines.append(f"{'.'.join(keys)} = {_toml(edit.value)}")
        return lines


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(part)}" for key, part in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return f"{value:.12g}" if isinstance(value, float) else toml_value(value)


def advice(source: Mechanism | Mapping[str, Any]) -> list[Advice]:
    """Return at most three changes after which a mechanism moves that does not move as meant, the likeliest first.

    Each has been tried: the changed mechanism has a plan and a regular start pose.

    Args:
        source: A mechanism, or the tables of its file, in which every change can then be made.

    Returns:
        The advice; none for a sound mechanism, or if nothing so small helps.

    Raises:
        MechanismError: The tables are not a mechanism.

    """
    mechanism = source if isinstance(source, Mechanism) else mechanism_of(dict(source), None)
    document = None if isinstance(source, Mechanism) else source
    local, origin = localized(mechanism)
    system = System(local)
    redundancy = find_redundancy(system)
    try:
        plan = plan_from(mechanism, system, origin, redundancy)
    except KinfmuError as problem:
        return treatment(mechanism, system, redundancy, problem, document)
    return improvement(plan, system, redundancy, document)


def treatment(
    mechanism: Mechanism,
    system: System,
    redundancy: Redundancy,
    problem: KinfmuError,
    document: Mapping[str, Any] | None = None,
) -> list[Advice]:
    """Return advice on a mechanism without a plan.

    Args:
        mechanism: The mechanism.
        system: Its equations.
        redundancy: Of the system.
        problem: Why it has no plan.
        document: The tables of its file; default: those of `text(mechanism)`.

    """
    if len(system.coordinates) > LARGEST:
        return []
    case = Case(mechanism, system, redundancy)
    free, rank = case.free.shape[1], len(system.coordinates) - case.free.shape[1]
    held = len(system.rows) - len(redundancy.redundant) > rank
    remedies: list[Iterable[Remedy]] = []
    if free:
        remedies.append(additions(case))
    if held:
        remedies.append(removals(case))
    if free and held:
        remedies.append(other_drivers(case, mechanism.drivers))
    if isinstance(problem, MobilityError):
        return _best(case, chain(*remedies), document)
    remedies += [law_starts(case)]
    found = _best(case, chain(*remedies), document)
    numbers = _best(case, chain(swaps(case), scalings(case), other_starts(case)), document, only_if=_meets_at_start)
    return [*numbers, *found][:MOST]


def improvement(
    plan: SolvePlan, system: System, redundancy: Redundancy, document: Mapping[str, Any] | None = None
) -> list[Advice]:
    """Return advice on a mechanism that has a plan but does not move as meant.

    Other start poses are advised if the assembled pose is far from those of the file, and near to these; other drivers
    if the run cannot be reached, or a driver has the name of a body that it does not drive; other points of joints if
    bodies do not move. With the last two the whole run must be reached and all bodies must move.
    """
    mechanism = plan.mechanism
    if len(system.coordinates) > LARGEST:
        return []
    case, found = Case(mechanism, system, redundancy), list[Advice]()
    if _fit(system, redundancy) > NEAR:
        found += _best(
            case, chain(swaps(case), other_starts(case)), document, only_if=lambda trial: _is_other_start(trial, plan)
        )
    reached, moving = _run(plan)
    drivers = list(mechanism.drivers) if reached < 1.0 else _misnamed(mechanism)
    found += _best(case, other_drivers(case, drivers), document, only_if=_moves_all)
    if len(moving) < len(mechanism.moving_bodies):
        found += _best(case, other_ends(case), document, only_if=_moves_all)
    return found[:MOST]


def is_doubtful(system: System, redundancy: Redundancy) -> bool:
    """Return whether something in the file of a mechanism that has a plan does not fit, whatever its motion is."""
    return _fit(system, redundancy) > NEAR or bool(_misnamed(system.mechanism))


def _misnamed(mechanism: Mechanism) -> list[Driver]:
    """Return the drivers with the name of a body that they do not drive."""
    bodies = {body.name for body in mechanism.moving_bodies}
    return [driver for driver in mechanism.drivers if driver.name in bodies - {*driver.bodies()}]


def _moves_all(trial: _Trial) -> bool:
    return trial.reached == 1.0 and trial.still == 0.0


def _fit(system: System, redundancy: Redundancy) -> float:
    """Return how far the assembled pose is from what the start poses give [rad, sizes]."""
    start, pose = redundancy.assembly
    return 0.0 if pose is None else distance_from_start(system, start, pose.q)


class _Trial(NamedTuple):
    """A changed mechanism that moves; reached: part of its run; still: share of bodies that never move."""

    plan: SolvePlan
    system: System
    redundancy: Redundancy
    reached: float
    still: float


def _meets_at_start(trial: _Trial) -> bool:
    """Return whether the start poses of a changed mechanism nearly close its joints."""
    return open_at_start(trial.system) <= ROUGH and _fit(trial.system, trial.redundancy) <= _FITS


def _is_other_start(trial: _Trial, plan: SolvePlan) -> bool:
    """Return whether the start poses of a changed mechanism fit, and it starts elsewhere than before."""
    if _fit(trial.system, trial.redundancy) > _FITS:
        return False
    off = (trial.plan.anchor.q - plan.anchor.q) / trial.system.column_scales
    return bool(np.abs(off).max() > 1e-3)


def _best(
    case: Case, remedies: Iterable[Remedy], document: Mapping[str, Any] | None, only_if: Any = None
) -> list[Advice]:
    """Return the best of the remedies that work."""
    tables = case.document if document is None else document
    looks = max(MOST, _LOOKS // max(1, len(case.system.coordinates)))
    trials = max(MOST, _TRIALS // max(1, len(case.system.coordinates)))
    found: list[tuple[float, Remedy, _Trial]] = []
    for remedy in sorted(_unlike(remedies), key=lambda one: one.cost)[:looks]:
        worst = sorted(cost for cost, *_ in found)[MOST - 1 : MOST]
        if (worst and worst[0] <= remedy.cost) or trials == 0:
            break
        changed = _changed(case, tables, remedy, meets=only_if is _meets_at_start)
        if changed is None:
            continue
        trials -= 1
        trial = _tried(changed)
        if trial is not None and (only_if is None or only_if(trial)):
            cost = remedy.cost + _STOPS * (1.0 - trial.reached) + _IDLE * trial.still
            found.append((cost, remedy, trial))
    found.sort(key=lambda one: one[0])
    return [Advice(remedy.text, remedy.edits, _result(trial)) for _, remedy, trial in found[:MOST]]


def _unlike(remedies: Iterable[Remedy]) -> Iterator[Remedy]:
    """Yield remedies without those that make the edits of an earlier one."""
    seen = []
    for remedy in remedies:
        if remedy.edits not in seen:
            seen.append(remedy.edits)
            yield remedy


def _changed(case: Case, document: Mapping[str, Any], remedy: Remedy, meets: bool) -> Mechanism | None:
    """Return the changed mechanism if its rows close near its start pose and determine all coordinates; else None.

    meets: Whether the start poses must nearly close its joints, which is tested first.
    """
    try:
        mechanism = mechanism_of(edited(document, remedy.edits), None)
    except KinfmuError:
        return None
    system = System(localized(mechanism)[0])
    if not mechanism.drivers or len(system.rows) < len(system.coordinates):
        return None
    if meets and open_at_start(system) > ROUGH:
        return None
    start = start_from_poses(system)
    is_open = [value is None for body in mechanism.moving_bodies for value in body.start]
    known = dict(zip(case.system.coordinates, case.q.tolist(), strict=True))
    closed = [known.get(name, value) for name, value in zip(system.coordinates, start.q.tolist(), strict=True)]
    for q in (start.q, np.where(is_open, closed, start.q)):
        pose, gap = close(system, q, start.u)
        if gap <= closed_up_to(system):
            singular = np.linalg.svd(Part(system).jacobian(pose), compute_uv=False)
            return mechanism if singular[-1] > _REGULAR * singular[0] else None
        if not any(is_open):
            break
    return None


def _tried(mechanism: Mechanism) -> _Trial | None:
    """Return a mechanism that moves; None if it has no plan or no regular start pose."""
    local, origin = localized(mechanism)
    system = System(local)
    try:
        redundancy = find_redundancy(system)
        plan = plan_from(mechanism, system, origin, redundancy)
        if plan.anchor.margin < COMFORTABLE_WITHOUT_BRIDGES:
            return None
        reached, moving = _run(plan)
    except KinfmuError:
        return None
    still = 1.0 - len(moving) / max(1, len(mechanism.moving_bodies))
    return _Trial(plan, system, redundancy, reached, still) if reached > 0.0 else None


def _run(plan: SolvePlan) -> tuple[float, set[str]]:
    """Return which part of the run of a mechanism is reached, and the bodies that move in it."""
    run = plan.mechanism.run
    motion = solve(plan, np.linspace(run.start, run.stop, _SAMPLES), engine="python")
    values = motion.values[motion.good][:, : motion.coordinate_count]
    if not len(values):
        return 0.0, set()
    spread = np.ptp(values, axis=0)
    names = plan.outputs[: motion.coordinate_count]
    moving = {
        name.owner
        for name, extent in zip(names, spread, strict=True)
        if extent > _STILL * (1.0 if name.is_angle else plan.size)
    }
    return float(motion.good.mean()), moving


def _result(trial: _Trial) -> str:
    """Return what a changed mechanism does."""
    mechanism = trial.plan.mechanism
    drivers = listed(driver.name for driver in mechanism.drivers)
    reach = "the whole run" if trial.reached == 1.0 else f"{100.0 * trial.reached:.0f} % of the run"
    return f"mobility {len(mechanism.drivers)}, driven by {drivers}; it moves over {reach}"
