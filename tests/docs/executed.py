"""Pages whose Python runs, block after block, and prints the text blocks below it."""

from __future__ import annotations

import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

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
