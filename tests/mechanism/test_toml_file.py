"""Mechanism files: written mechanisms are read back, units are converted, every error is a MechanismError."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinfmu.errors import MechanismError
from kinfmu.mechanism import Body, Mechanism, Parameter, Point, RunSettings, Start, expression, gallery
from kinfmu.mechanism.drivers import AngleDriver
from kinfmu.mechanism.joints import Coordinate, Distance, Revolute
from kinfmu.mechanism.laws import ConstantSpeed
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.units import METRES

EXAMPLES = settings().max_examples  # of the profile
FOURBAR = (gallery.folder() / "fourbar" / "mechanism.toml").read_text(encoding="utf-8")

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_"
names = st.builds(
    str.__add__, st.sampled_from(LETTERS), st.text(st.sampled_from(LETTERS + "0123456789"), max_size=11)
).filter(lambda name: name != "ground")
numbers = st.floats(-1e30, 1e30)
positive = st.floats(1e-30, 1e30)
titles = st.text(st.characters(blacklist_categories=("Cc", "Cs", "Zl", "Zp", "Cn")), max_size=40)


@st.composite
def parameters(draw: st.DrawFn) -> dict[str, Any]:
    """Draw parameters in any order: numbers, text with units, and expressions of those drawn before."""
    found: dict[str, Any] = {}
    for name in draw(st.lists(names.filter(lambda name: name not in expression.WORDS), max_size=4, unique=True)):
        number = draw(st.floats(-1e6, 1e6))
        forms = [number, f"{number!r} mm", f"{number!r} deg/s", Parameter(number, description=draw(titles))]
        forms += [f"-{other} / 3 + {other}" for other in _lengths(found)]
        found[name] = draw(st.sampled_from(forms))
    return dict(draw(st.permutations(list(found.items()))))


def _lengths(parameters: dict[str, Any]) -> list[str]:
    """Return the names of the parameters that are valid where a length is needed."""
    return [name for name, value in parameters.items() if "deg" not in str(value)]


@st.composite
def mechanisms(draw: st.DrawFn) -> Mechanism:
    """Draw mechanisms of one to three moving bodies in a row, with every table that a file can hold."""
    numbered = draw(parameters())
    lengths = st.one_of(numbers, st.sampled_from(["5 mm + 1 m", "sqrt(2)*3 m", *_lengths(numbered)]))
    count = draw(st.integers(1, 3))
    bodies = draw(st.lists(names, min_size=count, max_size=count, unique=True))
    points = st.dictionaries(names, st.builds(Point, lengths, lengths), min_size=1, max_size=3)
    maybe, phi = st.one_of(st.none(), lengths), st.one_of(st.none(), numbers)
    made = [Body("ground", draw(points))]
    made += [Body(name, draw(points), draw(st.builds(Start, maybe, maybe, phi))) for name in bodies]
    made = draw(st.permutations(made))
    joint_names = iter(draw(st.lists(names, min_size=2 * count, max_size=2 * count, unique=True)))
    joints: list[Any] = []
    for one, other in pairwise(made):
        pair = tuple(f"{body.name}.{draw(st.sampled_from(sorted(body.points)))}" for body in (one, other))
        kind = draw(st.sampled_from(["revolute", "distance", "coordinate"]))
        if kind == "revolute":
            joints.append(Revolute(next(joint_names), pair))
        elif kind == "distance":
            joints.append(Distance(next(joint_names), pair, draw(positive)))
        else:
            of = next(point for point in pair if not point.startswith("ground."))
            joints.append(Coordinate(next(joint_names), of, draw(st.sampled_from("xy")), draw(lengths)))
    law = st.builds(ConstantSpeed, numbers, numbers)
    drivers = [
        AngleDriver(name, draw(st.sampled_from(bodies)), draw(law))
        for name in draw(st.lists(names, max_size=2, unique=True))
    ]
    targets = [f"{body.name}.{point}" for body in made for point in body.points]
    of_interest = draw(st.dictionaries(names.filter(lambda n: n not in bodies), st.sampled_from(targets), max_size=3))
    known = [f"{body.name}.{c}" for body in made if body.name != "ground" for c in ("x", "y", "phi")]
    some = st.lists(st.sampled_from(known), unique=True).map(tuple)
    start = draw(st.floats(-1e6, 1e6))
    return Mechanism(
        name=draw(names),
        bodies=tuple(made),
        joints=tuple(joints),
        drivers=tuple(drivers),
        points=of_interest,
        coordinates=draw(st.one_of(st.sampled_from(["moving", "all"]), some)),
        run=RunSettings(start, start + draw(st.floats(0.0, 1e6)), draw(st.floats(1e-9, 1e6))),
        length_unit=draw(st.sampled_from(sorted(METRES))),
        title=draw(titles),
        parameters=numbered,
    )


@settings(max_examples=4 * EXAMPLES)
@given(mechanism=mechanisms())
def test_a_mechanism_that_is_written_and_read_is_the_same(mechanism: Mechanism) -> None:
    again = parse(text(mechanism))
    assert again == mechanism
    assert again.expressions == mechanism.expressions
    assert list(again.parameters) == list(mechanism.parameters)
    assert list(again.points) == list(mechanism.points)
    assert [list(body.points) for body in again.bodies] == [list(body.points) for body in mechanism.bodies]
    assert text(again) == text(mechanism)


@pytest.mark.parametrize("name", gallery.names())
def test_the_gallery_is_the_same_after_writing_and_reading(name: str) -> None:
    mechanism = gallery.load(name)
    assert parse(text(mechanism)) == mechanism


def test_the_fourbar_as_kinfmu_writes_it_is_the_golden_file(golden: Callable[[str, str], None]) -> None:
    golden("fourbar_written.toml", text(parse(FOURBAR)))


@given(title=titles)
def test_any_line_of_text_can_be_a_title(title: str) -> None:
    mechanism = replace(parse(FOURBAR), title=title)
    assert parse(text(mechanism)).title == title


@pytest.mark.parametrize("title", ["\N{TAG LATIN SMALL LETTER A}", "\ue000", "\u00a0", '"""', "\\U0001F600", "'", "#"])
def test_a_title_of_characters_that_do_not_print_or_that_toml_uses_is_kept(title: str) -> None:
    mechanism = replace(parse(FOURBAR), title=title)
    assert parse(text(mechanism)).title == title


