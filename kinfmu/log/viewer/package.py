"""The package of the Rerun viewer, which is an extra of kinfmu."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from kinfmu.errors import MissingPackageError

INSTALL = "pip install 'kinfmu[viewer]'"


def has_viewer() -> bool:
    """Return True if the viewer is installed; it is not loaded."""
    try:
        return find_spec("rerun") is not None
    except ValueError:  # a module without a specification, or None in its place
        return False


def require_viewer(what: str) -> None:
    """Raise a MissingPackageError if the viewer is not installed; what: what needs it, as 'run.rrd: a recording'."""
    if not has_viewer():
        raise MissingPackageError(f"{what} needs the Rerun viewer: {INSTALL}")


@contextmanager
def without_pandas() -> Iterator[None]:
    """Keep pyarrow from importing pandas in this block: it asks of each list of Rerun whether it is a series of pandas.

    The import takes longer than writing a recording. For commands only: afterwards pyarrow takes a series for a list.
    """
    sys.meta_path.insert(0, _NoPandas)
    try:
        yield
    finally:
        sys.meta_path.remove(_NoPandas)


class _NoPandas:
    @staticmethod
    def find_spec(name: str, *_: object) -> None:
        if name == "pandas":
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
