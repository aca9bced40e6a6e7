"""The methods by which notebooks ask a value for its picture and its table."""

from __future__ import annotations

import sys
from functools import singledispatch
from importlib import import_module
from typing import Any

from kinfmu.display.html import escaped

_MAKERS = "kinfmu.notebook"  # by name: it knows the classes, which know only this package


@singledispatch
def html_of(value: object) -> str | None:
    """Return a value as HTML; `kinfmu.notebook` registers a function for each class. None: as text."""
    del value
    return None


@singledispatch
def svg_of(value: object) -> str | None:
    """Return the picture of a value as SVG, registered like `html_of`. None: there is no picture."""
    del value
    return None


@singledispatch
def widget_of(value: object) -> Any:
    """Return a value as a widget of notebooks, registered like `html_of`. None: there is none."""
    del value
    return None


class Displayed:
    """A value that shows itself in notebooks, which call these methods of a cell's result.

    No method raises an error: the text in its place states the reason.
    """

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        try:
            import_module(_MAKERS)
            return html_of(self)
        except Exception as error:
            return f"<pre>{escaped(repr(self))}\ncannot be shown: {escaped(_reason(error))}</pre>"

    def _repr_svg_(self) -> str | None:
        try:
            import_module(_MAKERS)
            return svg_of(self)
        except Exception:
            return None  # the HTML states the reason


class Live(Displayed):
    """A value that notebooks show as a widget; where none can be made, as its picture and table."""

    __slots__ = ()

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> Any:
        """Return the widget for Jupyter; None in a terminal, which asks as well."""
        shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
        widget = _widget(self) if getattr(shell, "kernel", None) is not None else None
        return None if widget is None else widget._repr_mimebundle_(include=include, exclude=exclude)

    def _display_(self) -> Any:
        """Return what marimo shows."""
        widget = _widget(self)
        return sys.modules["marimo"].Html(self._repr_html_() or "") if widget is None else widget


def _widget(value: object) -> Any:
    try:
        import_module(_MAKERS)
        return widget_of(value)
    except Exception:
        return None  # the HTML states what is wrong with the value


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__
