"""The report of `check`: mobility, redundancy, drivers, plan, loops, ranges, assemblies, the matrices of the method."""

from kinfmu import lazy

__all__, __getattr__, __dir__ = lazy.names(globals())
