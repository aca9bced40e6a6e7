"""Fits that balance a four-bar by its centres of mass and by a mass."""

from __future__ import annotations

from dataclasses import replace

import pytest

import kinfmu
from kinfmu.design.fit import MeasureTarget
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.measures import Range
from kinfmu.mechanism.toml_file import parse

COUPLER = 7850 * 0.1 * 0.02 * 0.008  # [kg]
STILL = [MeasureTarget(name=name, of=name, value=0) for name in ("swing_x", "swing_y")]


def test_the_centres_of_mass_that_balance_a_fourbar_are_those_of_the_closed_form() -> None:
    """The coupler's ends carry half of its mass each (Berkof and Lowen, 1969)."""
    mechanism = _measured(kinfmu.load("fourbar_loaded"))
    unknowns = {"crank_center": (-20, 20), "rocker_center": (-40, 40)}
    result = kinfmu.fit(kinfmu.FitProblem(mechanism, unknowns, STILL), starts=1)
    assert result.parameters["crank_center"] == pytest.approx(-40.0 * COUPLER / 2.4, rel=1e-8)
    assert result.parameters["rocker_center"] == pytest.approx(-90.0 * COUPLER / 1.0, rel=1e-8)
    assert result.residuals == pytest.approx([0.0, 0.0], abs=1e-8)


def test_designs_with_a_negative_mass_are_refused_with_the_reason() -> None:
    """The crank's counterweight as an unknown mass, 10 mm behind its axis; the rocker is balanced."""
    text = (kinfmu.mechanism.gallery.folder() / "fourbar_loaded" / "mechanism.toml").read_text(encoding="utf-8")
    text = text.replace("crank_center = 0.0", 'weight = "1 kg"').replace("_center = 20.0", "_center = -11.304")
    text = text.replace('"1.2 kg"', '"weight"').replace('"crank_center"', "-10")
    mechanism = _measured(parse(text, "mechanism.toml"))
    result = kinfmu.fit(kinfmu.FitProblem(mechanism, {"weight": (-1, 5)}, STILL), starts=1)
    assert result.parameters["weight"] == pytest.approx(4.0 * COUPLER / 2.0, rel=1e-8)
    assert "of them refused, for example: measure 'swing_x' has no value: " in str(result)
    assert "[bodies.crank] mass = -" in str(result)
    with pytest.raises(KinfmuError, match=r"\[bodies\.crank\] mass = -\S+ must be 0 or more"):
        kinfmu.fit(kinfmu.FitProblem(mechanism, {"weight": (-2, -1)}, STILL), starts=1)


def _measured(mechanism: kinfmu.Mechanism) -> kinfmu.Mechanism:
    measures = Range("swing_x", "shaking_force_x"), Range("swing_y", "shaking_force_y")
    return replace(mechanism, measures=measures)
