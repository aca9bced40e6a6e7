"""Efforts and reactions of a mechanism with masses or loads over the motion that measures are taken of.

Samples are 360 in a turn of the driver, or those of the file's run. Peaks lie between them where the polynomials that
measures use place them, to 1e-9 where forces are smooth. Where samples have no numbers, peaks are those of the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from kinfmu.analysis.cams import CamFindings
from kinfmu.analysis.measuring import motion_of_check, name_of_run
from kinfmu.analysis.singular import DriverRange
from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.force_names import names_of_rows
from kinfmu.mechanism.joints.cam import Cam
from kinfmu.mechanism.laws import Spline
from kinfmu.mechanism.loads.load import Following
from kinfmu.motion.cams import pressing_sign
from kinfmu.motion.history import History
from kinfmu.motion.motion import Motion, break_places
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import effort_noun
from kinfmu.plan.undetermined import shared_reactions, unknown_contacts, why_unknown
from kinfmu.run import Run
from kinfmu.run.axis import TIME
from kinfmu.run.solve import solve
from kinfmu.units import METRES, ForceName, Quantity, unit_of

EQUAL = 1e-9  # relative: of two sizes that differ by less, the first is reported


@dataclass(frozen=True)
class ForcePeak:
    """The largest size of a force, with its sign, and where it occurs.

    name: Of a column, such as 'crank.torque', or of a joint; driver: in whose values `at` is; 'time' if several move;
    rms: Root of the mean square over the motion.
    """

    name: str
    value: float
    unit: str
    driver: str
    at: float
    at_unit: str
    rms: float


@dataclass(frozen=True)
class ForceRange:
    """The smallest and the largest value of a reduced inertia, or of the force or length of a spring."""

    name: str
    smallest: float
    largest: float
    unit: str


@dataclass(frozen=True)
class UnknownContact:
    """A contact force of unknown direction: the joint of the cam, the reactions that depend on it, what is missing."""

    joint: str
    reactions: tuple[str, ...]
    reason: str


@dataclass(frozen=True)
class LeftTable:
    """A load whose argument leaves the table of its law, which keeps its first and last value there.

    load: its name; table, reached: first and last argument, of the table and of the motion; kept: the first and the
    last effort of the table; unit, effort_unit: of these.
    """

    load: str
    table: tuple[float, float]
    reached: tuple[float, float]
    unit: str
    kept: tuple[float, float]
    effort_unit: str


@dataclass(frozen=True)
class Loading:
    """Forces over a motion.

    over: the motion, as text; gravity: [m/s2], None without; efforts: of each driver; inertias: reduced; loads: of
    springs and dampers, of each its effort, then its length or angle; reaction: the joint that transmits the largest
    determined force; shaking: force and moment on the ground; undetermined: reactions that share a load, with the rows
    that share it; reason: why there are no numbers, '' if there are; missing: samples without numbers;
    left_tables: loads beyond their tables; lift_offs: contacts of cams that would have to pull; unknown_contacts:
    contacts of cams without a known direction.
    """

    over: str
    gravity: tuple[float, float] | None = None
    efforts: tuple[ForcePeak, ...] = ()
    inertias: tuple[ForceRange, ...] = ()
    loads: tuple[ForceRange, ...] = ()
    reaction: ForcePeak | None = None
    shaking: tuple[ForcePeak, ...] = ()
    undetermined: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = ()
    reason: str = ""
    missing: int = 0
    left_tables: tuple[LeftTable, ...] = ()
    lift_offs: tuple[LiftOff, ...] = ()
    unknown_contacts: tuple[UnknownContact, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the forces as plain data."""
        return {
            "over": self.over,
            "gravity": None if self.gravity is None else list(self.gravity),
            "efforts": [asdict(effort) for effort in self.efforts],
            "reduced_inertias": [asdict(inertia) for inertia in self.inertias],
            "loads": [asdict(load) for load in self.loads],
            "largest_reaction": None if self.reaction is None else asdict(self.reaction),
            "shaking": [asdict(peak) for peak in self.shaking],
            "undetermined": [{"reactions": list(names), "rows": list(rows)} for names, rows in self.undetermined],
            "unknown_contacts": [asdict(one) | {"reactions": list(one.reactions)} for one in self.unknown_contacts],
            "left_tables": [asdict(one) for one in self.left_tables],
            "lift_offs": [one.as_json() for one in self.lift_offs],
            "reason": self.reason or None,
            "samples_without_numbers": self.missing,
        }


