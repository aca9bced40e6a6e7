"""Time a sample and the compiling of long chains: both should grow with the number of loops, and no faster."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence

from benchmarks.rounds import samples_in_turn, spread, table
from kinfmu.codegen.python import load_model
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.gallery.chains import fourbar_chain, open_chain
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Solver

LOOPS = (1, 10, 100, 1000)
ROUNDS = 15
MOST = 100  # samples in a row: they stay inside the range
STEP = 0.01  # [rad]
FIRST_LOOP = ("bar_1.phi",)


def run(rounds: int = ROUNDS) -> str:
    """Return a table: seconds to compile, and microseconds a sample for all outputs and for one of the first loop."""
    whole, compiled = zip(*(_ready(fourbar_chain(n)) for n in LOOPS), strict=True)
    first, _ = zip(*(_ready(fourbar_chain(n), FIRST_LOOP) for n in LOOPS), strict=True)
    times = samples_in_turn([*whole, *first], rounds, MOST)
    rows = [
        [str(n), f"{seconds:.2f}", *spread(of_all).cells(2), f"{statistics.median(of_first):.2f}"]
        for n, seconds, of_all, of_first in zip(LOOPS, compiled, times, times[len(LOOPS) :], strict=False)
    ]
    lines = [f"chain of four-bars, q, qd, qdd of all bodies, {rounds} rounds in turn; processor time"]
    lines += table(("loops", "compile, s", "us a sample", "min", "max", "us, first loop only"), rows)
    grown = sorted(math.log(b / a) / math.log(LOOPS[3] / LOOPS[1]) for a, b in zip(times[1], times[3], strict=True))
    median, low, high = statistics.median(grown), grown[0], grown[-1]
    lines.append(
        f"exponent from {LOOPS[1]} to {LOOPS[3]} loops, round by round: {median:.3f} ({low:.3f} to {high:.3f})"
    )
    pruned = statistics.median(times[-1]) / statistics.median(times[len(LOOPS)])
    lines.append(f"one output of the first loop: {pruned:.2f} times the cost that it has in a chain of one")
    links, seconds = _ready(open_chain(LOOPS[-1]))
    (samples,) = samples_in_turn([links], rounds, MOST)
    lines.append(
        f"open chain of {LOOPS[-1]} links: compile {seconds:.2f} s, {statistics.median(samples):.2f} us a sample"
    )
    return "\n".join(lines)


def _ready(mechanism: Mechanism, outputs: Sequence[str] | None = None) -> tuple[Callable[[int], None], float]:
    """Return a function that takes some samples, each a step further, and the seconds it took to compile."""
    start = time.process_time()
    model = load_model(compile_plan(mechanism, outputs))
    seconds = time.process_time() - start
    solver = Solver(model)

    def samples(count: int) -> None:
        pose = solver.anchor
        for k in range(count):
            pose = solver.solve(pose, (solver.anchor.u[0] + (k + 1) * STEP,))
            solver.motion(pose, (1.0,), (0.0,))

    return samples, seconds
