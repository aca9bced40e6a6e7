"""Pages in which a mechanism of the gallery is dragged, with its FMU and picture: files next to the site's pages."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import kinfmu
from kinfmu import build
from kinfmu.fmu.picture import picture, svg
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.page import page

FOLDER = "gallery/live"
CARD = (280, 190)  # [px] of a picture
PART = 0.12  # of the run, after which its pose is drawn: bars are rarely in line there
FRAME = """\
```{{raw}} html
<iframe class="live" src="live/{name}.html" loading="lazy" title="{name}: drag the mechanism"></iframe>
<p><a href="live/{name}.html">On a page of its own</a> · <a href="live/{name}.fmu" download>FMU</a> (FMI 2.0, for the
platform on which this site was built)</p>
```
"""


def write(app: Any, failure: Exception | None) -> None:
    """Write these pages, FMUs and pictures, when the site is built (a Sphinx event)."""
    if failure is None and app.builder.name == "html":
        folder = Path(app.outdir, FOLDER)
        folder.mkdir(parents=True, exist_ok=True)
        for name in gallery.names():
            mechanism = gallery.load(name)
            (folder / f"{name}.html").write_text(page(mechanism), encoding="utf-8", newline="\n")
            (folder / f"{name}.svg").write_text(drawn(mechanism), encoding="utf-8", newline="\n")
            build(mechanism, folder / f"{name}.fmu")


def drawn(mechanism: Mechanism, size: tuple[float, float] = CARD) -> str:
    """Return the picture of a mechanism in a size [px], as SVG."""
    shown = picture(kinfmu.solve(mechanism), *size, PART)
    if shown is None:
        raise ValueError(f"mechanism '{mechanism.name}' has nothing to draw")
    return svg(shown, escape(mechanism.title or mechanism.name))
