"""The errors that kinfmu raises on purpose.

    KinfmuError
    |-- RequestError            a request is invalid: an unknown name, a wrong value, a wrong time span
    |   |-- TooLargeError       the mechanism is valid, but too large for what is requested
    |-- MechanismError          the mechanism as written is invalid: file, table, key and what would be valid
    |   |-- InconsistentError   a constraint contradicts the others, by `gap`
    |   |-- MobilityError       drivers and degrees of freedom do not match
    |-- AssemblyError           the bodies cannot be assembled near the start pose
    |   |-- AmbiguousStartError the start pose lies where branches cross, so the branch is not defined
    |-- PoseError               a sample is unreachable, or the solver did not converge
    |-- CompilerError           compiling generated C
    |-- StudyError              running a study, or reading its results
    |-- FmuError                building or stepping an FMU
    |-- LogError                writing or reading a log
    |-- FigureError             drawing a figure
    |-- MissingPackageError     an optional package is not installed

Each message is one line with the place, the value and what would be valid; the exception also carries the data.
"""

from __future__ import annotations

from collections.abc import Iterable


class KinfmuError(Exception):
    """Root of all errors raised on purpose; keyword arguments become attributes of the exception."""

    def __init__(self, message: str, **data: object) -> None:
        super().__init__(message)
        self.data = data

    def __getattr__(self, name: str) -> object:
        data = self.__dict__.get("data", {})
        if name in data:
            return data[name]
        raise AttributeError(name)


class RequestError(KinfmuError):
    """An invalid request: an unknown name or a wrong value; on the command line: wrong usage."""


class TooLargeError(RequestError):
    """A valid mechanism that is too large for what is requested; on the command line no wrong usage."""


class MechanismError(KinfmuError):
    """An invalid mechanism, as written in a file or in Python."""


class InconsistentError(MechanismError):
    """A constraint that contradicts the others; `gap` is the misfit as a length."""


class MobilityError(MechanismError):
    """Drivers and degrees of freedom do not match."""


class AssemblyError(KinfmuError):
    """Bodies that cannot be assembled near the start pose."""


class AmbiguousStartError(AssemblyError):
    """A start pose where branches cross, so that the branch is not defined."""


class PoseError(KinfmuError):
    """A sample that is unreachable, or where the solver did not converge."""


class CompilerError(KinfmuError):
    """Compiling generated C failed, or there is no compiler."""


class StudyError(KinfmuError):
    """Running a study, or reading its results, failed."""


class FmuError(KinfmuError):
    """Building or stepping an FMU failed."""


class LogError(KinfmuError):
    """Writing or reading a log failed."""


class FigureError(KinfmuError):
    """Drawing or writing a figure failed."""


class MissingPackageError(KinfmuError):
    """An optional package is not installed."""


MOST_LISTED = 100  # names in a message
MOST_SHOWN = 24  # names in a line of a report
OTHER_WORDS = {  # words of other programs and of drawings, with the words of kinfmu
    **dict.fromkeys(
        ("pin", "pinned", "hinge", "pivot", "rotational", "rotary", "pin joint", "hinge joint"), "revolute"
    ),
    **dict.fromkeys(("prismatic", "slider", "slide", "sliding", "linear", "slider joint"), "translational"),
    **dict.fromkeys(("weld", "welded", "rigid"), "fixed"),
    **dict.fromkeys(("inch", "inches", '"'), "in"),
    **dict.fromkeys(("foot", "feet"), "ft"),
    **dict.fromkeys(("\N{DEGREE SIGN}", "degree", "degrees"), "deg"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("turn", "turns", "revolution", "revolutions"), "rev"),
}
OTHER_COORDINATES = {  # words for coordinates and their rates, with the endings of kinfmu, the likeliest first
    **dict.fromkeys(("angle", "rotation", "rot", "theta", "orientation"), ("phi",)),
    **dict.fromkeys(("angular_velocity", "angular_speed", "w"), ("omega",)),
    "angular_acceleration": ("alpha",),
    **dict.fromkeys(("speed", "velocity", "v"), ("omega", "vx")),
    **dict.fromkeys(("acceleration", "a"), ("alpha", "ax")),
    **dict.fromkeys(("position", "pos"), ("x",)),
}
SHORTEST_BEGINNING = 3  # characters of a word that may be the beginning of a longer one, such as tol of tolerance
LONGEST_WORD = 200  # characters of a word that may be a misspelt name


def listed(names: Iterable[str]) -> str:
    """Return `a, b, c`, or `none`, for messages; of more than MOST_LISTED names only the first."""
    names = list(names)
    if len(names) > MOST_LISTED:
        names[MOST_LISTED - 1 :] = [f"... ({len(names)} in all)"]
    return ", ".join(names) or "none"


def some(names: Iterable[str]) -> str:
    """Return names as `listed` does; of more than MOST_SHOWN names the first ones, and how many more there are."""
    names = list(names)
    more = f" and {len(names) - MOST_SHOWN} more" if len(names) > MOST_SHOWN else ""
    return listed(names[:MOST_SHOWN]) + more


def valid_names(word: str, known: Iterable[str], what: str = "known") -> str:
    """Return `; did you mean 'coupler'?; bodies: ground, crank, coupler`: the nearest valid name, and all of them.

    Args:
        word: The name that is not valid.
        known: Names that are.
        what: What they are, in the message.

    """
    known = list(known)
    return f"{suggestion(word, known)}; {what}: {listed(known)}"


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return `; did you mean 'coupler'?` if a known word is close to `word`, else ''."""
    import difflib

    if len(word) > LONGEST_WORD:  # not a misspelt name, and slow to compare
        return ""
    known, lower = list(known), word.lower()
    owner, _, ending = word.rpartition(".")
    others = [OTHER_WORDS.get(lower), *(f"{owner}.{ours}" for ours in OTHER_COORDINATES.get(ending.lower(), ()))]
    by_lower = {ours.lower(): ours for ours in reversed(known)}
    near = [ours for ours in (*others, by_lower.get(lower)) if ours in known]
    if not near and len(word) >= SHORTEST_BEGINNING:
        begun = [key for key in by_lower if key.startswith(lower) or key.rpartition(".")[2].startswith(lower)]
        near = [by_lower[key] for key in begun] if len(begun) == 1 else []
    near = near or [by_lower[key] for key in difflib.get_close_matches(lower, by_lower, n=1)]
    return f"; did you mean '{near[0]}'?" if near else ""
