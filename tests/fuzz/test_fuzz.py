"""Short forms of the fuzz runs that `scripts/fuzz` makes long."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.fuzz import cache, files, fmu, logs, mechanisms
from tests.fuzz.guarded import Watch
from tests.fuzz.hostile_text import CANARY
from tests.fuzz.summary import PARTS, Summary, run

SECONDS = 0.5  # of each part after one trial of each kind; scripts/fuzz goes on for longer
KINDS = {  # of the programs of `fmu`, compiled under sanitizers, see below; `opens` has one kind
    "mechanisms": {mechanisms.kind_of(seed).__name__.strip("_") for seed in range(1000)},
    "files": {files.kind_of(seed).__name__.strip("_") for seed in range(1000)},
    "cache": set(cache.KINDS),
    "logs": set(logs.KINDS),
}


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.few(1)
def test_hostile_input_of_each_part_has_no_findings(part: str) -> None:
    summary = run(part, 0, SECONDS)
    assert summary.tried.total() > 0
    assert KINDS.get(part, set()) <= summary.tried.keys()
    assert summary.findings == [], "\n".join(summary.lines())


# ------------------------------------------------------------------------------------------------------------------ fmu


TORQUE = [seed for seed, variant in enumerate(fmu.VARIANTS) if variant.drive == "torque"]


@pytest.mark.parametrize(
    "seed",
    [1, 2, *(pytest.param(seed, marks=pytest.mark.long) for seed in TORQUE)],
    ids=lambda seed: str(fmu.VARIANTS[seed]),
)
@pytest.mark.few(1)
def test_no_call_of_fmi_does_harm(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if seed not in TORQUE:  # where single calls are slow: the integrator's steps follow from the numbers given
        monkeypatch.setattr(fmu, "CALLS", 3000)
    summary = Summary("fmu")
    for again in range(3):
        fmu.trial(seed + again * len(fmu.VARIANTS), tmp_path, summary)
    assert summary.tried.total() == 3
    assert summary.findings == [], "\n".join(summary.lines())


# -------------------------------------------------------------------------------------------------------------- guarded


@pytest.mark.parametrize(
    ("command", "is_seen"),
    [
        (["/usr/bin/cc", "-c", "a.c"], False),
        (["/usr/bin/cc", CANARY], True),
        ([sys.executable, "-c", "pass"], True),
    ],
)
def test_only_compilers_without_texts_of_the_input_may_start(command: list[str], is_seen: bool, tmp_path: Path) -> None:
    watch = Watch(tmp_path)
    watch.is_on = True
    watch.hook("subprocess.Popen", (command[0], command, None, None))
    assert bool(watch.seen) == is_seen
