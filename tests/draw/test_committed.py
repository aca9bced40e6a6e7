"""The figures in the gallery are equal to those drawn now."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from kinfmu import gallery

NUMBER = re.compile(r"-?\d+\.\d+|-?\d+")
IDENTIFIER = re.compile(r"\b[mp][0-9a-f]{10}\b")  # matplotlib makes them from the bits of what they name
MAKER = re.compile(r"Matplotlib v(\d+\.\d+)")
FAR = 0.02  # [pt]; round-off differs between machines, and is not visible


@pytest.mark.parametrize("name", gallery.names())
def test_the_figure_in_the_gallery_is_current(name: str, gallery_figure: Callable[[str], Path]) -> None:
    import matplotlib as mpl

    there = (gallery.folder() / name / "figure.svg").read_text(encoding="utf-8")
    (maker,) = MAKER.findall(there)
    if not mpl.__version__.startswith(f"{maker}."):
        pytest.skip(f"drawn by matplotlib {maker}, which writes files of its own kind; this is {mpl.__version__}")
    now = gallery_figure(name).read_text(encoding="utf-8")
    (words, numbers), (new_words, new_numbers) = _taken_apart(there), _taken_apart(now)
    assert words == new_words, "scripts/pictures draws it anew"
    assert len(numbers) == len(new_numbers)
    assert max(abs(a - b) for a, b in zip(numbers, new_numbers, strict=True)) < FAR, "scripts/pictures draws it anew"


def _taken_apart(svg: str) -> tuple[list[str], list[float]]:
    """Return the text between the numbers of a file, and the numbers."""
    plain = IDENTIFIER.sub("", MAKER.sub("", svg))
    return NUMBER.split(plain), [float(number) for number in NUMBER.findall(plain)]
