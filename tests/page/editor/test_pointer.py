"""Mechanisms that are drawn in the browser, by clicks, fingers and keys, move as those that are written by hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.analysis import check
from kinfmu.mechanism import Mechanism
from kinfmu.page.editor import Drawing
from tests.page.editor import test_reference as references
from tests.page.editor.drawn import drawn, interest, put
from tests.page.editor.hand import DrawingHand, Place, drawing_hand
from tests.page.editor.test_reference import SAME, gallery, motor
from tests.page.engines import Browser, needs_browser

pytestmark = needs_browser

Drawn = tuple[dict[str, Any], ...]  # places that are compared, by name; operations that give numbers


@pytest.fixture
def hand(chromium: Browser, tmp_path: Path) -> Iterator[DrawingHand]:
    with drawing_hand(chromium, tmp_path) as opened:
        yield opened
        assert opened.page.errors == []


def assert_moves_as(
    reference: Mechanism, columns: list[str], path: Path, places: Mapping[str, Place], *operations: dict[str, Any]
) -> None:
    """Compare points of a saved file, at places of the drawing, with those of a mechanism that is written by hand."""
    assert check(kinfmu.load(path)).problem is None
    drawing = drawn(*operations, begin=Drawing.read(path))
    for name, place in places.items():
        moving = [point for point in drawing.mechanism.body_points if not point.startswith("ground.")]
        point = next(point for point in moving if math.dist(drawing.at(point), place) < SAME)
        known = [interest for interest, target in drawing.mechanism.points.items() if target == point]
        renamed = {"do": "rename", "place": ["points", *known], "name": name}
        drawing = drawn(renamed if known else interest(point, name), begin=drawing)
    times = np.linspace(0.0, float(drawing.mechanism.run.stop), 41)
    ours, theirs = kinfmu.solve(drawing.mechanism, times), kinfmu.solve(reference, times)
    assert ours.good.all()
    for column in columns:
        expected = theirs[column]
        np.testing.assert_allclose(ours[column], expected, rtol=0.0, atol=SAME * max(1.0, np.abs(expected).max()))


def slider_crank(hand: DrawingHand) -> Drawn:
    hand.click((0, 0), (30, 0), (120, 10), (140, 10))
    hand.tool("ground")
    hand.click((0, 0))
    hand.tool("slider", "Block")
    hand.click((130, 10), (150, 10))
    hand.tool("motor")
    hand.click((15, 0))
    return ({"Q": (120, 10)},)


def inverted_slider_crank(hand: DrawingHand) -> Drawn:
    written = gallery("inverted_slider_crank")
    pin, tip, end = written.at("crank.P"), written.at("lever.tip"), written.at("ram.R")
    hand.typed((0, 300), pin)
    hand.tool("link")
    hand.typed((0, 0), tip, end)
    hand.fit()
    hand.tool("slot")
    hand.click(pin, (0, 0), tip)
    hand.tool("slider")
    hand.click(end)
    hand.typed((end[0] + 100, end[1]))
    hand.tool("ground")
    hand.click((0, 300), (0, 0))
    hand.tool("motor")
    hand.click((0.5 * pin[0], 150 + 0.5 * pin[1]))
    return ({"P": pin, "end": tip, "R": end}, *motor(written.mechanism))


def watt_six_bar(hand: DrawingHand) -> Drawn:
    written = gallery("watt_six_bar")
    crank, coupler, rocker = written.at("crank.P"), written.at("coupler.Q"), (80, 0)
    corner, other, end = written.at("coupler.R"), written.at("rocker.S"), written.at("left.T")
    hand.typed((0, 0), crank, coupler, rocker)
    hand.fit()
    hand.tool("ground")
    hand.click((0, 0), rocker)
    for link, place in (((crank, coupler), corner), ((coupler, rocker), other)):
        hand.tool("interest", "Corner")
        hand.click(((link[0][0] + link[1][0]) / 2, (link[0][1] + link[1][1]) / 2))
        hand.typed(place)
    hand.fit()
    hand.tool("link")
    hand.click(corner)
    hand.typed(end)
    hand.fit()
    hand.click(other)
    hand.tool("motor")
    hand.click((0.5 * crank[0], 0.5 * crank[1]))
    return ({"T": end}, *motor(written.mechanism))


def excavator(hand: DrawingHand) -> Drawn:
    written = gallery("excavator")

    def at(point: str) -> tuple[float, float]:
        x, y = written.at(point)
        return x, y

    hand.page.tab.get_by_label("Unit of length").select_option("m")
    hand.wait()
    hand.typed((0, 0), at("boom.P"), at("stick.Q"))
    hand.fit()
    corners = {
        "boom.P": ("boom.boom_eye", "boom.stick_foot"),
        "stick.Q": ("stick.stick_eye", "stick.bucket_foot", "stick.I"),
    }
    begins = {"boom.P": (0.0, 0.0), "stick.Q": at("boom.P")}
    for end, places in corners.items():
        (x, y), (u, v) = begins[end], at(end)
        for place in places:
            hand.tool("interest", "Corner")
            hand.click((0.8 * x + 0.2 * u, 0.8 * y + 0.2 * v))
            hand.typed(at(place))
    hand.tool("link")
    hand.typed(at("stick.I"), at("idler.N"))
    hand.press("Escape")
    hand.typed(at("stick.Q"), at("bucket.M"))
    hand.press("Escape")
    hand.typed(at("idler.N"), at("bucket.M"))
    (x, y), (u, v) = at("stick.Q"), at("bucket.M")
    hand.fit()
    hand.tool("interest", "Corner")
    hand.click((0.5 * x + 0.5 * u, 0.5 * y + 0.5 * v))
    hand.typed(at("bucket.tip"))
    hand.tool("ground")
    hand.typed((0, 0))
    cylinders = (
        ("ground.boom_foot", "boom.boom_eye"),
        ("boom.stick_foot", "stick.stick_eye"),
        ("stick.bucket_foot", "idler.N"),
    )
    for first, last in cylinders:
        hand.tool("cylinder")
        hand.typed(at(first), at(last))
    by_operations, _, _ = references.excavator()
    laws = enumerate(by_operations.document["drivers"].values(), start=1)
    puts = [
        put("drivers", f"cylinder_{number}", key, value=value)
        for number, driver in laws
        for key, value in driver.items()
        if key not in ("type", "between")
    ]
    return ({"tip": at("bucket.tip")}, *puts, put("run", value={"start": 0, "stop": 5, "step": 0.0125}))


def cam_with_roller(hand: DrawingHand) -> Drawn:
    written = gallery("cam_roller")
    roller = written.at("lever.roller")
    hand.click((0, 0), (20, 0))
    hand.tool("link")
    hand.click((90, 0))
    hand.typed(roller)
    hand.tool("ground")
    hand.click((0, 0), (90, 0))
    hand.tool("cam", "Roller")
    hand.click((10, 0), roller)
    hand.tool("motor")
    hand.click((10, 0))
    by_operations, _, _ = references.cam_with_roller()
    numbers = by_operations.document["joints"]["cam_1"]
    puts = tuple(
        put("joints", "cam_1", key, value=numbers[key]) for key in ("start", "begin", "roller_radius", "segments")
    )
    return ({"roller": roller}, *puts, *motor(written.mechanism))


def geared_five_bar(hand: DrawingHand) -> Drawn:
    written = gallery("geared_five_bar")
    first, last, end = written.at("gear.P"), written.at("pinion.Q"), written.at("left.T")
    hand.typed((0, 0), first, end, last, (60, 0))
    hand.fit()
    hand.tool("ground")
    hand.click((0, 0), (60, 0))
    hand.tool("gear")
    hand.typed("-2")
    hand.click((0.5 * first[0], 0.5 * first[1]), (30 + 0.5 * last[0], 0.5 * last[1]))
    hand.tool("motor")
    hand.click((0.5 * first[0], 0.5 * first[1]))
    return ({"T": end}, *motor(written.mechanism))


def toggle_clamp(hand: DrawingHand) -> Drawn:
    hand.click((0, 0), (30, 40), (80, 30), (90, 10))
    hand.tool("ground")
    hand.click((0, 0), (90, 10))
    hand.tool("interest")
    hand.click((85, 20), (130, 5))
    hand.tool("spring")
    hand.click((90, 70), (130, 5))
    hand.tool("force")
    hand.click((130, 5), (130, 45))
    hand.tool("motor")
    hand.click((15, 20))
    numbers = {"x": -3, "y": 40}
    puts = (put("loads", "force_1", key, value=value) for key, value in numbers.items())
    stiffness = put("loads", "spring_1", "stiffness", value="2 N/mm")
    return ({"jaw": (130, 5)}, *puts, stiffness, put("drivers", "motor", "speed", value="-4 rpm"))


DRAWN: tuple[Callable[[DrawingHand], Drawn], ...] = (
    slider_crank,
    inverted_slider_crank,
    watt_six_bar,
    excavator,
    cam_with_roller,
    geared_five_bar,
    toggle_clamp,
)


def test_a_four_bar_takes_ten_clicks_and_two_numbers(hand: DrawingHand) -> None:
    _, reference, columns = references.fourbar()
    hand.click((0, 0))
    hand.typed("40 < 90")
    hand.click((120, 80))
    hand.typed("100, 0")
    hand.tool("ground")
    hand.click((0, 0), (100, 0))
    hand.tool("motor")
    hand.click((0, 20))
    assert hand.clicks <= 10
    assert hand.numbers == 2
    assert hand.plays()
    assert_moves_as(reference, columns, hand.save(), {"P": (0, 40), "Q": (120, 80)})


@pytest.mark.long
@pytest.mark.parametrize("draw", DRAWN, ids=lambda draw: draw.__name__)
def test_what_is_drawn_by_pointer_moves_as_what_is_written(
    draw: Callable[[DrawingHand], Drawn], hand: DrawingHand
) -> None:
    _, reference, columns = getattr(references, draw.__name__)()
    operations = draw(hand)
    assert hand.page.tab.is_hidden("#draw-banner"), hand.page.tab.inner_text("#draw-banner")
    assert hand.plays()
    assert_moves_as(reference, columns, hand.save(), *operations)


@pytest.mark.long
def test_keys_alone_draw_a_four_bar(hand: DrawingHand) -> None:
    _, reference, columns = references.fourbar()
    hand.page.tab.focus("#draw-tools [data-tool=link]")
    hand.press("Enter")
    hand.typed("0, 0")
    step = hand.get("e.step")
    hand.press(*["ArrowUp"] * round(40 / step), "Enter")
    hand.typed("120, 80", "100, 0")
    hand.press("g", "Enter")
    hand.typed("0, 0")
    hand.press("m")
    hand.typed("0, 20")
    assert hand.clicks == 0
    assert hand.plays()
    hand.press("Control+s")
    hand.page.tab.wait_for_function("document.getElementById('save').textContent === 'Saved'")
    assert_moves_as(reference, columns, hand.path, {"P": (0, 40), "Q": (120, 80)})


@pytest.mark.long
def test_fingers_draw_a_four_bar_on_a_phone(chromium: Browser, tmp_path: Path) -> None:
    _, reference, columns = references.fourbar()
    with drawing_hand(chromium, tmp_path, has_touch=True, is_mobile=True) as hand:
        hand.page.resize({"width": 390, "height": 844})
        hand.click((0, 0))
        hand.page.tab.tap("#typed")
        hand.typed("40 < 90", "120, 80", "100, 0")
        hand.tool("ground")
        hand.click((0, 0), (100, 0))
        hand.tool("motor")
        hand.click((0, 20))
        assert hand.plays()
        assert hand.page.tab.evaluate("document.documentElement.scrollWidth") == 390
        assert_moves_as(reference, columns, hand.save(), {"P": (0, 40), "Q": (120, 80)})
        assert hand.page.errors == []
