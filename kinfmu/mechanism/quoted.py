"""Values as messages show them: on one line, shortened when long, as the engineer wrote them."""

from __future__ import annotations

import reprlib
from datetime import date, time

LONGEST = 120
_LARGEST_WHOLE = 10**40  # whole numbers beyond are told by their size; Python refuses to print very long ones


class _Quoter(reprlib.Repr):
    """reprlib with room for a sentence, and the words of TOML."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = 100
        self.maxlevel = 3

    def repr_bool(self, x: bool, level: int) -> str:  # noqa: ARG002  the signature is reprlib's
        return "true" if x else "false"

    def repr_date(self, x: date | time, level: int) -> str:  # noqa: ARG002
        return x.isoformat()

    repr_datetime = repr_time = repr_date

    def repr_int(self, x: int, level: int) -> str:  # noqa: ARG002
        return repr(x) if abs(x) < _LARGEST_WHOLE else f"a whole number of {x.bit_length()} bits"


def quoted(value: object) -> str:
    """'text' in quotes with its line breaks escaped, numbers and lists as they are; LONGEST characters at most."""
    told = _QUOTER.repr(float(value) if isinstance(value, float) else value)  # numpy's floats print their type
    return told if len(told) <= LONGEST else told[: LONGEST - 3] + "..."


_QUOTER = _Quoter()
