"""The cache of compiled libraries: private, checked before it is loaded, whole after every interruption."""

from __future__ import annotations

import ctypes
import io
import os
import shutil
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.codegen.c import compiler, library_cache
from kinfmu.errors import CompilerError
from kinfmu.mechanism import gallery
from kinfmu.plan import compile_plan
from kinfmu.run.native_engine import Library

SEVEN = {"a.c": "int f(void);\nint f(void) { return 7; }\n"}
EIGHT = {"a.c": "int f(void);\nint f(void) { return 8; }\n"}
pytestmark = pytest.mark.usefixtures("optimized")  # the flags of other processes, with which the cache is shared

LOAD = f"from kinfmu.codegen.c import compiler; print(compiler.load({SEVEN!r}).f())"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of an empty cache."""
    try:
        compiler.command()
    except CompilerError as error:
        pytest.skip(str(error))
    folder = tmp_path / "cache"
    monkeypatch.setenv("KINFMU_CACHE", str(folder))
    return folder


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_the_folder_is_private_whatever_the_umask(cache: Path) -> None:
    before = os.umask(0)
    try:
        library = compiler.shared_library(SEVEN)
    finally:
        os.umask(before)
    assert mode(cache) == 0o700
    assert mode(library) & 0o077 == 0
    assert [path.name for path in cache.iterdir()] == [library.name]


@pytest.mark.parametrize("given", [0o777, 0o775, 0o755])
def test_a_folder_that_others_may_enter_is_closed_to_them(cache: Path, given: int) -> None:
    cache.mkdir()
    cache.chmod(given)
    compiler.shared_library(SEVEN)
    assert mode(cache) == 0o700


def sum_of(length: int) -> dict[str, str]:
    """Files of a library: a unit of the run time that reads sizes alone, and the unit of a model."""
    return {
        "sizes.h": "#define SIZE 3\n",
        "sums.h": '#include "sizes.h"\ndouble sum(const double *values);\n',
        "rare.c": '#include "sums.h"\ndouble sum(const double *v) { return v[0] + v[1] + v[SIZE - 1]; }\n',
        "model.c": f'#include "sums.h"\ndouble f(void) {{ double v[] = {{1, 2, {length}}}; return sum(v); }}\n',
    }


def called(files: dict[str, str]) -> float:
    function = compiler.load(files, rare=["rare.c"]).f
    function.restype = ctypes.c_double
    return float(function())


@pytest.fixture
def compiled(cache: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the units as they are compiled, in an empty cache."""
    assert not cache.exists()
    units: list[str] = []
    run = compiler._run

    def noted(commands: Sequence[Sequence[str]], folder: str) -> None:
        units.extend(command[-1] for command in commands if "-c" in command)
        run(commands, folder)

    monkeypatch.setattr(compiler, "_run", noted)
    return units


def test_the_run_time_is_compiled_once_for_mechanisms_of_the_same_sizes(compiled: list[str]) -> None:
    assert [called(sum_of(4)), called(sum_of(5))] == [7.0, 8.0]
    assert sorted(compiled) == ["model.c", "model.c", "rare.c"]
    wider = {**sum_of(4), "sizes.h": "#define SIZE 2\n"}
    assert called(wider) == 5.0  # 1 + 2 + 2
    assert compiled[3:].count("rare.c") == 1


def test_an_object_that_was_changed_on_disk_is_compiled_again(cache: Path, compiled: list[str]) -> None:
    called(sum_of(4))
    for kept in cache.glob("*.o"):
        flipped(kept)
    assert called(sum_of(6)) == 9.0
    assert compiled.count("rare.c") == 2


@pytest.mark.long
def test_a_mechanism_with_other_lengths_gets_the_library_it_gets_without_a_cache(
    compiled: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    written = (gallery.folder() / "crank_rocker" / "mechanism.toml").read_text("utf-8")
    longer = tmp_path / "longer.toml"
    longer.write_text(written.replace('"crank_rocker"', '"longer"').replace("[100, 0]", "[101, 0]"), "utf-8")
    plan, other = compile_plan(kinfmu.load("crank_rocker")), compile_plan(kinfmu.load(longer))
    assert other.size != plan.size
    assert other.mechanism.name != plan.mechanism.name
    Library(plan)
    first = len(compiled)
    Library(other)
    again = compiled[first:]
    assert {"model.c", "lanes.c"} <= set(again)
    assert not {name for name in again if (compiler.RUNTIME / name).is_file()}
    assert not {"diagnosis.c", "singular_points.c"} & set(again)
    linked = [path.read_bytes() for path in library_cache.cache_folder().glob("*.so")]
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path / "another"))
    Library(compile_plan(kinfmu.load(longer)))
    (whole,) = library_cache.cache_folder().glob("*.so")
    assert whole.read_bytes() in linked


