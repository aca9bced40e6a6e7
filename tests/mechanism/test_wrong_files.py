"""Files with wrong words, names and values: refused with file, place and what would be right."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from kinfmu.errors import OTHER_WORDS, MechanismError, suggestion
from kinfmu.mechanism import gallery
from kinfmu.mechanism.toml_file import parse
from kinfmu.run.solve import solve
from tests.analysis.test_design_notes import FOURBAR
from tests.fuzz.mechanisms import SAMPLES, written
from tests.gallery_members import mostly_long
from tests.mechanisms import FOURBAR_PINS

ROOT = Path(__file__).parents[2]

CRANK_ROCKER = (
    """\
name = "crank_rocker"
[parameters]
crank = 1.0
[bodies.ground]
points = { O = [0, 0], C = [4, 0] }
[bodies.crank]
points = { O = [0, 0], P = ["crank", 0] }
start = { phi = "60 deg" }
[bodies.coupler]
points = { P = [0, 0], Q = [3.5, 0], tip = [2, 1.5] }
start = { x = 0.5, y = 0.9, phi = "40 deg" }
[bodies.rocker]
points = { C = [0, 0], Q = [3, 0] }
start = { x = 4, phi = "100 deg" }
"""
    + FOURBAR_PINS
    + """[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = "60 deg", speed = "1 rad/s" }
