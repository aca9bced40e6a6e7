"""Sketches of mechanisms as DXF drawings: a layer is a body, points in the same place on two layers are a pin.

The layers `ground` and `0` are fixed. A line on the layer `slot` is a slot of the ground, one on `slot_NAME` a slot of
the body NAME; what has a point on it slides along it. A drawing has no drivers: the shortest link on the ground, or one
with a name such as `crank`, gets one.
"""

from __future__ import annotations

import io
import logging
import math
import re
from collections.abc import Iterator
from importlib import import_module
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError, MissingPackageError, some
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.imports.sketch import Sketch
from kinfmu.mechanism.valid import check_number

DXF_UNITS = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "um": 13}  # $INSUNITS
_BEGIN = re.compile(r"(?:999[ \t]*\r?\n[^\n]*\n\s*)*0[ \t]*\r?\n[ \t]*SECTION\b")
_NEAR = 1e-6  # of the extent of the drawing; points that are closer are one
_MOST_CORNERS = 20  # of a polyline; one with more is an outline
_MOST_ENTITIES = 5000
_FIXED = ("0", GROUND_NAME)  # layers, in small letters
_SLOT = "slot"
_DRIVEN = ("crank", "input", "motor", "drive")  # beginnings of names
_SPEED = 60.0  # [rpm]
_FAILURES = (ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RecursionError, AssertionError)


class DxfSlot(NamedTuple):
    """A line on a layer of slots: the layer of its body, '' for the ground, and its ends."""

    carrier: str
    ends: tuple[tuple[float, float], tuple[float, float]]


def imported_ezdxf(where: object) -> Any:
    """Return the package ezdxf; MissingPackageError about `where` if it is not installed."""
    try:
        return import_module("ezdxf")
    except ImportError:
        raise MissingPackageError(f"{where}: a DXF file needs ezdxf: pip install 'kinfmu[dxf]'") from None


def is_dxf(content: str) -> bool:
    """Return whether a text is a DXF drawing."""
    return bool(_BEGIN.match(content))


def sketch_of_dxf(content: str, name: str) -> Sketch:
    """Return a drawing; name: of the mechanism."""
    ezdxf = imported_ezdxf(name or "the drawing")
    logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # else warnings with texts of the file go to stderr
    try:
        drawing = ezdxf.read(io.StringIO(content.replace("\r\n", "\n") + "\n"))
        code = drawing.header.get("$INSUNITS", 0)
        layers, slots, notes = _geometry(drawing)
    except (ezdxf.DXFError, *_FAILURES) as error:
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise MechanismError(f"is not a valid DXF drawing: {reason}") from None
    unit = next((unit for unit, number in DXF_UNITS.items() if number == code), "mm")
    sketch = Sketch("a DXF drawing", name or "sketch", unit)
    sketch.notes += notes
    if DXF_UNITS[unit] != code:
        sketch.notes.append(f"the drawing has no unit of length that is known ($INSUNITS = {code}): mm")
    _add_links(sketch, layers)
    places = [point for slot in slots for point in slot.ends] + [pin[1:] for pin in sketch.pins.values()]
    for layer in (slot.carrier for slot in slots if slot.carrier not in ("", *layers)):
        raise MechanismError(f"layer slot_{layer}: there is no layer {layer!r}")
    sketch.settle()
    for number, slot in enumerate(slots, start=1):
        _add_slot(sketch, slot, number, _NEAR * _extent(places))
    _add_drivers(sketch)
    return sketch


def _geometry(drawing: Any) -> tuple[dict[str, list[tuple[float, float]]], list[DxfSlot], list[str]]:
    """Return the points by layer, the slots, and notes on what is left out."""
    hidden = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_off() or layer.is_frozen()}
    layers: dict[str, list[tuple[float, float]]] = {}
    slots: list[DxfSlot] = []
    left: dict[str, int] = {}
    spelled: dict[str, str] = {}
    for count, entity in enumerate(drawing.modelspace()):
        if count >= _MOST_ENTITIES:
            raise MechanismError(f"has more than {_MOST_ENTITIES} elements, the most that are imported")
        kind = entity.dxftype()
        layer = spelled.setdefault(entity.dxf.layer.lower(), entity.dxf.layer)
        points = [] if layer.lower() in hidden else list(_points(entity, kind))
        if not points or len(points) > _MOST_CORNERS:
            what = "elements of hidden layers" if layer.lower() in hidden else kind
            left[what] = left.get(what, 0) + 1
            continue
        before, _, owner = layer.partition("_")
        if before.lower() == _SLOT and kind == "LINE":
            slots.append(DxfSlot(spelled.get(owner.lower(), owner), (points[0], points[1])))
        else:
            layers.setdefault(layer, []).extend(points)
    slots = [slot._replace(carrier=spelled.get(slot.carrier.lower(), slot.carrier)) for slot in slots]
    return layers, slots, [f"left out: {some(f'{number} {what}' for what, number in left.items())}"] if left else []


