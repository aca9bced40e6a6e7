"""Building python FMUs: reproducible, self-contained, with clear refusals."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from kinfmu.errors import RequestError
from kinfmu.fmu import build
from tests.fmu.conftest import GALLERY, mechanism

ROOT = GALLERY.parent
CONTENTS = """
import sys
from kinfmu.fmu.build import build
from kinfmu.fmu.native.archive import _contents
from kinfmu.fmu.variables import interface
from kinfmu.mechanism import toml_file
from kinfmu.plan import compile_plan
for path in sys.argv[1:]:
    mechanism = toml_file.read(path)
    sys.stdout.buffer.write(build(mechanism, "one.fmu", flavour="python").read_bytes())
    plan = compile_plan(mechanism)
    print(_contents(plan, interface(plan), "1", "2.0", "{x}", None))
"""
STEP = """
import sys
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
about = read_model_description(sys.argv[1])
identifier = about.coSimulation.modelIdentifier
slave = FMU2Slave(guid=about.guid, modelIdentifier=identifier, unzipDirectory=extract(sys.argv[1]))
slave.instantiate()
slave.setupExperiment(startTime=0.0)
slave.enterInitializationMode()
slave.exitInitializationMode()
before = set(sys.modules)
slave.doStep(0.0, 60.0)
references = {v.name: v.valueReference for v in about.modelVariables}
x, vx = slave.getReal([references["coupler.x"], references["coupler.vx"]])
foreign = [m for m in sys.modules if m.partition(".")[0] in ("kinfmu", "pythonfmu", "scipy")]
assert not foreign, foreign
assert set(sys.modules) == before, set(sys.modules) - before
print(repr(x))
slave.terminate()
slave.freeInstance()  # as hosts do; pythonfmu's library may abort at exit where an instance is left
"""


@pytest.mark.long
def test_two_builds_under_two_hash_seeds_are_the_same_bytes(tmp_path: Path) -> None:
    """FMUs of the python flavour, and all but the binaries of native ones."""
    paths = [str(GALLERY / name / "mechanism.toml") for name in ("fourbar", "double_pendulum")]
    built = []
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", CONTENTS, *paths]
        done = subprocess.run(command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, check=True)
        built.append(done.stdout)
    assert built[0] == built[1]


def test_fmu_runs_in_a_fresh_process_that_has_never_seen_kinfmu(fourbar: Path, tmp_path: Path) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", STEP, str(fourbar)],
        env=environment,
        cwd=tmp_path,
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == pytest.approx(1.5, abs=1e-12)


def test_archive_holds_mechanism_documentation_binaries_and_only_modules_named_after_their_content(
    fourbar: Path,
) -> None:
    with zipfile.ZipFile(fourbar) as zipped:
        names = zipped.namelist()
        entry = zipped.read("resources/slavemodule.txt").decode()
    assert names[0] == "modelDescription.xml"
    assert {"resources/mechanism.toml", "documentation/index.html", "binaries/linux64/fourbar.so"} <= set(names)
    package = entry.removesuffix("_slave")
    assert package.startswith("kinfmu_fourbar_")
    modules = [name for name in names if name.endswith(".py")]
    assert all(name.startswith((f"resources/{package}/", f"resources/{package}_slave.py")) for name in modules)


def test_documents_inside_list_requirements_and_licences(fourbar: Path) -> None:
    with zipfile.ZipFile(fourbar) as zipped:
        needs = zipped.read("documentation/externalDependencies.txt").decode()
        licence = zipped.read("documentation/licenses/license.txt").decode()
        other = zipped.read("documentation/licenses/pythonfmu.txt").decode()
    assert "a host process that holds Python" in needs
    assert "no Python packages" in needs
    assert (ROOT / "LICENSE").read_text("utf-8") in licence
    assert "pythonfmu, in pythonfmu.txt" in licence
    assert "MIT" in other


def test_token_changes_with_the_content(fourbar: Path, tmp_path: Path) -> None:
    from fmpy import read_model_description

    other = build(mechanism("fourbar"), tmp_path / "other.fmu", drive="inputs")
    assert read_model_description(str(fourbar)).guid != read_model_description(str(other)).guid


def test_outputs_can_be_chosen(tmp_path: Path) -> None:
    from kinfmu.fmu import simulate

    run = simulate(build(mechanism("fourbar"), tmp_path, outputs=["coupler.x"]), stop=3.0)
    assert run.outputs == ("coupler.x",)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"flavour": "natve"}, "flavour 'natve' is not known; did you mean 'native'.*flavours: python, native"),
        ({"drive": "input"}, "drive = 'input' is not known; did you mean 'inputs'"),
        ({"fmi": 3, "flavour": "python"}, "fmi = 3 needs flavour = 'native'; the python flavour is FMI 2.0"),
        ({"platforms": "all", "flavour": "python"}, "platforms = 'all' needs flavour = 'native'"),
        ({"path": "fourbar.zip"}, r"fourbar\.zip: is no folder, and the file of an FMU ends in \.fmu"),
    ],
)
def test_invalid_choices_are_refused_in_one_line(arguments: dict[str, str], words: str) -> None:
    with pytest.raises(RequestError, match=words):
        build(mechanism("fourbar"), **arguments)  # type: ignore[arg-type]


def test_folder_takes_the_name_of_the_mechanism_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = build(mechanism("fourbar"), tmp_path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.name == "fourbar.fmu"
