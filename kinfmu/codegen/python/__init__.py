"""Python source from the plan, and a loaded model from the source."""

from __future__ import annotations

from kinfmu.codegen.python.emit import emit
from kinfmu.codegen.python.load import load_model, load_module

__all__ = ["emit", "load_model", "load_module"]