@pytest.mark.parametrize("title", ["\n", "\0", "\x1b[2J", "\u2028", "\ud800", "\uffff", "\x85", "\x7f"])
def test_a_title_that_is_not_one_line_of_text_is_refused(title: str) -> None:
    with pytest.raises(MechanismError, match=r"^title = .* must be one line of text without control characters$"):
        replace(parse(FOURBAR), title=title)


def test_numpys_numbers_are_written_as_numbers() -> None:
    """repr(np.float64(1.0)) is no TOML."""
    one = np.float64(1.5)
    bodies = (
        Body("ground", {"O": Point(one, one)}),
        Body("bar", {"P": Point(one, one)}, Start(one, None, np.float32(2))),
    )
    joints = (Distance("rod", ("ground.O", "bar.P"), one), Coordinate("guide", "bar.P", "x", np.int64(3)))
    drivers = (AngleDriver("motor", "bar", ConstantSpeed(one, one)),)
    mechanism = Mechanism("numbers", bodies, joints, drivers, run=RunSettings(np.float64(0), one, one))
    assert parse(text(mechanism)) == mechanism


def test_units_are_converted_to_those_used_inside() -> None:
    changed = FOURBAR.replace('length = "m"', 'length = "mm"').replace("length = 1\n", 'length = "2.5 cm"\n')
    changed = changed.replace("stop = 180", 'stop = "3 min"').replace('phi = "60 deg"', 'phi = "0.5 rev"')
    mechanism = parse(changed.replace('speed = "1 deg/s"', 'speed = "30 rpm"').replace("P = [1, 0]", 'P = ["1 in", 0]'))
    assert mechanism.joints[-1].length == 25.0  # type: ignore[attr-defined]
    assert mechanism.bodies[1].points["P"] == (25.4, 0.0)
    assert mechanism.bodies[1].start.phi == math.pi
    assert mechanism.run.stop == 180.0
    assert mechanism.drivers[0].law.speed == math.pi  # type: ignore[attr-defined]


