"""Figures for reports and web pages: of a mechanism, of a run's coordinates and their jerk, of a moving run.

matplotlib and Pillow draw them; they are loaded when first used.
"""

from __future__ import annotations

from kinfmu.draw.animation import animate
from kinfmu.draw.cam import cam
from kinfmu.draw.drawing import figure
from kinfmu.draw.dxf import dxf
from kinfmu.draw.plots import plot
from kinfmu.draw.svaj import svaj

__all__ = ["animate", "cam", "dxf", "figure", "plot", "svaj"]
