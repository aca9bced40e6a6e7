"""Model descriptions of FMI 2.0 and 3.0, written and read."""

from __future__ import annotations

from kinfmu.fmu.description.description import Description, FmiVersion, read, write

__all__ = ["Description", "FmiVersion", "read", "write"]
