"""What an FMU carries of itself: roles and digests of its files, and the record of its checks."""

from __future__ import annotations

import json
import posixpath
import re
import zipfile
from hashlib import sha3_256
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from click.testing import CliRunner
from fmpy.ssp.ssd import read_ssv

import kinfmu
from kinfmu.cli import main
from kinfmu.errors import FmuError
from kinfmu.fmu import description
from kinfmu.fmu.conformance import CERTIFICATE, RECORD, Check, conformance, record
from kinfmu.fmu.related import FOLDER, MANIFEST
from tests.fmu.conftest import Build

ROLE = re.compile("document|model|parameter|experiment/smoke-test|result|report")
ATTRIBUTES = {"type", "source", "role", "description", "checksum"}
NAMESPACE = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"


def related(path: Path) -> dict[str, str]:
    """Return roles by path, of a manifest that follows its schema, with digests that are right."""
    with zipfile.ZipFile(path) as zipped:
        root = ET.fromstring(zipped.read(MANIFEST))  # noqa: S314  # written by this test's FMU
        assert root.tag == "fmiReferences"
        assert root.attrib == {
            f"{NAMESPACE}name": "org.fmi-standard.fmi-ls-ref",
            f"{NAMESPACE}version": "1.0.0-beta.1",
            f"{NAMESPACE}description": "Layered Standard providing information on related files included in an FMU.",
        }
        roles = {}
        for one in root:
            assert (one.tag, len(one), set(one.attrib)) == ("Related", 0, ATTRIBUTES)
            assert ROLE.fullmatch(one.attrib["role"])
            place = posixpath.normpath(posixpath.join(FOLDER, one.attrib["source"]))
            assert sha3_256(zipped.read(place)).hexdigest() == one.attrib["checksum"]
            roles[place] = one.attrib["role"]
    return roles


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])
def test_the_manifest_names_what_belongs_to_an_fmu_with_its_role(flavour: str, fmi: int, tmp_path: Path) -> None:
    path = kinfmu.build(
        kinfmu.load("crank_rocker"), tmp_path, flavour=flavour, fmi=fmi, drive="inputs", page=fmi == 3, certify=True
    )
    roles = related(path)
    assert roles == {
        "resources/mechanism.toml": "model",
        f"{FOLDER}/crank_rocker.ssv": "parameter",
        f"{FOLDER}/crank_rocker.exp": "experiment/smoke-test",
        "extra/org.kinfmu/crank_rocker_ref.csv": "result",
        "documentation/index.html": "document",
        **({"documentation/play.html": "document"} if fmi == 3 else {}),
        RECORD: "report",
        CERTIFICATE: "report",
    }
    with zipfile.ZipFile(path) as zipped:
        experiments = ET.fromstring(zipped.read(f"{FOLDER}/crank_rocker.exp"))  # noqa: S314
        with zipped.open(f"{FOLDER}/crank_rocker.ssv") as file:
            parameters = read_ssv(file, validate=True).parameters
        about = description.read(zipped.read("modelDescription.xml"), "")
        inside = set(zipped.namelist())
    (experiment,) = experiments
    assert [one.tag for one in experiment] == ["TransientSimulation", "Parameters", "Stimuli", "References"]
    for one in experiment[1:]:
        assert posixpath.normpath(posixpath.join(FOLDER, one.attrib["source"])) in inside
    assert float(experiment[0].attrib["stopTime"]) == about.interface.experiment.stop
    settable = {one.name for one in about.interface if one.causality == "parameter" and one.type != "Enumeration"}
    assert {one.name for one in parameters} == settable
    assert all(check.ok for check in conformance(path))


def _replaced(path: Path, new: Path, changed: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path) as before, zipfile.ZipFile(new, "w") as after:
        for name in before.namelist():
            after.writestr(name, changed.get(name, before.read(name)))
    return new


