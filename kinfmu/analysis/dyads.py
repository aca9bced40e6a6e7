"""Dyads: two links between bodies that are solved before them, with the transmission angle where the links meet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from kinfmu.analysis.driver_path import DriverPath
from kinfmu.analysis.loops import Dyad, Place, dyads
from kinfmu.analysis.named_loops import MOST, NamedLoop
from kinfmu.analysis.transmission import TransmissionRange, dyad_angle
from kinfmu.mechanism import Mechanism
from kinfmu.plan.equations.redundancy import Redundancy


@dataclass(frozen=True)
class NamedDyad:
    """A dyad that is part of no four-bar or slider-crank, with its transmission angle over the path of each driver.

    pins: the places of its pins: of the first link, where the links meet, of the second link; of a link on a slide, of
    its pin and of the point that slides.
    """

    dyad: Dyad
    pins: tuple[Place, ...]
    transmission: tuple[TransmissionRange, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the dyad as plain data."""
        dyad = self.dyad
        links = [dyad.first] if dyad.direction is not None else [dyad.first, dyad.second]
        return {
            "links": [dyad.first.name, dyad.second.name],
            "lengths": {link.name: link.length for link in links},
            "joint": dyad.joint or None,
            "between": [place.body for place in (self.pins[0], *self.pins[2:])],
            "transmission": [angle.as_json() for angle in self.transmission],
        }


def find_dyads(
    mechanism: Mechanism, redundancy: Redundancy, paths: Sequence[DriverPath], loops: Sequence[NamedLoop]
) -> tuple[NamedDyad, ...]:
    """Return the dyads that a driver moves and whose transmission angle is that of no loop.

    Large mechanisms have no transmission angles.
    """
    if len(mechanism.coordinate_names) > MOST or not paths:
        return ()
    known = {frozenset((angle.coupler, angle.output)) for loop in loops for angle in loop.transmission}
    return tuple(_found(dyads(mechanism, {row.row.owner for row in redundancy.dependent}), paths, known))


def _found(candidates: Sequence[Dyad], paths: Sequence[DriverPath], known: set[frozenset[str]]) -> Iterator[NamedDyad]:
    for dyad in candidates:
        key = frozenset((dyad.first.name, dyad.second.name))
        results = [] if key in known else [dyad_angle(path, dyad) for path in paths]
        found = [result for result in results if result is not None]
        if found:
            known.add(key)
            yield NamedDyad(dyad, found[0][1], tuple(angle for angle, _ in found))
