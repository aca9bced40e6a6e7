"""The stress suite in short, and that its oracle and its judgement are right."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from kinfmu import Run
from kinfmu.plan.equations.system import System
from tests import oracle
from tests.stress import families
from tests.stress.drawn import Drawn, Frame
from tests.stress.families import FAMILIES, Draw
from tests.stress.jets import DIGITS, LONG
from tests.stress.report import Report
from tests.stress.trial import Trial, trial

ROOT = Path(__file__).parents[2]
MECHANISMS = 4  # of each family


@pytest.mark.parametrize("family", FAMILIES)
def test_random_mechanisms_over_random_steps_are_right_or_say_why_not(family: str) -> None:
    for seed in range(MECHANISMS):
        assert trial(seed, family).judged().faults == [], f"scripts/stress --family '{family}' --seed {seed}"


@pytest.mark.parametrize("family", FAMILIES)
def test_so_they_are_by_the_native_engine(family: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    command = f"scripts/stress --engine native --family '{family}' --seed 1"
    assert trial(1, family, "native").judged().faults == [], command


@pytest.mark.parametrize(("seed", "family"), [(136, "pins in slots"), (299, "near change points")])
def test_a_sample_solved_in_one_order_and_not_in_another_has_an_estimate(
    seed: int, family: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """At a limit the order of the samples decides: errors are estimated in the order in which samples were solved."""
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    assert trial(seed, family, "native").judged().faults == []


@pytest.mark.parametrize(
    ("engine", "seed"),
    [
        *(("python", seed) for seed in (36, 46, 68, 252, 530)),
        *(("native", seed) for seed in (68, 1055, 1114, 1197)),
    ],
)
def test_estimates_count_the_rounding_of_arguments_of_laws(
    engine: Literal["python", "native"], seed: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    """What is off by less than the rounding of its column's largest magnitude does not count."""
    verdict = trial(seed, "led by laws", engine).judged()
    known = ~np.isnan(verdict.absolute)
    assert verdict.faults == []
    is_rounding = verdict.relative[known] <= np.finfo(float).eps
    assert (is_rounding | (verdict.absolute[known] <= verdict.estimate[known])).all()


