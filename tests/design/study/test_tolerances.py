"""First-order tolerance analysis: against derivatives of the closed form, and against the designs of the study."""

from __future__ import annotations

import math

import mpmath
import pytest

import kinfmu
from kinfmu.mechanism import toml_file
from kinfmu.mechanism.measures import PeakAcceleration
from tests.design.study.linkage import linkage, swing

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
    assert "warning" not in text
    assert "(by sensitivities)" in text


def test_a_study_with_other_variations_has_no_first_order_analysis() -> None:
    mixed = {"crank": {"tolerance": 0.1}, "base": {"values": [40, 45]}}
    found = kinfmu.study(linkage(), mixed, measures="swing", designs=4, workers=1)
    assert (len(found), found.nominal.deviations) == (8, {})
    assert "first order" not in str(found)


SLIDER_CRANK = """
name = "press"
parameters = { crank = "1 m", rod = "3 m", offset = "%s m" }
bodies.ground.points = { O = [0, 0], G = [0, "offset"] }
bodies.crank.points = { O = [0, 0], P = ["crank", 0] }
bodies.rod = { points = { P = [0, 0], S = ["rod", 0] }, start = { x = 1, phi = "1 deg" } }
bodies.ram = { points = { S = [0, 0] }, start = { x = 4, y = "offset" } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
joints.P = { type = "revolute", between = ["crank.P", "rod.P"] }
joints.S = { type = "revolute", between = ["rod.S", "ram.S"] }
joints.guide = { type = "translational", between = ["ground.G", "ram.S"] }
drivers.crank = { type = "angle", of = "crank", law = "constant_speed", speed = 1 }
measures.stroke = { type = "range", of = "ram.x" }
"""


@pytest.mark.parametrize(
    ("offset", "tolerance", "warns"),
    [
        (0.0, 0.3, True),  # stroke = sqrt((r + l)^2 - e^2) - sqrt((l - r)^2 - e^2) is even in e
        (0.0, 1e-3, True),
        (0.1, 0.3, True),  # the mean is shifted
        (1.0, 0.03, False),
    ],
)
@pytest.mark.few(1)
def test_a_study_warns_where_first_order_and_samples_disagree(offset: float, tolerance: float, warns: bool) -> None:
    mechanism = toml_file.parse(SLIDER_CRANK % offset)
    found = kinfmu.study(mechanism, {"offset": {"tolerance": tolerance}}, measures="stroke", designs=256, workers=1)

    def stroke(e: float) -> float:
        return math.sqrt(16.0 - e * e) - math.sqrt(4.0 - e * e)

    sampled, first = found.statistics["stroke"], found.nominal.deviation("stroke")
    slope = offset / math.sqrt(4.0 - offset**2) - offset / math.sqrt(16.0 - offset**2)
    assert first == pytest.approx(slope * tolerance / 3.0, abs=1e-9)
    shift = sampled.mean - stroke(offset)
    disagrees = abs(first - sampled.deviation) > 0.3 * sampled.deviation or abs(shift) > 0.3 * sampled.deviation
    assert disagrees is warns
    assert ("warning: stroke is not linear within the tolerances" in str(found)) is warns
