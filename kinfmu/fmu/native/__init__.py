"""The native flavour: FMUs of generated C, which need no Python."""

from __future__ import annotations

from kinfmu.fmu.native.archive import archive

__all__ = ["archive"]
