"""C source from a plan: the model of a mechanism, with the run time common to all mechanisms."""

from __future__ import annotations

from kinfmu.codegen.c.model import emit

__all__ = ["emit"]
