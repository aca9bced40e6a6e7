"""The slave of a Python FMU, which has a copy of this package: standard library and pythonfmu's base class only."""
