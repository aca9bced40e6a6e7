"""Options of commands that write tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from kinfmu.errors import listed

CSV = ".csv"
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t"}


def table_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --units, --separator and --decimal, which `csv_form` checks."""
    for option in (
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


def csv_form(
    suffix: str, tables: tuple[str, ...], *, units: bool, separator: str | None, decimal: str | None
) -> dict[str, Any]:
    """Return the form of a CSV file, as arguments of `write_table`; raise a UsageError for other files.

    Args:
        suffix: Of the file.
        tables: Suffixes of tables, which may be written with units.
        units: As given.
        separator: As given; None: the default.
        decimal: As given; None: the default.

    """
    given = {"--separator": separator, "--decimal": decimal}
    asked = [f"{option} '{value}'" for option, value in given.items() if value] + ["--units"] * units
    if suffix not in tables and asked:
        valid = tables[0] if len(tables) == 1 else f"tables, {listed(tables)}"
        raise click.UsageError(f"{listed(asked)}: only for {valid}, not {suffix}")
    if suffix != CSV and (separator or decimal):
        raise click.UsageError(f"{listed(asked)}: only for {CSV}, not {suffix}")
    found = {"separator": SEPARATORS[separator or ","], "decimal": decimal or "."}
    if found["separator"] == found["decimal"]:
        raise click.UsageError("--decimal ',' needs another separator than the comma: --separator ';'")
    return {"units": units, **found}
