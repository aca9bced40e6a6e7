"""Types of numpy arrays, and new ones."""

from __future__ import annotations

import math

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
    count = math.prod(shape)
    if count < _PAGE:
        return np.empty(shape)
    whole = np.empty(count + 2 * _PAGE)
    first = -(whole.__array_interface__["data"][0] // whole.itemsize) % _PAGE
    return whole[first : first + count].reshape(shape)
