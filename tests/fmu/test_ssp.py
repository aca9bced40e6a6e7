"""An FMU as an SSP, and its description for OSP: valid, complete, and read by other hosts."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd, read_ssv
from lxml import etree

import kinfmu
from kinfmu.errors import RequestError
from kinfmu.fmu import build, description, simulate
from kinfmu.fmu.system_files import NAMESPACE, groups
from tests.fmu.test_si import PRESS

PYTHON = os.environ.get("KINFMU_HOSTS", sys.executable)
STEP, COUNT = 0.01, 30
OUTPUTS = ("ram.x", "crank.phi", "ram.force")

ECOS = """
import sys
from ecospy import EcosSimulation
ssp, step, count, name, *outputs = sys.argv[1:]
with EcosSimulation(float(step), ssp_path=ssp) as simulation:
    simulation.init(parameter_set="initialValues")
    for _ in range(int(count)):
        simulation.step(1)
        print("row", *(repr(simulation.get_real(f"{name}::{output}")) for output in outputs))
"""
OSP = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
kind, file, step, count, name, *references = sys.argv[1:]
if kind == "ssp":
    execution = CosimExecution.from_ssp_file(file, round(float(step) * 1e9))
else:
    execution = CosimExecution.from_osp_config_file(file)
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
slave = execution.slave_index_from_instance_name(name)
for _ in range(int(count)):
    assert execution.step()
    print("row", *map(repr, observer.last_real_values(slave, [int(one) for one in references])))
"""


@pytest.fixture(scope="module")
def mechanism() -> kinfmu.Mechanism:
    made = kinfmu.mechanism.toml_file.parse(PRESS, "press.toml")
    return made.with_parameters({"arm": "41 mm"})


