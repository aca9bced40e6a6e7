"""python -m kinfmu.cli: the command line."""

from kinfmu.cli import main

main()
