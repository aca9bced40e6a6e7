"""Sweeps: `solve` at many samples, by the Python or the native engine."""

from __future__ import annotations

from kinfmu.sweep.designs import Designs
from kinfmu.sweep.driving import run_times
from kinfmu.sweep.model import Model, compile  # noqa: A004  as re.compile
from kinfmu.sweep.sensitivities import Sensitivities
from kinfmu.sweep.solve import solve

__all__ = ["Designs", "Model", "Sensitivities", "compile", "run_times", "solve"]
