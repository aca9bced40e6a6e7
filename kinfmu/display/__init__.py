"""Values that show themselves in notebooks; their tables as HTML and as text."""

from __future__ import annotations

from kinfmu.display.columns import aligned
from kinfmu.display.displayed import Displayed, Live, html_of, svg_of, widget_of
from kinfmu.display.html import escaped, page, table

__all__ = ["Displayed", "Live", "aligned", "escaped", "html_of", "page", "svg_of", "table", "widget_of"]
