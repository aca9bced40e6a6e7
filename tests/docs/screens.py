"""Take screenshots of the built site and of its live pages: `python -m tests.docs.screens FOLDER [NAME ...]`.

Desktop and phone, light and dark, as whole pages; NAME: pages by their path in docs/_build, without `.html`. Prints
what is wider than the window, and code that does not fit its column on a desktop.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.page.engines import browser

SITE = Path(__file__).parents[2] / "docs" / "_build"
PAGES = (
    "index",
    "own-linkage",
    "tutorial",
    "gallery",
    "gallery/jansen_leg",
    "mechanism-files",
    "commands",
    "forces",
    "fmu",
    "accuracy",
    "glossary",
    "reference/api-run",
)
LIVE = tuple(
    f"gallery/live/{name}"
    for name in (
        "jansen_leg",
        "crank_rocker",
        "cam_roller",
        "excavator_loaded",
        "toggle_press",
        "geared_five_bar",
        "engine",
        "parallel_jaw",
    )
)
WIDTHS = {"desktop": 1440, "phone": 390}
HIGHEST = 5000  # [px] of a picture
WIDE = """() => {
    const page = document.scrollingElement;
    const found = page.scrollWidth > innerWidth ? [`page ${page.scrollWidth} px`] : [];
    const isDesktop = innerWidth > 1000;
    for (const code of document.querySelectorAll("article pre")) {
        const [longest] = code.textContent.trim().split("\\n").sort((a, b) => b.length - a.length);
        if (isDesktop && code.scrollWidth > code.clientWidth + 1) found.push(`code: ${longest}`);
    }
    return found;
}"""


def opened(chromium: Any, names: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    """Yield each page at each width in each theme, with a name for its picture."""
    for size, width in WIDTHS.items():
        for theme in ("light", "dark"):
            options = {"color_scheme": theme, "reduced_motion": "reduce"}
            for name in names:
                with chromium.tab(**options) as page:
                    page.tab.set_viewport_size({"width": width, "height": 900})
                    page.tab.goto((SITE / f"{name}.html").as_uri())
                    page.tab.wait_for_load_state("networkidle")
                    page.tab.wait_for_timeout(300)
                    yield f"{name.replace('/', '-')}-{size}-{theme}", page.tab


def main(folder: Path, names: tuple[str, ...]) -> None:
    """Write the pictures and print what does not fit."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work, browser(Path(work)) as chromium:
        for name, tab in opened(chromium, names):
            for wide in tab.evaluate(WIDE):
                print(f"{name}: {wide}")
            if "-live-" not in name:  # live pages fit their window
                high = min(tab.evaluate("document.documentElement.scrollHeight"), HIGHEST)
                tab.set_viewport_size({"width": tab.viewport_size["width"], "height": max(high, 900)})
                tab.wait_for_timeout(300)
            tab.screenshot(path=folder / f"{name}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), tuple(sys.argv[2:]) or PAGES + LIVE)
