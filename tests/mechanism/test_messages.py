"""Messages about wrong mechanism files: one line with file, table, key, and what would be valid."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from kinfmu.errors import MechanismError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.toml_document import LARGEST_FILE
from kinfmu.mechanism.toml_file import parse, read

FOURBAR = (gallery.folder() / "fourbar" / "mechanism.toml").read_text(encoding="utf-8")


def message(text: str) -> str:
    """Return the message, of one line, for a mechanism file with this text."""
    with pytest.raises(MechanismError) as caught:
        parse(text, "arm.toml")
    line = str(caught.value)
    assert line.splitlines() == [line]
    assert line.startswith("arm.toml: ")
    assert len(line) < 400
    return line.removeprefix("arm.toml: ")


def changed(old: str, new: str) -> str:
    """Return the four-bar's file with the first occurrence of `old` replaced."""
    assert old in FOURBAR
    return FOURBAR.replace(old, new, 1)


TYPES = (
    "revolute, translational, fixed, distance, point_on_line, coordinate, angle, relative_angle, gear, "
    "rack_and_pinion, cam_translating, cam_oscillating, cam_roller, cam_flat_face, coupling"
)
LAWS = (
    "constant_speed, constant, polynomial, harmonic, simple_harmonic, cycloidal, modified_sine, modified_trapezoid, "
    "3-4-5, 4-5-6-7, spline, sequence, external"
)
LENGTHS = "m, mm, cm, um, km, in, ft"
NAME_RULE = "must consist of at most 100 letters, digits and underscores, and not begin with a digit"

