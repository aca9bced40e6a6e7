"""Pages in which a mechanism of the gallery is dragged, with its FMU: files next to the pages of the site."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kinfmu import build
from kinfmu.mechanism import gallery
from kinfmu.page import page

FOLDER = "gallery/live"
FRAME = """\
```{{raw}} html
<iframe class="live" src="live/{name}.html" loading="lazy" title="{name}: drag the mechanism"></iframe>
<p><a href="live/{name}.html">On a page of its own</a> · <a href="live/{name}.fmu" download>FMU</a> (FMI 2.0, for the
platform on which this site was built)</p>
```
"""


def write(app: Any, failure: Exception | None) -> None:
    """Write these pages and FMUs, when the site is built (a Sphinx event)."""
    if failure is None and app.builder.name == "html":
        folder = Path(app.outdir, FOLDER)
        folder.mkdir(parents=True, exist_ok=True)
        for name in gallery.names():
            mechanism = gallery.load(name)
            (folder / f"{name}.html").write_text(page(mechanism), encoding="utf-8", newline="\n")
            build(mechanism, folder / f"{name}.fmu")
