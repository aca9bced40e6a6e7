"""An example of every type of mechanism-files.md, from examples.toml: lines and a picture, in the site."""

from __future__ import annotations

import re
import tomllib
from base64 import b64encode
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

import kinfmu
from _site import formulas, live
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse

PAGE = "mechanism-files"
SIZE = (180, 130)  # [px] of a picture
HEAD = """\
name = "example"
units.length = "mm"
run = {{ stop = {stop}, step = 0.01 }}
bodies.ground.points = {{ O = [0, 0], C = [70, 0], G = [0, 10], B = [0, -20] }}
"""
HEADING = re.compile(r"^### `([\w-]+)`\n\n(.+)\n", re.MULTILINE)  # of a type, with its summary
FORMULA = re.compile(r"^    (.+)\n+", re.MULTILINE)
LEGEND = "Pictures: the value (thick, blue), its rate (green) and its acceleration (red) over time, each scaled.\n\n"
SECTION = re.compile(r"(?<=<!-- generated: )(joints|drivers|loads|measures|laws)( -->.*?)(?=<!-- end)", re.DOTALL)


@cache
def examples() -> dict[str, Any]:
    """Return the tables of examples.toml."""
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def shown(group: str, name: str) -> str:
    """Return the lines that the page shows."""
    return str(examples()[group][name]["shown"]).strip()


def mechanism(group: str, name: str) -> Mechanism:
    """Return the mechanism of an example."""
    one = examples()[group][name]
    parts = one.get("parts", ["crank"] if group == "laws" else [])
    lines = [HEAD.format(stop=2 if group == "laws" else 1), *(examples()["parts"][part] for part in parts)]
    return parse("".join([*lines, one.get("rest", ""), one["shown"]]), f"{name}.toml")


def drawn(group: str, name: str) -> str:
    """Return the picture of an example, as SVG: the mechanism, or the curve of a law."""
    shown = mechanism(group, name)
    return _curves(name, kinfmu.solve(shown)) if group == "laws" else live.drawn(shown, SIZE)


def _curves(name: str, run: kinfmu.Run) -> str:
    """Return a law over time (strong) with its rate and acceleration (thin), each scaled to the picture."""
    curves = [run[f"crank.{column}"] for column in ("phi", "omega", "alpha")]
    width, height = SIZE
    lines = []
    for values, style in zip(curves, ('#0072b2" stroke-width="3', "#009e73", "#d55e00"), strict=True):
        largest = np.abs(values).max() or 1.0
        y = 0.5 * height - 0.42 * height * values / largest
        points = " ".join(f"{x:.1f},{at:.1f}" for x, at in zip(np.linspace(4, width - 4, len(y)), y, strict=True))
        lines.append(f'<polyline points="{points}" stroke="{style}"/>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" fill="none" '
        f'stroke-width="1.3" aria-label="{escape(name)} over time, with rate and acceleration">'
        f'<path d="M4 {0.5 * height}H{width - 4}" stroke="#888"/>{"".join(reversed(lines))}</svg>\n'
    )


def added(_app: Any, page: str, source: list[str]) -> None:
    """Put the example of each type under its summary, and set formulas as formulas (a Sphinx event)."""
    if page != PAGE:
        return

    def section(found: re.Match[str]) -> str:
        text = FORMULA.sub(lambda one: f"$$\n{formulas.latex(one[1])}\n$$\n\n", found[2])
        text = text.replace("### `", f"{LEGEND}### `", 1) if found[1] == "laws" else text
        return found[1] + HEADING.sub(lambda one: _example(found[1], one[1], one[2]), text)

    source[0] = SECTION.sub(section, source[0])


def _image(group: str, name: str) -> str:
    """Return the picture as an element that holds it; as an image it has its own dark colours."""
    data = b64encode(drawn(group, name).encode()).decode()
    return f'<img class="example dark-light" alt="Example of {name}" src="data:image/svg+xml;base64,{data}">'


def _example(group: str, name: str, summary: str) -> str:
    """Return the heading of a type with picture, summary and lines; quantities and measures have no picture."""
    image = "" if group == "measures" else f"```{{raw}} html\n{_image(group, name)}\n```\n\n"
    return f"### `{name}`\n\n{image}{summary}\n\n```toml\n{shown(group, name)}\n```\n"
