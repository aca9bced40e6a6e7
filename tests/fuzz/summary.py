"""What a part of the hostile suite tried and found, and the parts: each a module with `run(seed, seconds)`."""

from __future__ import annotations

import importlib
import itertools
import time
from collections import Counter
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, cast

SEEDS_OF_ALL_KINDS = 100  # among so many seeds in a row, every kind of trial is found


class Finding(NamedTuple):
    """One fault: the seed that repeats it, the kind of trial, and what was seen."""

    seed: int
    kind: str
    text: str


@dataclass
class Summary:
    """Trials counted by kind, and the findings."""

    part: str
    tried: Counter[str] = field(default_factory=Counter)
    findings: list[Finding] = field(default_factory=list)

    def count(self, kind: str, number: int = 1) -> None:
        """Count trials of a kind."""
        self.tried[kind] += number

    def find(self, seed: int, kind: str, text: str) -> None:
        """Keep a finding."""
        self.findings.append(Finding(seed, kind, text))

    def lines(self) -> list[str]:
        """The counts, then each finding with the command that repeats it."""
        counts = ", ".join(f"{count} {kind}" for kind, count in sorted(self.tried.items()))
        found = [
            f"  {one.kind}: {one.text}\n    scripts/fuzz {self.part} --seed {one.seed} --seconds 0"
            for one in self.findings
        ]
        return [f"{self.part}: {self.tried.total()} trials ({counts}), {len(found)} findings", *found]


def seeds(first: int, seconds: float, kind: Callable[[int], Hashable] = lambda _: None) -> Iterator[int]:
    """Seeds from `first` on until `seconds` have passed: one of each kind in any case; only `first` if 0 seconds."""
    if seconds <= 0:
        yield first
        return
    found = one_of_each(first, kind)
    yield from found
    end = time.monotonic() + seconds
    for seed in itertools.count(first):
        if time.monotonic() >= end:
            return
        if seed not in found:
            yield seed


def one_of_each(first: int, kind: Callable[[int], Hashable]) -> tuple[int, ...]:
    """The first seed of each kind, from `first` on."""
    found: dict[Hashable, int] = {}
    for seed in range(first, first + SEEDS_OF_ALL_KINDS):
        found.setdefault(kind(seed), seed)
    return tuple(found.values())


# ---------------------------------------------------------------------------------------------------------------- parts


PARTS = ("mechanisms", "files", "fmu", "cache", "logs", "opens")


def run(part: str, seed: int, seconds: float) -> Summary:
    """Run one part: trials from `seed` on for about `seconds`, at least one."""
    module = importlib.import_module(f"tests.fuzz.{part}")
    return cast(Summary, module.run(seed, seconds))
