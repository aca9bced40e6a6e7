"""A page for each mechanism of the gallery: figure, report of `check`, file, reference data."""

from __future__ import annotations

import csv
import re
from typing import Any

import kinfmu
from _site.live import FRAME
from _site.pages import Pages, table
from kinfmu.mechanism import gallery

ROWS = 5  # of the reference data on a page
COLUMNS = 6
DIGITS = 15
NEWLINE = "\n"  # blanks at the start of a page are those of a sketch


def write(pages: Pages) -> None:
    """Write the pages of all mechanisms."""
    for name in gallery.names():
        pages.write(f"gallery/{name}.md", _page(name))


def linked(_app: Any, page: str, source: list[str]) -> None:
    """Lead links from a mechanism's folder to its page, offer examples as files, list the gallery (a Sphinx event)."""
    up = "../" * page.count("/")
    source[0] = re.sub(r"\]\(\.\./fmus/(\w+)/README\.md\)", rf"]({up}gallery/\1.md)", source[0])
    source[0] = re.sub(r"\[([^]]+)\]\((\.\./examples/[\w/.]+)\)", r"{download}`\1 <\2>`", source[0])
    if page == "gallery":
        names = "\n".join(f"gallery/{name}" for name in gallery.names())
        source[0] += f"\n```{{toctree}}\n:hidden:\n\n{names}\n```\n"


def _page(name: str) -> str:
    folder = gallery.folder() / name
    title, text = (folder / "README.md").read_text(encoding="utf-8").split("\n", 1)
    up = f"../../fmus/{name}"
    return f"""{title}

![{title.lstrip("# ")}]({up}/figure.svg)

{{download}}`Mechanism file <{up}/mechanism.toml>` · {{download}}`Reference data <{up}/reference.csv>` ·
{{download}}`Figure <{up}/figure.svg>`

{text.strip(NEWLINE)}

## Drag it

{FRAME.format(name=name)}
## What `check` reports

    kinfmu check {name}

```text
{kinfmu.check(kinfmu.load(name))}
```

## The file

    kinfmu new {name} mine.toml        # a copy, to edit
    kinfmu build {name}                # its FMU

```{{literalinclude}} {up}/mechanism.toml
:language: toml
```

## Reference data

{_reference(name)}
"""


def _reference(name: str) -> str:
    with (gallery.folder() / name / "reference.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    chosen = slice(0, COLUMNS)
    shown = [tuple(_rounded(cell) for cell in row[chosen]) for row in rows[:ROWS]]
    return (
        f"{len(rows)} samples of {len(head) - 1} columns in 20 digits, from closed forms in 50 digits. The first "
        f"{len(shown)}, with the first {min(COLUMNS, len(head))} columns rounded to {DIGITS} digits:\n\n"
        + table(tuple(f"`{cell}`" for cell in head[chosen]), shown)
    )


def _rounded(cell: str) -> str:
    return f"{float(cell):.{DIGITS}g}"
