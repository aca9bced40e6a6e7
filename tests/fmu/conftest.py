"""FMUs of the gallery's mechanisms, built once, and slaves of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from kinfmu.fmu.interface import Drive
from kinfmu.mechanism import Mechanism, toml_file
from tests.fmu.host import Host

GALLERY = Path(__file__).parents[2] / "fmus"
Build = Callable[..., Path]
Start = Callable[..., Host]


def mechanism(name: str) -> Mechanism:
    return toml_file.read(GALLERY / name / "mechanism.toml")


@pytest.fixture(scope="session")
def built(fmu_of: Build) -> Build:
    """`built(name, drive)`: path of the python FMU of a gallery mechanism."""
    return lambda name, drive="time": fmu_of(name, drive=drive)


@pytest.fixture(scope="session")
def built_native(fmu_of: Build) -> Build:
    """`built_native(mechanism, fmi, drive)`: path of a native FMU of a mechanism or a gallery name."""
    return lambda model, fmi, drive="inputs": fmu_of(model, "native", fmi, drive)


@pytest.fixture
def fourbar(built: Callable[..., Path]) -> Path:
    return built("fourbar", "time")


@pytest.fixture
def pendulum(built: Callable[..., Path]) -> Path:
    return built("double_pendulum", "time")


@pytest.fixture
def start(built: Build, opened: Start) -> Start:
    """`start(name, drive)`: a slave, by default initialized at time 0; freed at the end."""

    def get(name: str = "fourbar", drive: Drive = "inputs", *, initialize: bool = True) -> Host:
        host = opened(built(name, drive))
        if initialize:
            host.initialize(0.0)
        return host

    return get
