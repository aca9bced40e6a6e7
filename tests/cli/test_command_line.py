"""The command line: colours, completion, hints, suffixes and new folders."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.cli import main
from kinfmu.files import suffix_of
from kinfmu.log import write_mcap
from kinfmu.mechanism import gallery
from tests.cli.conftest import Command
from tests.design.study.linkage import write
from tests.log.runs import fourbar

pty = pytest.importorskip("pty", reason="pseudo-terminals are those of POSIX")

COLOUR = re.compile(rb"\x1b\[[0-9;:]*m")
PROGRESS = "from kinfmu.cli.group import Progress\nwith Progress('solving', 1) as show:\n    show(1, 2); show(2, 2)"
MODULE = ("-m", "kinfmu")


def on_a_terminal(arguments: tuple[str, ...], folder: Path, variables: dict[str, str]) -> bytes:
    """Return what Python prints with these arguments where stdin, stdout and stderr are a terminal."""
    ours, its = pty.openpty()
    environment = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    environment |= {"TERM": "xterm-256color", **variables}
    process = subprocess.Popen(
        [sys.executable, *arguments], cwd=folder, env=environment, stdin=its, stdout=its, stderr=its
    )
    os.close(its)
    printed = b""
    try:
        while read := os.read(ours, 65536):
            printed += read
    except OSError:  # EIO on Linux: the program closed its side
        pass
    finally:
        os.close(ours)
        process.wait(timeout=60)
    return printed


@pytest.mark.parametrize("columns", ["60", "80", "200"])
@pytest.mark.few(2)
def test_a_report_is_coloured_on_a_terminal_as_wide_as_it(columns: str, tmp_path: Path) -> None:
    arguments = (*MODULE, "check", "jansen_leg")
    printed = on_a_terminal(arguments, tmp_path, {"COLUMNS": columns})
    plain = on_a_terminal(arguments, tmp_path, {"COLUMNS": columns, "NO_COLOR": "1"})
    assert b"\x1b[32m  ok" in printed
    assert b"\x1b[31m8.648 deg" in printed
    assert [line.rstrip() for line in COLOUR.sub(b"", printed).splitlines()] == plain.splitlines()
    lines = plain.decode().splitlines()
    width = max(map(len, lines))
    assert width <= int(columns)
    assert (width > 80) == (columns == "200")
    assert any(line.startswith("kinfmu play jansen_leg moves it") for line in lines[-2:])


@pytest.mark.parametrize(
    ("arguments", "contains"),
    [
        ((*MODULE, "list"), b"fourbar"),
        ((*MODULE, "check", "fourbr"), b"did you mean"),
        ((*MODULE, "check", "--help"), b"--figure"),
        ((*MODULE, "chek"), b"Usage"),
        ((*MODULE, "solve", "double_pendulum", "-o", "run.csv", "--times", "0:3:0.5"), b"crank = 6.54"),
        (("-c", PROGRESS), b"100%"),
    ],
    ids=["list", "error", "help", "usage", "limit", "progress"],
)
@pytest.mark.few(1)
def test_commands_on_a_terminal_print_no_colours(arguments: tuple[str, ...], contains: bytes, tmp_path: Path) -> None:
    printed = on_a_terminal(arguments, tmp_path, {})
    assert contains in printed
    assert not COLOUR.search(printed)
    assert on_a_terminal(arguments, tmp_path, {"NO_COLOR": "1"}) == printed


def test_a_program_with_colours_would_be_found(tmp_path: Path) -> None:
    printed = on_a_terminal(("-c", "import click; click.secho('red', fg='red')"), tmp_path, {})
    assert COLOUR.search(printed)


# ----------------------------------------------------------------------------------------------------------- completion


SCRIPT = """
eval "$(_KINFMU_COMPLETE=bash_source kinfmu)"
for line in "kinfmu rev" "kinfmu check four" "kinfmu simulate --st" "kinfmu check mi"; do
    read -ra COMP_WORDS <<<"$line"
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
    COMPREPLY=()
    compopt() { COMPREPLY+=("by bash"); } # outside a completion there is nothing to set
    _kinfmu_completion kinfmu
    echo "${COMPREPLY[*]}"