def test_numbers_without_units_are_in_the_units_used_inside() -> None:
    mechanism = parse(FOURBAR.replace('speed = "1 deg/s"', "speed = 0.25").replace('length = "m"', 'length = "in"'))
    assert mechanism.drivers[0].law.speed == 0.25  # type: ignore[attr-defined]
    assert mechanism.bodies[1].points["P"] == (1.0, 0.0)


def test_missing_keys_have_their_default() -> None:
    mechanism = parse('name = "a"\n[bodies.bar]\n')
    assert mechanism == Mechanism("a", (Body("ground"), Body("bar")))
    assert mechanism.run == RunSettings(0.0, 1.0, 0.01)
    assert mechanism.length_unit == "m"
    assert mechanism.coordinates == "moving"


# ------------------------------------------------------------------------------------------- trying to break parse()

WORDS = ["name", "title", "units", "run", "bodies", "joints", "drivers", "points", "outputs", "type", "law", "between"]
WORDS += [
    "of",
    "axis",
    "value",
    "length",
    "start",
    "stop",
    "step",
    "speed",
    "coordinates",
    "ground",
    "x",
    "y",
    "phi",
    "O",
    "parameters",
    "a",
]
TEXTS = ["revolute", "distance", "coordinate", "angle", "constant_speed", "ground.O", "bar.O", "bar", "1 m", "60 deg"]
TEXTS += ["moving", "all", "m", "x", "", ".", "nan m", "1e999 m", "\n", "\0", "1 \n m"]
TEXTS += ["a", "2*a + 5 mm", "a/0", "2*(a", "sqrt(-1)", "a**a", "1e30*1e30*1e300", "atan2(a, 0)"]
keys = st.one_of(st.sampled_from(WORDS), st.text(max_size=4))
scalars = st.one_of(
    st.sampled_from(TEXTS), st.text(max_size=8), st.integers(), st.booleans(), st.floats(), st.dates(), st.times()
)
junk = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(keys, inner, max_size=4)),
    max_leaves=20,
)


