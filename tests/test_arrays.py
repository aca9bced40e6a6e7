"""Arrays without values, and finite numbers."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu import arrays
from kinfmu.arrays import finite, new_numbers


@pytest.mark.parametrize("shape", [(3, 5), (0,), (4, 600_000)])
def test_new_arrays_are_whole_and_large_ones_begin_at_a_large_page(shape: tuple[int, ...]) -> None:
    array = new_numbers(*shape)
    assert array.shape == shape
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    assert array.flags.writeable
    if array.size > 1_000_000:
        assert array.ctypes.data % 2**21 == 0


def test_memory_of_a_large_array_is_used_again_when_no_array_refers_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrays, "_kept", [])
    first = new_numbers(3, 400_000)
    place, part = first.ctypes.data, first.T[5:, 1]
    part[:] = 7.0
    del first
    other = new_numbers(3, 400_000)
    other[:] = 0.0
    assert other.ctypes.data != place
    assert (part == 7.0).all()
    del part
    assert new_numbers(1_200_000).ctypes.data == place


def test_no_more_than_some_memory_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrays, "_kept", [])
    monkeypatch.setattr(arrays, "_MOST_KEPT", 1_000_000)
    used = [new_numbers(300_000) for _ in range(5)]
    assert len(arrays._kept) == 3
    assert len({array.ctypes.data for array in used}) == 5
    new_numbers(1_100_000)
    assert len(arrays._kept) == 3
    assert new_numbers(290_000).ctypes.data not in {array.ctypes.data for array in used}


def test_finite_numbers_are_not_copied_if_all_are() -> None:
    numbers = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert np.shares_memory(finite(numbers), numbers)
    numbers[0, 1] = np.nan
    assert finite(numbers).tolist() == [1.0, 3.0, 4.0]
