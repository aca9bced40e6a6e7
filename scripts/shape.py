"""Count what a reader of kinfmu holds in the head: packages, floors, arrows, circles, files and lines; judge nothing.

A package stands one floor above the highest package that it imports; an arrow is a pair of packages of which one
imports the other; a circle is a set of files, or of packages, that import each other. Imports inside functions count
too. A file of C imports the headers that it includes. Modules next to the packages have floors, but are no packages
and no ends of arrows.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).parents[1]
ENDINGS = {".py", ".c", ".h", ".js", ".css", ".html"}
SHORT = 60  # lines of a file below which it is counted as short
AS_LARGE_AS_PACKAGES = {"kinfmu/notebook.py"}
PITCH, STOREY, BOX = 110, 64, (90, 30)  # of the picture: distances of packages and floors, size of a package
NEITHER = {"docs", "examples"}  # folders of the checkout that are neither product nor tests

Graph = dict[str, set[str]]


def tracked() -> list[PurePosixPath]:
    """Return the files of code that git tracks."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)  # noqa: S607
    return [path for path in map(PurePosixPath, listed.stdout.splitlines()) if path.suffix in ENDINGS]


def imports_of_python(files: Iterable[PurePosixPath]) -> Graph:
    """Return for each file of Python in the package the files of Python there that it imports."""
    homes = {_module(path): str(path) for path in files if path.suffix == ".py" and path.parts[0] == "kinfmu"}
    return {path: {homes[name] for name in _imported(module, path, homes)} - {path} for module, path in homes.items()}


def _module(path: PurePosixPath) -> str:
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


