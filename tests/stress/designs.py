"""Random designs of the gallery: batches against files with the same numbers; see `--help`.

Batches of both engines are compared with Python's `solve` of a file for each design, whose numbers are numbers in the
generated code; some files are solved in C too. A mechanism whose comparison is done is kept in `--results`, and
skipped by the next call.
"""

from __future__ import annotations

import argparse
import gc
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import kinfmu
from kinfmu import Designs, Mechanism, Run
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.gallery import names
from kinfmu.plan import SolvePlan
from kinfmu.processes import cores, processes, without_main
from kinfmu.run import model
from kinfmu.run.continued import continued
from kinfmu.solver.python.pose import Status
from kinfmu.units import CoordinateName
from tests.mechanisms import with_open_lengths

SAMPLES = 24  # of a design, over the run of the file
SPREADS = (0.02, 0.2)  # of the logarithm of a length
CLOSE = (1e-12, 1e-10, 1e-8)  # of the largest of a column: values, rates, accelerations
ENGINES = ("python", "native")
PART = 50  # designs of a task
FILES_IN_C = 2  # of a mechanism: each is compiled


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


class Compared(NamedTuple):
    """Designs compared with their files.

    faults: What differs. samples: Samples by status, of the files. worst: Largest differences of values, rates and
    accelerations, of the largest of a column. unsolvable: Designs whose file cannot be solved.
    """

    faults: list[str]
    samples: Counter[str]
    worst: tuple[float, ...]
    unsolvable: int


def faults(name: str, count: int, seed: int, engines: Sequence[str] = ENGINES) -> list[str]:
    """Return what differs between batches of the engines and `solve` of files with the numbers of each design."""
    return compared(name, count, seed, engines).faults


def compared(name: str, count: int, seed: int, engines: Sequence[str] = ENGINES, part: slice | None = None) -> Compared:
    """Compare batches of the engines with `solve` of files with the numbers of each design; part: of the designs."""
    mechanism = with_open_lengths(kinfmu.load(name))
    t = np.linspace(mechanism.run.start, mechanism.run.stop, SAMPLES)
    places = range(count)[part or slice(None)]
    values = {key: array[places.start : places.stop] for key, array in drawn(mechanism, count, seed).items()}
    found, samples, worst, unsolvable = [], Counter[str](), np.zeros(3), 0
    with _failures_planned_once():
        batches = {engine: kinfmu.compile(mechanism, engine=engine).solve_designs(values, t) for engine in engines}
        for k, place in enumerate(places):
            design = {key: float(array[k]) for key, array in values.items()}
            runs: dict[str, Run | None] = {}
            for engine in ("python", "native") if "native" in engines and place < FILES_IN_C else ("python",):
                try:
                    file = continued(mechanism, design).mechanism
                    runs[engine] = kinfmu.compile(file, parameters=(), engine=engine).solve(t)
                except KinfmuError:  # or there is no such file: the root of a negative number
                    runs[engine] = None
            run = runs["python"]
            samples.update(Status(status).name.lower() for status in ([] if run is None else run.status.tolist()))
            unsolvable += run is None
            for engine, designs in batches.items():
                for of_file, wanted in runs.items():
                    apart, differences = _differences(designs, k, wanted)
                    worst = np.maximum(worst, apart)
                    where = f"{name}, seed {seed}, design {place}, {engine}, file {of_file}"
                    found += [f"{where}: {fault}" for fault in differences]
    return Compared(found, samples, tuple(worst.tolist()), unsolvable)


@contextmanager
def _failures_planned_once() -> Iterator[None]:
    """Plan a mechanism that does not close once: batches of both engines and the file plan the very same one."""
    failures: dict[Mechanism, KinfmuError] = {}
    plan = model.compile_plan

    def once(mechanism: Mechanism, *arguments: Any) -> SolvePlan:
        if mechanism in failures:
            raise failures[mechanism]
        try:
            return plan(mechanism, *arguments)
        except KinfmuError as error:
            failures[mechanism] = error
            raise

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model, "compile_plan", once)
        yield


def _differences(designs: Designs, k: int, run: Run | None) -> tuple[np.ndarray, list[str]]:
    """Return the differences of a design from the run of its file, as `differences`; None: it cannot be solved."""
    if run is None:
        return np.zeros(3), ["its file cannot be solved, but the design is"] if designs.good[k].any() else []
    tables = [table if table is None else table[k] for table in (designs.values, designs.rates, designs.accelerations)]
    return differences(designs.outputs, designs.status[k], tables, run)


