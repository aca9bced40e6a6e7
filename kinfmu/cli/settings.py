"""What --set says: parameters of a mechanism, and constants of its laws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kinfmu import gallery
from kinfmu.cli.group import about
from kinfmu.errors import listed, suggestion

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism


def with_parameters(name: str, settings: tuple[tuple[str, str], ...]) -> Mechanism:
    """The mechanism of this name with parameters as set on the command line."""
    mechanism = gallery.load(name)
    for parameter, text in settings:
        if parameter not in mechanism.parameters:
            known = mechanism.parameters
            law = "; constants of laws are set in solve and simulate" if "." in parameter else ""
            raise click.UsageError(
                f"--set {parameter}={text}: {name} has no parameter '{parameter}'{suggestion(parameter, known)}; "
                f"parameters: {listed(known)}{law}"
            )
    with about(name):
        return mechanism.with_parameters({parameter: _value(text) for parameter, text in settings})


def refuse_what_follows(mechanism: Mechanism, settings: tuple[tuple[str, str], ...]) -> None:
    """Raise a click.UsageError for a law constant that the file gives by an expression: that is to be set."""
    for name, text in settings:
        driver, _, key = name.rpartition(".")
        expression = mechanism.expressions.get(("drivers", driver, "law", key))
        if expression is not None:
            raise click.UsageError(f"--set {name}={text}: it follows from '{expression.text}'; set what stands there")


def as_values(settings: tuple[tuple[str, str], ...]) -> dict[str, float | str | bool]:
    """Settings by name: true or false, a number, or text that says a unit."""
    truths = {"true": True, "false": False}
    return {name: truths.get(text.lower(), _value(text)) for name, text in settings}


def _value(text: str) -> float | str:
    """A number, or text that says its unit or its expression."""
    try:
        return float(text)
    except ValueError:
        return text
