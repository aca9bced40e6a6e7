"""Names, placed so that they cover neither each other nor what is drawn."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.palette import Colour
from kinfmu.draw.sheet import FONT, INK, LINE, Sheet, text_width

_DIRECTIONS = 16  # from an anchor to a place for its name
_FURTHER = (0.0, 4.0, 9.0, 16.0, 26.0, 38.0)  # [pt], additional distances
LEADER: Colour = (120, 120, 120)
_LEADER_FROM = 9.0  # [pt]; a leader line connects a name that is further away with its anchor
_INSIDE = 1.0  # [pt] inside the edge of a name's rectangle, from which a line crosses it
_AIR, _GAP = 1.5, 3.0  # [pt], margins above and below a name, and left and right of it
_OVERLAP, _OFF_SHEET = 60.0, 200.0  # costs of covering another name and of leaving the sheet; of a covered dot: 1
_DISTANCE, _TILT = 0.12, 0.05  # costs of a distance of 1 pt and of places other than above on the right
_CROSSED = 12.0  # cost of a leader line across another name, of which it would seem to be a part
_ON_LEADER = np.linspace(0.0, 1.0, 12)  # points at which a leader line is compared with names
_CROWD, _APART = 0.8, 5.0  # cost of another name within this distance [pt]: both would be read as one
_BROKEN = 0.6  # cost of a name in several lines
_ROUNDS = 6  # at most, in which names are placed again


@dataclass(frozen=True, eq=False)
class Name:
    """A name and its possible places.

    Attributes:
        text: The name; ', ' separates the parts of a list.
        anchors: (k, 2) what it names, in world coordinates [length], the best first.
        clearance: Distance from an anchor [pt], 0 if the name may be on the first anchor.
        colour: Of the text.
        italic: True: in italics.
        rank: Names of a lower rank are placed first.

    """

    text: str
    anchors: FloatArray
    clearance: float
    colour: Colour = INK
    italic: bool = False
    rank: int = 0


class Mark(ABC):
    """A thing that figures show and no other picture does: an arrow, a named place, a path; in world coordinates."""

    at: FloatArray  # world coordinates, (2,) or (k, 2)

    def extent(self) -> FloatArray:
        """Return world coordinates (k, 2) that must be on the sheet."""
        return np.atleast_2d(self.at)

    @abstractmethod
    def draw(self, sheet: Sheet) -> list[Name]:
        """Draw it over what is on the sheet, and return its names, which are placed when everything is drawn."""


@dataclass(frozen=True, eq=False)
class _Options:
    """Possible places of a name.

    spots, halves: middles and half sizes (s, 2) [pt]; texts: its text there; leaders: points (s, n, 2) on its leader
    lines [pt], NaN without one; costs: (s,), without other names.
    """

    spots: FloatArray
    halves: FloatArray
    texts: Sequence[str]
    leaders: FloatArray
    costs: FloatArray

    def box(self, k: int) -> FloatArray:
        """Return the lower left and upper right corner, (4,), at spot k."""
        return np.concatenate([self.spots[k] - self.halves[k], self.spots[k] + self.halves[k]])

    def best(self, taken: Sequence[tuple[FloatArray, FloatArray]]) -> int:
        """Return the spot of the least cost, given boxes (4,) and points on leader lines (n, 2) of other names."""
        costs = self.costs.copy()
        for box, leader in taken:
            middle, size = (box[:2] + box[2:]) / 2.0, (box[2:] - box[:2]) / 2.0
            apart = np.abs(self.spots - middle) - (self.halves + size)  # (s, 2)
            on_other = np.abs(self.leaders - middle) < size - _INSIDE  # (s, n, 2)
            on_this = np.abs(leader - self.spots[:, None]) < self.halves[:, None] - _INSIDE
            costs += _CROSSED * np.any(np.all(on_other, axis=2) | np.all(on_this, axis=2), axis=1)
            costs += _OVERLAP * (apart < 0.0).all(axis=1) + _CROWD * (apart < _APART).all(axis=1)
        return int(np.argmin(np.round(costs, 6)))  # rounding keeps the choice the same on every machine


def place(names: Sequence[Name], sheet: Sheet) -> None:
    """Write each name at the place of the least cost: near its anchor, on free paper.

    Names are placed one after another, then again with the others in place, until none moves.
    """
    names = sorted(names, key=lambda name: name.rank)
    options = [_options(name, sheet) for name in names]
    chosen: dict[int, int] = {}
    for _ in range(_ROUNDS):
        before = dict(chosen)
        for k, option in enumerate(options):
            others = [(options[j], spot) for j, spot in chosen.items() if j != k]
            chosen[k] = option.best([(other.box(spot), other.leaders[spot]) for other, spot in others])
        if chosen == before:
            break
    for k, (name, option) in enumerate(zip(names, options, strict=True)):
        spot = chosen[k]
        if np.isfinite(option.leaders[spot]).all():
            ends = sheet.low + option.leaders[spot][[0, -1]] * sheet.point
            sheet.line(ends, 0.5, LEADER, matters=0.0)
        sheet.text(option.spots[spot], option.texts[spot], name.colour, italic=name.italic)


def _options(name: Name, sheet: Sheet) -> _Options:
    """Return all spots of a name, on one line and, if it is a list, with one line for each part."""
    anchors, corner = sheet.to_paper(name.anchors), sheet.to_paper(sheet.high) + sheet.beyond
    found = []
    for broken, text in enumerate(dict.fromkeys([name.text, name.text.replace(", ", ",\n")])):
        half = _half_size(text, italic=name.italic)
        spots, homes, costs = _spots(anchors, half, name.clearance, can_cover=name.clearance == 0.0)
        costs = costs + _covering(spots, half, sheet.covered, corner) + _BROKEN * broken
        leaders = _leaders(anchors[homes], spots, half, name.clearance)
        found.append((spots, np.tile(half, (len(spots), 1)), [text] * len(spots), leaders, costs))
    spots_, halves, texts, leaders_, costs_ = zip(*found, strict=True)
    together = [np.concatenate(part) for part in (spots_, halves, leaders_, costs_)]
    return _Options(together[0], together[1], [text for part in texts for text in part], together[2], together[3])


def _half_size(text: str, *, italic: bool) -> FloatArray:
    """Return half of width and height of a name [pt]."""
    lines = text.split("\n")
    width = max(text_width(line, FONT, "italic" if italic else "normal") for line in lines)
    return np.array([width / 2.0 + _GAP, (FONT + (len(lines) - 1) * LINE) / 2.0 + _AIR])


def _spots(
    anchors: FloatArray, half: FloatArray, clearance: float, *, can_cover: bool
) -> tuple[FloatArray, list[int], FloatArray]:
    """Return possible middles (s, 2) [pt] of a name, the anchor of each, and the cost of its distance."""
    spots, homes, costs = [], [], []
    for home, anchor in enumerate(anchors):
        if can_cover and home == 0:
            spots.append(anchor)
            homes.append(home)
            costs.append(0.0)
        for k in range(_DIRECTIONS):
            angle = 2.0 * np.pi * k / _DIRECTIONS
            direction = np.array([np.cos(angle), np.sin(angle)])
            is_diagonal = abs(abs(direction[0]) - abs(direction[1])) < 1e-9
            edge = direction / max(abs(direction)) if is_diagonal else direction  # a diagonal one leads to a corner
            for further in _FURTHER:
                spots.append(anchor + direction * (clearance + further) + edge * half)
                homes.append(home)
                costs.append(_DISTANCE * further + 0.1 * home + _TILT * (2.0 - direction[0] - direction[1]))
    return np.array(spots), homes, np.array(costs)


def _covering(spots: FloatArray, half: FloatArray, covered: FloatArray, corner: FloatArray) -> FloatArray:
    """Return the cost (s,) of covered dots and of leaving the sheet at each spot."""
    within = (covered[:, :2] > spots.min(axis=0) - half) & (covered[:, :2] < spots.max(axis=0) + half)
    covered = covered[within.all(axis=1)]
    near = np.abs(covered[None, :, :2] - spots[:, None, :])  # (s, k, 2)
    costs = ((near < half).all(axis=2) * covered[:, 2]).sum(axis=1)
    off = (spots - half < 0.0).any(axis=1) | (spots + half > corner).any(axis=1)
    return np.asarray(costs + _OFF_SHEET * off)


def _leaders(homes: FloatArray, spots: FloatArray, half: FloatArray, clearance: float) -> FloatArray:
    """Return points (s, n, 2) on the lines from anchors (s, 2) to names that are far from them, NaN for near ones."""
    nearest = np.clip(homes, spots - half, spots + half)
    distance = np.hypot(*(nearest - homes).T)[:, None]
    far = distance - clearance > _LEADER_FROM
    starts = np.where(far, homes + (nearest - homes) * (clearance / np.where(far, distance, 1.0)), np.nan)
    return np.asarray(starts[:, None] + _ON_LEADER[:, None] * (nearest - starts)[:, None])
