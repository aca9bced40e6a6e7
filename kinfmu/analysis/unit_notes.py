"""Notes on bare numbers whose unit is probably a slip: what was understood, and what was probably meant."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.members import NumberPath, path_text
from kinfmu.mechanism.number import given_unit
from kinfmu.units import METRES, Quantity, unit_of

_USUAL = {  # a bare number is in N/m or N s/m
    ("stiffness", "mm"): "N/mm",
    ("stiffness", "cm"): "N/cm",
    ("stiffness", "in"): "lbf/in",
    ("damping", "mm"): "N s/mm",
}
_EARTH = (9.7, 10.1)  # [m/s2]; what is written for the gravity of the earth
_SLIP = 1000.0  # between m and mm
_APART = 100.0  # a length that is farther from all others is probably one in another unit
_FREE_APART = 20.0  # the same for free lengths, which are like the distances that springs span
_NEAR = 2.0  # of the others' range, in which the length is then
_FEWEST = 3  # other lengths that tell


def unit_notes(mechanism: Mechanism) -> Iterator[str]:
    """Yield a line for each bare number that is probably in another unit than its own; mechanism: as written."""
    unit = mechanism.length_unit
    lengths: dict[NumberPath, float] = {}
    bare: dict[NumberPath, tuple[float, Quantity]] = {}

    def look(place: NumberPath, value: Any, quantity: Quantity) -> Any:
        is_start = place[0] == "bodies" and place[2] == "start"
        if "law" in place or is_start or place[0] == "measures" or not value:
            return value
        if quantity == Quantity("length"):
            lengths[place] = abs(float(value))
        if not given_unit(value) and place not in mechanism.expressions:
            bare[place] = float(value), quantity
        return value

    mechanism.members.changed(look)
    yield from _gravity(mechanism, bare)
    for place, (value, quantity) in bare.items():
        meant = _USUAL.get((quantity.kind, unit))
        if meant:
            understood = f"{value:.12g} {unit_of(quantity, unit)}"
            yield (
                f"{path_text(place)} = {value:.12g} is {understood}, although the unit of length is {unit}: write "
                f"'{value:.12g} {meant}' if intended, else '{understood}'"
            )
    yield from dict.fromkeys(
        text for place, (value, _) in bare.items() if place in lengths for text in _lengths(place, value, lengths, unit)
    )  # once for the two coordinates of a point


def _gravity(mechanism: Mechanism, bare: dict[NumberPath, tuple[float, Quantity]]) -> Iterator[str]:
    """Yield a line for a bare gravity that is the earth's in another unit of length."""
    size, unit = math.hypot(*(mechanism.gravity or (0.0, 0.0))), mechanism.length_unit
    places = [place for place in bare if place[0] == "gravity"]
    near = [one for one in ("m", "mm", "cm", "in", "ft") if _EARTH[0] <= size * METRES[one] <= _EARTH[1]]
    if places and near and unit not in near:
        value, _ = bare[places[0]]
        yield (
            f"{path_text(places[0])} = {value:.12g} is {value:.12g} {unit}/s2, {size * METRES[unit]:.6g} m/s2 in all: "
            f"for the gravity of the earth write '{value:.12g} {near[0]}/s2'"
        )


def _lengths(place: NumberPath, value: float, lengths: dict[NumberPath, float], unit: str) -> Iterator[str]:
    """Yield a line for a length that all others are a thousand times, or a thousandth of."""
    size, least = abs(value), _FREE_APART if place[-1] == "free_length" else _APART
    others = [other for other in lengths.values() if max(other, size) > min(other, size) * math.sqrt(least)]
    if len(others) < _FEWEST or len(others) <= len(lengths) - len(others):
        return
    low, high = min(others), max(others)
    for factor, word in ((_SLIP, "a thousandth of"), (1.0 / _SLIP, "a thousand times")):
        is_apart = size * least < low if factor > 1.0 else size > high * least
        meant = [one for one in ("m", "mm") if math.isclose(METRES[one], METRES[unit] * factor)]
        if is_apart and low / _NEAR <= size * factor <= high * _NEAR and meant:
            yield (
                f"{path_text(place)}: {value:.12g} is {value:.12g} {unit}, about {word} the other lengths ({low:.6g} "
                f"to {high:.6g} {unit}); write '{value:.12g} {meant[0]}' if intended"
            )
