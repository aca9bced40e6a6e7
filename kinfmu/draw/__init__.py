"""Figures for paper and pages: of a mechanism, of a run's coordinates, of a run as it moves.

By matplotlib and Pillow, which load when one is drawn.
"""

from __future__ import annotations

from kinfmu.draw.animation import animate
from kinfmu.draw.drawing import figure
from kinfmu.draw.plots import plot

__all__ = ["animate", "figure", "plot"]
