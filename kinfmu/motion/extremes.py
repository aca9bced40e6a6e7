"""Extremes of the quantities of many designs, read off the samples in compiled code as soon as they are solved.

Most measures are made of extremes. They are asked of a motion without numbers first, which notes what they need; then
`extremes.c` reads it design by design, so that no table holds the samples of all designs.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.codegen.lanes.stage import address_of
from kinfmu.motion.history import Extreme, cut_places, larger, weights_at
from kinfmu.motion.quantities import QuantityNames, QuantityRead, path_of
from kinfmu.motion.quintic import compiled
from kinfmu.run.native_engine import DesignReader

_FOUND = 7  # numbers of a channel, as FOUND of extremes.c
_Place = ctypes.c_void_p


class SamplesNeededError(Exception):
    """A measure reads more of a motion than extremes."""


class ExtremeChannel(NamedTuple):
    """What extremes are of: a column, or the size of a vector of two, its derivative of an order, and the part."""

    columns: tuple[int, ...]
    order: int
    part: int


class CutSamples(NamedTuple):
    """A part of the motion as `extremes.c` reads it.

    x: (k,) arguments of its samples; inside: number of the first one of the motion; intervals: in which its ends are,
    counted on into the next period, and where in them, s.
    """

    x: FloatArray
    inside: int
    intervals: IntArray
    s: FloatArray

    @classmethod
    def of(cls, x: FloatArray, window: tuple[float, float], *, is_closed: bool) -> CutSamples:
        """Return the part in a window of a motion at arguments x (n,)."""
        whole, inside, last = cut_places(x, *window, is_closed=is_closed)
        ends = np.array(window)
        k = np.clip(np.searchsorted(whole, ends, side="right") - 1, 0, len(whole) - 2)
        s = (ends - whole[k]) / (whole[k + 1] - whole[k])
        return cls(np.concatenate([ends[:1], whole[inside:last], ends[1:]]), int(inside), k, s)


Window = tuple[float, float] | None  # of a motion; None: all of it, or one that it does not reach


@dataclass(frozen=True)
class Channels:
    """The channels that measures need, and the parts of the motion that they see.

    Attributes:
        outputs: The quantities in the columns.
        channels: The channels, each once.
        windows: Of each part, if the motion does not go round, and if it does. The first part is the whole motion.

    """

    outputs: Sequence[QuantityRead]
    channels: list[ExtremeChannel] = field(default_factory=list)
    windows: list[tuple[Window, Window]] = field(default_factory=lambda: [(None, None)])

    @property
    def groups(self) -> list[tuple[int, ...]]:
        """Columns that go round together: those of each channel."""
        return list(dict.fromkeys(channel.columns for channel in self.channels))

    def find(self, names: QuantityNames, points: Any, of: Any, order: int) -> tuple[tuple[int, ...], int]:
        """Return the columns of a quantity or a point, and the order of its derivative with that of its name.

        Raise a SamplesNeededError if its derivatives are not those of columns.
        """
        quantities: tuple[QuantityRead, ...] = (of,)
        if isinstance(of, str) and order and of in points:
            quantities = path_of(of)
        elif isinstance(of, str):
            name, own = names.orders.get(of, (of, 0))
            quantities, order = (name,), own + order if not (own and order) else -1  # type: ignore[assignment]
        is_known = all(one in self.outputs and not getattr(one, "is_root", False) for one in quantities)
        if order < 0 or not is_known:
            raise SamplesNeededError
        return tuple(map(self.outputs.index, quantities)), order


@dataclass(frozen=True, eq=False)
class HistoryExtremes:
    """What extremes.c found of a channel: as much of a `History` as most measures read.

    Attributes:
        x: (n,) arguments of the motion.
        is_closed: The motion goes round.
        found: (..., FOUND) minimum and its place, maximum and its place, first and last value, repeats.

    """

    x: FloatArray
    is_closed: bool
    found: FloatArray

    @property
    def span(self) -> float:
        return float(self.x[-1] - self.x[0])

    @property
    def value(self) -> FloatArray:
        """(..., 2) the first and the last value."""
        return self.found[..., 4:6]

    def minimum(self) -> Extreme:
        return Extreme(self.found[..., 0], self.found[..., 1])

    def maximum(self) -> Extreme:
        return Extreme(self.found[..., 2], self.found[..., 3])

    def extremes(self) -> tuple[Extreme, Extreme]:
        return self.minimum(), self.maximum()

    def largest_size(self) -> Extreme:
        return larger(*self.extremes())

    def repeats(self) -> FloatArray:
        return self.found[..., 6]

    def __getattr__(self, name: str) -> Any:
        raise SamplesNeededError


@dataclass(frozen=True, eq=False)
class Extremes:
    """The extremes of designs.

    Attributes:
        channels: What they are of.
        found: (channels, m, FOUND); None while measures are asked what they need.
        rounds: (m, groups) whether the columns of a group go round.

    """

    channels: Channels
    found: FloatArray | None = None
    rounds: NDArray[np.bool_] | None = None

    def of(
        self, columns: tuple[int, ...], order: int, window: Window, x: FloatArray, *, is_closed: bool
    ) -> HistoryExtremes:
        """Return the extremes of columns in a part of the motion."""
        part = next(k for k, windows in enumerate(self.channels.windows) if windows[is_closed] == window)
        channel = ExtremeChannel(columns, order, part)
        if self.found is None:
            if channel not in self.channels.channels:
                self.channels.channels.append(channel)
            return HistoryExtremes(x, is_closed, np.full(_FOUND, np.nan))
        return HistoryExtremes(x, is_closed, self.found[self.channels.channels.index(channel)])

    def goes_round(self, quantities: Sequence[QuantityRead]) -> NDArray[np.bool_]:
        """Return (m,) whether quantities go round together."""
        assert self.rounds is not None  # noqa: S101  it is known once designs are read
        columns = tuple(map(self.channels.outputs.index, quantities))
        return self.rounds[:, self.channels.groups.index(columns)]

    def of_designs(self, chosen: IntArray) -> Extremes:
        """Return those of some designs."""
        assert self.found is not None and self.rounds is not None  # noqa: S101, PT018
        return replace(self, found=self.found[:, chosen], rounds=self.rounds[chosen])


class _Part(ctypes.Structure):
    """kf_part of extremes.c."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("inside", ctypes.c_int64),
        ("intervals", ctypes.c_int64 * 2),
        ("s", ctypes.c_double * 2),
        ("x", _Place),
        ("h", _Place),
    )


