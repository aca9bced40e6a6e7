"""What a run leaves: MCAP as the durable record, Rerun as the picture, tables for everything else.

The writers and readers load their packages (zstandard, rerun, pyarrow) when first used, not on import.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinfmu.log.mcap_file import write_mcap
    from kinfmu.log.mcap_log import McapLog
    from kinfmu.log.reading import read, recover
    from kinfmu.log.table import write_table
    from kinfmu.log.viewer.rerun_file import write_rrd
    from kinfmu.log.viewer.reviewing import review

__all__ = ["McapLog", "read", "recover", "review", "write_mcap", "write_rrd", "write_table"]

_HOME = {
    "McapLog": "mcap_log",
    "read": "reading",
    "recover": "reading",
    "review": "viewer.reviewing",
    "write_mcap": "mcap_file",
    "write_rrd": "viewer.rerun_file",
    "write_table": "table",
}


def __getattr__(name: str) -> Any:
    """A public function, from the module that holds it."""
    if name not in _HOME:
        raise AttributeError(f"module 'kinfmu.log' has no attribute '{name}'")
    found = getattr(import_module(f"kinfmu.log.{_HOME[name]}"), name)
    globals()[name] = found  # from now on without this detour
    return found


def __dir__() -> list[str]:
    return [*globals(), *__all__]