# case: text in the file, its replacement, the message
CHANGES = {
    "a table that is not known": (
        "[joints.O]",
        "[joint.O]",
        "[joint]: unknown key; did you mean 'joints'?; "
        "keys: name, title, units, parameters, run, bodies, joints, drivers, gravity, loads, points, outputs, "
        "measures, counts, repeat",
    ),
    "a key of the file that is not known": (
        "title =",
        "tittle =",
        "tittle: unknown key; did you mean 'title'?; "
        "keys: name, title, units, parameters, run, bodies, joints, drivers, gravity, loads, points, outputs, "
        "measures, counts, repeat",
    ),
    "a key of a joint that is not known": (
        "length = 1\n",
        "lenght = 1 ",
        "[joints.AB] lenght: unknown key; did you mean 'length'?; keys: type, between, length",
    ),
    "a key of a body that is not known": (
        "start = { x = 0,",
        "stat = { x = 0,",
        "[bodies.crank] stat: unknown key; did you mean 'start'?; "
        "keys: points, start, mass, center_of_mass, inertia, rod, plate, density, areal_density, thickness, width",
    ),
    "a coordinate of a start pose that is not known": (
        "start = { x = 0,",
        "start = { z = 0,",
        "[bodies.crank] start z: unknown key; keys: x, y, phi",
    ),
    "a key of a driver that is not known": (
        "speed =",
        "sped =",
        "[drivers.crank] sped: unknown key; did you mean 'speed'?; keys: type, law, of, start, speed",
    ),
    "a key of the run that is not known": (
        "step =",
        "steps =",
        "[run] steps: unknown key; did you mean 'step'?; keys: start, stop, step, over",
    ),
    "a key of the units that is not known": (
        'length = "m"',
        'angle = "deg"',
        "[units] angle: unknown key; keys: length",
    ),
    "a name that is missing": (
        'name = "fourbar"',
        "",
        "name is missing; the first line should be such as name = 'fourbar'",
    ),
    "a type that is missing": (
        'type = "revolute"',
        "",
        f"[joints.O] needs the key 'type', one of {TYPES}",
    ),
    "a type that is not known": (
        'type = "revolute"',
        'type = "revolut"',
        f"[joints.O] type = 'revolut' is not known; did you mean 'revolute'?; known: {TYPES}",
    ),
    "a type that is no text": (
        'type = "revolute"',
        "type = 1",
        f"[joints.O] type = 1 must be one of {TYPES}",
    ),
    "a law that is missing": (
        'law = "constant_speed"',
        "",
        f"[drivers.crank] needs the key 'law', one of {LAWS}",
    ),
    "a law that is not known": (
        'law = "constant_speed"',
        'law = "constant_sped"',
        f"[drivers.crank] law = 'constant_sped' is not known; did you mean 'constant_speed'?; known: {LAWS}",
    ),
    "points of a joint that are missing": (
        'between = ["ground.O", "crank.O"]',
        "",
        "[joints.O] needs the key 'between'; keys: between",
    ),
    "a length that is missing": ("length = 1\n", "", "[joints.AB] needs the key 'length'; keys: between, length"),
    "a body of a driver that is missing": ('of = "crank"', "", "[drivers.crank] needs the key 'of'; keys: of, law"),
    "one point in place of two": (
        '["ground.O", "crank.O"]',
        '"ground.O"',
        "[joints.O] between = 'ground.O' must be two points ['body.point', 'body.point']",
    ),
    "three points in place of two": (
        '["ground.O", "crank.O"]',
        '["ground.O", "crank.O", "rocker.Q"]',
        "[joints.O] between = ['ground.O', 'crank.O', 'rocker.Q'] must be two points ['body.point', 'body.point']",
    ),
    "a point that is a number": (
        '["ground.O", "crank.O"]',
        '["ground.O", 5]',
        "[joints.O] between = 5 must be text such as 'body.point'",
    ),
    "a point without its body": (
        '"crank.O"]',
        '"O"]',
        "[joints.O] between = 'O' must be 'body.point'",
    ),
    "a body that is not there": (
        '"crank.O"]',
        '"crnk.O"]',
        "[joints.O] between: body 'crnk' is not in the mechanism; did you mean 'crank'?; "
        "bodies: ground, crank, coupler, rocker",
    ),
    "a point that is not there": (
        '"coupler.P"]',
        '"coupler.p"]',
        "[joints.P] between: body 'coupler' has no point 'p'; did you mean 'P'?; its points: P, Q, A",
    ),
    "a driven body that is not there": (
        'of = "crank"',
        'of = "crank.O"',
        "[drivers.crank] of: 'crank.O' must be a body; did you mean 'crank'?",
    ),
    "a driven ground": (
        'of = "crank"',
        'of = "ground"',
        "[drivers.crank] acts on the ground only, which does not move",
    ),
    "a body joined to itself": (
        '["ground.O", "crank.O"]',
        '["crank.P", "crank.O"]',
        "[joints.O] joins body 'crank' to itself",
    ),
    "the ground joined to itself": (
        '["ground.O", "crank.O"]',
        '["ground.B", "ground.O"]',
        "[joints.O] joins body 'ground' to itself",
    ),
    "a length that is negative": (
        "length = 1\n",
        "length = -1 ",
        "[joints.AB] length = -1.0 must be a positive number, 1e-30 or more",
    ),
    "a length that is zero": (
        "length = 1\n",
        "length = 0 ",
        "[joints.AB] length = 0.0 must be a positive number, 1e-30 or more",
    ),
    "a length that is no number": ("length = 1\n", "length = nan ", "[joints.AB] length = nan must be a finite number"),
    "a length that is infinite": (
        "length = 1\n",
        "length = -inf ",
        "[joints.AB] length = -inf must be a finite number",
    ),
    "a length that is too large": (
        "length = 1\n",
        "length = 1e200 ",
        "[joints.AB] length = 1e+200 is too large; numbers go up to 1e+30",
    ),
    "a length that is too large in the unit used": (
        "length = 1\n",
        'length = "1e29 km" ',
        "[joints.AB] length = '1e29 km' is too large; numbers go up to 1e+30",
    ),
    "a length of a thousand digits": (
        "length = 1\n",
        f"length = {'9' * 1000} ",
        "[joints.AB] length = a whole number of 3322 bits is too large; numbers go up to 1e+30",
    ),
    "a length of five thousand hexadecimal digits": (
        "length = 1\n",
        f"length = 0x{'F' * 5000} ",
        "[joints.AB] length = a whole number of 20000 bits is too large; numbers go up to 1e+30",
    ),
    "a length that is a truth": (
        "length = 1\n",
        "length = true ",
        "[joints.AB] length = true must be a number or text such as '25 mm'",
    ),
    "a length that is a list": (
        "length = 1\n",
        "length = [1] ",
        "[joints.AB] length = [1] must be a number or text such as '25 mm'",
    ),
    "a length with the unit of an angle": (
        "length = 1\n",
        'length = "1 deg" ',
        f"[joints.AB] length = '1 deg': unit 'deg' must be one of {LENGTHS}",
    ),
    "a length as text without a unit": (
        "length = 1\n",
        'length = "1" ',
        f"[joints.AB] length = '1': text needs a unit, one of {LENGTHS}",
    ),
    "a length that is text without a number": (
        "length = 1\n",
        'length = "one m" ',
        "[joints.AB] length must be a length, such as '25 mm': 'one m', character 5: expected one of + - * / **, "
        "found 'm'",
    ),
    "a speed with the unit of an angle": (
        '"1 deg/s"',
        '"1 deg"',
        "[drivers.crank] speed = '1 deg': unit 'deg' must be one of "
        "rad/s, rad/min, deg/s, deg/min, rev/s, rev/min, rpm, Hz; did you mean 'deg/s'?",
    ),
    "an angle with the unit of a length": (
        'phi = "60 deg"',
        'phi = "60 mm"',
        "[bodies.crank] start.phi = '60 mm': unit 'mm' must be one of rad, deg, rev",
    ),
    "a unit of length that is not known": (
        'length = "m"',
        'length = "parsec"',
        f"[units] length = 'parsec' is not a unit of length; known: {LENGTHS}",
    ),
    "a unit that is no text": ('length = "m"', "length = 1", "[units] length = 1 must be text"),
    "a point of one number": (
        "O = [0, 0], C",
        "O = [0], C",
        "[bodies.ground] points.O = [0] must be two numbers [x, y]",
    ),
    "a point that is infinite": (
        "O = [0, 0], C",
        "O = [0, inf], C",
        "[bodies.ground] points.O = inf must be a finite number",
    ),
    "points that are a list": (
        "points = { O = [0, 0], P = [1, 0] }",
        "points = [0, 0]",
        "[bodies.crank] points = [0, 0] must be a table such as { P = [1, 0] }",
    ),
    "a start pose that is a list": (
        'start = { x = 0, y = 0, phi = "60 deg" }',
        "start = [0, 0, 0]",
        "[bodies.crank] start = [0, 0, 0] must be a table such as { x = 0, y = 0, phi = 0 }",
    ),
    "a start pose of the ground": (
        "[bodies.crank]",
        "start = { x = 1 }\n[bodies.crank]",
        "[bodies.ground] start: the ground does not move, its frame is the world's",
    ),
    "a run without an end": ("stop = 180", "stop = inf", "[run] stop = inf must be a finite number"),
    "a run that ends before it starts": ("stop = 180", "stop = -1", "[run] stop = -1.0 lies before start = 0.0"),
    "a step of nothing": ("step = 1", "step = 0", "[run] step = 0.0 must be positive"),
    "a point of interest with the name of a body": (
        'A = "coupler.A"',
        'coupler = "coupler.A"',
        "[points] coupler: a body has this name already, so 'coupler.x' would be ambiguous",
    ),
    "a point of interest that is a number": (
        'A = "coupler.A"',
        "A = 1",
        "[points] A = 1 must be text such as 'body.point'",
    ),
    "a point of interest that is not there": (
        'A = "coupler.A"',
        'A = "coupler.B"',
        "[points] A: body 'coupler' has no point 'B'; its points: P, Q, A",
    ),
    "a name with a blank": ('name = "fourbar"', 'name = "four bar"', f"name = 'four bar' {NAME_RULE}"),
    "a name with a line break": ('name = "fourbar"', r'name = "four\nbar"', rf"name = 'four\nbar' {NAME_RULE}"),
    "a name that is a number": ('name = "fourbar"', "name = 4", "name = 4 must be text"),
    "a name of a body that a variable cannot have": (
        "[bodies.crank]",
        '[bodies."cränk"]',
        f"[bodies] 'cränk' {NAME_RULE}",
    ),
    "a name of a joint with a line break": ("[joints.O]", r'[joints."O\nO"]', rf"[joints] 'O\nO' {NAME_RULE}"),
    "a name of a driver with a dot": ("[drivers.crank]", '[drivers."crank.a"]', f"[drivers] 'crank.a' {NAME_RULE}"),
    "a name of a point that is empty": ("{ O = [0, 0], P", '{ "" = [0, 0], P', f"[bodies.crank] points '' {NAME_RULE}"),
    "a key with a line break": (
        "title =",
        r'"tit\nle" =',
        r"'tit\nle': unknown key; did you mean 'title'?; "
        "keys: name, title, units, parameters, run, bodies, joints, drivers, gravity, loads, points, outputs, "
        "measures, counts, repeat",
    ),
    "a title with a line break": (
        'title = "Four-bar',
        r'title = "\nFour-bar',
        r"title = '\nFour-bar crank with a redundant constraint' must be one line of text without control characters",
    ),
}


