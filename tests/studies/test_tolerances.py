"""First-order tolerance analysis: against derivatives of the closed form, and against the designs of the study."""

from __future__ import annotations

import math

import mpmath
import pytest

import kinfmu
from kinfmu.readings import PeakAcceleration
from tests.studies.linkage import linkage, swing

TOLERANCES = {
    "crank": {"tolerance": "0.06 mm", "deviations": 2},
    "rocker": {"tolerance": "0.1 mm", "distribution": "uniform"},
    "base": {"tolerance": "0.09 mm"},
}
DEVIATIONS = {"crank": 0.03, "rocker": 0.1 / math.sqrt(3.0), "base": 0.03}
AT = {"crank": 20.0, "rocker": 50.0, "base": 40.0}


def slope(name: str) -> float:
    """Return the derivative of the swing angle in 30 digits."""

    def closed(value: mpmath.mpf) -> mpmath.mpf:
        crank, rocker, base = (value if one == name else mpmath.mpf(AT[one]) for one in AT)

        def angle(reach: mpmath.mpf) -> mpmath.mpf:
            return mpmath.acos((base**2 + rocker**2 - reach**2) / (2 * base * rocker))

        return angle(rocker + crank) - angle(rocker - crank)

    with mpmath.workdps(30):
        assert float(closed(mpmath.mpf(AT[name]))) == pytest.approx(swing(**AT), rel=1e-12)
        return float(mpmath.diff(closed, AT[name]))


def test_an_extreme_of_a_coordinate_has_exact_derivatives() -> None:
    found = kinfmu.study(linkage(), TOLERANCES, measures="swing", designs=16, workers=1).nominal
    assert found.measures["swing"].method == "sensitivities"
    assert found.deviations == pytest.approx(DEVIATIONS)
    for name, value in found.measures["swing"].slopes.items():
        assert value == pytest.approx(slope(name), rel=1e-9)
    variances = {name: (slope(name) * DEVIATIONS[name]) ** 2 for name in AT}
    assert found.deviation("swing") == pytest.approx(math.sqrt(sum(variances.values())), rel=1e-9)
    parts = found.contributions("swing")
    assert parts == pytest.approx({name: one / sum(variances.values()) for name, one in variances.items()}, rel=1e-9)
    assert list(parts.values()) == sorted(parts.values(), reverse=True)


def test_differences_agree_with_the_designs() -> None:
    measures = ["swing", "fastest", PeakAcceleration("jolt", of="rocker.phi")]
    found = kinfmu.study(linkage(), TOLERANCES, measures=measures, designs=256, workers=1)
    for name in found.measures:
        first_order, sampled = found.nominal.deviation(name), found.statistics[name].deviation
        assert first_order == pytest.approx(sampled, rel=0.02)
        assert found.nominal.measures[name].value == pytest.approx(found.statistics[name].mean, abs=0.1 * sampled)
    assert found.nominal.measures["jolt"].method == "differences"
    text = str(found)
    assert "first order" in text.splitlines()[2]
    assert "(by sensitivities)" in text


def test_a_study_with_other_variations_has_no_first_order_analysis() -> None:
    mixed = {"crank": {"tolerance": 0.1}, "base": {"values": [40, 45]}}
    found = kinfmu.study(linkage(), mixed, measures="swing", designs=4, workers=1)
    assert (len(found), found.nominal.deviations) == (8, {})
    assert "first order" not in str(found)
