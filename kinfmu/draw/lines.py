"""Lines of a drawing, each once: without parts that are drawn already, and without lines of length 0."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from kinfmu.arrays import FloatArray

_SAME = 1e-9  # of the extent of the drawing; points that are closer are one


class Lines:
    """The straight lines of a layer.

    Args:
        extent: Of the drawing.

    """

    def __init__(self, extent: float) -> None:
        self._near = _SAME * extent
        self._drawn: list[tuple[FloatArray, FloatArray]] = []

    def new(self, points: FloatArray, *, is_closed: bool) -> Iterator[tuple[FloatArray, bool]]:
        """Yield the parts of a polyline (n, 2) that are not drawn yet, each with whether it is closed."""
        ends = np.concatenate([points, points[:1]]) if is_closed and len(points) > 2 else points
        ends = ends[np.append(True, np.hypot(*np.diff(ends, axis=0).T) > self._near)]
        parts = []
        for a, b in pairwise(ends):
            parts.append(self._open_parts(a, b))
            self._drawn.append((a, b))
        if parts and all(part == [(0.0, 1.0)] for part in parts):
            closes = is_closed and len(parts) > 2
            yield (ends[:-1] if closes else ends), closes
            return
        for (a, b), own in zip(pairwise(ends), parts, strict=True):
            for low, high in own:
                yield np.array([a + low * (b - a), a + high * (b - a)]), False

    def _open_parts(self, a: FloatArray, b: FloatArray) -> list[tuple[float, float]]:
        """Return the parts of the line from a to b, as parts of it, that no drawn line covers."""
        along = b - a
        length = float(np.hypot(*along))
        least = self._near / length
        drawn = np.array(self._drawn).reshape(-1, 2, 2) - a  # (k, 2, 2)
        across = np.abs(drawn[..., 0] * along[1] - drawn[..., 1] * along[0]).max(axis=1, initial=0.0) / length
        covered = np.sort(drawn[across <= self._near] @ along / length**2, axis=1)
        found, begin = [], 0.0
        for low, high in sorted((low, high) for low, high in covered.tolist() if high > least and low < 1.0 - least):
            if low > begin + least:
                found.append((begin, low))
            begin = max(begin, high)
        return found if begin >= 1.0 - least else [*found, (begin, 1.0)]
