"""The stress suite at length: `python -m tests.stress`, or scripts/stress."""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import sys
import tempfile
import time
from typing import Literal

from kinfmu.mechanism.toml_text import text
from tests.stress.families import FAMILIES
from tests.stress.report import Report, details
from tests.stress.trial import judged, trial

CHUNK = 10  # trials that a process gets at a time
COUNTS = {"python": 10_000, "native": 300}  # mechanisms; a compiler takes its time with each
PROGRESS_INTERVAL = 5.0  # [s] between two lines of progress


def main() -> int:
    """Try random mechanisms and print what is found; 1 if anything is wrong."""
    parser = argparse.ArgumentParser(
        prog="scripts/stress",
        description="Random mechanisms over random steps, against closed forms of 50 digits; a seed is a mechanism.",
        epilog=f"Families: {', '.join(FAMILIES)}.",
    )
    parser.add_argument("--count", type=int, help="mechanisms, or 1 with --seed alone, which shows every sample")
    parser.add_argument("--seed", type=int, help="of the first mechanism, the others count on from it; 0")
    parser.add_argument("--family", choices=list(FAMILIES), metavar="NAME", help="one family alone")
    parser.add_argument("--engine", choices=list(COUNTS), default="python", help="python by default")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes; one a core")
    given = parser.parse_args()
    if given.count is None:
        given.count = COUNTS[given.engine] if given.seed is None else 1
    first = given.seed or 0
    with tempfile.TemporaryDirectory() as compiled:
        os.environ["KINFMU_CACHE"] = compiled
        if given.count == 1:
            return _one(first, given.family, given.engine)
        return _many(range(first, first + given.count), given.family, given.engine, given.jobs)


def _one(seed: int, family: str | None, engine: Literal["python", "native"]) -> int:
    one = trial(seed, family, engine)
    verdict = one.judged()
    print(text(one.drawn.mechanism))
    print("\n".join(details(verdict, one.inputs[0].tolist())))
    return 1 if verdict.faults else 0


def _many(seeds: range, family: str | None, engine: Literal["python", "native"], jobs: int) -> int:
    begun = printed = time.monotonic()
    report = Report()
    tasks = [(seed, family, engine) for seed in seeds]
    with multiprocessing.get_context("spawn").Pool(jobs, signal.signal, (signal.SIGINT, signal.SIG_IGN)) as pool:
        try:
            for verdict in pool.imap_unordered(judged, tasks, CHUNK):
                report.take(verdict)
                if time.monotonic() - printed > PROGRESS_INTERVAL:
                    printed = time.monotonic()
                    done = report.mechanisms.total()
                    print(f"{done} of {len(tasks)}, {printed - begun:.0f} s", end="\r", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one would take the report
            print("interrupted: what was found so far\n")
    command = "scripts/stress" + (f" --family '{family}'" if family else "")
    command += f" --engine {engine}" if engine != "python" else ""
    print("\n".join(report.lines(command)))
    print(f"\n{report.mechanisms.total()} mechanisms in {time.monotonic() - begun:.0f} s on {jobs} processes", end="; ")
    print("nothing is wrong" if report.is_right else f"{report.faulty.total()} are at fault")
    return 0 if report.is_right else 1


if __name__ == "__main__":
    sys.exit(main())
