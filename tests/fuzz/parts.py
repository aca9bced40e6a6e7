"""The parts of the hostile suite, each a module with `run(seed, seconds)`, found by name."""

from __future__ import annotations

import importlib
from typing import cast

from tests.fuzz.summary import Summary

PARTS = ("mechanisms", "files", "fmu", "cache", "logs", "opens")


def run(part: str, seed: int, seconds: float) -> Summary:
    """Run one part: trials from `seed` on for about `seconds`, at least one."""
    module = importlib.import_module(f"tests.fuzz.{part}")
    return cast(Summary, module.run(seed, seconds))
