"""Pages of the whole gallery and of a long chain in a browser: no errors, no requests, whole ranges, native numbers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism
from kinfmu.gallery.chains import fourbar_chain
from kinfmu.page import page
from tests.page.browser import Browser, browser, needs_browser

pytestmark = needs_browser
LARGEST = 300_000  # [bytes] of a page of the gallery
AGREEMENT = 1e-9  # of the size; JavaScript computes sines of drawn poses, the engine those of the solution


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("pages")) as opened:
        yield opened


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


@pytest.mark.parametrize("name", kinfmu.gallery.names())
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
