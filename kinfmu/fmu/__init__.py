"""FMUs: one list of variables, the archive built from it, and the loop that steps one."""

from __future__ import annotations

from kinfmu.fmu.build import build
from kinfmu.fmu.host.simulate import simulate
from kinfmu.fmu.verify import verify

__all__ = ["build", "simulate", "verify"]
