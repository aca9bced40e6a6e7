"""A guard against a module that pythonfmu frees too early. Travels inside the FMU: standard library only."""

from __future__ import annotations

import ctypes
from typing import Any


def hold(namespace: dict[str, Any]) -> None:
    """Take a reference to a module's namespace for good.

    pythonfmu 0.7 runs the slave's module once an instance and each time releases a reference to its namespace that it
    does not own: without this, the third instance of a process finds the namespace freed and crashes.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(namespace))
