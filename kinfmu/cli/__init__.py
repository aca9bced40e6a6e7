"""The command line, `kinfmu`: `list`, `new`, `check`, `solve`, `fit`, `study` and others.

Importing a file adds its commands to the group `main`.
"""

from kinfmu.cli import (  # noqa: F401  add commands
    build,
    check,
    design,
    export,
    gallery,
    imports,
    play,
    records,
    report,
    simulate,
    solve,
)
from kinfmu.cli.group import main

__all__ = ["main"]
