"""For every folder: golden files with `--update`, how hypothesis draws, which tests run, and what compiles C."""

from __future__ import annotations

import gc
import signal
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.fmu.native import archive
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_text import text
from kinfmu.run import native_engine as library
from tests import compiled_once

if TYPE_CHECKING:
    from tests.fmu.host import Host
    from tests.page.engines import Browser

GOLDEN = Path(__file__).parent / "golden"

FLAGS = ((compiler, "FLAGS"), (compiler, "VECTORIZED"), (archive, "FLAGS"), (library, "FLAGS"))
MEASURED = "kinfmu/seconds"  # in the cache of pytest: how long runs took, by their arguments
MOST_MEASURED = 20  # runs
USUAL_TIME = "the tests take about 5 min on two cores, 20 with --long; the first run compiles more"
STARTED = pytest.StashKey[float]()
SHIPPED_FLAGS = {place: getattr(*place) for place in FLAGS}

# Few examples, the same every time; .ci/run draws more: --hypothesis-profile=long.
settings.register_profile("kinfmu", deadline=None, derandomize=True, database=None, max_examples=6)
settings.register_profile("long", settings.get_profile("kinfmu"), max_examples=60)
settings.load_profile("kinfmu")


@pytest.fixture(scope="session", autouse=True)
def python_fmus() -> Iterator[None]:
    """FMUs are of the python flavour and have no page if a test asks for neither: both take long."""
    module, command = import_module("kinfmu.fmu.build"), import_module("kinfmu.cli.build")
    page = command._page

    def default_flavour(fmi: int = 2, platforms: str = "host") -> str:
        return "python" if (fmi, platforms) == (2, "host") else "native"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "default_flavour", default_flavour)
        patch.setattr(command, "_page", lambda mechanism, wanted: page(mechanism, wanted) if wanted else "")
        yield


@pytest.fixture(scope="session", autouse=True)
def signals_of_a_terminal() -> None:
    """Ctrl-C and a closed terminal end the programs of tests, also where nohup or a shell had them ignored."""
    for name in ("SIGINT", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number is not None and signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if name == "SIGINT" else signal.SIG_DFL)


@pytest.fixture(scope="session", autouse=True)
def quickly_compiled(request: pytest.FixtureRequest) -> Iterator[None]:
    """C is compiled as `compiled_once` says, once for all workers and runs: `--cache-clear` compiles all anew."""
    folder = compiled_once.folder(request.config.cache.mkdir("compiled"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KINFMU_CACHE", str(folder))
        patch.setattr(compiler, "compile_files", compiled_once.compile_files)
        for (module, name), flags in SHIPPED_FLAGS.items():
            quick = ["-O0" if flag.startswith("-O") else flag for flag in flags if flag != "-march=native"]
            patch.setattr(module, name, tuple(quick))
        yield


@pytest.fixture
def optimized(monkeypatch: pytest.MonkeyPatch) -> None:
    """C is compiled with the flags of the package and file by file, as for a user."""
    monkeypatch.setattr(compiler, "compile_files", compiled_once.FILE_BY_FILE)
    for (module, name), flags in SHIPPED_FLAGS.items():
        monkeypatch.setattr(module, name, flags)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update", action="store_true", help="rewrite the golden files, so that a change is read as a diff"
    )
    parser.addoption(
        "--long", action="store_true", help="also the tests marked `long`, which the default run leaves out"
    )
    parser.addoption(
        "--grids", type=int, metavar="N", help="so many random grids of tests that take fewer, and these in full"
    )


def pytest_configure() -> None:
    gc.disable()  # until all is imported, and never for that: a tenth of the time


def pytest_report_header(config: pytest.Config) -> str:
    """Return how long the run takes, as measured the last time that it had these arguments."""
    seconds = config.cache.get(MEASURED, {}).get(" ".join(config.invocation_params.args))
    return f"takes about {seconds / 60:.1f} min, as the last time" if seconds else USUAL_TIME


def pytest_sessionstart(session: pytest.Session) -> None:
    session.config.stash[STARTED] = time.monotonic()


def pytest_sessionfinish(session: pytest.Session) -> None:
    config = session.config
    if session.testscollected and not hasattr(config, "workerinput"):
        seconds = {" ".join(config.invocation_params.args): time.monotonic() - config.stash[STARTED]}
        config.cache.set(MEASURED, dict(list({**config.cache.get(MEASURED, {}), **seconds}.items())[-MOST_MEASURED:]))


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what is long, and all but a few sets of parameters of tests that are marked so.

    All of them run with --long, with -m, or if a test is named.
    """
    if config.getoption("--long") or config.option.markexpr or any("::" in argument for argument in config.args):
        return
    sets = defaultdict(list)
    for item in items:
        if not item.get_closest_marker("long"):
            sets[item.nodeid.partition("[")[0]].append(item)
    chosen = {item for group in sets.values() for item in _few(group)}
    config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
    items[:] = [item for item in items if item in chosen]


def _few(items: list[pytest.Item]) -> Iterable[pytest.Item]:
    """Return the sets of parameters of one test that run by default: each with as many new values as possible."""
    marker = items[0].get_closest_marker("few")
    if marker is None:
        return items
    chosen: list[pytest.Item] = []
    seen: set[tuple[str, int]] = set()
    while len(chosen) < min(marker.args[0], len(items)):
        rest = [item for item in items if item not in chosen]
        best = max(rest, key=lambda item: len(item.callspec.indices.items() - seen))
        chosen.append(best)
        seen |= best.callspec.indices.items()
    return chosen


@pytest.fixture(scope="session")
def fmu_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """`fmu_of(mechanism, flavour, fmi, drive)`: path of an FMU, built once; of the gallery a name is enough."""
    folder = tmp_path_factory.mktemp("fmus")
    paths: dict[tuple[str, str, int, str], Path] = {}

    def get(model: str | Mechanism, flavour: str = "python", fmi: int = 2, drive: str = "time") -> Path:
        mechanism = kinfmu.load(model) if isinstance(model, str) else model
        key = (text(mechanism), flavour, fmi, drive)
        if key not in paths:
            path = folder / f"{len(paths)}" / f"{mechanism.name}.fmu"
            paths[key] = kinfmu.build(mechanism, path, flavour=flavour, fmi=fmi, drive=drive)  # type: ignore[arg-type]
        return paths[key]

    return get


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Callable[..., Host]]:
    """`opened(path, **options)`: an instance of an FMU; freed at the end."""
    from tests.fmu.host import Host  # here: fmpy takes long to import

    hosts: list[Host] = []

    def get(path: Path, **options: Any) -> Host:
        hosts.append(Host(path, tmp_path / f"instance_{len(hosts)}", **options))
        return hosts[-1]

    yield get
    for host in hosts:
        host.free()


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser for pages, of one file: as long as it runs, nothing else can run an event loop."""
    from tests.page.engines import browser  # here, since few tests need it

    with browser(tmp_path_factory.mktemp("pages")) as opened:
        yield opened


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """`golden(name, text)`: text must equal tests/golden/<name>; with --update it is written there instead."""

    def compare(name: str, text: str) -> None:
        path = GOLDEN / name
        if request.config.getoption("--update"):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
        assert path.is_file(), f"there is no {path.name} in tests/golden; pytest --update writes it"
        expected = path.read_text(encoding="utf-8")
        assert text == expected, f"differs from tests/golden/{name}; if the change is intended: pytest --update"

    return compare
