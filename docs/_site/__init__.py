"""What kinfmu's site adds to Sphinx: pages made from the code and the gallery, and formulas drawn while it builds."""

from __future__ import annotations

from typing import Any

from _site import api, command_line, docstrings, formulas, gallery, live, variables
from _site.pages import Pages


def setup(app: Any) -> dict[str, bool]:
    """Connect the parts with Sphinx."""
    formulas.connect(app)
    app.connect("builder-inited", _write_pages)
    app.connect("source-read", gallery.linked)
    app.connect("build-finished", live.write)
    app.connect("autodoc-process-docstring", docstrings.prepared, priority=400)  # before napoleon, at 500
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _write_pages(app: Any) -> None:
    pages = Pages(app.srcdir)
    for part in (api, command_line, gallery, variables):
        part.write(pages)
    pages.remove_others()
