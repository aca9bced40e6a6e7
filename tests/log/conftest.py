"""Runs as fixtures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from kinfmu.errors import LogError
from kinfmu.log.viewer import headless
from kinfmu.run import Run
from tests.log.runs import KINDS, fourbar, with_gap


@pytest.fixture
def run() -> Run:
    """0 to 180 s in steps of 1 s."""
    return fourbar(np.arange(181.0))


@pytest.fixture
def run_with_gap(run: Run) -> Run:
    return with_gap(run, 100, 120)


@pytest.fixture(params=KINDS, ids=lambda kind: kind.replace(" ", "-"))
def any_run(request: pytest.FixtureRequest) -> Run:
    """Each kind of run in turn."""
    return KINDS[request.param]()


@pytest.fixture(scope="session")
def fmu(fmu_of: Callable[..., Path]) -> Callable[[], Path]:
    """`fmu()`: the four-bar as an FMU driven by time, built when first asked for."""
    return lambda: fmu_of("fourbar")


@pytest.fixture(scope="package")  # an open viewer draws all the time
def viewer() -> Iterator[headless.Viewer]:
    """One invisible viewer for all recordings; skips, with the reason, where no picture can be drawn."""
    with ExitStack() as stack:
        try:
            found = stack.enter_context(headless.viewer((800, 600)))
        except LogError as error:
            if not error.data.get("no_graphics"):
                raise
            pytest.skip(str(error))
        yield found


@pytest.fixture(scope="package")  # an open viewer draws all the time
def graphics(viewer: headless.Viewer) -> None:
    """Skips, with the reason, where no picture can be drawn."""
    assert viewer
