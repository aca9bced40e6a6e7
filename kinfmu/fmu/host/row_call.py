"""C functions of an FMU that are called in every step, with arguments that are built once.

fmpy's own methods build arrays and lists in every call, which takes longer than a step of a native FMU. ctypes converts
Python numbers to declared types, which takes as long. So numbers of C are changed in place here.
"""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import CFUNCTYPE, c_double, c_int, c_size_t, c_uint, c_void_p
from functools import partial
from typing import Any

from numpy.typing import NDArray

WARNING = 1  # fmi2Warning and fmi3Warning; a greater status is a failure


class RowCall:
    """A get of variables into a row of a table, or a set from it: `call(row)`.

    Args:
        fmu: Instance, of fmpy.
        function: Name of the C function, such as "fmi2GetReal".
        references: The k value references.
        rows: (n, k) table of the function's type, each row without gaps.
        has_value_count: True for FMI 3.0, whose functions also take the number of values.

    """

    __slots__ = ("_address", "_base", "_function", "_name", "_rows", "_stride")

    def __init__(
        self, fmu: Any, function: str, references: Sequence[int], rows: NDArray[Any], *, has_value_count: bool
    ) -> None:
        self._name = function
        count = c_size_t(len(references))
        self._address = c_void_p()
        variables = (c_uint * len(references))(*references)
        more = (count,) if has_value_count else ()
        self._function = _function_of(fmu, function, variables, count, self._address, *more)
        self._rows, self._base, self._stride = rows, rows.ctypes.data, rows.strides[0]

    def __call__(self, row: int) -> None:
        """Get or set; raise fmpy's FMICallException for a status above Warning."""
        self._address.value = self._base + row * self._stride
        status = self._function()
        if status > WARNING:
            from fmpy.fmi1 import FMICallException

            raise FMICallException(function=self._name, status=status)


class StepCall:
    """A DoStep of an FMU: `call(time, step)` returns its status.

    Args:
        fmu: Instance, of fmpy.
        function: Name of the C function, such as "fmi2DoStep".
        more: Its arguments after time and step, values of ctypes.

    """

    __slots__ = ("_function", "_step", "_time", "name")

    def __init__(self, fmu: Any, function: str, *more: Any) -> None:
        self.name = function
        self._time, self._step = c_double(), c_double()
        self._function = _function_of(fmu, function, self._time, self._step, *more)

    def __call__(self, time: float, step: float) -> int:
        self._time.value, self._step.value = time, step
        return self._function()


def _function_of(fmu: Any, name: str, *arguments: Any) -> partial[int]:
    """Return a C function of an FMU bound to its instance and these arguments, values of ctypes."""
    return partial(CFUNCTYPE(c_int)((name, fmu.dll)), c_void_p.from_param(fmu.component), *arguments)
