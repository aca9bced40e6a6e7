"""Trial: one random mechanism over random steps, judged sample by sample."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

import kinfmu
from kinfmu import Run
from kinfmu.codegen.python import load_model
from kinfmu.errors import AmbiguousStartError
from kinfmu.plan import compile_plan
from tests.stress.branch import INSIDE, OUTSIDE, TURN, BranchPath, Expected, Floats, Interval, branch_of
from tests.stress.drawn import Drawn, Frame
from tests.stress.families import FAMILIES, STARTS_ANYWHERE, Draw, RedrawError
from tests.stress.jets import DIGITS, SCREENING, Numbers
from tests.stress.patterns import Started, drawn_steps, started

EPS = np.finfo(float).eps
WRONG = 1e-9  # of the column's largest magnitude
ROUNDINGS = 64.0  # of the driver values: what they change in the exact motion, an `ok` sample may be off by, too
SUMS = 4.0  # roundings of the largest driver value, or of a turn: begin, periods and segments of a law are taken off it
TIGHT = 4e-6  # where what must stay positive falls below on the way, `outside` is an answer too
NARROW = 0.015  # [rad]; change points that turn in less are too narrow for a bridge: `outside` is accepted too
NEAR_LIMIT = 4e-3  # [rad, lengths]; the same this close to a limit: four half widths of the narrowest bridge
AT = 1e-9  # [rad, lengths]; samples as close to such a change point count as those behind it
BEYOND = 10.0  # times its own estimate: the largest error of a flagged sample
SHARE = 0.01  # of the samples are judged by 50 digits in any case
SINGULAR = 1e-6  # product of what must stay positive; below, long doubles lose the digits that errors are judged by
AGREED = 0.1  # the two oracles may differ by this part of the error, or of what counts as wrong
STARTS = 64
MANY = 400  # least number of samples for the native engine, which solves many at once
FAR_SHARE, OFF_ORIGIN_SHARE = 0.05, 0.2  # of the mechanisms are a million lengths, or a few, from the origin
AMBIGUOUS = 1e-4  # sine at the start of a law below which AmbiguousStartError is accepted
SAME = 1e-3  # [rad, lengths]; a pose at a larger distance is another assembly
CLEAR = 0.1  # least sine of the angle between bars where assemblies are distinguished
MEETING = 0.3  # least sine of the angle under which bars meet at the start
DIRECTIONS = ((1, 0), (0, 1), (-1, 0), (Fraction(3, 5), Fraction(4, 5)), (Fraction(-7, 25), Fraction(24, 25)))
ORDERS = ("q", "qd", "qdd")


class Fault(NamedTuple):
    """What is wrong with a sample, or with the whole mechanism (sample -1)."""

    kind: str
    sample: int
    text: str


@dataclass
class Verdict:
    """What a trial showed."""

    seed: int
    family: str
    patterns: Sequence[str]
    statuses: NDArray[np.int64]
    side: NDArray[np.int64]
    relative: Floats  # (n, 3) error of q, qd, qdd, each column relative to its magnitude; NaN where there is no number
    absolute: Floats  # (n, 3) the same relative to the size for lengths, in radians for angles: as estimates are
    estimate: Floats  # (n, 3)
    spared: int  # samples reported unreachable behind a place too tight
    narrow: int  # the same behind a change point too narrow, or too close to a limit
    blurred: int  # `ok` samples with a larger error than WRONG, which a few roundings of the driver values cause, too
    digits: int  # samples that were judged by 50 digits
    gap: float  # largest difference of the two oracles, as a part of what is judged
    refused: bool = False  # as ambiguous, at a singular start
    other: bool = False  # another assembly: the start poses do not determine which
    faults: list[Fault] = field(default_factory=list)


@dataclass
class Trial:
    """A drawn mechanism, its branch, and the samples asked for."""

    seed: int
    family: str
    drawn: Drawn
    branch: Interval | BranchPath
    patterns: Sequence[str]
    inputs: tuple[Floats, Floats, Floats]  # (n, d) each: values, speeds, accelerations
    engine: Literal["python", "native"] = "python"
    started: Started | None = None  # where the law starts, if not where the branch does

    def run(self) -> tuple[Run, float]:
        """What kinfmu says to it, and the size that it measures errors by."""
        plan = compile_plan(self.drawn.mechanism)
        names = [driver.inputs for driver in plan.drivers]
        given = {names[k][order]: table[:, k] for order, table in enumerate(self.inputs) for k in range(len(names))}
        return kinfmu.solve(plan, engine=self.engine, **given), load_model(plan).SIZE

    def judged(self) -> Verdict:
        """Return kinfmu's run, to be compared with the closed forms."""
        n = len(self.inputs[0])
        nothing = np.full((n, 3), np.nan)
        none = np.full(n, -1)
        verdict = Verdict(self.seed, self.family, self.patterns, none, none, nothing, nothing, nothing, 0, 0, 0, 0, 0.0)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                run, size = self.run()
        except AmbiguousStartError as error:
            if self._is_singular_at_start():
                verdict.refused = True  # several branches are as near as that: the message lists them
            else:
                verdict.faults.append(Fault("raised", -1, f"{type(error).__name__}: {error}"))
            return verdict
        except Exception as error:  # whatever it is, it is a fault, and the next mechanism goes on
            verdict.faults.append(Fault("raised", -1, f"{type(error).__name__}: {error}"))
            return verdict
        verdict.statuses, verdict.estimate = run.status, run.error
        expected = self.branch.expected(self.inputs[0], run.good)
        verdict.side = expected.side
        if self.started is not None and not self._is_on_the_branch(run, expected):
            if self._is_clear():
                verdict.faults.append(Fault("another assembly", 0, "the start poses are nearer to that of the oracle"))
            verdict.other = True
            return verdict
        self._judge_status(run, expected, verdict)
        which = np.flatnonzero(run.good & (expected.side == INSIDE))
        if len(which) == 0:
            return verdict
        relative, absolute = self._errors(SCREENING, run, expected, which, size)
        verdict.relative, verdict.absolute = nothing.copy(), nothing.copy()
        verdict.relative[which], verdict.absolute[which] = relative, absolute
        self._confirm(run, expected, which, size, verdict)
        self._judge_errors(run, expected, verdict)
        return verdict

    def _sine_at_start(self) -> float:
        """Least sine of the angle under which bars meet at the start of the law."""
        assert self.started is not None
        sines = self.drawn.positions(self.started.law_start[None]).closing.sines
        return min(abs(float(np.atleast_1d(sine)[0])) for sine in sines)

    def _is_singular_at_start(self) -> bool:
        return self.started is not None and self._sine_at_start() < AMBIGUOUS

    def _is_clear(self) -> bool:
        """True if the start poses distinguish the assemblies: noise is small against what lies between them."""
        assert self.started is not None
        return not self.started.is_there or self._sine_at_start() > MEETING

    def _is_on_the_branch(self, run: Run, expected: Expected) -> bool:
        """True if the first sample that distinguishes the assemblies is the oracle's pose; or if there is none."""
        with np.errstate(all="ignore"):
            exact = self.drawn.positions(self.inputs[0])
        sines = np.minimum.reduce([np.abs(np.asarray(sine, dtype=float)) for sine in exact.closing.sines])
        which = np.flatnonzero(run.good & (expected.side == INSIDE) & (sines > CLEAR))
        unit = float(self.drawn.frame.scale)
        for name in run.outputs if len(which) else ():
            k = which[0]
            there = float(np.broadcast_to(exact.columns[name].d0, sines.shape)[k])
            if name.endswith(".phi"):
                there += TURN * round((float(expected.angles[name][k]) - there) / TURN)
            off = float(run[name][k]) - there
            if abs(off) > SAME * (1.0 if name.endswith(".phi") else unit):
                return False
        return True

    def _judge_status(self, run: Run, expected: Expected, verdict: Verdict) -> None:
        start = self.drawn.positions(np.array([self.drawn.start]))
        is_narrow = bool(self.branch.marks) and min(start.closing.widths, default=np.inf) < NARROW
        holes = np.isnan(run.values) | np.isnan(run.rates) | np.isnan(run.accelerations)
        for k, status in enumerate(run.status):
            if run.good[k] and holes[k].any():
                verdict.faults.append(Fault("NaN", k, f"status {status}"))
            if not run.good[k] and not holes[k].all():
                verdict.faults.append(Fault("numbers without a status", k, f"status {status}"))
            if run.good[k] and expected.side[k] == OUTSIDE:
                verdict.faults.append(Fault("past a limit", k, f"status {status}"))
            if not run.good[k] and expected.side[k] == INSIDE:
                if expected.tightest[k] < TIGHT:
                    verdict.spared += 1
                elif is_narrow or self._is_behind_a_crowded_change_point(float(self.inputs[0][k, 0])):
                    verdict.narrow += 1
                else:
                    verdict.faults.append(Fault("reported unreachable", k, f"status {status}"))
            if not run.good[k] and status != 3:
                verdict.faults.append(Fault("not outside", k, f"status {status}"))

    def _is_behind_a_crowded_change_point(self, x: float) -> bool:
        """True if between the start and a driver value branches cross so close to the limit that no bridge fits."""
        if not isinstance(self.branch, Interval):
            return False
        branch, unit = self.branch, 1.0 if self.drawn.sketch.kinds == ("angle",) else float(self.drawn.frame.scale)
        for mark in branch.marks:
            after, before = branch.high_is_limit and x > mark - AT * unit, branch.low_is_limit and x < mark + AT * unit
            left = min(branch.high - mark if after else np.inf, mark - branch.low if before else np.inf)
            if left < NEAR_LIMIT * unit:
                sines = self.drawn.positions(np.array([[mark]])).closing.sines
                return min(abs(float(np.atleast_1d(sine)[0])) for sine in sines) < 1e-12
        return False

    def _errors(
        self, numbers: Numbers, run: Run, expected: Expected, which: NDArray[np.int64], size: float
    ) -> tuple[Floats, Floats]:
        """(len(which), 3) largest errors of q, qd, qdd: of the columns' magnitudes, and as estimates are measured."""
        u, ud, udd = (table[which] for table in self.inputs)
        with np.errstate(all="ignore"):
            columns = self.drawn.exactly(numbers, u, ud, udd).columns
        found = [np.zeros((len(which), 3)), np.zeros((len(which), 3))]
        for name in run.outputs:
            column = columns[name]
            is_angle = name.is_angle
            for order, exact in enumerate((column.d0, column.d1, column.d2)):
                exact = np.broadcast_to(exact, (len(which),))
                ours = numbers.array(run[name.derivative(order)][which])
                error = ours - exact
                if is_angle and order == 0:
                    principal = np.asarray(exact, dtype=float)
                    turns = np.rint((expected.angles[name][which] - principal) / TURN)
                    error = error - numbers.array(turns) * (2 * numbers.pi)
                off = np.abs(np.asarray(error, dtype=float))
                off = np.where(np.isnan(off), np.inf, off)
                most = np.fmax(self._largest(name, order, ud, udd), np.abs(np.asarray(exact, dtype=float)))
                with np.errstate(all="ignore"):
                    part = off / most
                found[0][:, order] = np.fmax(found[0][:, order], np.where(off == 0.0, 0.0, part))
                found[1][:, order] = np.fmax(found[1][:, order], off if is_angle else off / size)
        return found[0], found[1]

    def _largest(self, name: str, order: int, ud: Floats, udd: Floats) -> Floats:
        """(n,) the largest magnitude that a column, or its derivative of an order, has at these speeds."""
        drive, more = np.abs(ud).max(axis=1), np.abs(udd).max(axis=1)
        large = self.branch.magnitudes
        if order == 0:
            return np.full(len(drive), large.q[name])
        return large.qd[name] * drive if order == 1 else large.qdd[name] * drive * drive + large.qd[name] * more

    def _rounded(self, k: int, outputs: Iterable[str]) -> Floats:
        """(3,) how much rounding may change q, qd, qdd of a sample, as errors are measured.

        Roundings of its driver values, and those of the sums in which a law takes them, or a solved angle, in which
        small values are rounded as large ones. Where a rise ends, all rests beyond: a few roundings of the sums reach
        into the rise.
        """
        sketch = self.drawn.sketch
        turns = [TURN if kind == "angle" else 0.0 for kind in sketch.kinds]
        largest = np.fmax(np.abs(self.inputs[0]).max(axis=0), turns)
        of_sums = self._changes(k, outputs, SUMS * EPS * largest)
        of_values = ROUNDINGS * self._changes(k, outputs, np.spacing(self.inputs[0][k]))
        return np.fmax(np.fmax(of_sums, of_values), self._changes(k, outputs, 0.0 * largest, float(SUMS * EPS * TURN)))

    def _changes(self, k: int, outputs: Iterable[str], shifts: Floats, later: float = 0.0) -> Floats:
        """(3,) how much shifts of the driver values, or of the law, change q, qd, qdd of a sample: up or down, what
        changes more.
        """
        here = self._exact(k, 0.0 * shifts)
        steps = [(shift, 0.0) for shift in np.diag(shifts) if shift.any()] + [(0.0 * shifts, later)]
        sides = [[self._exact(k, sign * shift, sign * by) for sign in (1.0, -1.0)] for shift, by in steps]
        changes = np.zeros(3)
        for name in outputs:
            for order, value in enumerate(here[name]):
                change = sum(max(abs(float(side[name][order] - value)) for side in pair) for pair in sides)
                scale = max(self._largest(name, order, *self._rates(k))[0], abs(float(value)))
                changes[order] = max(changes[order], change / scale if change else 0.0)
        return changes

    def _rates(self, k: int) -> tuple[Floats, Floats]:
        """(1, d) speeds and accelerations of the drivers at a sample."""
        return self.inputs[1][[k]], self.inputs[2][[k]]

    def _exact(self, k: int, shift: Floats, later: float = 0.0) -> dict[str, tuple[Any, Any, Any]]:
        """The exact q, qd, qdd of a sample, with shifted driver values, and a law that begins later."""
        drawn = self.drawn
        if later and drawn.sketch.later is not None:
            drawn = replace(drawn, sketch=replace(drawn.sketch, poses=drawn.sketch.later(later)))
        columns = drawn.exactly(DIGITS, self.inputs[0][[k]] + shift, *self._rates(k)).columns
        return {name: tuple(np.ravel(part)[0] for part in (jet.d0, jet.d1, jet.d2)) for name, jet in columns.items()}

    def _confirm(self, run: Run, expected: Expected, which: NDArray[np.int64], size: float, verdict: Verdict) -> None:
        """A share of the samples, all that look wrong and all where long doubles do not decide are judged again by 50
        digits, which then count. Where long doubles decide, the two must agree.
        """
        rng = np.random.default_rng(self.seed)
        decided = self._long_doubles_decide(self.inputs[0][which])
        suspect = (verdict.relative[which] > 0.1 * WRONG).any(axis=1) | ~decided
        chosen = suspect | (rng.uniform(size=len(which)) < SHARE)
        again, decided = which[chosen], decided[chosen]
        if len(again) == 0 or SCREENING is DIGITS:
            verdict.digits = len(which) if SCREENING is DIGITS else 0
            return
        relative, absolute = self._errors(DIGITS, run, expected, again, size)
        first = verdict.relative[again]
        with np.errstate(invalid="ignore"):  # where both are infinite
            gaps = np.where(relative == first, 0.0, np.abs(relative - first) / np.fmax(relative, WRONG))
        verdict.gap = float(gaps[decided].max(initial=0.0))
        verdict.relative[again], verdict.absolute[again] = relative, absolute
        verdict.digits = len(again)
        for k in again[(gaps > AGREED).any(axis=1) & decided]:
            verdict.faults.append(Fault("the oracles differ", int(k), f"by {verdict.gap:.1g}"))

    def _long_doubles_decide(self, u: Floats) -> NDArray[np.bool_]:
        """False where samples (n, d) lie so close to a limit that few digits are left of what must stay positive.

        There the error of qdd is a rounding over the product of these.
        """
        with np.errstate(all="ignore"):
            limits = self.drawn.positions(u).closing.limits
        product = np.ones(len(u))
        for limit in limits:
            product *= np.clip(np.asarray(limit, dtype=float), 0.0, 1.0)
        return product >= SINGULAR

    def _judge_errors(self, run: Run, expected: Expected, verdict: Verdict) -> None:
        for k in np.flatnonzero(run.good & (expected.side == INSIDE)):
            for order, name in enumerate(ORDERS):
                error, absolute = verdict.relative[k, order], verdict.absolute[k, order]
                if error <= WRONG:
                    continue
                estimate = run.error[k, order]
                finding = f"{name} wrong by {error:.2g} (estimate {estimate:.2g}, true {absolute:.2g})"
                if run.status[k] == 0:
                    if error <= self._rounded(int(k), run.outputs)[order]:
                        verdict.blurred += 1
                    else:
                        verdict.faults.append(Fault("wrong with status ok", int(k), finding))
                    break
                if not absolute <= BEYOND * estimate:
                    verdict.faults.append(Fault("beyond its estimate", int(k), f"status {run.status[k]}, {finding}"))
                    break


