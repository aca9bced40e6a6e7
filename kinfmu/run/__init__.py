"""Runs: named columns over samples, their axis, the columns to keep, the verdict, and sinks, which receive parts."""

from __future__ import annotations

from kinfmu.run.run import MOST_SAMPLES, Event, Run, Sink
from kinfmu.run.tables import Column

__all__ = ["MOST_SAMPLES", "Column", "Event", "Run", "Sink"]
