"""FMI functions that get or set the same variables in every step, called with arguments that are built once."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import CFUNCTYPE, c_int, c_size_t, c_uint, c_void_p
from typing import Any

from numpy.typing import NDArray

WARNING = 1  # fmi2Warning and fmi3Warning; a greater status is a failure


class RowCall:
    """Gets variables into a row of a table, or sets them to its values: `call(row)`.

    It calls the C function with the address of the row. fmpy's own methods build two arrays and a list in every call,
    which takes longer than a step of a native FMU.

    fmu: the instance, of fmpy; function: name of the C function, such as "fmi2GetReal"; references: the k value
    references; rows: (n, k) table of the function's type, each row without gaps; has_value_count: True for FMI 3.0,
    whose functions take the number of values, too.
    """

    __slots__ = ("_base", "_count", "_function", "_instance", "_more", "_name", "_references", "_rows", "_stride")

    def __init__(
        self, fmu: Any, function: str, references: Sequence[int], rows: NDArray[Any], *, has_value_count: bool
    ) -> None:
        self._instance = fmu.component
        self._name = function
        types = [c_void_p, c_void_p, c_size_t, c_void_p, *([c_size_t] if has_value_count else [])]
        self._function = CFUNCTYPE(c_int, *types)((function, fmu.dll))
        count = len(references)
        self._count, self._more = count, (count,) if has_value_count else ()
        self._references = (c_uint * count)(*references)
        self._rows, self._base, self._stride = rows, rows.ctypes.data, rows.strides[0]

    def __call__(self, row: int) -> None:
        """Get or set; raises fmpy's FMICallException for a status above Warning."""
        address = self._base + row * self._stride
        status = self._function(self._instance, self._references, self._count, address, *self._more)
        if status > WARNING:
            from fmpy.fmi1 import FMICallException

            raise FMICallException(function=self._name, status=status)