def _points(entity: Any, kind: str) -> Iterator[tuple[float, float]]:
    """Yield the points of an element in the world: ends, corners, centres."""
    if kind == "LINE":
        points = [entity.dxf.start, entity.dxf.end]
    elif kind == "CIRCLE":
        points = [entity.ocs().to_wcs(entity.dxf.center)]
    elif kind == "POINT":
        points = [entity.dxf.location]
    elif kind == "LWPOLYLINE":
        points = list(entity.vertices_in_wcs())
    elif kind == "POLYLINE":
        points = list(entity.points_in_wcs())
    else:
        points = []
    for point in points:
        for axis in ("x", "y"):
            check_number(f"{kind} on layer {entity.dxf.layer!r}: {axis}", getattr(point, axis))
        yield float(point.x), float(point.y)


def _add_links(sketch: Sketch, layers: dict[str, list[tuple[float, float]]]) -> None:
    """Make links of layers, and pins of their points; points in the same place are one pin."""
    fixed = [layer for layer in layers if layer.lower() in _FIXED]
    moving = [layer for layer in layers if layer.lower() not in _FIXED]
    if not fixed or not moving:
        missing = (
            f"layers that move next to {some(fixed)}" if fixed else "a layer 'ground' (or '0') with the fixed points"
        )
        raise MechanismError(f"needs {missing}; each layer is a body")
    if "0" in fixed:
        sketch.notes.append("layer 0 is part of the ground")
    near = _NEAR * _extent([point for points in layers.values() for point in points])
    cells: dict[tuple[int, int], list[str]] = {}
    for layer in (*fixed, *moving):
        pins = [_pin_at(sketch, cells, point, near) for point in layers[layer]]
        if layer in moving:
            sketch.link(layer, layer, pins)
        else:
            for pin in pins:
                sketch.hold(GROUND_NAME, pin)


def _pin_at(sketch: Sketch, cells: dict[tuple[int, int], list[str]], point: tuple[float, float], near: float) -> str:
    """Return the pin in a place, a new one if there is none; cells: the pins by squares of the plane."""
    x, y = point
    column, row = (math.floor(value / near) if near else 0 for value in point)
    for place in ((column + i, row + j) for i in (0, -1, 1) for j in (0, -1, 1)):
        for key in cells.get(place, []):
            pin = sketch.pins[key]
            if math.hypot(pin.x - x, pin.y - y) <= near:
                return key
    key = f"P{len(sketch.pins) + 1}"
    sketch.pin(key, key, x, y)
    cells.setdefault((column, row), []).append(key)
    return key


def _add_slot(sketch: Sketch, slot: DxfSlot, number: int, near: float) -> None:
    """Let all that has a pin on a slot slide along it."""
    carrier = sketch.body(slot.carrier) if slot.carrier and slot.carrier.lower() not in _FIXED else GROUND_NAME
    (a_x, a_y), (b_x, b_y) = slot.ends
    length = math.hypot(b_x - a_x, b_y - a_y)
    if not length:
        sketch.notes.append(f"slot {number} has no length: left out")
        return
    along_x, along_y = (b_x - a_x) / length, (b_y - a_y) / length
    sliding = []
    for key, pin in list(sketch.pins.items()):
        x, y = pin.x - a_x, pin.y - a_y
        is_on = abs(along_x * y - along_y * x) <= near and -near <= along_x * x + along_y * y <= length + near
        bodies = sketch.bodies_at(key)
        if is_on and bodies and carrier not in bodies:
            between = [sketch.at(carrier, key), sketch.at(bodies[0], key)]
            axis = math.atan2(along_y, along_x)
            sketch.add("joints", f"slot_{pin.name}", type="point_on_line", between=between, axis=axis)
            sliding.append(f"{bodies[0]}.{pin.name}")
    sketch.notes.append(f"slot {number} on {carrier} holds {some(sliding)}")


def _add_drivers(sketch: Sketch) -> None:
    """Drive links that are pinned to the ground, as many as the mechanism has degrees of freedom."""
    cranks: dict[str, tuple[bool, float]] = {}
    for key in sketch.pins:
        first, *others = sketch.bodies_at(key) or [""]
        for body in others if first == GROUND_NAME else ():
            cranks.setdefault(body, (not body.lower().startswith(_DRIVEN), sketch.reach(body, key)))
    for body in sorted(cranks, key=lambda body: cranks[body])[: max(sketch.mobility(), 1)]:
        sketch.turn(_SPEED, GROUND_NAME, body)
        sketch.notes.append(f"{body} is driven at {_SPEED:g} rpm: a drawing has no drivers")


def _extent(points: list[tuple[float, float]]) -> float:
    """Return the larger side of the rectangle around points."""
    return max((max(values) - min(values) for values in zip(*points, strict=True)), default=0.0)
