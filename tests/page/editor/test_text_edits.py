"""Files in every style of TOML are edited where they are, with their comments."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from kinfmu.errors import MechanismError
from kinfmu.mechanism.edits import Put, edited
from kinfmu.page.editor import Drawing, changed
from kinfmu.page.editor.text_edits import edited_text
from tests.page.editor.drawn import Operation, bar, ground, put

STYLES = {
    "dotted keys": """name = "x"  # the name
units.length = "mm"
bodies.ground.points = { O = [0, 0], C = [90, 0] }  # pivots
bodies.a.points.O = [0, 0]
bodies.a.points.P = [30, 0]  # pin
bodies.a.start = { x = 0, y = 0, phi = 0 }
joints.O = { type = "revolute", between = ["ground.O", "a.O"] }
drivers.m = { type = "angle", of = "a", law = "constant_speed" }
""",
    "tables in braces": """name = "x"
bodies = { ground = { points = { O = [0, 0] } }, a = { points = { O = [0, 0], P = [30, 0] }, start = {x=0,y=0,phi=0} } }
joints = { O = { type = "revolute", between = ["ground.O", "a.O"] } }
""",
    "lines of one table": """name = "x"
[bodies]
ground.points = { O = [0, 0] }
a = { points = { O = [0, 0], P = [30, 0] }, start = { x = 0, y = 0, phi = 0 } }  # bar
[joints]
O = { type = "revolute", between = [
  "ground.O",  # first
  "a.O",
] }
# end
""",
    "tables in any order": """name = "x"
[joints.O]
type = "revolute"
between = ["ground.O", "a.O"]
# about a
[bodies.a]
points = { O = [0, 0], P = [30, 0] }
start = { x = 0, y = 0, phi = 0 }
[drivers.m]
type = "angle"
of = "a"
law = "constant_speed"
[bodies.ground]
points = { O = [0, 0] }
""",
    "tables of tables": """name = "x"
[bodies.ground.points]
O = [0, 0]
[bodies.a.points]
O = [0, 0]
P = [
  30,  # x
  0,
]
[bodies.a.start]
x = 0
y = 0
phi = 0
[joints.O]
type = "revolute"
between = ["ground.O", "a.O"]
""",
}

OPERATIONS: tuple[Operation, ...] = (
    bar("a.P", (60, 20)),
    ground(5, 5),
    {"do": "move", "point": "a.P", "to": [31, 2]},
    {"do": "point", "body": "a", "at": [9, 9]},
    {"do": "rename", "place": ["bodies", "a"], "name": "crank"},
    {"do": "rename", "place": ["bodies", "a", "points", "P"], "name": "Z"},
    {"do": "rename", "place": ["joints", "O"], "name": "Z"},
    put("bodies", "a", "mass", value="1 kg"),
    {"do": "units", "length": "cm"},
    {"do": "spring", "from": {"at": [7, -9]}, "to": {"point": "a.P"}},
    {"do": "cylinder", "from": {"at": [7, -9]}, "to": {"point": "a.P"}},
)


@pytest.mark.parametrize("style", STYLES)
def test_every_style_is_edited_and_keeps_its_comments(style: str) -> None:
    text = STYLES[style]
    comments = [line[line.index("#") :] for line in text.splitlines() if "#" in line]
    drawing = Drawing.of(text, Path())
    for operation in OPERATIONS:
        after = changed(drawing, [operation])
        assert after.text != text
        assert [comment for comment in comments if comment not in after.text] == [], operation
    for place in (["joints", "O"], ["bodies", "a"]):
        removed = changed(drawing, [{"do": "delete", "place": place}])
        assert not removed.document.get("joints")
        assert removed.document["bodies"].get("ground") == drawing.document["bodies"]["ground"]


def test_an_edit_that_is_not_written_as_wanted_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    text = STYLES["lines of one table"]
    monkeypatch.setattr("tomlkit.dumps", lambda _: text)
    with pytest.raises(MechanismError, match="cannot be written into the file as it is written"):
        edited_text(text, tomllib.loads(text), [Put(("title",), "other")])


def test_a_new_table_has_a_blank_line_above_and_other_lines_stay() -> None:
    text = 'name = "x"\n[bodies.a]\n[run]\nstop = 1  # s\n'
    document = tomllib.loads(text)
    edits = [Put(("drivers", "m"), {"type": "angle", "of": "a", "start": 0.1})]
    after = edited_text(text, document, edits)
    assert after == f'{text}\n[drivers.m]\ntype = "angle"\nof = "a"\nstart = 0.1\n'
    assert tomllib.loads(after) == edited(document, edits)
