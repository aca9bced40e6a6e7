"""Exit statuses, of commands that are stopped and of those that find a full disk too."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

import kinfmu
from kinfmu import log
from kinfmu.cli import main
from kinfmu.mechanism import gallery
from tests.cli.conftest import Command
from tests.gallery_members import mostly_long

FILES = {
    "broken.toml": "name = 'broken'\n[bodies.crank]\nponts = {}\n",
    "folder.toml": None,
    "text.fmu": "no archive",
    "damaged.mcap": "no record",
    "picture.rrd": "no recording",
    "no_time.csv": "crank_angle\n0\n",
    "words.csv": "time,crank_angle\n0,0\n1,far\n",
    "short.csv": "time,crank_angle\n0,0\n1,0.5\n",
    "past.csv": "time,crank_angle [deg]\n0,300\n2,380\n",
}

# arguments, and words of the message
WRONG_USAGE = [
    ("list fourbar", "unexpected extra argument"),
    ("check", "Missing argument 'MECH'"),
    (
        "check forbar",
        "Invalid value for 'MECH': 'forbar' is not in the gallery; did you mean 'fourbar'?; "
        f"gallery: {', '.join(gallery.names())}; files end in .toml",
    ),
    ("check contradictin.tml", "did you mean 'contradicting.toml'?"),
    ("check folder", "did you mean 'folder.toml'?"),
    ("check contradicting", "did you mean 'contradicting.toml'?"),
    ("check none.toml", "none.toml: there is no such file"),
    (f"check {'n' * 5000}.toml", ": there is no such file"),
    ("check contradictin.toml", "did you mean 'contradicting.toml'?"),
    ("check folder.toml", "folder.toml: is a folder"),
    ("check fourbar_chain:0", "the count must be a whole number from 1 to"),
    ("check fourbar --figure four.gif", "four.gif: its name must end in one of .svg, .png, .pdf"),
    ("check fourbar --figure short.csv/four.svg", "'short.csv' is a file, not a folder"),
    ("check fourbar --set a=1", "there is no parameter 'a'"),
    ("check fourbar --set crank.speed=1mm", "unit 'mm' must be one of rad/s"),
    ("report fourbar", "Missing option '-o'"),
    ("report fourbar -o report.txt", "report.txt: its name must end in one of .html, .pdf"),
    ("report fourbar -o report", "report: its name must end in one of .html, .pdf"),
    ("report fourbar -o short.csv/four.pdf", "'short.csv' is a file, not a folder"),
    ("new forbar mine.toml", "did you mean 'fourbar'?"),
    ("new fourbar mine.txt", "mine.txt: its name must end in .toml"),
    ("new fourbar broken.toml", "broken.toml: exists already"),
    ("new fourbar short.csv/mine.toml", "'short.csv' is a file, not a folder"),
    ("schema -o short.csv/schema.json", "'short.csv' is a file, not a folder"),
    ("solve fourbar", "Missing option '-o'"),
    ("solve forbar -o run.csv", "did you mean 'fourbar'?"),
    ("solve fourbar -o run", "run: its name must end in one of .csv, .xlsx, .parquet, .npz, .mcap"),
    ("solve fourbar -o run.xls", "run.xls: its name must end in one of .csv, .xlsx, .parquet, .npz, .mcap"),
    ("solve fourbar -o short.csv/run.csv", "'short.csv' is a file, not a folder"),
    ("solve fourbar -o run.csv --set crank.sped=1", "did you mean 'crank.speed'?"),
    ("solve fourbar -o run.csv --outputs roker.phi", "did you mean 'rocker.phi'?"),
    ("solve fourbar -o run.csv --times 0:1", "must be A:B:STEP"),
    ("solve fourbar -o run.csv --angle 0:1:2 --times 0:1:1", "exclude each other"),
    ("solve five_bar -o run.csv --angle 0:1:2", "five_bar has left, right; simulate --input drives them"),
    ("solve fourbar -o run.csv --angle 0:1:2 --set crank.speed=2", "give --times A:B:STEP in place of --angle"),
    ("solve fourbar -o run.csv --engine nativ", "'nativ' is not one of"),
    ("import none.dxf", "none.dxf: there is no such file"),
    ("import short.csv -o run.csv", "run.csv: its name must end in .toml"),
    ("build forbar", "did you mean 'fourbar'?"),
    ("build fourbar -o four.zip", "four.zip: is no folder, and the file of an FMU ends in .fmu"),
    ("build fourbar --flavour python --fmi 3", "--fmi 3 needs --flavour native; the python flavour has --fmi 2"),
    ("build fourbar --flavour python --platforms all", "--platforms all needs --flavour native"),
    ("build fourbar --set crank.sped=1", "did you mean 'crank.speed'?"),
    ("build fourbar --outputs roker.phi", "did you mean 'rocker.phi'?"),
    ("simulate none.fmu", "none.fmu: there is no such file"),
    ("simulate forbar", "did you mean 'fourbar'?"),
    ("simulate fourbar --input none.csv", "none.csv: there is no such file"),
    ("simulate fourbar --mcap short.csv/run.mcap", "'short.csv' is a file, not a folder"),
    ("simulate fourbar --mcap run.txt", "Invalid value for '--mcap': run.txt: its name must end in .mcap"),
    ("simulate fourbar --rrd run.txt", "Invalid value for '--rrd': run.txt: its name must end in .rrd"),
    ("simulate motion.csv", "files end in .toml or .fmu or .ssp"),
    (
        "simulate fourbar --set crank.sped=1",
        "--set: there is no parameter 'crank.sped'; did you mean 'crank.speed'?; "
        "parameters: crank.start, crank.speed, solver.tolerance, driven_by_time, rates",
    ),
    ("simulate fourbar.fmu --set crank.sped=1", "did you mean 'crank.speed'?"),
    ("simulate fourbar.fmu --set crank.speed=1mm", "unit 'mm' must be one of rad/s"),
    (
        "simulate fourbar --step 0",
        "start = 0 s, stop = 180 s, step = 0 s: a run needs finite times, start <= stop and a positive step",
    ),
    ("simulate fourbar --step fast", "'fast' is not a number (units: s, ms, min, h)"),
    ("simulate fourbar --start 3 --stop 1", "start <= stop"),
    ("simulate fourbar --wrap", "--wrap needs --input"),
    ("simulate fourbar --input short.csv --stop 2", "holds 0 to 1 s, the run goes from 0 to 2 s"),
    ("review none.mcap", "none.mcap: there is no such file"),
    ("review short.csv", "short.csv: its name must end in one of .mcap, .rrd"),
    ("review damaged.mcap none.mcap", "none.mcap: there is no such file"),
    ("review picture.rrd --save run.rrd", "picture.rrd: a recording cannot be saved as another; give the run's .mcap"),
    ("review picture.rrd damaged.mcap", "picture.rrd: a recording cannot be compared"),
    ("review damaged.mcap --at 3", "--at needs --screenshot"),
    ("review whole.mcap --screenshot run.png --at 5", "at = 5 s is outside the run, t = 0 to 2 s"),
    ("review damaged.mcap --save run.txt", "run.txt: its name must end in .rrd"),
    ("review damaged.mcap --screenshot run.jpg", "run.jpg: its name must end in .png"),
    ("export none.mcap -o run.csv", "none.mcap: there is no such file"),
    ("export short.csv -o run.csv", "short.csv: its name must end in .toml or .mcap"),
    ("export damaged.mcap", "Missing option '-o'"),
    ("export damaged.mcap -o run.xls", "run.xls: its name must end in one of .csv"),
    ("export damaged.mcap -o short.csv/run.csv", "'short.csv' is a file, not a folder"),
    ("recover none.mcap", "none.mcap: there is no such file"),
    ("recover damaged.mcap -o run.csv", "run.csv: its name must end in .mcap"),
    ("simulate fourbar --channels q,qddd", "channel 'qddd' is not known; did you mean 'qdd'?"),
    ("simulate fourbar --rate 0", "0.0 is not in the range"),
    ("study none.toml", "none.toml: there is no such file"),
    ("study short.csv", "short.csv"),
    ("fit none.toml", "none.toml: there is no such file"),
    ("fit short.csv", "short.csv"),
    ("play forbar", "did you mean 'fourbar'?"),
    ("play", "name a mechanism to play, or with --new the file of one to draw"),
    ("play fourbar --new mine.toml", "name a mechanism to play, or with --new the file of one to draw"),
    ("play --new mine.txt", "mine.txt: its name must end in .toml"),
    ("play --new broken.toml", "broken.toml is there already; kinfmu play broken.toml opens it"),
    ("verify none.fmu", "none.fmu: there is no such file"),
    ("verify short.csv", "short.csv: its name must end in one of .fmu, .json"),
]
AT_FAULT = [
    ("import broken.toml", "broken.toml: is not a link of PMKS+, a .linkage2 file of Linkage, or a DXF drawing"),
    ("import https://example.org/", "is an address without a drawing"),
    ("check broken.toml", "broken.toml: [bodies.crank] ponts: unknown key"),
    ("check contradicting.toml", "contradicts the other joints"),
    ("report broken.toml -o report.html", "broken.toml: [bodies.crank] ponts: unknown key"),
    ("solve broken.toml -o run.csv", "broken.toml: [bodies.crank] ponts: unknown key"),
    ("solve contradicting.toml -o run.csv", "contradicts the other joints"),
    ("solve double_pendulum -o run.csv --times 0:3:1", "cannot be reached"),
    ("build broken.toml", "broken.toml: [bodies.crank] ponts: unknown key"),
    ("build contradicting.toml", "contradicts the other joints"),
    ("simulate broken.toml", "broken.toml: [bodies.crank] ponts: unknown key"),
    ("simulate text.fmu", "text.fmu: is no FMU"),
    ("simulate double_pendulum --stop 3 --step 1", "cannot be reached"),
    ("simulate double_pendulum --step 1 --input past.csv", "cannot be reached"),
    ("simulate fourbar --input no_time.csv", "the column 'time' is missing"),
    ("simulate fourbar --input words.csv", "line 3: crank_angle = 'far' is not a number"),
    ("review damaged.mcap --save run.rrd", "damaged.mcap"),
    ("export damaged.mcap -o run.csv", "damaged.mcap: not a whole MCAP file"),
    ("recover damaged.mcap", "nothing can be recovered"),
    ("study broken.toml", "broken.toml: "),
    ("play broken.toml --no-browser", "broken.toml: [bodies.crank] ponts: unknown key"),
    ("verify text.fmu", "text.fmu: is no FMU"),
    ("fit broken.toml", "broken.toml: "),
]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """An FMU and a record, made once."""
    path, mechanism = tmp_path_factory.mktemp("made"), kinfmu.load("fourbar")
    kinfmu.build(mechanism, path / "fourbar.fmu")
    kinfmu.log.write_mcap(kinfmu.solve(mechanism, [0.0, 1.0, 2.0]), path / "whole.mcap")
    return {file.name: file.read_bytes() for file in path.iterdir()}


@pytest.fixture
def folder(tmp_path: Path, made: dict[str, bytes]) -> Path:
    """What is there: files with and without faults."""
    for name, text in FILES.items():
        if text is None:
            (tmp_path / name).mkdir()
        else:
            (tmp_path / name).write_text(text, encoding="utf-8")
    fourbar = (gallery.folder() / "fourbar" / "mechanism.toml").read_text(encoding="utf-8")
    assert "length = 1\n" in fourbar
    (tmp_path / "contradicting.toml").write_text(fourbar.replace("length = 1\n", "length = 1.01\n"), encoding="utf-8")
    for name, content in made.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


@pytest.mark.parametrize(("arguments", "message"), WRONG_USAGE, ids=[arguments for arguments, _ in WRONG_USAGE])
@pytest.mark.few(6)
def test_wrong_usage_is_reported_with_status_two_and_leaves_nothing_behind(
    arguments: str, message: str, refuses: Callable[..., str], folder: Path
) -> None:
    before = sorted(folder.iterdir())
    assert message in refuses(*arguments.split())
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(("arguments", "message"), AT_FAULT, ids=[arguments for arguments, _ in AT_FAULT])
@pytest.mark.few(7)
def test_a_fault_of_the_mechanism_or_of_the_run_is_reported_with_status_one(
    arguments: str, message: str, command: Command, folder: Path
) -> None:
    assert folder.is_dir()
    result = command(*arguments.split())
    assert result.exit_code == 1
    *_, last = result.stderr.splitlines()
    assert last.startswith("kinfmu: ")
    assert message in last


def test_every_command_that_can_be_at_fault_is_in_the_tables() -> None:
    refused, at_fault = ({arguments.split()[0] for arguments, _ in table} for table in (WRONG_USAGE, AT_FAULT))
    assert refused >= set(main.commands)
    assert at_fault >= set(main.commands) - {"list", "new", "schema"}


# -------------------------------------------------------------------------------------------------------------- stopped


def press(*_: object, **__: object) -> NoReturn:
    raise KeyboardInterrupt


@pytest.mark.parametrize("early", ["kinfmu.fmu.build", "kinfmu.fmu.simulate"])
def test_simulate_that_is_stopped_before_the_first_sample_says_that_nothing_was_kept(
    early: str, fails: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(early, press)
    assert fails("simulate", "fourbar") == "stopped before the first sample: nothing was kept"
    assert list(tmp_path.iterdir()) == []


def test_simulate_that_is_stopped_while_the_recording_is_written_says_where_the_run_is(
    fails: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kinfmu.log.write_rrd", press)
    message = fails("simulate", "fourbar", "--mcap", "run.mcap")
    assert message == "stopped before the recording was written; the run is in run.mcap"
    assert len(log.read(tmp_path / "run.mcap")) == 181


@pytest.mark.parametrize("early", ["kinfmu.run.solve.solve", "kinfmu.log.write_table"])
def test_solve_that_is_stopped_says_that_nothing_was_written(
    early: str, fails: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(early, press)
    message = fails("solve", "fourbar", "-o", "run.csv")
    assert message == "stopped before the run was complete: nothing was written"
    assert list(tmp_path.iterdir()) == []


# ------------------------------------------------------------------------------------------------------------ full disk


PROGRAM = """
import resource, signal, sys
from kinfmu.cli import main

limit, *arguments = sys.argv[1:]
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), int(limit)))
main(arguments)
"""
COMMANDS = {
    "schema": (["schema", "-o", "out.json"], "out.json"),
    "build": (["build", "fourbar", "--flavour", "python", "-o", "out.fmu"], "out.fmu"),
    "figure": (["check", "fourbar", "--figure", "out.svg"], "out.svg"),
    "new": (["new", "fourbar", "out.toml"], "out.toml"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="a limit on the size of files simulates a full disk")
@pytest.mark.parametrize("name", mostly_long(COMMANDS, few=("schema", "figure", "new")))
@pytest.mark.few(1)
def test_a_full_disk_is_reported_in_one_line_and_leaves_no_file(name: str, tmp_path: Path) -> None:
    arguments, out = COMMANDS[name]
    existed = name != "new"  # new never replaces a file
    if existed:
        (tmp_path / out).write_text("older")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, "400", *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert done.returncode == 1
    *_, line = done.stderr.splitlines()  # before it, matplotlib may report that its cache cannot be written
    assert line == f"kinfmu: {out}: cannot be written (File too large)"
    assert [path.name for path in tmp_path.iterdir()] == ([out] if existed else [])
    if existed:
        assert (tmp_path / out).read_text() == "older"
