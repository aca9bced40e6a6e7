"""A hand that draws in the editor of a page: with a mouse, fingers or keys."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kinfmu.page.player import PlayServer, PlaySource
from tests.page.engines import Browser, Opened

Place = tuple[float, float]


class DrawingHand:
    """Draws in an opened page; counts clicks and typed numbers.

    Args:
        page: The page, with an editor.
        path: Its file.
        with_fingers: True to tap instead of clicking.

    """

    def __init__(self, page: Opened, path: Path, *, with_fingers: bool = False) -> None:
        self.page, self.path, self._with_fingers = page, path, with_fingers
        self.clicks = self.numbers = 0

    def get(self, expression: str) -> Any:
        """Return the value of an expression in which `e` is the editor and `k` the page."""
        return self.page.tab.evaluate(f"() => {{ const k = window.kinfmu, e = k.editor; return {expression}; }}")

    def wait(self) -> None:
        """Wait until all clicks are answered and drawn."""
        self.page.tab.evaluate("window.kinfmu.editor.session.next(() => 0)")
        self.page.settle()

    def press(self, *keys: str) -> None:
        """Press keys."""
        for key in keys:
            self.page.tab.keyboard.press(key)
            self.wait()

    def button(self, selector: str) -> None:
        """Click a button."""
        (self.page.tab.tap if self._with_fingers else self.page.tab.click)(selector)
        self.clicks += 1
        self.wait()

    def tool(self, name: str, option: str = "") -> None:
        """Choose a tool, and one of its options."""
        self.button(f"#draw-tools [data-tool={name}]")
        if option:
            self.button(f"#draw-bar button:has-text('{option}')")

    def at(self, place: Place) -> Place:
        """Return the place on the screen of a place of the drawing."""
        x, y = self.page.tab.evaluate(
            """place => {
                const { view, canvas } = window.kinfmu;
                const box = canvas.getBoundingClientRect();
                const [x, y] = view.pixel(place);
                return [x + box.left, y + box.top];
            }""",
            list(place),
        )
        return x, y

    def click(self, *places: Place) -> None:
        """Click places of the drawing."""
        for place in places:
            if self._with_fingers:
                self.page.tab.touchscreen.tap(*self.at(place))
            else:
                self.page.tab.mouse.click(*self.at(place))
            self.clicks += 1
            self.wait()

    def drag(self, begin: Place, end: Place) -> None:
        """Drag from one place of the drawing to another one."""
        mouse = self.page.tab.mouse
        mouse.move(*self.at(begin))
        mouse.down()
        mouse.move(*self.at(end), steps=4)
        mouse.up()
        self.wait()

    def typed(self, *texts: str | Place) -> None:
        """Type lengths with angles, or coordinates, and accept them."""
        for text in texts:
            written = text if isinstance(text, str) else f"{text[0]!r}, {text[1]!r}"
            self.page.tab.keyboard.type(written)
            self.page.tab.keyboard.press("Enter")
            self.numbers += 1
            self.wait()

    def fit(self) -> None:
        """Fit the drawing to the view."""
        self.page.tab.click("#fit")
        self.wait()

    def plays(self) -> bool:
        """Return whether the mechanism is complete and begins to move; a limit may stop it soon."""
        self.page.tab.wait_for_function("!window.kinfmu.editor.machine")
        return bool(self.get("k.linkage && k.linkage.t >= 0"))

    def save(self) -> Path:
        """Write the file, and return its path."""
        self.page.tab.click("#save")
        self.page.tab.wait_for_function("document.getElementById('save').textContent === 'Saved'")
        return self.path


@contextmanager
def drawing_hand(chromium: Browser, folder: Path, text: str = "", **options: Any) -> Iterator[DrawingHand]:
    """Yield a hand that draws in the page of a new file, or of one with a text; options: of the browser's context."""
    path = folder / "mine.toml"
    if text:
        path.write_text(text, "utf-8")
    source = PlaySource(str(path), is_new=not text)
    with PlayServer(source) as server, chromium.open_at(server.url, bypass_csp=True, **options) as page:
        page.tab.emulate_media(reduced_motion="no-preference")  # what is drawn begins to move when it is complete
        page.tab.wait_for_function("window.kinfmu.editor")
        hand = DrawingHand(page, path, with_fingers=options.get("has_touch", False))
        if not text:
            page.tab.wait_for_function("window.kinfmu.editor.sketch")
            hand.wait()
        yield hand
