"""The generated model with other rules for when Newton stops."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks import stopping
from benchmarks.engine import EngineSetting
from benchmarks.stopping import model_with
from kinfmu.codegen.python import load_model
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.gallery import load
from kinfmu.plan import SolvePlan, compile_plan

every_kind = pytest.mark.parametrize("name", ["slider_crank", "crank_rocker", "stephenson_six_bar", "jansen_leg"])


def plan_of(name: str) -> SolvePlan:
    return compile_plan(load(name))


def position_nearby(model: Any, off: float = 0.05) -> tuple[Any, ...]:
    """What `position` finds where every unknown starts a bit off."""
    u, z = model.ANCHOR
    rest = (0.0,) * len(z)
    return model.position(u, tuple(value + off for value in z), rest, rest, 0.0)  # type: ignore[no-any-return]


@every_kind
@pytest.mark.few(2)
def test_round_off_is_the_shipped_rule_to_the_bit(name: str) -> None:
    found, shipped = (
        position_nearby(model) for model in (model_with(plan_of(name), EngineSetting()), load_model(plan_of(name)))
    )
    assert found[:7] == shipped[:7]


@every_kind
@pytest.mark.parametrize("corrections", [0, 1, 2, 3])
@pytest.mark.few(7)
def test_a_fixed_number_of_corrections_is_made_in_every_block(name: str, corrections: int) -> None:
    plan = plan_of(name)
    found = position_nearby(model_with(plan, EngineSetting(corrections=corrections)))
    assert found[4] == corrections * sum(bool(block.unknowns) for block in plan.blocks)


@every_kind
@pytest.mark.few(2)
def test_each_correction_brings_the_residual_down_and_newton_faster_than_chord(name: str) -> None:
    plan = plan_of(name)
    full = [position_nearby(model_with(plan, EngineSetting(corrections=n)))[3] for n in range(4)]
    chord = [position_nearby(model_with(plan, EngineSetting(corrections=n, chord=True)))[3] for n in range(4)]
    assert full[:2] == chord[:2]  # the first correction is the same
    for k in (1, 2):
        assert full[k + 1] < 0.05 * full[k]
        assert full[k + 1] < chord[k + 1] < chord[k]


@every_kind
@pytest.mark.few(2)
def test_correcting_ends_at_the_tolerance_and_not_long_after(name: str) -> None:
    plan = plan_of(name)
    counts = []
    for tolerance in (1e-3, 1e-6, 1e-9):
        found = position_nearby(model_with(plan, EngineSetting(tolerance=tolerance)))
        assert found[3] <= tolerance
        counts.append(found[4])
    shipped = position_nearby(load_model(plan))[4]
    assert counts[0] < shipped
    assert counts == sorted(counts)
    assert counts[-1] <= shipped


@every_kind
def test_chord_newton_ends_at_the_same_pose_with_the_rates_of_that_pose(name: str) -> None:
    plan = plan_of(name)
    chord, full = model_with(plan, EngineSetting(chord=True)), load_model(plan)
    found, exact = position_nearby(chord), position_nearby(full)
    assert found[4] > exact[4]
    assert found[0] == pytest.approx(exact[0], rel=0, abs=1e-12)
    tangent, exact_tangent = chord.tangent(found[-1]), full.tangent(exact[-1])
    for ours, theirs in zip(tangent, exact_tangent, strict=True):
        assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10)


def test_code_without_the_loop_that_is_known_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    source = stopping.emit(plan_of("crank_rocker"))
    monkeypatch.setattr(stopping, "emit", lambda _: source.replace("for iteration in", "for attempt in"))
    with pytest.raises(KinfmuError, match=r"crank_rocker: the generated code has no loop `for iteration in range"):
        model_with(plan_of("crank_rocker"), EngineSetting())
    monkeypatch.setattr(stopping, "emit", lambda _: source.replace("if error <=", "if last > 0.0 or error <="))
    with pytest.raises(KinfmuError, match=r"stops by another rule than is known here: last > 0\.0 or error"):
        model_with(plan_of("crank_rocker"), EngineSetting())
