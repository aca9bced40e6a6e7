"""Loads in a page: their symbols at their points, in every pose and with other values; the direction of gravity."""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from kinfmu.arrays import FloatArray
from kinfmu.page import page as page_of
from tests.mechanism.loads.every_load import every_load, fourbar
from tests.page.engines import Browser, Opened, needs_browser, text_of

pytestmark = needs_browser
VIOLET = "rgb(126,34,206)"


class Drawn(NamedTuple):
    """Violet lines of a page [px], and its texts with their places."""

    lines: list[FloatArray]
    texts: dict[str, FloatArray]


@cache
def text() -> str:
    return page_of(every_load())


def drawn(page: Opened) -> Drawn:
    """What the page saves as SVG."""
    page.tab.click("#tab-files")
    with page.tab.expect_download() as saved:
        page.tab.click("#save-svg")
    svg = Path(saved.value.path()).read_text("utf-8")
    paths = re.findall(r'<path d="([^"]+)"([^>]*)/>', svg)
    lines = [np.array(re.findall(r"-?[0-9.]+", path), dtype=float) for path, look in paths if VIOLET in look]
    texts = re.findall(r'<text x="([^"]+)" y="([^"]+)"[^>]*>([^<]+)<', svg)
    return Drawn([one.reshape(-1, 2) for one in lines], {name: np.array([float(x), float(y)]) for x, y, name in texts})


def pixel(page: Opened, point: str) -> FloatArray:
    """The place of a point in the drawing."""
    body, _, name = point.partition(".")
    which = f"one => one.body === '{body}' && one.name === '{name}'"
    return np.array(page.get(f"k.view.pixel(k.linkage.point(k.linkage.data.points.findIndex({which})))"))


def ahead(lines: list[FloatArray], at: FloatArray) -> FloatArray:
    """The direction, y down, of the arrow one of whose ends is nearest to a place."""
    shafts = [line for line in lines if len(line) == 2]
    heads = [line for line in lines if len(line) == 3]
    shaft = min(shafts, key=lambda line: float(np.hypot(*(line - at).T).min()))
    head = min(heads, key=lambda line: float(np.hypot(*(line[1:].mean(axis=0) - shaft[1]))))
    way = head[0] - shaft[0]
    return np.asarray(way / np.hypot(*way))


def test_every_kind_of_load_is_drawn_at_its_points_with_its_name(chromium: Browser) -> None:
    with chromium.open(text()) as page:
        for value in (1.0, 3.5):
            page.move(value)
            found = drawn(page)
            start = pixel(page, "ground.D")
            spring = min((line for line in found.lines if len(line) > 12), key=lambda line: math.dist(line[0], start))
            np.testing.assert_allclose(spring[0], start, atol=0.02)
            np.testing.assert_allclose(spring[-1], pixel(page, "coupler.M"), atol=0.02)
            everything = np.vstack(found.lines)
            for point in ("ground.E", "ground.F", "rocker.Q", "rocker.T"):
                assert np.hypot(*(everything - pixel(page, point)).T).min() < 4.0, point
            wanted = {
                "strut",
                "muscle (input)",
                "weight = 50 N",
                "wind (input)",
                "brake = 2 N m",
                "clock",
                "grease",
                "g",
            }
            assert wanted <= set(found.texts)
        assert page.errors == []


@pytest.mark.long
def test_the_arrow_of_a_force_turns_with_its_axes_and_follows_its_values(chromium: Browser) -> None:
    wind = (
        '[loads.wind]\ntype = "force"\nat = "rocker.T"\nx = 30\ny = 40\naxes = "rocker"\n'
        '[loads.push]\ntype = "force_along"\nat = "coupler.M"\nangle = "30 deg"\n'
        'law = "polynomial"\ncoefficients = [-7]\n'
    )
    with chromium.open(page_of(fourbar(wind))) as page:
        for value in (1.0, 2.0):
            page.move(value)
            found = drawn(page)
            turn = page.get("k.linkage.bodyPose(k.linkage.body('rocker'))[2]") + math.atan2(40.0, 30.0)
            np.testing.assert_allclose(
                ahead(found.lines, pixel(page, "rocker.T")), [math.cos(turn), -math.sin(turn)], atol=0.01
            )
            against = math.radians(210.0)
            np.testing.assert_allclose(
                ahead(found.lines, pixel(page, "coupler.M")), [math.cos(against), -math.sin(against)], atol=0.01
            )
            assert "wind = 50 N" in found.texts
        page.get("k.design.set({'loads.wind.x': 0, 'loads.wind.y': -12, 'loads.push.angle': 0}) && k.reshape()")
        page.settle()
        found = drawn(page)
        turn = page.get("k.linkage.bodyPose(k.linkage.body('rocker'))[2]") - 0.5 * math.pi
        np.testing.assert_allclose(
            ahead(found.lines, pixel(page, "rocker.T")), [math.cos(turn), -math.sin(turn)], atol=0.01
        )
        np.testing.assert_allclose(ahead(found.lines, pixel(page, "coupler.M")), [-1.0, 0.0], atol=0.01)
        assert "wind = 12 N" in found.texts
        page.get("k.design.set({'loads.wind.y': 0}) && k.reshape()")
        page.settle()
        assert not any(name.startswith("wind") for name in drawn(page).texts)
        assert page.errors == []


