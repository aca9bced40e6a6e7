"""Laws in mechanism files: units, tables from CSV, and messages about invalid ones."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from kinfmu import (
    Cycloidal,
    External,
    Harmonic,
    Mechanism,
    MotionSequence,
    Polynomial,
    Polynomial345,
    Segment,
    SlideDriver,
    Spline,
)
from kinfmu.errors import MechanismError
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.toml_document import table_keys
from kinfmu.mechanism.toml_file import parse, read
from kinfmu.mechanism.toml_text import text

ARM = """name = "arm"
[units]
length = "mm"
[bodies.ground]
points = { O = [0, 0] }
[bodies.arm]
points = { O = [0, 0] }
[joints]
slot = { type = "translational", between = ["ground.O", "arm.O"] }
[drivers.ram]
type = "slide"
between = ["ground.O", "arm.O"]
"""


def arm(law: str, folder: str | Path = "") -> Mechanism:
    return parse(ARM + law, "arm.toml", folder)


def law_of(law: str, folder: str | Path = "") -> Law:
    return arm(law, folder).drivers[0].law


def message_of(law: str, folder: str | Path = "") -> str:
    """Return the message about a wrong law, without file and table."""
    with pytest.raises(MechanismError) as caught:
        arm(law, folder)
    line = str(caught.value)
    assert line.splitlines() == [line]
    assert line.startswith("arm.toml: [drivers.ram]")
    assert len(line) < 400
    return line.removeprefix("arm.toml: [drivers.ram]").strip()


def test_numbers_of_a_law_have_the_units_of_the_driven_quantity_over_time() -> None:
    assert law_of('law = "3-4-5"\nrise = "1 cm"\nduration = "500 ms"\nbegin = "1 min"') == Polynomial345(
        10.0, 0.5, begin=60.0
    )
    assert law_of('law = "harmonic"\namplitude = "1 m"\nfrequency = "2 Hz"\nphase = "90 deg"') == Harmonic(
        1000.0, 4.0 * math.pi, phase=math.pi / 2.0
    )
    assert law_of('law = "polynomial"\ncoefficients = ["1 cm", "1 m/s", 3, "1 m/s3"]') == Polynomial(
        (10.0, 1000.0, 3.0, 1000.0)
    )
    assert law_of('law = "external"\nstart = "1 cm"') == External(10.0)
    assert law_of('law = "spline"\nends = "natural"\npoints = [[0, 0], ["500 ms", "1 cm"], [1, 0]]') == Spline(
        ((0.0, 0.0), (0.5, 10.0), (1.0, 0.0)), "natural"
    )
    assert law_of(
        'law = "sequence"\nrepeat = true\nsegments = [\n{ law = "dwell", duration = "1 s" },\n'
        '{ law = "cycloidal", rise = "1 cm", duration = "500 ms" },\n]'
    ) == MotionSequence((Segment("dwell", 1.0), Segment("cycloidal", 0.5, 10.0)), repeat=True)


def test_rises_that_do_not_add_up_are_reported_in_the_units_of_the_file() -> None:
    written = (
        'name = "cam"\nparameters = { swing = "20 deg", back = "15 deg" }\n'
        "bodies.ground.points = { O = [0, 0], C = [60, 0] }\nbodies.cam.points.O = [0, 0]\n"
        "bodies.follower.points.C = [0, 0]\n"
        'joints.O = { type = "revolute", between = ["ground.O", "cam.O"] }\n'
        'joints.C = { type = "revolute", between = ["ground.C", "follower.C"] }\n'
        'joints.lift = { type = "cam_oscillating", between = ["ground", "follower"], cam = "cam", law = "sequence", '
        'repeat = true, segments = [{ law = "cycloidal", duration = "180 deg", rise = "swing" }, '
        '{ law = "cycloidal", duration = "180 deg", rise = "-back" }] }\n'
    )
    with pytest.raises(MechanismError) as caught:
        parse(written)
    assert str(caught.value).endswith(
        "[joints.lift] law: the rises of its sequence add up to 5 deg, not to 0; a follower that goes on turn after "
        "turn needs a coupling (rise_1 = 'swing', rise_2 = '-back', swing = 20 deg, back = 15 deg)"
    )


def test_numbers_of_a_law_may_be_expressions_of_parameters() -> None:
    mechanism = arm(
        'law = "sequence"\nsegments = [{ law = "cycloidal", rise = "2*h", duration = "T" }, '
        '{ law = "dwell", duration = "T/2" }]\n[parameters]\nh = "1 cm"\nT = 3'
    )
    assert mechanism.drivers[0].law == MotionSequence((Segment("cycloidal", 3.0, 20.0), Segment("dwell", 1.5)))
    assert parse(text(mechanism)) == mechanism
    assert 'rise = "2*h", duration = "T"' in text(mechanism)
    higher = mechanism.with_parameters({"h": "2 cm"}).drivers[0].law
    assert higher.at(10.0) == 40.0
    assert message_of('law = "cycloidal"\nrise = 1\nduration = "T - 2 s"\n[parameters]\nT = "2 s"') == (
        "duration = 0.0 must be positive (duration = 'T - 2 s', T = 2 s)"
    )


def test_a_table_is_read_from_a_csv_file_next_to_the_mechanism(tmp_path: Path) -> None:
    (tmp_path / "lift.csv").write_text("# measured\ntime [ms], lift [cm]\n0, 0\n\n500, 1\n1000, 2.5\n1500, 0\n")
    (tmp_path / "arm.toml").write_text(ARM + 'law = "spline"\nfile = "lift.csv"')
    mechanism = read(tmp_path / "arm.toml")
    assert mechanism.drivers[0].law == Spline(((0.0, 0.0), (0.5, 10.0), (1.0, 25.0), (1.5, 0.0)))
    assert parse(text(mechanism)) == mechanism, "the text itself holds the table"


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_columns_are_separated_by_commas_semicolons_or_tabs_and_need_no_header(tmp_path: Path, mark: str) -> None:
    rows = [(0.0, 0.0), (1.0, 2.0), (2.0, -1e-3), (3.0, 4.0)]
    (tmp_path / "a.csv").write_text("\ufeff" + "".join(f"{x}{mark}{u}\r\n" for x, u in rows), encoding="utf-8")
    assert law_of('law = "spline"\nfile = "a.csv"', tmp_path) == Spline(tuple(rows))


SPLINE = 'law = "spline"\n'
SEQUENCE = 'law = "sequence"\n'
SEGMENT = '{ law = "cycloidal", rise = 1, duration = 2 }'
RISES = "simple_harmonic, cycloidal, modified_sine, modified_trapezoid, 3-4-5, 4-5-6-7"

WRONG = {
    "a rise without its duration": (
        'law = "3-4-5"\nrise = 1',
        "needs the key 'duration'; keys: rise, duration, start, begin",
    ),
    "a duration of nothing": ('law = "3-4-5"\nrise = 1\nduration = 0', "duration = 0.0 must be positive"),
    "a duration that is a length": (
        'law = "3-4-5"\nrise = 1\nduration = "1 mm"',
        "duration = '1 mm': unit 'mm' must be one of s, ms, min, h",
    ),
    "a rise that is no number": (
        'law = "3-4-5"\nrise = true\nduration = 1',
        "rise = true must be a number or text such as '25 mm'",
    ),
    "a misspelt law": ('law = "3-4-6"', "law = '3-4-6' is not known; did you mean '3-4-5'?; known: "),
    "a misspelt key": (
        'law = "cycloidal"\nrise = 1\nduraton = 1',
        "duraton: unknown key; did you mean 'duration'?; keys: type, law, between, axis, rise, duration, start, begin",
    ),
    "a key of another law": (
        'law = "external"\nspeed = 1',
        "speed: unknown key; keys: type, law, between, axis, start",
    ),
    "coefficients that are a number": (
        'law = "polynomial"\ncoefficients = 1',
        "coefficients = 1 must be a list of numbers [c0, c1, ...]",
    ),
    "no coefficients": (
        'law = "polynomial"\ncoefficients = []',
        "coefficients: 0 numbers; they must be 1 to 21, [c0, c1, ...]",
    ),
    "a coefficient with the unit of another": (
        'law = "polynomial"\ncoefficients = [0, "1 mm"]',
        "c1 = '1 mm': unit 'mm' must be one of m/s, m/min, ",
    ),
    "a coefficient that is no number": (
        'law = "polynomial"\ncoefficients = [0, 1, 2, [3]]',
        "c3 = [3] must be a number or text such as '25 mm/s3'",
    ),
    "a coefficient that is a word": (
        'law = "polynomial"\ncoefficients = [0, "fast"]',
        "c1 must be a speed, such as '25 mm/s': 'fast', character 1: no parameter 'fast'; parameters: none",
    ),
    "neither points nor a file": (SPLINE, "needs the key 'points' or 'file'; keys: points, ends, file"),
    "points and a file": (
        f'{SPLINE}points = []\nfile = "a"',
        "has both 'points' and 'file'; the table is one or the other",
    ),
    "points that are none": (f"{SPLINE}points = 1", "points = 1 must be a list of points [[x, u], [x, u], ...]"),
    "a point of three numbers": (
        f"{SPLINE}points = [[1, 2, 3]]",
        "points = [[1, 2, 3]] must be a list of points [[x, u], [x, u], ...]",
    ),
    "too few points": (
        f"{SPLINE}points = [[0, 0], [1, 1], [2, 0]]",
        "points: 3 points are too few for ends = 'not_a_knot'; at least 4",
    ),
    "points that do not ascend": (
        f"{SPLINE}points = [[0, 0], [2, 1], [1, 0], [3, 0]]",
        "points: x = 1.0 of point 3 comes after 2.0; x must ascend",
    ),
    "a point twice": (
        f"{SPLINE}points = [[0, 0], [1, 1], [1, 1], [3, 0]]",
        "points: x = 1.0 of point 3 appears twice; x must ascend",
    ),
    "a point that is not finite": (
        f"{SPLINE}points = [[0, 0], [1, nan], [2, 1], [3, 0]]",
        "points = nan must be a finite number",
    ),
    "a point that is an expression": (
        f'{SPLINE}points = [[0, 0], [1, "h"], [2, 1], [3, 0]]\n[parameters]\nh = 1',
        "points must be numbers; a table cannot hold expressions of parameters (points = 'h', h = 1.0)",
    ),
    "ends that are not known": (
        f'{SPLINE}ends = "natrual"\npoints = []',
        "ends = 'natrual' is not known; did you mean 'natural'?; known: not_a_knot, natural, periodic",
    ),
    "ends that are no text": (f"{SPLINE}ends = 1\npoints = []", "ends = 1 must be text"),
    "a periodic table that does not close": (
        f'{SPLINE}ends = "periodic"\npoints = [[0, 0], [1, 1], [2, 1], [3, 0.5]]',
        "points: the last value 0.5 must be the first, 0.0, with ends = 'periodic'",
    ),
    "a file that is not there": (
        f'{SPLINE}file = "lift.csv"',
        "file = 'lift.csv' cannot be read (No such file or directory)",
    ),
    "a file that is no name": (f"{SPLINE}file = 1", "file = 1 must be the name of a CSV file"),
    "no segments": (f"{SEQUENCE}segments = []", "segments must hold at least one segment"),
    "segments that are a table": (
        f"{SEQUENCE}segments = {SEGMENT}",
        "segments = {'duration': 2, 'law': 'cycloidal', 'rise': 1} must be a list of tables such as "
        '{ law = "cycloidal", rise = 1, duration = 2 }',
    ),
    "a segment without a law": (
        f"{SEQUENCE}segments = [{SEGMENT}, {{ duration = 1 }}]",
        "segments, segment 2: needs the key 'law'; keys: law, rise, duration",
    ),
    "a rise without its way": (
        f'{SEQUENCE}segments = [{{ law = "cycloidal", duration = 1 }}]',
        "segments, segment 1: needs the key 'rise'; keys: law, rise, duration",
    ),
    "a dwell that rises": (
        f'{SEQUENCE}segments = [{{ law = "dwell", duration = 1, rise = 1 }}]',
        "segments: segment 1 is a dwell, which has no rise",
    ),
    "a law that is no rise": (
        f'{SEQUENCE}segments = [{{ law = "harmonic", duration = 1 }}]',
        f"segments: law 'harmonic' of segment 1 is not known; did you mean 'simple_harmonic'?; known: {RISES}, dwell",
    ),
    "a law that is a number": (
        f"{SEQUENCE}segments = [{{ law = 1, duration = 1 }}]",
        "segments, segment 1: law = 1 must be text",
    ),
    "a misspelt key of a segment": (
        f'{SEQUENCE}segments = [{{ law = "dwell", duraton = 1 }}]',
        "segments, segment 1: duraton: unknown key; did you mean 'duration'?; keys: law, rise, duration",
    ),
    "a segment of no duration": (
        f'{SEQUENCE}segments = [{SEGMENT}, {{ law = "dwell", duration = -1 }}]',
        "duration_2 = -1.0 must be positive",
    ),
    "a number of a segment with a wrong unit": (
        f'{SEQUENCE}segments = [{{ law = "dwell", duration = "1 mm" }}]',
        "duration_1 = '1 mm': unit 'mm' must be one of s, ms, min, h",
    ),
    "a repetition that is no truth": (
        f"{SEQUENCE}segments = [{SEGMENT}]\nrepeat = 1",
        "repeat = 1 must be true or false",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_law_is_reported_in_one_line(case: str, tmp_path: Path) -> None:
    law, line = WRONG[case]
    if line.endswith(" "):  # the rest is a long list
        assert message_of(law, tmp_path).startswith(line)
    else:
        assert message_of(law, tmp_path) == line


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (b"0,0\n1,2,3\n", ", line 2: 3 columns; there must be two"),
        (b"0,0\n1;2\n# a\n\n2\n", ", line 5: 1 columns; there must be two"),
        (b"0,0\n1,one\n", ", line 2: 'one' must be a number"),
        (b"x,u\n0,nan\n", ", line 2: nan must be a finite number"),
        (b"x,1\n0,0\n", ", line 1: 'x' must be a number"),
        (b"0,0\n1,inf\n", ", line 2: inf must be a finite number"),
        (b"0,0\n1,1_0\n", ", line 2: '1_0' must be a number"),
        (b"0,0\n1,Infinity\n", ", line 2: 'Infinity' must be a number"),
        ("0,0\n1,\u0663\n".encode(), ", line 2: '\u0663' must be a number"),
        (b"0,0\n1," + b"1" * 200_000, ", line 2: field larger than field limit (131072)"),
        (b"\x00\xff\xfe", " is not a text file (byte 1 is not UTF-8)"),
        (b"0,0\n" * 1_000_001, " is too large for a table (largest: 4000000 bytes)"),
    ],
    ids=[
        "three columns",
        "one column",
        "a word",
        "not a number",
        "half a header",
        "infinite",
        "an underscore",
        "another word",
        "another script",
        "a large field",
        "binary",
        "too large",
    ],
)
def test_an_error_in_a_csv_file_is_reported_with_its_line(tmp_path: Path, content: bytes, line: str) -> None:
    (tmp_path / "a.csv").write_bytes(content)
    assert message_of(f'{SPLINE}file = "a.csv"', tmp_path) == f"file = 'a.csv'{line}"


def test_an_empty_table_and_one_with_a_wrong_unit_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("")
    few = "points: 0 points are too few for ends = 'not_a_knot'; at least 4"
    assert message_of(f'{SPLINE}file = "a.csv"', tmp_path) == few
    (tmp_path / "a.csv").write_text("t [s], lift [deg]\n0, 0\n")
    wrong = "points = '0.0 deg': unit 'deg' must be one of m, mm, cm, um, km, in, ft"
    assert message_of(f'{SPLINE}file = "a.csv"', tmp_path) == wrong


def test_laws_made_in_python_are_checked_by_the_mechanism() -> None:
    mechanism = arm('law = "external"')

    def complaint(law: Law) -> str:
        with pytest.raises(MechanismError) as caught:
            Mechanism("arm", mechanism.bodies, mechanism.joints, (SlideDriver("ram", ("ground.O", "arm.O"), law=law),))
        return str(caught.value)

    assert complaint(Cycloidal(1.0, -1.0)) == "[drivers.ram] duration = -1.0 must be positive"
    assert complaint(Cycloidal(math.nan, 1.0)) == "[drivers.ram] rise = nan must be a finite number"
    assert complaint(Spline(((0, 0), (0, 1), (2, 3), (4, 5)))).endswith(
        "x = 0.0 of point 2 appears twice; x must ascend"
    )
    with pytest.raises(MechanismError, match=r"^points of a spline: \(1, 2, 3\) must be two numbers \[x, u\]$"):
        Spline(((1, 2, 3),))  # type: ignore[arg-type]


def test_keys_of_a_spline_name_the_file() -> None:
    assert table_keys(Spline) == ["points", "ends", "file"]
    assert table_keys(Cycloidal) == ["rise", "duration", "start", "begin"]
