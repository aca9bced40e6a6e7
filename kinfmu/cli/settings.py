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
            raise click.UsageError(
                f"--set {parameter}={text}: {name} has no parameter '{parameter}'{suggestion(parameter, known)}; "
                f"parameters: {listed(known)}"
            )
    with about(name):
        return mechanism.with_parameters({parameter: _value(text) for parameter, text in settings})


def parted(
    mechanism: Mechanism, settings: tuple[tuple[str, str], ...]
) -> tuple[dict[str, float | str], tuple[tuple[str, str], ...]]:
    """Parameters of a mechanism among the settings, by name, and the other settings as they are."""
    geometry = {name: _value(text) for name, text in settings if name in mechanism.parameters}
    return geometry, tuple(setting for setting in settings if setting[0] not in geometry)


def as_numbers(settings: tuple[tuple[str, str], ...]) -> dict[str, float | bool]:
    """Settings that are taken as they are: numbers, or true and false. Raises a click.UsageError for others."""
    parameters: dict[str, float | bool] = {}
    for name, text in settings:
        if text.lower() in ("true", "false"):
            parameters[name] = text.lower() == "true"
            continue
        try:
            parameters[name] = float(text)
        except ValueError:
            raise click.UsageError(f"--set {name}={text}: '{text}' is not a number") from None
    return parameters


def _value(text: str) -> float | str:
    """A number, or text that says its unit or its expression."""
    try:
        return float(text)
    except ValueError:
        return text
