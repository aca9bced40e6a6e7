"""How a file's name ends: it alone decides what a file is read as, or written as."""

from __future__ import annotations

from pathlib import PurePath


def suffix_of(path: str | PurePath) -> str:
    """'.mcap' of 'run.mcap' and of 'RUN.MCAP'; '' if a name has no suffix."""
    return PurePath(path).suffix.lower()
