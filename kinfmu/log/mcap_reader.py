"""Reader of the MCAP container: record after record, of a file that is complete or cut off."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.errors import LogError, MissingPackageError
from kinfmu.log.cdr import Bytes
from kinfmu.log.mcap_writer import MAGIC, MESSAGE, Opcode
from kinfmu.mechanism.valid import quoted

MOST_IN_CHUNK = 2**27  # [bytes] unpacked; twice what a chunk of ours holds
ALWAYS = 2**20  # [bytes] that every chunk may unpack to, whatever its index states
MOST_UNPACKED = 2**27  # [bytes] in all chunks of a channel, or LARGEST_RATIO times the file
LARGEST_RATIO = 2000  # of unpacked to packed; an index of 16 bytes a message leaves less
MOST_RECORDS = 4  # per packed byte of a chunk; a message takes at least one, because messages differ
_HEAD = struct.Struct("<BQ")  # of a record: its kind and its length
_HEAD_SIZE = _HEAD.size
_ENTRY = 16  # [bytes] of a message in the index of its chunk


class Channel(NamedTuple):
    """A topic of the file."""

    topic: str
    metadata: dict[str, str]


class MessageBlock(NamedTuple):
    """Messages of one channel and of one length: sequence numbers (n,), log times (n,) [ns], payloads (n, length)."""

    sequence: NDArray[np.uint32]
    times: NDArray[np.uint64]
    payloads: Bytes


@dataclass
class _Chunk:
    """Place of a chunk's record, and the number of messages by channel in its index; empty without an index."""

    place: int
    length: int
    messages: dict[int, int] = field(default_factory=dict)

    def most(self, channel: int, length: int | None) -> int:
        """Return the largest valid unpacked size [bytes]; length: of each payload, if all are of one length."""
        if length is None:
            return MOST_IN_CHUNK
        count = 2 * self.messages[channel] if list(self.messages) == [channel] else MOST_RECORDS * self.length
        return min(MOST_IN_CHUNK, max(ALWAYS, count * (MESSAGE.itemsize + length)))


class McapReader:
    """Content of an MCAP file; fault: where and why its records end early, empty if the file is complete."""

    def __init__(self, path: Path) -> None:
        self.channels: dict[int, Channel] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self._path = path
        self._chunks: list[_Chunk] = []
        with path.open("rb") as file:
            self._size = path.stat().st_size
            self.fault = self._read(file, self._size)

    def id_of(self, topic: str) -> int | None:
        """Return the number of a topic's channel, None if there is none."""
        return next((number for number, channel in self.channels.items() if channel.topic == topic), None)

    def blocks(self, channel: int, length: int | None = None) -> Iterator[MessageBlock]:
        """Yield the messages of a channel in file order; length: of each payload, if all are of one length.

        LogError for a damaged chunk, and for chunks whose unpacked size is larger than valid ones can be.
        """
        left = max(MOST_UNPACKED, LARGEST_RATIO * self._size)
        with self._path.open("rb") as file:
            for chunk in self._chunks:
                if not chunk.messages or channel in chunk.messages:
                    file.seek(chunk.place)
                    most = min(left, chunk.most(channel, length))
                    raw = _unpacked(file.read(chunk.length), chunk.place, most)
                    left -= len(raw)
                    yield from _messages(raw, channel, chunk.place, MOST_RECORDS * chunk.length)

    def _read(self, file: BinaryIO, size: int) -> str:
        if file.read(len(MAGIC)) != MAGIC:
            return "it does not begin as an MCAP file" if size else "it is empty"
        is_ended = False
        while True:
            place = file.tell()
            if is_ended and size - place == len(MAGIC) and file.read(len(MAGIC)) == MAGIC:
                return ""
            head = file.read(_HEAD_SIZE)
            if len(head) < _HEAD_SIZE:
                return f"it ends at byte {size}, within a record" if head else f"it ends at byte {size}"
            kind, length = _HEAD.unpack(head)
            if length > size - place - _HEAD_SIZE:
                return f"the record at byte {place} goes beyond the end, byte {size}"
            try:
                is_ended = self._take(kind, file, length)
            except (ValueError, struct.error) as error:
                return f"the record at byte {place} is damaged: {error}"
            file.seek(place + _HEAD_SIZE + length)

    def _take(self, kind: int, file: BinaryIO, length: int) -> bool:
        """Take what is needed of a record; return True for the last record of a file."""
        if kind == Opcode.CHUNK:
            self._chunks.append(_Chunk(file.tell(), length))
        elif kind == Opcode.MESSAGE_INDEX and self._chunks:
            number, entries = _Body(file.read(min(length, 6))).numbers("<HI")
            if entries > length - 6:
                raise ValueError("a field goes beyond its end")
            self._chunks[-1].messages[number] = entries // _ENTRY
        elif kind == Opcode.CHANNEL:
            body = _Body(file.read(length))
            number, _ = body.numbers("<HH")
            topic, _, metadata = body.text(), body.text(), body.table()
            self.channels[number] = Channel(topic, metadata)
        elif kind == Opcode.METADATA:
            body = _Body(file.read(length))
            name = body.text()
            self.metadata[name] = body.table()
        elif kind == Opcode.ATTACHMENT:
            body = _Body(file.read(length))
            body.numbers("<QQ")
            name, _ = body.text(), body.text()
            (count,) = body.numbers("<Q")
            self.attachments[name] = body.taken(count)
        elif kind not in Opcode._value2member_map_:
            raise ValueError(f"{kind:#x} is not a kind of record")
        return kind == Opcode.FOOTER


