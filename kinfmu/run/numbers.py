"""Numbers that a caller gives as arrays: what numpy would make numbers of silently is refused."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.arrays import FloatArray
from kinfmu.errors import RequestError

_DOUBLE = np.dtype(np.float64)
_NO_NUMBERS: dict[tuple[type, ...], str] = {  # types that numpy makes floats of
    (bool, np.bool_): "true or false",
    (complex, np.complexfloating): "complex",
    (np.datetime64,): "dates",
    (np.timedelta64,): "durations; divide them by a unit, such as np.timedelta64(1, 's')",
    (np.void,): "records of several fields",
}


def numbers_of(name: str, values: ArrayLike, what: str = "numbers") -> FloatArray:
    """Return an array of floats.

    Raises:
        RequestError: They are no real numbers, though numpy may make numbers of them, or some are masked.

    """
    if type(values) is np.ndarray and values.dtype is _DOUBLE:
        return values
    if type(values) is float:
        return np.array(values)
    items: Sequence[Any] = values if isinstance(values, list | tuple) else ()
    types: set[type] = set(map(type, items))
    try:
        if any(issubclass(one, np.ma.MaskedArray) for one in types):  # numpy would drop their masks
            values = np.ma.stack(list(map(np.ma.asanyarray, items)))
        array = np.asanyarray(values)
        types |= set(map(type, array.ravel().tolist())) if array.dtype == object else {array.dtype.type}
        for kinds, what_they_are in _NO_NUMBERS.items():
            if any(issubclass(one, kinds) for one in types):
                raise RequestError(f"{name} must be {what}, not {what_they_are}")
        if np.ma.is_masked(array):
            place = np.argwhere(np.ma.getmaskarray(array))[0]
            where = f"[{', '.join(map(str, place))}]" if array.ndim else ""
            raise RequestError(f"{name}{where} is masked; leave it out, or fill in a number")
        return np.asarray(array, dtype=float)
    except (TypeError, ValueError):
        raise RequestError(f"{name} must be {what}") from None
