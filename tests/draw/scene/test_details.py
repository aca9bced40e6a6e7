"""Details that are as large as the picture needs: supports, rails, blocks, teeth, hatching."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu.draw.scene import details
from kinfmu.draw.scene.shape import Shape

DOWN = np.array([0.0, -1.0])


def shape(kind: str, *points: tuple[float, float], direction: np.ndarray = DOWN) -> Shape:
    return Shape(kind, "name", "ground", np.array(points), direction=direction)


@pytest.mark.parametrize("size", [0.01, 0.5])
def test_hatching_is_below_the_whole_line(size: float) -> None:
    line = details.rail(shape("rail", (4.0, 1.0), (-2.0, 1.0)), size)  # drawn to the right or to the left
    strokes = details.hatching(line, DOWN, size)
    tops, ends = strokes[:, 0], strokes[:, 1]
    np.testing.assert_allclose(tops[:, 1], line[0, 1])
    assert (ends[:, 1] < tops[:, 1]).all()
    gaps = np.diff(np.sort([*line[:, 0], *tops[:, 0]]))
    assert gaps.max() < 2.0 * np.median(gaps)


def test_a_rail_is_as_far_from_its_line_as_its_block_is_wide() -> None:
    line = details.rail(shape("rail", (0.0, 1.0), (5.0, 1.0)), 0.1)
    np.testing.assert_allclose(line[:, 1], 1.0 - 0.1 * details.BLOCK_WIDTH)
    assert np.ptp(line[:, 0]) > 5.0 + 2.0 * 0.1 * details.BLOCK
    assert details.rail(shape("bed", (0.0, 1.0), (5.0, 1.0)), 0.1)[0, 1] < line[0, 1]


@pytest.mark.parametrize("towards", [(0.0, -1.0), (1.0, 0.0), (-0.6, 0.8)])
def test_a_support_ends_at_its_line_with_the_pin_at_its_tip(towards: tuple[float, float]) -> None:
    direction = np.array(towards)
    triangle, line = details.support(shape("support", (2.0, 3.0), direction=direction), 0.1)
    np.testing.assert_array_equal(triangle[0], [2.0, 3.0])
    for point in (*triangle[1:], *line):
        assert (point - triangle[0]) @ direction == pytest.approx(0.1 * details.SUPPORT)
    np.testing.assert_allclose(line.mean(axis=0), triangle[1:].mean(axis=0))


def test_teeth_are_on_both_sides_of_the_pitch_line_and_smaller_than_their_pinion() -> None:
    rack, radius = shape("rack", (0.0, 0.0), (10.0, 0.0)), 2.0
    corners = details.teeth(rack, details.teeth_size(radius))
    assert 0.0 < corners[:, 1].max() < 0.5 * radius
    assert corners[:, 1].min() < -corners[:, 1].max()  # the back is on the side of the direction
    assert (corners[0, 0], corners[-2, 0]) == (0.0, 10.0)


def test_a_shape_without_direction_is_reported() -> None:
    with pytest.raises(TypeError, match="a shape of kind 'link' has no direction"):
        details.support(Shape("link", "crank", "crank", np.zeros((2, 2))), 1.0)


def test_a_placed_shape_turns_with_its_frame() -> None:
    placed = shape("block", (1.0, 0.0), direction=np.array([1.0, 0.0])).placed(
        {"ground": np.array([2.0, 3.0, np.pi / 2])}
    )
    np.testing.assert_allclose(placed.points, [[2.0, 4.0]], atol=1e-15)
    np.testing.assert_allclose(placed.towards, [0.0, 1.0], atol=1e-15)
