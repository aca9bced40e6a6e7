"""Efforts and reactions of a mechanism with masses or loads over the motion that measures are taken of.

Samples are 360 in a turn of the driver, or those of the file's run. Peaks lie between them where the polynomials that
measures use place them, to 1e-9 where forces are smooth. Where samples have no numbers, peaks are those of the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from kinfmu.analysis.cams import CamFindings
from kinfmu.analysis.lift_off import LiftOff, lift_offs
from kinfmu.analysis.measuring import SAMPLES_PER_TURN, turns_of_cycle
from kinfmu.analysis.singular import DriverRange
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.joints.cam import Cam
from kinfmu.laws import ConstantSpeed, External
from kinfmu.mechanism import Mechanism
from kinfmu.motion.motion import Motion, break_places, force_of
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import effort_noun
from kinfmu.plan.undetermined import shared_reactions, unknown_contacts, why_unknown
from kinfmu.run import FloatArray, Run
from kinfmu.run.axis import axis_of
from kinfmu.sweep import solve
from kinfmu.units import unit_of

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
class InertiaRange:
    """The smallest and the largest value of a reduced inertia."""

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
class Loading:
    """Forces over a motion.

    over: the motion, as text; efforts: of each driver; inertias: reduced; reaction: the joint that transmits the
    largest determined force; shaking: force and moment on the ground; undetermined: reactions that share a load, with
    the rows that share it; reason: why there are no numbers, '' if there are; missing: samples without numbers;
    lift_offs: contacts of cams that would have to pull; unknown_contacts: contacts of cams without a known direction.
    """

    over: str
    efforts: tuple[ForcePeak, ...] = ()
    inertias: tuple[InertiaRange, ...] = ()
    reaction: ForcePeak | None = None
    shaking: tuple[ForcePeak, ...] = ()
    undetermined: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = ()
    reason: str = ""
    missing: int = 0
    lift_offs: tuple[LiftOff, ...] = ()
    unknown_contacts: tuple[UnknownContact, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the forces as plain data."""
        return {
            "over": self.over,
            "efforts": [asdict(effort) for effort in self.efforts],
            "reduced_inertias": [asdict(inertia) for inertia in self.inertias],
            "largest_reaction": None if self.reaction is None else asdict(self.reaction),
            "shaking": [asdict(peak) for peak in self.shaking],
            "undetermined": [{"reactions": list(names), "rows": list(rows)} for names, rows in self.undetermined],
            "unknown_contacts": [asdict(one) | {"reactions": list(one.reactions)} for one in self.unknown_contacts],
            "lift_offs": [one.as_json() for one in self.lift_offs],
            "reason": self.reason or None,
            "samples_without_numbers": self.missing,
        }


def loading(plan: SolvePlan, ranges: Sequence[DriverRange], cams: Sequence[CamFindings] = ()) -> Loading | None:
    """Return the forces of a mechanism over its motion; None without masses and loads.

    A single driver with a constant speed, or without a law, that turns all the way round makes one cycle, without a law
    at 1 rad/s; any other motion is the run of the file.

    Args:
        plan: The plan of the mechanism.
        ranges: Ranges of its drivers.
        cams: Its cams.

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
        arguments, over = _motion(mechanism, ranges)
        run = _with_breaks(solve(mechanism, **arguments), mechanism, arguments)
        over = over or f"the run of the file, {axis_of(run).range()}"
        missing = int((~run.good).sum())
        if missing == len(run):
            return Loading(over, reason="no sample has numbers", missing=missing)
        forces = _Forces(run)
        efforts = tuple(map(forces.peak, _efforts(mechanism)))
        inertias, shaking = tuple(forces.inertias()), tuple(map(forces.peak, ("shaking_force", "shaking_moment")))
        reaction, lifts = forces.largest_reaction(), forces.lift_offs(cams)
        return Loading(over, efforts, inertias, reaction, shaking, missing=missing, lift_offs=lifts)
    except KinfmuError as reason:
        return Loading("no motion", reason=str(reason))


def _motion(mechanism: Mechanism, ranges: Sequence[DriverRange]) -> tuple[dict[str, Any], str]:
    """Return the motion as `solve` takes it, over time where a law gives it, since laws of loads may need times."""
    if len(mechanism.drivers) != 1 or not ranges or ranges[0].turns is None:
        return {}, ""
    (driver,), turns = mechanism.drivers, turns_of_cycle(mechanism, ranges[0].turns)
    count = "one turn" if turns == 1 else f"{turns} turns"
    angle, speed_name, _ = driver.inputs()
    turned = np.linspace(0.0, turns * math.tau, turns * SAMPLES_PER_TURN + 1)
    if isinstance(driver.law, External):
        start = float(driver.law.at(mechanism.run.start))
        return {angle: start + turned, speed_name: 1.0}, f"{count} of {driver.name} at 1 rad/s"
    if isinstance(driver.law, ConstantSpeed) and (speed := float(driver.law.speed)):
        unit = unit_of(speed_name.quantity, mechanism.length_unit)
        times = mechanism.run.start + turned / abs(speed)
        return {"t": times}, f"{count} of {driver.name} at {speed:.6g} {unit}"
    return {}, ""


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


def _efforts(mechanism: Mechanism) -> list[str]:
    return [f"{driver.name}.{effort_noun(driver.quantity.kind)}" for driver in mechanism.drivers]


class _Forces:
    """Forces of a run: their extremes between the samples."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._motion: Motion | None = None  # without it extremes are those of samples
        with suppress(RequestError):  # too few samples, or they are not in the order of one argument
            self._motion = Motion.of_run(run, with_margin=False)

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
        return ForcePeak(name, value, unit, driver, at, at_unit, _rms(run, force_of(run, name)))

    def inertias(self) -> Iterator[InertiaRange]:
        """Yield the ranges of the reduced inertias."""
        for name in self._run.force_names:
            if name.noun.startswith("reduced_inertia") and np.isfinite(self._run[name]).any():
                (low, _), (high, _) = self._extremes(name)
                yield InertiaRange(name, low, high, unit_of(name.quantity, self._run.length_unit))

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
        run, values = self._run, force_of(self._run, name)
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