def test_loads_can_be_switched_off_and_a_page_without_them_has_no_switch(chromium: Browser) -> None:
    with chromium.open(text()) as page:
        page.tab.click("#tab-show")
        page.tab.uncheck("#show-loads")
        page.settle()
        found = drawn(page)
        assert found.lines == []
        assert "g" not in found.texts
        assert page.errors == []
    with chromium.open(text_of("crank_rocker")) as page:
        page.tab.click("#tab-show")
        assert page.tab.locator("#show-loads").count() == 0
        assert page.get("k.linkage.data.loads") == []
        assert drawn(page).lines == []


@pytest.mark.long
def test_gravity_is_not_drawn_over_other_things(chromium: Browser) -> None:
    with chromium.open(text()) as page:
        assert "g" in drawn(page).texts
        page.get("k.view.zoom(1, [0, 0]) || (k.view.x -= 150, k.refresh())")  # the strut's end comes into the corner
        x, y = pixel(page, "ground.E")
        page.get(f"(k.view.pan(k.view.width - 34 - {x}, 74 - {y}), k.refresh())")
        page.settle()
        assert "g" not in drawn(page).texts


@pytest.mark.long
def test_the_page_of_a_loaded_mechanism_stays_small() -> None:
    assert len(text_of("excavator_loaded").encode()) <= 200_000


@pytest.mark.long
def test_constant_loads_show_their_values_as_set_and_turn_with_their_sign(chromium: Browser) -> None:
    loads = (
        '[loads.push]\ntype = "force_along"\nat = "coupler.M"\nlaw = "constant"\nlevel = 20\n'
        '[loads.brake]\ntype = "torque"\non = "rocker"\nlaw = "constant"\nlevel = -3\n'
    )
    with chromium.open(page_of(fourbar(loads))) as page:
        found = drawn(page)
        assert {"push = 20 N", "brake = 3 N m"} <= set(found.texts)
        np.testing.assert_allclose(ahead(found.lines, pixel(page, "coupler.M")), [1.0, 0.0], atol=0.01)
        before = turn_of(found, pixel(page, "rocker.C"))
        assert before > 1.0  # clockwise: y is down
        page.get("k.design.set({'loads.push.law.level': -8, 'loads.brake.law.level': 4}) && k.reshape()")
        page.settle()
        found = drawn(page)
        assert {"push = 8 N", "brake = 4 N m"} <= set(found.texts)
        np.testing.assert_allclose(ahead(found.lines, pixel(page, "coupler.M")), [-1.0, 0.0], atol=0.01)
        assert turn_of(found, pixel(page, "rocker.C")) == pytest.approx(-before, abs=0.01)
        assert page.errors == []


def turn_of(found: Drawn, centre: FloatArray) -> float:
    """The angle of the circular arrow about a place, y down [rad]."""
    arc = next(line for line in found.lines if len(line) > 12 and np.ptp(np.hypot(*(line - centre).T)) < 0.1)
    angles = np.unwrap(np.arctan2(*(arc - centre).T[::-1]))
    return float(angles[-1] - angles[0])


@pytest.mark.long
def test_a_force_by_an_expression_of_changed_parameters_is_left_out_by_name(chromium: Browser) -> None:
    parameters = '[parameters]\nF = "30 N"\na = "20 deg"\n'
    loads = (
        '[loads.weight]\ntype = "force"\nat = "coupler.M"\nx = "F"\ny = "-2*F"\n'
        '[loads.push]\ntype = "force_along"\nat = "rocker.T"\nangle = "a"\nlaw = "constant"\nlevel = "F"\n'
    )
    with chromium.open(page_of(fourbar(parameters + loads))) as page:
        (text_of_weight,) = (text for text in drawn(page).texts if text.startswith("weight = "))
        assert float(text_of_weight.split()[2]) == pytest.approx(30.0 * math.sqrt(5.0), rel=1e-4)
        page.get("k.design.set({ F: 40, a: -0.5 }) && k.reshape()")
        page.settle()
        found = drawn(page)
        assert not any(text.startswith("weight") for text in found.texts)
        assert "the load weight, whose numbers are changed" in page.tab.inner_text("#note")
        assert "push = 40 N" in found.texts
        way = [math.cos(-0.5), -math.sin(-0.5)]
        np.testing.assert_allclose(ahead(found.lines, pixel(page, "rocker.T")), way, atol=0.01)
        assert page.errors == []
