"""ROS 2 messages: definitions, time stamps, and CDR, their wire format, of which numpy fills thousands at once.

CDR is little-endian; the offset of an item of k bytes is a multiple of k, counted after the four header bytes (OMG
DDS-XTypes, plain CDR version 1). Source of the definitions: common_interfaces, geometry2 and rcl_interfaces (Apache-2.0
/ BSD-3), without comments.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.errors import LogError

HEADER = b"\x00\x01\x00\x00"
Bytes = NDArray[np.uint8]

NANOSECONDS = 1_000_000_000
LATEST = 2.0**31 - 1.0  # [s]; a ROS 2 time stamp holds its seconds in 32 bits

_LINE = "=" * 80
TIME_DEFINITION = f"{_LINE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
_HEADER = f"{_LINE}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{TIME_DEFINITION}"

STRING = "string data\n"
JOINT_STATE = (
    f"std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{_HEADER}"
)
TF_MESSAGE = (
    "geometry_msgs/TransformStamped[] transforms\n"
    f"{_LINE}\nMSG: geometry_msgs/TransformStamped\n"
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
    f"{_LINE}\nMSG: geometry_msgs/Transform\n"
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
    f"{_LINE}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    f"{_LINE}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n{_HEADER}"
)
LOG = (
    "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n"
    "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n"
    f"{TIME_DEFINITION}"
)
LOG_LEVELS = {"info": 20, "warning": 30, "error": 40}


class Template:
    """The layout of one message: fixed bytes, with slots for time stamps and for 8-byte numbers."""

    def __init__(self) -> None:
        self._bytes = bytearray(HEADER)
        self._stamps: list[int] = []
        self._words: list[tuple[int, int]] = []  # offset and number of adjacent slots

    def uint8(self, value: int) -> Template:
        """Add a fixed number of one byte."""
        self._bytes.append(value)
        return self

    def uint32(self, value: int) -> Template:
        """Add a fixed number of four bytes."""
        self._align(4)
        self._bytes += value.to_bytes(4, "little")
        return self

    def string(self, text: str) -> Template:
        """Add a fixed text: its length with the final zero byte, then its UTF-8."""
        encoded = text.encode() + b"\0"
        self.uint32(len(encoded))
        self._bytes += encoded
        return self

    def strings(self, texts: tuple[str, ...]) -> Template:
        """Add a sequence of fixed texts."""
        self.uint32(len(texts))
        for text in texts:
            self.string(text)
        return self

    def stamp(self) -> Template:
        """Add a slot for builtin_interfaces/Time."""
        self._align(4)
        self._stamps.append(len(self._bytes))
        self._bytes += bytes(8)
        return self

    def words(self, count: int) -> Template:
        """Add slots for `count` numbers of 8 bytes."""
        if count:
            self._align(8)
            self._words.append((len(self._bytes), count))
            self._bytes += bytes(8 * count)
        return self

    def sequence(self, count: int) -> Template:
        """Add a sequence of `count` 8-byte numbers: its length, then the slots."""
        return self.uint32(count).words(count)

    def fill(self, out: Bytes, stamps: NDArray[np.int64], tables: Iterable[NDArray[np.generic]] = ()) -> None:
        """Write n messages into out (n, L).

        stamps: (n,) [ns], written into every time slot; tables: (n, k) of 8-byte items, written into the other slots
        in turn; a table need not end where adjacent slots end.
        """
        out[:] = np.frombuffer(self._bytes, np.uint8)
        times = np.column_stack([stamps // NANOSECONDS, stamps % NANOSECONDS]).astype("<u4")
        for place in self._stamps:
            out[:, place : place + 8].view("<u4")[:] = times
        slots = [out[:, place : place + 8 * count].view("<u8") for place, count in self._words]
        k = filled = 0
        for table in tables:
            taken = 0
            while taken < table.shape[1]:
                count = min(slots[k].shape[1] - filled, table.shape[1] - taken)
                slots[k][:, filled : filled + count] = _words(table[:, taken : taken + count])
                taken, filled = taken + count, filled + count
                if filled == slots[k].shape[1]:
                    k, filled = k + 1, 0

    def messages(
        self, places: NDArray[np.int64], times: NDArray[np.int64], tables: Sequence[NDArray[np.generic]] = ()
    ) -> Messages:
        """Return messages at these places and times; tables: as in `fill`."""
        return Messages(self, places, times, tables)

    def read(self, messages: Bytes) -> NDArray[np.uint64]:
        """Return the 8-byte items (n, slots) of messages (n, L), the inverse of `fill`."""
        return np.hstack([messages[:, place : place + 8 * count].view("<u8") for place, count in self._words])

    @property
    def length(self) -> int:
        """Length L of a message [bytes]."""
        return len(self._bytes)

    def _align(self, size: int) -> None:
        self._bytes += bytes(-(len(self._bytes) - len(HEADER)) % size)


class Messages(NamedTuple):
    """Messages of one layout: their places in a chunk (n,), log times (n,) [ns] and tables as in `Template.fill`."""

    template: Template
    places: NDArray[np.int64]
    times: NDArray[np.int64]
    tables: Sequence[NDArray[np.generic]]


def _words(table: NDArray[np.generic]) -> NDArray[np.uint64]:
    """Return a table of 8-byte items as their bits, so that copying does not interpret them."""
    return table.astype(table.dtype.newbyteorder("<"), copy=False).view("<u8")


def nanoseconds(t: FloatArray) -> NDArray[np.int64]:
    """Return times (n,) [s] as whole nanoseconds, rounded: truncation would make times of a 1 ms grid 1 ns too low."""
    check_times(t)
    return np.rint(t * NANOSECONDS).astype(np.int64)


def check_times(t: FloatArray) -> None:
    """Raise a LogError if a time (n,) [s] is outside the range of a log."""
    if len(t) and not (t.min() >= -LATEST and t.max() <= LATEST):
        row = int(np.argmin(np.abs(t) <= LATEST))
        raise LogError(f"time of sample {row} is {t[row]} s; a log needs a number within +-{LATEST:.0f} s")


def zero_of(t: FloatArray) -> int:
    """Return the origin of log times [whole s]: 0, or less if the run begins before 0.

    MCAP's times are unsigned, so the log times of a run that begins at -0.5 s are counted from -1 s.
    """
    return min(0, int(np.floor(t.min()))) if len(t) else 0
