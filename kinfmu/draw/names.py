"""Names, placed so that they cover neither each other nor what is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kinfmu.draw.sheet import FONT, INK, Sheet
from kinfmu.run import FloatArray
from kinfmu.shapes.palette import Colour

_DIRECTIONS = 16  # in which a name may stand beside its anchor
_FURTHER = (0.0, 4.0, 9.0, 16.0, 26.0)  # [pt] from where it would touch
_LEADER_FROM = 9.0  # [pt]; a name further off is tied to its anchor by a thin line
_AIR, _GAP = 1.5, 3.0  # [pt] above and below a name, and beside it
_OVERLAP, _OFF_SHEET, _DISTANCE, _TILT = 60.0, 200.0, 0.12, 0.05  # costs beside 1 for a dot of what is drawn


@dataclass(frozen=True, eq=False)
class Name:
    """A name and where it may stand.

    anchors: (k, 2) [length], the best first; clearance: [pt] from an anchor, 0 if it may stand on the first one itself;
    rank: names of a lower rank choose first.
    """

    text: str
    anchors: FloatArray
    clearance: float
    colour: Colour = INK
    italic: bool = False
    rank: int = 0


def place(names: Sequence[Name], sheet: Sheet) -> None:
    """Write each name where it costs least: near its anchor, on free paper."""
    covered = sheet.covered
    taken: list[FloatArray] = []
    for name in sorted(names, key=lambda name: name.rank):
        anchors = sheet.to_paper(name.anchors)
        half = _half_size(name.text, italic=name.italic)
        spots, homes, costs = _spots(anchors, half, name.clearance, can_stand_on=name.clearance == 0.0)
        costs = costs + _covering(spots, half, covered, taken, sheet.to_paper(sheet.high))
        best = int(np.argmin(np.round(costs, 6)))  # rounding keeps the choice the same on every machine
        spot, home = spots[best], anchors[homes[best]]
        _lead(sheet, home, spot, half, name.clearance)
        sheet.text(spot, name.text, name.colour, italic=name.italic)
        taken.append(np.concatenate([spot - half, spot + half]))


def _half_size(text: str, *, italic: bool) -> FloatArray:
    """Half of width and height of a name [pt]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=FONT, style="italic" if italic else "normal")
    width, _, _ = text_to_path.get_text_width_height_descent(text, font, ismath=False)
    return np.array([width / 2.0 + _GAP, FONT / 2.0 + _AIR])


def _spots(
    anchors: FloatArray, half: FloatArray, clearance: float, *, can_stand_on: bool
) -> tuple[FloatArray, list[int], FloatArray]:
    """Middles (s, 2) [pt] where a name may stand, the anchor of each, and what the distance costs."""
    spots, homes, costs = [], [], []
    for home, anchor in enumerate(anchors):
        if can_stand_on and home == 0:
            spots.append(anchor)
            homes.append(home)
            costs.append(0.0)
        for k in range(_DIRECTIONS):
            angle = 2.0 * np.pi * k / _DIRECTIONS
            way = np.array([np.cos(angle), np.sin(angle)])
            edge = way / max(abs(way)) if abs(abs(way[0]) - abs(way[1])) < 1e-9 else way
            for further in _FURTHER:
                spots.append(anchor + way * (clearance + further) + edge * half)
                homes.append(home)
                costs.append(_DISTANCE * further + 0.1 * home + _TILT * (2.0 - way[0] - way[1]))
    return np.array(spots), homes, np.array(costs)


def _covering(
    spots: FloatArray, half: FloatArray, covered: FloatArray, taken: Sequence[FloatArray], corner: FloatArray
) -> FloatArray:
    """What it costs to cover dots and names, or to leave the sheet, at each spot (s,)."""
    within = (covered[:, :2] > spots.min(axis=0) - half) & (covered[:, :2] < spots.max(axis=0) + half)
    covered = covered[within.all(axis=1)]
    near = np.abs(covered[None, :, :2] - spots[:, None, :])  # (s, k, 2)
    costs = ((near < half).all(axis=2) * covered[:, 2]).sum(axis=1)
    for box in taken:
        middle, size = (box[:2] + box[2:]) / 2.0, (box[2:] - box[:2]) / 2.0
        costs += _OVERLAP * (np.abs(spots - middle) < half + size).all(axis=1)
    off = (spots - half < 0.0).any(axis=1) | (spots + half > corner).any(axis=1)
    return np.asarray(costs + _OFF_SHEET * off)


def _lead(sheet: Sheet, home: FloatArray, spot: FloatArray, half: FloatArray, clearance: float) -> None:
    """A thin line from an anchor to a name that stands far off."""
    nearest = np.clip(home, spot - half, spot + half)
    distance = float(np.hypot(*(nearest - home)))
    if distance - clearance > _LEADER_FROM:
        start = home + (nearest - home) * (clearance / distance)
        ends = sheet.low + np.array([start, nearest]) * sheet.point
        sheet.line(ends, 0.5, (120, 120, 120), matters=0.0)
