"""Types of generated C: how they lie in memory, and how the WebAssembly machine reads, writes and has them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

from kinfmu.codegen.wasm.binary import unsigned

KEPT = 4096  # instructions of each kind that are kept, because they are written again and again


@dataclass(frozen=True, eq=False)
class Scalar:
    """A number; load, store: the instructions that read and write it, value: the machine's type.

    There is one of each: types are compared often.
    """

    name: str
    size: int
    load: int
    store: int
    value: bytes = b"\x7f"  # i32

    @property
    def align(self) -> int:
        return self.size


@dataclass(frozen=True)
class Pointer:
    """The address of something."""

    to: CType
    size: int = 4
    align: int = 4
    load: int = 0x28
    store: int = 0x36
    value: bytes = b"\x7f"


@dataclass(frozen=True)
class Array:
    """Items in a row."""

    of: CType
    count: int

    @property
    def size(self) -> int:
        return self.of.size * self.count

    @property
    def align(self) -> int:
        return self.of.align


@dataclass(eq=False)
class Struct:
    """A record; members: their places and types."""

    members: dict[str, tuple[int, CType]] = field(default_factory=dict)
    size: int = 0
    align: int = 1

    def append(self, name: str, kind: CType) -> None:
        """Add a member behind the others."""
        place = aligned(self.size, kind.align)
        self.members[name] = (place, kind)
        self.align = max(self.align, kind.align)
        self.size = place + kind.size

    def end(self) -> None:
        """Let records follow each other in arrays."""
        self.size = aligned(self.size, self.align)


Value = Scalar | Pointer  # what the machine has on its stack
CType = Value | Array | Struct

DOUBLE = Scalar("double", 8, 0x2B, 0x39, b"\x7c")  # f64
INT = Scalar("int", 4, 0x28, 0x36)
BOOL = Scalar("bool", 1, 0x2D, 0x3A)
CHAR = Scalar("char", 1, 0x2D, 0x3A)
VOID = Scalar("void", 1, 0, 0, b"")
NAMES: dict[str, CType] = {"size_t": INT}
NAMES |= {one.name: one for one in (DOUBLE, INT, BOOL, CHAR, VOID)}


def aligned(place: int, align: int) -> int:
    """Return the next place that is a multiple."""
    return -(-place // align) * align


@lru_cache(maxsize=KEPT)
def loading(kind: Value, offset: int) -> bytes:
    """Return the instruction that reads a value at an offset from the address on the stack."""
    return bytes((kind.load, kind.align.bit_length() - 1)) + unsigned(offset)


@lru_cache(maxsize=KEPT)
def storing(kind: Value, offset: int) -> bytes:
    """Return the instruction that writes a value at an offset from the address before it on the stack."""
    return bytes((kind.store, kind.align.bit_length() - 1)) + unsigned(offset)
