"""Pages of the whole gallery and of a long chain in a browser: no errors, no requests, whole ranges, native numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.mechanism.gallery.chains import fourbar_chain
from kinfmu.page import page
from tests.page.engines import PHONE, Browser, needs_browser

pytestmark = needs_browser
LARGEST = 300_000  # [bytes] of a page of the gallery
AGREEMENT = 1e-9  # of the size; JavaScript computes sines of drawn poses, the engine those of the solution


def opens_and_moves(chromium: Browser, mechanism: Mechanism, largest: int) -> None:
    """Test the page of a mechanism: its size, errors, requests, the range of its sliders, its numbers."""
    text = page(mechanism)
    assert len(text.encode()) <= largest
    with chromium.open(text) as shown:
        for tab in ("plots", "show", "files", "values"):
            shown.tab.click(f"#tab-{tab}")
        for key in ("velocity", "acceleration", "transmission", "centres", "traces", "forces"):
            shown.get(f"k.show.{key} = true")
        names = shown.get("[...k.linkage.index.keys()]")
        for number in range(len(mechanism.drivers)):
            low, high = shown.get(f"k.linkage.ranges[{number}]")
            assert high > low
            for u in np.linspace(low, high, 25):
                shown.get(f"k.refresh(() => k.move({number}, {float(u)!r}))")
                shown.settle()
                assert shown.get("k.blocked") == "", u
            shown.get(f"k.move({number}, k.linkage.law[0].u[{number}])")
        poses, inputs = [], []
        for t in np.linspace(mechanism.run.start, mechanism.run.stop, 61):
            if shown.get(f"k.linkage.goToTime({float(t)!r})"):
                poses.append(shown.get("Array.from(k.linkage.pose.q)"))
                inputs.append(shown.get("Array.from(k.linkage.u)"))
        assert shown.errors == []
        assert shown.requests == []
        size = shown.get("k.linkage.data.size")
    driven = np.array(inputs)
    values = {str(driver.inputs()[0]): driven[:, k] for k, driver in enumerate(mechanism.drivers)}
    run = kinfmu.solve(mechanism, **values)
    columns = dict(zip(names, np.array(poses).T, strict=True))
    for name in run.outputs:
        scale = 1.0 if name.is_angle else size
        assert np.nanmax(np.abs(columns[name] - run[name])) <= AGREEMENT * scale, name


@pytest.mark.parametrize("name", kinfmu.mechanism.gallery.names())
def test_page_of_the_gallery_opens_and_moves(chromium: Browser, name: str) -> None:
    opens_and_moves(chromium, kinfmu.load(name), LARGEST)


def test_page_of_a_long_chain_opens_and_moves(chromium: Browser) -> None:
    opens_and_moves(chromium, fourbar_chain(100), LARGEST)


def test_page_of_a_leg_paints_soon_and_draws_frames_in_less_than_10_ms(chromium: Browser) -> None:
    with chromium.open(page(kinfmu.load("jansen_leg"))) as shown:
        paint = shown.tab.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
        assert paint < 1000.0
        assert len(shown.get("k.curves[0]")) == 721
        for change in ("k.move(0, {angle!r})", "(k.design.set({{ m: {length!r} }}), k.reshape())"):
            shown.get("k.frames.times.splice(0)")
            for step in np.linspace(0.0, 1.0, 120):
                work = change.format(angle=float(2.0 * np.pi * step), length=float(14.0 + 2.0 * step))
                shown.get(f"k.refresh(() => {work})")
                shown.settle()
            assert np.median(shown.get("k.frames.times")) < 10.0, change
        assert shown.errors == []


def test_page_of_a_long_chain_draws_frames_in_less_than_10_ms(chromium: Browser) -> None:
    with chromium.open(page(fourbar_chain(100))) as shown:
        medians = []
        for _ in range(3):  # the machine may be busy
            shown.get("k.frames.times.splice(0)")
            for angle in np.linspace(0.0, 2.0 * np.pi, 120):
                shown.get(f"k.refresh(() => k.move(0, {float(angle)!r}))")
                shown.settle()
            medians.append(np.median(shown.get("k.frames.times")))
        assert min(medians) < 10.0
        assert shown.errors == []


def test_file_with_the_values_of_a_page_gives_an_fmu_with_its_numbers(chromium: Browser, tmp_path: Path) -> None:
    with chromium.open(page(kinfmu.load("crank_rocker")), "#bodies.rocker.points.Q.x=52.5&crank.speed=2") as shown:
        shown.tab.click("#tab-files")
        with shown.tab.expect_download() as waiting:
            shown.tab.click("#save-file")
        path = tmp_path / "changed.toml"
        path.write_bytes(waiting.value.path().read_bytes())
        names = shown.get("[...k.linkage.index.keys()]")
        poses = [shown.get(f"k.linkage.goToTime({t!r}) && Array.from(k.linkage.pose.q)") for t in (0.0, 0.5, 1.0)]
        assert shown.errors == []
    fmu = kinfmu.build(kinfmu.load(path), tmp_path / "changed.fmu", flavour="native", fmi=3)
    run = kinfmu.simulate(fmu, step=0.5, stop=1.0)
    columns = dict(zip(names, np.array(poses).T, strict=True))
    for name in ("tracer.x", "tracer.y", "rocker.phi", "coupler.x"):
        assert np.abs(columns[name] - run[name]).max() < 1e-9, name


def test_a_length_that_leads_to_another_branch_is_taken_over_before_the_change_point(chromium: Browser) -> None:
    name = "bodies.ground.points.O_4.x"
    beyond, before = float(np.deg2rad(193.2)), float(np.deg2rad(150.0))
    with chromium.open(page(kinfmu.load("fourbar_chain"))) as shown:
        shown.move(beyond)
        kept = shown.get("Array.from(k.linkage.pose.q)")
        shown.get(f"k.setValues({{ '{name}': 0.98 * k.design.values.get('{name}') }})")
        shown.settle()
        banner = shown.tab.inner_text("#banner")
        assert banner.startswith("Another branch: ")
        assert "beyond crank = 180°" in banner
        assert shown.get("Array.from(k.linkage.pose.q)") == kept
        shown.move(before)
        assert shown.tab.is_hidden("#banner")
        assert shown.get(f"k.linkage.bound.get('{name}') === k.design.values.get('{name}')")
        assert shown.errors == []


def test_fingers_drag_zoom_and_press(chromium: Browser) -> None:
    with chromium.open(page(kinfmu.load("excavator")), has_touch=True) as shown:
        shown.tab.set_viewport_size(PHONE)
        shown.tab.wait_for_timeout(100)
        shown.settle()
        fingers = shown.tab.context.new_cdp_session(shown.tab)

        def touch(kind: str, *places: tuple[float, float]) -> None:
            points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(places)]
            fingers.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": points})
            shown.settle()

        tip = shown.at("bucket.tip")
        touch("Start", tip)
        for step in range(1, 9):
            touch("Move", (tip[0] - 4.0 * step, tip[1] + 1.0 * step))
        touch("End")
        moved = shown.at("bucket.tip")
        assert np.hypot(moved[0] - tip[0] + 32.0, moved[1] - tip[1] - 8.0) < 3.0
        scale, middle = shown.get("k.view.scale"), (180.0, 200.0)
        touch("Start", (middle[0] - 40.0, middle[1]), (middle[0] + 40.0, middle[1]))
        for step in range(1, 9):
            touch("Move", (middle[0] - 40.0 - 5.0 * step, middle[1]), (middle[0] + 40.0 + 5.0 * step, middle[1]))
        touch("End")
        assert abs(shown.get("k.view.scale") / scale - 2.0) < 1e-6
        shown.tab.tap("#fit")
        shown.settle()
        assert abs(shown.get("k.view.scale") / scale - 1.0) < 0.2
        shown.tab.tap("#play")
        shown.tab.wait_for_timeout(300)
        assert shown.get("k.isPlaying")
        shown.tab.tap("#play")
        shown.tab.tap("#sheet")
        shown.tab.tap("#tab-plots")
        assert shown.tab.is_visible("#plots")
        assert shown.tab.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert shown.errors == []
