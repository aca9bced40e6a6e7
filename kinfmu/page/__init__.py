"""A mechanism as a page of a browser, which moves it with the C of its native FMU, compiled to WebAssembly."""

from __future__ import annotations

from kinfmu.page.html import page

__all__ = ["page"]
