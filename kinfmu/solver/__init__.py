"""The solver at run time, in two languages: the same files, functions and decisions in `python/` and in `c/`."""
