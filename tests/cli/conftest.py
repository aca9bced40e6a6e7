"""The command line, called in this process and in a folder of its own."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result
from numpy.typing import NDArray

from kinfmu.cli import main
from kinfmu.mechanism import gallery

Command = Callable[..., Result]


def read_csv(path: Path) -> dict[str, NDArray[np.float64]]:
    with path.open(encoding="utf-8", newline="") as file:
        names, *rows = csv.reader(file)
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))


@pytest.fixture
def program_called() -> click.Command:
    """The program that `command` calls."""
    return main


@pytest.fixture
def command(program_called: click.Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """`command("check", "fourbar")`; an exception that escapes fails the test. The working folder is empty."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Result:
        result = CliRunner().invoke(program_called, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert "Traceback" not in result.output
        return result

    return run


@pytest.fixture
def fails(command: Command) -> Callable[..., str]:
    """`fails("check", path)`: the one line on stderr, with exit status 1."""

    def run(*arguments: object) -> str:
        result = command(*arguments)
        assert result.exit_code == 1
        assert result.stderr.startswith("kinfmu: ")
        assert result.stderr.splitlines() == [result.stderr.rstrip("\n")]
        return result.stderr.removeprefix("kinfmu: ").rstrip("\n")

    return run


@pytest.fixture
def refuses(command: Command) -> Callable[..., str]:
    """`refuses("check")`: the message of wrong usage on stderr, after the hint at --help, with exit status 2."""

    def run(*arguments: object) -> str:
        result = command(*arguments)
        assert result.exit_code == 2
        assert result.stdout == ""
        *_, message = result.stderr.splitlines()
        assert message.startswith("Error: ")
        return message.removeprefix("Error: ")

    return run


@pytest.fixture
def fourbar_file(tmp_path: Path) -> Callable[..., Path]:
    """`fourbar_file(old, new)`: a mechanism file, the four-bar's with one thing changed."""

    def write(old: str = "", new: str = "", name: str = "mine.toml") -> Path:
        text = (gallery.folder() / "fourbar" / "mechanism.toml").read_text(encoding="utf-8")
        assert old in text
        path = tmp_path / name
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
        return path

    return write