def loading(plan: SolvePlan, ranges: Sequence[DriverRange], cams: Sequence[CamFindings] = ()) -> Loading | None:
    """Return the forces of a mechanism over its motion; None without masses and loads.

    They are those of the motion of `motion_of_check`.
    """
    mechanism = plan.mechanism
    if not (mechanism.has_masses or mechanism.loads):
        return None
    undetermined: dict[tuple[str, ...], list[str]] = {}
    for name, rows in shared_reactions(plan).items():
        undetermined.setdefault(rows, []).append(name)
    shared = tuple((tuple(names), rows) for rows, names in undetermined.items())
    cam_joints = {joint.name: joint for joint in mechanism.joints if isinstance(joint, Cam)}
    hidden = tuple(
        UnknownContact(name, tuple(map(str, names)), why_unknown(plan, cam_joints[name]))
        for name, names in unknown_contacts(plan).items()
    )
    found = _over_motion(mechanism, ranges, cams)
    return replace(found, undetermined=shared, unknown_contacts=hidden)


def _over_motion(mechanism: Mechanism, ranges: Sequence[DriverRange], cams: Sequence[CamFindings]) -> Loading:
    """Return the forces over a motion, without those that are undetermined."""
    try:
        arguments, over = motion_of_check(mechanism, ranges)
        run = _with_breaks(solve(mechanism, **arguments), mechanism, arguments)
        over = over or name_of_run(run)
        missing = int((~run.good).sum())
        if missing == len(run):
            return Loading(over, reason="no sample has numbers", missing=missing)
        forces = _Forces(run)
        names = [f"{driver.name}.{effort_noun(driver.quantity.kind)}" for driver in mechanism.drivers]
        efforts = tuple(map(forces.peak, names))
        loads = {load.name for load in mechanism.loads if load.columns}
        inertias = forces.ranges(name for name in run.force_names if name.noun.startswith("reduced_inertia"))
        of_loads = forces.ranges(name for name in run.force_names if name.owner in loads)
        shaking = tuple(map(forces.peak, ("shaking_force", "shaking_moment")))
        metre = METRES[mechanism.length_unit]
        gravity = None if mechanism.gravity is None else (mechanism.gravity.x * metre, mechanism.gravity.y * metre)
        reaction, lifts = forces.largest_reaction(), forces.lift_offs(cams)
        left = tuple(forces.left_tables(mechanism))
        found = Loading(over, gravity, efforts, inertias, of_loads, reaction, shaking, missing=missing)
        return replace(found, left_tables=left, lift_offs=lifts)
    except KinfmuError as reason:
        return Loading("no motion", reason=str(reason))


def _with_breaks(run: Run, mechanism: Mechanism, arguments: dict[str, Any]) -> Run:
    """Return a run with samples where derivatives of laws jump too: there forces have kinks, or their peaks."""
    name = next(iter(arguments), "t")
    samples = np.asarray(arguments.get(name, run.t))
    with suppress(RequestError):  # the samples are too few, or not in order
        added = break_places(run)
        near = 1e-6 * float(np.diff(samples).min())
        added = [x for x in added if np.abs(samples - x).min() > near]
        if added:
            return solve(mechanism, **{**arguments, name: np.sort(np.concatenate([samples, added]))})
    return run


