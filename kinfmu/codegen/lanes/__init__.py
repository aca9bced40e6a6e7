"""Sweep of many samples at once in the lanes of vector registers: an optional accelerator of the native engine."""

from __future__ import annotations

from kinfmu.codegen.lanes.lanes import sources

__all__ = ["sources"]
