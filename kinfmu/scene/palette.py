"""Colours: one a body, the same in linkage and plots. After Okabe and Ito (2008), safe for colour-blind eyes."""

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
RUNS: tuple[Colour, Colour] = ((213, 94, 0), (86, 180, 233))  # two runs compared
BACKDROP: Colour = (13, 16, 17)  # what lies behind a recording's linkage
OUT_OF_REACH: Colour = (110, 110, 110)
STATUS: tuple[Colour, ...] = (
    (0, 140, 100),
    (230, 159, 0),
    (60, 120, 200),
    (200, 60, 50),
    (170, 50, 120),
    (120, 40, 40),
)  # by kinfmu.solver.python.Status


def body(index: int) -> Colour:
    """Colour of the body at this place of the mechanism file; points of interest go on after the bodies.

    After BODIES they come again darker, then paler; those of the first 21, and these made lighter, are all different.
    """
    turn, place = divmod(index, len(BODIES))
    own = BODIES[place]
    return (own, _mixed(own, (0, 0, 0), 0.3), _mixed(own, (150, 150, 150), 0.6))[turn % 3]


def _mixed(colour: Colour, other: Colour, part: float) -> Colour:
    """The colour with a part of another one in it."""
    red, green, blue = (round(a + part * (b - a)) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def lighter(colour: Colour) -> Colour:
    """The same colour half way to white: y beside x."""
    red, green, blue = ((value + 255) // 2 for value in colour)
    return red, green, blue


def darker(colour: Colour) -> Colour:
    """The same colour for edges and names on white paper."""
    red, green, blue = ((11 * value) // 20 for value in colour)
    return red, green, blue