def differences(
    outputs: Sequence[CoordinateName], status: np.ndarray, tables: Sequence[np.ndarray | None], run: Run
) -> tuple[np.ndarray, list[str]]:
    """Return the largest differences (3,) from the run of a file, and those that are too large, in words.

    tables: Values, rates and accelerations of the outputs.
    """
    worst = np.zeros(3)
    if (status != run.status).any():
        sample = int(np.flatnonzero(status != run.status)[0])
        return worst, [f"status {status[sample]} at sample {sample}, of its file {run.status[sample]}"]
    found = []
    for order, table in enumerate(tables):
        if table is None or not run.good.any():
            continue
        wanted = np.column_stack([_column(run, output, order) for output in outputs])
        size = np.maximum(np.nanmax(np.abs(wanted), axis=0), 1.0)
        is_equal = (table == wanted) | (np.isnan(table) & np.isnan(wanted))
        apart = np.where(is_equal, 0.0, np.abs(table - wanted) / size)
        apart[np.isnan(apart)] = np.inf  # a number in one of them alone
        worst[order] = apart.max()
        if worst[order] > CLOSE[order]:
            row, column = np.unravel_index(int(apart.argmax()), apart.shape)
            output = outputs[column].derivative(order)
            found.append(f"{output} differs by {worst[order]:.1e} at sample {row} of status {run.status[row]}")
    return worst, found


def _column(run: Run, output: CoordinateName, order: int) -> np.ndarray:
    """Return the column of an output, or of its rate or acceleration; one that the file's numbers fix is constant."""
    if output in run.outputs:
        return np.asarray((run.values, run.rates, run.accelerations)[order][:, run.outputs.index(output)])
    return np.where(run.good, 0.0 if order else run.fixed[output], np.nan)


def main() -> int:
    """Compare random designs of the gallery; 1 if anything differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.stress.designs", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="designs of each mechanism; 1000")
    parser.add_argument("--seed", type=int, default=0, help="of the designs; 0")
    parser.add_argument("names", nargs="*", help="mechanisms of the gallery; all")
    parser.add_argument("--jobs", type=int, default=cores(), help="processes; as many as cores")
    parser.add_argument("--results", type=Path, help="file of the mechanisms that are done, which are skipped")
    given = parser.parse_args()
    results = given.results.read_text().splitlines() if given.results and given.results.exists() else []
    done = [json.loads(line) for line in results]
    wrong = 0
    with processes(given.jobs, gc.disable) as pool:
        for name in given.names or names():
            asked = {"name": name, "count": given.count, "seed": given.seed}
            known = [result for result in done if asked.items() <= result.items()]
            begun = time.monotonic()
            if known:
                line, found = known[-1]["line"], known[-1]["differences"]
            else:
                found, line = _in_parts(pool, name, given.count, given.seed)
                line = f"{line}; {time.monotonic() - begun:.0f} s"
                if given.results:
                    with given.results.open("a") as file:
                        file.write(json.dumps({**asked, "line": line, "differences": found}) + "\n")
            print(line, *found, sep="\n  ", flush=True)
            wrong += len(found)
    return 1 if wrong else 0


def _in_parts(pool: Executor, name: str, count: int, seed: int) -> tuple[list[str], str]:
    """Compare the designs of a mechanism in parts; return what differs, and a line about all of them."""
    kinfmu.compile(with_open_lengths(kinfmu.load(name)), engine="native")  # once, for the cache of libraries
    with without_main():
        waiting = [pool.submit(_part, name, count, seed, slice(k, k + PART)) for k in range(0, count, PART)]
    whole = [future.result() for future in waiting]
    found = [fault for one in whole for fault in one.faults]
    samples = sum((one.samples for one in whole), Counter[str]())
    values, rates, accelerations = np.max([one.worst for one in whole], axis=0)
    statuses = ", ".join(f"{number} {status}" for status, number in samples.most_common())
    return found, (
        f"{name}: {count} designs, {len(found)} differences; {sum(one.unsolvable for one in whole)} files without "
        f"solution; samples: {statuses}; largest difference: {values:.1e}, {rates:.1e}, {accelerations:.1e}"
    )


def _part(name: str, count: int, seed: int, part: slice) -> Compared:
    """Compare a part of the designs; garbage is collected once, after it, which saves up to half of the time."""
    try:
        return compared(name, count, seed, part=part)
    finally:
        gc.collect()


if __name__ == "__main__":
    from tests.stress.designs import main as main_of_module  # whose functions the workers find

    sys.exit(main_of_module())