def test_the_record_is_checked_again_and_changes_are_found(tmp_path: Path) -> None:
    run = CliRunner().invoke
    path, again = tmp_path / "it.fmu", tmp_path / "again.fmu"
    for one in (path, again):
        done = run(main, ["build", "fourbar", "--certify", "--no-page", "--flavour", "python", "-o", str(one)])
        assert done.exit_code == 0, done.output
    assert path.read_bytes() == again.read_bytes()
    with zipfile.ZipFile(path) as zipped:
        content = json.loads(zipped.read(RECORD))
        files = set(zipped.namelist()) - {RECORD, MANIFEST}
        proof = json.loads(zipped.read(CERTIFICATE))
        table = zipped.read("extra/org.kinfmu/fourbar_ref.csv")
    assert set(content["files"]) == files
    assert set(content["checks"]) == {"description", "state", "results", "motion"}
    done = run(main, ["verify", str(path)])
    assert done.exit_code == 0
    lines = done.output.splitlines()
    assert lines[0].startswith(f"files       {len(files)} files, as {content['tool']} checked them; token {{")
    assert "motion      certified   crank from 60 deg to 420 deg" in done.output
    damaged = _replaced(path, tmp_path / "damaged.fmu", {"extra/org.kinfmu/fourbar_ref.csv": table + b"\n"})
    done = run(main, ["verify", str(damaged)])
    assert done.exit_code == 1
    assert "files: not as they were checked: extra/org.kinfmu/fourbar_ref.csv" in done.output
    proof["states"]["high"] += 1.0
    wrong = _replaced(path, tmp_path / "wrong.fmu", {CERTIFICATE: json.dumps(proof).encode()})
    named = {check.name: check for check in conformance(wrong)}
    assert (named["files"].ok, named["motion"].ok, named["state"].ok) == (False, False, True)
    other = kinfmu.build(kinfmu.load("crank_rocker"), tmp_path / "other.fmu", flavour="python", certify=True)
    with zipfile.ZipFile(other) as zipped:
        strange = _replaced(path, tmp_path / "strange.fmu", {CERTIFICATE: zipped.read(CERTIFICATE)})
    assert conformance(strange)[-1].text == f"{CERTIFICATE} is of another mechanism"
    assert conformance(_replaced(path, tmp_path / "bad.fmu", {RECORD: b"[]"}))[0].text.startswith(
        f"{RECORD} is damaged"
    )


def test_an_fmu_that_fails_a_check_is_refused(built: Build, tmp_path: Path) -> None:
    path = built("fourbar", "time")
    with zipfile.ZipFile(path) as zipped:
        name = "extra/org.kinfmu/fourbar_ref.csv"
        header, first, *rows = zipped.read(name).decode().splitlines()
    numbers = first.split(",")
    numbers[1] = repr(float(numbers[1]) + 1e-3)
    table = "\n".join([header, ",".join(numbers), *rows, ""]).encode()
    wrong = _replaced(path, tmp_path / "wrong.fmu", {name: table})
    with pytest.raises(FmuError, match="results: 21 outputs at 21 of 21 samples"):
        record(wrong)


def test_fmus_without_reference_results_or_record(built: Build, tmp_path: Path) -> None:
    torque = kinfmu.build(
        kinfmu.load("fourbar_loaded"), tmp_path / "t.fmu", flavour="python", drive="torque", checks=True
    )
    assert [(check.name, check.ok) for check in conformance(torque)] == [
        (name, True) for name in ("files", "description", "state", "results")
    ]
    assert set(related(torque).values()) == {"model", "parameter", "document", "report"}
    done = CliRunner().invoke(main, ["verify", str(torque)])
    assert done.exit_code == 0
    assert done.output.splitlines()[-1].startswith("results     no reference results: they depend on the efforts")
    (tmp_path / "host.csv").write_text("time,coupler.x\n0,1\n", encoding="utf-8")
    done = CliRunner().invoke(main, ["verify", str(torque), "--results", str(tmp_path / "host.csv")])
    assert done.exit_code == 1
    assert "efforts drive this FMU" in done.output
    assert "holds no record of checks" in conformance(built("fourbar", "time"))[0].text
    assert all(check.ok for check in conformance(built("fourbar", "inputs")))


def test_what_a_run_leaves_in_the_folder_is_not_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def state(folder: Path, _: object) -> Check:
        (folder / "resources" / "left.pyc").write_bytes(b"left")
        return Check("state", ok=True, text="left a file")

    monkeypatch.setattr("kinfmu.fmu.conformance._state", state)
    path = kinfmu.build(kinfmu.load("crank_rocker"), tmp_path / "it.fmu", flavour="python", checks=True)
    assert conformance(path)[0].ok


def test_an_fmu_is_built_below_a_folder_in_which_it_cannot_be_stepped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "a%20b"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    path = kinfmu.build(kinfmu.load("crank_rocker"), tmp_path / "it.fmu", flavour="python", checks=True)
    with zipfile.ZipFile(path) as zipped:
        assert json.loads(zipped.read(RECORD))["checks"]["state"].startswith("not stepped: the temporary folder ")
