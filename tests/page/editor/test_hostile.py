"""What the server of a drawing answers to wrong operations, large bodies, other sites, and several tabs."""

from __future__ import annotations

import http.client
import itertools
import json
import threading
from collections.abc import Iterator
from http import HTTPStatus
from pathlib import Path
from typing import Any

import pytest

from kinfmu.page.editor import Drawing, answer, changed, new_text
from kinfmu.page.editor.operations import MOST_OPERATIONS
from kinfmu.page.player import PlayServer, PlaySource
from kinfmu.page.player.server import LARGEST_BODY
from tests.page.editor.drawn import FOURBAR, bar, ground, put

SPOT = {"at": [3, 4]}
POINT = {"point": "coupler.D"}
EACH = (  # an operation of each kind that is possible on the four-bar, with all its arguments
    {"do": "bar", "from": POINT, "to": {"at": [7, 9]}, "body": "more"},
    {"do": "point", "body": "coupler", "at": [60, 90]},
    {"do": "ground", "at": {"body": "coupler", "at": [60, 90]}},
    {"do": "pin", "points": ["ground.A", "coupler.D"]},
    {"do": "pin", "at": SPOT, "bodies": ["crank", "rocker"]},
    {"do": "motor", "body": "rocker", "joint": "B"},
    {"do": "slider", "point": "coupler.D", "along": [1, 0], "on": "crank", "block": True},
    {"do": "slot", "point": "coupler.D", "body": "crank", "from": [0, 0], "to": [5, 5]},
    {"do": "cylinder", "from": {"at": [50, -20]}, "to": POINT, "stroke": 5},
    {"do": "gear", "bodies": ["crank", "rocker"], "ratio": -1.5},
    {"do": "cam", "body": "crank", "follower": "rocker.D", "kind": "flat_face", "rise": 2},
    {"do": "spring", "from": {"at": [50, -20]}, "to": POINT, "stiffness": 3},
    {"do": "force", "at": POINT, "vector": [1, 2]},
    {"do": "force", "at": POINT, "to": [1, 2]},
    {"do": "interest", "at": POINT, "name": "tip"},
    {"do": "move", "point": "crank.C", "to": [5, 45]},
    {"do": "length", "between": ["crank.A", "crank.C"], "value": 45},
    {"do": "set", "place": ["bodies", "crank", "mass"], "value": 2},
    {"do": "values", "values": {"bodies.crank.points.C.y": 41}},
    {"do": "name", "name": "other"},
    {"do": "units", "length": "m"},
    {"do": "rename", "place": ["bodies", "crank"], "name": "handle"},
    {"do": "delete", "place": ["joints", "C"]},
    {"do": "edit", "edits": [{"put": ["title"], "value": "mine"}, {"remove": ["run"]}]},
    {"do": "replace", "text": 'name = "x"\n[bodies.a]\n', "name": "x.toml"},
)
WRONG = (True, {}, {"at": [1]}, {"a": [[{}]]}, [True], [[]], ["no", "such", "thing"], "no such", 1e31, -(10**30) * 11)
POSSIBLE = {
    ("delete", "place"),
    ("replace", "name"),
    ("slider", "block"),
    ("values", "values"),
}  # arguments for which some of these are valid


@pytest.fixture
def server(tmp_path: Path) -> Iterator[PlayServer]:
    with PlayServer(PlaySource(str(tmp_path / "mine.toml"), is_new=True)) as served:
        yield served


