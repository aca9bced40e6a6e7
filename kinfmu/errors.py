"""Everything that kinfmu raises on purpose.

    KinfmuError
    |-- RequestError            what a caller asked for is not there or cannot be meant: a name, a value, a span of time
    |-- MechanismError          the mechanism as written cannot be used: file, table, key and what would be valid
    |   |-- InconsistentError   a constraint contradicts the others: the gap says by how much
    |   |-- MobilityError       drivers and degrees of freedom do not match
    |-- AssemblyError           the bodies cannot be put together near the start pose
    |   |-- AmbiguousStartError the start pose lies where branches cross and nothing says which one is meant
    |-- PoseError               a sample that cannot be reached, or where the solver gave up
    |-- CompilerError           compiling generated C
    |-- FmuError                building or stepping an FMU
    |-- LogError                writing or reading a log
    |-- FigureError             drawing a figure
    |-- MissingPackageError     an optional package is not installed

Each message is one line that names the thing, the value and what would be valid; the data stay on the exception.
"""

from __future__ import annotations

from collections.abc import Iterable


class KinfmuError(Exception):
    """Root of all errors raised on purpose; keyword arguments stay on the exception as attributes."""

    def __init__(self, message: str, **data: object) -> None:
        super().__init__(message)
        self.data = data

    def __getattr__(self, name: str) -> object:
        data = self.__dict__.get("data", {})
        if name in data:
            return data[name]
        raise AttributeError(name)


class RequestError(KinfmuError):
    """What a caller asked for is not there or cannot be meant; on the command line that is wrong usage."""


class MechanismError(KinfmuError):
    """The mechanism as written cannot be used."""


class InconsistentError(MechanismError):
    """A constraint contradicts the others; `gap` is by how much, as a length."""


class MobilityError(MechanismError):
    """Drivers and degrees of freedom do not match."""


class AssemblyError(KinfmuError):
    """The bodies cannot be put together near the start pose."""


class AmbiguousStartError(AssemblyError):
    """The start pose lies where branches cross and nothing says which one is meant."""


class PoseError(KinfmuError):
    """A sample that cannot be reached, or where the solver gave up."""


class CompilerError(KinfmuError):
    """Compiling generated C failed, or there is no compiler."""


class FmuError(KinfmuError):
    """Building or stepping an FMU failed."""


class LogError(KinfmuError):
    """Writing or reading a log failed."""


class FigureError(KinfmuError):
    """Drawing or writing a figure failed."""


class MissingPackageError(KinfmuError):
    """An optional package is not installed."""


MOST_LISTED = 100  # names in a message
OTHER_WORDS = {  # of other programs and of drawings, by what they are called here
    **dict.fromkeys(("pin", "hinge", "pivot", "rotational", "rotary"), "revolute"),
    **dict.fromkeys(("prismatic", "slider", "slide", "sliding", "linear"), "translational"),
    **dict.fromkeys(("weld", "welded", "rigid"), "fixed"),
    **dict.fromkeys(("inch", "inches", '"'), "in"),
    **dict.fromkeys(("foot", "feet"), "ft"),
    **dict.fromkeys(("\N{DEGREE SIGN}", "degree", "degrees"), "deg"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("turn", "turns", "revolution", "revolutions"), "rev"),
}
LONGEST_WORD = 200  # characters of a word that may be a misspelt name


def listed(names: Iterable[str]) -> str:
    """`a, b, c`, or `none`: how messages list what would be valid; of more than MOST_LISTED names the first."""
    names = list(names)
    if len(names) > MOST_LISTED:
        names[MOST_LISTED - 1 :] = [f"... ({len(names)} in all)"]
    return ", ".join(names) or "none"


def suggestion(word: str, known: Iterable[str]) -> str:
    """`; did you mean 'coupler'?` when something known is close to `word`, else nothing."""
    import difflib

    if len(word) > LONGEST_WORD:  # no misspelt name, and slow to compare
        return ""
    known = list(known)
    near = [meant for meant in [OTHER_WORDS.get(word.lower())] if meant in known]
    near = near or difflib.get_close_matches(word, known, n=1) or [k for k in known if k.lower() == word.lower()]
    return f"; did you mean '{near[0]}'?" if near else ""
