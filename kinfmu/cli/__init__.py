"""The command line, `kinfmu`: `list`, `new`, `check`, `solve`, `fit`, `study` and others.

Importing a file adds its commands to the group `main`.
"""

from kinfmu.cli import build, check, design, export, gallery, play, records, simulate, solve  # noqa: F401  add commands
from kinfmu.cli.group import main

__all__ = ["main"]