class _Body:
    """The bytes of a record, read field by field."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def taken(self, count: int) -> bytes:
        if count > len(self._data) - self._at:
            raise ValueError("a field goes beyond its end")
        self._at += count
        return self._data[self._at - count : self._at]

    def numbers(self, layout: str) -> tuple[int, ...]:
        return struct.unpack(layout, self.taken(struct.calcsize(layout)))

    def text(self) -> str:
        (count,) = self.numbers("<I")
        return self.taken(count).decode()

    def table(self) -> dict[str, str]:
        (count,) = self.numbers("<I")
        entries = _Body(self.taken(count))
        found = {}
        while entries._at < count:
            key = entries.text()
            found[key] = entries.text()
        return found


def _unpacked(data: bytes, place: int, most: int) -> Bytes:
    """Return the unpacked messages of a chunk; data: its record's body, at byte `place`; most: largest size [bytes]."""
    try:
        body = _Body(data)
        _, _, size = body.numbers("<QQQ")
        (crc,) = body.numbers("<I")
        compression = body.text()
        if size > most:
            raise ValueError(f"its unpacked size is {size} bytes; the largest valid size is {most}")
        (count,) = body.numbers("<Q")
        raw = _decompressed(compression, body.taken(count), size)
    except (ValueError, struct.error) as error:
        raise LogError(f"the chunk at byte {place} is damaged: {error}") from None
    if len(raw) != size or (crc and zlib.crc32(raw) != crc):
        raise LogError(f"the chunk at byte {place} is damaged: wrong checksum")
    return np.frombuffer(raw, np.uint8)


def _decompressed(compression: str, data: bytes, size: int) -> bytes:
    if compression == "":
        return data
    try:
        if compression == "zstd":
            import zstandard

            try:
                if zstandard.frame_content_size(data) not in (-1, size):
                    raise ValueError("its sizes disagree")
                return zstandard.ZstdDecompressor().decompress(data, size)
            except zstandard.ZstdError as error:
                raise ValueError(str(error)) from None
        if compression == "lz4":
            import lz4.frame

            try:
                return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))
            except (RuntimeError, EOFError) as error:
                raise ValueError(str(error)) from None
    except ImportError as error:
        raise MissingPackageError(f"chunks of {compression} need {error.name}: pip install {error.name}") from None
    raise ValueError(f"compression {quoted(compression)} is not known; known: zstd, lz4")


def _messages(raw: Bytes, channel: int, place: int, most: int) -> Iterator[MessageBlock]:
    """Yield the messages of a channel in an unpacked chunk at byte `place`; most: largest valid number of records."""
    length = _HEAD_SIZE + _HEAD.unpack_from(raw.data)[1] if len(raw) >= _HEAD_SIZE else 0
    if length and len(raw) % length == 0:
        table = raw.reshape(-1, length)
        heads = table[:, : MESSAGE.itemsize].view(MESSAGE)[:, 0] if length >= MESSAGE.itemsize else None
        if heads is not None and _are_uniform(heads):
            if heads["channel"][0] == channel:
                yield _block(table)
            return
    at, count, view = 0, 0, raw.data
    while at + _HEAD_SIZE <= len(raw):
        kind, length = _HEAD.unpack_from(view, at)
        count += 1
        end = at + _HEAD_SIZE + length
        if end > len(raw) or (kind == Opcode.MESSAGE and end - at < MESSAGE.itemsize) or count > most:
            fault = "too many records" if count > most else "a record goes beyond its end"
            raise LogError(f"the chunk at byte {place} is damaged: {fault}")
        if kind == Opcode.MESSAGE:
            record = raw[at:end].reshape(1, -1)
            if record[0, _HEAD_SIZE : _HEAD_SIZE + 2].view("<u2")[0] == channel:
                yield _block(record)
        at = end


def _are_uniform(heads: NDArray[np.void]) -> bool:
    """Return True if all records are messages of one channel and one length."""
    first = heads[0]
    return first["opcode"] == Opcode.MESSAGE and all(
        bool((heads[name] == first[name]).all()) for name in ("opcode", "length", "channel")
    )


def _block(records: Bytes) -> MessageBlock:
    heads = records[:, : MESSAGE.itemsize].view(MESSAGE)[:, 0]
    return MessageBlock(heads["sequence"], heads["log"], records[:, MESSAGE.itemsize :])
