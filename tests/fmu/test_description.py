"""The rules of FMI that exporters get wrong, checked on our own descriptions."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from fmpy.validation import validate_fmu

from kinfmu.errors import FmuError
from kinfmu.fmu import description
from kinfmu.fmu.documents import documents
from kinfmu.fmu.variables import interface
from kinfmu.plan import compile_plan
from tests.fmu.conftest import mechanism

MODELS = ("fourbar", "double_pendulum")
STRUCTURED_NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*\Z", re.ASCII)


def _xml(path: Path) -> bytes:
    with zipfile.ZipFile(path) as zipped:
        return zipped.read("modelDescription.xml")


@pytest.fixture(params=MODELS)
def fmu(request: pytest.FixtureRequest, built: Callable[..., Path]) -> Path:
    return built(request.param, "time")


@pytest.fixture
def root(fmu: Path) -> ET.Element:
    return ET.fromstring(_xml(fmu))  # noqa: S314  # our own


def _scalars(root: ET.Element) -> list[ET.Element]:
    return list(root.iterfind("ModelVariables/ScalarVariable"))


def test_fmpy_validates_the_fmu_without_problems(fmu: Path) -> None:
    assert validate_fmu(str(fmu)) == []


def test_description_reads_back_as_the_interface_it_was_written_from(fmu: Path) -> None:
    read = description.read(_xml(fmu), str(fmu)).interface
    plan = compile_plan(mechanism(read.name))
    assert read == interface(plan, "time", reach=documents(plan, 2).reach)


def test_every_output_is_in_outputs_and_initial_unknowns(root: ET.Element) -> None:
    outputs = [str(k + 1) for k, scalar in enumerate(_scalars(root)) if scalar.get("causality") == "output"]
    assert outputs
    for element in ("Outputs", "InitialUnknowns"):
        assert [u.get("index") for u in root.iterfind(f"ModelStructure/{element}/Unknown")] == outputs


def test_dependencies_have_kinds_and_never_name_an_output(root: ET.Element) -> None:
    scalars = _scalars(root)
    allowed = {"Outputs": {"input"}, "InitialUnknowns": {"input", "parameter"}}
    for element, causalities in allowed.items():
        for unknown in root.iterfind(f"ModelStructure/{element}/Unknown"):
            indices = unknown.get("dependencies", "").split()
            kinds = unknown.get("dependenciesKind", "").split()
            assert len(kinds) == len(indices)
            assert set(kinds) <= ({"dependent", "fixed"} if element == "Outputs" else {"dependent"})
            assert {scalars[int(index) - 1].get("causality") for index in indices} <= causalities


def test_position_depends_on_angle_velocity_also_on_speed_acceleration_on_all_three(fmu: Path) -> None:
    variables = {v.name: v for v in description.read(_xml(fmu), str(fmu)).interface}
    name = "coupler" if "coupler.x" in variables else "lower"
    assert variables[f"{name}.phi"].dependencies == ("crank_angle",)
    assert variables[f"{name}.omega"].dependencies == ("crank_angle", "crank_speed")
    assert variables[f"{name}.alpha"].dependencies == ("crank_angle", "crank_speed", "crank_acceleration")
    assert set(variables[f"{name}.phi"].initial_dependencies or ()) == {
        "crank_angle", "crank.start", "crank.speed", "driven_by_time",
    }  # fmt: skip


def test_starts_and_initial_follow_causality(root: ET.Element) -> None:
    for scalar in _scalars(root):
        start, causality = scalar[0].get("start"), scalar.get("causality")
        if scalar.get("initial") == "calculated":
            assert start is None
        else:
            assert start is not None
        assert (causality == "input") == (scalar.get("initial") is None)
        if causality == "parameter":
            assert scalar.get("variability") in ("fixed", "tunable")
        low, high = float(scalar[0].get("min", "-inf")), float(scalar[0].get("max", "inf"))
        assert low <= high
        if start is not None and scalar[0].tag == "Real":
            assert low <= float(start) <= high


def test_names_and_value_references_are_unique_and_names_legal(root: ET.Element) -> None:
    names = [scalar.get("name", "") for scalar in _scalars(root)]
    references = [scalar.get("valueReference") for scalar in _scalars(root)]
    assert len(set(names)) == len(names)
    assert len(set(references)) == len(references)
    assert all(STRUCTURED_NAME.match(name) for name in names)


def test_units_of_all_numbers_are_defined_with_exponents_and_angles_shown_in_degrees(root: ET.Element) -> None:
    units = {unit.get("name"): unit for unit in root.iterfind("UnitDefinitions/Unit")}
    displays = {name: {d.get("name") for d in unit.iterfind("DisplayUnit")} for name, unit in units.items()}
    for scalar in _scalars(root):
        for real in scalar.iterfind("Real"):
            assert real.get("unit") in units
            assert real.get("displayUnit") in {None, *displays[real.get("unit")]}
            assert (real.get("displayUnit") or "").startswith("deg") == real.get("unit", "").startswith("rad")
    assert units["rad/s2"].find("BaseUnit").attrib == {"rad": "1", "s": "-2"}  # type: ignore[union-attr]
    assert units["m/s"].find("BaseUnit").attrib == {"m": "1", "s": "-1"}  # type: ignore[union-attr]


def test_derivatives_lead_from_acceleration_to_velocity_to_position(root: ET.Element) -> None:
    scalars = _scalars(root)
    derivative = {s.get("name"): s[0].get("derivative") for s in scalars}
    some = "coupler" if "coupler.ax" in derivative else "lower"
    velocity = scalars[int(derivative[f"{some}.ax"] or 0) - 1]
    assert velocity.get("name") == f"{some}.vx"
    assert scalars[int(velocity[0].get("derivative", 0)) - 1].get("name") == f"{some}.x"


def test_root_has_no_date_or_a_legal_one_and_a_c_identifier(root: ET.Element) -> None:
    date = root.get("generationDateAndTime")
    assert date is None or re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", date)
    simulation = root.find("CoSimulation")
    assert simulation is not None
    assert re.fullmatch(r"[A-Za-z_]\w*", simulation.get("modelIdentifier", ""))
    assert simulation.get("needsExecutionTool") == "true"  # Python
    experiment = root.find("DefaultExperiment")
    assert experiment is not None
    assert float(experiment.get("stopTime", "nan")) > float(experiment.get("startTime", "nan"))


def test_mechanism_in_millimetres_declares_millimetres_everywhere() -> None:
    import dataclasses

    plan = compile_plan(dataclasses.replace(mechanism("fourbar"), length_unit="mm"))
    text = description.write(description.Description(interface(plan), "t", "fourbar", "kinfmu"), {})
    root = ET.fromstring(text)  # noqa: S314  # our own
    units = {u.get("name"): u for u in root.iterfind("UnitDefinitions/Unit")}
    assert "m" not in units
    assert units["mm/s"].find("BaseUnit").attrib == {"m": "1", "s": "-1", "factor": "0.001"}  # type: ignore[union-attr]


def test_description_of_another_tool_is_refused_by_name() -> None:
    text = b'<fmiModelDescription fmiVersion="2.0" generationTool="OtherTool"><CoSimulation/></fmiModelDescription>'
    with pytest.raises(FmuError, match=r"x\.fmu: made by OtherTool; this needs"):
        description.read(text, "x.fmu")
