"""Run time in Python: advance along the branch, Newton, bridges over singular points. Standard library only.

This package is copied into the Python FMU as it is.
"""
