"""No module of kinfmu imports itself by way of others: at run time, in functions, or for types only."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
FILES = sorted((CHECKOUT / "kinfmu").rglob("*.py"))


def module_of(path: Path) -> str:
    parts = path.relative_to(CHECKOUT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in FILES}


def imported(path: Path) -> Iterator[str]:
    package = module_of(path).split(".") if path.name == "__init__.py" else module_of(path).split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names if name.name in MODULES)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join([*package[: len(package) + 1 - node.level], *([node.module] if node.module else [])])
            source = base if node.level else str(node.module)
            for name in node.names:
                submodule = f"{source}.{name.name}"
                yield from [submodule] if submodule in MODULES else [source] if source in MODULES else []


@pytest.mark.long
def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {name: set(imported(path)) - {name} for name, path in MODULES.items()}
    assert "kinfmu.errors" in graph["kinfmu.fmu.host.simulate"]
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(reversed(error.args[1])))
