"""The rules of model descriptions that exporters get wrong, in both versions of FMI."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from fmpy.validation import validate_fmu

import kinfmu
from kinfmu.fmu import description
from kinfmu.fmu.documents import documents
from kinfmu.fmu.interface import Interface
from kinfmu.fmu.variables import interface
from kinfmu.plan import compile_plan
from tests.fmu.conftest import Build
from tests.fmu.test_parameters import linkage

STRUCTURED_NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*\Z", re.ASCII)


@pytest.fixture(params=["fourbar", "double_pendulum", "settable"])
def fmu(request: pytest.FixtureRequest, built_native: Build, fmi: int) -> Path:
    return built_native(linkage() if request.param == "settable" else request.param, fmi, "time")


@pytest.fixture
def data(fmu: Path) -> bytes:
    with zipfile.ZipFile(fmu) as zipped:
        return zipped.read("modelDescription.xml")


@pytest.fixture
def root(data: bytes) -> ET.Element:
    return ET.fromstring(data)  # noqa: S314  # our own


@pytest.mark.few(2)
def test_fmpy_validates_the_fmu_without_problems(fmu: Path) -> None:
    assert validate_fmu(str(fmu)) == []


def test_description_reads_back_as_the_interface_it_was_written_from(data: bytes, fmi: int) -> None:
    read = description.read(data, "it")
    mechanism = linkage() if read.interface.name == "settable" else kinfmu.load(read.interface.name)
    plan = compile_plan(mechanism)
    written = interface(plan, "time", has_time=fmi == 3, has_work=True, reach=documents(plan, fmi).reach)
    place = written.value_references()
    assert list(read.interface) == [
        replace(
            v,
            initial_dependencies=v.initial_dependencies and tuple(sorted(v.initial_dependencies, key=place.get)),
            derivative_of=None,
        )
        for v in written
    ]
    assert [(part.name, part.names) for part in read.interface.parts] == [(p.name, p.names) for p in written.parts]
    assert read.version == f"{fmi}.0"
    assert bool(read.sources) == (fmi == 2)


def test_both_kinds_of_simulation_declare_their_capabilities(root: ET.Element, fmi: int) -> None:
    can = ["canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative"]
    if fmi == 3:
        can = ["canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives"]
        can.append("providesAdjointDerivatives")
    for kind in ("CoSimulation", "ModelExchange"):
        element = root.find(kind)
        assert element is not None
        assert [element.get(name) for name in can] == ["true"] * len(can)
        assert element.get("needsExecutionTool") == element.get("canBeInstantiatedOnlyOncePerProcess") == "false"
        assert re.fullmatch(r"[A-Za-z_]\w*", element.get("modelIdentifier", ""))
    simulation = root.find("CoSimulation")
    assert simulation is not None
    assert simulation.get("canHandleVariableCommunicationStepSize") == "true"
    assert simulation.get("maxOutputDerivativeOrder") == "2"


def test_value_references_and_names_are_unique_and_names_legal(data: bytes, root: ET.Element) -> None:
    elements = list(root.iterfind("ModelVariables/*"))
    references = [element.get("valueReference") for element in elements]
    names = [element.get("name", "") for element in elements]
    assert len(set(references)) == len(references)
    assert len(set(names)) == len(names)
    assert all(STRUCTURED_NAME.match(name) for name in names)
    assert b"generationDateAndTime" not in data


def test_outputs_and_initial_unknowns_are_complete_with_as_many_kinds_as_dependencies(data: bytes, fmi: int) -> None:
    about = description.read(data, "it").interface
    for variable in about:
        known = {v.name for v in about if v.causality in ("input", "parameter", "independent")}
        if variable.causality == "output":
            assert variable.dependencies is not None
            assert {about_causality(about, name) for name in variable.dependencies} <= (
                {"input"} if fmi == 2 else {"input", "independent", "parameter"}
            )
        assert set(variable.initial_dependencies or ()) <= known
    found = re.findall(r'<(\w+)[^<>]* dependencies="([^"]*)" dependenciesKind="([^"]*)"', data.decode())
    assert found
    for element, listed, kinds in found:  # FMI wants no other kinds of initial unknowns; in 2.0 both are an Unknown
        assert len(listed.split()) == len(kinds.split())
        assert set(kinds.split()) <= ({"dependent"} if element == "InitialUnknown" else {"dependent", "fixed"})


def test_outputs_of_fmi_3_depend_on_tunable_parameters_and_on_none_that_is_fixed(data: bytes, fmi: int) -> None:
    about = description.read(data, "it").interface
    parameters = {v.name: v.variability for v in about if v.causality == "parameter"}
    listed = {v.name: {name for name in v.dependencies or () if name in parameters} for v in about}
    law = {name for name in parameters if name.startswith("crank.")}
    turned = "upper" if about.name == "double_pendulum" else "crank"
    for name in (f"{turned}.phi", f"{turned}.omega", f"{turned}.alpha", "solver.residual"):
        assert listed[name] == (law if fmi == 3 else set())
    assert listed["solver.status"] == (law | {"solver.tolerance"} if fmi == 3 else set())
    assert {parameters[name] for names in listed.values() for name in names} == ({"tunable"} if fmi == 3 else set())


def test_kind_is_fixed_where_an_output_is_linear_in_an_input(data: bytes) -> None:
    about = description.read(data, "it").interface
    turned = "upper.phi" if about.name == "double_pendulum" else "crank.phi"
    assert {v.name: v.linear_in for v in about if v.linear_in} == {turned: ("crank_angle",)}
    assert data.count(b'dependenciesKind="fixed') == 1


def about_causality(about: Interface, name: str) -> str:
    return next(variable.causality for variable in about if variable.name == name)


def test_time_is_the_one_independent_variable_of_fmi_3(data: bytes, fmi: int) -> None:
    independent = [v for v in description.read(data, "it").interface if v.causality == "independent"]
    assert [v.name for v in independent] == (["time"] if fmi == 3 else [])
    assert all(v.start is None and v.initial is None for v in independent)


def test_starts_and_limits_follow_causality(data: bytes) -> None:
    for variable in description.read(data, "it").interface:
        if variable.causality == "input" or variable.initial == "exact":
            assert variable.start is not None
        else:
            assert variable.start is None
        assert (variable.initial is None) == (variable.causality in ("input", "independent"))
        low, high = variable.minimum, variable.maximum
        if variable.type == "Real" and variable.start is not None:
            assert low is None or low <= variable.start
            assert high is None or variable.start <= high
        if variable.causality == "parameter":
            assert variable.variability != "continuous"


def test_units_and_display_units_are_defined(root: ET.Element) -> None:
    units = {unit.get("name"): {d.get("name") for d in unit.iterfind("DisplayUnit")} for unit in root.iter("Unit")}
    users = [element for element in root.find("ModelVariables").iter() if element.get("unit")]  # type: ignore[union-attr]
    assert len(users) > 20
    for element in users:
        assert element.get("unit") in units
        assert element.get("displayUnit") in {None, *units[element.get("unit")]}


# Importers that read descriptions otherwise


def _unknowns(root: ET.Element) -> list[ET.Element]:
    """The elements of the model structure that list dependencies, of both versions."""
    return [element for element in root.iterfind("ModelStructure//*") if element.get("dependencies") is not None]


def test_dependencies_are_the_same_read_as_indices_and_as_value_references(root: ET.Element) -> None:
    """OMSimulator reads dependencies of FMI 3.0 as places from 1, as FMI 2.0 has them."""
    elements = list(root.iterfind("ModelVariables/*"))
    by_reference = {int(element.get("valueReference", -1)): element for element in elements}
    assert 0 not in by_reference
    unknowns = _unknowns(root)
    listed = [int(one) for unknown in unknowns for one in unknown.get("dependencies", "").split()]
    named = [int(unknown.get("index") or unknown.get("valueReference", -1)) for unknown in unknowns]
    assert len(listed) > 20
    for number in (*listed, *named):
        assert 1 <= number <= len(elements)
        assert elements[number - 1] is by_reference[number]


def test_no_variable_looks_like_the_derivative_of_a_state(root: ET.Element) -> None:
    """OMSimulator counts every continuous variable with the attribute `derivative` as a state in model exchange."""
    assert root.find("ModelExchange") is not None
    assert [element.tag for element in root.iter() if element.get("derivative") is not None] == []
    assert [e.tag for e in root.iterfind("ModelStructure//*") if "Derivative" in e.tag] == []


def test_initial_unknowns_equal_those_that_importers_derive_from_the_variables(root: ET.Element, fmi: int) -> None:
    """OMSimulator compares the list with its own and refuses an FMU where they differ."""
    elements = list(root.iterfind("ModelVariables/*"))
    expected = {
        element.get("valueReference")
        for element in elements
        if (element.get("causality") == "output" and element.get("initial") in ("calculated", "approx"))
        or element.get("causality") == "calculatedParameter"
    }
    place = "ModelStructure/InitialUnknowns/Unknown" if fmi == 2 else "ModelStructure/InitialUnknown"
    found = [unknown.get("index") or unknown.get("valueReference") for unknown in root.iterfind(place)]
    assert set(found) == expected
    assert len(found) == len(expected)
