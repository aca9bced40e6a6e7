"""Options of several commands: values of --set, and the form of tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import ArgumentType
from kinfmu.cli.group import errors_of, note
from kinfmu.errors import MechanismError, RequestError, listed
from kinfmu.units import METRES, Quantity, in_turns, looks_like_degrees

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism


TOLERANCE = "solver.tolerance"
DRIVEN_BY_TIME = "driven_by_time"
RATES = "rates"
INTEGRATOR_TOLERANCE = "integrator.tolerance"
_ELSEWHERE = {
    TOLERANCE: "belongs to a run; use solve or simulate",
    DRIVEN_BY_TIME: "belongs to an FMU; use simulate, or set its default with build --drive",
    INTEGRATOR_TOLERANCE: "belongs to a motion under torques; use simulate --drive torque",
    RATES: "belongs to an FMU; use simulate, with auto, estimated or wired",
}


class SettingArgument(ArgumentType):
    """NAME=VALUE."""

    name = "NAME=VALUE"

    def read(self, text: str) -> tuple[str, str]:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise ValueError(f"'{text}' must be NAME=VALUE, such as crank.speed=30rpm")
        return name, value


set_option = click.option(
    "--set",
    "settings",
    type=SettingArgument(),
    multiple=True,
    help="Set a parameter or a law's constant, such as crank=40mm or crank.speed=30rpm. Repeat for several.",
)


@dataclass(frozen=True)
class Settings:
    """Values of --set by name.

    written: the mechanism as in its file; parameters, constants: their new values; of_run: settings of a run.
    """

    written: Mechanism
    parameters: Mapping[str, float | str]
    constants: Mapping[str, float | str]
    of_run: Mapping[str, float | str | bool]

    def mechanism(self) -> Mechanism:
        """Return the mechanism with its settings, in the pose reached from that of the file by continuation.

        A note on stderr reports when this fails and the mechanism is assembled from its start poses.
        """
        from kinfmu.run.continued import continued

        followed = continued(self.written, {**self.parameters, **self.constants})
        if followed.message:
            note(followed.message)
        return followed.mechanism


def checked_settings(mechanism: Mechanism, settings: Sequence[tuple[str, str]], of_run: Sequence[str] = ()) -> Settings:
    """Return the settings of the command line after checking them.

    Args:
        mechanism: The mechanism as in its file.
        settings: Name and text of each --set.
        of_run: Names of settings of a run that this command takes.

    Returns:
        The settings.

    Raises:
        click.UsageError: For an unknown name, an invalid value, or a value that follows from an expression.

    """
    from kinfmu.mechanism.settings import read_tolerance

    settable, known = mechanism.settable, (*mechanism.settable.names, *of_run)
    for setting, text in settings:
        if setting in _ELSEWHERE and setting not in known:
            raise click.UsageError(f"--set: {setting} {_ELSEWHERE[setting]}")
        if _WITH_TOLERANCE.fullmatch(text):
            raise click.UsageError(
                f"--set: {setting}={text}: a tolerance belongs to a certificate; use check --certify"
            )
    values = {setting: _value(text) for setting, text in settings if setting not in of_run}
    for setting, value in values.items():
        constant = settable.constants.get(setting)
        if text := settable.note_on_bare(setting, [value]):
            note(f"--set: {text}")
        elif constant is not None and constant.quantity == Quantity("angle") and isinstance(value, float):
            _note_degrees(setting, value)
    run = as_values([(setting, text) for setting, text in settings if setting in of_run])
    try:
        for setting in values:
            if setting not in known:
                raise settable.unknown(setting, known)
        if TOLERANCE in run:
            read_tolerance(TOLERANCE, run[TOLERANCE])
        mechanism.with_parameters(values)
    except (MechanismError, RequestError) as error:
        raise click.UsageError(f"--set: {error}") from None
    return Settings(
        mechanism,
        {setting: value for setting, value in values.items() if setting in mechanism.parameters},
        {setting: value for setting, value in values.items() if setting in settable.constants},
        run,
    )


_WITH_TOLERANCE = re.compile(r"\s*(.+?)\s*(?:\N{PLUS-MINUS SIGN}|\+/?-)\s*(.+?)\s*")
_NUMBER_AND_UNIT = re.compile(r"([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*(.*)")


def without_tolerances(
    mechanism: Mechanism, settings: Sequence[tuple[str, str]]
) -> tuple[list[tuple[str, str]], dict[str, float]]:
    """Return settings without their tolerances, and these by name [rad or the file's unit of length].

    20mm±0.05mm, 20±0.05mm, 20mm+-0.05 and 20mm±0.25% are one tolerance.
    """
    settable = mechanism.settable
    plain: list[tuple[str, str]] = []
    tolerances: dict[str, float] = {}
    for name, text in settings:
        found = _WITH_TOLERANCE.fullmatch(text)
        if not found:
            plain.append((name, text))
            continue
        value, tolerance = found.groups()
        parts = [_NUMBER_AND_UNIT.fullmatch(part) for part in (value, tolerance)]
        units = [part[2] for part in parts if part]
        if len(units) == 2 and units[1] != "%" and not all(units):  # one unit is that of both
            value, tolerance = (f"{part[1]}{''.join(units)}" for part in parts if part)
        plain.append((name, value))
        try:
            settable.check_name(name)
            if name in settable.constants:
                raise RequestError(f"{name}: a constant of a law has no tolerance; parameters have")
            if tolerance.endswith("%"):
                size = abs(settable.number(name, _value(value))) * settable.number(name, _value(tolerance[:-1])) / 100.0
            else:
                size = settable.number(name, _value(tolerance))
        except RequestError as error:
            raise click.UsageError(f"--set: {name}={text}: {error}") from None
        if not size > 0.0:
            raise click.UsageError(f"--set: {name}={text}: the tolerance must be positive")
        tolerances[name] = size
    return plain, tolerances


def tolerances_of_study(mechanism: Mechanism, path: Path) -> tuple[list[tuple[str, str]], dict[str, float]]:
    """Return the settings and the tolerances of the parameters of a study file, ranges as tolerances."""
    from kinfmu.design.study.definition import KEYS
    from kinfmu.design.study.sampling import Grid, UniformRange, read_variation
    from kinfmu.mechanism.toml_document import document_of, refuse_other_kind, table_of, text_in

    document = document_of(text_in(path, "a study file"), str(path))
    plain: list[tuple[str, str]] = []
    tolerances: dict[str, float] = {}
    with errors_of(str(path)):
        refuse_other_kind(document, "study", KEYS)
        tables = table_of(document, "parameters")
        for name, table in tables.items():
            varied = read_variation(f"[parameters.{name}]", name, table, mechanism)
            if name in mechanism.settable.constants or isinstance(varied, Grid):
                raise RequestError(f"[parameters.{name}]: only tolerances and ranges of parameters have a certificate")
            if isinstance(varied, UniformRange):
                nominal, tolerance = 0.5 * (varied.low + varied.high), 0.5 * (varied.high - varied.low)
            else:
                nominal, tolerance = varied.nominal, varied.tolerance
            plain.append((name, f"{nominal!r}{varied.unit}"))
            tolerances[name] = tolerance
    return plain, tolerances


def tolerance_of(settings: Settings) -> float:
    """Return the tolerance of a solve: the value of --set, or the default."""
    from kinfmu.solver.python.solver import TOLERANCE as USUAL

    return float(settings.of_run.get(TOLERANCE, USUAL))


def as_values(settings: Sequence[tuple[str, str]]) -> dict[str, float | str | bool]:
    """Return settings by name: true or false, a number, or text with a unit."""
    truths = {"true": True, "false": False}
    return {name: truths.get(text.lower(), _value(text)) for name, text in settings}


def _value(text: str) -> float | str:
    """Return a number, or text with a unit or an expression."""
    try:
        return float(text)
    except ValueError:
        return text


def _note_degrees(name: str, value: float) -> None:
    if looks_like_degrees(value):
        note(f"{name} = {value:.12g} rad, {in_turns(value)}; write {name}={value:.12g}deg for degrees")


CSV, XLSX = ".csv", ".xlsx"
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t"}


def table_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --lengths, --units, --separator and --decimal, which `csv_form` checks."""
    for option in (
        click.option(
            "--lengths",
            type=click.Choice(list(METRES)),
            help="Unit of lengths in a table. Default: that of the mechanism.",
        ),
        click.option("--decimal", type=click.Choice([".", ","]), help="Decimal sign of a CSV file; default: a point."),
        click.option(
            "--separator",
            type=click.Choice(list(SEPARATORS)),
            help="Between the columns of a CSV file; default: a comma. Spreadsheets of many countries need "
            "--separator ';' --decimal ','.",
        ),
        click.option(
            "--units",
            is_flag=True,
            help="Write units into the first line of a CSV file: coupler.x [m]. Other tables always hold them.",
        ),
    ):
        command = option(command)
    return command


def has_degrees(suffix: str, options: Mapping[str, Any]) -> bool:
    """Return True if a table has angles in degrees: if --degrees asks for them, and workbooks unless --radians does."""
    return bool(suffix == XLSX if options["degrees"] is None else options["degrees"])


def csv_form(suffix: str, tables: tuple[str, ...], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the form of a CSV file, as arguments of `write_table`; raise a UsageError for other files.

    Args:
        suffix: Of the file.
        tables: Suffixes of tables, which may be written with units.
        options: Of the command, with those of `table_options`.

    """
    units, separator, decimal, lengths = (options[name] for name in ("units", "separator", "decimal", "lengths"))
    of_csv = [f"--{name} '{options[name]}'" for name in ("separator", "decimal") if options[name]]
    asked = of_csv + ["--units"] * units + [f"--lengths {lengths}"] * bool(lengths)
    if suffix not in tables and asked:
        valid = tables[0] if len(tables) == 1 else f"tables, {listed(tables)}"
        raise click.UsageError(f"{listed(asked)}: only for {valid}, not {suffix}")
    if suffix != CSV and of_csv:
        raise click.UsageError(f"{listed(asked)}: only for {CSV}, not {suffix}")
    form = {"separator": SEPARATORS[separator or ","], "decimal": decimal or "."}
    if form["separator"] == form["decimal"]:
        raise click.UsageError("--decimal ',' needs another separator than the comma: --separator ';'")
    return {"units": units, **form}
