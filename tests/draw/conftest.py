"""The command line, called in this process; the gallery's figures, each drawn once; runs of the four-bar."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from kinfmu.draw import figure
from kinfmu.mechanism import gallery
from kinfmu.run import Run
from tests.log.runs import fourbar, with_gap


@pytest.fixture
def run_cli() -> Callable[..., tuple[int, str, str]]:
    """`run_cli("check", "fourbar")`: exit status, stdout and stderr; an exception that escapes fails the test."""

    def run(*arguments: object) -> tuple[int, str, str]:
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.stdout, result.stderr

    return run


@pytest.fixture(scope="session")
def gallery_figure(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """`gallery_figure("fourbar")`: a fresh SVG of a mechanism of the gallery."""
    folder = tmp_path_factory.mktemp("figures")

    @cache
    def draw(name: str) -> Path:
        path = folder / f"{name}.svg"
        figure(gallery.load(name), path)
        return path

    return draw


@pytest.fixture
def run() -> Run:
    """0 to 180 s in steps of 1 s."""
    return fourbar(np.arange(181.0))


@pytest.fixture
def run_with_gap(run: Run) -> Run:
    return with_gap(run, 100, 120)
