"""Mechanisms up to 1e10 sizes from the world's origin that are tied to it, in 50 digits: `python -m tests.stress.far`.

A coordinate in the world is driven or coupled. Samples with numbers must be within their estimates; what the rounding
of the offset does not let close must be refused, and the message must give the offset.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

import kinfmu
from kinfmu.errors import AssemblyError
from tests import oracle
from tests.oracle import largest_error
from tests.stress.comparisons import all_compared, command_line
from tests.stress.families import Draw
from tests.test_scale import TIED, written

NEAREST, FARTHEST = 1.5, 10.0  # decimal exponents
TIMES = np.linspace(0.0, 1.2, 13)
REASON = "from the world's origin"


@dataclass
class Tied:
    """What one mechanism showed: its errors as parts of the estimates, and how many samples had no numbers."""

    seed: int
    family: str
    errors: tuple[float, ...] = (0.0, 0.0, 0.0)
    refused: int = 0
    faults: list[str] = field(default_factory=list)


def compared(seed: int, engine: Literal["python", "native"]) -> Tied:
    """Compare a mechanism at a random place with its equations in 50 digits."""
    rng = Draw(seed)
    made = rng.choice(TIED)
    x, y = (rng.choice((1.0, -1.0)) * 10.0 ** rng.uniform(NEAREST, FARTHEST) for _ in range(2))
    y = rng.choice((y, y, 0.0, rng.uniform(-5.0, 5.0)))
    mechanism, residual = made(*(written(float(f"{value:.{rng.randint(3, 15)}g}")) for value in (x, y)))
    found = Tied(seed, f"{made.__name__}, {engine} engine")
    try:
        run = kinfmu.solve(mechanism, TIMES, engine=engine)
    except AssemblyError as error:
        found.refused = len(TIMES)
        found.faults += [] if REASON in str(error) else [str(error)]
        return found
    found.refused = int((~run.good).sum())
    found.faults += [event.text for event in run.events if REASON not in event.text]
    if not run.good.any():
        return found
    exact = oracle.solve(residual, run.q[run.good], *run.inputs[run.good].T.tolist())
    errors = []
    for ours, wanted, estimate in zip((run.q, run.qd, run.qdd), exact, run.error.T, strict=True):
        off = [largest_error(row, true) for row, true in zip(ours[run.good], wanted, strict=True)]
        errors.append(float((np.array(off) / estimate[run.good]).max()))
    found.errors = tuple(errors)
    if max(errors) > 1.0:
        found.faults.append(f"an error is {max(errors):.2g} times its estimate")
    return found


def _task(task: tuple[int, Literal["python", "native"]]) -> Tied:
    return compared(*task)


def main() -> int:
    """Compare many mechanisms and print what is found; 1 if anything is wrong."""
    parser = command_line("Mechanisms far from the world's origin that are tied to it, in 50 digits.", 1000)
    parser.add_argument("--engine", choices=["python", "native"], default="python", help="python by default")
    given = parser.parse_args()
    tasks = [(seed, given.engine) for seed in range(given.seed, given.seed + given.count)]
    found = all_compared(_task, tasks, given.jobs)
    worst = ", ".join(f"{one:.2g}" for one in np.max([one.errors for one in found], axis=0))
    refused, faulty = sum(one.refused for one in found), sum(bool(one.faults) for one in found)
    print(f"{len(found)} mechanisms, {given.engine} engine: worst errors {worst} of their estimates; ", end="")
    print(f"{refused} of {len(found) * len(TIMES)} samples refused; {faulty} at fault")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
