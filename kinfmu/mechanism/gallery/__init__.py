"""The gallery: mechanisms that come with kinfmu; loading and saving mechanisms."""

from __future__ import annotations

from kinfmu.mechanism.gallery.load import folder, has, load, names, save

__all__ = ["folder", "has", "load", "names", "save"]
