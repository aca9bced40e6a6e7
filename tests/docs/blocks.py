"""The blocks of a page in their order: commands to type, Python, files, and what is shown between them.

`python -m tests.docs.blocks` prints the words of each page.
"""

from __future__ import annotations

import re
import shlex
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = {  # README.md and the pages of docs by their name, others by their path
    page.name if page.parent in (ROOT, DOCS) else page.relative_to(ROOT).as_posix(): page
    for page in (
        ROOT / "README.md",
        *sorted([*DOCS.glob("*.md"), *ROOT.glob("fmus/*/*.md"), *ROOT.glob("examples/*/*.md")]),
    )
}

PROGRAMS = (
    "kinfmu",
    "python",
    "fmpy",
    "ecos",
    "cosim",
    "pip",
    "source",
)  # a line that begins so, or with scripts/, is typed
_BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$|((?:^    [^\n]*\n)+)", re.DOTALL | re.MULTILINE)


class Block(NamedTuple):
    """A block of a page."""

    kind: str  # "commands", the language of a fenced block, "" without a language, "indented" for any other
    text: str
    file: str = ""  # name of the file that the paragraph above announces

    @property
    def head(self) -> str:
        """The first line, by which lists name the block."""
        return self.text.strip().partition("\n")[0]


def is_typed(line: str) -> bool:
    """Return whether the line is a command."""
    return line.startswith("scripts/") or line.partition(" ")[0] in PROGRAMS


def blocks(page: str) -> list[Block]:
    """Return the blocks of a page; directives of the site, such as a table of contents, are none."""
    found = []
    for match in _BLOCK.finditer(page):
        if match[3] is not None:
            lines = [line[4:] for line in match[3].splitlines()]
            kind = "commands" if is_typed(lines[0]) else "indented"
            found.append(Block(kind, "\n".join(lines) + "\n"))
        elif not match[1].startswith("{"):
            (above,) = page[: match.start()].rstrip().split("\n\n")[-1:]
            names = re.findall(r"`([\w.]+\.(?:toml|csv|py))`", above)
            found.append(Block(match[1], match[2], names[-1] if above.endswith(":") and names else ""))
    return found


def commands(block: Block) -> list[str]:
    """Return the lines of a block of commands without comments."""
    return [shlex.join(shlex.split(line, comments=True)) for line in block.text.splitlines() if line.strip()]


def words(page: str) -> int:
    """Return the number of words of a page, in its text, tables and blocks; signs alone are none."""
    return sum(any(map(str.isalnum, word)) for word in page.split())


# ------------------------------------------------------------------------------------------------------------- executed


BLOCK = re.compile(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```\n)?", re.DOTALL)


def executed(path: Path) -> str:
    """Return the page with the text below each block of Python as the block prints it; blocks share their names."""
    names: dict[str, object] = {}

    def run(block: re.Match[str]) -> str:
        printed = StringIO()
        with redirect_stdout(printed):
            exec(compile(block[1], path.name, "exec"), names)  # noqa: S102  our own page
        assert (block[2] is None) == (printed.getvalue() == ""), f"{path.name}: what this prints is shown:\n{block[1]}"
        return block[0] if block[2] is None else f"```python\n{block[1]}```\n\n```text\n{printed.getvalue()}```\n"

    return BLOCK.sub(run, path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    counts = {path.name: words(path.read_text(encoding="utf-8")) for path in sorted(DOCS.glob("*.md"))}
    print(
        "\n".join(f"{count:6} {name}" for name, count in counts.items()),
        f"{sum(counts.values()):6} words in docs",
        sep="\n",
    )
