"""The command line as `python -m kinfmu`, for when the command `kinfmu` is not on the path."""

from kinfmu.cli import main

if __name__ == "__main__":
    main()
