"""Stages at all samples of a run, by compiled C or by Python: sensitivities, forces and reactions."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.codegen.lanes.stage import Given, empty_results, is_printable, load_native_stage
from kinfmu.codegen.python.stage import CompiledStage
from kinfmu.errors import CompilerError

FRESH = 1 << 22  # numbers; larger arrays are fresh memory, which the system fills with zeros
AT_ONCE = 512  # samples; the arrays of a stage then stay in the processor's cache

Native = Callable[[Sequence[Given], FloatArray, bool], bool]  # fills results (rows, n) from arrays (n,)


def native_stage(stage: CompiledStage) -> Native | None:
    """Return the stage as compiled C; None where it stays in Python."""
    if not is_printable(stage):
        return None
    try:
        return load_native_stage(stage)
    except CompilerError:  # the library of the model was found in the cache
        return None


def native_results(
    stage: CompiledStage, native: Native, numbers: Sequence[Given], shape: tuple[int, int], *, is_checked: bool
) -> tuple[FloatArray, bool]:
    """Return what `stage_results` returns, by compiled C; numbers may also be given by where they are in memory."""
    results = _empty(stage, shape)
    return results, native(numbers, results, is_checked)


def _empty(stage: CompiledStage, shape: tuple[int, int]) -> FloatArray:
    """Return an array of results without values, except for those that are always 0."""
    if shape[0] * shape[1] > FRESH:
        return empty_results(*shape, of=np.zeros)
    results = empty_results(*shape)
    set_zeros(stage, results)
    return results


def set_zeros(stage: CompiledStage, results: FloatArray) -> None:
    """Set the results of a stage that are always 0."""
    for rows_at_zero in stage.zeros:
        results[rows_at_zero] = 0.0


def stage_results(
    stage: CompiledStage,
    native: Native | None,
    numbers: Sequence[FloatArray | float],
    shape: tuple[int, int],
    *,
    is_checked: bool = True,
    into: FloatArray | None = None,
) -> tuple[FloatArray, bool]:
    """Return all results of a stage, (rows, n), and whether all are finite; they are not where a block is singular.

    numbers: arrays (n,), or one number each. Without `is_checked` results pass as finite. into: results of an earlier
    call, of the same shape, which are overwritten, except for those that are always 0.
    """
    n = shape[1]
    results = _empty(stage, shape) if into is None else into
    if native is not None:
        return results, native(numbers, results, is_checked)
    if n <= stage.few:
        columns = [number.tolist() if isinstance(number, np.ndarray) else [number] * n for number in numbers]
        rows = []
        for given in zip(*columns, strict=True) if columns else [()] * n:  # results may be constants
            try:
                rows.append(stage.of_sample(given))
            except (ArithmeticError, ValueError):
                rows.append((np.nan,) * len(stage.places))
        results[list(stage.places)] = np.array(rows, dtype=float).reshape(n, len(stage.places)).T
    else:
        with np.errstate(all="ignore"):
            for start in range(0, n, AT_ONCE):
                part = slice(start, start + AT_ONCE)
                own = [number[part] if isinstance(number, np.ndarray) else number for number in numbers]
                for place, result in zip(stage.places, stage.of_samples(own), strict=True):
                    results[place, part] = result
    return results, not is_checked or bool(np.isfinite(results).all())
