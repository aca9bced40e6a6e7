"""python -m kinfmu.cli: the command line."""

from kinfmu.cli import main

if __name__ == "__main__":
    main()
