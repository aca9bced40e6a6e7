"""The page of the editor: what is drawn goes on, is undone, kept, saved and shared, and half-drawn files are shown."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import kinfmu
from kinfmu.mechanism.gallery.load import folder
from kinfmu.page.player import PlayServer, PlaySource
from tests.page.editor.drawn import FOURBAR, bar, drawn
from tests.page.editor.hand import DrawingHand, drawing_hand
from tests.page.engines import Browser, needs_browser
from tests.page.test_page import CONTRASTS, LABELS, LARGEST

pytestmark = [needs_browser, pytest.mark.long]
LINKAGE = Path(__file__).parents[2] / "mechanism" / "imports" / "linkage" / "slider_crank.linkage2"
CONFLICT = "Failed to load resource: the server responded with a status of 409 (Conflict)"


@pytest.fixture
def hand(chromium: Browser, tmp_path: Path) -> Iterator[DrawingHand]:
    """A hand that draws in the page of a four-bar, with the tool for moving."""
    with drawing_hand(chromium, tmp_path, drawn(*FOURBAR).text) as opened:
        opened.button("#draw")
        opened.page.tab.wait_for_function("window.kinfmu.editor.machine")
        yield opened


def places(hand: DrawingHand) -> dict[str, Any]:
    """Return the places of all points."""
    found: dict[str, Any] = hand.get(
        "Object.fromEntries(e.sketch.data.points.map((p, k) => [e.sketch.nameOf(k), p.at]))"
    )
    return found


def test_a_dragged_pin_moves_with_all_that_is_pinned_there_and_locks_keep_lengths(hand: DrawingHand) -> None:
    hand.drag((120, 80), (130, 90))
    assert places(hand)["coupler.D"] == places(hand)["rocker.D"] == [130, 90]
    assert hand.get("k.linkage.data.file") is not None
    hand.click((115, 45))
    assert hand.page.tab.inner_text("#draw-panel .selected h2") == "Link rocker"
    hand.page.tab.check("#draw-panel .selected .check input")
    hand.drag((130, 90), (100, 150))
    x, y = places(hand)["rocker.D"]
    assert (x, y) == pytest.approx((100, (30**2 + 90**2) ** 0.5))
    assert hand.page.errors == []


def test_lengths_and_places_are_typed_for_what_is_selected(hand: DrawingHand) -> None:
    hand.click((0, 20))
    hand.typed("50")
    assert places(hand)["crank.C"] == places(hand)["coupler.C"] == [0, 50]
    hand.click((120, 80))
    hand.typed("125, 70")
    assert places(hand)["rocker.D"] == [125, 70]
    hand.page.tab.get_by_label("Place", exact=True).fill("110, 75")
    hand.page.tab.keyboard.press("Enter")
    hand.wait()
    assert places(hand)["rocker.D"] == [110, 75]


def test_members_at_a_pin_are_deleted_one_by_one(hand: DrawingHand) -> None:
    hand.tool("interest")
    hand.click((120, 80))
    hand.tool("move")
    hand.click((120, 80))
    members = hand.page.tab.locator("#draw-panel .selected span.wide")
    assert members.all_inner_texts() == ["D (revolute, coupler\u2013rocker)", "E (of interest)"]
    hand.button("[aria-label='Delete E (of interest)']")
    hand.button("[aria-label^='Delete D (revolute']")
    assert members.all_inner_texts() == []
    assert hand.page.errors == []


def test_what_is_selected_is_deleted_by_a_button_or_a_key(hand: DrawingHand) -> None:
    ground = {"do": "ground", "at": {"point": "coupler.D"}}
    force = {"do": "force", "at": {"point": "coupler.D"}, "to": [150, 120]}
    operations = json.dumps([ground, {"do": "motor", "body": "rocker"}, force])
    assert hand.get(f"e.operate({operations})")

    def counts() -> list[int]:
        found: list[int] = hand.get("['drivers', 'loads', 'joints', 'bodies'].map((all) => e.sketch.data[all].length)")
        return found

    def select_symbol(name: str) -> None:
        ends = hand.get(f"e.painter.symbols.filter((one) => one.name === '{name}').at(-1).ends[0]")
        hand.click(tuple(ends))

    hand.wait()
    assert counts() == [2, 1, 5, 4]
    select_symbol("motor_2")
    hand.button("#draw-bar button:has-text('Delete motor_2')")
    assert counts() == [1, 1, 5, 4]
    select_symbol("motor")
    hand.press("Delete")
    select_symbol("force_1")
    hand.press("Delete")
    assert counts() == [0, 0, 5, 4]
    hand.click((60, 60))
    members = hand.page.tab.locator("#draw-panel .selected span.wide")
    assert members.all_inner_texts() == [
        "C (revolute, crank\u2013coupler)",
        "D (revolute, coupler\u2013rocker)",
        "E (revolute, ground\u2013coupler)",
    ]
    hand.click((120, 80))
    hand.button("#draw-bar button:has-text('Delete pin ground.D')")
    assert hand.get("e.sketch.data.joints.map((joint) => joint.name)") == ["A", "C", "D", "B"]
    hand.click((100, 0))
    hand.button("#draw-bar button:has-text('Delete pin ground.B')")
    hand.click((110, 40))
    hand.press("Delete")
    hand.click((60, 60))
    hand.button("#draw-panel .selected .edits button")
    assert counts() == [0, 0, 1, 2]
    assert hand.page.errors == []


def test_the_name_of_a_pin_is_off_the_arc_of_its_motor(hand: DrawingHand) -> None:
    drawn_at = """() => {
        const own = CanvasRenderingContext2D.prototype.fillText;
        const found = [];
        CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
            if (text === "A") found.push([x, y]);
            own.call(this, ...arguments);
        };
        window.kinfmu.editor.painter.paint(window.kinfmu.canvas.getContext("2d"));
        CanvasRenderingContext2D.prototype.fillText = own;
        return found;
    }"""
    ((x, y),) = hand.page.tab.evaluate(drawn_at)
    pivot = hand.get("k.view.pixel([0, 0])")
    assert ((x - pivot[0]) ** 2 + (y - pivot[1]) ** 2) ** 0.5 > 19 + 6


def test_all_is_undone_and_made_again(chromium: Browser, tmp_path: Path) -> None:
    with drawing_hand(chromium, tmp_path) as hand:
        empty = hand.get("e.session.answer.text")
        hand.click((0, 0), (0, 40), (120, 80), (100, 0))
        whole = hand.get("e.session.answer.text")
        hand.press("Escape", *["Control+z"] * 3)
        assert hand.get("e.session.answer.text") == empty
        assert hand.page.tab.is_disabled("#undo")
        hand.press(*["Control+y"] * 3)
        assert hand.get("e.session.answer.text") == whole
        assert hand.page.errors == []


def test_findings_apply_their_edits_and_the_mechanism_plays_in_the_same_page(chromium: Browser, tmp_path: Path) -> None:
    with drawing_hand(chromium, tmp_path) as hand:
        hand.get("window.isSamePage = true")
        hand.click((0, 0), (0, 40), (120, 80), (100, 0))
        assert hand.page.tab.inner_text("#badge") == hand.get("e.session.answer.badge.text") != "complete"
        hand.tool("ground")
        hand.click((0, 0), (100, 0))
        assert hand.page.tab.is_hidden("#transport")
        hand.button("#draw-panel .ghost >> nth=0")
        assert hand.plays()
        assert hand.page.tab.inner_text("#badge") == "complete"
        assert hand.get("window.isSamePage")
        hand.press("Space")
        hand.page.tab.click("#tab-files")
        with hand.page.tab.expect_download() as download:
            hand.page.tab.click("#save-time")
        assert download.value.path().read_text("utf-8").startswith("time [s],link_1.phi [deg]")
        with hand.page.tab.expect_download() as download:
            hand.page.tab.click("#save-fmu2")
        fmu = tmp_path / "drawn.fmu"
        download.value.save_as(fmu)
        assert kinfmu.simulate(fmu).t[-1] == pytest.approx(2)
        with hand.page.tab.expect_download() as download:
            hand.page.tab.click("#save-page")
        assert download.value.path().read_text("utf-8").startswith("<!doctype html>")
        hand.press("Control+z")
        assert hand.get("e.session.answer.badge.drivers") == 0
        assert hand.page.tab.is_hidden("#transport")
        assert hand.page.errors == []


def test_a_small_drawing_fills_the_view_when_it_begins_to_move(chromium: Browser, tmp_path: Path) -> None:
    with drawing_hand(chromium, tmp_path) as hand:
        for _ in range(6):
            hand.button("#out")
        hand.typed((0, 0), (0, 40), (120, 80), (100, 0))
        hand.press("g")
        hand.typed((0, 0), (100, 0))
        hand.press("m")
        hand.typed((0, 20))
        assert hand.plays()
        x0, y0, x1, y1 = hand.get("k.linkage.box().map((edge) => edge * k.view.scale)")
        assert max((x1 - x0) / hand.get("k.view.width"), (y1 - y0) / hand.get("k.view.height")) > 0.5
        assert hand.page.errors == []


def test_values_set_while_it_moves_are_part_of_the_drawing(hand: DrawingHand) -> None:
    hand.button("#draw")
    hand.get("(k.design.set({'bodies.crank.points.C.y': 45, 'bodies.coupler.points.C.y': 45}), k.design.commit())")
    hand.page.settle()
    hand.press("v")
    hand.page.tab.wait_for_function("window.kinfmu.editor.session.answer.text.includes('45')")
    assert places(hand)["crank.C"] == [0, 45]
    assert hand.page.errors == []


def test_a_file_that_another_program_writes_is_not_overwritten(hand: DrawingHand) -> None:
    hand.press("v")
    hand.path.write_text(hand.path.read_text("utf-8") + "# first\n", "utf-8")
    hand.page.tab.wait_for_function("window.kinfmu.editor.session.answer.text.includes('# first')")
    hand.drag((120, 80), (130, 90))
    hand.path.write_text(hand.path.read_text("utf-8") + "# second\n", "utf-8")
    hand.press("Control+s")
    banner = hand.page.tab.locator("#draw-banner")
    assert "was changed by another program" in banner.locator("span").inner_text()
    assert "# second" in hand.path.read_text("utf-8")
    banner.get_by_text("Overwrite the file").click()
    hand.page.tab.wait_for_function("document.getElementById('save').textContent === 'Saved'")
    assert "130" in hand.path.read_text("utf-8")
    assert set(hand.page.errors) == {CONFLICT}


def test_a_second_editor_is_noticed_and_shown(hand: DrawingHand) -> None:
    other = {"state": hand.get("e.session.state"), "operations": [{"do": "name", "name": "elsewhere"}]}
    hand.get(
        f"(k.frames.ask(), fetch('editor/operations', {{ method: 'POST', body: {json.dumps(json.dumps(other))} }}))"
    )
    hand.page.tab.wait_for_function("document.getElementById('name').textContent === 'elsewhere'")
    hand.get("e.session.answer.state = 0")
    hand.drag((120, 80), (130, 90))
    assert hand.page.tab.inner_text("#draw-banner span").endswith("what is shown is the newer state.")
    assert places(hand)["rocker.D"] == [120, 80]


def test_a_text_is_pasted_and_a_refusal_is_one_line(hand: DrawingHand) -> None:
    paste = """text => {
        const data = new DataTransfer();
        data.setData("text", text);
        document.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true }));
    }"""
    text = (folder() / "crank_rocker" / "mechanism.toml").read_text("utf-8")
    hand.page.tab.evaluate(paste, text)
    hand.wait()
    assert hand.get("e.session.answer.text") == text
    hand.page.tab.evaluate(paste, "not\na mechanism")
    hand.wait()
    line = hand.page.tab.inner_text("#draw-banner span")
    assert line.startswith("replace: ") or "TOML" in line
    assert "\n" not in line
    assert hand.get("e.session.answer.text") == text
    hand.press("Escape")
    assert hand.page.tab.is_hidden("#draw-banner")


def test_a_picture_is_scaled_by_two_clicks_and_a_length(hand: DrawingHand, tmp_path: Path) -> None:
    path = tmp_path / "picture.png"
    Image.new("RGB", (400, 300), "white").save(path)
    hand.page.tab.set_input_files("#picture-file", path)
    hand.page.tab.wait_for_function("window.kinfmu.editor.machine?.tool === 'scale'")
    (x, y), size = hand.get("e.picture.at"), hand.get("e.picture.size")
    hand.click((x + 50 * size, y - 100 * size), (x + 250 * size, y - 100 * size))
    hand.typed("80")
    assert hand.get("e.picture.size") == pytest.approx(0.4, rel=0.02)
    hand.page.tab.click("text=Move it")
    (x, y), size = hand.get("e.picture.at"), hand.get("e.picture.size")
    hand.click((x + 50 * size, y - 100 * size), (0, 0))
    assert hand.get("e.picture.at") == pytest.approx([-50 * size, 100 * size], abs=0.5)
    assert hand.get("e.machine.tool") == "move"


def test_a_half_drawn_file_is_opened_in_the_editor(chromium: Browser, tmp_path: Path) -> None:
    with drawing_hand(chromium, tmp_path, drawn(*FOURBAR[:4]).text) as hand:
        hand.page.tab.wait_for_function("window.kinfmu.editor.sketch")
        hand.wait()
        assert hand.page.tab.is_visible("#draw-tools")
        assert hand.page.tab.is_hidden("#transport")
        hand.tool("delete")
        hand.click((60, 60))
        assert set(places(hand)) == {"ground.A", "ground.B", "crank.A", "crank.C"}
        assert hand.page.errors == []


@pytest.mark.parametrize("name", ["excavator_loaded", "jansen_leg"])
def test_pages_with_an_editor_are_small(name: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    kinfmu.save(kinfmu.load(name), path)
    with PlayServer(PlaySource(str(path))) as server:
        assert len(server.source.page().encode()) <= LARGEST


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_all_controls_have_names_and_texts_can_be_read(hand: DrawingHand, theme: str) -> None:
    if hand.page.tab.evaluate("document.documentElement.dataset.theme") != theme:
        hand.page.tab.click("#theme")
    hand.click((0, 20))
    hand.page.tab.wait_for_timeout(300)  # transitions of colours
    assert hand.page.tab.evaluate(f"({LABELS})()")["found"] == []
    dim = [one for one in hand.page.tab.evaluate(f"({CONTRASTS})()") if one["ratio"] < one["least"]]
    assert dim == []


def test_a_pin_that_is_dropped_on_another_one_is_pinned_there(hand: DrawingHand) -> None:
    hand.tool("link")
    hand.click((40, 20), (60, 20))
    hand.tool("move")
    hand.drag((60, 20), (100, 0))
    (end,) = (name for name, at in places(hand).items() if name.startswith("link_1.") and at == [100, 0])
    joints = hand.get(f"e.sketch.data.joints.filter((j) => j.points.some((k) => e.sketch.nameOf(k) === '{end}'))")
    assert [joint["type"] for joint in joints] == ["revolute"]


def test_undo_and_redo_of_an_import_fit_the_view_and_its_notes_are_shown(chromium: Browser, tmp_path: Path) -> None:
    with drawing_hand(chromium, tmp_path) as hand:
        hand.click((0, 0), (0, 40), (30, 30))
        hand.press("Escape")
        hand.page.tab.set_input_files("#import-file", LINKAGE)
        hand.page.tab.wait_for_function("window.kinfmu.editor.session.answer.text.startsWith('# Imported from')")
        hand.wait()
        notes = hand.page.tab.locator("#draw-panel .finding", has_text="import: ")
        assert notes.count() == hand.get("e.session.answer.text").split("\n\n")[0].count("\n#   ")
        for key in ("Control+z", "Control+y", "Control+z"):
            hand.press(key)
            corners = hand.get("[e.box.slice(0, 2), e.box.slice(2)].map((p) => k.view.pixel(p))")
            width, height = hand.get("[k.view.width, k.view.height]")
            assert all(0 <= x <= width and 0 <= y <= height for x, y in corners), key
            assert max(abs(corners[1][0] - corners[0][0]) / width, abs(corners[1][1] - corners[0][1]) / height) > 0.5
        assert notes.count() == 0
        hand.click((0, 0))
        scale = hand.get("k.view.scale")
        hand.press("Control+z")
        assert hand.get("k.view.scale") == scale  # of one link
        assert hand.page.errors == []


def test_a_half_drawn_mechanism_gets_changes_that_were_tried_and_one_click_makes_them(
    chromium: Browser, tmp_path: Path
) -> None:
    half = drawn(*FOURBAR[:4], bar((123, 78), "ground.B", "rocker"))
    with drawing_hand(chromium, tmp_path, half.text) as hand:
        hand.page.tab.wait_for_function("window.kinfmu.editor.sketch")
        ghosts = hand.page.tab.locator("#draw-panel .open .ghost")
        tried = hand.page.tab.locator(".open .ghost", has_text="join coupler.D and rocker.E and drive crank")
        tried.wait_for()
        assert ghosts.first.inner_text() == "pin coupler.D and rocker.E"
        assert "it moves over the whole run" in tried.inner_text()
        tried.click()
        assert hand.plays()
        assert hand.page.tab.inner_text("#badge") == "complete"
        hand.press("Control+z")
        ghosts.first.click()
        hand.wait()
        assert places(hand)["coupler.D"] == places(hand)["rocker.E"] == [120, 80]
        assert hand.page.errors == []


def test_locks_are_there_after_a_reload(hand: DrawingHand) -> None:
    hand.click((111, 45))
    hand.page.tab.check("#draw-panel .selected .check input")
    hand.get("k.design.lock(['bodies.crank.points.C.y'])")
    hand.page.tab.reload()
    hand.page.tab.wait_for_function("window.kinfmu?.editor")
    assert hand.get("[...k.design.locked]") == ["bodies.crank.points.C.y"]
    hand.button("#draw")
    hand.page.tab.wait_for_function("window.kinfmu.editor.machine")
    hand.click((111, 45))
    assert hand.page.tab.is_checked("#draw-panel .selected .check input")
    assert hand.page.errors == []


def test_the_end_of_the_program_is_stated_once(chromium: Browser, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(drawn(*FOURBAR).text, "utf-8")
    with PlayServer(PlaySource(str(path))) as server, chromium.open_at(server.url, bypass_csp=True) as page:
        hand = DrawingHand(page, path)
        page.tab.wait_for_function("window.kinfmu.editor")
        hand.button("#draw")
        page.tab.wait_for_function("window.kinfmu.editor.machine")
        server.__exit__(None, None, None)
        page.tab.locator("#file-problem", has_text="kinfmu play has ended").wait_for()
        hand.drag((120, 80), (130, 90))
        hand.press("Control+s")
        assert page.tab.locator("[role=alert]:visible").count() == 1
        assert "start it again to go on" in page.tab.inner_text("#file-problem")


def test_keys_are_listed_once(hand: DrawingHand) -> None:
    for is_drawing in (True, False):
        hand.page.tab.click("#help")
        keys = hand.page.tab.locator("#keys tr:visible td:first-child").all_inner_texts()
        assert len(keys) == len(set(keys)) > 6
        assert sum("Space" in one for one in keys) == sum("Ctrl+Z" in one for one in keys) == 1
        assert ("chooses a tool" in hand.page.tab.inner_text("#keys")) is is_drawing
        hand.page.tab.click("#keys button")
        assert hand.page.tab.is_hidden("#keys")
        if is_drawing:
            hand.page.tab.keyboard.press("Space")  # plays: the button that opened the list has no focus
            hand.page.tab.wait_for_function("window.kinfmu.isPlaying && !window.kinfmu.editor.machine")
            hand.page.tab.keyboard.press("Space")


def test_on_a_phone_the_drawing_is_not_covered(chromium: Browser, tmp_path: Path) -> None:
    text = drawn(*FOURBAR[:4]).text
    options = {"has_touch": True, "viewport": {"width": 390, "height": 844}}
    with drawing_hand(chromium, tmp_path, text, **options) as hand:
        hand.page.tab.wait_for_function("window.kinfmu.editor.sketch")
        hand.tool("link")
        hand.click((0, 100))
        box = {one: hand.page.tab.locator(one).bounding_box() for one in ("#drawing", "#draw-bar", "#typed", "#badge")}
        bottom = box["#drawing"]["y"] + box["#drawing"]["height"]
        assert box["#draw-bar"]["y"] >= bottom
        assert box["#typed"]["y"] >= bottom
        assert hand.page.tab.inner_text("#badge") == "2 more joints or drivers"
        assert hand.page.tab.evaluate(
            "(() => { const b = document.getElementById('badge'); return b.scrollWidth <= b.clientWidth; })()"
        )
        assert box["#badge"]["x"] + box["#badge"]["width"] <= 390
        assert hand.page.tab.evaluate("document.documentElement.scrollWidth") <= 390
        assert box["#drawing"]["height"] > 0.45 * 844
