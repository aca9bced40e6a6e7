"""Expressions of generated C as code of the WebAssembly machine, which has their values on its stack.

Code is written while the text is read, from left to right. Operations keep their order and their grouping, so numbers
are equal to those of C that is compiled without contraction.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

from kinfmu.codegen.wasm.binary import Binary, number_bytes, signed, unsigned
from kinfmu.codegen.wasm.c_types import (
    BOOL,
    CHAR,
    DOUBLE,
    INT,
    KEPT,
    VOID,
    Array,
    CType,
    Pointer,
    Scalar,
    Struct,
    Value,
    loading,
    storing,
)
from kinfmu.errors import CompilerError

_TOKENS = re.compile(r'"[^"]*"|[A-Za-z_]\w*|\d+\.?\d*(?:[eE][-+]?\d+)?|->|\+\+|&&|\|\||[-+*/<>=!]=|\S', re.ASCII)
_SKIPPED = re.compile(r"/\*.*?\*/|^ *#[^\n]*", re.DOTALL | re.MULTILINE)
_LEVELS = {"?": 1, "||": 2, "&&": 3, "==": 4, "!=": 4, "<": 5, ">": 5, "<=": 5, ">=": 5, "+": 6, "-": 6, "*": 7, "/": 7}
_CHOICE, _AND, _LAST_LOGICAL, _LAST_COMPARISON, _SUM = 1, 3, 3, 5, 6
_INSTRUCTIONS = {"fabs": b"\x99", "floor": b"\x9c", "sqrt": b"\x9f"}
_NUMBERS = {"INFINITY": math.inf, "NAN": math.nan}
_INTEGERS = {"true": 1, "false": 0, "NULL": 0}

OF_DOUBLES = {"+": b"\xa0", "-": b"\xa1", "*": b"\xa2", "/": b"\xa3", "==": b"\x61", "!=": b"\x62", "<": b"\x63",
              ">": b"\x64", "<=": b"\x65", ">=": b"\x66"}  # fmt: skip
OF_INTEGERS = {"+": b"\x6a", "-": b"\x6b", "*": b"\x6c", "/": b"\x6d", "==": b"\x46", "!=": b"\x47", "<": b"\x48",
               ">": b"\x4a", "<=": b"\x4c", ">=": b"\x4e"}  # fmt: skip
TO_DOUBLE, NEGATED, IS_ZERO, CALL = b"\xb7", b"\x9a", b"\x45", b"\x10"
IF, ELSE, END, EMPTY = b"\x04", b"\x05", b"\x0b", b"\x40"


class CVariable(NamedTuple):
    """A variable of the machine by its number, or one in memory by its address."""

    place: int
    type: CType
    in_memory: bool


class Target(NamedTuple):
    """What can be assigned to: a variable of the machine, or memory at an offset from the address on the stack."""

    type: CType
    offset: int
    variable: int | None = None


class Callee(NamedTuple):
    """A function that is called by its number."""

    number: int
    arguments: tuple[CType, ...]
    result: Scalar


@lru_cache(maxsize=KEPT)
def get(variable: int) -> bytes:
    """Return the instruction that puts a variable of the machine on the stack."""
    return b"\x20" + unsigned(variable)


@lru_cache(maxsize=KEPT)
def set_to(variable: int) -> bytes:
    """Return the instruction that takes a variable's value from the stack."""
    return b"\x21" + unsigned(variable)


@lru_cache(maxsize=KEPT)
def integer(value: int) -> bytes:
    """Return the instruction that puts an integer on the stack."""
    return b"\x41" + signed(value)


def double(value: float) -> bytes:
    """Return the instruction that puts a double on the stack."""
    return b"\x44" + number_bytes(value)


