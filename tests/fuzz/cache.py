"""The cache of compiled libraries: damaged files, strange files, processes that build at once and are killed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from kinfmu.codegen.c import compiler
from tests.fuzz.summary import Summary, seeds

PATIENCE = 120.0  # [s] for a process that loads
_FILES = {"a.c": "int f(void);\nint f(void) { return 7; }\n"}
_OTHER = {"a.c": "int f(void);\nint f(void) { return 8; }\n"}
_LOAD = f"""
import os, sys
from kinfmu.codegen.c import compiler
for os.environ["KINFMU_CACHE"] in sys.argv[1:] or [os.environ["KINFMU_CACHE"]]:
    print(compiler.load({_FILES!r}).f())
"""
KINDS = (
    "cut short",
    "changed",
    "noise",
    "another library",
    "a link",
    "a pipe",
    "others may write",
    "an open folder",
)


def run(seed: int, seconds: float) -> Summary:
    """Damage the cache by chance, then load from it in a process of its own, or in several, of which one is killed.

    If there is time at all, one process loads from caches of every kind of damage before.
    """
    summary = Summary("cache")
    if seconds > 0:
        with tempfile.TemporaryDirectory(prefix="kinfmu_fuzz_") as folder:
            _every_kind(seed, Path(folder), summary)
    for one in seeds(seed, seconds):
        with tempfile.TemporaryDirectory(prefix="kinfmu_fuzz_") as folder:
            _trial(one, Path(folder) / "cache", summary)
    return summary


def _every_kind(seed: int, folder: Path, summary: Summary) -> None:
    rng = random.Random(seed)  # noqa: S311  damage by chance
    places = {kind: folder / kind.replace(" ", "_") for kind in KINDS}
    for kind, place in places.items():
        with _cache_at(place):
            _damaged(compiler.shared_library(_FILES), rng, kind)
        summary.count(kind)
    command = [sys.executable, "-c", _LOAD, *map(str, places.values())]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    if (done.returncode, done.stdout, done.stderr) != (0, "7\n" * len(places), ""):
        last = (done.stderr.splitlines() or [repr(done.stdout)])[-1]
        summary.find(seed, "every kind", f"loading ended with status {done.returncode}: {last}"[:300])
    for kind, place in places.items():
        _check_mode(seed, kind, place, summary)


@contextmanager
def _cache_at(folder: Path) -> Iterator[None]:
    """Let this process use the cache in a folder."""
    os.environ["KINFMU_CACHE"], before = str(folder), os.environ.get("KINFMU_CACHE")
    try:
        yield
    finally:
        os.environ.pop("KINFMU_CACHE")
        if before is not None:
            os.environ["KINFMU_CACHE"] = before


def _check_mode(seed: int, kind: str, folder: Path, summary: Summary) -> None:
    if folder.stat().st_mode & 0o777 != 0o700:
        summary.find(seed, kind, f"the folder has mode {folder.stat().st_mode & 0o777:o}")


def _trial(seed: int, folder: Path, summary: Summary) -> None:
    rng = random.Random(seed)  # noqa: S311  damage by chance
    environment = {**os.environ, "KINFMU_CACHE": str(folder)}
    done = []
    with _cache_at(folder):
        if rng.random() < 0.8:
            library = compiler.shared_library(_FILES)
            done = [_damaged(library, rng, rng.choice(KINDS)) for _ in range(rng.choice((1, 1, 2)))]
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", _LOAD], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(rng.choice((1, 1, 3)))
    ]
    killed = len(processes) > 1
    if killed:
        try:
            processes[0].wait(rng.uniform(0.1, 1.5))
        except subprocess.TimeoutExpired:
            processes[0].send_signal(signal.SIGKILL)
    kind = ", then ".join(done) or "empty"
    summary.count(("with a process killed: " if killed else "") + kind)
    for k, process in enumerate(processes):
        try:
            out, errors = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            summary.find(seed, kind, f"loading does not end in {PATIENCE:g} s")
            continue
        if (k > 0 or not killed) and (process.returncode, out, errors) != (0, "7\n", ""):
            last = (errors.splitlines() or [out])[-1]
            summary.find(seed, kind, f"loading ended with status {process.returncode}: {last}"[:300])
    _check_mode(seed, kind, folder, summary)


def _damaged(library: Path, rng: random.Random, kind: str) -> str:
    """Damage a library, or where it lies; return how."""
    if library.is_symlink() or not library.is_file():  # damaged before
        library.unlink()
        library.write_bytes(b"nothing")
    whole = library.read_bytes()
    if kind == "cut short":
        os.truncate(library, rng.randrange(len(whole) + 1))
    elif kind == "changed":
        changed = bytearray(whole or b"?")
        for _ in range(rng.choice((1, 10, 1000))):
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
        library.write_bytes(changed)
    elif kind == "noise":
        library.write_bytes(rng.randbytes(rng.choice((0, 1, 100, 20000))))
    elif kind == "others may write":
        library.chmod(0o777)
    elif kind == "an open folder":
        library.parent.chmod(0o777)
    else:
        library.unlink()
        if kind == "a pipe":
            os.mkfifo(library)
        elif kind == "a link":
            library.symlink_to(compiler.shared_library(_OTHER))
        else:
            library.write_bytes(compiler.shared_library(_OTHER).read_bytes())
    return kind
