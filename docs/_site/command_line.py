"""The page of the command line, from the commands themselves."""

from __future__ import annotations

import click

from _site.pages import Pages, table
from kinfmu.cli import main


def write(pages: Pages) -> None:
    """Write reference/command-line.md."""
    context = click.Context(main, info_name="kinfmu", **main.context_settings)
    parts = [_section(context, name) for name in main.list_commands(context)]
    text = (
        "# Command line\n\nEvery command with all its options, as `--help` prints them. [Commands](../commands.md) "
        "introduces them in the order of work.\n\n"
    )
    pages.write("reference/command-line.md", text + "\n\n".join(parts) + "\n")


def _section(parent: click.Context, name: str) -> str:
    command = main.commands[name]
    context = click.Context(command, info_name=name, parent=parent)
    records = [record for option in command.get_params(context) if (record := option.get_help_record(context))]
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    parts = [f"## `{name}`", f"    {usage}", _plain(command.help or "")]
    rows = [(f"`{names}`", _plain(text).replace("\n", " ")) for names, text in records if text]
    if rows:
        parts.append(table(("option", "meaning"), rows))
    if command.epilog:
        parts.append(f"    {command.epilog.removeprefix('Example: ')}")
    return "\n\n".join(parts)


def _plain(text: str) -> str:
    """Return a help text as Markdown that shows the same characters."""
    lines = [line.strip() for line in text.strip().replace("\b", "").splitlines()]
    return "\n".join(line.replace("<", r"\<").replace("*", r"\*").replace("[", r"\[") for line in lines)
