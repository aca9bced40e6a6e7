"""Pages under the rules of axe-core, in light and dark, with everything opened, on desktop and phone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import kinfmu
from kinfmu.page.player import PlayServer, PlaySource
from tests.page.axe import needs_axe, violations
from tests.page.editor.drawn import FOURBAR, drawn
from tests.page.editor.hand import drawing_hand
from tests.page.engines import PHONE, Browser, Opened, needs_browser, text_of

pytestmark = [
    needs_browser,
    needs_axe,
    pytest.mark.long,
]


@pytest.fixture(autouse=True)
def states_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KINFMU_STATES", str(tmp_path / "states"))


def themes(page: Opened) -> Iterator[str]:
    """Yield each theme while the page has it."""
    for _ in range(2):
        yield page.tab.evaluate("document.documentElement.dataset.theme")
        page.tab.click("#theme")


@pytest.mark.parametrize("name", ["jansen_leg", "excavator_loaded", "cam_roller", "engine"])
def test_pages_of_mechanisms_have_no_violations(chromium: Browser, name: str) -> None:
    with chromium.open(text_of(name)) as page:
        page.tab.click("#tab-plots")
        page.tab.click("#edit")
        page.get("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        for theme in themes(page):
            for tab in ("values", "show", "files"):
                page.tab.click(f"#tab-{tab}")
                page.settle()
                assert violations(page.tab) == [], (theme, tab)
        page.tab.keyboard.press("?")
        assert violations(page.tab) == []
        page.tab.keyboard.press("Escape")
        page.resize(PHONE)
        assert violations(page.tab) == []
        page.tab.click("#sheet")
        assert violations(page.tab) == []


def test_a_length_that_does_not_close_has_no_violations(chromium: Browser) -> None:
    with chromium.open(text_of("jansen_leg")) as page:
        page.get("(k.setValues({ m: 45 }), k.commit())")
        page.tab.wait_for_selector("#banner button")
        for _ in themes(page):
            assert violations(page.tab) == []


def test_the_editor_has_no_violations(chromium: Browser, tmp_path: Path) -> None:
    with drawing_hand(chromium, tmp_path, drawn(*FOURBAR[:5]).text) as hand:
        hand.page.tab.wait_for_function("window.kinfmu.editor.sketch")
        hand.wait()
        hand.get("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        hand.tool("move")
        hand.click((0, 20))
        for theme in themes(hand.page):
            hand.tool("link")
            assert violations(hand.page.tab) == [], theme
            hand.tool("cam")
            assert violations(hand.page.tab) == [], theme
        hand.page.tab.click("#help")
        assert violations(hand.page.tab) == []
        hand.page.tab.keyboard.press("Escape")
        hand.page.resize(PHONE)
        assert violations(hand.page.tab) == []


def test_the_gallery_has_no_violations_and_leads_to_a_mechanism_and_back(chromium: Browser, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    kinfmu.save(kinfmu.load("crank_rocker"), path)
    with PlayServer(PlaySource(str(path))) as server, chromium.open_at(server.url, bypass_csp=True) as page:
        page.tab.click("[aria-label=Gallery]")
        page.tab.wait_for_selector("text=Back to the mechanism")
        assert violations(page.tab) == []
        page.tab.click("text=jansen_leg >> nth=0")
        page.tab.wait_for_function("window.kinfmu")
        assert page.tab.inner_text("#name").replace("\u200b", "") == "jansen_leg"
        assert violations(page.tab) == []
        page.tab.click("[aria-label=Gallery]")
        page.tab.click("text=Back to the mechanism")
        page.tab.wait_for_function("window.kinfmu")
        assert page.tab.inner_text("#name").replace("\u200b", "") == "crank_rocker"
        assert page.errors == []
