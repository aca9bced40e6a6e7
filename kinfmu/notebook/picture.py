"""Pictures in HTML, or the reason why there is none."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable

from kinfmu.display import escaped
from kinfmu.errors import KinfmuError

MOST = 24  # names in a cell
MOST_ROWS = 12  # of a table


def picture(draw: Callable[[], str], alternative: str) -> str:
    """Return the SVG text of `draw` as an image, which styles of the page do not change; of an error the reason.

    Args:
        draw: Returns the SVG.
        alternative: Text for readers who do not see the image.

    """
    try:
        image = b64encode(draw().encode()).decode()
    except KinfmuError as reason:
        return f"<p>{escaped(reason)}</p>"
    return f'<p><img alt="{escaped(alternative)}" style="max-width: 100%" src="data:image/svg+xml;base64,{image}"></p>'


def some(names: list[str]) -> str:
    """Return names separated by commas; of many, the first and the number of others."""
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return ", ".join(names[:MOST]) + more
