"""Tables of mechanism files: measures and repeats."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import kinfmu
from kinfmu.errors import MechanismError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.measures import READINGS, PathDistance
from kinfmu.mechanism.quantities import DistanceBetween
from kinfmu.mechanism.repeats import LARGEST_COUNT, expanded
from kinfmu.mechanism.schema import schema_text
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text

FILE = (gallery.folder() / "crank_rocker" / "mechanism.toml").read_text(encoding="utf-8")
TABLES = """
[parameters]
width = "1 mm"

[measures]
low = { type = "minimum", of = "tracer.vy" }
reach = { type = "maximum", of = { measure = "distance", between = ["ground.O", "coupler.tracer"] } }
swing = { type = "range", of = "rocker.phi", begin = "10 deg", end = "0.5 rev" }
peak = { type = "peak", of = "rocker.phi" }
speed = { type = "peak_speed", of = "coupler.tracer" }
push = { type = "peak_acceleration", of = { measure = "angle", of = "rocker", to = "coupler" } }
ratio = { type = "time_ratio", of = "rocker.phi" }
rest = { type = "dwell", of = "tracer.y", band = "2*width", near = "minimum" }
line = { type = "straightness", of = "coupler.tracer", begin = 2, end = 4 }
round = { type = "roundness", of = "coupler.Q" }
path = { type = "path_distance", of = "coupler.tracer", targets = [["20 mm", 80], ["3*width", "8 cm"]] }
mu = { type = "transmission_angle", coupler = ["coupler.P", "coupler.Q"], output = ["rocker.C", "rocker.Q"] }
alpha = { type = "pressure_angle", cam = "crank", follower = "rocker.Q", pivot = "rocker.C" }
out = { type = "velocity_ratio", of = "rocker.phi", to = "crank.phi", extreme = "minimum" }
force = { type = "mechanical_advantage", of = "rocker.phi" }
margin = { type = "lowest_margin" }
"""


def test_every_type_is_read_with_its_numbers() -> None:
    mechanism = parse(FILE + TABLES)
    assert {type(reading) for reading in mechanism.measures} == set(READINGS)
    found = {reading.name: reading for reading in mechanism.measures}
    assert found["swing"].begin == math.radians(10.0)
    assert found["swing"].end == math.pi
    assert vars(found["reach"])["of"] == DistanceBetween(("ground.O", "coupler.tracer"))
    assert vars(found["rest"])["band"] == 2.0
    assert vars(found["path"])["targets"] == ((20.0, 80.0), (3.0, 80.0))
    wider = {reading.name: reading for reading in mechanism.with_parameters({"width": 4.0}).measures}
    assert vars(wider["rest"])["band"] == 8.0
    assert vars(wider["path"])["targets"][1] == (12.0, 80.0)
    assert "width" not in mechanism.unused_parameters


def test_a_mechanism_with_measures_survives_its_own_text() -> None:
    mechanism = parse(FILE + TABLES)
    again = parse(text(mechanism))
    assert again == mechanism
    assert text(again) == text(mechanism)


def test_the_schema_accepts_every_type_and_refuses_unknown_keys() -> None:
    schema = json.loads(schema_text())
    document = tomllib.loads(FILE + TABLES)
    jsonschema.validate(document, schema)
    document["measures"]["low"]["off"] = 1
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, schema)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('type = "minimun", of = "tracer.y"', "[measures.m] type = 'minimun' is not known; did you mean 'minimum'?"),
        ('type = "minimum"', "[measures.m] needs the key 'of'; keys: of, begin, end"),
        ('type = "minimum", off = "tracer.y"', "[measures.m] off: unknown key; did you mean 'of'?"),
        (
            'type = "minimum", of = "tracr.y"',
            "[measures.m] of: 'tracr.y' is not a coordinate of this mechanism; did you mean 'tracer.y'?",
        ),
        ('type = "minimum", of = 3', "[measures.m] of = 3 must be a coordinate such as 'rocker.phi'"),
        ('type = "minimum", of = "crank.P"', "[measures.m] of: 'crank.P' is not a coordinate of this mechanism"),
        ('type = "range", of = "tracer.y", begin = "3 mm"', "[measures.m] begin = '3 mm'"),
        ('type = "dwell", of = "tracer.y", band = "3 deg"', "[measures.m] band = '3 deg'"),
        ('type = "dwell", of = "tracer.y", band = 0', "[measures.m] band = 0 must be positive"),
        ('type = "dwell", of = "tracer.y", band = 1, near = "top"', "[measures.m] near = 'top' must be one of maximum"),
        (
            'type = "straightness", of = "coupler.trace"',
            "[measures.m] of: body 'coupler' has no point 'trace'",
        ),
        (
            'type = "path_distance", of = "coupler.Q", targets = [[1, 2, 3]]',
            "[measures.m] targets = [[1, 2, 3]] must be",
        ),
        ('type = "path_distance", of = "coupler.Q", targets = []', "[measures.m] targets must hold one point or more"),
        (
            'type = "velocity_ratio", of = "rocker.phi", to = "crnk.phi"',
            "[measures.m] to: 'crnk.phi' is not a",
        ),
        ('type = "pressure_angle", cam = "crnk", follower = "rocker.Q"', "[measures.m] cam: body 'crnk' is not in the"),
    ],
)
def test_an_error_is_one_line_with_table_and_key(table: str, message: str) -> None:
    with pytest.raises(MechanismError) as error:
        parse(f"{FILE}\n[measures]\nm = {{ {table} }}\n")
    assert str(error.value).removeprefix("mechanism: ").startswith(message)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "targets",
    [[[1.5, 2.25]], ([1.5, 2.25], (3.0, 1.0)), np.array([[0.1, 0.2], [0.3, 4]]), [["3 mm", 2.5]], [(1, 2)]],
)
def test_targets_of_a_path_distance_are_saved_however_they_are_given(targets: Any, tmp_path: Path) -> None:
    given = replace(kinfmu.load("crank_rocker"), measures=(PathDistance("d", "coupler.Q", targets),))
    kinfmu.save(given, tmp_path / "a.toml")
    assert kinfmu.load(tmp_path / "a.toml") == given
    assert hash(given.measures[0])


@pytest.mark.parametrize("targets", [3, [1.5, 2.5], [[1.5]], [[1.0, 2.0, 3.0]], None])
def test_targets_that_are_no_points_are_refused(targets: Any) -> None:
    with pytest.raises(MechanismError, match=r"\[measures.d\] targets = .* must be a list of points \[\[x, y\], ...\]"):
        PathDistance("d", "coupler.Q", targets)


# -------------------------------------------------------------------------------------------------------------- repeats


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