def _imported(module: str, path: str, homes: Mapping[str, str]) -> set[str]:
    """Return the modules that a file imports: a name taken from a package is that package, unless it is a module."""
    package = module if path.endswith("__init__.py") else module.rpartition(".")[0]
    names = set()
    for node in ast.walk(ast.parse((ROOT / path).read_bytes())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            whole = {f"{base}.{alias.name}" for alias in node.names}
            names |= (whole & homes.keys()) | ({base} if whole - homes.keys() else set())
    return names & homes.keys()


def includes_of_c(files: Iterable[PurePosixPath]) -> Graph:
    """Return for each file of C in the package the headers there that it includes."""
    own = [path for path in files if path.suffix in {".c", ".h"} and path.parts[0] == "kinfmu"]
    known = {path.name: str(path) for path in own}
    graph: Graph = {}
    for path in own:
        text = (ROOT / path).read_text("utf-8")
        included = {PurePosixPath(other).name for other in re.findall(r'^#include "(.+)"', text, re.MULTILINE)}
        graph[str(path)] = {known[other] for other in included & known.keys()}
    return graph


def folders(graph: Graph) -> Graph:
    """Return the graph of the folders of files."""
    merged: Graph = {}
    for path, imported in graph.items():
        here = str(PurePosixPath(path).parent)
        merged.setdefault(here, set()).update({str(PurePosixPath(other).parent) for other in imported} - {here})
    return merged


def place(path: str, depth: int = 2) -> str:
    """Return the package of a file, or the module next to the packages that it is: 'kinfmu/plan', 'kinfmu/units.py'."""
    return "/".join(PurePosixPath(path).parts[:depth])


def places(graph: Graph) -> Graph:
    """Return the graph of packages and modules without the package's own face, `kinfmu/__init__.py`."""
    merged: Graph = {}
    for path, imported in graph.items():
        here = place(path)
        merged.setdefault(here, set()).update({place(other) for other in imported} - {here})
    face = {name for name in merged if name.endswith(("__init__.py", "__main__.py"))}
    return {name: imported - face for name, imported in merged.items() if name not in face}


def circles(graph: Graph) -> list[list[str]]:
    """Return the strongly connected components of more than one member, by Tarjan's algorithm."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    components: list[list[str]] = []

    def visit(node: str) -> None:
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in order:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == order[node]:
            members = stack[stack.index(node) :]
            del stack[-len(members) :]
            if len(members) > 1:
                components.append(sorted(members))

    for node in sorted(graph):
        if node not in order:
            visit(node)
    return components


def floors(graph: Graph) -> dict[str, int]:
    """Return the floor of each package, 1 for those that import none; empty where there is a circle."""
    heights: dict[str, int] = {}
    try:
        for name in TopologicalSorter(graph).static_order():
            heights[name] = 1 + max((heights[other] for other in graph.get(name, ())), default=0)
    except CycleError:
        return {}
    return heights


def needed(graph: Graph) -> set[tuple[str, str]]:
    """Return the arrows that no way through other packages replaces."""
    reached: Graph = {}
    for name in TopologicalSorter(graph).static_order():
        reached[name] = set().union(*({other} | reached[other] for other in graph.get(name, ())))
    return {
        (name, other)
        for name, imported in graph.items()
        for other in imported
        if not any(other in reached[third] for third in imported - {other})
    }


def picture(graph: Graph, heights: Mapping[str, int]) -> str:
    """Return the packages as SVG, a row for each floor, with the arrows that no other way replaces."""
    rows = [sorted(name for name in graph if heights[name] == floor) for floor in range(max(heights.values()), 0, -1)]
    width = PITCH * max(map(len, rows))
    middle = {
        name: ((k + 0.5) * width / len(row), (j + 0.5) * STOREY)
        for j, row in enumerate(rows)
        for k, name in enumerate(row)
    }
    height = STOREY * len(rows)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'font-family="sans-serif" font-size="13" text-anchor="middle" fill="none" stroke="#778">',
        "<style>@media(prefers-color-scheme:dark){rect{fill:#1d2733}text{fill:#dde4ee}}</style>",
        '<marker id="head" markerWidth="8" markerHeight="6" refX="8" refY="3" orient="auto" stroke="none">'
        '<path d="M0 0 8 3 0 6z" fill="#778"/></marker>',
    ]
    for name, other in sorted(needed(graph)):
        (x, y), (to_x, to_y) = middle[name], middle[other]
        y, to_y = y + BOX[1] / 2, to_y - BOX[1] / 2
        bend = (to_y - y) / 2
        parts.append(
            f'<path d="M{x:.0f} {y:.0f}C{x:.0f} {y + bend:.0f} {to_x:.0f} {to_y - bend:.0f} {to_x:.0f} {to_y:.0f}" '
            f'marker-end="url(#head)"/>'
        )
    for name, (x, y) in middle.items():
        box = f'x="{x - BOX[0] / 2:.0f}" y="{y - BOX[1] / 2:.0f}" width="{BOX[0]}" height="{BOX[1]}" rx="4"'
        parts.append(f'<rect {box} fill="#eef3fa"/>')
        label = name.rpartition("/")[2].removesuffix(".py")
        parts.append(f'<text x="{x:.0f}" y="{y + 5:.0f}" fill="#223" stroke="none">{label}</text>')
    return "\n".join([*parts, "</svg>\n"])


def main(target: str = "") -> None:
    """Print the counts, a line each, and the packages from the top floor down; or draw the packages into a file."""
    files = tracked()
    python = imports_of_python(files)
    packages = places(python)
    heights = floors(packages)
    counted = {name for name in packages if not name.endswith(".py") or name in AS_LARGE_AS_PACKAGES}
    if target:
        inner = {name: packages[name] & counted for name in counted}
        (ROOT / target).write_text(picture(inner, floors(inner)), "utf-8")
        return
    lines = {path: (ROOT / path).read_bytes().count(b"\n") for path in files}
    product = {path: n for path, n in lines.items() if path.parts[0] not in {*NEITHER, "tests", "benchmarks"}}
    own = [path for path in product if path.suffix == ".py" and path.parts[0] == "kinfmu"]
    print(f"packages        {len(counted)}")
    print(f"floors          {max(heights.values(), default='none: a circle')}")
    print(f"arrows          {sum(len(packages[name] & counted) for name in counted)}")
    short = sum(product[path] < SHORT for path in own)
    print(f"files           {len(own)}, of which {short} have less than {SHORT} lines")
    print(f"product         {sum(product.values())} lines")
    print(f"tests           {sum(n for path, n in lines.items() if path.parts[0] == 'tests')} lines")
    c = includes_of_c(files)
    graphs = {"packages": packages, "files of Python": python, "files of C": c, "folders of C": folders(c)}
    for name, graph in graphs.items():
        found = circles(graph)
        print(f"circles of {name}: {len(found)}")
        for members in found:
            print(f"  {', '.join(members)}")
    for floor in range(max(heights.values(), default=0), 0, -1):
        print(f"floor {floor:2}  {', '.join(sorted(name for name in packages if heights[name] == floor))}")


if __name__ == "__main__":
    main(*sys.argv[1:])
