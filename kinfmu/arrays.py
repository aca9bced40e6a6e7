"""Types of numpy arrays, new arrays, and their finite numbers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PAGE = 2**21 // 8  # numbers in a large page of the system


def new_numbers(*shape: int) -> FloatArray:
    """Return an array without values.

    A large one begins at a large page of the system and has all of its last one: the small pages that it would have at
    its ends take as long as all the others.
    """
    numbers = np.empty(shape)
    if numbers.size < _PAGE:
        return numbers
    whole = np.empty(numbers.size + 2 * _PAGE)
    first = -(whole.__array_interface__["data"][0] // whole.itemsize) % _PAGE
    return whole[first : first + numbers.size].reshape(shape)


def finite(values: FloatArray) -> FloatArray:
    """Return the numbers of an array that are finite, (n,); they are not copied if all are."""
    known = np.isfinite(values)
    return values.reshape(-1) if known.all() else values[known]
