"""Cost against size: chains of loops, batches of designs, records of rows; each next to its floor, in one run."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from benchmarks.crank_rockers import ANGLES, crank_rocker, drawn
from benchmarks.design_measures import OF_ROCKER
from benchmarks.native_sweep import closed_form
from benchmarks.rounds import in_turn, spread, table
from benchmarks.singular_points import FOURBAR
from kinfmu.draw.chart import SMALL, dress
from kinfmu.draw.scene.palette import BODIES, GROUND, darker
from kinfmu.draw.sheet import GREY, INCH, ink
from kinfmu.draw.writing import write
from kinfmu.log import write_mcap
from kinfmu.mechanism.gallery import load
from kinfmu.mechanism.gallery.chains import fourbar_chain
from kinfmu.motion import measure_designs
from kinfmu.plan import compile_plan
from kinfmu.run.model import compile as compiled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROUNDS = 3
LOOPS = (1, 10, 100, 1000)
DESIGNS = (1, 10, 100, 1000, 10_000, 100_000)
ROWS = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
SAMPLES = 1000  # of a chain, in a call
BRIEF = 1e-2  # [s]; a shorter call is repeated until it takes this long
CHART = "cost-against-size"
COLOURS = (BODIES[4], darker(BODIES[4]), GROUND)
_WIDTH, _HEIGHT = 760.0, 265.0  # [pt]


class Cost(NamedTuple):
    """Seconds of processor time against size; curves: medians of the rounds by name, one for each size; floor last."""

    title: str
    sizes: Sequence[int]
    curves: dict[str, list[float]]


def run(rounds: int = ROUNDS, folder: Path | None = None, most: int = 10_000_000) -> str:
    """Return tables of cost against size, up to a largest size; the chart goes into a folder, if one is given."""
    with tempfile.TemporaryDirectory(prefix="kinfmu_bench_") as temporary:
        costs = [
            _measured("a sample of a chain of four-bars", "loops", LOOPS, most, rounds, _chain),
            _measured("measures of crank-rockers", "designs", DESIGNS, most, rounds, _designs),
            _measured("a record of the crank-rocker", "rows", ROWS, most, rounds, partial(_record, Path(temporary))),
        ]
    costs = [cost for cost in costs if cost.sizes]
    lines = [f"cost against size; processor time, median of {rounds} rounds in turn"]
    for cost in costs:
        head = (cost.title, *cost.curves, "times the floor")
        columns = list(zip(*cost.curves.values(), strict=True))
        rows = [
            (f"{size:,}".replace(",", " "), *(f"{value:.3g} s" for value in row), f"{row[-2] / row[-1]:.2f}")
            for size, row in zip(cost.sizes, columns, strict=True)
        ]
        lines += ["", *table(head, rows)]
    if folder is not None:
        paths = tuple(folder / f"{CHART}{suffix}" for suffix in (".svg", ".png"))
        write(paths, lambda: chart(costs))
        lines += ["", f"written: {', '.join(map(str, paths))}"]
    return "\n".join(lines)


def _measured(
    title: str,
    unit: str,
    sizes: Sequence[int],
    most: int,
    rounds: int,
    ways: Callable[[int], dict[str, tuple[Callable[[], object], float]]],
) -> Cost:
    """Return the cost of what `ways` returns for a size: functions to call, and the share of a call that counts."""
    sizes = [size for size in sizes if size <= most]
    curves: dict[str, list[float]] = {}
    for size in sizes:
        of_size = ways(size)
        times = [_repeated(way) for way, _ in of_size.values()]
        measured = in_turn([way for way, _ in times], rounds, process_time)
        for (name, (_, share)), (_, calls), seconds in zip(of_size.items(), times, measured, strict=True):
            curves.setdefault(name, []).append(spread(seconds).median / calls * share)
    return Cost(f"{title}: {unit}", sizes, curves)


def _repeated(way: Callable[[], object]) -> tuple[Callable[[], object], int]:
    """Return a function that calls another so often that it can be timed, and how often."""
    way()
    start = process_time()
    way()
    calls = max(1, math.ceil(BRIEF / max(process_time() - start, 1e-7)))
    return (way if calls == 1 else lambda: [way() for _ in range(calls)]), calls


def _chain(loops: int) -> dict[str, tuple[Callable[[], object], float]]:
    mechanism = fourbar_chain(loops)
    begin = compile_plan(mechanism).anchor_values[0][0]
    u = begin + np.linspace(0.0, 1.5, SAMPLES)
    native, python = (compiled(mechanism, engine=engine) for engine in ("native", "python"))
    angles: dict[str, Any] = {native.mechanism.drivers[0].inputs()[0]: u}
    few = {name: of[:10] for name, of in angles.items()}
    by_hand = closed_form(u, np.empty((15, SAMPLES)))
    return {
        "Python": (lambda: python.solve(**few), 0.1),
        "native": (lambda: native.solve(**angles), 1.0 / SAMPLES),
        "closed form by hand, for each loop": (by_hand, loops / SAMPLES),
    }


def _designs(count: int) -> dict[str, tuple[Callable[[], object], float]]:
    angles, lengths = np.linspace(0.0, 2.0 * np.pi, ANGLES), drawn(count)
    model = compiled(crank_rocker(), engine="native")
    by_hand = closed_form(angles, np.empty((15, ANGLES)))
    return {
        "measure_designs": (lambda: measure_designs(model, lengths, OF_ROCKER, crank_angle=angles), 1.0),
        "closed form by hand, samples alone": (by_hand, float(count)),
    }


def _record(folder: Path, rows: int) -> dict[str, tuple[Callable[[], object], float]]:
    record, plain = folder / "record.mcap", folder / "columns"
    angle = np.linspace(0.0, rows * np.radians(1.0), rows)
    run = compiled(load("crank_rocker"), FOURBAR).solve(crank_angle=angle)
    columns = (run.values, run.rates, run.accelerations)

    def written() -> None:
        with plain.open("wb") as stream:
            for columns_of in columns:
                columns_of.tofile(stream)

    return {
        "write_mcap": (lambda: write_mcap(run, record, channels=["-drawn"]), 1.0),
        "the same numbers by numpy.tofile": (written, 1.0),
    }


def chart(costs: Sequence[Cost]) -> Figure:
    """Draw seconds against size, one panel each."""
    from matplotlib.figure import Figure

    made = Figure(figsize=(_WIDTH / INCH, _HEIGHT / INCH), dpi=INCH, facecolor="white")
    grid = made.add_gridspec(
        1, len(costs), left=0.06, right=0.985, top=1.0 - 26.0 / _HEIGHT, bottom=36.0 / _HEIGHT, wspace=0.22
    )
    for k, cost in enumerate(costs):
        axes = made.add_subplot(grid[0, k])
        title, unit = cost.title.split(": ")
        dress(axes, title)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(unit, fontsize=SMALL, color=ink(GREY), labelpad=2.0)
        colours = [*COLOURS[: len(cost.curves) - 1], COLOURS[-1]]
        for (name, seconds), colour in zip(cost.curves.items(), colours, strict=True):
            axes.plot(cost.sizes, seconds, color=ink(colour), linewidth=1.6, marker="o", markersize=3.5, label=name)
        powers = np.log10([*cost.curves.values()])
        axes.set_ylim(10.0 ** np.floor(powers.min()), 10.0 ** (np.ceil(powers.max()) + 1.0))  # with a place for names
        axes.minorticks_off()
        axes.legend(loc="upper left", frameon=False, fontsize=SMALL, labelcolor="linecolor", labelspacing=0.3)
        if k == 0:
            axes.set_ylabel("seconds", fontsize=SMALL, color=ink(GREY), labelpad=2.0)
    return made
