"""C source from the plan: the model of a mechanism, and the run time that is the same for every mechanism."""

from __future__ import annotations

from kinfmu.codegen.c.model import emit

__all__ = ["emit"]
