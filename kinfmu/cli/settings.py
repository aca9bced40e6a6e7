"""What --set says: parameters of a mechanism, constants of its laws, and what belongs to a run alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from kinfmu.cli.tell import note
from kinfmu.errors import MechanismError, listed, suggestion
from kinfmu.units import Quantity, in_turns, looks_like_degrees

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism

TOLERANCE = "solver.tolerance"
DRIVEN_BY_TIME = "driven_by_time"
RATES = "rates"
_ELSEWHERE = {
    TOLERANCE: "it belongs to a run: solve and simulate take it",
    DRIVEN_BY_TIME: "it belongs to an FMU: simulate takes it, build --drive chooses its default",
    RATES: "it belongs to an FMU: simulate takes it, as auto, estimated or wired",
}


@dataclass(frozen=True)
class Settings:
    """Settings by name, each where it belongs.

    written: the mechanism as the file has it; parameters, constants: as they were set; of_run: what belongs to a run.
    """

    written: Mechanism
    parameters: Mapping[str, float | str]
    constants: Mapping[str, float | str]
    of_run: Mapping[str, float | str | bool]

    def mechanism(self) -> Mechanism:
        """Return the mechanism with its settings, in the pose to which the written one is followed.

        A note on stderr says if that is not possible and it is assembled anew.
        """
        from kinfmu.sweep.continued import continued

        followed = continued(self.written, {**self.parameters, **self.constants})
        if followed.message:
            note(followed.message)
        return followed.mechanism


def settled(
    name: str, mechanism: Mechanism, settings: Sequence[tuple[str, str]], of_run: Sequence[str] = ()
) -> Settings:
    """Settings of the command line, checked; the names of a mechanism are the same for every command.

    name: as which the user knows the mechanism; of_run: names of a run that this command takes, too. Raises a
    click.UsageError for what is not there, cannot be meant, or follows from something else.
    """
    constants = {constant.name: constant for constant in mechanism.law_constants}
    known = [*mechanism.parameters, *constants, *of_run]
    for parameter, text in settings:
        where = f"--set {parameter}={text}"
        driver, _, key = parameter.rpartition(".")
        expression = mechanism.expressions.get(("drivers", driver, "law", key))
        if expression is not None:
            raise click.UsageError(f"{where}: it follows from '{expression.text}'; set what stands there")
        if parameter not in known:
            elsewhere = _ELSEWHERE.get(parameter)
            hint = f"; {elsewhere}" if elsewhere else suggestion(parameter, known)
            raise click.UsageError(f"{where}: {name} has no parameter '{parameter}'{hint}; parameters: {listed(known)}")
        if parameter in constants and constants[parameter].quantity == Quantity("angle"):
            _note_of_degrees(parameter, text)
        if parameter == TOLERANCE:
            value = _value(text)
            if not isinstance(value, float) or not 0.0 < value < math.inf:
                raise click.UsageError(f"{where}: it must be a positive number")
    values = {parameter: _value(text) for parameter, text in settings if parameter not in of_run}
    try:
        mechanism.with_parameters(values)
    except MechanismError as error:
        raise click.UsageError(f"--set: {error}") from None
    return Settings(
        mechanism,
        {parameter: value for parameter, value in values.items() if parameter in mechanism.parameters},
        {parameter: value for parameter, value in values.items() if parameter in constants},
        as_values([(parameter, text) for parameter, text in settings if parameter in of_run]),
    )


def tolerance_of(settings: Settings) -> float:
    """The tolerance of a solve: what --set says, else the usual one."""
    from kinfmu.solver.python.solver import TOLERANCE as USUAL

    return float(settings.of_run.get(TOLERANCE, USUAL))


def as_values(settings: Sequence[tuple[str, str]]) -> dict[str, float | str | bool]:
    """Settings by name: true or false, a number, or text that says a unit."""
    truths = {"true": True, "false": False}
    return {name: truths.get(text.lower(), _value(text)) for name, text in settings}


def _value(text: str) -> float | str:
    """A number, or text that says its unit or its expression."""
    try:
        return float(text)
    except ValueError:
        return text


def _note_of_degrees(name: str, text: str) -> None:
    value = _value(text)
    if isinstance(value, float) and looks_like_degrees(value):
        note(f"{name} = {text} rad, {in_turns(value)}; write {name}={text}deg for degrees")
