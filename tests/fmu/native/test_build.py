"""Building native FMUs: clean C, the same bytes each time, sources that others can compile, and clear messages."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.errors import CompilerError, FmuError, RequestError
from kinfmu.fmu.native import archive
from kinfmu.fmu.native.platforms import PLATFORMS, host
from kinfmu.fmu.native.sources import headers, sources
from kinfmu.fmu.variables import interface
from kinfmu.plan import compile_plan
from tests.fmu.conftest import Build
from tests.fmu.host import Host
from tests.fmu.test_parameters import linkage

STRICT = ("-O0", "-Wall", "-Wextra", "-Wconversion", "-Werror")


def _files(mechanism: kinfmu.Mechanism, version: str) -> dict[str, str]:
    plan = compile_plan(mechanism)
    return sources(plan, interface(plan, has_time=version == "3.0"), version, "{token}") | headers(version)


@pytest.mark.usefixtures("optimized")
@pytest.mark.parametrize(
    ("name", "version"),
    [pytest.param("fourbar", "3.0", marks=pytest.mark.long), ("five_bar", "2.0"), ("settable", "3.0")],
)
@pytest.mark.few(1)
def test_each_file_of_c_is_clean_under_strict_warnings(name: str, version: str) -> None:
    mechanism = linkage() if name == "settable" else kinfmu.load(name)
    assert compiler.shared_library(_files(mechanism, version), STRICT).exists()


def test_two_builds_are_the_same_bytes(built_native: Build, fmi: int, tmp_path: Path) -> None:
    first = built_native("fourbar", fmi)
    again = kinfmu.build(kinfmu.load("fourbar"), tmp_path / "again.fmu", flavour="native", fmi=fmi, drive="inputs")
    assert first.read_bytes() == again.read_bytes()


def test_archive_holds_binary_sources_documentation_and_mechanism(built_native: Build, fmi: int) -> None:
    with zipfile.ZipFile(built_native("fourbar", fmi)) as zipped:
        names = zipped.namelist()
    folder = host().folder(f"{fmi}.0")
    wanted = {f"binaries/{folder}/fourbar{host().suffix}", "documentation/index.html", "resources/mechanism.toml"}
    wanted |= {"sources/model.c", "sources/solver.c", f"sources/fmi{fmi}.c"}
    assert names[0] == "modelDescription.xml"
    assert wanted <= set(names)
    assert ("sources/buildDescription.xml" in names) == (fmi == 3)
    assert "documentation/licenses/license.txt" in names
    assert "documentation/externalDependencies.txt" not in names  # it has none
    assert not [name for name in names if name.endswith((".pdb", ".lib", ".o", f"fmi{5 - fmi}.c"))]


@pytest.mark.skipif(shutil.which("cmake") is None, reason="fmpy compile needs cmake")
@pytest.mark.long
def test_fmpy_compiles_the_sources_inside_and_the_result_is_the_same(
    built_native: Build, fmi: int, tmp_path: Path
) -> None:
    copy = tmp_path / "rebuilt.fmu"
    with zipfile.ZipFile(built_native("fourbar", fmi)) as given, zipfile.ZipFile(copy, "w") as stripped:
        for name in given.namelist():
            if not name.startswith("binaries/"):
                stripped.writestr(name, given.read(name))
    done = subprocess.run([sys.executable, "-m", "fmpy", "compile", str(copy)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    rebuilt, own = Host(copy, tmp_path / "a"), Host(built_native("fourbar", fmi), tmp_path / "b")
    for one in (rebuilt, own):
        one.initialize(0.0)
        one.set({"crank_angle": 1.0, "crank_speed": 2.0})
    assert rebuilt.outputs() == pytest.approx(own.outputs(), abs=1e-12)
    for one in (rebuilt, own):
        one.free()


def test_all_platforms_are_compiled_with_progress(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each for its own target, under its own name. Zig compiles two of them below."""
    targets: list[str | None] = []

    def compiled(_files: object, _flags: object, target: str | None = None) -> bytes:
        targets.append(target)
        return b"binary"

    monkeypatch.setattr(compiler, "shared_library_bytes", compiled)
    seen: list[tuple[int, int]] = []
    path = kinfmu.build(
        kinfmu.load("fourbar"),
        tmp_path / "all.fmu",
        flavour="native",
        platforms="all",
        progress=lambda done, count: seen.append((done, count)),
    )
    with zipfile.ZipFile(path) as zipped:
        binaries = {name for name in zipped.namelist() if name.startswith("binaries/")}
    assert binaries == {f"binaries/{one.fmi2}/fourbar{one.suffix}" for one in PLATFORMS}
    assert targets == [one.target for one in PLATFORMS]
    assert seen == [(k, len(PLATFORMS)) for k in range(len(PLATFORMS) + 1)]


@pytest.mark.skipif(find_spec("ziglang") is None, reason="other platforms need ziglang")
@pytest.mark.long
def test_zig_compiles_for_other_platforms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Zig's first library for windows takes minutes; of the others, one for each system.
    quick = tuple(one for one in PLATFORMS if one.name in ("aarch64-linux", "aarch64-darwin"))
    monkeypatch.setattr(archive, "PLATFORMS", quick)
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    path = kinfmu.build(kinfmu.load("fourbar"), tmp_path / "all.fmu", flavour="native", platforms="all")
    with zipfile.ZipFile(path) as zipped:
        binaries = {name for name in zipped.namelist() if name.startswith("binaries/")}
    assert binaries == {f"binaries/{one.fmi2}/fourbar{one.suffix}" for one in quick}
    assert list(here.iterdir()) == []


def test_other_platforms_without_zig_are_refused_with_what_brings_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(compiler, "find_spec", lambda _: None)
    with pytest.raises(CompilerError, match=r"needs ziglang; pip install 'kinfmu\[native\]'"):
        kinfmu.build(kinfmu.load("fourbar"), tmp_path, flavour="native", platforms="all")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"flavour": "native", "fmi": 1}, "fmi = 1 is not known; known: 2, 3"),
        ({"flavour": "native", "platforms": "hots"}, "platforms = 'hots' is not known; did you mean 'host'"),
        ({"flavour": "python", "fmi": 3}, "the python flavour is FMI 2.0 on pythonfmu's platforms"),
        ({"flavour": "python", "platforms": "all"}, "the python flavour is FMI 2.0 on pythonfmu's platforms"),
    ],
)
def test_invalid_choices_are_refused_in_one_line(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(RequestError, match=words):
        kinfmu.build(kinfmu.load("fourbar"), **arguments)  # type: ignore[arg-type]


def test_platforms_that_fmi_has_no_name_for_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.machine", lambda: "s390x")
    with pytest.raises(FmuError, match="no native FMUs are built for s390x-"):
        archive.archive(compile_plan(kinfmu.load("fourbar")), "time", "1", "2.0", "host")
