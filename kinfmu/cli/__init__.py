"""The command line, `kinfmu`: `list`, `new`, `check`, `solve`, `fit`, `study` and others.

One command per file; importing a file adds its command to the group `main`.
"""

from kinfmu.cli import (  # noqa: F401  for the commands that they add
    build,
    check,
    export,
    fit,
    listing,
    new,
    play,
    recover,
    review,
    schema,
    simulate,
    solve,
    study,
    verify,
)
from kinfmu.cli.group import main

__all__ = ["main"]
