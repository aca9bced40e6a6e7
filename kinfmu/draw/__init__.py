"""Figures of a mechanism, for paper and for the gallery: SVG and PNG by matplotlib, which loads when one is drawn."""

from __future__ import annotations

from kinfmu.draw.drawing import figure

__all__ = ["figure"]
