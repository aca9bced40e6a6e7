"""The command line: kinfmu list | new | schema | check | solve | build | simulate | review | export | recover | bench.

A command a file, which puts itself into the group `main` when it is imported.
"""

from kinfmu.cli import bench, build, check, export, listing, new, recover, review, schema, simulate, solve
from kinfmu.cli.group import main

__all__ = [
    "bench",
    "build",
    "check",
    "export",
    "listing",
    "main",
    "new",
    "recover",
    "review",
    "schema",
    "simulate",
    "solve",
]
