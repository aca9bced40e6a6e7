"""WebAssembly in binary form: a compiled module in which functions are replaced, and to which functions are added.

The format is that of the WebAssembly specification, chapter 5. Only modules without imports are read.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

PAGE = 65536  # bytes
_HEADER = b"\0asm\1\0\0\0"
_CUSTOM, _TYPE, _FUNCTION, _MEMORY, _GLOBAL, _EXPORT, _CODE, _DATA, _DATA_COUNT = 0, 1, 3, 5, 6, 7, 10, 11, 12
_ORDER = (1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 10, 11)  # of the sections
_FOLLOWS = 2**32 - 1

Signature = tuple[bytes, bytes]  # types of the arguments and of the results
Piece = bytes | range  # range: of the bytes that were read


class Binary:
    """A module; custom: contents of sections for programs, functions and addresses: of what it exports, all by name."""

    def __init__(self, data: bytes) -> None:
        self._read = data
        self._sections: dict[int, range] = {}
        self.custom: dict[str, bytes] = {}
        reader = _Reader(data, len(_HEADER))
        while reader.place < len(data):
            number, content = data[reader.place], reader.skip(1).span()
            if number == _CUSTOM:
                inside = _Reader(data, content.start)
                name = inside.text()
                self.custom[name] = data[inside.place : content.stop]
            else:
                self._sections[number] = content
        self._types = [reader.signature() for reader in self._items(_TYPE)]
        self._functions = [reader.number() for reader in self._items(_FUNCTION)]
        self._codes: list[Piece] = [reader.entry() for reader in self._items(_CODE)]
        self._data: list[Piece] = [reader.segment() for reader in self._items(_DATA)]
        globals_ = [reader.skip(2).constant() for reader in self._items(_GLOBAL)]
        exports = {name: (kind, number) for name, kind, number in (one.export() for one in self._items(_EXPORT))}
        self.functions = {name: number for name, (kind, number) in exports.items() if kind == 0}
        self.addresses = {name: globals_[number] for name, (kind, number) in exports.items() if kind == 3}
        self._end = self.addresses["__heap_base"]

    def _items(self, section: int) -> Iterator[_Reader]:
        """Yield a reader at each item of a section; it is to read the item."""
        reader = _Reader(self._read, self._sections[section].start)
        for _ in range(reader.number()):
            yield reader

    def signature(self, function: int) -> Signature:
        """Return the types of a function."""
        return self._types[self._functions[function]]

    def reserve(self, size: int, align: int = 8) -> int:
        """Return the address of so many bytes of new memory."""
        address = -(-self._end // align) * align
        self._end = address + size
        return address

    def put(self, address: int, content: bytes) -> None:
        """Let memory hold bytes from the start."""
        if content.strip(b"\0"):
            self._data.append(b"\0\x41" + signed(address) + b"\x0b" + unsigned(len(content)) + content)

    def add(self, signature: Signature) -> int:
        """Return the number of a new function, whose code `define` sets."""
        if signature not in self._types:
            self._types.append(signature)
        self._functions.append(self._types.index(signature))
        self._codes.append(b"")
        return len(self._codes) - 1

    def define(self, function: int, code: bytes) -> None:
        """Set the code of a function: its local variables and its body."""
        self._codes[function] = _sized(code)

    def _pieces(self, exports: Iterable[str]) -> list[Piece]:
        """Return the module, which exports its memory and these functions: new bytes, and what stays of those read."""
        names = [name for name in exports if name in self.functions]
        listed = [b"\x06memory\2\0", *(_text(name) + b"\0" + unsigned(self.functions[name]) for name in names)]
        kinds = [b"\x60" + unsigned(len(a)) + a + unsigned(len(b)) + b for a, b in self._types]
        sections: dict[int, Iterable[Piece]] = {k: [content] for k, content in self._sections.items()} | {
            _TYPE: _vector(kinds),
            _FUNCTION: _vector(map(unsigned, self._functions)),
            _MEMORY: _vector([b"\0" + unsigned(-(-self._end // PAGE))]),
            _EXPORT: _vector(listed),
            _CODE: _vector(self._codes),
            _DATA: _vector(self._data),
            _DATA_COUNT: [unsigned(len(self._data))],
        }
        made: list[Piece] = [_HEADER]
        for number in _ORDER:
            content = list(sections.get(number, ()))
            if content:
                made += [bytes([number]) + unsigned(sum(map(len, content))), *content]
        return made

    def difference(self, exports: Iterable[str]) -> bytes:
        """Return how the module, which exports its memory and these functions, is made from the one that was read.

        Numbers of four bytes, the lowest first: the count of pieces, then start and length of each in the bytes read.
        Pieces with the start 2^32 - 1 are new: they follow the numbers.
        """
        joined: list[list[int]] = []
        follows = bytearray()
        for piece in self._pieces(exports):
            start = piece.start if isinstance(piece, range) else _FOLLOWS
            if joined and (joined[-1][0] == start == _FOLLOWS or sum(joined[-1]) == start):
                joined[-1][1] += len(piece)
            else:
                joined.append([start, len(piece)])
            follows += b"" if isinstance(piece, range) else piece
        return struct.pack(f"<{2 * len(joined) + 1}I", len(joined), *(k for one in joined for k in one)) + follows


def custom_section(name: str, content: bytes) -> bytes:
    """Return a section that only programs like this one read, which may follow any section of a module."""
    return b"\0" + _sized(_text(name) + content)


def unsigned(value: int) -> bytes:
    """Return a number of 0 or more in LEB128."""
    made = bytearray()
    while value > 0x7F:
        made.append(value & 0x7F | 0x80)
        value >>= 7
    made.append(value)
    return bytes(made)


def signed(value: int) -> bytes:
    """Return a number in signed LEB128."""
    made = bytearray()
    while not -64 <= value < 64:
        made.append(value & 0x7F | 0x80)
        value >>= 7
    made.append(value & 0x7F)
    return bytes(made)


def _vector(items: Iterable[Piece]) -> list[Piece]:
    """Return items with their number before them."""
    listed = list(items)
    return [unsigned(len(listed)), *listed]


def code_of(variables: Sequence[bytes], body: bytes) -> bytes:
    """Return the code of a function from the types of its variables, without arguments, and its instructions."""
    runs = [unsigned(len(list(run))) + kind for kind, run in groupby(variables)]
    return b"".join([unsigned(len(runs)), *runs, body, b"\x0b"])


def number_bytes(value: float) -> bytes:
    """Return a double as memory holds it."""
    return struct.pack("<d", value)


def _text(name: str) -> bytes:
    return _sized(name.encode())


def _sized(content: bytes) -> bytes:
    return unsigned(len(content)) + content


class _Reader:
    """A place in bytes, behind what was read last."""

    def __init__(self, data: bytes, place: int = 0) -> None:
        self._data, self.place = data, place

    def skip(self, count: int) -> _Reader:
        self.place += count
        return self

    def number(self) -> int:
        """Read an unsigned number."""
        value = shift = 0
        while True:
            byte = self._data[self.place]
            self.place += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def span(self) -> range:
        """Read bytes whose number is before them, and return where they are."""
        size = self.number()
        self.place += size
        return range(self.place - size, self.place)

    def entry(self) -> range:
        """Read the same, and return where it is with its number."""
        return range(self.place, self.span().stop)

    def bytes(self) -> bytes:
        """Read bytes whose number is before them."""
        span = self.span()
        return self._data[span.start : span.stop]

    def text(self) -> str:
        """Read a text whose length is before it."""
        return self.bytes().decode()

    def signature(self) -> Signature:
        """Read a type of functions."""
        self.skip(1)
        return self.bytes(), self.bytes()

    def export(self) -> tuple[str, int, int]:
        """Read name, kind and number of an export."""
        return self.text(), self._data[self.skip(1).place - 1], self.number()

    def constant(self) -> int:
        """Read an expression that is a constant of type i32, as an unsigned number: addresses are positive."""
        value = self.skip(1).number()
        self.skip(1)
        return value

    def segment(self) -> range:
        """Read a segment of data, and return where it is."""
        start = self.place
        self.skip(1).constant()
        return range(start, self.span().stop)
