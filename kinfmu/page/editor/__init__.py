"""Drawing a mechanism in the browser: operations that edit the text of its file, with every state kept on disk."""

from __future__ import annotations

from kinfmu.page.editor.answer import answer, sketch, view
from kinfmu.page.editor.drawing import Drawing, new_text
from kinfmu.page.editor.operations import changed
from kinfmu.page.editor.session import Session, StaleState

__all__ = ["Drawing", "Session", "StaleState", "answer", "changed", "new_text", "sketch", "view"]
