"""Records of a long run of the four-bar: time to write and read them, their size, and the cost of a recorded step.

Compared with the writer of the package mcap, which gets the same messages, already made, one after another.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time
from typing import NamedTuple

import numpy as np

from benchmarks.rounds import in_turn, spread, table
from kinfmu.errors import CompilerError, MissingPackageError
from kinfmu.fmu.build import FLAVOURS, build
from kinfmu.fmu.host.simulate import simulate
from kinfmu.log import McapLog, read, write_mcap, write_rrd
from kinfmu.log.record import computed_when_read
from kinfmu.log.viewer.timeline import MOST_ROWS
from kinfmu.mechanism.gallery import load
from kinfmu.run import Run
from kinfmu.run.solve import solve

ROUNDS = 5
SAMPLES = 1_000_000
TURNS = 0.5  # of the crank
STEPS = 20_000  # of an FMU, in a round
STOP = 360.0  # [s]; the crank of the FMU turns once in this time
PER_DOUBLE, PER_ROW = 9.0, 20.0  # [bytes] that a file may take


class LogTask(NamedTuple):
    """Something that writes the first `rows` samples of a run to a file, or reads them."""

    name: str
    rows: int
    take: Callable[[], object]
    file: Path
    plain: int = 0  # place of the task of the package mcap with which it is compared


def run(rounds: int = ROUNDS, samples: int = SAMPLES, steps: int = STEPS) -> str:
    """Return a table of writing and reading records, and one of the steps of an FMU, alone and with their record.

    Of records: rows per second by the clock; processor time per row, and the ratio of the package mcap's to it; size.
    """
    long_run = fourbar(samples)
    processor: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory(prefix="kinfmu_bench_") as folder:
        found, absent = tasks(long_run, Path(folder))
        takes = [_timed(task.take, processor.setdefault(task.name, [])) for task in found]
        clock = in_turn(takes, rounds, perf_counter)
        sizes = [task.file.stat().st_size / task.rows for task in found]
    doubles = len(list(long_run.without(computed_when_read(long_run)).places()))
    rows = []
    busy_in = [spread([one / task.rows for one in processor[task.name][1:]]).median for task in found]  # 0 warms up
    for task, seconds, busy, size in zip(found, clock, busy_in, sizes, strict=True):
        speed = spread([task.rows / value / 1e6 for value in seconds])
        share = "" if absent else f"{busy_in[task.plain] / busy:.1f}"
        cost = f"{busy * 1e6:.2f} us/row"
        rows.append((task.name, f"{speed.median:.2f}", f"{speed.high:.2f}", cost, share, f"{size:.1f} B/row"))
    lines = [f"{samples} samples of the four-bar, {doubles} columns of 8 bytes, {rounds} rounds in turn"]
    lines += table(("", "million rows/s", "best", "processor", "mcap/this", "size"), rows)
    allowed = PER_DOUBLE * doubles + PER_ROW
    recorded, best = found[-1].rows, min(clock[-1])
    lines.append(f"a Rerun recording of {recorded} samples, its record read, takes {best:.2f} s at best")
    lines.append(f"a row may take {allowed:.0f} B: {PER_DOUBLE:g} for each of {doubles} columns, and {PER_ROW:g}")
    return "\n".join([*lines, *([absent] if absent else []), "", *logged_steps(rounds, steps)])


def _timed(take: Callable[[], object], seconds: list[float]) -> Callable[[], object]:
    """Return `take` as a function that appends the processor time of each call, in all threads, to `seconds`."""

    def timed() -> None:
        start = process_time()
        take()
        seconds.append(process_time() - start)

    return timed


def fourbar(samples: int) -> Run:
    """Return a run of the gallery's four-bar, whose margins and errors are computed when they are read."""
    angle = np.linspace(0.0, TURNS * 2.0 * np.pi, samples)
    return solve(load("fourbar"), angle / np.radians(1.0))


