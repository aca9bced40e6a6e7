"""Records opened and closed, whole, damaged and given up, as often as time allows: nothing is left open or grows."""

from __future__ import annotations

import random
import resource
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from kinfmu.errors import LogError
from kinfmu.log import McapLog, read
from kinfmu.run import Run
from tests.fuzz.logs import motion
from tests.fuzz.summary import Summary, seeds

FIRST = 50  # rounds before memory and descriptors are looked at for the first time
MOST_GROWTH = 16 * 2**20  # [bytes] that memory may grow by after them


def run(seed: int, seconds: float) -> Summary:
    """Open and close records in rounds, from `seed` on."""
    summary = Summary("opens")
    if sys.platform != "linux":
        return summary
    some = motion().part(slice(0, 3))
    with tempfile.TemporaryDirectory(prefix="kinfmu_fuzz_") as name:
        path = Path(name) / "run.mcap"

        def go_on(one: int) -> None:
            draw = random.Random(one)  # noqa: S311  a seed repeats it
            _write(path, some, whole=draw.random() < 0.5)
            with suppress(LogError):  # of a record that was given up
                read(path)
            _damage(path, draw)
            with suppress(LogError):
                read(path)
            summary.count("written")
            summary.count("read", 2)

        for one in range(seed, seed + FIRST):
            go_on(one)
        descriptors, memory = _descriptors(), _memory()
        for one in seeds(seed + FIRST, seconds):
            go_on(one)
        if _descriptors() > descriptors:
            summary.find(seed, "descriptors", f"{_descriptors() - descriptors} are left open")
        if _memory() > memory + MOST_GROWTH:
            summary.find(seed, "memory", f"it grows by {_memory() - memory} bytes")
        left = sorted(file.name for file in Path(name).iterdir())
        if left != ["run.mcap"]:
            summary.find(seed, "files", f"the folder holds {left}")
    return summary


def _write(path: Path, some: Run, *, whole: bool) -> None:
    """Write a record, whole or given up."""
    sink = McapLog(path, drawn=False)
    sink.begin(some.part(slice(0, 0)))
    sink.add(some)
    if whole:
        sink.end(some, "")
    else:
        sink.close()


def _damage(path: Path, draw: random.Random) -> None:
    """Flip a bit of a file and cut it off somewhere."""
    data = bytearray(path.read_bytes())
    data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    path.write_bytes(data[: draw.randint(1, len(data))])


def _descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def _memory() -> int:
    """Memory of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
