"""Checks of names, numbers and lines of text, and values as messages show them."""

from __future__ import annotations

import math
import re
import reprlib
import unicodedata
from datetime import date, time
from numbers import Real
from typing import Any

from kinfmu.errors import MechanismError

LARGEST_NUMBER = 1e30  # lengths, angles, rates: products of a few of them stay far from overflow
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}\Z")
MOST_PARTS = 8  # of the name of a parameter


def check_name(where: str, name: str, *, most_parts: int = 1) -> None:
    """Raise a MechanismError unless `name` is a valid name; most_parts: of names with dots, such as 'crank.P.x'."""
    parts = name.split(".", most_parts)
    if len(parts) > most_parts or not all(map(_NAME.match, parts)):
        rule = "must consist of at most 100 letters, digits and underscores, and not begin with a digit"
        raise MechanismError(f"{where} {quoted(name)} {rule}")


def check_number(where: str, value: Any, written: object = None) -> None:
    """Raise a MechanismError unless `value` is finite and at most LARGEST_NUMBER; `written`: as messages show it."""
    if is_number(value) and abs(value) <= LARGEST_NUMBER:
        return
    shown = quoted(value if written is None else written)
    if not is_number(value):
        raise MechanismError(f"{where} = {shown} must be a number")
    if value != value or value in (math.inf, -math.inf):
        raise MechanismError(f"{where} = {shown} must be a finite number")
    raise MechanismError(f"{where} = {shown} is too large; numbers go up to {LARGEST_NUMBER:g}")


def is_number(value: object) -> bool:
    """Return True for real numbers, False for truth values and for durations, which numpy counts among the integers."""
    is_duration = getattr(getattr(value, "dtype", None), "kind", "") == "m"
    return isinstance(value, Real) and not isinstance(value, bool) and not is_duration


def check_line(where: str, text: str) -> None:
    """Raise a MechanismError unless `text` is one line that terminals, TOML and XML accept."""
    if not is_line(text):
        raise MechanismError(f"{where} = {quoted(text)} must be one line of text without control characters")


def is_line(text: str) -> bool:
    """Return True for one line of text that terminals, TOML and XML accept."""
    controls = ("Cc", "Cs", "Zl", "Zp")  # control characters, surrogates, line breaks
    return all(ord(sign) & 0xFFFE != 0xFFFE and unicodedata.category(sign) not in controls for sign in text)


LONGEST = 120
_LARGEST_WHOLE = 10**40  # larger whole numbers are shown by their size; Python refuses to print very long ones


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
    """Return text in quotes with escaped line breaks, numbers and lists as they are; at most LONGEST characters."""
    shown = _QUOTER.repr(float(value) if isinstance(value, float) else value)  # numpy's floats print their type
    return shown if len(shown) <= LONGEST else shown[: LONGEST - 3] + "..."


_QUOTER = _Quoter()
