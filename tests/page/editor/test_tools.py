"""The editor of pages without a page: where clicks snap, what typed numbers mean, and what tools make of clicks."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import pytest

import kinfmu.page
from tests.page.engines import NODE, needs_node

WEB = Path(kinfmu.page.__file__).parent / "web"
SCRIPT = Path(__file__).with_name("call_tools.mjs")

pytestmark = needs_node


def called(*calls: list[Any]) -> list[Any]:
    """Return what functions of the editor return: each call is [module, function, arguments]."""
    done = subprocess.run(
        [NODE, SCRIPT, WEB], input=json.dumps(calls), capture_output=True, text=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stderr
    found: list[Any] = json.loads(done.stdout)
    return found


def sketch(**bodies: dict[str, tuple[float, float]]) -> dict[str, Any]:
    """Return a sketch of bodies with points; points of one name are pinned together."""
    points = [
        {"body": body, "name": name, "x": x, "y": y} for body, own in bodies.items() for name, (x, y) in own.items()
    ]
    joints = []
    for k, point in enumerate(points):
        others = [i for i in range(k) if points[i]["name"] == point["name"]]
        if others:
            joints.append({"name": point["name"], "type": "revolute", "points": [others[-1], k]})
    names = ["ground", *(body for body in bodies if body != "ground")]
    data = {"bodies": [{"name": name, "colour": [0, 0, 0], "pose": [0, 0, 0]} for name in names], "points": points}
    empty: dict[str, Any] = {key: [] for key in ("drivers", "shapes", "loads", "interest", "cams")}
    return {"sketch": data | empty | {"joints": joints, "unit": "mm", "box": [[0, 0], [100, 60]]}}


FOUR_BAR = sketch(
    ground={"A": (0, 0), "D": (100, 0)},
    crank={"A": (0, 0), "B": (0, 40)},
    coupler={"B": (0, 40), "C": (100, 60)},
    rocker={"C": (100, 60), "D": (100, 0)},
)
NEAR: dict[str, Any] = {"reach": 5, "step": 2}


def test_clicks_snap_to_pins_then_links_then_the_grid() -> None:
    places = [(98, 57), (1.5, 20.7), (33, 21.4), (33, 21.4)]
    more: list[dict[str, Any]] = [{}, {}, {}, {"isFree": True}]
    calls = [["editor_places", "snapped", [FOUR_BAR, p, NEAR | one]] for p, one in zip(places, more, strict=True)]
    pin, link, grid, free = called(*calls)
    assert (pin["kind"], pin["point"], pin["at"]) == ("point", "coupler.C", [100, 60])
    assert (pin["joints"], pin["open"]) == (["C"], [])
    assert (link["kind"], link["body"], link["at"], link["along"]) == ("body", "crank", [0, 20], [0, 1])
    assert grid == {"kind": "free", "at": [34, 22], "bodies": []}
    assert free["at"] == [33, 21.4]


def test_places_on_a_link_are_on_the_grid_and_stay_on_the_link() -> None:
    slanted = sketch(a={"P": (0, -20), "Q": (90, 70)}, b={"R": (0, 60), "S": (90, 80)})
    both, across = called(
        ["editor_places", "snapped", [slanted, (46, 27.3), NEAR | {"step": 5}]],
        ["editor_places", "snapped", [slanted, (31.2, 66.5), NEAR | {"step": 5}]],
    )
    assert both["at"] == [45, 25]
    assert across["at"][0] == 30
    assert across["at"][1] == pytest.approx(60 + 20 / 3, abs=1e-11)


def test_motors_and_forces_are_members_that_can_be_clicked() -> None:
    symbols = [{"table": "drivers", "name": "motor", "ends": [[-10, -10], [10, -10]]}]
    arc, pin, none = called(
        ["editor_places", "snapped", [FOUR_BAR, (6, -9), NEAR | {"hasMembers": True, "symbols": symbols}]],
        ["editor_places", "snapped", [FOUR_BAR, (1, -1), NEAR | {"hasMembers": True, "symbols": symbols}]],
        ["editor_places", "snapped", [FOUR_BAR, (6, -9), NEAR | {"symbols": symbols}]],
    )
    assert (arc["kind"], arc["table"], arc["name"]) == ("member", "drivers", "motor")
    assert (pin["kind"], none["kind"]) == ("point", "free")


def test_a_pin_on_the_ground_and_a_crossing_are_found() -> None:
    crossed = sketch(a={"P": (0, 0), "Q": (100, 0)}, b={"R": (50, -50), "S": (50, 50)})
    ground, crossing = called(
        ["editor_places", "snapped", [FOUR_BAR, (2, 1), NEAR]],
        ["editor_places", "snapped", [crossed, (51, 2), NEAR]],
    )
    assert (ground["point"], ground["bodies"]) == ("ground.A", ["ground", "crank"])
    assert (crossing["at"], sorted(crossing["bodies"])) == ([50, 0], ["a", "b"])


def test_shift_snaps_to_steps_of_15_degrees() -> None:
    (found,) = called(["editor_places", "snapped", [sketch(), (50, 28), NEAR | {"base": [0, 0], "isAngled": True}]])
    assert math.degrees(math.atan2(*found["at"][::-1])) == pytest.approx(30, abs=1e-5)
    assert math.hypot(*found["at"]) == pytest.approx(58, abs=1e-5)


@pytest.mark.parametrize(
    ("text", "base", "at"),
    [
        ("30, -4.5", None, (30, -4.5)),
        ("1e2;.5", (7, 7), (100, 0.5)),
        ("@3,4", (7, 7), (10, 11)),
        ("50", (0, 0), (30, 40)),
        ("50<90", (1, 2), (1, 52)),
        ("50 < -90 deg", (1, 2), (1, -48)),
        ("20 180", (0, 0), (-20, 0)),
        ("<0", (0, 0), (5, 0)),
    ],
)
def test_typed_numbers_are_coordinates_lengths_and_angles(
    text: str, base: tuple[float, float] | None, at: tuple[float, float]
) -> None:
    (found,) = called(["editor_places", "typed", [text, base, [3, 4]]])
    assert found["at"] == pytest.approx(at, abs=1e-9)


def test_what_is_typed_wrongly_is_refused_in_one_line() -> None:
    answers = called(
        *(
            ["editor_places", "typed", [text, base, [3, 4]]]
            for text, base in [("x", None), ("-3", [0, 0]), ("5<3", None)]
        )
    )
    assert [found["problem"] for found in answers] == [
        '"x" is neither a length, a length < angle, nor x, y',
        "a length must be greater than 0",
        "type x, y: there is no place yet from which a length counts",
    ]


def test_locked_lengths_hold_a_dragged_pin_on_a_circle() -> None:
    free, circle, fixed = called(
        ["editor_places", "kept", [[0, 40], [30, 60], []]],
        ["editor_places", "kept", [[0, 40], [30, 40], [[0, 0]]]],
        ["editor_places", "kept", [[0, 40], [30, 60], [[0, 0], [100, 60]]]],
    )
    assert (free, circle, fixed) == ([30, 60], pytest.approx([24, 32]), [0, 40])


def free(x: float, y: float) -> dict[str, Any]:
    return {"kind": "free", "at": [x, y], "bodies": []}


def link(body: str, x: float, y: float) -> dict[str, Any]:
    return {"kind": "body", "at": [x, y], "body": body, "bodies": [body], "along": [1, 0]}


def pin(*points: str, at: tuple[float, float] = (0, 0), is_open: bool = False) -> dict[str, Any]:
    bodies = [point.split(".")[0] for point in points]
    pairs = [list(points)] if is_open else []
    joints = [] if is_open or len(points) < 2 else ["J"]
    first = {"point": points[0], "points": list(points), "body": bodies[0], "bodies": bodies}
    return {"kind": "point", "at": list(at), "joints": joints, "open": pairs, **first}


def made(tool: str, *targets: dict[str, Any], **state: Any) -> Any:
    """Return the operations of the last click."""
    (found,) = called(["clicks", "", [tool, list(targets), state]])
    assert [one["refusal"] for one in found] == [""] * len(targets)
    return found[-1]["operations"]


def test_links_are_a_chain_that_ends_at_a_pin_or_at_the_same_place() -> None:
    (chain, stopped) = called(
        ["clicks", "", ["link", [free(0, 0), free(0, 40), free(90, 80), pin("ground.D", at=(120, 0))]]],
        ["clicks", "", ["link", [free(0, 0), free(0, 40), free(0, 40)]]],
    )
    assert [one["operations"] for one in chain] == [
        [],
        [{"do": "bar", "from": {"at": [0, 0]}, "to": {"at": [0, 40]}}],
        [{"do": "bar", "from": {"at": [0, 40]}, "to": {"at": [90, 80]}}],
        [{"do": "bar", "from": {"at": [90, 80]}, "to": {"point": "ground.D"}}],
    ]
    assert [one["picks"] for one in chain] == [1, 1, 1, 0]
    assert (stopped[-1]["operations"], stopped[-1]["picks"]) == ([], 0)


def test_tools_make_their_operations() -> None:
    crank, rod = link("crank", 0, 20), link("rod", 30, 5)
    assert made("ground", pin("crank.A")) == [{"do": "ground", "at": {"point": "crank.A"}}]
    assert made("motor", crank) == [{"do": "motor", "body": "crank"}]
    assert made("motor", pin("ground.A", "crank.A")) == [{"do": "motor", "body": "crank", "joint": "J"}]
    assert made("pin", pin("a.P", "b.Q", is_open=True)) == [{"do": "pin", "points": ["a.P", "b.Q"]}]
    crossing = crank | {"bodies": ["crank", "rod"]}
    at = {"body": "crank", "at": [0, 20]}
    assert made("pin", crossing) == [{"do": "pin", "at": at, "bodies": ["crank", "rod"]}]
    assert made("pin", pin("a.P"), pin("b.Q", at=(1, 0))) == [{"do": "pin", "points": ["a.P", "b.Q"]}]
    assert made("slider", pin("rod.C"), free(30, 0)) == [{"do": "slider", "point": "rod.C", "along": [30, 0]}]
    on = {"do": "slider", "point": "crank.B", "along": [1, 0], "on": "rod"}
    assert made("slider", pin("crank.B"), rod) == [on]
    assert made("slider", pin("rod.C"), free(0, 9), option="block")[0]["block"] is True
    slot = {"do": "slot", "point": "crank.B", "body": "rod", "from": [30, 5], "to": [60, 5]}
    assert made("slot", pin("crank.B"), rod, free(60, 5)) == [slot]
    assert made("slot", pin("crank.B"), free(0, 5), free(60, 5))[0]["body"] == "ground"
    assert made("slot", pin("rod.B", "crank.B"), rod, free(60, 5)) == [slot]
    ends = {"from": {"at": [0, 0]}, "to": {"body": "rod", "at": [30, 5]}}
    assert made("cylinder", free(0, 0), rod) == [{"do": "cylinder", **ends}]
    assert made("spring", free(0, 0), rod) == [{"do": "spring", **ends}]
    assert made("gear", crank, rod, number=-2) == [{"do": "gear", "bodies": ["crank", "rod"], "ratio": -2}]
    cam = {"do": "cam", "body": "crank", "follower": {"point": "rod.C"}, "kind": "flat_face"}
    assert made("cam", crank, pin("rod.C"), option="flat_face") == [cam]
    assert made("force", pin("rod.C"), free(0, 9)) == [{"do": "force", "at": {"point": "rod.C"}, "to": [0, 9]}]
    assert made("interest", pin("rod.C")) == [{"do": "interest", "at": {"point": "rod.C"}}]
    corner = {"body": "crank", "at": [50, 50]}
    assert made("interest", crank, free(50, 50)) == [{"do": "interest", "at": corner}]
    assert made("interest", crank, free(50, 50), option="corner") == [{"do": "point", **corner}]
    assert made("delete", pin("a.P", "b.Q")) == [{"do": "delete", "place": ["joints", "J"]}]
    assert made("delete", pin("a.P")) == [{"do": "delete", "place": ["bodies", "a", "points", "P"]}]
    assert made("delete", pin("a.P") | {"isEnd": True}) == [{"do": "delete", "place": ["bodies", "a"]}]
    assert made("delete", crank) == [{"do": "delete", "place": ["bodies", "crank"]}]
    member = {"kind": "member", "at": [0, 0], "bodies": [], "table": "loads", "name": "spring_1"}
    assert made("delete", member) == [{"do": "delete", "place": ["loads", "spring_1"]}]


def test_targets_that_a_tool_cannot_use_are_refused() -> None:
    found = called(
        ["clicks", "", ["motor", [free(0, 0)]]],
        ["clicks", "", ["motor", [pin("ground.A")]]],
        ["clicks", "", ["gear", [link("crank", 0, 0), link("crank", 1, 0)]]],
        ["clicks", "", ["delete", [free(0, 0)]]],
        ["clicks", "", ["spring", [free(0, 0), free(0, 0)]]],
    )
    assert [one[-1]["refusal"] for one in found] == [
        "Click a link or its pin.",
        "Click a link or its pin.",
        "Click another link.",
        "There is nothing to delete.",
        "Click another place.",
    ]
