"""The hostile suite in short: a trial of each kind, and some more of each part."""

from __future__ import annotations

import pytest

from tests.fuzz import cache, files, logs, mechanisms
from tests.fuzz.parts import PARTS, run
from tests.fuzz.summary import one_of_each

SECONDS = 0.5  # of each part after one trial of each kind; scripts/fuzz goes on for longer
KINDS = {  # of the programs of `fmu`, compiled under sanitizers, see test_fmu.py; `opens` has one kind
    "mechanisms": {mechanisms.kind_of(seed).__name__.strip("_") for seed in range(1000)},
    "files": {files.kind_of(seed).__name__.strip("_") for seed in range(1000)},
    "cache": set(cache.KINDS),
    "logs": set(logs.KINDS),
}


@pytest.mark.parametrize("part", PARTS)
def test_hostile_input_of_each_part_has_no_findings(part: str) -> None:
    summary = run(part, 0, SECONDS)
    assert summary.tried.total() > 0
    assert KINDS.get(part, set()) <= summary.tried.keys()
    assert summary.findings == [], "\n".join(summary.lines())


def test_one_seed_of_each_kind_is_found_from_any_seed_on() -> None:
    for first in (0, 7, 123):
        for part in (mechanisms, files):
            found = [part.kind_of(seed) for seed in one_of_each(first, part.kind_of)]
            assert len(found) == len(set(found)) == len(KINDS[part.__name__.rpartition(".")[2]])
