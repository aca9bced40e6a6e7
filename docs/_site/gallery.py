"""The gallery as cards, and a page for each mechanism: live, figure, report of `check`, file, reference data."""

from __future__ import annotations

import csv
import re
from html import escape
from typing import Any

import kinfmu
from _site.live import FRAME
from _site.pages import Pages, coded, folded, table
from kinfmu.mechanism import gallery

ROWS = 5  # of the reference data on a page
COLUMNS = 6
DIGITS = 15
FIGURE = re.compile(r"!\[[^]]*\]\(figure\.svg\)\n\n")  # of the page in the mechanism's folder
ROW = re.compile(r"^\| \[`(\w+)`\]\(\.\./fmus/\w+/README\.md\) \| (.+?) \| (.+) \|\n", re.MULTILINE)
TABLE = re.compile(rf"^\| name \|.*\n\|[-|]+\n((?:{ROW.pattern})+)", re.MULTILINE)


def write(pages: Pages) -> None:
    """Write the pages of all mechanisms."""
    for name in gallery.names():
        pages.write(f"gallery/{name}.md", _page(name))


def linked(_app: Any, page: str, source: list[str]) -> None:
    """Lead links from a mechanism's folder to its page, offer examples as files, make cards (a Sphinx event)."""
    up = "../" * page.count("/")
    if page == "gallery":
        names = "\n".join(f"gallery/{name}" for name in gallery.names())
        cards = TABLE.sub(lambda rows: _cards(rows[1]), source[0])
        source[0] = f"{cards}\n```{{toctree}}\n:hidden:\n\n{names}\n```\n"
    source[0] = re.sub(r"\]\(\.\./fmus/(\w+)/README\.md\)", rf"]({up}gallery/\1.md)", source[0])
    source[0] = re.sub(r"\[([^]]+)\]\((\.\./examples/[\w/.]+)\)", r"{download}`\1 <\2>`", source[0])


def _cards(rows: str) -> str:
    """Return rows of the table as cards; `live.write` draws their pictures."""
    cards = "\n".join(
        f'<a class="card" href="gallery/{name}.html">'
        f'<img src="gallery/live/{name}.svg" class="dark-light" loading="lazy" alt="">'
        f"<strong>{escape(title)}</strong> <code>{name}</code><span>{coded(escape(words))}</span></a>"
        for name, title, words in ROW.findall(rows)
    )
    return f'```{{raw}} html\n<div class="cards">\n{cards}\n</div>\n```\n'


def _page(name: str) -> str:
    folder = gallery.folder() / name
    title, text = (folder / "README.md").read_text(encoding="utf-8").split("\n\n", 1)
    up = f"../../fmus/{name}"
    report = f"    kinfmu check {name}\n\n```text\n{kinfmu.check(kinfmu.load(name))}\n```"
    file = f"""    kinfmu new {name} mine.toml   # a copy, to edit
    kinfmu build {name}           # its FMU

```{{literalinclude}} {up}/mechanism.toml
:language: toml
```"""
    return f"""{title}

{FRAME.format(name=name)}
{FIGURE.sub("", text).strip()}

{{download}}`Mechanism file <{up}/mechanism.toml>` · {{download}}`Reference data <{up}/reference.csv>` ·
{{download}}`Figure <{up}/figure.svg>`

{folded("Figure with names", f"![{title.lstrip('# ')}]({up}/figure.svg)")}
{folded("Report of `kinfmu check`", report)}
{folded("The file", file)}
{folded("Reference data", _reference(name))}"""


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
