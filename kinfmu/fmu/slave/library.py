"""What pythonfmu 0.7's library leaves behind in the process of a host, put right from Python.

For each instance the library runs the slave's module once more, and keeps the classes that it finds there: that module
imports one class, and calls `hold`.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any


def hold(namespace: dict[str, Any]) -> None:
    """Take a permanent reference to a module's namespace, and the resources of the FMU out of `sys.path`.

    The library releases a reference to the namespace that it does not own: without this, the third instance of a
    process would find it freed and crash. It puts the resources first in `sys.path`, once more for each instance.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(namespace))
    resources = Path(sys.path[0])
    with suppress(OSError):
        if (resources / "slavemodule.txt").read_text("utf-8") == namespace["__name__"]:
            del sys.path[0]
            _finalize_at_exit(resources.parent / "binaries/linux64")


@cache
def _finalize_at_exit(folder: Path) -> None:
    """Let the library free its state of Python before the process ends: on Linux it would free it twice then."""
    if sys.platform == "linux":
        for path in folder.glob("*.so"):
            with suppress(OSError):
                library = ctypes.CDLL(str(path), os.RTLD_NOLOAD | os.RTLD_LAZY)  # which stays loaded in any case
                atexit.register(library.finalizePythonInterpreter)