@pytest.mark.parametrize("case", CHANGES)
def test_an_error_is_one_line_with_table_key_and_valid_values(case: str) -> None:
    old, new, expected = CHANGES[case]
    assert message(changed(old, new)) == expected


def test_coordinates_of_the_outputs_are_checked() -> None:
    def outputs_message(value: str) -> str:
        return message(f"{FOURBAR}\n[outputs]\ncoordinates = {value}\n")

    assert outputs_message('"most"') == "[outputs] coordinates = 'most' must be 'moving', 'all' or a list of names"
    assert outputs_message("5") == "[outputs] coordinates = 5 must be 'moving', 'all' or a list of names"
    assert outputs_message("[5]") == "[outputs] coordinates = 5 must be text such as 'crank.phi'"
    assert outputs_message('["crank.x", "crank.x"]') == "[outputs] coordinates names a coordinate twice"
    assert outputs_message('["crank.fi"]').startswith(
        "[outputs] coordinates: 'crank.fi' is not a coordinate of this mechanism; did you mean 'crank.phi'?; "
        "coordinates: crank.x, crank.y, crank.phi, coupler.x"
    )


def test_two_joints_with_the_same_name_are_reported_with_the_line() -> None:
    text = changed("[joints.P]", "[joints.O]")
    line = 1 + [k for k, line in enumerate(text.splitlines()) if line == "[joints.O]"][1]
    first = 1 + text.splitlines().index("[joints.O]")
    assert message(text) == f"not valid TOML: line {line}: 'joints.O' is written twice, first in line {first}; keep one"


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("link = 127,5", "link = 127,5: a decimal has a point, not a comma: link = 127.5"),
        ("start = { x = -1,5, y = 0 }", "x = -1,5: a decimal has a point, not a comma: x = -1.5"),
        ("of = crank  # its body", 'of = crank: text, also a number with a unit, needs quotes: of = "crank"'),
        ("of = crank.A", 'of = crank.A: text, also a number with a unit, needs quotes: of = "crank.A"'),
        ("speed = 60 rpm", 'speed = 60 rpm: text, also a number with a unit, needs quotes: speed = "60 rpm"'),
        ("a = { b = 90 deg }", 'b = 90 deg: text, also a number with a unit, needs quotes: b = "90 deg"'),
        ("length = 2*a", 'length = 2*a: text, also a number with a unit, needs quotes: length = "2*a"'),
        ("repeat = True", "repeat = True: written in small letters: repeat = true"),
        ("A = (28, 21)", "A = (28, 21): a list has brackets, not parentheses: A = [28, 21]"),
        ("of\t=\tcrank", 'of = crank: text, also a number with a unit, needs quotes: of = "crank"'),
        ('a = "b = c, 1,5" + 1', None),  # what is in quotes is no mistake
    ],
)
def test_a_slip_in_toml_is_reported_with_its_line_and_what_to_write(line: str, expected: str | None) -> None:
    text = f'name = "a"\n\n[run]\n{line}\nstop = 1\n'
    found = message(text)
    assert (
        found == f"not valid TOML: line 4: {expected}"
        if expected
        else found.startswith("not valid TOML: Expected newline")
    )


