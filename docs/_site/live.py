"""The page of each mechanism of the gallery in which it is dragged: files beside the pages of the site."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kinfmu import gallery
from kinfmu.page import page

FOLDER = "gallery/live"
FRAME = """\
```{{raw}} html
<iframe class="live" src="live/{name}.html" loading="lazy" title="{name}: drag the mechanism"></iframe>
<p><a href="live/{name}.html">On a page of its own</a></p>
```
"""


def write(app: Any, failure: Exception | None) -> None:
    """Write these pages, when the site is built (a Sphinx event)."""
    if failure is None and app.builder.name == "html":
        folder = Path(app.outdir, FOLDER)
        folder.mkdir(parents=True, exist_ok=True)
        for name in gallery.names():
            (folder / f"{name}.html").write_text(page(gallery.load(name)), encoding="utf-8", newline="\n")
