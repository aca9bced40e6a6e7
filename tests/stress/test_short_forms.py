"""Short forms of the stress runs that `python -m tests.stress...` makes long."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, Model
from kinfmu.design.fit import MeasureTarget
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.gallery import names
from kinfmu.mechanism.measures import Range
from kinfmu.mechanism.toml_file import parse
from kinfmu.run.forces import ForceModel
from kinfmu.run.sensitivities import Sensitivities
from tests.fmu.host import OK, Host
from tests.fmu.native.test_memory import CC, check_under_sanitizers
from tests.mechanisms import fourbar
from tests.stress import far, parameters
from tests.stress.designs import faults
from tests.stress.forces import ENERGY
from tests.stress.forces import WRONG as WRONG_FORCES
from tests.stress.forces import compared as compared_forces
from tests.stress.repeating import compared
from tests.stress.sensitivities import WRONG as WRONG_SENSITIVITIES
from tests.stress.sensitivities import Engine
from tests.stress.sensitivities import compared as compared_sensitivities

DESIGNS = {"elliptic_trammel": 1, "fourbar": 1, "parallel_jaw": 1}  # one that does not close: it is assembled in vain


@pytest.mark.parametrize("name", names())
def test_a_batch_equals_files_with_the_numbers_of_its_designs(name: str) -> None:
    count = DESIGNS.get(name, 3)
    assert list(faults(name, count, 0, ["python"])) == [], f"python -m tests.stress.designs {name} --count {count}"


@pytest.mark.parametrize("name", ["crank_rocker", "five_bar", "jansen_leg", "slider_crank"])
def test_a_batch_in_c_equals_files_with_the_numbers_of_its_designs(name: str) -> None:
    assert list(faults(name, 6, 1, ["native"])) == [], f"python -m tests.stress.designs {name} --count 6 --seed 1"


# ----------------------------------------------------------------------------------------------------------- parameters


@pytest.mark.parametrize("name", ["crank_rocker", "fourbar_loaded", "toggle_press"])
def test_an_fmu_with_all_numbers_open_equals_files_with_its_settings(name: str, tmp_path: Path) -> None:
    found = parameters.compared(name, parameters.built(name, tmp_path, ["python", "native"]), 3, 0)
    assert found.faults == [], f"python -m tests.stress.parameters {name} --count 3"
    assert found.counts["stepped"] > 0


@pytest.mark.long
@pytest.mark.parametrize("name", names())
def test_every_fmu_with_all_numbers_open_equals_files_with_its_settings(name: str, tmp_path: Path) -> None:
    found = parameters.compared(name, parameters.built(name, tmp_path), 12, 1)
    assert found.faults == [], f"python -m tests.stress.parameters {name} --count 12 --seed 1"


# ------------------------------------------------------------------------------------------------------------ repeating


@pytest.mark.parametrize(("engine", "count"), [("python", 100), ("native", 20)])
def test_a_repeating_law_is_exact_after_up_to_a_million_periods(
    engine: Literal["python", "native"], count: int
) -> None:
    faults = [(seed, fault) for seed in range(count) for fault in compared(seed, engine).faults]
    assert faults == [], f"python -m tests.stress.repeating --engine {engine}"


# ------------------------------------------------------------------------------------------------------------------ far


@pytest.mark.parametrize(("engine", "count"), [("python", 20), ("native", 10)])
def test_far_from_the_origin_samples_are_within_their_estimates_or_refused(
    engine: Literal["python", "native"], count: int
) -> None:
    faults = [(seed, fault) for seed in range(count) for fault in far.compared(seed, engine).faults]
    assert faults == [], f"python -m tests.stress.far --engine {engine}"


# ----------------------------------------------------------------------------------------------------------- sanitizers


@pytest.mark.skipif(CC is None, reason="neither gcc nor clang is there")
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    "name",
    ["fourbar", "five_bar", "settable", "fourbar_loaded", "engine", "excavator_loaded", "motor", "rocker"],
)
def test_sanitizers_report_no_errors_in_optimized_code(name: str, fmi: int, tmp_path: Path) -> None:
    check_under_sanitizers(name, fmi, tmp_path, "-O1")


# --------------------------------------------------------------------------------------------------------------- forces


FEW_FORCES = {
    "four-bars": 1,
    "slider-cranks": 2,
    "pins in slots": 3,
    "watt six-bars": 4,
    "geared five-bars": 5,
    "redundant parallelograms": 6,
    "coupled wheels": 7,
    "cylinders": 8,
    "robots": 9,
}


@pytest.mark.parametrize(("family", "seed"), FEW_FORCES.items())
@pytest.mark.parametrize("engine", ["python", "native"])
def test_forces_agree_with_50_digits(family: str, seed: int, engine: Literal["python", "native"]) -> None:
    found = compared_forces(seed, family, engine)
    assert found.faults == []
    assert found.samples > 0
    assert found.stretches > 0
    assert max(found.efforts, found.inertias, found.reactions, found.balance, found.shaking) <= WRONG_FORCES
    assert found.energy <= ENERGY


@pytest.mark.parametrize("method", ["forces", "reactions"])
def test_wrong_forces_are_reported(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    right = getattr(ForceModel, method)
    monkeypatch.setattr(ForceModel, method, lambda model, run: right(model, run) * (1.0 + 1e-9))
    faults = compared_forces(1, "four-bars").faults
    for what in {"forces": ["efforts"], "reactions": ["reactions", "shaking force"]}[method]:
        assert any(f"{what} wrong by" in fault for fault in faults)


def test_reactions_that_are_not_determined_may_not_be_given(monkeypatch: pytest.MonkeyPatch) -> None:
    right = ForceModel.reactions

    def invented(model: ForceModel, run: Any) -> Any:
        return np.nan_to_num(right(model, run))

    monkeypatch.setattr(ForceModel, "reactions", invented)
    faults = compared_forces(7, "coupled wheels").faults
    assert any("a self-stress may be added" in fault for fault in faults)


# -------------------------------------------------------------------------------------------------------- sensitivities


FEW_SENSITIVITIES = {
    "four-bars": 0,
    "pins in slots": 5,
    "watt six-bars": 6,
    "geared five-bars": 10,
    "redundant parallelograms": 26,
    "cylinders": 16,
}


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize(("family", "seed"), FEW_SENSITIVITIES.items())
def test_sensitivities_agree_with_50_digits(family: str, seed: int, engine: Engine) -> None:
    found = compared_sensitivities(seed, family, engine)
    assert found.faults == []
    assert found.compared > 0
    assert found.worst <= WRONG_SENSITIVITIES


def test_wrong_derivatives_and_wrong_refusals_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    right = Model.sensitivities

    def changed(model: Model, *given: Any, **named: Any) -> Sensitivities:
        found = right(model, *given, **named)
        refused: Mapping[str, str] = {found.parameters[0]: "no reason"}
        return replace(found, rates_by=found.rates_by + 1e-9, refused=refused)

    monkeypatch.setattr(Model, "sensitivities", changed)
    faults = compared_sensitivities(0, "four-bars", "python").faults
    assert "is refused, but no row opens: no reason" in faults[0] + faults[-1]
    assert sum("is wrong by" in fault for fault in faults) >= 6


# -------------------------------------------------------------------------------------------------------- torque driven


def heavy() -> Mechanism:
    plain = fourbar(2.0, 0.7, 1.9, 1.5)
    bodies = [
        body if body.is_ground else replace(body, mass=1.0 + 0.3 * k, center_of_mass=(0.3, 0.1), inertia=0.2)
        for k, body in enumerate(plain.bodies)
    ]
    return replace(plain, bodies=tuple(bodies))


def test_energy_is_constant_over_a_thousand_turns() -> None:
    run = kinfmu.simulate(
        heavy(), drive="torque", start=0.0, stop=940.0, step=1.0, state={"crank_speed": 7.0}, tolerance=1e-13
    )
    assert run["crank_angle"][-1] > 1000 * 2 * math.pi
    drift = np.abs(run["kinetic_energy"] / run["kinetic_energy"][0] - 1).max()
    print(f"drift over {run['crank_angle'][-1] / 2 / math.pi:.0f} turns: {drift:.2g}")
    assert drift < 1e-9


def test_energy_of_an_fmu_is_constant_over_a_thousand_turns(tmp_path: Path) -> None:
    path = kinfmu.build(heavy(), tmp_path / "free.fmu", drive="torque", flavour="native", fmi=3)
    host = Host(path, tmp_path / "free")
    host.set({"crank_speed": 7.0, "integrator.tolerance": 1e-13})
    host.initialize(0.0)
    (first,) = host.get("kinetic_energy")
    energies = []
    for k in range(940):
        assert host.step(float(k), 1.0) == OK
        energies += host.get("kinetic_energy")
    (angle,) = host.get("crank_angle")
    host.free()
    assert angle > 1000 * 2 * math.pi
    drift = np.abs(np.array(energies) / first - 1).max()
    print(f"drift over {angle / 2 / math.pi:.0f} turns of an FMU: {drift:.2g}")
    assert drift < 1e-9


# ------------------------------------------------------------------------------------------------------------ balancing


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