def trial(seed: int, family: str | None = None, engine: Literal["python", "native"] = "python") -> Trial:
    """The trial of a seed, of any family or of one, for an engine."""
    rng = Draw(seed)
    drawn_family = rng.choices(list(FAMILIES), [weight for _, weight in FAMILIES.values()])[0]
    family = family or drawn_family
    while True:
        try:
            drawn = _drawn(rng, family)
            branch = branch_of(drawn)
        except (RedrawError, ZeroDivisionError, ValueError):
            continue
        break
    begun = started(rng, branch) if family == STARTS_ANYWHERE else None
    names, u = drawn_steps(rng, branch)
    if begun is not None:
        drawn, u = begun.drawn, np.concatenate([begun.law_start[None], u])
    while engine == "native" and len(u) < MANY:
        others, more = drawn_steps(rng, branch)
        names, u = [*names, *(other for other in others if other not in names)], np.concatenate([u, more])
    generator = np.random.default_rng(rng.getrandbits(64))
    units = [1.0 if kind == "angle" else float(drawn.frame.scale) for kind in drawn.sketch.kinds]
    ud = generator.uniform(0.3, 1.5, u.shape) * generator.choice((1.0, -1.0), u.shape) * units
    udd = generator.uniform(-1.0, 1.0, u.shape) * units
    return Trial(seed, family, drawn, branch, names, (u, ud, udd), engine, begun)


