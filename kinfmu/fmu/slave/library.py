"""What pythonfmu 0.7's library leaves behind in the process of a host, put right from Python.

For each instance the library runs the slave's module once more. It keeps lists of the bases of each class that the code
binds, and the string that it puts into `sys.path`. So that module binds no class, and calls `hold`.
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

_CLASS = ""  # the name that the library takes the class by, if the code binds none


def hold(namespace: dict[str, Any], slave: type) -> None:
    """Give the library the class of the slave; keep the module's namespace, and free the path that it leaves.

    The library releases a reference to the namespace that it does not own: without this, the third instance of a
    process would find it freed and crash. It puts the resources first in `sys.path`, once more for each instance.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(namespace))
    is_imported = _CLASS in namespace  # by an earlier instance: else Python's import system refers to the path
    namespace[_CLASS] = slave
    path = sys.path[0]
    with suppress(OSError):
        if Path(path, "slavemodule.txt").read_text("utf-8") == namespace["__name__"]:
            del sys.path[0]
            _finalize_at_exit(Path(path).parent / "binaries/linux64")
            unshared = f"{path}/"
            if is_imported and sys.getrefcount(path) > sys.getrefcount(unshared):
                ctypes.pythonapi.Py_DecRef(ctypes.py_object(path))


@cache
def _finalize_at_exit(folder: Path) -> None:
    """Let the library free its state of Python before the process ends: on Linux it would free it twice then."""
    if sys.platform == "linux":
        for path in folder.glob("*.so"):
            with suppress(OSError):
                library = ctypes.CDLL(str(path), os.RTLD_NOLOAD | os.RTLD_LAZY)  # which stays loaded in any case
                atexit.register(library.finalizePythonInterpreter)
