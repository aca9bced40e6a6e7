"""Trials in a process of their own: bounded memory and time, with a watch on what they run and where they write."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import resource
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Hashable
from multiprocessing.connection import Connection
from pathlib import Path

from tests.fuzz.hostile_text import CANARY
from tests.fuzz.summary import Finding, Summary, seeds

MEMORY = 2 * 2**30  # [bytes] that a process of trials may write to
PATIENCE = 20.0  # [s] for one trial
STARTING = 60.0  # [s] for a process to import what it needs

_STARTED = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "pty.spawn")
_CHANGED = ("os.mkdir", "os.remove", "os.rename", "os.rmdir", "os.symlink", "os.link", "os.truncate", "shutil.rmtree")
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND

COMPILERS = ("cc", "gcc", "clang", "uname")  # which builds start, with no text of the input on their command line

Trial = Callable[[int, Summary], None]  # does the trial of a seed, counts it and keeps what it finds


def guarded(
    part: str,
    seed: int,
    seconds: float,
    memory: int = MEMORY,
    patience: Callable[[int], float] = lambda _: PATIENCE,
    kind: Callable[[int], Hashable] = lambda _: None,
) -> Summary:
    """Run `trial(seed, summary)` of the module tests.fuzz.<part> for seeds from `seed` on, in a guarded process.

    Each trial gets `patience(seed)` seconds; one of each `kind(seed)` is done whatever the time.
    """
    summary = Summary(part)
    worker: _Worker | None = None
    with tempfile.TemporaryDirectory(prefix="kinfmu_fuzz_") as folder:
        try:
            for one in seeds(seed, seconds, kind):
                worker = worker or _Worker(part, Path(folder), memory)
                if not worker.run(one, summary, patience(one)):
                    worker.end()
                    worker = None
        finally:
            if worker:
                worker.end()
    return summary


class _Worker:
    """A process that does one trial after another."""

    def __init__(self, part: str, folder: Path, memory: int) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, far = context.Pipe()
        self._process = context.Process(target=_work, args=(part, folder, memory, far), daemon=True)
        self._process.start()
        far.close()
        if not self._pipe.poll(STARTING):
            self.end()
            raise RuntimeError(f"the process for trials of '{part}' did not start")
        self._pipe.recv()

    def run(self, seed: int, summary: Summary, patience: float) -> bool:
        """Do one trial; False if the process is lost."""
        self._pipe.send(seed)
        if not self._pipe.poll(patience):
            summary.count("trials without an end")
            summary.find(seed, "time", f"the trial does not end in {patience:g} s")
            return False
        try:
            tried, findings = self._pipe.recv()
        except EOFError:
            self._process.join(5.0)
            summary.count("trials that ended the process")
            summary.find(seed, "crash", f"the process ended with status {self._process.exitcode}")
            return False
        summary.tried.update(tried)
        summary.findings += [Finding(*one) for one in findings]
        return True

    def end(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _work(part: str, folder: Path, memory: int, pipe: Connection) -> None:
    trial: Trial = importlib.import_module(f"tests.fuzz.{part}").trial
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.chdir(folder)
    tempfile.tempdir = str(folder)
    os.environ["KINFMU_CACHE"] = str(folder / "cache")
    warnings.simplefilter("error")
    watch = Watch(folder)
    sys.addaudithook(watch.hook)
    pipe.send("ready")
    while True:
        seed = pipe.recv()
        summary = Summary(part)
        watch.seen.clear()
        watch.is_on = True
        try:
            trial(seed, summary)
        except MemoryError:
            summary.find(seed, "memory", f"needs more than {memory / 2**30:g} GB")
        except Exception as error:
            summary.find(seed, "traceback", failure(error))
        watch.is_on = False
        for text in watch.seen:
            summary.find(seed, "side effect", text)
        pipe.send((summary.tried, [tuple(one) for one in summary.findings]))


def failure(error: BaseException) -> str:
    """An error with its place in kinfmu."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = next((frame for frame in reversed(frames) if "kinfmu/" in frame.filename), frames[-1])
    where = ours.filename.rpartition("kinfmu/")[2]
    return f"{type(error).__name__} at {where}:{ours.lineno}: {error}"[:500]


def _compiles(program: object, command: object) -> bool:
    """True for a compiler without any text of the input on its command line."""
    if not isinstance(command, list | tuple) or any(CANARY in str(argument) for argument in command):
        return False
    return Path(str(program)).name in COMPILERS


class Watch:
    """What Python reports of processes started, of classes found by pickles and of writing outside a folder."""

    def __init__(self, folder: Path) -> None:
        self.seen: list[str] = []
        self.is_on = False
        caches = (Path.home() / ".cache" / "matplotlib", Path.home() / ".config" / "matplotlib")
        self._inside = (os.path.realpath(folder) + os.sep, "/dev/null", *(f"{place}{os.sep}" for place in caches))

    def hook(self, event: str, arguments: tuple[object, ...]) -> None:
        """Take an audit event."""
        if not self.is_on:
            return
        if event in _STARTED:
            if not _compiles(arguments[0], arguments[1]):
                self.seen.append(f"{event} {arguments[0]!r}"[:300])
        elif event == "pickle.find_class":
            self.seen.append(f"a pickle asks for {arguments}")
        elif event in _CHANGED and not self._is_inside(arguments[0]):
            self.seen.append(f"{event} {arguments[0]!r}"[:300])
        elif event == "open":
            path, mode, flags = arguments
            writes = bool(set(mode) & set("wax+")) if isinstance(mode, str) else bool(int(str(flags or 0)) & _WRITING)
            if writes and not self._is_inside(path):
                self.seen.append(f"open for writing: {path!r}"[:300])

    def _is_inside(self, path: object) -> bool:
        if not isinstance(path, str | bytes | os.PathLike):
            return True  # a descriptor that was opened before
        real = os.path.realpath(os.fsdecode(path))
        return any(real == place.rstrip(os.sep) or real.startswith(place) for place in self._inside)
