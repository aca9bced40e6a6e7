"""The command line: kinfmu list | new | schema | check | solve | build | simulate | review | bench.

A command a file, which puts itself into the group `main` when it is imported.
"""

from kinfmu.cli import bench, build, check, listing, new, review, schema, simulate, solve
from kinfmu.cli.group import main

__all__ = ["bench", "build", "check", "listing", "main", "new", "review", "schema", "simulate", "solve"]
