"""The repository: imports, circles and scripts."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
LOGGING = {"mcap", "zstandard", "lz4", "rerun", "pyarrow", "pandas", "polars"}
HEAVY = {"numpy", "scipy", "pythonfmu", "fmpy", "PIL", "matplotlib", "importlib.metadata"} | LOGGING


def loaded_by(statement: str) -> set[str]:
    """Names of all modules that a fresh process has loaded after a statement."""
    done = subprocess.run(
        [sys.executable, "-c", f"{statement}\nimport sys\nprint(*sys.modules)"],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
        check=True,
    )
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("statement", "late"),
    [
        ("import kinfmu", HEAVY | {"click"}),
        ("import kinfmu; kinfmu.load; kinfmu.Mechanism; kinfmu.Body", HEAVY | {"click"}),
        ("import kinfmu.solver.python", HEAVY | {"click"}),
        ("import kinfmu.cli", HEAVY),
        (
            "from kinfmu.log import read, review, write_mcap, write_rrd, write_table",
            HEAVY - {"numpy", "importlib.metadata"},
        ),
        ("from kinfmu.draw import animate, cam, dxf, figure, plot, svaj", HEAVY - {"numpy", "importlib.metadata"}),
        ("import kinfmu.fmu", HEAVY - {"numpy", "importlib.metadata"}),
    ],
)
@pytest.mark.few(2)
def test_importing_loads_no_heavy_package(statement: str, late: set[str]) -> None:
    loaded = loaded_by(statement)
    assert "kinfmu" in loaded
    assert loaded & late == set()


@pytest.mark.long
def test_building_and_stepping_an_fmu_loads_nothing_to_log_with(tmp_path: Path) -> None:
    statement = (
        f"import kinfmu; fmu = kinfmu.build(kinfmu.load('fourbar'), {str(tmp_path / 'fourbar.fmu')!r}); "
        "run = kinfmu.simulate(fmu, stop=1.0); assert len(run) == 2"
    )
    loaded = loaded_by(statement)
    assert {"kinfmu.fmu.host.simulate", "fmpy"} <= loaded
    assert loaded & LOGGING == set()
    assert not [name for name in loaded if name.startswith("kinfmu.log")]


COMMANDS = (
    "list",
    "new crank_rocker mine.toml",
    "schema",
    "check mine.toml --matrices",
    "check fourbar --assemblies",
    "check cam_roller",
    "check flat_face_lever",
    "check parallel_jaw",
    "solve mine.toml -o run.csv",
    "solve mine.toml -o run.mcap --times 0:1:0.1",
    "export run.mcap -o again.csv",
    "build mine.toml --flavour python -o mine.fmu",
    "simulate mine.fmu --stop 0.1",
)


@pytest.mark.long
def test_commands_load_neither_scipy_nor_pandas(tmp_path: Path) -> None:
    statement = f"""
import os, sys
os.chdir({str(tmp_path)!r})
sys.path.insert(0, {str(CHECKOUT)!r})
from kinfmu.cli import main
for command in {COMMANDS!r}:
    main(command.split(), standalone_mode=False)
    assert not {{"scipy", "pandas"}} & sys.modules.keys(), command
"""
    assert "fmpy" in loaded_by(statement)


def test_writing_and_reading_a_record_loads_no_viewer(tmp_path: Path) -> None:
    path = str(tmp_path / "run.mcap")
    statement = (
        f"import kinfmu; run = kinfmu.solve(kinfmu.load('fourbar')); kinfmu.log.write_mcap(run, {path!r}); "
        f"assert len(kinfmu.log.read({path!r})) == 181"
    )
    assert loaded_by(statement) & LOGGING == {"zstandard"}


# -------------------------------------------------------------------------------------------------------------- circles


FILES = sorted((CHECKOUT / "kinfmu").rglob("*.py"))


def module_of(path: Path) -> str:
    parts = path.relative_to(CHECKOUT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in FILES}


def imported(path: Path) -> Iterator[str]:
    package = module_of(path).split(".") if path.name == "__init__.py" else module_of(path).split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names if name.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join([*package[: len(package) + 1 - node.level], *([node.module] if node.module else [])])
            source = base if node.level else str(node.module)
            for name in node.names:
                submodule = f"{source}.{name.name}"
                yield from [submodule] if submodule in MODULES else [source] if source in MODULES else []


@pytest.mark.long
def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {name: set(imported(path)) - {name} for name, path in MODULES.items()}
    assert "kinfmu.errors" in graph["kinfmu.fmu.host.simulate"]
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(reversed(error.args[1])))


# -------------------------------------------------------------------------------------------------------------- scripts


SCRIPTS = sorted(path for path in (CHECKOUT / "scripts").iterdir() if not path.suffix)


@pytest.mark.parametrize("script", ["setup", "demo", "check", "docs", "graphics", "browser", "video", "shape"])
def test_help_is_printed_without_setting_anything_up(script: str, tmp_path: Path) -> None:
    shutil.copytree(CHECKOUT / "scripts", tmp_path / "scripts")
    done = subprocess.run([tmp_path / "scripts" / script, "--help"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith(f"scripts/{script}")
    assert "set -euo" not in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["scripts"]


@pytest.mark.parametrize("script", ["setup", "demo", "docs", "graphics", "browser", "video"])
def test_an_argument_without_meaning_is_wrong_usage(script: str) -> None:
    done = subprocess.run([CHECKOUT / "scripts" / script, "all"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, f"kinfmu: scripts/{script} takes no arguments, got 'all'\n")


@pytest.mark.parametrize("script", [*SCRIPTS, CHECKOUT / ".ci" / "run"], ids=lambda path: path.name)
def test_every_script_is_executable_and_ends_at_an_error(script: Path) -> None:
    assert script.stat().st_mode & 0o111 == 0o111
    assert "\nset -euo pipefail\n" in script.read_text()