def test_a_control_character_is_reported_by_its_code() -> None:
    assert message("of = crank\b\n").startswith("not valid TOML: Invalid value (at line 1, column 6)")
    assert message('["a\b"]\n["a\b"]\n').startswith("not valid TOML: Illegal character '\\x08'")


def test_a_key_written_twice_is_named_with_both_lines() -> None:
    text = 'name = "a"\n[joints]\nA = { type = "revolute" }\n[drivers]\nA = 1\n[joints.B]\n[bodies]\nx.y = 1\n'
    for twice, name, lines in (("[joints]\n", "joints", (9, 2)), ("x.y = 2\n", "bodies.x.y", (9, 8))):
        expected = f"line {lines[0]}: '{name}' is written twice, first in line {lines[1]}; keep one"
        assert message(text + twice) == f"not valid TOML: {expected}"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            'bodies.rod = { start = { phi = 1 } }\nbodies.rod.mass = "2 kg"\n',
            "line 3: 'bodies.rod' is a table in braces in line 2: write mass = ... inside the braces",
        ),
        (
            "[bodies]\nrod = { start = { phi = 1 } }\nrod.start.x = 1\n",
            "line 4: 'bodies.rod' is a table in braces in line 3: write start.x = ... inside the braces",
        ),
        (
            "[bodies]\nrod = { start = { phi = 1 } }\n[bodies.rod.points]\nA = [0, 0]\n",
            "line 4: 'bodies.rod' is a table in braces in line 3: write points = ... inside the braces",
        ),
        (
            "units = 1\nunits.length = 2\n",
            "line 3: 'units.length': 'units' has a value in line 2, so it is not a table",
        ),
    ],
)
def test_a_key_of_a_table_in_braces_is_reported_with_the_line_of_the_braces(text: str, expected: str) -> None:
    assert message(f'name = "a"\n{text}') == f"not valid TOML: {expected}"