class _Channel(ctypes.Structure):
    """kf_channel of extremes.c."""

    _fields_ = (
        ("column", ctypes.c_int64),
        ("other", ctypes.c_int64),
        ("order", ctypes.c_int64),
        ("group", ctypes.c_int64),
        ("parts", _Place),
        ("found", _Place),
    )


class _Extremes(ctypes.Structure):
    """kf_extremes of extremes.c."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("columns", ctypes.c_int64),
        ("channels", ctypes.c_int64),
        ("groups", ctypes.c_int64),
        ("x", _Place),
        ("h", _Place),
        ("rows", _Place * 3),
        ("weights", (_Place * 2) * 2),
        ("is_angle", _Place),
        ("members", _Place),
        ("channel", _Place),
        ("goes_round", _Place),
        ("worst", _Place),
        ("missing", _Place),
        ("ranges", _Place),
        ("memory", _Place),
    )


class ExtremesReader:
    """Reads the extremes of m designs off their samples, one after another, in the memory of one.

    Attributes:
        tables: Values, rates and accelerations of all designs, (m, n, columns) each, of which every design has the
            same memory; status: (m, n), the same.
        worst: (m,) worst status of a design.
        missing: (m, 2) number of its samples without numbers, and the first of them.
        function: What `Library.solve_designs` calls after each design.

    """

    def __init__(self, channels: Channels, x: FloatArray, order: slice, designs: int) -> None:
        n, columns, groups = len(x), len(channels.outputs), channels.groups
        self._channels = channels
        self._kept: list[Any] = []  # arrays that addresses are of
        rows = np.empty((3, columns, n))
        self.tables = [np.broadcast_to(row.T[order], (designs, n, columns)) for row in rows]
        one = np.empty(n, np.int32)
        self.status = np.broadcast_to(one, (designs, n))
        self._found = np.empty((len(channels.channels), designs, _FOUND))
        self._rounds = np.empty((designs, len(groups)), np.bool_)
        self.worst, self.missing = np.empty(designs, np.int32), np.empty((designs, 2), np.int32)
        parts = (_Part * (2 * len(channels.windows)))()
        for k, windows in enumerate(channels.windows):
            for is_closed, window in enumerate(windows):
                if window is not None:
                    self._fill(parts[2 * k + is_closed], CutSamples.of(x, window, is_closed=bool(is_closed)))
        listed = (_Channel * len(channels.channels))()
        for to, channel, found in zip(listed, channels.channels, self._found, strict=True):
            column, other = (*channel.columns, -1)[:2]
            to.column, to.other, to.order, to.group = column, other, channel.order, groups.index(channel.columns)
            to.parts = ctypes.addressof(parts[2 * channel.part]) if channel.part else None
            to.found = self._address(found)
        weights = [weights_at(x, is_closed=is_closed) for is_closed in (False, True)]
        of = self._of = _Extremes(n, columns, len(listed), len(groups), self._address(x), self._address(np.diff(x)))
        of.rows = (_Place * 3)(*map(self._address, rows))
        of.weights = ((_Place * 2) * 2)(*((_Place * 2)(*map(self._address, both)) for both in weights))
        of.is_angle = self._address(np.array([one.is_angle for one in channels.outputs], np.uint8))
        of.members = self._address(np.array([[k in group for k in range(columns)] for group in groups], np.uint8))
        of.channel = ctypes.addressof(listed)
        of.goes_round, of.worst, of.missing = map(self._address, (self._rounds, self.worst, self.missing))
        of.ranges = self._address(np.empty((columns, 3, 2)))
        of.memory = self._address(np.empty((2 * columns + 9, n)))
        self._kept += [one, parts, listed]
        function = ctypes.cast(compiled().kf_read_extremes, _Place).value or 0
        self.function = DesignReader(function, ctypes.addressof(of))

    def _fill(self, to: Any, cut: CutSamples) -> None:
        to.count, to.inside = len(cut.x), cut.inside
        to.intervals, to.s = (ctypes.c_int64 * 2)(*cut.intervals.tolist()), (ctypes.c_double * 2)(*cut.s.tolist())
        to.x, to.h = self._address(cut.x), self._address(np.diff(cut.x))

    def _address(self, array: NDArray[Any]) -> int:
        array = np.ascontiguousarray(array)
        self._kept.append(array)
        return address_of(array)

    def extremes(self) -> Extremes:
        """Return what was found."""
        return Extremes(self._channels, self._found, self._rounds)
