"""The command line, called in this process."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from click.testing import CliRunner

from kinfmu.cli import main


@pytest.fixture
def run_cli() -> Callable[..., tuple[int, str, str]]:
    """`run_cli("check", "fourbar")`: exit status, stdout and stderr; an exception that escapes fails the test."""

    def run(*arguments: object) -> tuple[int, str, str]:
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.stdout, result.stderr

    return run
