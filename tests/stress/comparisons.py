"""Mechanisms compared with an oracle by several processes, for the modules of this folder that are commands."""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

CHUNK = 5  # mechanisms that a process takes at a time
PROGRESS_EVERY = 50  # mechanisms


class Comparison(Protocol):
    """What a comparison of one mechanism found."""

    seed: int
    family: str
    faults: list[str]


Found = TypeVar("Found", bound=Comparison)


def command_line(description: str, count: int) -> argparse.ArgumentParser:
    """Return the options that these commands share; count: mechanisms by default."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--count", type=int, default=count, help=f"mechanisms; {count}")
    parser.add_argument("--seed", type=int, default=0, help="of the first mechanism; 0")
    parser.add_argument("--family", help="one family alone")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes; one a core")
    return parser


def all_compared(compare: Callable[[Any], Found], tasks: Sequence[Any], jobs: int) -> list[Found]:
    """Return the comparisons of all tasks; faults are printed as they are found."""
    begun = time.monotonic()
    found: list[Found] = []
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        for one in pool.imap_unordered(compare, tasks, CHUNK):
            found.append(one)
            for fault in one.faults:
                print(f"seed {one.seed}, {one.family}: {fault}", flush=True)
            if len(found) % PROGRESS_EVERY == 0:
                print(f"{len(found)} of {len(tasks)}, {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
    return found
