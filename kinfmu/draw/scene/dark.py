"""SVG that is light or dark as the page around it is: its colours, and for dark pages others in their place."""

from __future__ import annotations

import colorsys
import re
from functools import cache

from kinfmu.draw.scene import palette

_COLOUR = re.compile(r'(fill|stroke)(: |=")(#[0-9a-f]{6})')
_LOWEST, _HIGHEST = 0.09, 0.93  # lightness of white and of black on dark pages
_LEAST, _MOST = 4.5, 9.0  # contrast of a line to dark paper, between which its colour stays
_PALE = 217  # lightness of an area from which its colour does not stay, of 255
_SCOPE = ":root:is(svg,.kinfmu)"  # an image, or a page of kinfmu that holds it


def with_dark_colours(svg: str) -> str:
    """Return an SVG with a style sheet that gives its lines, areas and texts other colours on dark pages.

    Of an image in a page that is its `color-scheme`, of a file the browser's.
    """
    rules = [f"text{{fill:{palette.hexadecimal(on_dark(palette.INK))}}}"]  # of those without a colour of their own
    for key, mark, colour in sorted(set(_COLOUR.findall(svg))):
        red, green, blue = bytes.fromhex(colour[1:])
        selector = f'[style*="{key}: {colour}"]' if mark == ": " else f'[{key}="{colour}"]'
        dark = palette.hexadecimal(on_dark((red, green, blue), is_area=key == "fill"))
        rules.append(f"{selector}{{{key}:{dark}!important}}")
    style = f"<style>@media(prefers-color-scheme:dark){{{_SCOPE}{{\n{chr(10).join(rules)}\n}}}}</style>"
    start = svg.index(">", svg.index("<svg")) + 1
    return f"{svg[:start]}{style}{svg[start:]}"


@cache
def on_dark(colour: palette.Colour, *, is_area: bool = False) -> palette.Colour:
    """Return the colour on dark paper of what has a colour on white paper.

    That of a body's stroke has the same role. Others keep their hue, and their lightness is turned round, unless both
    papers allow it: that of areas but for pale ones, and of lines by their contrast.
    """
    known = _of_roles().get(colour)
    if known is not None:
        return known
    of_lines = _LEAST <= palette.contrast(colour, palette.DARK) <= _MOST
    if len({*colour}) > 1 and (max(colour) + min(colour) < 2 * _PALE if is_area else of_lines):
        return colour
    hue, lightness, saturation = colorsys.rgb_to_hls(*(value / 255.0 for value in colour))
    red, green, blue = colorsys.hls_to_rgb(hue, _HIGHEST - (_HIGHEST - _LOWEST) * lightness, saturation)
    return round(255 * red), round(255 * green), round(255 * blue)


@cache
def _of_roles() -> dict[palette.Colour, palette.Colour]:
    """Return the colours of strokes on dark paper by those on white paper."""
    own = (palette.LOAD, palette.DRIVER)
    things = [*map(palette.body, range(3 * len(palette.BODIES))), palette.GROUND, palette.BAR, *own]
    return {
        palette.tint(role, thing): palette.tint(role, thing, is_dark=True)
        for role in reversed(palette.ROLES)
        for thing in things
        if role != "own" or thing in own
    }