def _drawn(rng: Draw, family: str) -> Drawn:
    chance = rng.random()
    rng.finest = 8 if chance < FAR_SHARE else 11
    sketch = FAMILIES[family][0](rng)
    scale = Fraction(10) ** (rng.randint(-6, 6) if rng.random() < 0.25 else 0)
    direction = rng.choice(DIRECTIONS) if rng.random() < 0.5 else DIRECTIONS[0]
    direction = DIRECTIONS[0] if sketch.is_level else direction
    at = (Fraction(0), Fraction(0))
    if chance < FAR_SHARE:  # as decimal numbers, which kinfmu takes them for
        scale, direction = Fraction(1), DIRECTIONS[0]
        at = (Fraction(rng.randint(-2_000_000, 2_000_000)), Fraction(rng.randint(-1_000_000, 1_000_000)))
    elif chance < OFF_ORIGIN_SHARE:
        at = (scale * Fraction(rng.randint(-2000, 2000), 1000), scale * Fraction(rng.randint(-9, 9), 8))
    frame = Frame(scale, (Fraction(direction[0]), Fraction(direction[1])), at)
    low, high = sketch.reach
    units = [1.0 if kind == "angle" else float(scale) for kind in sketch.kinds]
    candidates = np.array([[round(rng.uniform(low, high), 2) for _ in units] for _ in range(STARTS)]) * units
    if not sketch.period:
        candidates = candidates + frame.angle
    drawn = Drawn(sketch, frame, tuple(candidates[0]))
    with np.errstate(all="ignore"):
        closing = drawn.positions(candidates).closing
        good = np.minimum.reduce([np.abs(np.asarray(s, dtype=float)) for s in closing.sines]) > MEETING
    if not good.any():
        raise RedrawError
    return Drawn(sketch, frame, tuple(float(value) for value in candidates[int(np.argmax(good))]))


def judged(task: tuple[int, str | None, Literal["python", "native"]]) -> Verdict:
    """The verdict on a seed, a family and an engine, for processes that share the work."""
    return trial(*task).judged()
