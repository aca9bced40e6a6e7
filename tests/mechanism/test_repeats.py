"""Repeated parts of mechanism files: what they expand to, the scissor lift's closed form, messages."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import MechanismError
from kinfmu.mechanism.repeats import LARGEST_COUNT, expanded
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text

LIFT = Path(__file__).parents[2] / "examples" / "scissor_lift" / "mechanism.toml"
LIFT_TEXT = LIFT.read_text(encoding="utf-8")


@pytest.mark.parametrize("stages", [1, 2, 7])
def test_a_scissor_lift_of_any_number_of_stages_has_its_closed_form(stages: int) -> None:
    lift = parse(LIFT_TEXT.replace("stages = 4", f"stages = {stages}"))
    assert lift.title == f"Scissor lift with {stages} stages, driven at its foot"
    assert len(lift.moving_bodies) == 2 * stages
    run = kinfmu.solve(lift, np.linspace(0.0, 4.0, 33))
    rate = 0.5 * np.pi
    w, wd, wdd = (
        500.0 * (order == 0) + 80.0 * rate**order * np.sin(rate * run.t + order * np.pi / 2) for order in range(3)
    )
    h = np.sqrt(600.0**2 - w**2)  # of a stage
    hd = -w * wd / h
    hdd = -(wd**2 + w * wdd + hd**2) / h
    for order, exact in enumerate((h, hd, hdd)):
        name = ("top.y", "top.vy", "top.ay")[order]
        np.testing.assert_allclose(run[name], stages * exact, rtol=0, atol=1e-11 * stages * np.abs(exact).max())
    np.testing.assert_allclose(run["top.x"], w, rtol=0, atol=1e-9)


def test_a_mechanism_is_saved_as_expanded_and_read_back_equal(tmp_path: Path) -> None:
    lift = kinfmu.load(LIFT)
    assert "{" not in text(lift).replace("{ ", "")
    kinfmu.save(lift, tmp_path / "lift.toml")
    assert kinfmu.load(tmp_path / "lift.toml") == lift


def test_braces_are_numbers_in_names_texts_and_nested_tables() -> None:
    document = tomllib.loads("""
        title = "{n} pivots"
        counts = { n = 2 }
        [bodies.ground.points]
        O_0 = [0, 0]
        [repeat.i]
        from = 1
        to = "n - 0"
        bodies.ground.points."O_{i}" = ["{i}*a", "{ n + 1 } mm"]
        parameters."b_{i}" = "{i-1}*a"
        [repeat.none]
        from = 3
        to = "n"
        bodies."never_{none}" = {}
    """)
    assert expanded(document) == {
        "title": "2 pivots",
        "bodies": {"ground": {"points": {"O_0": [0, 0], "O_1": ["1*a", "3 mm"], "O_2": ["2*a", "3 mm"]}}},
        "parameters": {"b_1": "0*a", "b_2": "1*a"},
    }


def test_without_counts_and_repeats_braces_are_text() -> None:
    assert parse('name = "a"\ntitle = "one {k}"\nbodies.b = {}').title == "one {k}"


HEAD = "name = 'a'\n"
BAR = "bodies.'bar_{k}' = {}\n"
WRONG = {
    "counts.n = 2.5": "[counts] n = 2.5 must be a whole number from 0 to 10000",
    "counts.n = true": "[counts] n = true must be a whole number from 0 to 10000",
    "counts.n = 'm'": "[counts] n = 'm' must be a whole number",
    "counts.n = 10001": "[counts] n = 10001 must be a whole number from 0 to 10000",
    f"[repeat.k]\n{BAR}": "[repeat.k] needs the key 'to', the last number, such as to = 4",
    f"[repeat.k]\nto = 'stage'\n{BAR}counts.stages = 3": "[repeat.k] counts: unknown key",
    f"counts.stages = 3\n[repeat.k]\nto = 'stage'\n{BAR}": "[repeat.k] to = 'stage' must be a whole number or a "
    "count, such as 'stages'; did you mean 'stages'?; counts: stages",
    f"[repeat.k]\nfrom = 3\nto = 1\n{BAR}": "[repeat.k] to = 1 is below from = 3",
    f"counts.k = 3\n[repeat.k]\nto = 1\n{BAR}": "[repeat.k]: 'k' is the name of a count; use another name",
    "[repeat.k]\nto = 2\nbody.'bar_{k}' = {}": "[repeat.k] body: unknown key; did you mean 'bodies'?",
    "[repeat.k]\nto = 2\nbodies = 3": "[repeat.k] bodies = 3 must be a table [repeat.k.bodies]",
    "[repeat.k]\nto = 2\npoints.P = 'bar.P'": "[repeat.k], k = 2: points.P is there already; a repeated name needs its "
    "number, such as 'P_{k}'",
    "bodies.bar_2.mass = 1\n[repeat.k]\nto = 2\nbodies.'bar_{k}'.mass = 2": "[repeat.k], k = 2: bodies.bar_2.mass is "
    "there already",
    "[repeat.k]\nto = 2\npoints.'P_{k}' = 'bar_{j}.P'": "points.P_1: '{j}' is not a count or the number of a repeat, "
    "such as '{k}' or '{k+1}'; known here: k",
    "[repeat.k]\nto = 2\npoints.'P_{kk}' = 'bar.P'": "[points]: '{kk}' is not a count or the number of a repeat",
    "[repeat.k]\nto = 2\npoints.'P_{k}' = 'bar_{k-2}.P'": "points.P_1: '{k-2}' is -1, and names cannot hold a minus",
    "counts.n = 1\npoints.'P_1' = 'a.b'\npoints.'P_{n}' = 'a.b'": "[points] P_1 is there twice, the second time as "
    "'P_{n}'",
    f"[repeat.k]\nto = 2\n{BAR}joints.'J_{{k}}' = {{ type = 'pin', between = ['a.P', 'b.P'] }}": "[joints.J_1] type = "
    "'pin' is not known; did you mean 'revolute'?",
}


@pytest.mark.parametrize("case", WRONG, ids=range(len(WRONG)))
def test_wrong_repeats_are_reported_with_table_and_key(case: str) -> None:
    with pytest.raises(MechanismError) as caught:
        parse(HEAD + case, "a.toml")
    assert f"a.toml: {WRONG[case]}" in str(caught.value)


@pytest.mark.long
def test_a_small_file_cannot_ask_for_endless_copies() -> None:
    points: dict[str, Any] = {f"P{n}_{{k}}": [0, 0] for n in range(1000)}
    document = {"repeat": {"k": {"to": LARGEST_COUNT, "bodies": {"b_{k}": {"points": points}}}}}
    with pytest.raises(MechanismError, match=r"\[repeat\]: too many copies; together they exceed 4000000 characters"):
        expanded(document)
