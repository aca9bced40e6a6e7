"""Generated pages: written where they changed, so that Sphinx reads only those again."""

from __future__ import annotations

import re
from pathlib import Path

FOLDERS = ("gallery", "reference")  # of docs/; git ignores them


class Pages:
    """The pages of one build."""

    def __init__(self, source: str | Path) -> None:
        self.source = Path(source)
        self.written: set[Path] = set()

    def write(self, name: str, text: str) -> None:
        """Write a page, such as 'gallery/fourbar.md', if its text is new."""
        path = self.source / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8", newline="\n")
        self.written.add(path)

    def remove_others(self) -> None:
        """Remove pages that an earlier build has written and this one has not."""
        for folder in FOLDERS:
            for path in (self.source / folder).glob("*.md"):
                if path not in self.written:
                    path.unlink()


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a Markdown table."""
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines)


def folded(title: str, content: str) -> str:
    """Return Markdown that a reader opens and closes; it must not contain headings."""
    return f"<details>\n<summary>{coded(title)}</summary>\n\n{content}\n\n</details>\n"


def coded(text: str) -> str:
    """Return text with HTML for its backticks."""
    return re.sub(r"`([^`]*)`", r"<code>\1</code>", text)