def written(value: Any) -> str:
    """Return any tree as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{written(str(key))} = {written(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + "".join(f"\\U{ord(c):08X}" for c in value if not 0xD800 <= ord(c) < 0xE000) + '"'
    return value.isoformat() if hasattr(value, "isoformat") else repr(value)


def parsed_or_reported(text: str) -> None:
    """Parse to a mechanism, or to a message of one line; anything else fails the test."""
    try:
        mechanism = parse(text, "junk.toml")
    except MechanismError as error:
        message = str(error)
        assert message.splitlines() == [message]
        assert message.isprintable()
        assert message.startswith("junk.toml: ")
        assert len(message) < 1000
    else:
        assert isinstance(mechanism, Mechanism)


def put(document: dict[str, Any], path: list[str], value: Any) -> None:
    """Set the value at a path; create missing tables."""
    for key in path[:-1]:
        inner = document.get(key)
        document[key] = inner = inner if isinstance(inner, dict) else {}
        document = inner
    document[path[-1]] = value


def all_paths(tree: Any, prefix: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    if not isinstance(tree, dict):
        return [prefix]
    return [*([prefix] if prefix else []), *(path for key in tree for path in all_paths(tree[key], (*prefix, key)))]


PATHS = all_paths(tomllib.loads(FOURBAR))


@settings(max_examples=8 * EXAMPLES)
@given(document=st.dictionaries(keys, junk, max_size=5))
def test_any_tree_of_values_gives_a_mechanism_or_a_message_of_one_line(document: dict[str, Any]) -> None:
    parsed_or_reported("\n".join(f"{written(key)} = {written(value)}" for key, value in document.items()))


@settings(max_examples=10 * EXAMPLES)
@given(path=st.sampled_from(PATHS), deeper=st.lists(keys, max_size=2), value=junk)
def test_the_fourbar_with_anything_in_place_of_one_value_gives_a_mechanism_or_one_line(
    path: tuple[str, ...], deeper: list[str], value: Any
) -> None:
    document = tomllib.loads(FOURBAR)
    put(document, [*path, *deeper], value)
    parsed_or_reported("\n".join(f"{written(key)} = {written(inner)}" for key, inner in document.items()))


@settings(max_examples=5 * EXAMPLES)
@given(data=st.data())
def test_the_fourbars_text_with_a_piece_cut_out_or_put_in_gives_a_mechanism_or_one_line(data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(FOURBAR)))
    end = data.draw(st.integers(start, min(start + 30, len(FOURBAR))))
    inserted = data.draw(
        st.one_of(st.text(max_size=6), st.sampled_from(['"', "[", "]", "{", "}", "=", "\n", "'''", "1e"]))
    )
    parsed_or_reported(FOURBAR[:start] + inserted + FOURBAR[end:])


@settings(max_examples=5 * EXAMPLES)
@given(junk=st.text())
def test_any_text_gives_one_line(junk: str) -> None:
    parsed_or_reported(junk)


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(18)
def test_a_file_written_in_its_own_units_is_the_same_mechanism(name: str) -> None:
    mechanism = gallery.load(name)
    written = text(mechanism, as_written=True)
    assert parse(written) == mechanism
    assert text(parse(written), as_written=True) == written
    assert text(parse(written)) == text(mechanism)


def test_a_text_that_no_longer_gives_its_number_is_not_written() -> None:
    mechanism = parse(
        'name = "m"\n[units]\nlength = "mm"\n[parameters]\na = "2 cm"\n'
        '[bodies.ground]\npoints = {}\n[bodies.bar]\npoints = { P = ["3 cm", "a"] }\nstart = { phi = "60°" }\n'
    )
    assert '"3 cm"' in text(mechanism, as_written=True)
    assert 'phi = "60°"' in text(mechanism, as_written=True)
    metric = text(mechanism.in_metres(), as_written=True)
    assert '[0.03, "a"]' in metric
    assert parse(metric) == mechanism.in_metres()
    assert '[30.0, "a"]' in text(replace(mechanism, length_unit="cm"), as_written=True)


ARM = """
name = "arm"
bodies = { ground = { points = { O = [0, 0] } }, arm = { points = { O = [0, 0] } } }
joints.O = { type = "revolute", between = ["ground.O", "arm.O"] }
drivers.arm = { type = "angle", of = "arm", LAW }
run = { RUN }
"""


@pytest.mark.parametrize(
    ("law", "run", "times"),
    [
        ('law = "constant_speed", speed = "600 rpm"', "", (0.0, 0.1, 0.1 / 360.0)),
        ('law = "constant_speed", speed = "-0.5 rpm"', 'start = "0.5 s"', (0.5, 120.5, 1.0 / 3.0)),
        ('law = "constant_speed", speed = "600 rpm"', 'start = "7 s"', (7.0, 7.1, 0.1 / 360.0)),
        ('law = "harmonic", amplitude = 0.1, frequency = "5 Hz"', 'over = "run"', (0.0, 0.2, 0.2 / 360.0)),
        ('law = "constant_speed", speed = "600 rpm"', "stop = 2", (0.0, 2.0, 0.01)),
        ('law = "constant_speed", speed = "600 rpm"', "step = 0.1", (0.0, 1.0, 0.1)),
        ('law = "constant_speed", speed = 0', "", (0.0, 1.0, 0.01)),
        ('law = "external"', "", (0.0, 1.0, 0.01)),
        ('law = "cycloidal", rise = 1, duration = 2', "", (0.0, 1.0, 0.01)),
    ],
)
def test_a_run_that_the_file_does_not_give_is_a_cycle_of_its_driver(
    law: str, run: str, times: tuple[float, float, float]
) -> None:
    found = parse(ARM.replace("LAW", law).replace("RUN", run)).run
    assert (found.start, found.stop, found.step) == pytest.approx(times, rel=1e-11)


def test_the_run_of_several_drivers_is_a_second() -> None:
    two = text(gallery.load("five_bar"))
    start = two.index("[run]")
    assert parse(two[:start] + two[two.index("[bodies") :]).run == RunSettings()