def test_a_decimal_comma_in_text_is_named() -> None:
    found = message(f'{FOURBAR}\n[parameters]\nlink = "127,5 mm"\n')
    assert found.endswith("character 4: expected one of + - * / **, found ','; a decimal has a point, not a comma")


@pytest.mark.parametrize(
    ("word", "ours"),
    [
        ("crank.angle", "crank.phi"),
        ("crank.theta", "crank.phi"),
        ("crank.angular_velocity", "crank.omega"),
        ("crank.speed", "crank.omega"),
        ("crank.angular_acceleration", "crank.alpha"),
        ("crank.position", "crank.x"),
    ],
)
def test_other_words_for_coordinates_lead_to_those_of_kinfmu(word: str, ours: str) -> None:
    found = message(f'{FOURBAR}\n[measures.m]\ntype = "range"\nof = "{word}"\n')
    assert f"'{word}' is not a coordinate of this mechanism; did you mean '{ours}'?" in found


def test_a_mechanism_of_the_ground_only_is_refused() -> None:
    expected = "[bodies] has only the ground; a mechanism needs a body that can move"
    assert message('name = "a"') == expected
    assert message('name = "a"\n[bodies.ground]\n') == expected


def test_a_value_in_place_of_a_table_is_refused() -> None:
    assert message('name = "a"\njoints = 1') == "joints = 1 must be a table [joints]"
    assert message('name = "a"\nbodies = "crank"') == "bodies = 'crank' must be a table [bodies]"
    assert message('name = "a"\n[[joints]]\nx = 1') == (
        "[[joints]] must be tables with names of their own, such as [joints.A]"
    )
    assert message('name = "a"\njoints = [1]') == "joints = [1] must be a table [joints]"
    assert message('name = "a"\n[bodies]\ncrank = 1') == "[bodies] crank = 1 must be a table [bodies.crank]"


