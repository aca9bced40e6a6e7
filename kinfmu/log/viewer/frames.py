"""Frames of bodies that move in a recording, and the lines and points that stand still in them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.log.viewer.blocks import send
from kinfmu.log.viewer.timeline import Timeline
from kinfmu.run import FloatArray, Run
from kinfmu.scene import palette

if TYPE_CHECKING:
    import rerun as rr


class Frames:
    """The frames of one run, placed on a timeline.

    size: of which radii are parts [length]; layer: added to the order of drawing.
    """

    def __init__(self, rec: rr.RecordingStream, timeline: Timeline, run: Run, size: float, layer: float) -> None:
        self._rec, self._timeline, self._run, self._size, self._layer = rec, timeline, run, size, layer
        self._good = np.flatnonzero(run.good)
        self._always = 0 < len(self._good) == len(run.good)  # every sample holds numbers

    def move(self, path: str, pose: FloatArray) -> None:
        """Poses (n, 3) of the frame of an entity, x, y [length], phi [rad], at the samples that hold numbers."""
        import rerun as rr

        known = pose[self._good]
        zero = np.zeros(len(known))
        half = 0.5 * known[:, 2]
        turn = np.column_stack([zero, zero, np.sin(half), np.cos(half)]).astype(np.float32)
        shift = np.column_stack([known[:, :2], zero]).astype(np.float32)
        send(
            self._rec,
            path,
            self._timeline,
            self._run.t[self._good],
            lambda rows: rr.Transform3D.columns(translation=shift[rows], quaternion=turn[rows]),
        )

    def line(
        self,
        path: str,
        points: FloatArray,
        radius: float,
        colour: palette.Colour,
        order: float,
        label: str | None = None,
        shown: bool = False,
    ) -> None:
        """A line (k, 2) that stands still in its frame, from the first pose on; grey where the last pose stands in.

        radius: as a part of the size; label: its name, if it has one; shown: not only when it is pointed at.
        """
        import rerun as rr

        look = self._look(radius, order, [label] if label else [], shown)
        strip = [points.astype(np.float32)]
        if self._always:
            self._rec.log(path, rr.LineStrips2D(strip, colors=[colour], **look), static=True)
        elif len(self._good):
            self._rec.log(path, rr.LineStrips2D.from_fields(**look), static=True)
            self._with_first_pose(path, rr.LineStrips2D.columns(strips=strip))
            turns = self.turns()
            colours = np.array([colour if good else palette.OUT_OF_REACH for good in self._run.good[turns]], np.uint8)
            at = self._run.t[turns]
            send(self._rec, path, self._timeline, at, lambda rows: rr.LineStrips2D.columns(colors=colours[rows]))

    def points(
        self,
        path: str,
        points: FloatArray,
        radius: float,
        colour: palette.Colour,
        order: float,
        names: list[str],
        shown: bool,
    ) -> None:
        """Points (k, 2) with their names, which stand still in their frame, from the first pose on."""
        import rerun as rr

        look = {"colors": [colour], **self._look(radius, order, names, shown)}
        at = points.astype(np.float32)
        if self._always:
            self._rec.log(path, rr.Points2D(at, **look), static=True)
        elif len(self._good):
            self._rec.log(path, rr.Points2D.from_fields(**look), static=True)
            self._with_first_pose(path, rr.Points2D.columns(positions=at).partition([len(at)]))

    def turns(self) -> NDArray[np.int64]:
        """The first sample of each stretch with numbers, and of each without."""
        return np.flatnonzero(np.diff(self._run.good.astype(int), prepend=-1))

    def _with_first_pose(self, path: str, columns: Any) -> None:
        send(self._rec, path, self._timeline, self._run.t[self._good[:1]], lambda _: columns)

    def _look(self, radius: float, order: float, names: list[str], shown: bool) -> dict[str, Any]:
        """What lines and points are told alike."""
        return {
            "radii": [radius * self._size],
            "labels": names or None,
            "show_labels": shown if names else None,
            "draw_order": self._layer + order,
        }