@pytest.fixture(scope="module")
def ssp(mechanism: kinfmu.Mechanism, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(mechanism, tmp_path_factory.mktemp("ssp"), flavour="native", drive="time", si=True, ssp=True)


def _inside(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as archive:
        return archive.read(name)


def _fmu(path: Path, folder: Path) -> Path:
    fmu = folder / "small_press.fmu"
    fmu.write_bytes(_inside(path, "resources/small_press.fmu"))
    return fmu


def test_the_ssp_is_valid_and_has_every_connector_with_its_unit(ssp: Path) -> None:
    assert ssp.name == "small_press.ssp"
    described = read_ssd(BytesIO(ssp.read_bytes()), validate=True)
    (component,) = described.system.elements
    with zipfile.ZipFile(BytesIO(_inside(ssp, component.source))) as fmu:
        interface = description.read(fmu.read("modelDescription.xml"), "the FMU").interface
    kinds = ("input", "output", "parameter", "calculatedParameter")
    wanted = {one.name: one for one in interface if one.causality in kinds and one.type != "Enumeration"}
    assert {one.name: one.kind for one in component.connectors} == {n: one.causality for n, one in wanted.items()}
    root = etree.fromstring(_inside(ssp, "SystemStructure.ssd"))
    defined = {unit.get("name") for unit in root.iter("{*}Unit")}
    for connector in root.iter("{*}Connector"):
        assert connector[0].get("unit") == wanted[connector.get("name")].unit
        assert connector[0].get("unit") in {*defined, None}
    assert {"m", "m/s", "N", "rad"} <= defined


def test_the_parameter_set_holds_all_parameters_as_set(ssp: Path) -> None:
    with zipfile.ZipFile(ssp) as archive, archive.open("resources/small_press.ssv") as file:
        values = {one.name: one for one in read_ssv(file, validate=True).parameters}
    assert {name: str(one.value) for name, one in values.items()}["arm"] == "0.041"
    assert values["arm"].unit == "m"
    assert str(values["driven_by_time"].value) == "true"
    assert {"arm", "rod", "weight", "solver.tolerance", "driven_by_time"} <= set(values)


def test_an_ssp_is_stepped_like_its_fmu(ssp: Path, mechanism: kinfmu.Mechanism, tmp_path: Path) -> None:
    system = simulate(ssp, stop=STEP * COUNT, step=STEP)
    alone = simulate(_fmu(ssp, tmp_path), stop=STEP * COUNT, step=STEP)
    solved = kinfmu.solve(mechanism, system.t)
    assert system.length_unit == "m"
    for name in OUTPUTS:
        assert np.array_equal(system[name], alone[name])
        size = np.abs(solved[name]).max()
        assert np.abs(system[name] * (1e3 if name == "ram.x" else 1.0) - solved[name]).max() < 1e-9 * size
    longer = simulate(ssp, stop=STEP, step=STEP, parameters={"small_press.arm": "42 mm"})
    assert longer["crank.phi"][0] != system["crank.phi"][0]


def test_ssp_2_has_the_enumerations(ssp: Path, mechanism: kinfmu.Mechanism, tmp_path: Path) -> None:
    """Its schemas come with pyssp-standard; without it the rest is tested."""
    path = build(mechanism, tmp_path, flavour="native", drive="time", si=True, ssp=2)
    root, values = etree.fromstring(_inside(path, "SystemStructure.ssd")), _inside(path, "resources/small_press.ssv")
    assert root.get("version") == "2.0"
    declared = {
        one.get("name"): {item.get("name"): item.get("value") for item in one} for one in root.find("{*}Enumerations")
    }
    used = {one.getparent().get("name"): one.get("name") for one in root.iter("{*}Enumeration") if len(one) == 0}
    assert used == {"solver.status": "Status", "rates": "Rates"}
    assert set(used.values()) == set(declared)
    assert declared["Rates"] == {"auto": "0", "estimated": "1", "wired": "2"}
    (rates,) = (one[0] for one in etree.fromstring(values).iter("{*}Parameter") if one.get("name") == "rates")
    assert (etree.QName(rates).localname, rates.get("value")) == ("Enumeration", "auto")
    same = simulate(path, stop=STEP, step=STEP), simulate(ssp, stop=STEP, step=STEP)
    assert np.array_equal(same[0]["ram.x"], same[1]["ram.x"])
    package = find_spec("pyssp_standard")
    if package is None or package.origin is None:
        pytest.skip("needs the schemas in pyssp-standard")
    schemas = Path(package.origin).parent / "resources/ssp2"
    for data, name in ((root, "Description"), (etree.fromstring(values), "ParameterValues")):
        etree.XMLSchema(etree.parse(str(schemas / f"SystemStructure{name}.xsd"))).assertValid(data)


def test_an_ssp_is_built_twice_as_the_same_file_and_only_in_its_place(
    mechanism: kinfmu.Mechanism, tmp_path: Path
) -> None:
    again = [build(mechanism, tmp_path / f"{k}.ssp", flavour="python").read_bytes() for k in (1, 2)]
    assert again[0] == again[1]
    for arguments, message in (
        ({"path": "it.fmu", "ssp": True}, "it.fmu: is no folder, and the file of a system ends in .ssp"),
        ({"path": "it.ssp", "osp": True}, "osp describes an FMU for the folder that it is in; an .ssp holds none"),
    ):
        with pytest.raises(RequestError) as caught:
            build(mechanism, **arguments)
        assert str(caught.value) == message


def _rows(script: str, *arguments: str, cwd: Path) -> np.ndarray:
    done = subprocess.run([PYTHON, "-c", script, *arguments], capture_output=True, text=True, cwd=cwd, timeout=120)
    assert done.returncode == 0, done.stderr
    return np.array([line.split()[1:] for line in done.stdout.splitlines() if line.startswith("row ")], float)


def _needs(module: str) -> None:
    if subprocess.run([PYTHON, "-c", f"import {module}"], capture_output=True).returncode:
        pytest.skip(f"{module} is not installed")


def _wanted(ssp: Path, folder: Path) -> np.ndarray:
    run = simulate(_fmu(ssp, folder), stop=STEP * COUNT, step=STEP)
    return np.column_stack([run[name][1:] for name in OUTPUTS])


def test_ecos_steps_the_ssp(ssp: Path, tmp_path: Path) -> None:
    _needs("ecospy")
    rows = _rows(ECOS, str(ssp), str(STEP), str(COUNT), "small_press", *OUTPUTS, cwd=tmp_path)
    np.testing.assert_allclose(rows, _wanted(ssp, tmp_path), rtol=1e-9, atol=1e-12)


def test_libcosim_steps_the_ssp(ssp: Path, tmp_path: Path) -> None:
    _needs("libcosimpy")
    with zipfile.ZipFile(BytesIO(_inside(ssp, "resources/small_press.fmu"))) as fmu:
        references = description.read(fmu.read("modelDescription.xml"), "").interface.value_references()
    places = [str(references[name]) for name in OUTPUTS]
    rows = _rows(OSP, "ssp", str(ssp), str(STEP), str(COUNT), "small_press", *places, cwd=tmp_path)
    np.testing.assert_allclose(rows, _wanted(ssp, tmp_path), rtol=1e-9, atol=1e-12)


SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
    <BaseStepSize>0.001</BaseStepSize>
    <Algorithm>fixedStep</Algorithm>
    <Simulators>
        <Simulator name="drive" source="by_torque/small_press.fmu"/>
        <Simulator name="press" source="by_inputs/small_press.fmu"/>
    </Simulators>
    <Connections>
        <VariableGroupConnection>
            <VariableGroup simulator="drive" name="ram"/>
            <VariableGroup simulator="press" name="ram"/>
        </VariableGroupConnection>
        <VariableGroupConnection>
            <VariableGroup simulator="drive" name="ram position"/>
            <VariableGroup simulator="press" name="ram position"/>
        </VariableGroupConnection>
    </Connections>
</OspSystemStructure>
"""


@pytest.fixture(scope="module")
def both(mechanism: kinfmu.Mechanism, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the press driven by efforts and by inputs, each with its description for OSP."""
    folder = tmp_path_factory.mktemp("osp")
    for drive in ("torque", "inputs"):
        (folder / f"by_{drive}").mkdir()
        build(mechanism, folder / f"by_{drive}", flavour="native", drive=drive, osp=True)  # type: ignore[arg-type]
    return folder


def test_the_osp_description_has_a_port_with_opposite_causalities(both: Path) -> None:
    for drive, inward, outward in (("inputs", "ram_speed", "ram.force"), ("torque", "ram_force", "ram_speed")):
        folder = both / f"by_{drive}"
        root = etree.fromstring((folder / "small_press_OspModelDescription.xml").read_bytes())
        assert root.tag == f"{{{NAMESPACE}}}OspModelDescription"
        with zipfile.ZipFile(folder / "small_press.fmu") as fmu:
            interface = description.read(fmu.read("modelDescription.xml"), "").interface
        variables = {one.name: one for one in interface}
        (port,) = [group for group in groups(interface) if group.kind == "LinearMechanicalPort"]
        refs = [one.get("ref") for one in root.find(".//{*}LinearMechanicalPort").iter("{*}Variable")]
        assert port.name == "ram"
        assert sorted(refs) == sorted((inward, outward))
        assert {variables[one].causality for one in refs} == {"input", "output"}
        names = [one.get("name") for one in root.find("{*}VariableGroups").iter() if one.get("name")]
        assert len(names) == len(set(names))
        for one in root.iter("{*}Variable"):
            assert variables[one.get("ref")].unit == one.get("unit")
        kinds = [one.tag.partition("}")[2] for one in root.find("{*}VariableGroups")]
        assert kinds == ["Generic", "Force", "LinearDisplacement", "LinearAcceleration", "LinearMechanicalPort"]


def test_without_forces_the_speed_is_a_group_of_its_own(tmp_path: Path) -> None:
    build(kinfmu.load("fourbar"), tmp_path, flavour="python", osp=True)
    root = etree.fromstring((tmp_path / "fourbar_OspModelDescription.xml").read_bytes())
    found = {one.get("name"): one.tag.partition("}")[2] for one in root.find("{*}VariableGroups")}
    assert found == {
        "crank speed": "AngularVelocity",
        "crank angle": "AngularDisplacement",
        "crank acceleration": "AngularAcceleration",
    }


def test_libcosim_connects_the_groups_of_a_system_structure(both: Path) -> None:
    _needs("libcosimpy")
    (both / "OspSystemStructure.xml").write_text(SYSTEM)
    rows = []
    for simulator, names in (
        ("drive", ("ram_position", "ram_speed", "ram_force")),
        ("press", ("ram_position", "ram_speed", "ram.force")),
    ):
        folder = both / ("by_torque" if simulator == "drive" else "by_inputs")
        with zipfile.ZipFile(folder / "small_press.fmu") as fmu:
            references = description.read(fmu.read("modelDescription.xml"), "").interface.value_references()
        places = [str(references[name]) for name in names]
        rows.append(_rows(OSP, "osp", str(both), "0.001", "8", simulator, *places, cwd=both))
    drive, press = rows
    assert len(drive) == len(press) == 8
    assert np.ptp(drive[:, 1]) > 0.0
    np.testing.assert_array_equal(press[1:, :2], drive[:-1, :2])  # what passes is a step late in libcosim
    np.testing.assert_array_equal(drive[1:, 2], press[:-1, 2])


def test_libcosim_and_ecos_pass_numbers_as_they_are(both: Path, ssp: Path, tmp_path: Path) -> None:
    wire = 'startElement="drive" startConnector="ram_position" endElement="press" endConnector="ram_position"'
    parts = [("drive", "output", "mm"), ("press", "input", "m")]
    components = "".join(
        f'<ssd:Component name="{name}" type="application/x-fmu-sharedlibrary" source="resources/{name}.fmu">'
        f'<ssd:Connectors><ssd:Connector name="ram_position" kind="{kind}"><ssc:Real unit="{unit}"/></ssd:Connector>'
        "</ssd:Connectors></ssd:Component>"
        for name, kind, unit in parts
    )
    structure = (
        '<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
        'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" name="both" version="1.0">'
        f'<ssd:System name="both"><ssd:Elements>{components}</ssd:Elements><ssd:Connections><ssd:Connection {wire}/>'
        "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>"
    )
    system = tmp_path / "both.ssp"
    with zipfile.ZipFile(system, "w") as archive:
        archive.writestr("SystemStructure.ssd", structure)
        archive.write(both / "by_torque" / "small_press.fmu", "resources/drive.fmu")
        archive.writestr("resources/press.fmu", _inside(ssp, "resources/small_press.fmu"))
    with zipfile.ZipFile(BytesIO(_inside(ssp, "resources/small_press.fmu"))) as fmu:
        references = description.read(fmu.read("modelDescription.xml"), "").interface.value_references()
    place = str(references["ram_position"])
    for module, script, name in (("libcosimpy", OSP, place), ("ecospy", ECOS, "ram_position")):
        _needs(module)
        kind = ("ssp",) if module == "libcosimpy" else ()
        script = script.replace('parameter_set="initialValues"', "")
        rows = _rows(script, *kind, str(system), "0.001", "3", "press", name, cwd=tmp_path)
        assert rows[-1, 0] == pytest.approx(123.0, rel=1e-2)  # 123 mm arrive as 123 m
