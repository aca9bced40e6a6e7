"""Dependent rows by name, mobility, and the rows that stay on watch."""

from __future__ import annotations

from kinfmu.redundancy.redundancy import CONSISTENT, DependentRow, Redundancy, find_redundancy

__all__ = ["CONSISTENT", "DependentRow", "Redundancy", "find_redundancy"]
