"""Runs: named columns over samples, their axis, which of them are kept, and what takes a run while it goes on."""

from __future__ import annotations

from kinfmu.run.run import MOST_SAMPLES, Column, Event, FloatArray, IntArray, Run, Sink

__all__ = ["MOST_SAMPLES", "Column", "Event", "FloatArray", "IntArray", "Run", "Sink"]
