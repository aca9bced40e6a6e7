"""Outlines of links."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu.draw.scene.shape import ribs, rim


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([(0, 0)], [(0, 0)]),
        ([(1, 0), (0, 0)], [(0, 0), (1, 0)]),
        ([(0, 0), (2, 2), (1, 1)], [(0, 0), (1, 1), (2, 2)]),
        ([(0, 0), (4, 0), (0, 4)], [(0, 0), (4, 0), (0, 4)]),
    ],
    ids=["point", "bar", "three-in-a-line", "triangle"],
)
def test_a_link_is_drawn_through_all_its_points(points: list[tuple[int, int]], expected: list[tuple[int, int]]) -> None:
    drawn, is_closed = rim(np.array(points, dtype=float))
    if not is_closed:  # a line has two directions
        drawn = drawn[np.lexsort(drawn.T)]
    np.testing.assert_array_equal(drawn, expected)
    assert not len(ribs(np.array(points, dtype=float)))


def test_a_point_inside_a_plate_is_joined_to_the_nearest_corner() -> None:
    points = np.array([(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (1.0, 1.0), (2.5, 1.0)])
    np.testing.assert_array_equal(ribs(points), [[(0, 0), (1, 1)], [(4, 0), (2.5, 1)]])


def test_the_rim_of_a_link_is_around_its_points_or_along_them() -> None:
    corners, is_closed = rim(np.array([(0.0, 4.0), (1.0, 1.0), (4.0, 0.0), (0.0, 0.0)]))
    assert is_closed
    np.testing.assert_array_equal(corners, [(0, 0), (4, 0), (0, 4)])
    corners, is_closed = rim(np.array([(2.0, 0.0), (1.0, 0.0), (1.0, 0.0)]))
    assert not is_closed
    np.testing.assert_array_equal(corners, [(1, 0), (2, 0)])
