"""Pages in which a mechanism is dragged, with what a page alone cannot do: a server, a widget."""

from __future__ import annotations

from kinfmu.page.player.server import PlayServer
from kinfmu.page.player.source import PlaySource
from kinfmu.page.player.widget import play

__all__ = ["PlayServer", "PlaySource", "play"]
