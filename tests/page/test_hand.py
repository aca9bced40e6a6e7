"""Drags on the page: the handle of a driver, banners that end with their cause, arrows and ticks that stay in view."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import kinfmu.page
from tests.page.engines import PHONE, Browser, Opened, needs_browser, text_of

pytestmark = needs_browser
WATCH_TEXTS = """(() => {
    const own = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
        const half = 0.5 * this.measureText(text).width;
        window.texts.push([text, x + half <= this.canvas.clientWidth]);
        return own.call(this, text, x, y);
    };
})()"""


def on_screen(page: Opened, expression: str) -> tuple[float, float]:
    """Return the place on the screen of a place on the canvas."""
    x, y = page.get(expression)
    box = page.tab.locator("#drawing").bounding_box()
    return x + box["x"], y + box["y"]


@pytest.mark.parametrize("mode", ["move", "lengths"])
@pytest.mark.few(1)
def test_handle_of_a_driver_drags_it_in_both_modes_and_the_view_stays(chromium: Browser, mode: str) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        if mode == "lengths":
            page.tab.click("#edit")
        before = page.get("[k.view.x, k.view.y, k.view.scale]")
        x, y = on_screen(page, "k.handles[0].at")
        cx, cy = page.at("crank.O")
        mouse, angle = page.tab.mouse, math.radians(70)
        mouse.move(x - 6, y)  # [px], towards the pin of the crank, which is 16 px away
        assert page.get("k.canvas.classList.contains('grip')")
        mouse.down()
        mouse.move(cx + 90 * math.cos(angle), cy - 90 * math.sin(angle), steps=3)
        mouse.up()
        page.settle()
        assert page.get("k.linkage.u[0]") == pytest.approx(angle, abs=0.02)
        hx, hy = on_screen(page, "k.handles[0].at")
        assert math.atan2(cy - hy, hx - cx) == pytest.approx(angle, abs=0.02)  # it stays under the hand
        assert page.get("[k.view.x, k.view.y, k.view.scale]") == before
        assert page.get("k.design.changes()") == []
        assert page.errors == []


def test_a_finger_drags_the_handle_and_two_fingers_zoom(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker"), has_touch=True, is_mobile=True) as page:
        page.resize(PHONE)
        before = page.get("[k.view.x, k.view.y, k.view.scale]")
        x, y = on_screen(page, "k.handles[0].at")
        cx, cy = page.at("crank.O")
        radius = math.dist((x, y), (cx, cy))
        way = [math.radians(10 * k) for k in range(13)]
        off = 14  # [px] next to the handle, as fingers are
        page.touch([(cx + (radius + off) * math.cos(a), cy - (radius + off) * math.sin(a)) for a in way])
        assert page.get("k.linkage.u[0]") == pytest.approx(math.radians(120), abs=0.02)
        assert page.get("k.hand.held") is None  # let go
        assert page.get("[k.view.x, k.view.y, k.view.scale]") == before
        assert page.tab.evaluate("scrollY") == 0  # neither the view nor the page moves with the finger
        assert page.get("location.hash").startswith("#@crank=")
        angle = page.get("k.linkage.u[0]")
        box = page.tab.locator("#drawing").bounding_box()
        mx, my = box["x"] + 0.5 * box["width"], box["y"] + 0.8 * box["height"]
        page.touch([(mx - 20 - 4 * k, my) for k in range(11)], [(mx + 20 + 4 * k, my) for k in range(11)])
        assert page.get("k.view.scale") == pytest.approx(3.0 * before[2], rel=0.05)
        assert page.get("k.linkage.u[0]") == angle
        assert page.errors == []


def test_a_finger_drags_the_slider_of_a_driver(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker"), has_touch=True) as page:
        slider = page.tab.get_by_label("crank, slider")
        box = slider.bounding_box()
        y = box["y"] + 0.5 * box["height"]
        page.touch([(box["x"] + 8 + part * (box["width"] - 16), y) for part in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)])
        assert page.get("k.linkage.u[0]") == pytest.approx(math.pi, abs=0.05)
        assert page.errors == []


def test_banner_names_the_joint_and_goes_with_what_it_was_about(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        page.tab.click("#edit")
        x, y = page.at("ground.C")
        for after in ("undo", "value", "reset"):
            page.drag("ground.C", [(x + 60 * k, y) for k in range(1, 15)])
            banner = page.tab.text_content("#banner")
            assert banner.startswith("Stops here: joint C does not close: gap ")
            if after == "value":
                field = page.tab.get_by_label("rocker length mm", exact=True)
                field.fill("51")
                field.press("Enter")
            else:
                page.tab.click(f"#{after}")
            page.settle()
            assert page.tab.is_hidden("#banner"), after
        assert page.get("k.design.changes()") == []
        assert page.errors == []


def test_rows_in_messages_are_joints_and_drivers(chromium: Browser) -> None:
    stated = {
        "rows C.x, C.y do not close: gap 2 mm": "joint C does not close: gap 2 mm",
        "at 1 deg, rows C.x, D.y do not close": "at 1 deg, joints C and D do not close",
        "row AB.length closes on another branch only": "joint AB closes on another branch only",
        "rows C.x, lift.length close on another branch only": "joint C and driver lift close on another branch only",
        "redundant row C.x does not close": "joint C does not close",
        "2 cannot be reached: the limit is lift = 99.9999994 mm": "2 cannot be reached: the limit is lift = 100 mm",
        "where rows C.x, C.y are dependent": "where the equations of joint C are dependent",
    }
    code = (Path(kinfmu.page.__file__).parent / "web" / "numbers.js").read_text("utf-8").replace("export ", "")
    with chromium.tab() as page:
        for text, wanted in stated.items():
            assert page.tab.evaluate(f"text => {{ {code}; return ofJoints(text, ['lift']); }}", text) == wanted


@pytest.mark.parametrize("size", [None, PHONE])
@pytest.mark.long
def test_arrows_of_velocities_end_in_the_view_and_plots_name_a_whole_turn(
    chromium: Browser, size: dict[str, int] | None
) -> None:
    with chromium.open(text_of("jansen_leg")) as page:
        if size:
            page.tab.set_viewport_size(size)
            page.tab.wait_for_timeout(50)
            page.settle()
        page.get("k.show.velocity = true")
        for k in range(0, 360, 20):
            page.move(math.radians(k))
            heads = page.get(
                "k.extra().arrows.map(({ from, along }) => k.view.pixel(from).map((x, i) => x + [1, -1][i] * along[i]))"
            )
            width, height = page.get("[k.view.width, k.view.height]")
            assert len(heads) > 3
            assert all(0 < x < width and 0 < y < height for x, y in heads), k
        page.get("window.texts = []")
        page.get(WATCH_TEXTS)
        if size:
            page.tab.click("#sheet")
        page.tab.click("#tab-plots")
        page.settle()
        assert ["360\u00b0", True] in page.get("window.texts")
        assert page.errors == []
