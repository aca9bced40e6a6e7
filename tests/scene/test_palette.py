"""Colours that distinguish bodies."""

from __future__ import annotations

from kinfmu.scene import palette


def test_the_first_bodies_have_the_plain_colours() -> None:
    assert tuple(map(palette.body, range(7))) == palette.BODIES


def test_twenty_one_bodies_have_different_colours_in_x_and_y() -> None:
    plain = [palette.body(index) for index in range(21)]
    found = [*plain, *map(palette.lighter, plain)]
    apart = [max(abs(a - b) for a, b in zip(one, other, strict=True)) for one in found for other in found]
    assert sorted(apart)[len(found)] > 8  # the smallest are of each with itself


def test_colours_are_repeated_without_end() -> None:
    assert palette.body(1021) == palette.body(1000)
