"""A shared library from generated C: compiled once by the system's compiler (or zig's), then taken from the cache.

A library is found again by its sources, the flags, the compiler and the processor: see library_cache.py. So are the
objects of the run time, for mechanisms of the same sizes.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import re
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from kinfmu.codegen.c import library_cache
from kinfmu.errors import CompilerError
from kinfmu.files import temporary_folder

RUNTIME = Path(__file__).parents[2] / "solver" / "c"
MODEL = ("kinfmu.h", "curve.h", "sincos.h", "position.c", "linear.c", "curve.c")  # what a model needs of the run time
SOLVER = (*MODEL, "solver.h", "internal.h", "pose.c", "span.c", "trusted_step.c", "bridge.c",
          "singularity_map.c", "tracks.c", "limit.c", "advance.c", "solver.c", "continuation.c", "worst_case_step.c",
          "estimate.c")  # fmt: skip
_LEVEL = "-O2"
FLAGS = ("-std=c99", _LEVEL, "-ffp-contract=off", "-fPIC", "-shared")  # no fused multiply-add: Python has none
VECTORIZED = (  # for loops over samples; results are equal
    "-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math",
    "-fno-tree-slp-vectorize",  # of statements outside of loops: GCC 12 fuses some of them in spite of FLAGS
)  # fmt: skip

_ZIG = (sys.executable, "-m", "ziglang", "cc")


def sources(names: Sequence[str]) -> dict[str, str]:
    """Return the texts of files of the run time, by name."""
    return {name: (RUNTIME / name).read_text("utf-8") for name in names}


def runtime() -> dict[str, str]:
    """Return the texts of all files of the run time, by name."""
    return sources(sorted(path.name for path in RUNTIME.iterdir() if path.suffix in (".c", ".h")))


def units(files: Mapping[str, str]) -> list[str]:
    """Return the names of the C files to compile, in order: all but headers and files that another one includes."""
    included = {name for text in files.values() for name in _included(text)}
    return sorted(name for name in files if name.endswith(".c") and name not in included)


def joined(names: Sequence[str]) -> str:
    """Return a C file that includes others, which is compiled faster than these one by one."""
    return "".join(f'#include "{name}"\n' for name in names)


def shared_library(
    files: Mapping[str, str], flags: Sequence[str] = (), target: str | None = None, rare: Sequence[str] = ()
) -> Path:
    """Return a shared library of C files (and the headers that they include), by name; compile it if it is not cached.

    A terminal shows a line while the compiler runs.

    It returns the path in the cache.

    Raise a CompilerError if there is no compiler, it fails, or the cache cannot be used.

    flags: Flags of the compiler, after FLAGS. target: A platform as zig names it, such as x86_64-windows-gnu, for which
    zig compiles; default: this platform. rare: Names of C files that run rarely: the compiler optimizes them as in
    FLAGS, which is faster.
    """
    build = _Build(files, flags, target, rare)
    found = library_cache.find(build.key, build.suffix)
    if found is not None:
        return found
    with _shown("kinfmu: compiling C; the result is kept for the next time"):
        return library_cache.store(build.key, build.suffix, build.compile())


def shared_library_bytes(files: Mapping[str, str], flags: Sequence[str] = (), target: str | None = None) -> bytes:
    """Return the content of a library as `shared_library` compiles it, also if the cache cannot be used.

    Raise a CompilerError if there is no compiler, or it fails.
    """
    return _Build(files, flags, target).found_or_compiled()


def load(files: Mapping[str, str], flags: Sequence[str] = (), rare: Sequence[str] = ()) -> ctypes.CDLL:
    """Load a shared library of C files, as `shared_library` compiles it.

    Raises:
        CompilerError: As in `shared_library`, or the system refuses to load it.

    """
    path = shared_library(files, flags, rare=rare)
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise CompilerError(
            f"the compiled library cannot be loaded: {error}; set KINFMU_CACHE to a folder where programs may run"
        ) from None


def is_cached(files: Mapping[str, str], flags: Sequence[str] = (), rare: Sequence[str] = ()) -> bool:
    """Return whether `load` finds the library in the cache, so that nothing is compiled."""
    with suppress(CompilerError, OSError):
        build = _Build(files, flags, None, rare)
        return library_cache.find(build.key, build.suffix) is not None
    return False


@contextmanager
def _shown(line: str) -> Iterator[None]:
    """Show a line while this block runs, if stderr is a terminal."""
    terminal = sys.stderr if sys.stderr is not None and sys.stderr.isatty() else None
    if terminal:
        print(line, end="\r", file=terminal, flush=True)
    try:
        yield
    finally:
        if terminal:
            print(" " * len(line), end="\r", file=terminal, flush=True)


class _Build:
    """Files, compiler and flags of one compilation; key: identifies the result."""

    def __init__(
        self,
        files: Mapping[str, str],
        flags: Sequence[str],
        target: str | None,
        rare: Sequence[str] = (),
    ) -> None:
        self._files = files
        self._rare = rare
        self._compiler = command() if target is None else zig(target)
        self._flags = (*FLAGS, *flags)
        self.key = _key(self._compiler, [*self._flags, *rare], files)
        self.suffix = _suffix(target)

    def found_or_compiled(self) -> bytes:
        """Return the library in the cache, or compile it; also if the cache cannot be used."""
        with suppress(CompilerError, OSError):
            cached = library_cache.find(self.key, self.suffix)
            if cached is not None:
                return cached.read_bytes()
        data = self.compile()
        with suppress(CompilerError):
            library_cache.store(self.key, self.suffix, data)
        return data

    def compile(self) -> bytes:
        """Return the compiled library."""
        try:
            with temporary_folder() as scratch:
                made = scratch / f"{self.key}{self.suffix}"
                compile_files(self._compiler, self._files, self._flags, made, self._rare)
                return made.read_bytes()
        except OSError as error:
            raise CompilerError(f"{self._compiler[0]} cannot compile the generated C: {error}") from None


def compile_files(
    compiler: Sequence[str], files: Mapping[str, str], flags: Sequence[str], output: Path, rare: Sequence[str] = ()
) -> None:
    """Run a compiler on C files; see `shared_library`.

    Raise a CompilerError if it fails; the message has its first error.
    """
    with temporary_folder() as scratch:
        for name, text in files.items():
            (scratch / name).write_text(text, "utf-8", newline="\n")
        names = units(files)
        libraries = [] if os.name == "nt" else ["-lm"]
        if tuple(compiler[: len(_ZIG)]) != _ZIG:  # zig compiles in parallel itself
            names = _objects(compiler, files, flags, rare, scratch)
        _run([[*compiler, *flags, *names, "-o", str(output.resolve()), *libraries]], scratch)


def _objects(
    compiler: Sequence[str], files: Mapping[str, str], flags: Sequence[str], rare: Sequence[str], folder: Path
) -> list[str]:
    """Compile units in a folder that holds the files; return their objects.

    Of a mechanism, the run time reads no more than the sizes: its objects are kept for the next mechanism of the same
    sizes, such as the same one with other lengths.
    """
    objects, keys, commands = [], {}, []
    for name in sorted(units(files), key=lambda name: (-_length(files, name), name)):  # the longest first
        command = [*compiler, *flags, *([_LEVEL] if name in rare else []), "-c", name]
        made = f"{name.removesuffix('.c')}.o"
        if name in rare or (RUNTIME / name).is_file():
            read = _read(files, name)
            key = _key(compiler, command, {one: files[one] for one in sorted(read)})
            with suppress(CompilerError):
                found = library_cache.find(key, ".o")
                if found is not None:
                    objects.append(str(found))
                    continue
            keys[made] = key
        objects.append(made)
        commands.append(command)
    _run(commands, folder)
    for made, key in keys.items():
        with suppress(CompilerError):  # the library is made without a cache too
            library_cache.store(key, ".o", (folder / made).read_bytes())
    return objects


def _key(compiler: Sequence[str], flags: Sequence[str], files: Mapping[str, str]) -> str:
    """Return what identifies the result of a compilation."""
    content = [platform.machine(), _processor(), *_version(tuple(compiler)), *flags]
    content += [part for name in sorted(files) for part in (name, files[name])]
    return hashlib.sha256("\0".join(content).encode()).hexdigest()[:24]


def _length(files: Mapping[str, str], name: str) -> int:
    """Return the length of a C file with the C files that it includes."""
    return sum(len(files[one]) for one in _read(files, name) if one.endswith(".c"))


def _read(files: Mapping[str, str], name: str) -> set[str]:
    """Return a C file and all files that it includes."""
    read, left = set[str](), {name}
    while left:
        one = left.pop()
        read.add(one)
        left |= _included(files[one]) & files.keys() - read
    return read


def _included(text: str) -> set[str]:
    """Return the files that a C file includes."""
    return set(re.findall(r'^ *# *include "([\w.]+)"', text, re.MULTILINE))


def _run(commands: Sequence[Sequence[str]], folder: Path) -> None:
    """Run compilers, as many at once as there are cores; raise a CompilerError with the first error if one fails."""
    import subprocess
    from concurrent.futures import ThreadPoolExecutor

    def run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(  # noqa: S603  a compiler that we looked up, on sources of our own
            command,
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            check=False,
        )

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for command, done in zip(commands, pool.map(run, commands), strict=True):
            if done.returncode != 0:
                pool.shutdown(cancel_futures=True)
                lines = done.stderr.splitlines() or ["it gives no reason"]
                complaint = next((line for line in lines if "error" in line), lines[0])
                raise CompilerError(f"{command[0]} cannot compile the generated C: {complaint}")


@cache
def command() -> tuple[str, ...]:
    """Return the compiler: what CC names, else cc, gcc, clang, or zig's from the extra `native`.

    Raise a CompilerError if none is found.
    """
    wanted = os.environ.get("CC")
    for name in [wanted] if wanted else ["cc", "gcc", "clang"]:
        found = shutil.which(name)
        if found:
            return (found,)
    if find_spec("ziglang") is not None:
        return _ZIG
    reason = f"CC names {wanted!r}, which is not found" if wanted else "cc, gcc and clang are not found"
    raise CompilerError(f"no C compiler: {reason}; pip install 'kinfmu[native]' brings one")


def zig(target: str) -> tuple[str, ...]:
    """Return zig's compiler for a platform.

    Raise a CompilerError if zig is not installed.
    """
    if find_spec("ziglang") is None:
        raise CompilerError("compiling for other platforms needs ziglang; pip install 'kinfmu[native]'")
    return (*_ZIG, "-target", target)


def _suffix(target: str | None) -> str:
    """Return the suffix of shared libraries on a platform, as zig names it; default: this platform."""
    system = target or {"win32": "windows", "darwin": "macos"}.get(sys.platform, "")
    return ".dll" if "windows" in system else ".dylib" if "macos" in system else ".so"


@cache
def _version(compiler: tuple[str, ...]) -> tuple[str, ...]:
    """Return the command of a compiler and the version that it states."""
    import subprocess

    with temporary_folder() as scratch:  # for some platforms zig leaves a file behind
        done = subprocess.run(  # noqa: S603  a compiler that we looked up
            [*compiler, "--version"], cwd=scratch, capture_output=True, text=True, check=False
        )
    return (*compiler, done.stdout)


@cache
def _processor() -> str:
    """Return what -march=native compiles for: the processor's features where the system lists them."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith(("flags", "Features"))), platform.processor())
