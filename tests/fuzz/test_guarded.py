"""What the watch over trials lets pass: compilers that builds start, and nothing else."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.fuzz.guarded import ZIG, Watch
from tests.fuzz.hostile_text import CANARY


@pytest.mark.parametrize(
    ("command", "is_seen"),
    [
        (["/usr/bin/cc", "-c", "a.c"], False),
        ([*ZIG, "-target", "wasm32-wasi", "a.c"], False),
        ([*ZIG, f"{CANARY}.c"], True),
        (["/usr/bin/cc", CANARY], True),
        ([sys.executable, "-m", "ziglang", "run"], True),
        ([sys.executable, "-c", "pass"], True),
        (["/bin/sh", "-m", "ziglang", "cc"], True),
    ],
)
def test_only_compilers_without_texts_of_the_input_may_start(command: list[str], is_seen: bool, tmp_path: Path) -> None:
    watch = Watch(tmp_path)
    watch.is_on = True
    watch.hook("subprocess.Popen", (command[0], command, None, None))
    assert bool(watch.seen) == is_seen