def ask(
    server: PlayServer, place: str, body: Any = None, method: str = "", **headers: str
) -> tuple[int, str, dict[str, Any]]:
    """Return status, text and JSON object of the answer; body: bytes, or what is sent as JSON."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
    names = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(
        method or ("GET" if body is None else "POST"), f"/{server.url.split('/')[3]}/{place}", data, names
    )
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    is_json = answer.headers["Content-Type"].startswith("application/json")
    return answer.status, text, json.loads(text) if is_json else {}


def draw(server: PlayServer, *operations: dict[str, Any]) -> dict[str, Any]:
    """Return the answer to operations in one request."""
    state = ask(server, "editor")[2]["state"]
    status, text, answer = ask(server, "editor/operations", {"state": state, "operations": operations})
    assert status == HTTPStatus.OK, text
    return answer


@pytest.fixture
def fourbar(server: PlayServer) -> dict[str, Any]:
    return draw(server, *FOURBAR)


@pytest.mark.parametrize("operation", EACH, ids=lambda one: one["do"])
def test_each_operation_is_possible_and_can_be_undone(
    server: PlayServer, fourbar: dict[str, Any], operation: dict[str, Any]
) -> None:
    after = draw(server, operation)
    assert after["text"] != fourbar["text"]
    _, _, before = ask(server, "editor/undo", {"state": after["state"]})
    assert before["text"] == fourbar["text"]
    assert before["sketch"] == fourbar["sketch"]


@pytest.mark.parametrize("operation", EACH, ids=lambda one: one["do"])
def test_wrong_arguments_are_one_line_and_change_nothing(
    server: PlayServer, fourbar: dict[str, Any], operation: dict[str, Any]
) -> None:
    arguments = [key for key in operation if key != "do"]
    wrong = [
        {**operation, key: value} for key in arguments for value in WRONG if (operation["do"], key) not in POSSIBLE
    ]
    wrong += [{**operation, "other": 1}, {**operation, "do": f"{operation['do']}s"}, {**operation, "do": 1}]
    for one in wrong:
        status, text, _ = ask(
            server, "editor/operations", {"state": fourbar["state"], "operations": [ground(9, 9), one]}
        )
        assert (status, text.count("\n")) == (HTTPStatus.UNPROCESSABLE_ENTITY, 0), (one, text)
        assert 0 < len(text) < 600
    _, _, after = ask(server, "editor")
    assert {key: after[key] for key in ("state", "text", "sketch")} == {
        key: fourbar[key] for key in ("state", "text", "sketch")
    }


REQUIRED = [
    (operation, key)
    for operation in EACH
    for key in operation
    if key not in ("do", "joint", "on", "block", "stroke", "ratio", "rise", "stiffness", "kind")
    and (operation["do"], key) not in {("bar", "body"), ("interest", "name"), ("replace", "name")}
]


def test_missing_arguments_are_named(server: PlayServer, fourbar: dict[str, Any]) -> None:
    for operation, key in REQUIRED:
        one = {name: value for name, value in operation.items() if name != key}
        status, text, _ = ask(server, "editor/operations", {"state": fourbar["state"], "operations": [one]})
        assert status == HTTPStatus.UNPROCESSABLE_ENTITY, one
        named = {"points": "bodies", "vector": "to"}.get(key, key)
        assert text.startswith(f"{operation['do']}: needs '{named}'"), text


def test_bodies_that_are_no_requests_are_refused(server: PlayServer, fourbar: dict[str, Any]) -> None:
    state = str(fourbar["state"]).encode()
    for body in (
        b"",
        b"{",
        b"[]",
        b"1",
        b"\xff",
        b'{"state": NaN}',
        b'{"state": %s, "operations": [{"do": "ground", "at": {"at": [NaN, 0]}}]}' % state,
        b'{"state": %s, "operations": [{"do": "ground", "at": {"at": [0, -Infinity]}}]}' % state,
        b'{"state": ' + b"9" * 5000 + b"}",
        b"[" * 100_000,
        b'{"a":' * 100_000,
    ):
        status, text, _ = ask(server, "editor/operations", body)
        assert (status, text.count("\n")) == (HTTPStatus.BAD_REQUEST, 0), body[:50]
    for operations in (
        None,
        {},
        "bar",
        1,
        [1],
        [None],
        [[]],
        [{}],
        [{"do": None}],
        [{"do": "bar"}] * (MOST_OPERATIONS + 1),
    ):
        status, text, _ = ask(server, "editor/operations", {"state": fourbar["state"], "operations": operations})
        assert (status, text.count("\n")) == (HTTPStatus.UNPROCESSABLE_ENTITY, 0), operations
    assert ask(server, "editor")[2]["text"] == fourbar["text"]


def test_characters_that_no_file_can_hold_are_refused(server: PlayServer, fourbar: dict[str, Any]) -> None:
    for operation in (
        put("title", value="\ud800"),
        put("title", value="a\x00b"),
        put("\ud800", value=1),
        {"do": "replace", "text": "# \ud800\n" + fourbar["text"]},
        {"do": "replace", "text": fourbar["text"] + "\x00"},
        {"do": "\ud800"},
        bar("\ud800.A", (1, 1)),
    ):
        status, text, _ = ask(server, "editor/operations", {"state": fourbar["state"], "operations": [operation]})
        assert (status, text.count("\n")) == (HTTPStatus.UNPROCESSABLE_ENTITY, 0), operation
    assert ask(server, "editor")[2]["text"] == fourbar["text"]


def test_large_bodies_are_not_read(server: PlayServer, fourbar: dict[str, Any]) -> None:
    for what in ("operations", "undo", "save"):
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
        connection.putrequest("POST", f"/{server.url.split('/')[3]}/editor/{what}")
        connection.putheader("Content-Length", "10000000")
        connection.endheaders(b"x" * 1000)
        answer = connection.getresponse()
        assert answer.status == HTTPStatus.REQUEST_ENTITY_TOO_LARGE
        assert answer.read().decode() == f"at most {LARGEST_BODY} bytes are read"
        connection.close()
    text = fourbar["text"] + "#" * (LARGEST_BODY - 2 * len(fourbar["text"]))
    assert draw(server, {"do": "replace", "text": text})["text"] == text
    status, text, _ = ask(server, "editor/undo", {"state": fourbar["state"] + 1})
    assert status == HTTPStatus.OK


def test_other_sites_and_tokens_are_refused(server: PlayServer, fourbar: dict[str, Any]) -> None:
    body = {"state": fourbar["state"], "operations": [ground(9, 9)]}
    for place in ("editor/operations", "editor/undo", "editor/redo", "editor/save", "editor", "editor/view"):
        sent = None if place in ("editor", "editor/view") else body
        assert ask(server, place, sent, Origin="http://elsewhere.example")[0] == HTTPStatus.FORBIDDEN
        assert ask(server, place, sent, Sec_Fetch_Site="cross-site")[0] == HTTPStatus.FORBIDDEN
        assert ask(server, place, sent, Host="elsewhere.example")[0] == HTTPStatus.MISDIRECTED_REQUEST
        assert ask(server, f"../wrong/{place}", sent)[0] == HTTPStatus.NOT_FOUND
    for place in ("editor/operations", "editor/save"):
        assert ask(server, place)[0] == HTTPStatus.NOT_FOUND  # GET
    after = ask(server, "editor")[2]
    assert (after["state"], after["text"]) == (fourbar["state"], fourbar["text"])
    assert not server.source.folder.joinpath("mine.toml").exists()


def test_the_second_of_two_tabs_gets_the_state_of_the_first(server: PlayServer, fourbar: dict[str, Any]) -> None:
    first = draw(server, ground(9, 9))
    for what in ("operations", "undo", "redo", "save"):
        request = {"state": fourbar["state"], "operations": [ground(8, 8)]}
        status, _, answer = ask(server, f"editor/{what}", request)
        assert status == HTTPStatus.CONFLICT
        assert (answer["state"], answer["text"]) == (first["state"], first["text"])
        assert answer["problem"] == f"this is no longer the current drawing; it is state {first['state']} now"
    status, text, _ = ask(server, f"editor/view?state={fourbar['state']}")
    assert (status, text) == (HTTPStatus.NO_CONTENT, "")


def test_tabs_that_draw_at_once_lose_nothing(server: PlayServer) -> None:
    done: list[list[float]] = []

    def tab(x: float) -> None:
        state, count = 0, 0
        while count < 5:
            status, _, answer = ask(server, "editor/operations", {"state": state, "operations": [ground(x, count)]})
            state = answer["state"]
            if status == HTTPStatus.OK:
                done.append([x, count])
                count += 1

    tabs = [threading.Thread(target=tab, args=(10 * k,)) for k in range(4)]
    for one in tabs:
        one.start()
    for one in tabs:
        one.join()
    points = ask(server, "editor")[2]["sketch"]["points"]
    assert sorted(point["at"] for point in points) == sorted(done)
    assert len(done) == 20


def test_new_states_are_reported_to_pages(server: PlayServer, fourbar: dict[str, Any]) -> None:
    assert server.source.state.editor == fourbar["state"]
    after = draw(server, ground(9, 9))
    assert server.source.state.editor == after["state"]


def test_the_view_is_the_page_of_the_drawing(server: PlayServer, fourbar: dict[str, Any]) -> None:
    assert fourbar["isViewComing"]
    assert fourbar["badge"] == {"mobility": 1, "drivers": 1, "text": "complete", "isComplete": True}
    status, _, answer = ask(server, f"editor/view?state={fourbar['state']}")
    assert status == HTTPStatus.OK
    assert answer["view"]["modules"]["written"]["text"]
    assert answer["view"]["points"] == [
        {key: point[key] for key in ("body", "name", "x", "y")} for point in fourbar["sketch"]["points"]
    ]


def test_a_large_drawing_in_a_singular_pose_is_answered_at_once(tmp_path: Path) -> None:
    text = new_text("chain")
    drawing = Drawing.of(text, tmp_path)
    bars = [{"do": "bar", "from": {"body": "ground", "at": [40 * k, 0]}, "to": {"at": [40 * k, 20]}} for k in range(13)]
    drawing = changed(drawing, bars)
    tips = [f"{body.name}.{[*body.points][1]}" for body in drawing.mechanism.moving_bodies]
    for first, second in itertools.pairwise(tips):
        drawing = changed(drawing, [{"do": "bar", "from": {"point": first}, "to": {"point": second}}])
    drawing = changed(drawing, [{"do": "motor", "body": drawing.mechanism.moving_bodies[0].name}])
    assert len(drawing.system.coordinates) == 75
    assert answer(drawing)["badge"]["text"] in ("complete", "complete, in a singular pose")
    moved = changed(drawing, [{"do": "move", "point": tips[0], "to": [0, -20]}])
    assert answer(moved)["badge"]["mobility"] == 1


def test_the_problem_of_a_drawing_comes_with_changes_that_help(server: PlayServer, fourbar: dict[str, Any]) -> None:
    meant = fourbar["text"]
    without = draw(server, {"do": "delete", "place": ["joints", "D"]})
    at_once, *_ = without["findings"][0]["edits"]
    assert at_once["text"].startswith("pin ")
    status, _, answer = ask(server, f"editor/view?state={without['state']}")
    assert status == HTTPStatus.OK
    assert answer["view"] is None
    problem, *_ = answer["findings"]
    assert problem["kind"] == "open"
    assert "mobility is 3 but there is 1 driver" in problem["text"]
    first, *_ = problem["edits"]
    helped = draw(server, *first["operations"])
    assert helped["badge"]["isComplete"]
    assert helped["text"].count("revolute") == meant.count("revolute")


def test_saving_over_another_program_needs_force(server: PlayServer, fourbar: dict[str, Any]) -> None:
    path = server.source.folder / "mine.toml"
    path.write_text("name = ")
    status, _, answer = ask(server, "editor/save", {"state": fourbar["state"]})
    assert status == HTTPStatus.CONFLICT
    assert answer["problem"] == "mine.toml was changed by another program; load it, or save over it"
    assert answer["isFileChanged"]
    assert path.read_text() == "name = "
    status, _, answer = ask(server, "editor/save", {"state": fourbar["state"], "force": True})
    assert (status, answer["isSaved"]) == (HTTPStatus.OK, True)
    assert path.read_text() == fourbar["text"]


def test_a_mechanism_of_the_gallery_has_no_file_to_edit() -> None:
    with PlayServer(PlaySource("fourbar")) as server:
        for place, body in (("editor", None), ("editor/operations", {"state": 1, "operations": []})):
            status, text, _ = ask(server, place, body)
            assert status == HTTPStatus.UNPROCESSABLE_ENTITY
            assert text == "only a mechanism file can be edited; save one from this page, and open it"
