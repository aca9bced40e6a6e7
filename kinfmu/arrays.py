"""Types of numpy arrays, new arrays, and their finite numbers."""

from __future__ import annotations

import math
from sys import getrefcount
from threading import Lock

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PAGE = 2**21 // 8  # numbers in a large page of the system
_MOST_KEPT = 2**26 // 8  # numbers of large arrays that are kept
_lock = Lock()
_kept: list[FloatArray] = []  # memory of large arrays, in use or not, the last used at the end


def new_numbers(*shape: int) -> FloatArray:
    """Return an array without values.

    A large one begins at a large page of the system and has all of its last one: the small pages that it would have at
    its ends take as long as all the others. It has the memory of an earlier array that is in use no more, if there is
    one: new memory is filled with zeros by the system, which takes a third of the time of a sweep.
    """
    size = math.prod(shape)
    if size < _PAGE:
        return np.empty(shape)
    with _lock:
        whole = _idle(size)
        if whole is None:
            whole = np.empty(size + 2 * _PAGE)
        if size <= _MOST_KEPT:
            _kept.append(whole)
        while sum(map(len, _kept)) > _MOST_KEPT + 2 * _PAGE * len(_kept):
            del _kept[0]
        first = -(whole.__array_interface__["data"][0] // whole.itemsize) % _PAGE
        return whole[first : first + size].reshape(shape)


def _idle(size: int) -> FloatArray | None:
    """Take memory for so many numbers, and not for many more, that no array refers to; None if there is none."""
    for k in range(len(_kept)):
        if getrefcount(_kept[k]) == _UNUSED and size <= len(_kept[k]) - 2 * _PAGE <= 2 * size:
            return _kept.pop(k)
    return None


def _references_of_unused() -> int:
    kept = [np.empty(1)]
    return getrefcount(kept[0])


_UNUSED = _references_of_unused()


def finite(values: FloatArray) -> FloatArray:
    """Return the numbers of an array that are finite, (n,); they are not copied if all are."""
    known = np.isfinite(values)
    return values.reshape(-1) if known.all() else values[known]
