"""Records under attack: processes that are killed or ended, full disks, folders without rights, one name for two runs.

Every trial runs in a process of its own, forked from one that has imported what is needed.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout, suppress
from functools import cache
from io import StringIO
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

import kinfmu
from kinfmu.cli import main
from kinfmu.cli.gallery import schema
from kinfmu.errors import KinfmuError, LogError
from kinfmu.fmu import build
from kinfmu.log import McapLog, read, recover, write_mcap
from kinfmu.log.table import write_table
from kinfmu.run import Run
from tests.fuzz.summary import Summary, seeds

MOTION = "motion.mcap"
PATIENCE = 60.0  # [s] for a process
ATTEMPTS = 6  # to interrupt a command before it ends
UNPRIVILEGED = 65534  # a user without rights
LONG, PIECE, MOST_GROWTH = 100_000, 2000, 8 * 2**20  # samples, samples of a piece, [bytes] that the memory may grow by


def run(seed: int, seconds: float) -> Summary:
    """Run trials of all kinds in turn, from `seed` on; one of each kind at least."""
    summary = Summary("logs")
    if sys.platform != "linux":
        return summary
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.fuzz.logs"])
    with tempfile.TemporaryDirectory(prefix="kinfmu_fuzz_") as name:
        folder = Path(name)
        folder.chmod(0o755)  # for trials of a user without rights
        write_mcap(motion(), folder / MOTION)
        fmu = build(kinfmu.load("fourbar"), folder / "fourbar.fmu", flavour="python", drive="time")
        for one in range(seed, seed + len(KINDS)):
            _trial(one, folder, fmu, summary)
        if seconds > 0:
            for one in seeds(seed + len(KINDS), seconds):
                _trial(one, folder, fmu, summary)
    return summary


def _trial(seed: int, folder: Path, fmu: Path, summary: Summary) -> None:
    kind, trial = list(KINDS.items())[seed % len(KINDS)]
    summary.count(kind)
    with tempfile.TemporaryDirectory(dir=folder, prefix="trial_") as name:
        place = Path(name)
        place.chmod(0o755)
        try:
            for fault in trial(random.Random(seed), place, fmu):  # noqa: S311  a seed repeats it
                summary.find(seed, kind, fault)
        except Exception as error:
            summary.find(seed, kind, f"{type(error).__name__}: {error}"[:500])


@cache
def motion() -> Run:
    """A run of 3000 samples."""
    return kinfmu.solve(kinfmu.load("fourbar"), np.linspace(0.0, 60.0, 3000), engine="python")


def _recorded_next_to(path: Path) -> Run:
    """The same run in a process of a trial, whose folder is next to the file that holds it."""
    return read(next(folder / MOTION for folder in path.parents if (folder / MOTION).exists()))


def _is_beginning(part: Run, whole: Run) -> bool:
    """True if a run holds the first samples of another, bit for bit, but for what is computed when it is read."""
    tables = ("t", "values", "rates", "accelerations", "inputs", "residual", "status", "watch")
    return all(getattr(part, name).tobytes() == getattr(whole, name)[: len(part)].tobytes() for name in tables)


def _process(target: Callable[..., None], *arguments: Any) -> tuple[Any, Connection]:
    """Start a process; its first argument is the end of a pipe, of which the other is returned."""
    context = multiprocessing.get_context("forkserver")
    near, far = context.Pipe(duplex=False)
    process = context.Process(target=target, args=(far, *arguments), daemon=True)
    process.start()
    far.close()
    return process, near


def _messages(pipe: Connection) -> list[Any]:
    """Return all messages of a process until it ended."""
    texts = []
    try:
        while pipe.poll(PATIENCE):
            texts.append(pipe.recv())
    except EOFError:
        pass
    return texts


def _hidden(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir() if path.name.startswith(".") or path.name.endswith(".part")]


def _grow(pipe: Connection, path: Path, seed: float, pause: float) -> None:
    """Write the run piece by piece; send how many samples were passed on, in the end "whole" or the error."""
    draw, whole, done = random.Random(seed), _recorded_next_to(path), 0  # noqa: S311
    sink = McapLog(path, drawn=draw.random() < 0.5)
    try:
        sink.begin(whole.part(slice(0, 0)))
        pipe.send(0)
        while done < len(whole):
            size = draw.randint(1, 400)
            sink.add(whole.part(slice(done, done + size)))
            done = min(done + size, len(whole))
            pipe.send((done, time.monotonic()))
            time.sleep(pause)
        sink.end(whole, "")
        pipe.send(("whole", time.monotonic()))
    except LogError as error:
        pipe.send(str(error))


def _killed(draw: random.Random, folder: Path, _fmu: Path) -> Iterator[str]:
    """SIGKILL while a record grows: everything passed on is there, and an older record until the first samples."""
    path = folder / "run.mcap"
    older = motion().part(slice(0, 5))
    write_mcap(older, path)
    process, pipe = _process(_grow, path, draw.random(), 0.002 * draw.random())
    first = pipe.recv()
    time.sleep(0.08 * draw.random() ** 2)
    process.kill()
    process.join()
    messages = [first, *_messages(pipe)]
    done = max(one[0] for one in messages if isinstance(one, tuple) and one[0] != "whole") if len(messages) > 1 else 0
    if messages[-1] == "whole" or done == len(motion()):
        return
    found = recover(path, folder / "found.mcap")
    if not _is_beginning(found, motion()):
        yield "what is recovered is not the beginning of the run"
    if done and len(found) < done:
        yield f"{len(found)} samples are left of {done} that were passed on"
    if not done and len(found) < len(older):
        yield "the older record is lost"
    if len(_hidden(folder)) > 1:
        yield f"left behind: {_hidden(folder)}"
    sink = McapLog(path)  # the name of a killed run is free again
    sink.begin(motion().part(slice(0, 0)))
    sink.end(motion().part(slice(0, 2)), "")
    if len(read(path)) != 2:
        yield "the name is not free after the writer was killed"


def _fill_disk(pipe: Connection, path: Path, limit: int, seed: float) -> None:
    """Write the run in several ways where files may have so many bytes; say what went wrong."""
    whole = _recorded_next_to(path)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    for name, write in _WRITERS.items():
        try:
            write(whole, path.with_suffix(name))
            pipe.send((name, ""))
        except KinfmuError as error:
            pipe.send((name, str(error)))
    _grow(pipe, path, seed, 0.0)


def _schema(_run: Run, path: Path) -> None:
    with redirect_stdout(StringIO()):
        schema.callback(path)  # type: ignore[misc]  # it is a command


_WRITERS: dict[str, Callable[[Run, Path], None]] = {
    ".whole.mcap": write_mcap,
    ".csv": write_table,
    ".npz": write_table,
    ".json": _schema,
}


def _full_disk(draw: random.Random, folder: Path, _fmu: Path) -> Iterator[str]:
    """A disk that fills up: one line reports it, older files stay, a record that grows keeps what it has."""
    path = folder / "run.mcap"
    for name in _WRITERS:
        path.with_suffix(name).write_text("older")
    limit = draw.randint(1, 500_000)
    process, pipe = _process(_fill_disk, path, limit, draw.random())
    messages = _messages(pipe)
    process.join()
    for name, error in (one for one in messages if isinstance(one, tuple) and one[0] in _WRITERS):
        if error and ("cannot be written" not in error or "\n" in error):
            yield f"{name}: {error}"
        if error and path.with_suffix(name).read_text() != "older":
            yield f"{name}: the older file is lost"
    if _hidden(folder):
        yield f"left behind: {_hidden(folder)}"
    if isinstance(messages[-1], str):
        if "cannot be written (File too large)" not in messages[-1] or "\n" in messages[-1]:
            yield messages[-1]
        done = [one[0] for one in messages if isinstance(one, tuple) and isinstance(one[0], int)]
        if path.exists():
            found = recover(path, folder / "found.mcap")
            if not _is_beginning(found, motion()) or len(found) < max(done, default=0):
                yield "what is left is not what was passed on"
        elif done:
            yield "the record is lost"
    elif messages[-1][0] != "whole":
        yield f"the process ended with status {process.exitcode} after {messages[-1:]}"


def _without_rights(pipe: Connection, path: Path) -> None:
    whole = _recorded_next_to(path)
    for name, write in _WRITERS.items():  # imports what it needs, which the user without rights may not
        write(whole, path.parents[1] / f"open{name}")
    if os.geteuid() == 0:
        os.setgid(UNPRIVILEGED)
        os.setuid(UNPRIVILEGED)
    for name, write in (*_WRITERS.items(), (".grown.mcap", lambda run, target: McapLog(target).begin(run))):
        try:
            write(whole, path.with_suffix(name))
            pipe.send((name, "no error"))
        except KinfmuError as error:
            pipe.send((name, str(error)))


def _read_only(_draw: random.Random, folder: Path, _fmu: Path) -> Iterator[str]:
    """A folder in which nothing can be written: one line reports it, nothing changes there."""
    closed = folder / "closed"
    closed.mkdir()
    closed.chmod(0o555)
    process, pipe = _process(_without_rights, closed / "run.mcap")
    messages = _messages(pipe)
    process.join()
    if len(messages) != len(_WRITERS) + 1:
        yield f"the process ended with status {process.exitcode} after {messages[-1:]}"
    for name, text in messages:
        if "cannot be written (Permission denied)" not in text or "\n" in text:
            yield f"{name}: {text}"
    if any(closed.iterdir()):
        yield "files appeared in the folder"


def _two_at_once(draw: random.Random, folder: Path, _fmu: Path) -> Iterator[str]:
    """Two processes and one name: a run that says it is written is the one in the file, or ended before the next."""
    path = folder / "run.mcap"
    both = []
    for _ in range(2):
        both.append(_process(_grow, path, draw.random(), 0.002 * draw.random()))
        time.sleep(0.1 * draw.random() ** 3)
    spans = []
    for process, pipe in both:
        messages = _messages(pipe)
        process.join()
        last = messages[-1] if messages else "no message"
        if isinstance(last, tuple) and last[0] == "whole":
            spans.append((messages[1][1], last[1]))
        elif last != f"{path}: cannot be written ({BUSY})":
            yield str(last)
    if not spans:
        yield "neither run is written"
    elif len(spans) == 2 and max(span[0] for span in spans) < min(span[1] for span in spans):
        yield "both runs say that they are written, and one is lost"
    if not _is_beginning(read(path), motion()) or len(read(path)) != len(motion()):
        yield "the record is not the run"


BUSY = "a run in progress writes to it; choose another name, or wait until it has ended"


def _command(pipe: Connection, arguments: list[str], folder: Path) -> None:
    """Run the command line as a shell does."""
    os.chdir(folder)
    tempfile.tempdir = str(folder / "temporary")
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # not longer than the process of the suite
    pipe.send("begun")
    main(arguments)


def _commands(fmu: Path) -> list[list[str]]:
    """Return the commands that `_ended` interrupts."""
    return [
        ["simulate", str(fmu), "--step", "0.01", "--mcap", "run.mcap", "--rrd", "run.rrd"],
        ["simulate", str(fmu), "--step", "0.5", "--mcap", "run.mcap", "--rrd", "run.rrd"],
        ["solve", "fourbar", "--engine", "python", "--times", "0:180:0.02", "-o", "run.csv"],
        ["solve", "fourbar", "--engine", "python", "--times", "0:180:0.02", "-o", "run.mcap"],
    ]


def _ended(draw: random.Random, folder: Path, fmu: Path) -> Iterator[str]:
    """SIGTERM or SIGHUP at any moment: no hidden files, no temporary folders, records are whole.

    A command that ends before its signal is judged by the same rules, and started again with half the pause.
    """
    number = draw.choice([signal.SIGTERM, signal.SIGHUP])
    (folder / "temporary").mkdir()
    arguments = draw.choice(_commands(fmu))
    pause = 0.1 + 1.2 * draw.random()
    for _ in range(ATTEMPTS):
        process, pipe = _process(_command, arguments, folder)
        pipe.recv()
        time.sleep(pause)
        with suppress(ProcessLookupError):
            os.kill(process.pid, number)
        process.join(PATIENCE)
        if process.exitcode not in (0, 128 + number, -number):  # -number: before the command line began
            yield f"{arguments[0]} ended with status {process.exitcode} at {number.name}"
        left = [*_hidden(folder), *(path.name for path in (folder / "temporary").iterdir())]
        if left:
            yield f"{arguments[0]} left behind {left} at {number.name}"
        if (folder / "run.mcap").exists() and not read(folder / "run.mcap").outputs:
            yield "the record is not whole"
        if process.exitcode != 0 or left:
            return
        pause /= 2.0
    yield f"{arguments[0]} was not interrupted: it ended before {number.name} {ATTEMPTS} times"


def _long(pipe: Connection, path: Path, samples: int) -> None:
    piece = _recorded_next_to(path).part(slice(0, PIECE))
    sink = McapLog(path, drawn=False)
    sink.begin(piece.part(slice(0, 0)))
    sizes = []
    for k in range(samples // PIECE):
        sink.add(piece)
        if k % 10 == 9:
            sizes.append(int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize())
    sink.close()
    pipe.send(sizes)


def _flat(_draw: random.Random, folder: Path, _fmu: Path, samples: int = LONG) -> Iterator[str]:
    """A long run: a record that grows takes no more memory for it."""
    process, pipe = _process(_long, folder / "run.mcap", samples)
    (sizes,) = _messages(pipe)
    process.join()
    if sizes[-1] - sizes[0] > MOST_GROWTH:
        yield f"the memory grows by {sizes[-1] - sizes[0]} bytes over {samples} samples"


KINDS: dict[str, Callable[[random.Random, Path, Path], Iterator[str]]] = {
    "killed": _killed,
    "full disk": _full_disk,
    "two at once": _two_at_once,
    "ended": _ended,
    "read-only folder": _read_only,
    "long run": _flat,
}
