"""CDR, the wire format of ROS 2: thousands of messages of one layout filled by numpy at once.

Little-endian; the offset of an item of k bytes is a multiple of k, counted after the four header bytes (OMG DDS-XTypes,
plain CDR version 1).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from kinfmu.log.clock import NANOSECONDS

HEADER = b"\x00\x01\x00\x00"
Bytes = NDArray[np.uint8]


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

    def read(self, messages: Bytes) -> NDArray[np.uint64]:
        """Return the 8-byte items (n, slots) of messages (n, L), the inverse of `fill`."""
        return np.hstack([messages[:, place : place + 8 * count].view("<u8") for place, count in self._words])

    @property
    def length(self) -> int:
        """Length L of a message [bytes]."""
        return len(self._bytes)

    def _align(self, size: int) -> None:
        self._bytes += bytes(-(len(self._bytes) - len(HEADER)) % size)


def _words(table: NDArray[np.generic]) -> NDArray[np.uint64]:
    """Return a table of 8-byte items as their bits, so that copying does not interpret them."""
    return table.astype(table.dtype.newbyteorder("<"), copy=False).view("<u8")
