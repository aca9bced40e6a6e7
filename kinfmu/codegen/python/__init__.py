"""Python source from the plan, and a loaded model from the source."""

from __future__ import annotations

from kinfmu.codegen.python.emit import emit, load_model, load_module

__all__ = ["emit", "load_model", "load_module"]
