"""Random designs of the gallery: batches against files with the same numbers; see `--help`."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence

import numpy as np

import kinfmu
from kinfmu import Designs, Mechanism, Run
from kinfmu.errors import KinfmuError
from kinfmu.gallery import names
from kinfmu.sweep.continued import continued
from tests.open_lengths import with_open_lengths

SAMPLES = 24  # of a design, over the run of the file
SPREADS = (0.02, 0.2)  # of the logarithm of a length
CLOSE = (1e-12, 1e-10, 1e-8)  # of the largest of a column: values, rates, accelerations
ENGINES = ("python", "native")


def drawn(mechanism: Mechanism, count: int, seed: int) -> dict[str, np.ndarray]:
    """Return random lengths: of a third of the designs one is changed, of a third all, of a third all by one factor."""
    rng = np.random.default_rng(seed)
    lengths = [name for name in mechanism.own_parameters if float(mechanism.parameters[name].value) != 0.0]
    values = {name: np.full(count, float(mechanism.parameters[name].value)) for name in lengths}
    for k in range(count):
        spread = SPREADS[k // 3 % len(SPREADS)]
        factor = np.exp(rng.normal(0.0, spread))
        for name in [lengths[rng.integers(len(lengths))]] if k % 3 == 0 else lengths:
            values[name][k] *= np.exp(rng.normal(0.0, spread)) if k % 3 == 1 else factor
    return values


def faults(name: str, count: int, seed: int, engines: Sequence[str] = ENGINES) -> Iterator[str]:
    """Yield what differs between batches of the engines and `solve` of files with the numbers of each design."""
    mechanism = with_open_lengths(kinfmu.load(name))
    t = np.linspace(mechanism.run.start, mechanism.run.stop, SAMPLES)
    values = drawn(mechanism, count, seed)
    batches = {engine: kinfmu.compile(mechanism, engine=engine).solve_designs(values, t) for engine in engines}
    for k in range(count):
        numbers = {key: float(array[k]) for key, array in values.items()}
        try:
            run = kinfmu.solve(continued(mechanism, numbers).mechanism, t, engine="python")
        except KinfmuError:
            run = None
        for engine, designs in batches.items():
            for fault in _differences(designs, k, run):
                yield f"{name}, seed {seed}, design {k}, {engine}: {fault}"


def _differences(designs: Designs, k: int, run: Run | None) -> Iterator[str]:
    """Yield what differs between a design and the run of its file; None: the file cannot be solved."""
    if run is None:
        if designs.good[k].any():
            yield "its file cannot be solved, but the design is"
        return
    if (designs.status[k] != run.status).any():
        sample = int(np.flatnonzero(designs.status[k] != run.status)[0])
        yield f"status {designs.status[k, sample]} at sample {sample}, of its file {run.status[sample]}"
        return
    tables = ((designs.values, run.values), (designs.rates, run.rates), (designs.accelerations, run.accelerations))
    for order, (table, wanted) in enumerate(tables):
        if table is None or not run.good.any():
            continue
        size = np.maximum(np.nanmax(np.abs(wanted), axis=0), 1.0)
        apart = np.nan_to_num(np.abs(table[k] - wanted) / size)
        if apart.max() > CLOSE[order]:
            sample, column = np.unravel_index(int(apart.argmax()), apart.shape)
            output = run.outputs[column].derivative(order)
            yield f"{output} differs by {apart.max():.1e} at sample {sample} of status {run.status[sample]}"


def main() -> int:
    """Compare random designs of the gallery; 1 if anything differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.stress.designs", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="designs of each mechanism; 1000")
    parser.add_argument("--seed", type=int, default=0, help="of the designs; 0")
    parser.add_argument("names", nargs="*", help="mechanisms of the gallery; all")
    given = parser.parse_args()
    wrong = 0
    for name in given.names or names():
        begun = time.monotonic()
        found = list(faults(name, given.count, given.seed))
        wrong += len(found)
        took = time.monotonic() - begun
        print(f"{name}: {given.count} designs in {took:.0f} s, {len(found)} differences", flush=True)
        print("".join(f"  {fault}\n" for fault in found), end="", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
