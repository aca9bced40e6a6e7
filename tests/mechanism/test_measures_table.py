"""[measures] of a mechanism file: numbers with units and expressions, references, round trip, schema, messages."""

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
