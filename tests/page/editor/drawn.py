"""Drawings made by operations only, as the page sends them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kinfmu.page.editor import Drawing, changed, new_text

Operation = dict[str, Any]


def empty() -> Drawing:
    """Return a drawing with nothing on it."""
    return Drawing.of(new_text("drawn"), Path())


def drawn(*operations: Operation, begin: Drawing | None = None) -> Drawing:
    """Return a drawing after operations, one request each."""
    drawing = begin or empty()
    for operation in operations:
        drawing = changed(drawing, [operation])
    return drawing


def ground(*at: float) -> Operation:
    return {"do": "ground", "at": {"at": list(at)}}


def target(place: Any) -> Operation:
    """Return a target: of a point 'body.P', of a free place (x, y), or of a place (x, y) on a body."""
    if isinstance(place, str):
        return {"point": place}
    if isinstance(place[0], str):
        return {"body": place[0], "at": list(place[1:])}
    return {"at": list(place)}


def bar(begin: Any, end: Any, body: str = "") -> Operation:
    return {"do": "bar", "from": target(begin), "to": target(end)} | ({"body": body} if body else {})


def put(*place: str, value: Any) -> Operation:
    return {"do": "set", "place": list(place), "value": value}


def interest(point: str, name: str) -> Operation:
    return {"do": "interest", "at": {"point": point}, "name": name}


FOURBAR = (
    ground(0, 0),
    ground(100, 0),
    bar("ground.A", (0, 40), "crank"),
    bar("crank.C", (120, 80), "coupler"),
    bar("coupler.D", "ground.B", "rocker"),
    {"do": "motor", "body": "crank"},
)
