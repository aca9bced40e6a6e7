"""What an SVG of matplotlib shows: lines and areas with their colours, and texts, whatever version wrote the file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

SVG, HREF = "{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}href"
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
SHAPE_APART = 0.02  # [pt]; round-off differs between machines, and is not visible
TEXT_APART = 2.0  # [pt]; versions of matplotlib measure the height of letters differently
_LOOK = ("fill", "stroke", "stroke-width", "stroke-dasharray")


@dataclass(frozen=True, eq=False)
class Shape:
    """A line or area: look: colours, width, dashes; verbs: of its parts, such as 'MLLz'; points: (k, 2) [pt]."""

    look: str
    verbs: str
    points: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Text:
    """A text: look: its letters, colour, size and style; at: (2,) [pt]."""

    look: str
    at: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Picture:
    """Shapes and texts in the order in which they are drawn; size: (2,) [pt]."""

    size: NDArray[np.float64]
    shapes: tuple[Shape, ...]
    texts: tuple[Text, ...]


def picture(path: Path) -> Picture:
    """Read an SVG."""
    root = ET.parse(path).getroot()  # noqa: S314  ours
    size = np.array([float(root.attrib[side].removesuffix("pt")) for side in ("width", "height")])
    defined = {element.attrib["id"]: element for element in root.iter(f"{SVG}path") if "id" in element.attrib}
    return Picture(size, tuple(_shapes(root, defined)), tuple(map(_text, root.iter(f"{SVG}text"))))


def differences(one: Picture, other: Picture) -> list[str]:
    """Return what differs between two pictures, a line for each shape and text; empty if nothing does."""
    found = []
    if np.abs(one.size - other.size).max() > SHAPE_APART:
        found.append(f"size: {one.size} and {other.size}")
    if len(one.shapes) != len(other.shapes):
        found.append(f"{len(one.shapes)} and {len(other.shapes)} shapes")
    if len(one.texts) != len(other.texts):
        found.append(f"{len(one.texts)} and {len(other.texts)} texts")
    for k, (a, b) in enumerate(zip(one.shapes, other.shapes, strict=False)):
        if (a.look, a.verbs) != (b.look, b.verbs):
            found.append(f"shape {k}: {a.look} {a.verbs} and {b.look} {b.verbs}")
        elif np.abs(a.points - b.points).max() > SHAPE_APART:
            found.append(f"shape {k}: {a.look} at {a.points[0]} and {b.points[0]}")
    for mine, its in zip(one.texts, other.texts, strict=False):
        if mine.look != its.look:
            found.append(f"text: {mine.look} and {its.look}")
        elif np.abs(mine.at - its.at).max() > TEXT_APART:
            found.append(f"text: {mine.look} at {mine.at} and {its.at}")
    return found


def _shapes(root: ET.Element, defined: Mapping[str, ET.Element]) -> Iterator[Shape]:
    """Yield the paths that are drawn, not those that are only defined, and the defined ones where they are used."""
    passive = {id(path) for part in (f"{SVG}defs", f"{SVG}clipPath") for one in root.iter(part) for path in one.iter()}
    for element in root.iter():
        if element.tag == f"{SVG}path" and id(element) not in passive:
            yield _shape(element, element, np.zeros(2))
        elif element.tag == f"{SVG}use":
            at = np.array([float(element.attrib[axis]) for axis in "xy"])
            yield _shape(element, defined[element.attrib[HREF].removeprefix("#")], at)


def _shape(element: ET.Element, path: ET.Element, at: NDArray[np.float64]) -> Shape:
    style = _style(element)
    text = path.attrib["d"]
    points = np.array([float(number) for number in NUMBER.findall(text)]).reshape(-1, 2) + at
    look = " ".join(f"{key}: {style[key]};" for key in _LOOK if key in style)
    return Shape(look, "".join(re.findall("[A-Za-z]", re.sub(r"e-?\d", "", text))), points)


def _text(element: ET.Element) -> Text:
    style = _style(element)
    font = style.get("font", f"{style.get('font-style', '')} {style.get('font-size', '')}")
    size = re.search(r"[\d.]+px", font)
    look = f"'{element.text}' {style['fill']} {size and size[0]}{' italic' * ('italic' in font)}"
    if "x" in element.attrib:
        return Text(look, np.array([float(element.attrib["x"]), float(element.attrib["y"])]))
    (x, y), *_ = np.array([float(number) for number in NUMBER.findall(element.attrib["transform"])]).reshape(-1, 2)
    return Text(look, np.array([x, y]))


def _style(element: ET.Element) -> dict[str, str]:
    pairs = (entry.split(":") for entry in element.attrib.get("style", "").split(";") if entry.strip())
    return {key.strip(): value.strip() for key, value in pairs}