class _Forces:
    """Forces of a run: their extremes between the samples."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._motion: Motion | None = None  # without it extremes are those of samples
        with suppress(RequestError):  # too few samples, or they are not in the order of one argument
            self._motion = Motion.of_run(run)

    def peak(self, name: str) -> ForcePeak:
        """Return the largest size of a force, of those that measures read; NaN if it has no numbers."""
        low, high = self._extremes(name)
        value, at = low if -low[0] > high[0] + EQUAL * abs(high[0]) else high
        if -low[0] >= high[0] - EQUAL * abs(high[0]) and low[1] < high[1]:  # of equal sizes the first
            value, at = low
        run = self._run
        driver, at_unit = "time", "s"
        if len(run.input_names) == 3:
            driver, at_unit = run.input_names[0].driver, unit_of(run.input_names[0].quantity, run.length_unit)
        unit = next((place.unit for place in run.places() if place.name == name), "N")
        return ForcePeak(name, value, unit, driver, at, at_unit, _rms(run, np.asarray(run[name], dtype=float)))

    def ranges(self, names: Iterable[ForceName]) -> tuple[ForceRange, ...]:
        """Return the ranges of forces that have numbers."""
        found = [(name, self._extremes(name)) for name in names if np.isfinite(self._run[name]).any()]
        unit = self._run.length_unit
        return tuple(
            ForceRange(name, low + 0.0, high + 0.0, unit_of(name.quantity, unit))
            for name, ((low, _), (high, _)) in found
        )

    def left_tables(self, mechanism: Mechanism) -> Iterator[LeftTable]:
        """Yield the loads whose arguments leave their tables."""
        for load in mechanism.loads:
            if not isinstance(load, Following) or not isinstance(load.law, Spline) or load.law.repeats:
                continue
            if load.over is None and self._run.axis == TIME:
                low, high = float(self._run.t[0]), float(self._run.t[-1])
            elif load.over is not None and self._motion is not None:
                low, high = (float(extreme.value) for extreme in self._motion.history(load.over).extremes())
            else:
                continue
            (first, below), (last, above) = load.law.points[0], load.law.points[-1]
            low, high = (
                end if abs(end - own) > EQUAL * (last - first) else own for end, own in ((low, first), (high, last))
            )
            if low < first or high > last:
                effort, argument = (unit_of(Quantity(kind), mechanism.length_unit) for kind in load.law_kinds)
                kept = float(below), float(above)
                yield LeftTable(load.name, (float(first), float(last)), (low, high), argument, kept, effort)

    def largest_reaction(self) -> ForcePeak | None:
        """Return the largest force that a joint transmits; None if there is none that is determined."""
        names = [name for name in self._run.reaction_names if name.owner and name.quantity.kind == "force"]
        joints = dict.fromkeys(name.owner for name in names)
        peaks = [replace(self.peak(f"{joint}.force"), name=joint) for joint in joints]
        return max(
            (peak for peak in peaks if math.isfinite(peak.value)), key=lambda peak: abs(peak.value), default=None
        )

    def lift_offs(self, cams: Sequence[CamFindings]) -> tuple[LiftOff, ...]:
        """Return the contacts of cams that would have to pull."""
        return () if self._motion is None else tuple(lift_offs(self._motion, cams))

    def _extremes(self, name: str) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the smallest and the largest value of a force, each with the driver value or time at which it is."""
        run, values = self._run, np.asarray(self._run[name], dtype=float)
        if self._motion is not None and np.isfinite(values).all():
            motion, history = self._motion, self._motion.history(name)
            low, high = history.extremes()
            return (
                (float(low.value), float(motion.driven_at(np.asarray(low.x)))),
                (float(high.value), float(motion.driven_at(np.asarray(high.x)))),
            )
        if not np.isfinite(values).any():
            return (math.nan, math.nan), (math.nan, math.nan)
        at = run.inputs[:, 0] if len(run.input_names) == 3 else run.t
        k, j = int(np.nanargmin(values)), int(np.nanargmax(values))
        return (float(values[k]), float(at[k])), (float(values[j]), float(at[j]))


def _rms(run: Run, values: FloatArray) -> float:
    """Return the root of the mean square over time by the trapezoidal rule; samples without numbers do not count."""
    steps = np.diff(run.t)
    weights = np.append(steps, 0.0) + np.append(0.0, steps) if steps.any() else np.ones(len(run))
    known = np.isfinite(values)
    total = float(weights[known].sum())
    return math.sqrt(float((weights[known] * np.square(values[known])).sum()) / total) if total > 0.0 else math.nan


