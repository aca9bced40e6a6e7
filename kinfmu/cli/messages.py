"""Notes and warnings on stderr, one line each."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from kinfmu.run import Run


def printable(text: str) -> str:
    """Return the text on one line, with control characters escaped: files may contain terminal codes."""
    line = " ".join(text.splitlines())
    return "".join(f"\\x{ord(c):02x}" if unicodedata.category(c) == "Cc" else c for c in line)


def note(text: str) -> None:
    """Print how an input was understood, or which default was chosen."""
    click.echo(f"kinfmu: note: {printable(text)}", err=True)


def warn(text: str) -> None:
    """Print a warning of a probable mistake."""
    click.echo(f"kinfmu: warning: {printable(text)}", err=True)


def print_events(run: Run) -> None:
    """Print the notes and warnings of a run, each once; `fail_if_failed` reports errors."""
    printers = {"info": note, "warning": warn}
    for level, text in dict.fromkeys((event.level, event.text) for event in run.events):
        if level in printers:
            printers[level](text)
