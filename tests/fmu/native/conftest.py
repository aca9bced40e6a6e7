"""Instances of native FMUs, of both versions of FMI."""

from __future__ import annotations

import pytest

from kinfmu.mechanism import Mechanism
from tests.fmu.conftest import Build, Start
from tests.fmu.host import Host


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture
def start(built_native: Build, fmi: int, opened: Start) -> Start:
    """`start(name, drive)`: an instance, by default initialized at time 0; freed at the end."""

    def get(
        model: str | Mechanism = "fourbar",
        drive: str = "inputs",
        *,
        initialize: bool = True,
        model_exchange: bool = False,
    ) -> Host:
        host = opened(built_native(model, fmi, drive), model_exchange=model_exchange)
        if initialize:
            host.initialize(0.0)
            if model_exchange:
                host.fmu.enterContinuousTimeMode()
        return host

    return get
