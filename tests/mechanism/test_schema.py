"""The JSON Schema of mechanism files agrees with what the reader accepts."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from jsonschema import Draft7Validator

from kinfmu.cli import main
from kinfmu.errors import MechanismError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.declared import REQUIRED, keys_of, summary_of
from kinfmu.mechanism.drivers import DRIVERS
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.quantities import POSE_QUANTITIES
from kinfmu.mechanism.schema import schema, schema_text
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from tests.mechanism.test_wrong_files import CHANGES, CRANK_ROCKER

SCHEMA = Draft7Validator(schema())
OF_SHAPE = {  # wrong files that the schema alone detects, so that an editor can report them
    "a key that is misspelt",
    "a table that is misspelt",
    "a table that is a list",
    "a unit of length that is unknown",
    "an expression that is Python",
    "an expression without an end",
    "a truth in place of a number",
    "a date in place of a number",
    "a point in space",
    "text where a list belongs",
    "a list where text belongs",
    "a number where a table belongs",
    "a law that is unknown",
    "a joint that is unknown",
    "a joint without a type",
    "a joint without points",
    "a name that no variable can have",
    "no name",
}


def test_the_committed_schema_is_current(golden: Callable[[str, str], None]) -> None:
    golden("../../docs/mechanism.schema.json", schema_text())


def test_the_schema_is_valid_and_refers_only_to_its_definitions() -> None:
    Draft7Validator.check_schema(schema())
    defined = set(schema()["definitions"])
    references = set(schema_text().split('"#/definitions/')[1:])
    assert {one.partition('"')[0] for one in references} <= defined


@pytest.mark.parametrize("name", gallery.names())
@pytest.mark.few(8)
def test_the_gallery_fits(name: str) -> None:
    path = gallery.folder() / name / "mechanism.toml"
    assert list(SCHEMA.iter_errors(tomllib.loads(path.read_text(encoding="utf-8")))) == []
    assert list(SCHEMA.iter_errors(tomllib.loads(text(gallery.load(name))))) == []


@pytest.mark.parametrize("case", CHANGES)
def test_wrong_files_do_not_fit_where_their_shape_is_wrong(case: str) -> None:
    old, new, _ = CHANGES[case]
    try:
        document = tomllib.loads(CRANK_ROCKER.replace(old, new, 1))
    except ValueError:
        return  # no TOML at all: there is nothing to look at
    assert SCHEMA.is_valid(document) == (case not in OF_SHAPE)


def test_every_case_of_shape_exists() -> None:
    assert set(CHANGES) >= OF_SHAPE


def values(cls: type, table: dict[str, Any]) -> dict[str, Any]:
    """Add a valid value for each required key of a class to a table."""
    for key in keys_of(cls):
        if key.default is REQUIRED and key.takes != "law":
            table[key.name] = value(key.takes, key.refers.kind if key.refers else "", key.name)
    return table


def value(takes: str, refers: str, name: str) -> Any:
    names = {"point": "rod.P", "body": "rod", "choice": "x", "": ""}
    pairs = {"point": ["ground.O", "rod.P"], "body": ["arm", "rod"]}
    if name in ("carrier", "pinion", "cam", "on"):
        return "third"
    shapes = {
        "number": 1.5,
        "text": names[refers],
        "pair": pairs.get(refers),
        "numbers": [1, "2 deg/s"],
        "points": [[0, 0], [1, 1], [2, 0], [3, "1"]],
        "measure": {"measure": "angle", "of": "rod"},
        "segments": [{"law": "cycloidal", "rise": 1, "duration": 2}, {"law": "dwell", "duration": 1}],
    }
    return shapes[takes]


BODIES = {name: {"points": {"O": [0, 0], "P": ["1 mm", "2*a"]}} for name in ("ground", "rod", "arm", "third")}


@pytest.mark.parametrize("cls", JOINTS, ids=lambda cls: cls.type)
@pytest.mark.few(7)
def test_every_joint_has_its_table_in_the_schema(cls: Any) -> None:
    table = values(cls, {"type": cls.type})
    if any(key.takes == "law" for key in keys_of(cls)):
        table |= {"law": "constant_speed"}
    document = {"name": "a", "bodies": BODIES, "joints": {"J": table}}
    assert list(SCHEMA.iter_errors(document)) == []
    for key in list(table):
        assert not SCHEMA.is_valid(document | {"joints": {"J": {k: v for k, v in table.items() if k != key}}})
    assert not SCHEMA.is_valid(document | {"joints": {"J": table | {"odd": 1}}})


@pytest.mark.parametrize("cls", LOADS, ids=lambda cls: cls.type)
@pytest.mark.few(6)
def test_every_load_has_its_table_in_the_schema(cls: Any) -> None:
    table, optional = values(cls, {"type": cls.type}), {"axes": "ground", "over": {"measure": "angle", "of": "rod"}}
    if any(key.takes == "law" for key in keys_of(cls)):
        table |= {"law": "external"}
    document = {"name": "a", "bodies": BODIES, "loads": {"L": table}}
    assert list(SCHEMA.iter_errors(document)) == []
    for key in table:
        assert not SCHEMA.is_valid(document | {"loads": {"L": {k: v for k, v in table.items() if k != key}}})
    assert not SCHEMA.is_valid(document | {"loads": {"L": table | {"odd": 1}}})
    known = {key: value for key, value in optional.items() if key in {key.name for key in keys_of(cls)}}
    assert SCHEMA.is_valid(document | {"loads": {"L": table | known}})


def test_masses_and_gravity_are_in_the_schema() -> None:
    def fits(body: dict[str, Any], gravity: Any = None) -> bool:
        tables = {} if gravity is None else {"gravity": gravity}
        return SCHEMA.is_valid({"name": "a", "bodies": BODIES | {"rod": BODIES["rod"] | body}, **tables})

    assert fits({"mass": "1.2 kg", "center_of_mass": ["l/2", 0], "inertia": 0.1}, {"x": 0, "y": "-9.81 m/s2"})
    assert fits({"mass": 1, "rod": ["O", "P"]})
    assert not fits({"mas": 1})
    assert not fits({"mass": 1, "rod": ["O"]})
    assert not fits({"mass": 1, "center_of_mass": 0})
    assert not any(fits({}, gravity) for gravity in (9.81, {"y": -9.81}, {"x": 0, "y": 0, "z": 0}))


@pytest.mark.parametrize("cls", POSE_QUANTITIES, ids=lambda cls: cls.type)
def test_every_measure_has_its_table_in_the_schema(cls: Any) -> None:
    measure = values(cls, {"measure": cls.type})
    joint = {"type": "coupling", "input": {"measure": "angle", "of": "rod", "to": "arm"}, "law": "constant_speed"}

    def fits(output: dict[str, Any]) -> bool:
        return SCHEMA.is_valid({"name": "a", "bodies": BODIES, "joints": {"J": joint | {"output": output}}})

    assert fits(measure)
    for key in measure:
        assert not fits({k: v for k, v in measure.items() if k != key})
    assert not fits(measure | {"odd": 1})


@pytest.mark.parametrize(
    ("cls", "law"),
    [
        pytest.param(cls, law, marks=() if DRIVERS[0] is cls or LAWS[0] is law else pytest.mark.long)
        for cls in DRIVERS
        for law in LAWS
    ],
    ids=lambda cls: cls.type,
)
@pytest.mark.few(5)
def test_every_driver_has_its_table_with_every_law_in_the_schema(cls: Any, law: Any) -> None:
    table = values(law, values(cls, {"type": cls.type, "law": law.type}))
    document = {"name": "a", "bodies": BODIES, "drivers": {"D": table}}
    assert list(SCHEMA.iter_errors(document)) == []
    for key in list(table):
        assert not SCHEMA.is_valid(document | {"drivers": {"D": {k: v for k, v in table.items() if k != key}}})
    assert not SCHEMA.is_valid(document | {"drivers": {"D": table | {"odd": 1}}})


def test_a_table_from_a_file_replaces_the_points() -> None:
    def fits(**more: Any) -> bool:
        driver = {"type": "angle", "of": "rod", "law": "spline", **more}
        return SCHEMA.is_valid({"name": "a", "bodies": BODIES, "drivers": {"D": driver}})

    assert fits(file="lift.csv")
    assert not fits()
    assert not fits(file="lift.csv", points=[[0, 0], [1, 1]])


def test_parameters_may_be_numbers_text_or_tables() -> None:
    def fits(value: Any) -> bool:
        return SCHEMA.is_valid({"name": "a", "bodies": BODIES, "parameters": {"a": value}})

    assert all(map(fits, [1, 1.5, "40 mm", "2*b + 5 mm", {"value": "40 mm", "description": "crank"}, {"value": 1}]))
    assert not any(map(fits, [True, [1], "", "a; b", {"description": "crank"}, {"value": 1, "unit": "mm"}]))


@pytest.mark.parametrize("cls", [*JOINTS, *DRIVERS, *LOADS, *LAWS, *POSE_QUANTITIES], ids=lambda cls: cls.__name__)
def test_every_key_has_a_meaning(cls: Any) -> None:
    assert summary_of(cls)
    for key in keys_of(cls):
        assert key.meaning, f"the annotation of {cls.__name__}.{key.name} has no text for its meaning"


def test_a_field_that_no_file_can_hold_is_an_error() -> None:
    from dataclasses import dataclass

    @dataclass
    class Odd:
        anything: dict[str, float]

    with pytest.raises(NotImplementedError, match=r"Odd\.anything: .* is not a type that a mechanism file can hold"):
        keys_of(Odd)


def test_the_command_writes_the_schema(tmp_path: Path) -> None:
    path = tmp_path / "mechanism.schema.json"
    result = CliRunner().invoke(main, ["schema", "-o", str(path)])
    assert result.exit_code == 0
    assert path.read_text(encoding="utf-8") == schema_text() == CliRunner().invoke(main, ["schema"]).stdout
    assert json.loads(schema_text()) == schema()


def test_the_line_that_names_the_schema_is_a_comment() -> None:
    assert parse("#:schema docs/mechanism.schema.json\n" + CRANK_ROCKER) == parse(CRANK_ROCKER)
    with pytest.raises(MechanismError, match="unknown key"):
        parse('"$schema" = "docs/mechanism.schema.json"\n' + CRANK_ROCKER)
