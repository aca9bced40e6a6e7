"""Values of measures as text: a deviation states what it counts from."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu.design.fit import MeasureConstraint, MeasureTarget
from kinfmu.draw.study import Quantities
from kinfmu.mechanism.measures import counted_from
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text as toml_text

_MEASURES = """
[measures.transmission]
type = "transmission_angle"
coupler = ["coupler.P", "coupler.Q"]
output = ["rocker.C", "rocker.Q"]
[measures.swing]
type = "range"
of = "rocker.phi"
"""


def test_reports_and_pictures_state_that_a_transmission_angle_counts_from_90_deg() -> None:
    text = toml_text(kinfmu.load("crank_rocker"))
    report = str(kinfmu.check(parse(text + _MEASURES)))
    (line,) = (line for line in report.splitlines() if "transmission = " in line)
    assert " deg) from 90 deg (crank at " in line
    (swing,) = (line for line in report.splitlines() if "swing = " in line)
    assert "from" not in swing
    column = Quantities("transmission", "deg", np.zeros(1), counted_from("transmission_angle"))
    assert column.label == "transmission from 90 deg [deg]"
    assert Quantities("swing", "deg", np.zeros(1), counted_from("range")).label == "swing [deg]"


@pytest.mark.long
def test_fits_state_that_a_transmission_angle_counts_from_90_deg() -> None:
    text = toml_text(kinfmu.load("crank_rocker")).replace("Q = [50.0, 0.0], tracer", 'Q = ["q", 0.0], tracer')
    mechanism = parse(text + _MEASURES + '[parameters]\nq = "50 mm"\n')
    problem = kinfmu.FitProblem(
        mechanism,
        unknowns={"q": ("49 mm", "52 mm")},
        targets=[MeasureTarget(name="wanted", of="transmission", value="66 deg")],
        constraints=[MeasureConstraint(name="limit", of="transmission", maximum="80 deg")],
    )
    lines = str(kinfmu.fit(problem, starts=1)).splitlines()
    (target,) = (line for line in lines if line.startswith("wanted (measure): "))
    assert " deg from 90 deg, error " in target
    (constraint,) = (line for line in lines if "transmission_angle = " in line)
    assert " deg from 90 deg, at most 80 deg" in constraint