done
"""


def test_bash_completes_commands_gallery_options_and_files(tmp_path: Path) -> None:
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("there is no bash")
    program = tmp_path / "kinfmu"
    program.write_text(
        f'#!/bin/sh\nexec "{sys.executable}" -c "from kinfmu.cli import main; main(prog_name=\'kinfmu\')" "$@"\n',
        encoding="utf-8",
    )
    program.chmod(0o755)
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        [bash, "-c", SCRIPT], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    commands, names, options, files = done.stdout.splitlines()
    assert commands == "review"
    assert names.split() == [name for name in gallery.names() if name.startswith("four")]
    assert options.split() == ["--start", "--stop", "--step"]
    assert files == "by bash"


# ---------------------------------------------------------------------------------------------------------------- hints


NAMES = "|".join(sorted(main.commands))
HINT = re.compile(rf"kinfmu ((?:{NAMES}) [^;|]*)")
FOLDERS = ["a b", "it's", 'the "best" one', "$HOME & more"]
FIT = """mechanism = "mine.toml"
unknowns.crank = [0.9, 1.1]
[targets.curve]
type = "path"
of = "coupler.B"
points = [[1.0, 1.0], [1.5, 1.0]]
step = "30 deg"
start = "80 deg"
"""


def hints(text: str) -> dict[str, list[str]]:
    """Return the words of the commands in a text, by the name of the command; a ValueError where quotes are open."""
    found = [shlex.split(match[1]) for line in text.splitlines() for match in HINT.finditer(line)]
    return {words[0]: words[1:] for words in found}


def test_a_hint_without_quotes_is_found() -> None:
    assert hints("run.mcap: written; next: kinfmu check a b/mine.toml") == {"check": ["a", "b/mine.toml"]}
    with pytest.raises(ValueError, match="No closing quotation"):
        hints("run.mcap: written; next: kinfmu check it's/mine.toml")


@pytest.mark.parametrize("name", FOLDERS)
@pytest.mark.parametrize("is_absolute", [False, True])
@pytest.mark.few(1)
def test_suggested_commands_name_the_file_also_in_folders_with_blanks_and_quotes(
    name: str, is_absolute: bool, command: Command, tmp_path: Path
) -> None:
    folder = (tmp_path if is_absolute else Path()) / name
    (tmp_path / name).mkdir()
    mine, run, fmu = folder / "mine.toml", folder / "run.mcap", folder / "mine.fmu"
    suggested: dict[str, dict[str, list[str]]] = {}

    def says(*arguments: object, status: int = 0) -> None:
        result = command(*arguments)
        assert result.exit_code == status, result.stderr
        suggested.setdefault(str(arguments[0]), {}).update(hints(result.stdout + result.stderr))

    says("new", "fourbar", mine)
    says("check", mine)
    says("solve", mine, "-o", folder / "solved.csv")
    says("export", mine, "-o", folder / "mine.gif", status=2)
    assert suggested["export"] == {"solve": [str(mine), "-o", str(folder / "mine.mcap")]}
    assert command("solve", *suggested.pop("export")["solve"]).exit_code == 0
    says("build", mine, "-o", fmu, "--flavour", "python")
    says("simulate", fmu, "--stop", 0.2, "--step", 0.1, "--mcap", run)
    says("export", run, "-o", folder / "run.csv")
    content = run.read_bytes()
    cut = folder / "cut.mcap"
    cut.write_bytes(content[: 9 * len(content) // 10])
    says("export", cut, "-o", folder / "cut.csv", status=1)
    says("review", cut, "--save", folder / "cut.rrd", status=1)
    driven = folder / "driven.fmu"
    says("build", "fourbar_loaded", "-o", driven, "--flavour", "python", "--drive", "torque")
    says("verify", driven, "--results", folder / "run.csv", status=1)

    assert {one: found for one, found in suggested.items() if found} == {
        "new": {"check": [str(mine)], "play": [str(mine)]},
        "simulate": {"review": [str(run)]},
        "export": {"recover": [str(cut), "keeps", "what", "is", "left"]},
        "review": {"recover": [str(cut), "keeps", "what", "is", "left"]},
        "verify": {"simulate": [str(driven)]},
    }


@pytest.mark.parametrize("name", FOLDERS)
@pytest.mark.few(2)
def test_studies_and_fits_suggest_no_command_that_names_a_file_without_quotes(
    name: str, tmp_path: Path, command: Command
) -> None:
    folder = tmp_path / name
    folder.mkdir()
    study = write(folder, 'mechanism = "hoeken.toml"\nparameters.base = { from = 40, to = 300, count = 3 }\n')
    kinfmu.save(kinfmu.load("fourbar"), folder / "mine.toml")
    (folder / "fit.toml").write_text(FIT, encoding="utf-8")
    for arguments in (
        ("study", study, "-o", folder / "found.parquet", "--workers", 1),
        ("fit", folder / "fit.toml", "-o", folder / "fitted.toml", "--starts", 1, "--workers", 1),
    ):
        result = command(*arguments)
        for words in hints(result.stdout + result.stderr).values():
            assert all(Path(word).exists() for word in words if str(tmp_path) in word)


# ------------------------------------------------------------------------------------------------------------- suffixes


BEGINNINGS = {"SVG": b"<?xml", "PNG": b"\x89PNG", "NPZ": b"PK", "PARQUET": b"PAR1", "GIF": b"GIF89a", "CSV": b"time,"}


@pytest.fixture
def record(tmp_path: Path) -> Path:
    path = tmp_path / "RUN.MCAP"
    write_mcap(fourbar(np.arange(5.0)), path)
    return path


def test_the_suffix_of_a_name_is_in_small_letters() -> None:
    assert [suffix_of(name) for name in ("run.MCAP", Path("a.b/RUN.Mcap"), "run", ".hidden")] == [
        ".mcap",
        ".mcap",
        "",
        "",
    ]


@pytest.mark.parametrize("suffix", BEGINNINGS)
@pytest.mark.few(2)
def test_a_run_is_exported_by_a_suffix_in_capitals(suffix: str, record: Path, command: Command, tmp_path: Path) -> None:
    if suffix == "PARQUET":
        pytest.importorskip("pyarrow")
    assert command("export", record, "-o", f"E.{suffix}").exit_code == 0
    assert (tmp_path / f"E.{suffix}").read_bytes().startswith(BEGINNINGS[suffix])
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"E.{suffix}", "RUN.MCAP"]


def test_a_mechanism_file_is_checked_solved_built_and_simulated(
    fourbar_file: Callable[..., Path], command: Command, tmp_path: Path
) -> None:
    file = fourbar_file(name="MINE.TOML").name
    for call in (
        ("check", file, "--figure", "F.SVG"),
        ("solve", file, "-o", "T.NPZ", "--times", "0:2:1"),
        ("build", file, "-o", "MINE.FMU"),
        ("simulate", "MINE.FMU", "--stop", 2),
        ("simulate", file, "--stop", 2, "--mcap", "S.MCAP", "--rrd", "S.RRD"),
    ):
        assert command(*call).exit_code == 0, call
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    logs = {str(Path("logs") / name) for name in ("MINE.mcap", "MINE.rrd")}
    assert names == {"F.SVG", "MINE.FMU", "MINE.TOML", "S.MCAP", "S.RRD", "T.NPZ"} | logs
    with np.load(tmp_path / "T.NPZ") as table:
        assert table["time"].tolist() == [0.0, 1.0, 2.0]


def test_runs_are_reviewed(record: Path, command: Command, refuses: Callable[..., str]) -> None:
    assert command("review", record, "--save", "R.RRD").stdout == "written: R.RRD\n"
    assert command("review", record, record, "--save", "BOTH.RRD").stdout == "written: BOTH.RRD\n"
    message = refuses("review", "R.RRD", "--save", "again.rrd")
    assert message == "R.RRD: a recording cannot be saved as another; give the run's .mcap file"
    assert "did you mean 'RUN.MCAP'?" in refuses("review", "RUNS.MCAp")


# ---------------------------------------------------------------------------------------------------------- new folders


@pytest.fixture
def recorded(command: Command) -> str:
    assert command("simulate", "fourbar", "--stop", "1", "--mcap", "new/logs/run.mcap").exit_code == 0
    return "new/logs/run.mcap"


def test_simulate_makes_the_folders_of_record_and_recording(recorded: str) -> None:
    assert Path(recorded).is_file()
    assert Path("new/logs/run.rrd").is_file()
    assert not Path("logs").exists()


@pytest.mark.parametrize(
    "words",
    [
        "check fourbar --figure {}.svg",
        "new fourbar {}.toml",
        "schema -o {}.json",
        "solve fourbar --times 0:1:1 -o {}.csv",
        "solve fourbar --times 0:1:1 -o {}.mcap",
        "build fourbar -o {}.fmu",
        "build fourbar --ssp -o {}.ssp",
        "export cam_roller --cam pitch -o {}.csv",
    ],
)
@pytest.mark.few(2)
def test_a_command_makes_the_folders_of_its_file(words: str, command: Command) -> None:
    target = words.split("{}")[1]
    done = command(*words.format("new/deep/it").split())
    assert done.exit_code == 0, done.stderr
    assert Path(f"new/deep/it{target}").is_file()


@pytest.mark.parametrize("ending", [".csv", ".npz", ".svg", ".dxf"])
@pytest.mark.few(1)
def test_export_makes_the_folders_of_its_file(ending: str, recorded: str, command: Command) -> None:
    done = command("export", recorded, "-o", f"other/deep/run{ending}")
    assert done.exit_code == 0, done.stderr
    assert Path(f"other/deep/run{ending}").is_file()


@pytest.mark.parametrize(
    "words", ["solve {} -o new/run.csv", "check {} --figure new/f.svg", "simulate {} --mcap new/a.mcap"]
)
def test_a_command_that_fails_leaves_no_folder(words: str, fails: Callable[..., str]) -> None:
    Path("bad.toml").write_text('name = "bad"\n', encoding="utf-8")
    fails(*words.format("bad.toml").split())
    assert not Path("new").exists()


# ----------------------------------------------------------------------------------------------------------------- play


@pytest.mark.skipif(os.name != "posix", reason="sends Ctrl-C as a signal")
def test_play_prints_the_address_of_the_page_and_ends_with_ctrl_c(tmp_path: Path) -> None:
    arguments = [sys.executable, "-m", "kinfmu", "play", "crank_rocker", "--no-browser"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as play:
        assert play.stdout is not None
        address = play.stdout.readline().strip()
        with urllib.request.urlopen(address, timeout=30) as answer:  # noqa: S310  its own server
            assert b"<title>crank_rocker</title>" in answer.read()
        play.send_signal(signal.SIGINT)
        try:
            assert "Traceback" not in play.communicate(timeout=30)[1]
        finally:
            play.kill()  # else leaving the block waits for a program that does not end
        assert play.returncode == 0


@pytest.mark.parametrize(("given", "expected"), [(None, "1"), ("3", "3")])
def test_commands_use_one_thread_for_small_matrices_unless_more_are_set(
    given: str | None, expected: str, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if given:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
    command("list")
    assert os.environ["OPENBLAS_NUM_THREADS"] == expected
