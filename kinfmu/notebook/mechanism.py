"""A mechanism: its drawing, and a table of its parts and its mobility."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from importlib.util import find_spec
from typing import Any

from kinfmu.display import html_of, page, svg_of, table, widget_of
from kinfmu.draw.drawing import sheet_of
from kinfmu.draw.instant import instant
from kinfmu.draw.writing import svg_text
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.notebook.picture import picture, some
from kinfmu.plan import localized, plan_from
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.system import System

_LARGEST = 300  # coordinates; mobility and plan of larger mechanisms take seconds
_KEPT = 8  # drawings


@html_of.register
def mechanism_html(mechanism: Mechanism) -> str:
    """Return the drawing of a mechanism, or the reason why there is none, and the table of its parts."""
    title = f"{mechanism.name}: {mechanism.title}" if mechanism.title else mechanism.name
    return page(title, picture(lambda: drawing(mechanism), f"Drawing of {title}"), table(_parts(mechanism)))


@svg_of.register
def drawing(mechanism: Mechanism) -> str:
    """Return the drawing of a mechanism as SVG.

    Raises:
        MissingPackageError: matplotlib is not installed.
        AssemblyError: The mechanism does not close.

    """
    return _drawing(mechanism)


@widget_of.register
def live(mechanism: Mechanism) -> Any:
    """Return the live mechanism; None without anywidget and ziglang, and for large ones, whose page takes long."""
    if len(mechanism.coordinate_names) > _LARGEST or not (find_spec("anywidget") and find_spec("ziglang")):
        return None
    from kinfmu.page.player import play

    return play(mechanism)


@lru_cache(maxsize=_KEPT)
def _drawing(mechanism: Mechanism) -> str:
    return svg_text("this picture", lambda: sheet_of(instant(mechanism)).figure)


def _parts(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Yield what is counted, and its names."""
    yield "moving bodies", f"{len(mechanism.moving_bodies)}: {some([body.name for body in mechanism.moving_bodies])}"
    kinds: dict[str, list[str]] = {}
    for joint in mechanism.joints:
        kinds.setdefault(joint.type, []).append(joint.name)
    yield "joints", "\n".join(f"{len(names)} {kind}: {some(names)}" for kind, names in kinds.items()) or "0"
    drivers = [f"{driver.name}: {driver.type}, {driver.law.type}" for driver in mechanism.drivers]
    yield "drivers", "\n".join(drivers) or "0"
    if mechanism.points:
        yield "points of interest", some([f"{name} = {point}" for name, point in mechanism.points.items()])
    if mechanism.parameters:
        values = [f"{name} = {parameter.value:.6g}" for name, parameter in mechanism.parameters.items()]
        yield "parameters", some(values)
    yield "unit of length", mechanism.length_unit
    if len(mechanism.coordinate_names) <= _LARGEST:
        yield from _mobility(mechanism)


def _mobility(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """Yield the mobility, redundant joints, and the problem that prevents solving."""
    local, origin = localized(mechanism)
    system = System(local)
    redundancy = find_redundancy(system)
    yield "mobility", str(redundancy.mobility)
    if redundancy.redundant:
        yield "redundant", ", ".join(dict.fromkeys(row.row.owner for row in redundancy.redundant))
    try:
        plan_from(mechanism, system, origin, redundancy)
    except KinfmuError as problem:
        yield "problem", str(problem)
