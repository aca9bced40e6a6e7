"""The command line of the benchmarks, called as that of kinfmu is."""

from __future__ import annotations

import click
import pytest

from benchmarks.__main__ import main
from tests.cli.conftest import Command, command, fails, refuses

__all__ = ["Command", "command", "fails", "refuses"]


@pytest.fixture
def program_called() -> click.Command:
    """The program that `command` calls."""
    return main
