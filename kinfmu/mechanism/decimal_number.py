"""Decimal numbers as tables of text hold them."""

from __future__ import annotations

import re

_DECIMAL = re.compile(r"\s*+[+-]?+(?:(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?+|nan|inf)\s*+")


def read_decimal(text: str) -> float:
    """Return the number of a plain decimal such as '-1.5e3', also of nan and inf.

    Raises a ValueError for other text. Python's `float` takes more: '1_000', digits of other scripts, 'Infinity'.
    """
    if not _DECIMAL.fullmatch(text):
        raise ValueError("not a plain decimal number")
    return float(text)
