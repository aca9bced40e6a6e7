"""CDR, the wire format of ROS 2: thousands of messages of one layout filled by numpy at once.

Little-endian; an item of k bytes stands at a multiple of k, counted after the four header bytes (OMG DDS-XTypes, plain
CDR version 1).
"""

from __future__ import annotations

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
        self._words: list[int] = []

    def uint8(self, value: int) -> Template:
        self._bytes.append(value)
        return self

    def uint32(self, value: int) -> Template:
        self._align(4)
        self._bytes += value.to_bytes(4, "little")
        return self

    def string(self, text: str) -> Template:
        encoded = text.encode() + b"\0"
        self.uint32(len(encoded))
        self._bytes += encoded
        return self

    def strings(self, texts: tuple[str, ...]) -> Template:
        self.uint32(len(texts))
        for text in texts:
            self.string(text)
        return self

    def stamp(self) -> Template:
        """A slot for builtin_interfaces/Time."""
        self._align(4)
        self._stamps.append(len(self._bytes))
        self._bytes += bytes(8)
        return self

    def words(self, count: int) -> Template:
        """Slots for `count` numbers of 8 bytes."""
        if count:
            self._align(8)
        self._words += range(len(self._bytes), len(self._bytes) + 8 * count, 8)
        self._bytes += bytes(8 * count)
        return self

    def sequence(self, count: int) -> Template:
        """A sequence of `count` 8-byte numbers: its length, then the slots."""
        return self.uint32(count).words(count)

    def fill(self, stamps: NDArray[np.int64], words: NDArray[np.generic] | None = None) -> Bytes:
        """Messages (n, L): stamps (n,) [ns] fill every time slot, words (n, slots), 8-byte items, the others."""
        out = np.tile(np.frombuffer(bytes(self._bytes), np.uint8), (len(stamps), 1))
        times = _bytes_of(np.column_stack([stamps // NANOSECONDS, stamps % NANOSECONDS]).astype("<u4"))
        for place in self._stamps:
            out[:, place : place + 8] = times
        if words is not None:
            numbers = _bytes_of(words)
            for column, place in enumerate(self._words):
                out[:, place : place + 8] = numbers[:, 8 * column : 8 * column + 8]
        return out

    def read(self, messages: Bytes) -> NDArray[np.uint64]:
        """The 8-byte items (n, slots) of messages (n, L): the inverse of `fill`."""
        return np.hstack([messages[:, place : place + 8] for place in self._words]).view("<u8")

    @property
    def length(self) -> int:
        """L, bytes of a message."""
        return len(self._bytes)

    def _align(self, size: int) -> None:
        self._bytes += bytes(-(len(self._bytes) - len(HEADER)) % size)


def _bytes_of(table: NDArray[np.generic]) -> Bytes:
    """The bytes (n, row bytes) of a table (n, k)."""
    table = np.ascontiguousarray(table.astype(table.dtype.newbyteorder("<"), copy=False))
    return table.view(np.uint8).reshape(len(table), table.shape[1] * table.itemsize)