@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_path_through_a_short_stretch_that_does_not_close_ends_there(
    engine: Literal["python", "native"], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A machine bends the path of a robot beyond its reach, by 6.5e-4, in the middle of a step."""
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    one = trial(911, "machines with a robot", "native")
    one.engine = engine
    verdict = one.judged()
    assert verdict.statuses[260] == 3
    assert verdict.faults == []


def test_at_a_crossing_without_a_bridge_the_rates_are_not_known() -> None:
    """3e-3 rad from a limit no bridge fits; on the crossing itself the rates are those of neither branch."""
    one = replace(trial(236, "watt six-bars", "native"), engine="python")
    verdict = one.judged()
    assert verdict.faults == []
    (crossing, _) = one.branch.marks  # type: ignore[union-attr]
    there = (np.abs(one.inputs[0][:, 0] - crossing) < 1e-9) & (verdict.statuses == 1)
    assert there.any()
    assert np.isinf(verdict.estimate[there][:, 1:]).all()


def test_a_loop_that_falls_in_line_inside_a_larger_block_keeps_its_smooth_branch() -> None:
    """There a whole row of the block's Jacobian vanishes and turns round, which rows of unit length would hide."""
    assert trial(2548, "six-bars driven at the end").judged().faults == []


@pytest.mark.parametrize("seed", [3263, 3583, 6731, 7940])
def test_a_near_change_point_that_falls_steeply_is_not_bridged(seed: int) -> None:
    """Half a width from it the block is regular; it is interpolated all the same, and must be shown to close."""
    assert trial(seed, "near change points").judged().faults == []


def test_a_crossing_1e_3_rad_before_a_limit_is_a_limit_and_counted_as_such() -> None:
    """A rhombus lies flat where the loop on it is about to be stretched: no six nodes of a bridge fit between."""
    verdict = trial(1841, "watt six-bars").judged()
    assert verdict.faults == []
    assert verdict.narrow == 1
    assert verdict.spared == 0


@pytest.mark.parametrize(
    ("seed", "family"),
    [(6838, "stephenson six-bars"), (7342, "watt six-bars"), (7440, "four-bars"), (21356, "near change points")],
)
def test_near_a_limit_samples_are_judged_by_50_digits(seed: int, family: str) -> None:
    """Up to 4e-8 of what must stay positive: long doubles are wrong by as much as counts."""
    assert trial(seed, family).judged().faults == []


@pytest.mark.parametrize(("roundings", "faults"), [(64.0, 0), (1.0, 1)])
def test_an_ok_sample_may_be_off_by_some_roundings_of_its_driver_values(
    roundings: float, faults: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A robot, almost stretched, on a four-bar near its dead centre: the rounding of a residual counts 72 000 times."""
    monkeypatch.setattr("tests.stress.trial.ROUNDINGS", roundings)
    verdict = trial(1322, "machines with a robot", "native").judged()
    assert len(verdict.faults) == faults
    assert verdict.blurred == 1 - faults


@pytest.mark.parametrize(
    ("seed", "engine"),
    [
        (10077, "python"),
        *(
            pytest.param(seed, engine, marks=pytest.mark.long)
            for seed in (10249, 10262)
            for engine in ("python", "native")
        ),
    ],
)
def test_where_a_rise_ends_the_rounding_of_the_argument_of_a_law_counts_to_both_sides(
    seed: int, engine: Literal["python", "native"], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Samples at the ends of rises within 3e-7 rad, some 2.1 roundings beyond: all rests there, before it not."""
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    verdict = replace(trial(seed, "led by laws", "python" if seed == 10077 else "native"), engine=engine).judged()
    assert verdict.faults == []
    assert verdict.blurred >= 1


@pytest.mark.long
@pytest.mark.parametrize(("seed", "engine", "faults"), [(10937, "native", 17), (11571, "python", 8)])
def test_the_argument_of_a_law_is_rounded_as_a_turn_is(
    seed: int, engine: Literal["python", "native"], faults: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """At 0.017 rad begin and period of a law, of some radians, are rounded 256 times as far as the value is. The angle
    of a rocker that turns back within a rise is rounded, but hardly moves where the crank's value is rounded.
    """
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    one = trial(seed, "led by laws", engine)
    assert one.judged().faults == []
    monkeypatch.setattr("tests.stress.trial.SUMS", 0.0)
    assert len(one.judged().faults) == faults


# --------------------------------------------------------------------------------------------------- the oracle


@pytest.mark.parametrize("family", FAMILIES)
def test_closed_forms_close_the_mechanism(family: str) -> None:
    one = trial(3, family)
    drawn = one.drawn
    system = System(drawn.mechanism)
    u, still = np.array([drawn.start]), np.zeros((1, len(drawn.start)))
    columns = drawn.exactly(LONG, u, still, still).columns
    q = np.array([float(columns[name].d0[0]) for name in system.coordinates])
    far = max(1.0, *(abs(float(part)) for part in drawn.frame.at))
    rounding, gap = 1e-14 * far * max(1.0, drawn.frame.scale), drawn.frame.length(abs(drawn.sketch.gap))
    steep = np.abs(system.gaps(np.finfo(float).eps * np.abs(system.jacobian(q)) @ np.abs(q)))  # by the rounding of q
    assert (np.abs(system.gaps(system.residual(q, u[0]))) <= np.maximum(rounding, steep) + gap).all()


@pytest.mark.parametrize("family", FAMILIES)
def test_long_doubles_and_50_digits_agree(family: str) -> None:
    one = trial(1, family)
    good = one.branch.expected(one.inputs[0], np.ones(len(one.inputs[0]), dtype=bool))
    which = np.flatnonzero((good.side == 0) & (good.tightest > 1e-3))[:6]
    inputs = [table[which] for table in one.inputs]
    quick, slow = (one.drawn.exactly(numbers, *inputs) for numbers in (LONG, DIGITS))
    regular = np.minimum.reduce([np.abs(np.asarray(sine, dtype=float)) for sine in quick.closing.sines]) > 0.05
    assert regular.any()
    for name, column in slow.columns.items():
        for order in ("d0", "d1", "d2"):
            exact, long = getattr(column, order), getattr(quick.columns[name], order)
            rounded = np.array([np.longdouble(oracle.mp.nstr(value, 25)) for value in exact])
            off = np.abs(long - rounded)[regular]
            most = np.abs(np.asarray(exact, dtype=float))[regular].max() + float(one.drawn.frame.scale)
            assert off.max() <= 1e-15 * most, (name, order)  # a rounding is 5e-20


@pytest.mark.parametrize("bars", [("4", "1", "3.5", "3"), ("1.2", "2", "1.7", "1.9"), ("2", "1", "2", "1")])
@pytest.mark.parametrize("side", [1, -1])
def test_four_bar_is_that_of_the_other_oracle(bars: tuple[str, str, str, str], side: int) -> None:
    exact = [families.Fraction(bar) for bar in bars]
    angles = np.array([0.3, 1.2, 2.9]) if bars[0] != "1.2" else np.array([0.5, 1.0])
    drawn = Drawn(families.fourbar(exact, "crank", side), Frame(), (0.3,))
    ours = drawn.exactly(DIGITS, angles[:, None], 0 * angles[:, None] + 0.7, 0 * angles[:, None] - 0.4).columns
    theirs = oracle.fourbar(*bars, list(angles), 0.7, -0.4, branch=side)
    for k, name in enumerate(("crank.phi", "coupler.phi", "rocker.phi")):
        for table, order in zip(theirs, ("d0", "d1", "d2"), strict=True):
            gaps = [abs(a - b) for a, b in zip(getattr(ours[name], order), table[:, k], strict=True)]
            assert max(gaps) < 1e-45, (name, order)


@pytest.mark.parametrize("family", ["change points", "crank = rod", "pins in slots", "chains"])
def test_closed_form_goes_on_smoothly_through_its_change_points(family: str) -> None:
    """Across a mark it is what its derivatives on one side say it is on the other."""
    seed = next(s for s in range(100) if trial(s, family).branch.is_free and trial(s, family).branch.marks)  # type: ignore[union-attr]
    one = trial(seed, family)
    mark, h = one.branch.marks[0], 1e-4  # type: ignore[union-attr]
    columns = one.drawn.positions(np.array([[mark - h], [mark + h]])).columns.values()
    there = [c.d0[0] + 2 * h * c.d1[0] + 2 * h * h * c.d2[0] - c.d0[1] for c in columns]
    scale = float(one.drawn.frame.scale)
    turns = np.array([value if abs(value) < 1.0 else value % (2 * np.pi) for value in map(float, there)])
    away = np.minimum(np.abs(turns), np.abs(turns - 2 * np.pi))
    assert away.max() < 1e-6 * max(1.0, scale)


# ------------------------------------------------------------------------------------------------ the judgement


@pytest.fixture(scope="module")
def plain() -> Trial:
    """Of lengths about 1, and right."""
    every = (trial(seed, "redundant parallelograms") for seed in range(50))
    return next(one for one in every if one.drawn.frame == Frame())


def _shifted(run: Run) -> Run:
    values = run.values.copy()
    values[3] += 1e-6
    return replace(run, values=values)


def _holed(run: Run) -> Run:
    rates = run.rates.copy()
    rates[3, 0] = np.nan
    return replace(run, rates=rates)


def _refused(run: Run) -> Run:
    status = run.status.copy()
    status[3] = 3
    gaps = [table.copy() for table in (run.values, run.rates, run.accelerations)]
    for table in gaps:
        table[3] = np.nan
    return replace(run, status=status, values=gaps[0], rates=gaps[1], accelerations=gaps[2])


def _flagged(run: Run) -> Run:
    status, error = run.status.copy(), run.error.copy()
    status[3], error[3] = 1, 1e-15
    return replace(_shifted(run), status=status, error=error)


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        (_shifted, "wrong with status ok"),
        (_holed, "NaN"),
        (_refused, "reported unreachable"),
        (_flagged, "beyond its estimate"),
    ],
)
def test_faults_are_reported(
    monkeypatch: pytest.MonkeyPatch, plain: Trial, change: Callable[[Run], Run], kind: str
) -> None:
    run, size = plain.run()
    assert run.status[3] in (0, 2)
    monkeypatch.setattr(Trial, "run", lambda _: (change(run), size))
    verdict = plain.judged()
    assert {fault.sample for fault in verdict.faults} == {3}
    assert verdict.faults[0].kind == kind
    report = Report()
    report.take(verdict)
    assert not report.is_right
    assert f"{kind}: 1 mechanisms" in report.lines("scripts/stress")


def test_numbers_past_a_limit_are_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    one = next(found for s in range(50) if (found := trial(s, "four-bars")).branch.low_is_limit)  # type: ignore[union-attr]
    run, size = one.run()
    outside = int(np.flatnonzero(run.status == 3)[0])
    status, values = run.status.copy(), np.where(np.isnan(run.values), 0.0, run.values)
    status[outside] = 0
    rates, accelerations = (np.where(np.isnan(table), 0.0, table) for table in (run.rates, run.accelerations))
    lying = replace(run, status=status, values=values, rates=rates, accelerations=accelerations)
    monkeypatch.setattr(Trial, "run", lambda _: (lying, size))
    assert ("past a limit", outside) in {(fault.kind, fault.sample) for fault in one.judged().faults}


def test_command_counts_and_reproduces_one_mechanism() -> None:
    def printed(*arguments: str) -> str:
        return subprocess.run(
            [sys.executable, "-m", "tests.stress", *arguments],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout

    many = printed("--seed", "20", "--count", "4", "--jobs", "2")
    assert "4 mechanisms in" in many
    assert "nothing is wrong" in many
    assert "scripts/stress --seed 2" in many
    one = printed("--seed", "20", "--family", "four-bars")
    assert one.startswith('name = "drawn"')
    assert "seed 20, four-bars" in one


def test_the_next_way_begins_at_the_last_sample_that_was_reached(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A sample behind a place too tight to pass is called unreachable; angles count their turns without it."""
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    assert trial(75, "machines with a robot", "native").judged().faults == []


def test_kinds_of_four_bars_are_what_they_are_called() -> None:
    draw = Draw(1)
    for kind in families.KINDS:
        for _ in range(20):
            bars = families.grashof(draw, kind)
            is_grashof = 2 * (min(bars) + max(bars)) < sum(bars)
            assert (families.KINDS[bars.index(min(bars))] if is_grashof else "triple rocker") == kind


def test_what_is_raised_is_a_fault_of_its_mechanism(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: Trial) -> tuple[Run, float]:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(Trial, "run", fail)
    (fault,) = trial(1).judged().faults
    assert fault == ("raised", -1, "ZeroDivisionError: by zero")