_ROUNDING = 1e-9  # of the largest contact force; smaller tensions are rounding


@dataclass(frozen=True)
class LiftOff:
    """A contact of a cam that would have to pull.

    joint: the cam's; force: the column of the contact force or moment; sense: 1 if a positive value presses
    follower and cam together, -1 if a negative one does; parts: where it would pull, each from begin to end in the
    direction of growing values of the driver, or in times if it turns back or several drivers move (driver: 'time'); of
    a motion that goes round a part may go on past its end; extent: 'turn' if it would pull
    at every angle of the driver, 'motion' if during the whole motion, else 'part'; largest, at: the largest tension, of
    a lever the largest moment that would pull, as a positive number, and where it occurs.
    """

    joint: str
    force: str
    sense: int
    unit: str
    driver: str
    at_unit: str
    parts: tuple[tuple[float, float], ...]
    extent: str
    largest: float
    at: float

    def as_json(self) -> dict[str, Any]:
        """Return the values as plain data."""
        values = asdict(self)
        tension = {"value": values.pop("largest"), "at": values.pop("at")}
        parts = [{"begin": begin, "end": end} for begin, end in self.parts]
        return {**values, "parts": parts, "largest_tension": tension}


def lift_offs(motion: Motion, cams: Sequence[CamFindings]) -> Iterator[LiftOff]:
    """Yield the contacts of cams that would have to pull during a motion with forces.

    A lever of which no contact is known has no sense in which it is pressed, so it is left out.
    """
    for cam in cams:
        if cam.cam is None:
            continue
        (name,) = names_of_rows(cam.cam.joint)
        sense = pressing_sign(cam.cam)
        history = motion.history(name)
        if sense < 0:
            history = history.negative()
        if not history.is_known:
            continue
        low, high = history.extremes()
        if -float(low.value) <= _ROUNDING * max(-float(low.value), float(high.value)):
            continue
        unit = motion.mechanism.length_unit
        parts = _negative_parts(history)
        direction = 0 if motion.drive is None else _direction(motion.drive)
        driven_at = motion.driven_at if direction else np.asarray
        driven = [driven_at(np.array(part)[:: direction or 1]).tolist() for part in parts]
        yield LiftOff(
            joint=cam.joint,
            force=name,
            sense=sense,
            unit=unit_of(name.quantity, unit),
            driver=motion.driver if direction else TIME,
            at_unit=unit_of(motion.driver_quantity, unit) if direction else "s",
            parts=tuple((begin, end) for begin, end in driven[:: direction or 1]),
            extent=_extent(motion, history, parts),
            largest=-float(low.value),
            at=float(driven_at(np.asarray(low.x))),
        )


def _direction(drive: History) -> int:
    """Return 1 if the driver's value never falls, -1 if it never grows, 0 if it turns back."""
    least = _ROUNDING * float(np.abs(drive.rate).max())
    falls, grows = bool(np.any(drive.rate < -least)), bool(np.any(drive.rate > least))
    return 0 if falls and grows else -1 if falls else 1


def _negative_parts(history: History) -> list[tuple[float, float]]:
    """Return the parts of a motion in which a quantity is negative, from argument to argument."""
    crossings = np.sort(history.crossings(np.asarray(0.0))[1])
    ends = [float(history.x[0]), *crossings.tolist(), float(history.x[-1])]
    parts = [(a, b) for a, b in pairwise(ends) if b > a and history.at(np.array([0.5 * (a + b)]))[0] < 0]
    if history.is_closed and len(parts) > 1 and parts[0][0] == ends[0] and parts[-1][1] == ends[-1]:
        parts = [*parts[1:-1], (parts[-1][0], parts[0][1])]  # one part goes on past the end
    return parts


def _extent(motion: Motion, history: History, parts: list[tuple[float, float]]) -> str:
    """Return the extent of the negative parts, as in LiftOff."""
    if parts != [(float(history.x[0]), float(history.x[-1]))]:
        return "part"
    travel = motion.driven_between(history.x[0], history.x[-1])
    is_turn = motion.driver_quantity.kind == "angle" and travel > math.tau - _ROUNDING
    return "turn" if is_turn else "motion"
