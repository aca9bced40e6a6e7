"""Figures for reports and web pages: of a mechanism, of a run's coordinates and their jerk, of a moving run.

matplotlib and Pillow draw them; they are loaded when first used.
"""

from kinfmu import _lazy

__all__, __getattr__, __dir__ = _lazy(globals())