def tasks(long_run: Run, folder: Path) -> tuple[list[LogTask], str]:
    """Return the measurements, those of the package mcap first if it is installed, and a note if it is not."""
    n = len(long_run)
    record, everything = folder / "record.mcap", folder / "everything.mcap"
    short, recording = folder / "short.mcap", folder / "short.rrd"
    reviewed = long_run.part(slice(0, MOST_ROWS))
    write_mcap(reviewed, short)
    found = [
        LogTask("MCAP: the record", n, lambda: write_mcap(long_run, record, channels=["-drawn"]), record),
        LogTask("MCAP: with what viewers draw", n, lambda: write_mcap(long_run, everything), everything, plain=1),
        LogTask("the record read back", n, lambda: read(record), record),
        LogTask("the record read back from all that", n, lambda: read(everything), everything),
        LogTask("a record made into a recording", len(reviewed), lambda: write_rrd(read(short), recording), recording),
    ]
    try:
        plain = [_plain("the record", found[0], folder), _plain("with what viewers draw", found[1], folder)]
    except MissingPackageError as error:
        return [task._replace(plain=0) for task in found], str(error)
    return [*plain, *found], ""


def _plain(name: str, task: LogTask, folder: Path) -> LogTask:
    """Return the task of writing the messages of a record by the package mcap: ready bytes, one call each."""
    if find_spec("mcap") is None:
        raise MissingPackageError("mcap is not installed: pip install 'kinfmu[bench]'")
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer

    task.take()
    with task.file.open("rb") as stream:
        found = make_reader(stream).iter_messages(log_time_order=False)
        messages = [(channel, schema, one.log_time, one.data, one.sequence) for schema, channel, one in found if schema]
    file = folder / f"plain {name}.mcap"

    def take() -> None:
        with file.open("wb") as stream:
            writer = Writer(stream, compression=CompressionType.ZSTD)
            writer.start(profile="ros2", library="")
            places: dict[int, int] = {}
            for channel, schema, time, data, number in messages:
                if channel.id not in places:
                    of = writer.register_schema(schema.name, schema.encoding, schema.data)
                    places[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, of)
                writer.add_message(places[channel.id], time, data, time, number)
            writer.finish()

    return LogTask(f"the package mcap: {name}", task.rows, take, file, plain=task.plain)


def logged_steps(rounds: int, steps: int = STEPS) -> list[str]:
    """Return lines: processor time of a step of the four-bar's FMU, by flavour, without and with a record.

    Loading the FMU does not count: time runs from the first sample to the end of `simulate`.
    """
    ways: dict[str, list[Callable[[], float]]] = {}
    absent = []
    with tempfile.TemporaryDirectory(prefix="kinfmu_bench_") as name:
        folder = Path(name)
        for flavour in FLAVOURS:
            try:
                fmu = build(load("fourbar"), folder / f"{flavour}.fmu", flavour=flavour, drive="time")
            except CompilerError as error:
                absent.append(f"native: {error}")
                continue
            ways[flavour] = [_alone(fmu, steps), _logged(fmu, steps, folder / "run.mcap")]
        seconds = {flavour: [[way() for way in pair] for _ in range(rounds + 1)][1:] for flavour, pair in ways.items()}
    rows = []
    for flavour, measured in seconds.items():
        costs = (spread([one / steps * 1e6 for one in column]) for column in zip(*measured, strict=True))
        rows.append([flavour, *(f"{cost.median:.1f} us{f'best {cost.low:.1f}':>14}" for cost in costs)])
    return table((f"{steps} steps of its FMU, all channels", "step alone", "logged step"), rows) + absent


def _alone(fmu: Path, steps: int) -> Callable[[], float]:
    """Return a function that steps an FMU without a record, and returns the processor time [s]."""
    return lambda: _measured(fmu, steps, None)


def _logged(fmu: Path, steps: int, record: Path) -> Callable[[], float]:
    """Return a function that steps an FMU with a record of all channels, and returns the processor time [s]."""
    return lambda: _measured(fmu, steps, McapLog(record))


def _measured(fmu: Path, steps: int, record: McapLog | None) -> float:
    start = 0.0

    def after(done: int, _count: int) -> None:
        nonlocal start
        if done == 1:
            start = process_time()

    channels = None if record else ["none"]
    simulate(fmu, start=0.0, stop=STOP, step=STOP / steps, channels=channels, sink=record, progress=after)
    return process_time() - start
