"""What a step of `kinfmu.simulate` costs: alone, and with all channels written to a record."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time

from kinfmu.bench.rounds import spread
from kinfmu.errors import CompilerError
from kinfmu.fmu.build import FLAVOURS, build
from kinfmu.fmu.simulate import simulate
from kinfmu.gallery import load
from kinfmu.log import McapLog

STEPS = 20_000  # in a round
TURN = 360.0  # [s] that the crank takes for a turn


def table(rounds: int, steps: int = STEPS) -> list[str]:
    """Return lines: processor time of a step of the four-bar's FMU, by flavour, without and with a record.

    Loading the FMU does not count: time runs from the first sample to the end of `simulate`.
    """
    head = f"{steps} steps of its FMU, all channels"
    lines = [f"{head:40}{'step alone':>15}{'logged step':>25}"]
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
    for flavour, measured in seconds.items():
        alone, logged = (spread([one / steps * 1e6 for one in column]) for column in zip(*measured, strict=True))
        figures = "".join(f"{cost.median:12.1f} us{f'best {cost.low:.1f}':>10}" for cost in (alone, logged))
        lines.append(f"{flavour:40}{figures}")
    return lines + absent


def _alone(fmu: Path, steps: int) -> Callable[[], float]:
    """Return a function that steps an FMU, asks for no channel, and gives the processor time [s]."""
    return lambda: _measured(fmu, steps, None)


def _logged(fmu: Path, steps: int, record: Path) -> Callable[[], float]:
    """The same with all channels, which are written to a record as `kinfmu simulate` does."""
    return lambda: _measured(fmu, steps, McapLog(record))


def _measured(fmu: Path, steps: int, record: McapLog | None) -> float:
    start = 0.0

    def after(done: int, _count: int) -> None:
        nonlocal start
        if done == 1:
            start = process_time()

    channels = None if record else ["none"]
    simulate(fmu, start=0.0, stop=TURN, step=TURN / steps, channels=channels, sink=record, progress=after)
    return process_time() - start
