"""Sweeps side by side: an optional accelerator, which solves many samples at once in the lanes of vector registers."""

from __future__ import annotations

from kinfmu.simd.lanes import sources

__all__ = ["sources"]
