"""Tables of text for the terminal."""

from __future__ import annotations

from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]], left: int = 0, indent: str = "  ") -> list[str]:
    """Return rows as lines whose columns are as wide as their cells.

    Args:
        rows: Cells of each row.
        left: Number of columns that are aligned to the left; the others are aligned to the right.
        indent: Begin of each line.

    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if k < left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append(indent + "  ".join(cells).rstrip())
    return lines