class Expressions:
    """The reader of tokens and of expressions.

    module: in which functions are called and texts are kept; numbers: names of integers. code: of the function that is
    being read; scopes: its variables, the innermost last.
    """

    def __init__(self, module: Binary, numbers: Mapping[str, int]) -> None:
        self.module = module
        self.integers = {**_INTEGERS, **numbers}
        self.tokens: list[str] = []
        self.at = 0
        self.code = bytearray()
        self.scopes: list[dict[str, CVariable]] = [{}]
        self.callees: dict[str, Callee] = {}
        self._texts: dict[str, int] = {}

    # ----------------------------------------------------------------------------------------------------------- tokens

    def start(self, text: str) -> None:
        """Go to the first word of a text."""
        self.tokens, self.at = [*_TOKENS.findall(_SKIPPED.sub("", text)), ""], 0

    def next(self) -> str:
        """Read a word."""
        self.at += 1
        return self.tokens[self.at - 1]

    def accept(self, word: str) -> bool:
        """Read a token if it is this one."""
        if self.tokens[self.at] != word:
            return False
        self.at += 1
        return True

    def expect(self, word: str) -> None:
        """Read this word."""
        if not self.accept(word):
            raise self.unknown()

    def unknown(self) -> CompilerError:
        """Return the error for a token that is not expected here."""
        return CompilerError(f"cannot translate this C: {' '.join(self.tokens[max(self.at - 12, 0) : self.at + 1])}")

    def variable(self, name: str) -> CVariable:
        """Return the variable of a name."""
        for scope in reversed(self.scopes):
            if name in scope:
                return scope[name]
        raise self.unknown()

    def text_at(self, word: str) -> int:
        """Return the address of a text."""
        if word not in self._texts:
            content = word[1:-1].encode() + b"\0"
            self._texts[word] = self.module.reserve(len(content), 1)
            self.module.put(self._texts[word], content)
        return self._texts[word]

    # ------------------------------------------------------------------------------------------------------ expressions

    def value(self, wanted: CType) -> None:
        """Read an expression as a value of a type."""
        self.convert(self.expression(), wanted, len(self.code))

    def condition(self) -> None:
        """Read an expression that is not 0 if it holds."""
        if self.expression() == DOUBLE:
            raise self.unknown()

    def convert(self, kind: CType, wanted: CType, end: int) -> None:
        """Convert a value, whose code ends at a place, to a type: integers to doubles; other types must agree."""
        if wanted == DOUBLE and kind == INT:
            self.code[end:end] = TO_DOUBLE
        elif (kind == DOUBLE) != (wanted == DOUBLE) or (wanted == BOOL and kind != BOOL):
            raise self.unknown()

    def expression(self, level: int = _CHOICE) -> Value:
        """Read an expression with operators of at least this level."""
        kind = self._operand()
        while True:
            operator = self.tokens[self.at]
            own = _LEVELS.get(operator, 0)
            if own < level:
                return kind
            self.at += 1
            if own <= _LAST_LOGICAL and kind == DOUBLE:
                raise self.unknown()
            if own == _CHOICE:
                kind = self._choice()
            elif own <= _LAST_LOGICAL:
                self.code += IF + INT.value + (b"" if own == _AND else integer(1) + ELSE)
                self.convert(self.expression(own + 1), BOOL, len(self.code))
                self.code += (ELSE + integer(0) if own == _AND else b"") + END
                kind = BOOL
            else:
                kind = self._operation(operator, own, kind)

    def _operation(self, operator: str, level: int, kind: Value) -> Value:
        """Read the right operand; the left one is on the stack."""
        code = self.code
        end = len(code)
        right = self.expression(level + 1)
        if DOUBLE in (kind, right):
            self.convert(right, DOUBLE, len(code))
            self.convert(kind, DOUBLE, end)
            code += OF_DOUBLES[operator]
            return BOOL if level <= _LAST_COMPARISON else DOUBLE
        if isinstance(kind, Pointer) and level >= _SUM:
            if right != INT or level != _SUM:
                raise self.unknown()
            code += integer(kind.to.size) + OF_INTEGERS["*"]
        code += OF_INTEGERS[operator]
        return BOOL if level <= _LAST_COMPARISON else kind

    def _choice(self) -> Value:
        """Read both values of 'a ? b : c'; the condition is on the stack."""
        code = self.code
        start = len(code)
        code += IF + EMPTY
        kind = self.expression()
        end = len(code)
        self.expect(":")
        code += ELSE
        other = self.expression()
        if DOUBLE in (kind, other):
            self.convert(other, DOUBLE, len(code))
            self.convert(kind, DOUBLE, end)
            kind = DOUBLE
        code[start + 1 : start + 2] = kind.value
        code += END
        return kind

    def _operand(self) -> Value:
        """Read an operand with the signs before it."""
        word = self.tokens[self.at]
        if word == "-":
            return self._negative()
        if word == "!":
            self.at += 1
            if self._operand() == DOUBLE:
                raise self.unknown()
            self.code += IS_ZERO
            return BOOL
        if word == "&":
            self.at += 1
            target = self.target()
            if not isinstance(target, Target) or target.variable is not None:
                raise self.unknown()
            self._add(target.offset)
            return Pointer(target.type)
        constant = self._constant(word)
        return self._part() if constant is None else constant

    def _negative(self) -> Value:
        """Read a minus and its operand; with a number it is one constant."""
        self.at += 1
        word = self.tokens[self.at]
        if word[:1].isdigit() and not word.isdigit():
            self.at += 1
            self.code += double(-float(word))
            return DOUBLE
        start = len(self.code)
        kind = self._operand()
        if kind == DOUBLE:
            self.code += NEGATED
        elif kind == INT:
            self.code[start:start] = integer(0)
            self.code += OF_INTEGERS["-"]
        else:
            raise self.unknown()
        return kind

    def _constant(self, word: str) -> Value | None:
        """Read a word if it is a constant."""
        if word.isdigit() or word in self.integers:
            self.at += 1
            self.code += integer(self.integers[word] if word in self.integers else int(word))
            return BOOL if word in ("true", "false") else INT
        if word[:1].isdigit() or word in _NUMBERS:
            self.at += 1
            self.code += double(_NUMBERS[word] if word in _NUMBERS else float(word))
            return DOUBLE
        if word[:1] == '"':
            self.at += 1
            self.code += integer(self.text_at(word))
            return Pointer(CHAR)
        return None

    def _part(self) -> Value:
        """Read a variable or a part of one, a call, or an expression in brackets."""
        target = self.target()
        if not isinstance(target, Target):
            return target
        if target.variable is not None:
            self.code += get(target.variable)
        elif isinstance(target.type, Array):
            self._add(target.offset)
            return Pointer(target.type.of)
        elif isinstance(target.type, Scalar | Pointer):
            self.code += loading(target.type, target.offset)
        if not isinstance(target.type, Scalar | Pointer):
            raise self.unknown()
        return target.type

    def _add(self, offset: int) -> None:
        if offset:
            self.code += integer(offset) + OF_INTEGERS["+"]

    def target(self) -> Target | Value:
        """Read what can be assigned to; or a call or an expression in brackets, and return the type of its value."""
        word = self.next()
        if word == "(":
            kind = self.expression()
            self.expect(")")
            return kind
        if word == "*":
            kind = self._operand()
            if not isinstance(kind, Pointer):
                raise self.unknown()
            return Target(kind.to, 0)
        if self.tokens[self.at] == "(":
            return self._call(word)
        variable = self.variable(word)
        if not variable.in_memory:
            return self._selected(Target(variable.type, 0, variable.place))
        self.code += integer(0)
        return self._selected(Target(variable.type, variable.place))

    def _selected(self, target: Target) -> Target:
        """Read the indices and names of members after a variable."""
        while self.tokens[self.at] in ("[", ".", "->"):
            word, kind = self.next(), target.type
            if word != "." and isinstance(kind, Pointer):  # the value is the address
                self.code += loading(kind, target.offset) if target.variable is None else get(target.variable)
                target = Target(kind.to, 0)
            elif word == "[" and isinstance(kind, Array):
                target = Target(kind.of, target.offset)
            elif word != ".":
                raise self.unknown()
            if word == "[":
                target = Target(target.type, target.offset + self._index(target.type))
            elif isinstance(target.type, Struct):
                place, kind = target.type.members[self.next()]
                target = Target(kind, target.offset + place)
            else:
                raise self.unknown()
        return target

    def _index(self, kind: CType) -> int:
        """Read an index of items: return the offset of a constant, or add another one to the address on the stack."""
        if self.tokens[self.at].isdigit() and self.tokens[self.at + 1] == "]":
            self.at += 2
            return int(self.tokens[self.at - 2]) * kind.size
        if self.expression() != INT:
            raise self.unknown()
        self.expect("]")
        self.code += integer(kind.size) + OF_INTEGERS["*"] + OF_INTEGERS["+"]
        return 0

    # ------------------------------------------------------------------------------------------------------------ calls

    def _call(self, name: str) -> Value:
        """Read arguments and call a function; what it gets by address is in memory meanwhile."""
        self.expect("(")
        if name in _INSTRUCTIONS:
            self.value(DOUBLE)
            self.expect(")")
            self.code += _INSTRUCTIONS[name]
            return DOUBLE
        callee = self._callee(name)
        after = b""
        for k, kind in enumerate(callee.arguments):
            if name == "snprintf" and self.tokens[self.at] == ")":
                self.code += double(0.0)  # the text has no place for a number
                break
            if k:
                self.expect(",")
            variable = self._addressed()
            if variable is None:
                self.value(kind)
            elif isinstance(variable.type, Scalar | Pointer):
                address = self.module.reserve(variable.type.size)
                self.code += integer(address) + integer(0) + get(variable.place) + storing(variable.type, address)
                after += integer(0) + loading(variable.type, address) + set_to(variable.place)
        self.expect(")")
        self.code += CALL + unsigned(callee.number) + after
        return callee.result

    def _addressed(self) -> CVariable | None:
        """Read an argument if it is the address of a variable of the machine."""
        if self.tokens[self.at] != "&" or self.tokens[self.at + 2] not in (",", ")"):
            return None
        variable = self.variable(self.tokens[self.at + 1])
        if variable.in_memory:
            return None
        self.at += 2
        return variable

    def _callee(self, name: str) -> Callee:
        """Return a function that was read before, or one of the module."""
        if name not in self.callees:
            number = self.module.functions.get(name)
            if number is None:
                raise CompilerError(f"cannot translate a call of {name}, which is unknown")
            arguments, result = self.module.signature(number)
            kinds = {DOUBLE.value: DOUBLE, INT.value: INT, VOID.value: VOID}
            given = tuple(kinds[bytes([one])] for one in arguments)
            self.callees[name] = Callee(number, given, kinds[result])
        return self.callees[name]
