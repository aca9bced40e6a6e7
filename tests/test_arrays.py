"""Arrays without values."""

from __future__ import annotations

import numpy as np
import pytest

from kinfmu.arrays import new_numbers


@pytest.mark.parametrize("shape", [(3, 5), (0,), (4, 600_000)])
def test_new_arrays_are_whole_and_large_ones_begin_at_a_large_page(shape: tuple[int, ...]) -> None:
    array = new_numbers(*shape)
    assert array.shape == shape
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    assert array.flags.writeable
    if array.size > 1_000_000:
        assert array.ctypes.data % 2**21 == 0