[points]
tip = "coupler.tip"
[run]
stop = 6.3
step = 0.01
"""
)
PIN_Q = 'Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }\n'
DRIVER = 'crank = { type = "angle", of = "crank", law = "constant_speed", start = "60 deg", speed = "1 rad/s" }\n'
POINT = '["crank", 0]'  # of the crank, by its parameter

# case: text in the file, its replacement, part of the message
CHANGES = {
    "a body that is missing": (
        '[bodies.rocker]\npoints = { C = [0, 0], Q = [3, 0] }\nstart = { x = 4, phi = "100 deg" }\n',
        "",
        "[joints.Q] between: body 'rocker' is not in the mechanism; bodies: ground, crank, coupler",
    ),
    "a key that is misspelt": ("stop =", "stopp =", "[run] stopp: unknown key; did you mean 'stop'?"),
    "a table that is misspelt": ("[drivers]", "[driver]", "[driver]: unknown key; did you mean 'drivers'?"),
    "a key that is there twice": ("stop = 6.3", "stop = 6.3\nstop = 7", "'run.stop' is written twice, first in line"),
    "a table that is a list": ("[joints]", "[[joints]]", "[[joints]] must be tables with names of their own"),
    "a unit of length that is unknown": (
        "[parameters]",
        'units = { length = "inches" }\n[parameters]',
        "[units] length = 'inches' is not a unit of length; did you mean 'in'?; known: m, mm",
    ),
    "an expression with an unknown name": (
        POINT,
        '["crnk/2", 0]',
        "[bodies.crank] points.P = 'crnk/2', character 1: no parameter 'crnk'; did you mean 'crank'?",
    ),
    "an expression that is Python": (POINT, "[\"__import__('os')\", 0]", "character 1: no function '__import__'"),
    "a division by zero": (POINT, '["1/(crank - 1)", 0]', "'1/(crank - 1)', character 2: division by zero"),
    "an expression without an end": (POINT, f'["{"1 + " * 100_000}1", 0]', "is too long for an expression"),
    "two drivers of one freedom": (
        "[points]",
        'again = { type = "angle", of = "crank", law = "constant_speed" }\n[points]',
        "[drivers] mobility is 1 but there are 2 drivers (crank, again)",
    ),
    "no driver": (DRIVER, "", "[drivers] mobility is 1 but there is no driver"),
    "a joint that is missing": (PIN_Q, "", "[drivers] mobility is 3 but there is 1 driver (crank)"),
    "joints that leave no motion": (
        "[drivers]",
        'L = { type = "distance", between = ["ground.O", "rocker.Q"], length = 3.5 }\n[drivers]',
        "[drivers] mobility is 0: the joints leave no motion",
    ),
    "lengths that contradict each other": (
        "[drivers]",
        'L = { type = "distance", between = ["ground.O", "crank.P"], length = 1.5 }\n[drivers]',
        "[joints.L] contradicts the other joints: with O closed, row 'length' does not close: gap 0.5 m in every pose",
    ),
    "lengths that do not close": ("Q = [3.5, 0]", "Q = [13.5, 0]", "does not close near its start pose"),
    "a length that a parameter makes negative": (
        PIN_Q,
        'Q = { type = "distance", between = ["coupler.Q", "rocker.Q"], length = "crank - 3 m" }\n',
        "[joints.Q] length = -2.0 must be a positive number, 1e-30 or more (length = 'crank - 3 m', crank = 1.0)",
    ),
    "a number of too many digits": ("C = [4, 0]", f"C = [{'9' * 5000}, 0]", "a number has too many digits"),
    "a truth in place of a number": ("C = [4, 0]", "C = [true, 0]", "[bodies.ground] points.C = true must be a number"),
    "a date in place of a number": ("stop = 6.3", "stop = 1979-05-27", "[run] stop = 1979-05-27 must be a number"),
    "a point in space": ("C = [4, 0]", "C = [4, 0, 0]", "points.C = [4, 0, 0] must be two numbers [x, y]"),
    "text where a list belongs": (
        '["ground.O", "crank.O"]',
        '"ground.O"',
        "[joints.O] between = 'ground.O' must be two points",
    ),
    "a list where text belongs": ('of = "crank"', 'of = ["crank"]', "[drivers.crank] of = ['crank'] must be text"),
    "a number where a table belongs": (
        "start = { x = 4, phi",
        "start = 4 # phi",
        "[bodies.rocker] start = 4 must be",
    ),
    "a law that is unknown": (
        "constant_speed",
        "constant_spd",
        "law = 'constant_spd' is not known; did you mean 'constant_sp",
    ),
    "a joint that is unknown": ('"revolute"', '"revolve"', "type = 'revolve' is not known; did you mean 'revolute'?"),
    "a joint without a type": ('type = "revolute", ', "", "[joints.O] needs the key 'type', one of revolute"),
    "a joint without points": (', between = ["ground.O", "crank.O"]', "", "[joints.O] needs the key 'between'"),
    "no name": ('name = "crank_rocker"', "", "name is missing; the first line should be such as name = 'fourbar'"),
    "a name that no variable can have": (
        "[bodies.crank]",
        '[bodies."my crank"]',
        "[bodies] 'my crank' must consist of at most 100 letters",
    ),
    "a line that is no TOML": (
        "[run]",
        "run:",
        "not valid TOML: Expected '=' after a key in a key/value pair",
    ),
    "text without an end": (
        '"crank_rocker"',
        '"crank_rocker',
        "not valid TOML: Illegal character '\\n' (at line 1",
    ),
}

FILES = {
    "an empty file": (b"", "name is missing; the first line should be such as name = 'fourbar'"),
    "binary rubbish": (bytes(range(256)) * 100, "not a text file (byte 128 is not UTF-8)"),
    "nothing but zeros": (bytes(10_000), "not valid TOML: Invalid statement (at line 1, column 1)"),
    "a file of 10 MB": (b"# " + b"x" * 10_000_000, "too large for a mechanism file (largest: 4000000 bytes)"),
    "deep nesting": (b"name = " + b"[" * 1_000_000, "not valid TOML: nested too deeply"),
    "a key of a million parts": (b"name" + b".a" * 1_000_000 + b" = 1", "a key of more than 50 parts (at line 1)"),
    "JSON": (b'{"name": "a"}', "not valid TOML: Invalid statement (at line 1, column 1)"),
    "thousands of parameters": (
        "\n".join(['name = "a"', "[bodies.b]", "[parameters]", *(f"p{k} = {k}" for k in range(10_001))]).encode(),
        "[parameters] holds 10001 parameters; 10000 at most",
    ),
    "a crowd of bodies": (
        "\n".join(['name = "a"', *(f"[bodies.b{k}]" for k in range(20_000))]).encode(),
        "[bodies] holds 20001 bodies; 20000 at most",
    ),
}


def content(case: str) -> tuple[bytes, str]:
    """Return the content of the file of a case, and the expected part of the message."""
    if case in FILES:
        return FILES[case]
    old, new, expected = CHANGES[case]
    assert CRANK_ROCKER.count(old) >= 1
    return CRANK_ROCKER.replace(old, new, 1).encode(), expected


def test_the_unchanged_file_is_right(tmp_path: Path) -> None:
    path = tmp_path / "right.toml"
    path.write_text(CRANK_ROCKER)
    assert CliRunner().invoke(main, ["check", str(path)]).exit_code == 0


@pytest.mark.parametrize("case", [*CHANGES, *FILES])
@pytest.mark.few(2)
def test_a_wrong_file_is_reported_in_one_line_that_names_the_place(case: str, tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    written, expected = content(case)
    path.write_bytes(written)
    result = CliRunner().invoke(main, ["check", str(path)])
    assert isinstance(result.exception, SystemExit)
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"kinfmu: {path}: ")
    assert expected in line
    assert len(line) < 500 + len(str(path))


@pytest.mark.parametrize("command", ["solve", "build", pytest.param("simulate", marks=pytest.mark.long)])
@pytest.mark.parametrize(
    "case",
    mostly_long(
        ["a body that is missing", "two drivers of one freedom", "lengths that do not close"],
        few=("lengths that do not close",),
    ),
)
def test_every_command_reports_the_same_line(
    command: str, case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    written, expected = content(case)
    Path("wrong.toml").write_bytes(written)
    options = {"solve": ["-o", "run.csv"]}.get(command, [])
    result = CliRunner().invoke(main, [command, "wrong.toml", *options])
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert line.startswith("kinfmu: wrong.toml: ")
    assert expected in line
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.toml"]


@pytest.mark.parametrize("case", ["binary rubbish", "deep nesting"])
@pytest.mark.few(1)
def test_a_separate_process_reports_the_same_line(case: str, tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    written, expected = content(case)
    path.write_bytes(written)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "kinfmu", "check", str(path)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 1
    assert done.stderr.splitlines() == [done.stderr.rstrip("\n")]
    assert expected in done.stderr
    assert "Traceback" not in done.stdout + done.stderr


def test_insufficient_memory_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def load(_: str) -> None:
        raise MemoryError

    monkeypatch.setattr(gallery, "load", load)
    result = CliRunner().invoke(main, ["check", "fourbar"])
    assert result.exit_code == 1
    assert result.stderr == "kinfmu: not enough memory for a mechanism of this size\n"


# ---------------------------------------------------------------------------------------------------------- other words


@pytest.mark.parametrize(
    ("old", "new", "meant"),
    [
        ('O = { type = "revolute"', 'O = { type = "pin"', "revolute"),
        ('O = { type = "revolute"', 'O = { type = "hinge"', "revolute"),
        ('O = { type = "revolute"', 'O = { type = "prismatic"', "translational"),
        ('O = { type = "revolute"', 'O = { type = "slider"', "translational"),
        ('"78 deg"', '"78 degrees"', "deg"),
        ("x = 20,", 'x = "20 inches",', "in"),
        ('length = "mm"', 'length = "inches"', "in"),
    ],
)
def test_a_word_of_another_program_suggests_the_word_of_kinfmu(old: str, new: str, meant: str) -> None:
    with pytest.raises(MechanismError, match=rf"; did you mean '{meant}'\?"):
        parse(FOURBAR.replace(old, new), "fourbar.toml")


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ('"78 deg"', '"78°"', '"78 deg"'),
        ('"78 deg"', '"78 °"', '"78 deg"'),
        ('"78 deg"', '"30° + 48°"', '"30 deg + 48 deg"'),
        ("x = 20,", 'x = "20 inch",', 'x = "20 in",'),
        ("x = 20,", 'x = "2*(4 inch + 0.5inch)",', 'x = "2*(4 in + 0.5in)",'),
        ('length = "mm"', 'length = "inch"', 'length = "in"'),
    ],
)
def test_degree_sign_and_inch_are_units(old: str, new: str, same: str) -> None:
    assert old in FOURBAR
    found, wanted = (parse(FOURBAR.replace(old, text), "fourbar.toml") for text in (new, same))
    assert (found.bodies, found.length_unit) == (wanted.bodies, wanted.length_unit)


def test_another_word_is_suggested_only_where_its_meaning_is_known() -> None:
    assert suggestion("pin", ["crank", "coupler"]) == ""
    assert {suggestion(word, [meant]) for word, meant in OTHER_WORDS.items()} == {
        f"; did you mean '{meant}'?" for meant in OTHER_WORDS.values()
    }


@pytest.mark.parametrize("word", ["ram.X", "RAM.X", "Ram.x"])
def test_another_case_is_the_nearest_spelling(word: str) -> None:
    for known in (["ram.x", "ram.y", "ram.vx"], ["ram.y", "ram.z", "ram.x"]):
        assert suggestion(word, known) == "; did you mean 'ram.x'?"


@pytest.mark.parametrize(
    ("word", "known", "meant"),
    [
        ("tol", ("from", "to", "tolerance", "nominal"), "tolerance"),
        ("Tol", ("from", "to", "tolerance", "nominal"), "tolerance"),
        ("tol", ("crank.start", "solver.tolerance"), "solver.tolerance"),
        ("amp", ("amplitude", "frequency"), "amplitude"),
        ("Couplr.X", ("coupler.x", "coupler.y"), "coupler.x"),
    ],
)
def test_the_beginning_of_a_word_is_taken_for_the_word(word: str, known: tuple[str, ...], meant: str) -> None:
    assert suggestion(word, known) == f"; did you mean '{meant}'?"


def test_the_beginning_of_several_words_is_taken_for_none() -> None:
    assert suggestion("tol", ["tolerance", "tolerable"]) == ""


# -------------------------------------------------------------------------------------------------------- hostile names


NAMES = {
    "name": '"main"',
    "crank": "for",  # parameters
    "rod": "coupler_phi",
    "arm": "int",  # a body
    "tip": "x",  # a point
    "joint": "errno",
    "driver": "lambda",
    "point": "t1",
}


@pytest.mark.parametrize("engine", ["python", "native"])
def test_names_of_languages_and_of_generated_code_change_no_number(
    engine: Literal["python", "native"], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    plain = solve(parse(written({})), SAMPLES, engine="python")
    other = solve(parse(written(NAMES)), SAMPLES, engine=engine)
    assert other.status.tolist() == plain.status.tolist()
    np.testing.assert_allclose(other.values, plain.values, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(other.accelerations, plain.accelerations, rtol=0.0, atol=1e-12)
