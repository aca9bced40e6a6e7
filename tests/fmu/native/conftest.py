"""Native FMUs of the gallery's mechanisms, built once, and instances of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

import pytest

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.mechanism import Mechanism
from tests.fmu.native.host import Host

Build = Callable[..., Path]
Start = Callable[..., Host]


@pytest.fixture(scope="package", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compile libraries without optimization, into a cache of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KINFMU_CACHE", str(tmp_path_factory.mktemp("cache")))
        for module in (compiler, import_module("kinfmu.fmu.native.archive")):
            quick = ["-O0" if flag.startswith("-O") else flag for flag in module.FLAGS]  # the same numbers
            patch.setattr(module, "FLAGS", quick)
        yield


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request: pytest.FixtureRequest) -> int:
    return int(request.param)


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
def start(built_native: Build, fmi: int, tmp_path: Path) -> Iterator[Start]:
    """`start(name, drive)`: an instance, by default initialized at time 0; freed at the end."""
    hosts: list[Host] = []

    def get(
        model: str | Mechanism = "fourbar",
        drive: str = "inputs",
        *,
        initialize: bool = True,
        model_exchange: bool = False,
    ) -> Host:
        path = built_native(model, fmi, drive)
        host = Host(path, tmp_path / path.stem, model_exchange=model_exchange)
        hosts.append(host)
        if initialize:
            host.initialize(0.0)
            if model_exchange:
                host.fmu.enterContinuousTimeMode()
        return host

    yield get
    for host in hosts:
        host.free()
