"""What is told beside results: one line each, on stderr."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from kinfmu.run import Run


def printable(text: str) -> str:
    """Return the text on one line, with control characters as escapes: texts of files may hold codes of terminals."""
    line = " ".join(text.splitlines())
    return "".join(f"\\x{ord(c):02x}" if unicodedata.category(c) == "Cc" else c for c in line)


def note(text: str) -> None:
    """Tell what was understood, or what was chosen where nothing was said."""
    click.echo(f"kinfmu: note: {printable(text)}", err=True)


def warn(text: str) -> None:
    """Tell what is probably not meant."""
    click.echo(f"kinfmu: warning: {printable(text)}", err=True)


def tell_of(run: Run) -> None:
    """Tell notes and warnings of a run, each once; errors are for `fail_if_failed`."""
    tellers = {"info": note, "warning": warn}
    for level, text in dict.fromkeys((event.level, event.text) for event in run.events):
        if level in tellers:
            tellers[level](text)
