"""Generated C as WebAssembly: declarations and statements, as the printers of this package write them.

What they do not write raises an error. A function or table for which the module has a place, under its name, takes this
place; all others are added. Arrays of functions are at fixed addresses: generated functions do not call themselves.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

from kinfmu.codegen.wasm.binary import Binary, code_of, number_bytes, unsigned
from kinfmu.codegen.wasm.c_types import (
    CHAR,
    DOUBLE,
    INT,
    NAMES,
    VOID,
    Array,
    CType,
    Pointer,
    Scalar,
    Struct,
    loading,
    storing,
)
from kinfmu.codegen.wasm.expressions import (
    ELSE,
    EMPTY,
    END,
    IF,
    IS_ZERO,
    OF_DOUBLES,
    OF_INTEGERS,
    Callee,
    CVariable,
    Expressions,
    Target,
    get,
    integer,
    set_to,
)
from kinfmu.errors import CompilerError

_BLOCK, _LOOP, _BRANCH, _BRANCH_IF, _RETURN, _UNREACHABLE, _DROP = (bytes([k]) for k in (2, 3, 12, 13, 15, 0, 26))


class Translator(Expressions):
    """The reader of C and writer of functions and data into a module.

    Args:
        module: The module with places, and with functions that the code calls.
        numbers: Names that stand for integers, such as sizes.
        most: Lengths of arrays that headers declare as KF_ROOM(KF_name), by name.

    Raises:
        CompilerError: `translate` finds C that the printers do not write; the message shows it.

    """

    def __init__(self, module: Binary, numbers: Mapping[str, int], most: Mapping[str, int]) -> None:
        super().__init__(module, numbers)
        self._most = most
        self._types = NAMES.copy()
        self._count = 0  # of the arguments of the function that is being read
        self._locals: list[bytes] = []  # types of its other variables
        self._result: CType = VOID
        self._depth = 0  # of blocks
        self._loops: list[int] = []  # depths of the blocks that breaks leave

    def translate(self, text: str) -> None:
        """Add what a text declares."""
        self.start(text)
        while self.tokens[self.at]:
            if self.accept("typedef"):
                self._structure()
            else:
                self._global()

    # ------------------------------------------------------------------------------------------------------------ types

    def _type(self) -> CType:
        """Read a type with its stars."""
        while self.tokens[self.at] in ("const", "static", "inline"):
            self.at += 1
        name = self.next()
        if name not in self._types:
            raise self.unknown()
        return self._stars(self._types[name])

    def _stars(self, kind: CType) -> CType:
        while self.tokens[self.at] in ("*", "const"):
            kind = Pointer(kind) if self.next() == "*" else kind
        return kind

    def _dimension(self, kind: CType) -> CType:
        """Read '[3]' after a name."""
        if not self.accept("["):
            return kind
        if self.accept("KF_ROOM"):
            self.expect("(")
            count = self._most[self.next().removeprefix("KF_")]
            self.expect(")")
        else:
            count = 0 if self.tokens[self.at] == "]" else int(self.next())
        self.expect("]")
        return Array(kind, count)

    def _structure(self) -> None:
        self.expect("struct")
        self.expect("{")
        made = Struct()
        while not self.accept("}"):
            first = kind = self._type()
            while not self.accept(";"):
                name = self.next()
                made.append(name, self._dimension(kind))
                if self.accept(","):
                    kind = self._stars(first)
        made.end()
        self._types[self.next()] = made
        self.expect(";")

    # --------------------------------------------------------------------------------------------- tables and functions

    def _global(self) -> None:
        kind, name = self._type(), self.next()
        if self.tokens[self.at] == "(":
            self._function(kind, name)
            return
        kind = self._dimension(kind)
        self.expect("=")
        self.scopes[0][name] = self._table(kind, self.module.addresses.get(name))
        self.expect(";")

    def _table(self, kind: CType, address: int | None = None) -> CVariable:
        """Read the values of a table, and put it at an address, or in new memory."""
        content = self._content(kind)
        address = self.module.reserve(len(content)) if address is None else address
        self.module.put(address, content)
        return CVariable(address, kind, in_memory=True)

    def _content(self, kind: CType) -> bytes:
        """Read an initializer."""
        if isinstance(kind, Array) and kind.of == CHAR:
            return self.next()[1:-1].encode() + b"\0"
        if isinstance(kind, Array) and kind.of == DOUBLE:
            return self._doubles(kind)
        if isinstance(kind, Array | Struct):
            kinds = [kind.of] * kind.count if isinstance(kind, Array) else [one for _, one in kind.members.values()]
            made = b""
            self.expect("{")
            for one in kinds:
                made += bytes(-len(made) % one.align) + self._content(one)
                if not self.accept(","):
                    break
            self.expect("}")
            return made + bytes(kind.size - len(made))
        sign = -1 if self.accept("-") else 1
        if kind == DOUBLE:
            return number_bytes(sign * float(self.next()))
        return (sign * self._whole()).to_bytes(4, "little", signed=True)[: kind.size]

    def _doubles(self, kind: Array) -> bytes:
        """Read an initializer of numbers; tables of laws have thousands."""
        self.expect("{")
        end = self.tokens.index("}", self.at)
        texts = "".join(self.tokens[self.at : end]).removesuffix(",").split(",")
        self.at = end + 1
        made = struct.pack(f"<{len(texts)}d", *map(float, texts))
        return made + bytes(kind.size - len(made))

    def _whole(self) -> int:
        """Read an integer or an address in an initializer."""
        self.accept("&")
        word = self.next()
        if word[0] == '"':
            return self.text_at(word)
        if word in self.integers:
            return self.integers[word]
        return int(word) if word.isdigit() else self.variable(word).place

    def _function(self, result: CType, name: str) -> None:
        self.expect("(")
        scope: dict[str, CVariable] = {}
        signature = b""
        while not self.accept(")"):
            kind = self._type()
            scope[self.next()] = CVariable(len(scope), kind, in_memory=False)
            signature += self._machine(kind)
            self.accept(",")
        number = self.module.functions.get(name)
        if number is None:
            number = self.module.add((signature, self._machine(result)))
        elif self.module.signature(number) != (signature, self._machine(result)):
            raise CompilerError(f"cannot translate {name}: its place has other arguments")
        if isinstance(result, Scalar):
            self.callees[name] = Callee(number, tuple(one.type for one in scope.values()), result)
        self.code, self._count, self._locals, self._result = bytearray(), len(scope), [], result
        self.scopes.append(scope)
        self.expect("{")
        self._block()
        self.scopes.pop()
        if result != VOID:
            self.code += _UNREACHABLE  # every path has returned
        self.module.define(number, code_of(self._locals, bytes(self.code)))

    def _machine(self, kind: CType) -> bytes:
        """Return how the machine has a variable."""
        if not isinstance(kind, Scalar | Pointer):
            raise self.unknown()
        return kind.value

    # ------------------------------------------------------------------------------------------------------- statements

    def _block(self) -> None:
        """Read statements up to the bracket that ends them, in a scope of their own."""
        self.scopes.append({})
        while not self.accept("}"):
            self._statement()
        self.scopes.pop()

    def _statement(self) -> None:
        word = self.tokens[self.at]
        if word == "(" and self.tokens[self.at + 1] == "void":
            self.at = self.tokens.index(";", self.at) + 1
        elif word in self._types or word in ("const", "static"):
            self._declaration()
        elif word in ("{", "if", "for"):
            self.at += 1
            {"{": self._block, "if": self._if, "for": self._for}[word]()
        else:
            if self.accept("break"):
                self.code += _BRANCH + unsigned(self._depth - self._loops[-1])
            elif self.accept("return"):
                if self._result != VOID:
                    self.value(self._result)
                self.code += _RETURN
            else:
                self._assignment()
            self.expect(";")

    def _if(self) -> None:
        self.expect("(")
        self.condition()
        self.expect(")")
        self.code += IF + EMPTY
        self._depth += 1
        self._statement()
        if self.accept("else"):
            self.code += ELSE
            self._statement()
        self._depth -= 1
        self.code += END

    def _for(self) -> None:
        self.expect("(")
        self._assignment()
        self.expect(";")
        self.code += _BLOCK + EMPTY + _LOOP + EMPTY
        self._loops.append(self._depth + 1)
        self._depth += 2
        self.condition()
        self.code += IS_ZERO + _BRANCH_IF + unsigned(1)
        self.expect(";")
        step = self.at
        self.at = self.tokens.index(")", step) + 1
        self._statement()
        end, self.at = self.at, step
        self._assignment()
        self.expect(")")
        self.at = end
        self.code += _BRANCH + unsigned(0) + END + END
        self._depth -= 2
        self._loops.pop()

    def _declaration(self) -> None:
        is_static = self.tokens[self.at] == "static"
        first = kind = self._type()
        while True:
            name, kind = self.next(), self._dimension(kind)
            if is_static:
                self.expect("=")
                variable = self._table(kind)
            elif isinstance(kind, Array):
                variable = CVariable(self.module.reserve(kind.size), kind, in_memory=True)
                if self.accept("="):
                    self._fill(variable.place, kind)
            else:
                variable = CVariable(self._count + len(self._locals), kind, in_memory=False)
                self._locals.append(self._machine(kind))
                if self.accept("="):
                    self.value(kind)
                    self.code += set_to(variable.place)
            self.scopes[-1][name] = variable
            if self.accept(";"):
                return
            self.expect(",")
            kind = self._stars(first)

    def _fill(self, address: int, kind: Array) -> None:
        """Read the values of an array of a function, which are computed each time."""
        if not isinstance(kind.of, Scalar):
            raise self.unknown()
        self.expect("{")
        for k in range(kind.count):
            if k:
                self.expect(",")
            self.code += integer(0)
            self.value(kind.of)
            self.code += storing(kind.of, address + k * kind.of.size)
        self.expect("}")

    def _assignment(self) -> None:
        """Read an assignment, a call or '++k'."""
        if self.accept("++"):
            variable = self.variable(self.next())
            if variable.in_memory or variable.type != INT:
                raise self.unknown()
            self.code += get(variable.place) + integer(1) + OF_INTEGERS["+"] + set_to(variable.place)
            return
        start = len(self.code)
        target = self.target()
        if not isinstance(target, Target):
            self.code += b"" if target == VOID else _DROP
            return
        kind, operator = target.type, self.next()
        if not isinstance(kind, Scalar | Pointer) or operator not in ("=", "+=", "-=", "*="):
            raise self.unknown()
        if operator != "=" and target.variable is None:
            self.code += self.code[start:] + loading(kind, target.offset)
        elif operator != "=" and target.variable is not None:
            self.code += get(target.variable)
        self.value(kind)
        if operator != "=":
            if kind not in (DOUBLE, INT):
                raise self.unknown()
            self.code += (OF_DOUBLES if kind == DOUBLE else OF_INTEGERS)[operator[0]]
        self.code += storing(kind, target.offset) if target.variable is None else set_to(target.variable)