def test_the_message_for_an_empty_file_shows_how_to_begin() -> None:
    expected = "name is missing; the first line should be such as name = 'fourbar'"
    assert message("") == expected
    assert message("# nothing yet\n") == expected


def test_invalid_toml_is_reported_with_its_place() -> None:
    assert message("name = \n") == "not valid TOML: Invalid value (at line 1, column 8)"
    assert message("name").startswith("not valid TOML: Expected '='")
    assert message(FOURBAR.replace("\n", "\r")).startswith("not valid TOML: ")


def test_deep_nesting_is_refused_and_does_not_overflow() -> None:
    assert message("a = " + "[" * 100_000) == "not valid TOML: nested too deeply"
    assert message("name" + ".a" * 20 + " = 1").endswith("must be text")
    assert message("\nname" + ".a" * 1_000_000 + " = 1") == "not valid: a key of more than 50 parts (at line 2)"


def test_a_number_of_thousands_of_digits_is_refused() -> None:
    assert message("name = " + "1" * 10_000) == "not valid TOML: a number has too many digits"


def test_a_long_value_is_shortened_in_the_message() -> None:
    assert re.fullmatch(
        r"name = 'a{40,}\.\.\.a{40,}' must consist of at most 100 letters.*", message(f'name = "{"a" * 100_000}"')
    )
    assert message("name = [" + "1," * 100_000 + "]") == "name = [1, 1, 1, 1, 1, 1, ...] must be text"


def test_windows_line_ends_and_a_byte_order_mark_are_read(tmp_path: Path) -> None:
    path = tmp_path / "fourbar.toml"
    path.write_bytes(b"\xef\xbb\xbf" + FOURBAR.replace("\n", "\r\n").encode())
    assert read(path) == parse(FOURBAR)


def file_message(path: Path) -> str:
    with pytest.raises(MechanismError) as caught:
        read(path)
    line = str(caught.value)
    assert line.splitlines() == [line]
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


def test_files_that_cannot_be_read_are_reported(tmp_path: Path) -> None:
    assert file_message(tmp_path / "none.toml") == "cannot be read (No such file or directory)"
    assert file_message(tmp_path) == "cannot be read (Is a directory)"
    assert file_message(tmp_path / ("long" * 1000)) == "cannot be read (File name too long)"
    assert file_message(tmp_path / "nul\0") == "cannot be read (embedded null byte)"


def test_files_that_are_not_text_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "binary.toml"
    path.write_bytes(b"name = \xff")
    assert file_message(path) == "not a text file (byte 7 is not UTF-8)"
    path.write_bytes('name = "ä"'.encode("latin-1"))
    assert file_message(path) == "not a text file (byte 8 is not UTF-8)"
    path.write_text('name = "a"', encoding="utf-16")
    assert file_message(path) == "not a text file (byte 0 is not UTF-8)"
    path.write_bytes(b"\0" * 100)
    assert file_message(path).startswith("not valid TOML: ")


def test_a_file_too_large_is_not_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "large.toml"
    with path.open("wb") as file:
        file.truncate(LARGEST_FILE + 1)
    assert file_message(path) == f"too large for a mechanism file (largest: {LARGEST_FILE} bytes)"


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no /dev/zero")
def test_a_device_without_an_end_is_refused() -> None:
    assert file_message(Path("/dev/zero")).startswith("too large for a mechanism file")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="everybody may read everything here")
def test_a_file_without_permission_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "locked.toml"
    path.write_text(FOURBAR)
    path.chmod(0)
    assert file_message(path) == "cannot be read (Permission denied)"
