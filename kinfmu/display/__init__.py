"""Values that show themselves in notebooks, and the HTML of their tables."""

from __future__ import annotations

from kinfmu.display.displayed import Displayed, html_of, svg_of
from kinfmu.display.html import escaped, page, table

__all__ = ["Displayed", "escaped", "html_of", "page", "svg_of", "table"]
