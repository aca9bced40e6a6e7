"""FMUs of the gallery's mechanisms, built once, and slaves of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import kinfmu
from kinfmu.fmu import build
from kinfmu.fmu.interface import Drive
from kinfmu.mechanism import Mechanism, toml_file
from tests.fmu.host import Host

GALLERY = Path(__file__).parents[2] / "fmus"
Build = Callable[..., Path]
Start = Callable[..., Host]


def mechanism(name: str) -> Mechanism:
    return toml_file.read(GALLERY / name / "mechanism.toml")


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Drive], Path]:
    """`built(name, drive)`: path of the FMU of a gallery mechanism."""
    folder = tmp_path_factory.mktemp("fmus")
    paths: dict[tuple[str, str], Path] = {}

    def get(name: str, drive: Drive = "time") -> Path:
        if (name, drive) not in paths:
            paths[name, drive] = build(mechanism(name), folder / f"{name}_{drive}.fmu", drive=drive)
        return paths[name, drive]

    return get


@pytest.fixture(scope="session")
def built_native(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """`built_native(mechanism, fmi, drive)`: path of a native FMU of a mechanism or a gallery name."""
    folder = tmp_path_factory.mktemp("native")
    paths: dict[tuple[str, int, str], Path] = {}

    def get(model: str | Mechanism, fmi: int, drive: str = "inputs") -> Path:
        mechanism = kinfmu.load(model) if isinstance(model, str) else model
        key = (mechanism.name, fmi, drive)
        if key not in paths:
            path = folder / f"{mechanism.name}_{fmi}_{drive}.fmu"
            paths[key] = kinfmu.build(mechanism, path, flavour="native", fmi=fmi, drive=drive)  # type: ignore[arg-type]
        return paths[key]

    return get


@pytest.fixture
def fourbar(built: Callable[..., Path]) -> Path:
    return built("fourbar", "time")


@pytest.fixture
def pendulum(built: Callable[..., Path]) -> Path:
    return built("double_pendulum", "time")


@pytest.fixture
def start(built: Callable[..., Path], tmp_path: Path) -> Iterator[Callable[..., Host]]:
    """`start(name, drive)`: a slave, by default initialized at time 0; freed at the end."""
    hosts: list[Host] = []

    def get(name: str = "fourbar", drive: Drive = "inputs", *, initialize: bool = True) -> Host:
        host = Host(built(name, drive), tmp_path / f"slave_{len(hosts)}")
        hosts.append(host)
        if initialize:
            host.initialize(0.0)
        return host

    yield get
    for host in hosts:
        host.free()
