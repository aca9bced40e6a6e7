"""C text: numbers, strings, arrays, declarations."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from types import ModuleType

from kinfmu.codegen.lists import Lists
from kinfmu.codegen.writer import Names
from kinfmu.plan.equations.graph import Node

_WIDTH = 110

Places = dict[Node | str, str]  # where functions find operations, and symbols by their names
FUNCTIONS = {"sin": "kf_sin", "cos": "kf_cos", "sincos": "kf_sincos", "atan2": "kf_atan2"}  # of solver/c/sincos.h


def wrapped(head: str, items: Sequence[str], tail: str, indent: str = "    ") -> list[str]:
    """Return 'head a, b, c tail', broken into lines."""
    lines, line = [], head
    for k, item in enumerate(items):
        piece = item if k == len(items) - 1 else f"{item},"
        if len(line) + len(piece) + 1 > _WIDTH and line.strip():
            lines.append(line.rstrip())
            line = indent
        line += piece if line.endswith(("{", "(", indent)) else f" {piece}"
    return [*lines, line + tail]


def string(text: str) -> str:
    """Return a string literal. Names are ASCII letters, digits, underscores and full stops: nothing needs escaping."""
    return f'"{text}"'


def array(declaration: str, items: Iterable[object]) -> list[str]:
    """Return 'const double a[2] = {1.0, 2.0};' for 'double a' and its items; an empty array has one item, zero."""
    texts = [repr(item) if isinstance(item, float) else str(item) for item in items]
    storage = "static const" if declaration.startswith("static ") else "const"
    declaration = declaration.removeprefix("static ")
    return wrapped(f"{storage} {declaration}[{max(len(texts), 1)}] = {{", texts or ["0"], "};")


def defines(prefix: str, modules: Iterable[ModuleType]) -> list[str]:
    """Return the constants of modules that are one number, by name. A name with two values does not compile."""
    numbers = {(k.strip("_"), x) for each in modules for k, x in vars(each).items() if type(x) in (int, float)}
    return [f"#define {prefix}{name} ({number!r})" for name, number in sorted(numbers) if name.isupper()]


def header(name: str, comment: str, lines: Iterable[str]) -> str:
    """Return a header, with a guard of its name."""
    guard = f"KF_{name.upper()}_H"
    return "\n".join([f"/* {comment} */", f"#ifndef {guard}", f"#define {guard}", "", *lines, "", "#endif", ""])


def booleans(values: Iterable[object]) -> list[str]:
    """Return 'true' or 'false' for each value."""
    return ["true" if value else "false" for value in values]


def declared(names: Iterable[str]) -> list[str]:
    """Return 'double a, b;' for names, each once; no lines for no names."""
    unique = list(dict.fromkeys(names))
    return wrapped("double", unique, ";", "       ") if unique else []


def assigned(lines: Iterable[str]) -> list[str]:
    """Return the names that the statements of a function assign."""
    found = [re.match(r"\s*(\w+) = |\s*kf_sincos\(.*, &(\w+), &(\w+)\);", line) for line in lines]
    return [name for match in found if match for name in match.groups() if name]


def model_places(lists: Lists) -> Places:
    """Return where functions find the parameters, and what depends on them alone."""
    places: Places = {node: f"model->derived[{k}]" for node, k in lists.derived.items()}
    return places | {name: f"model->parameters[{k}]" for name, k in lists.parameters.items()}


def loads(names: Names, nodes: Iterable[Node], places: Places, held: Callable[[Node], str]) -> list[str]:
    """Return assignments of what statements read and do not compute; held: gives the places of other operations."""
    found = [(node, places.get(node.name if node.op == "symbol" else node)) for node in nodes]
    return [f"{names.of(node)} = {held(node) if place is None else place};" for node, place in found]


def indented(lines: Iterable[str]) -> list[str]:
    """Return the lines indented by one step."""
    return [f"    {line}" for line in lines]


def ended(lines: Iterable[str]) -> list[str]:
    """Return statements with their ends; those that end in a bracket or a comment have theirs."""
    return [line if line.endswith((";", "{", "}", ",", "*/")) else f"{line};" for line in lines]


def function(signature: str, lines: Sequence[str], variables: Sequence[str] = ()) -> list[str]:
    """Return a function and an empty line; names that its statements assign are declared as double.

    Arguments that it leaves unused are marked as unused. lines: statements, with or without their ends; variables:
    further declarations.
    """
    lines = ended(lines)
    words = set(re.findall(r"\w+", " ".join([*variables, *lines])))
    unused = [f"(void){name};" for name in re.findall(r"(\w+)[,)]", signature) if name not in words]
    return [signature, "{", *indented([*declared(assigned(lines)), *variables, *unused, *lines]), "}", ""]


def filled(array: str, texts: Iterable[str]) -> list[str]:
    """Return the assignments of expressions to the items of an array."""
    return [f"{array}[{k}] = {text}" for k, text in enumerate(texts)]


def repeated(count: int, lines: Sequence[str]) -> list[str]:
    """Return the lines, in a loop over k if the count is more than 1."""
    return list(lines) if count == 1 else [f"for (k = 0; k < {count}; ++k) {{", *indented(lines), "}"]
