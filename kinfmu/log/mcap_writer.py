"""Writer of the MCAP container: chunks of messages of one layout, built by numpy, with indexes and checksums.

    magic, header | schemas, channels, metadata, attachments, chunks each with its message index | data end
    | summary: schemas, channels, statistics, indexes of chunks, attachments, metadata; their places | footer, magic

A chunk holds messages of one channel. Layout of the records: the specification of MCAP (mcap.dev/spec).
"""

from __future__ import annotations

import os
import struct
import zlib
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from enum import IntEnum
from io import RawIOBase
from threading import local
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.errors import MissingPackageError
from kinfmu.log.cdr import Bytes, Messages

MAGIC = b"\x89MCAP0\r\n"
ZSTD = "zstd"
LEVEL = -1  # of zstd: 1 takes a quarter more time for 2 % of the size, 3 twice the time
MOST_PENDING = 4  # chunks that are being compressed
MESSAGE = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")]
)  # the head of a message, before its payload
_INDEX = np.dtype([("time", "<u8"), ("offset", "<u8")])


class Opcode(IntEnum):
    """Kinds of records."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    ATTACHMENT_INDEX = 0x0A
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


class _Chunk(NamedTuple):
    """A chunk that is being compressed; packed: its compressed bytes and checksum."""

    channel: int
    times: NDArray[np.uint64]
    offsets: NDArray[np.int64]  # of the messages
    size: int
    packed: Future[tuple[bytes, int]]


class McapWriter:
    """Writer of one MCAP file; every failure of the file is an OSError.

    file: without a buffer, so that no data are lost when the process is killed. at_once: every chunk is in the file
    when `write` returns; default: other threads compress the chunks.
    """

    def __init__(self, file: RawIOBase, *, profile: str, library: str, at_once: bool = False) -> None:
        try:
            import zstandard
        except ImportError:
            raise MissingPackageError("MCAP files need zstandard: pip install zstandard") from None

        self._compressor: Callable[[], Any] = lambda: zstandard.ZstdCompressor(level=LEVEL)
        self._own = local()  # a compressor serves one thread
        self._file = file
        self.length = 0  # bytes of the whole records in the file
        self._schemas: dict[str, bytes] = {}
        self._channels: list[bytes] = []
        self._counts: list[int] = []  # messages by channel
        self._indexes: dict[Opcode, list[bytes]] = {
            kind: [] for kind in (Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX)
        }
        self._first, self._last = 2**64 - 1, 0  # log times
        self._pending: deque[_Chunk] = deque()
        self._pool = None if at_once else ThreadPoolExecutor(min(2, os.cpu_count() or 1))
        self._put(MAGIC + _record(Opcode.HEADER, _text(profile) + _text(library)))

    def continue_in(self, file: RawIOBase) -> None:
        """Continue at the end of `file`, which is the same file opened under another name."""
        self._file = file

    def channel(self, topic: str, schema: str, definition: str, metadata: Mapping[str, str]) -> int:
        """Add a channel of ROS 2 messages and return its id; schema, definition: name and text of their type."""
        if schema not in self._schemas:
            body = struct.pack("<H", len(self._schemas) + 1) + _text(schema) + _text("ros2msg") + _text(definition)
            self._schemas[schema] = _record(Opcode.SCHEMA, body)
            self._put(self._schemas[schema])
        schema_id = list(self._schemas).index(schema) + 1
        channel = len(self._channels)
        body = struct.pack("<HH", channel, schema_id) + _text(topic) + _text("cdr") + _table(metadata)
        self._channels.append(_record(Opcode.CHANNEL, body))
        self._counts.append(0)
        self._put(self._channels[channel])
        return channel

    def metadata(self, name: str, table: Mapping[str, str]) -> None:
        """Write a metadata record: texts by key."""
        record = _record(Opcode.METADATA, _text(name) + _table(table))
        place = struct.pack("<QQ", self._at_end(), len(record))
        self._indexes[Opcode.METADATA_INDEX].append(_record(Opcode.METADATA_INDEX, place + _text(name)))
        self._put(record)

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment, a file inside the file."""
        about = _text(name) + _text(media_type)
        body = struct.pack("<QQ", 0, 0) + about + struct.pack("<Q", len(data)) + data
        record = _record(Opcode.ATTACHMENT, body + struct.pack("<I", zlib.crc32(body)))
        place = struct.pack("<QQQQQ", self._at_end(), len(record), 0, 0, len(data))
        self._indexes[Opcode.ATTACHMENT_INDEX].append(_record(Opcode.ATTACHMENT_INDEX, place + about))
        self._put(record)

    def write(self, channel: int, *kinds: Messages) -> None:
        """Write one chunk of messages; messages of several lengths are merged by their places."""
        kinds = tuple(kind for kind in kinds if len(kind.places))
        if not kinds:
            return
        n = sum(len(kind.places) for kind in kinds)
        order = np.argsort(np.concatenate([kind.places for kind in kinds]), kind="stable")
        rank = np.empty(n, np.int64)
        rank[order] = np.arange(n)
        ranks = np.split(rank, np.cumsum([len(kind.places) for kind in kinds])[:-1])
        blocks = [self._block(channel, kind, mine) for kind, mine in zip(kinds, ranks, strict=True)]
        lengths = np.empty(n, np.int64)
        for block, mine in zip(blocks, ranks, strict=True):
            lengths[mine] = block.shape[1]
        offsets = np.cumsum(lengths) - lengths
        if len(blocks) == 1:
            raw = blocks[0].reshape(-1)
        else:
            raw = np.empty(int(lengths.sum()), np.uint8)
            for block, mine in zip(blocks, ranks, strict=True):
                raw[offsets[mine][:, None] + np.arange(block.shape[1])] = block
        times = np.concatenate([kind.times for kind in kinds])[order].astype("<u8")
        self._counts[channel] += n
        packed: Future[tuple[bytes, int]]
        if self._pool is None:
            packed = Future()
            packed.set_result(self._pack(raw))
        else:
            packed = self._pool.submit(self._pack, raw)
        self._pending.append(_Chunk(channel, times, offsets, raw.size, packed))
        while len(self._pending) > (MOST_PENDING if self._pool else 0):
            self._put_chunk(self._pending.popleft())

    def _block(self, channel: int, kind: Messages, ranks: NDArray[np.int64]) -> Bytes:
        """Return messages of one length, (n, bytes), which have the positions `ranks` in the chunk."""
        length = kind.template.length
        block = np.empty((len(ranks), MESSAGE.itemsize + length), np.uint8)
        heads = block[:, : MESSAGE.itemsize].view(MESSAGE)[:, 0]
        heads["opcode"] = Opcode.MESSAGE
        heads["length"] = MESSAGE.itemsize - 9 + length
        heads["channel"] = channel
        heads["sequence"] = self._counts[channel] + ranks
        heads["log"] = heads["publish"] = kind.times
        kind.template.fill(block[:, MESSAGE.itemsize :], kind.times, kind.tables)
        return block

    def finish(self) -> None:
        """Write the summary, which completes the file."""
        self._put(_record(Opcode.DATA_END, struct.pack("<I", 0)))  # 0: no checksum; each chunk has its own
        groups = {
            Opcode.SCHEMA: list(self._schemas.values()),
            Opcode.CHANNEL: self._channels,
            Opcode.STATISTICS: [self._statistics()],
            **self._indexes,
        }
        start, summary, places = self.length, b"", b""
        for kind, records in groups.items():
            if records:
                group = b"".join(records)
                places += _record(Opcode.SUMMARY_OFFSET, struct.pack("<BQQ", kind, start + len(summary), len(group)))
                summary += group
        footer = struct.pack("<QQ", start, start + len(summary))
        summary += places
        crc = zlib.crc32(summary + struct.pack("<BQ", Opcode.FOOTER, 20) + footer)
        self._put(summary + _record(Opcode.FOOTER, footer + struct.pack("<I", crc)) + MAGIC)
        self.close()

    def close(self) -> None:
        """Discard what is not in the file yet."""
        self._pending.clear()
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def _put(self, data: bytes) -> None:
        self._at_end()
        self._write_all(data)

    def _at_end(self) -> int:
        """Write all pending chunks and return the length of the file."""
        while self._pending:
            self._put_chunk(self._pending.popleft())
        return self.length

    def _write_all(self, data: bytes) -> None:
        left = memoryview(data)
        while left:
            left = left[self._file.write(left) :]
        self.length += len(data)

    def _pack(self, raw: Bytes) -> tuple[bytes, int]:
        if not hasattr(self._own, "compress"):
            self._own.compress = self._compressor().compress
        data: bytes = self._own.compress(raw)
        return data, zlib.crc32(raw.data)

    def _put_chunk(self, chunk: _Chunk) -> None:
        data, crc = chunk.packed.result()
        first, last = int(chunk.times.min()), int(chunk.times.max())
        self._first, self._last = min(self._first, first), max(self._last, last)
        head = struct.pack("<QQQI", first, last, chunk.size, crc) + _text(ZSTD) + struct.pack("<Q", len(data))
        length = 9 + len(head) + len(data)
        index = np.empty(len(chunk.times), _INDEX)
        index["time"], index["offset"] = chunk.times, chunk.offsets
        entries = index.tobytes()
        message_index = _record(Opcode.MESSAGE_INDEX, struct.pack("<HI", chunk.channel, len(entries)) + entries)
        at = self.length
        places = struct.pack("<QQQQIHQQ", first, last, at, length, 10, chunk.channel, at + length, len(message_index))
        sizes = struct.pack("<QQ", len(data), chunk.size)
        self._indexes[Opcode.CHUNK_INDEX].append(_record(Opcode.CHUNK_INDEX, places + _text(ZSTD) + sizes))
        head = struct.pack("<BQ", Opcode.CHUNK, len(head) + len(data)) + head
        self._write_all(b"".join((head, data, message_index)))

    def _statistics(self) -> bytes:
        counts = b"".join(struct.pack("<HQ", channel, count) for channel, count in enumerate(self._counts))
        total = sum(self._counts)
        body = struct.pack(
            "<QHIIIIQQ",
            total,
            len(self._schemas),
            len(self._channels),
            len(self._indexes[Opcode.ATTACHMENT_INDEX]),
            len(self._indexes[Opcode.METADATA_INDEX]),
            len(self._indexes[Opcode.CHUNK_INDEX]),
            self._first if total else 0,
            self._last,
        )
        return _record(Opcode.STATISTICS, body + struct.pack("<I", len(counts)) + counts)


def _record(kind: Opcode, body: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(body)) + body


def _text(text: str) -> bytes:
    encoded = text.encode()
    return struct.pack("<I", len(encoded)) + encoded


def _table(table: Mapping[str, str]) -> bytes:
    entries = b"".join(_text(key) + _text(value) for key, value in table.items())
    return struct.pack("<I", len(entries)) + entries
