"""What kinfmu's site adds to Sphinx: pages made from the code and the gallery, and formulas drawn while it builds."""

from __future__ import annotations

from html import escape
from textwrap import shorten
from typing import Any

from docutils import nodes

from _site import api, command_line, docstrings, examples, formulas, gallery, live, variables
from _site.pages import Pages


def setup(app: Any) -> dict[str, bool]:
    """Connect the parts with Sphinx."""
    formulas.connect(app)
    app.connect("builder-inited", _write_pages)
    app.connect("source-read", gallery.linked)
    app.connect("source-read", examples.added)
    app.connect("html-page-context", _describe)
    app.connect("build-finished", live.write)
    app.connect("autodoc-process-docstring", docstrings.prepared, priority=400)  # before napoleon, at 500
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _describe(_app: Any, _page: str, _template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
    """Give a page its first paragraph as its description, which search engines show."""
    paragraphs = doctree.findall(nodes.paragraph) if doctree else ()
    text = " ".join(next((one.astext() for one in paragraphs), "kinfmu: kinematics of planar mechanisms").split())
    context["metatags"] = (
        context.get("metatags", "") + f'<meta name="description" content="{escape(shorten(text, 160))}">'
    )


def _write_pages(app: Any) -> None:
    pages = Pages(app.srcdir)
    for part in (api, command_line, gallery, variables):
        part.write(pages)
    pages.remove_others()
