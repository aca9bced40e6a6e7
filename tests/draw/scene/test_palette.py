"""Colours that distinguish bodies."""

from __future__ import annotations

import pytest

from kinfmu.draw.overlay import MOST_CURVES, curve_colour
from kinfmu.draw.scene import palette


def test_the_first_bodies_have_the_plain_colours() -> None:
    assert tuple(map(palette.body, range(7))) == palette.BODIES


def test_twenty_one_bodies_have_different_colours_in_x_and_y() -> None:
    plain = [palette.body(index) for index in range(21)]
    found = [*plain, *map(palette.lighter, plain)]
    apart = [max(abs(a - b) for a, b in zip(one, other, strict=True)) for one in found for other in found]
    assert sorted(apart)[len(found)] > 8  # the smallest are of each with itself


def test_colours_are_repeated_without_end() -> None:
    assert palette.body(1021) == palette.body(1000)


def test_lines_on_white_paper_have_the_contrast_of_wcag() -> None:
    white = (255, 255, 255)
    assert palette.contrast((0, 0, 0), white) == 21.0
    assert palette.contrast((119, 119, 119), white) == pytest.approx(4.48, abs=0.005)  # the usual example of a grey
    for index in range(21):
        colour = palette.body(index)
        found = palette.on_white(colour)
        assert palette.contrast(found, white) >= 3.0
        assert (found == colour) == (palette.contrast(colour, white) >= 3.0)


def test_curves_of_a_panel_are_all_visible_and_all_different() -> None:
    colours = [curve_colour(index) for index in range(MOST_CURVES)]
    assert min(palette.contrast(colour, (255, 255, 255)) for colour in colours) >= 3.0
    assert len(set(colours)) == MOST_CURVES