def truncated(library: Path) -> None:
    os.truncate(library, library.stat().st_size // 3)


def empty(library: Path) -> None:
    os.truncate(library, 0)


def text(library: Path) -> None:
    library.write_text("not a library\n", "utf-8")


def flipped(library: Path) -> None:
    data = bytearray(library.read_bytes())
    data[len(data) // 2] ^= 0x10
    library.write_bytes(data)


def another(library: Path) -> None:
    shutil.copyfile(compiler.shared_library(EIGHT), library)


def huge(library: Path) -> None:
    os.truncate(library, 1 << 40)


def writable(library: Path) -> None:
    library.chmod(0o666)


def link(library: Path) -> None:
    other = compiler.shared_library(EIGHT)
    library.unlink()
    library.symlink_to(other)


def pipe(library: Path) -> None:
    library.unlink()
    os.mkfifo(library)


@pytest.mark.skipif(os.name == "nt", reason="POSIX files")
@pytest.mark.parametrize("damage", [truncated, empty, text, flipped, another, huge, writable, link, pipe])
@pytest.mark.usefixtures("cache")
@pytest.mark.few(3)
def test_a_damaged_library_is_compiled_again(damage: Callable[[Path], None]) -> None:
    library = compiler.shared_library(SEVEN)
    damage(library)
    assert compiler.load(SEVEN).f() == 7
    assert mode(library) & 0o077 == 0


def test_a_truncated_library_does_not_end_the_process(cache: Path) -> None:
    truncated(compiler.shared_library(SEVEN))
    done = subprocess.run([sys.executable, "-c", LOAD], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "7\n", "")
    assert len(list(cache.iterdir())) == 1


@pytest.mark.usefixtures("cache")
def test_a_native_fmu_is_never_built_of_a_damaged_library() -> None:
    whole = compiler.shared_library_bytes(SEVEN)
    truncated(compiler.shared_library(SEVEN))
    assert compiler.shared_library_bytes(SEVEN) == whole


def unusable(cache: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A cache below a file: not even root can write there."""
    cache.write_text("", "utf-8")
    monkeypatch.setenv("KINFMU_CACHE", str(cache / "below"))
    return (
        f"compiled libraries cannot be kept in '{cache / 'below'}': Not a directory; set KINFMU_CACHE to a folder that"
    )


def test_without_a_place_to_write_one_line_names_it(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    message = unusable(cache, monkeypatch)
    with pytest.raises(CompilerError) as error:
        compiler.shared_library(SEVEN)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "kinfmu",
            "solve",
            "crank_rocker",
            "-o",
            str(cache.parent / "a.csv"),
            "--engine",
            "native",
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_without_a_place_to_write_auto_takes_the_python_engine(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unusable(cache, monkeypatch)
    monkeypatch.setattr(import_module("kinfmu.run.model"), "WORTH_COMPILING", 10)
    run = kinfmu.solve(kinfmu.load("crank_rocker"), np.linspace(0.0, 1.0, 20), engine="auto")
    assert run.info["engine"] == "python"
    assert (run.status == 0).all()


def test_without_a_place_to_write_libraries_go_into_fmus_all_the_same(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unusable(cache, monkeypatch)
    assert len(compiler.shared_library_bytes(SEVEN)) > 1000


def test_a_full_disk_leaves_nothing_behind(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(library_cache.os, "fsync", full)
        with pytest.raises(CompilerError, match="No space left on device"):
            compiler.shared_library(SEVEN)
    assert list(cache.iterdir()) == []
    assert compiler.shared_library(SEVEN).exists()


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="POSIX users")
@pytest.mark.usefixtures("cache")
def test_a_folder_of_another_user_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    library = compiler.shared_library(SEVEN)
    user = os.geteuid()
    monkeypatch.setattr(library_cache.os, "geteuid", lambda: user + 1)
    with pytest.raises(
        CompilerError, match=rf"belongs to user {user}, this process to user {user + 1}; set KINFMU_CACHE"
    ):
        compiler.shared_library(SEVEN)
    assert library.exists()


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="POSIX users")
def test_a_folder_that_stays_open_to_others_is_refused(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a file system that keeps no permissions."""
    library = compiler.shared_library(SEVEN)
    cache.chmod(0o777)
    monkeypatch.setattr(type(cache), "chmod", lambda *_: None)
    with pytest.raises(CompilerError, match=rf"from '{cache}': others can write in it; set KINFMU_CACHE to a folder"):
        compiler.shared_library(SEVEN)
    assert library.exists()


@pytest.mark.usefixtures("cache")
def test_a_library_that_the_system_does_not_load_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(path: str) -> ctypes.CDLL:
        raise OSError(f"{path}: failed to map segment from shared object")

    monkeypatch.setattr(compiler.ctypes, "CDLL", refused)
    with pytest.raises(CompilerError, match=r"cannot be loaded: .*failed to map segment.*; set KINFMU_CACHE"):
        compiler.load(SEVEN)


def test_a_relative_folder_is_not_looked_up_among_the_system_s_libraries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("KINFMU_CACHE", ".")
    assert compiler.shared_library(SEVEN).parent == tmp_path


def test_without_a_home_folder_one_line_reports_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("KINFMU_CACHE", raising=False)
    monkeypatch.setattr(library_cache.Path, "home", homeless)
    with pytest.raises(CompilerError, match="no home folder for compiled libraries; set KINFMU_CACHE"):
        library_cache.cache_folder()


def test_processes_that_build_at_once_all_get_a_whole_library(cache: Path) -> None:
    running = [
        subprocess.Popen([sys.executable, "-c", LOAD], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    answers = [process.communicate(timeout=60) for process in running]
    assert answers == [("7\n", "")] * 3
    assert len(list(cache.iterdir())) == 1


def test_a_process_killed_while_it_writes_leaves_no_library(cache: Path) -> None:
    dying = (
        "import os; from kinfmu.codegen.c import compiler, library_cache;"
        f"library_cache.os.fsync = lambda _: os.kill(os.getpid(), 9); compiler.shared_library({SEVEN!r})"
    )
    done = subprocess.run([sys.executable, "-c", dying], capture_output=True)
    assert done.returncode == -9
    (part,) = cache.iterdir()
    assert part.suffix == ".part"
    assert compiler.shared_library(SEVEN).exists()
    assert part.exists()  # it may be another process's that is still writing
    os.utime(part, (time.time() - 2 * library_cache.STALE,) * 2)
    compiler.shared_library(EIGHT)
    assert not part.exists()


@pytest.mark.usefixtures("cache")
def test_libraries_that_were_not_used_for_a_day_are_removed_for_new_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    old, used = compiler.shared_library(SEVEN), compiler.shared_library(EIGHT)
    for path in (old, used):
        os.utime(path, (time.time() - 2 * library_cache.UNUSED,) * 2)
    assert compiler.shared_library(EIGHT) == used
    library_cache._remove_unused.cache_clear()
    library_cache.store("small", ".so", b"")
    assert old.exists()  # there is room for all
    monkeypatch.setattr(library_cache, "MOST_KEPT", 1)
    library_cache._remove_unused.cache_clear()
    library_cache.store("next", ".so", b"")
    assert not old.exists()
    assert used.exists()


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.usefixtures("cache")
def test_a_terminal_shows_a_line_while_the_compiler_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    for files, stream, shown in (
        (SEVEN, io.StringIO(), ""),
        (EIGHT, Terminal(), "kinfmu: compiling C; the result is kept for the next time"),
        (EIGHT, Terminal(), ""),  # it is in the cache now
    ):
        monkeypatch.setattr("sys.stderr", stream)
        compiler.shared_library(files)
        line, _, blank = stream.getvalue().partition("\r")
        assert (line, blank.strip()) == (shown, "")
