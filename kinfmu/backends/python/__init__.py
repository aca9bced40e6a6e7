"""Python source from the plan, and a loaded model from the source."""

from __future__ import annotations

from kinfmu.backends.python.emit import emit
from kinfmu.backends.python.load import load_model, load_module

__all__ = ["emit", "load_model", "load_module"]
