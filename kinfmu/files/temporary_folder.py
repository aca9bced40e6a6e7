"""Temporary folders that no signal leaves behind."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield a folder that is removed at the end, as far as the system lets it be.

    A signal that ends the process in order, as an exception, may come while the folder is removed; it is removed then
    all the same.
    """
    folder = Path(tempfile.mkdtemp(prefix="kinfmu_"))
    try:
        yield folder
    finally:
        try:
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
