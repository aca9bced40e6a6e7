"""XML files of FMI 3.0 FMUs of the gallery: valid by the schemas, and by rules of the standard that schemas lack."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.errors import RequestError
from kinfmu.fmu.interface import Drive
from tests.fmu.test_conformance import related
from tests.gallery_members import every_member

SCHEMAS = Path(fmpy.__file__).parent / "schema/fmi3"
FILES = {
    "modelDescription.xml": "fmi3ModelDescription",
    "sources/buildDescription.xml": "fmi3BuildDescription",
    "terminalsAndIcons/terminalsAndIcons.xml": "fmi3TerminalsAndIcons",
}
Built = Callable[[str, Drive], Path]


@pytest.fixture
def described(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Built:
    """`described(name, drive)`: an FMU of the gallery whose binary is not compiled."""
    monkeypatch.setattr(compiler, "shared_library_bytes", lambda *_: b"binary")

    def build(name: str, drive: Drive) -> Path:
        try:
            return kinfmu.build(kinfmu.load(name), tmp_path / "it.fmu", flavour="native", fmi=3, drive=drive)
        except RequestError as refusal:
            if drive == "torque" and "masses" in str(refusal):
                pytest.skip("the mechanism has no masses")
            raise

    return build


@pytest.mark.parametrize("drive", ["time", "torque"])
@every_member
def test_xml_files_follow_the_schemas_and_the_rules(name: str, drive: Drive, described: Built) -> None:
    path = described(name, drive)
    assert validate_fmu(str(path)) == []
    assert set(related(path).values()) >= {"model", "parameter", "document"}
    with zipfile.ZipFile(path) as zipped:
        inside = set(zipped.namelist())
        roots = {file: etree.fromstring(zipped.read(file)) for file in FILES}
    for file, schema in FILES.items():
        etree.XMLSchema(etree.parse(str(SCHEMAS / f"{schema}.xsd"))).assertValid(roots[file])
    model, build, terminals = roots.values()
    assert_sources_can_be_compiled(build, model, inside)
    assert_members_are_unique(terminals, {one.get("name") for one in model.find("ModelVariables")})


def assert_sources_can_be_compiled(build: Any, model: Any, inside: set[str]) -> None:
    """Options belong to a compiler that is named; each file is in the FMU, and listed once."""
    (configuration,) = build.iterfind("BuildConfiguration")
    assert {one.get("modelIdentifier") for one in model.iterfind("*[@modelIdentifier]")} == {
        configuration.get("modelIdentifier")
    }
    (files,) = configuration.iterfind("SourceFileSet")
    assert (files.get("compiler"), files.get("compilerOptions")) == ("gcc", "-ffp-contract=off")
    names = [file.get("name") for file in files.iterfind("SourceFile")]
    assert len(names) == len(set(names))
    assert {f"sources/{name}" for name in names} <= inside


def assert_members_are_unique(root: Any, variables: set[str]) -> None:
    """Buses connect members by name: a name that occurs twice in a terminal connects to neither."""
    terminals = [one.get("name") for one in root.iter("Terminal")]
    assert len(terminals) == len(set(terminals)) > 0
    for terminal in root.iter("Terminal"):
        members = terminal.findall("TerminalMemberVariable")
        names = [one.get("memberName") for one in members]
        assert len(names) == len(set(names)), names
        assert len(members) == len({one.get("variableName") for one in members})
        assert {one.get("variableName") for one in members} <= variables


def test_the_torque_that_drives_and_the_torque_for_the_motion_are_two_members(described: Built) -> None:
    with zipfile.ZipFile(described("toggle_press", "torque")) as zipped:
        root = etree.fromstring(zipped.read("terminalsAndIcons/terminalsAndIcons.xml"))
    members = {one.get("memberName"): one.get("variableName") for one in root.iter("TerminalMemberVariable")}
    assert members["torque"] == "crank_torque"
    assert members["required_torque"] == "crank.torque"
