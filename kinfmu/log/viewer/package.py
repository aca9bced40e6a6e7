"""The package of the Rerun viewer, which is an extra of kinfmu."""

from __future__ import annotations

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
