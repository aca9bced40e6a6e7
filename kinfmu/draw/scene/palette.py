"""Colours: one for each body, the same in linkage and plots; distinguishable by the colour-blind (Okabe, Ito 2008)."""

from __future__ import annotations

Colour = tuple[int, int, int]

BODIES: tuple[Colour, ...] = (
    (230, 159, 0),
    (86, 180, 233),
    (0, 178, 130),
    (204, 121, 167),
    (213, 94, 0),
    (60, 120, 200),
    (240, 228, 66),
)
GROUND: Colour = (150, 150, 150)
BAR: Colour = (190, 190, 190)
PIN: Colour = (235, 235, 235)
LOAD: Colour = (126, 34, 206)
DRIVER: Colour = (185, 28, 28)
INK: Colour = (40, 40, 40)
WHITE: Colour = (255, 255, 255)
DARK: Colour = (18, 23, 29)  # paper of dark pages
RUNS: tuple[Colour, Colour] = ((213, 94, 0), (86, 180, 233))  # two runs compared
STATUS: tuple[Colour, ...] = (
    (0, 140, 100),
    (230, 159, 0),
    (60, 120, 200),
    (200, 60, 50),
    (170, 50, 120),
    (120, 40, 40),
)  # by kinfmu.solver.python.Status


LEAST_CONTRAST = 3.0  # of lines to their background, WCAG 2.2, 1.4.11
# What the colour of a thing is mixed with for its strokes, and how much of it, on white paper and on dark paper.
ROLES: dict[str, tuple[tuple[Colour, float], tuple[Colour, float]]] = {
    "own": (((0, 0, 0), 0.0), (WHITE, 0.45)),
    "edge": (((0, 0, 0), 0.45), (WHITE, 0.25)),
    "fill": ((WHITE, 0.5), (DARK, 0.55)),
    "pale": ((WHITE, 0.82), (DARK, 0.78)),
    "paper": ((WHITE, 1.0), (DARK, 1.0)),
    "ink": ((INK, 1.0), ((232, 237, 243), 1.0)),
}


def tint(role: str, colour: Colour, *, is_dark: bool = False) -> Colour:
    """Return the colour of a stroke: of a role of ROLES, for a thing of a colour, on white or on dark paper."""
    return _mixed(colour, *ROLES[role][is_dark])


def body(index: int) -> Colour:
    """Return the colour of a body by its index in the mechanism file; points of interest follow after the bodies.

    The colours of BODIES are repeated darker, then paler. The first 21 and their lighter versions are all different.
    """
    turn, place = divmod(index, len(BODIES))
    own = BODIES[place]
    return (own, _mixed(own, (0, 0, 0), 0.3), _mixed(own, (150, 150, 150), 0.6))[turn % 3]


def _mixed(colour: Colour, other: Colour, part: float) -> Colour:
    """Return a mixture of two colours; part: of the other one."""
    red, green, blue = (round(a + part * (b - a)) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def lighter(colour: Colour) -> Colour:
    """Return the colour halfway to white, such as for y next to x."""
    return tint("fill", colour)


def darker(colour: Colour) -> Colour:
    """Return the colour for edges and names on white paper."""
    return tint("edge", colour)


def on_white(colour: Colour) -> Colour:
    """Return the colour for lines on white paper: as it is or, below the least contrast, darker."""
    found = colour
    while contrast(found, (255, 255, 255)) < LEAST_CONTRAST:
        found = _mixed(found, (0, 0, 0), 0.04)
    return found


def contrast(a: Colour, b: Colour) -> float:
    """Return the contrast of two colours, 1 to 21, as WCAG 2.2 defines it."""
    high, low = sorted(map(_luminance, (a, b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: Colour) -> float:
    parts = [value / 255.0 for value in colour]
    red, green, blue = (x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def grey(colour: Colour) -> Colour:
    """Return the grey that is as light as a colour."""
    value = sum(colour) // 3
    return value, value, value


def hexadecimal(colour: Colour) -> str:
    """Return a colour as '#1c2430'."""
    return "#" + "".join(f"{value:02x}" for value in colour)
