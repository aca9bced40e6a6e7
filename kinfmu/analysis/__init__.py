"""The report of `check`: mobility, redundancy, drivers, plan, loops, ranges, assemblies, the matrices of the method."""

from kinfmu import _lazy

__all__, __getattr__, __dir__ = _lazy(globals())
