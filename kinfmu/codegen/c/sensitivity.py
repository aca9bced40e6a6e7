"""Sensitivity stage in C: the statements of `kinfmu.codegen.python.sensitivity`, compiled, for many samples."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.codegen.c import compiler
from kinfmu.codegen.python.sensitivity import SensitivityStage, stage_lines
from kinfmu.codegen.writer import identifier
from kinfmu.equations.graph import reachable
from kinfmu.plan.sensitivity import LinearSolve

FloatArray = NDArray[np.float64]
FLAGS = ("-O2", "-fno-math-errno")
_SOLVE = """
/* J x = b for columns b, which become x: elimination with row pivots, rows scaled to a largest entry of 1. */
static void solutions(int k, int count, double *j, double *b)
{
    int i, c, m, n;
    for (i = 0; i < k; ++i) {
        double largest = 0.0;
        for (c = 0; c < k; ++c) {
            largest = fmax(largest, fabs(j[i * k + c]));
        }
        for (c = 0; c < k; ++c) {
            j[i * k + c] /= largest;
        }
        for (n = 0; n < count; ++n) {
            b[n * k + i] /= largest;
        }
    }
    for (c = 0; c < k; ++c) {
        int pivot = c;
        for (i = c + 1; i < k; ++i) {
            pivot = fabs(j[i * k + c]) > fabs(j[pivot * k + c]) ? i : pivot;
        }
        if (pivot != c) {
            for (m = 0; m < k; ++m) {
                const double kept = j[c * k + m];
                j[c * k + m] = j[pivot * k + m];
                j[pivot * k + m] = kept;
            }
            for (n = 0; n < count; ++n) {
                const double kept = b[n * k + c];
                b[n * k + c] = b[n * k + pivot];
                b[n * k + pivot] = kept;
            }
        }
        for (i = c + 1; i < k; ++i) {
            const double ratio = j[i * k + c] / j[c * k + c];
            for (m = c + 1; m < k; ++m) {
                j[i * k + m] -= ratio * j[c * k + m];
            }
            for (n = 0; n < count; ++n) {
                b[n * k + i] -= ratio * b[n * k + c];
            }
        }
    }
    for (n = 0; n < count; ++n) {
        for (i = k - 1; i >= 0; --i) {
            for (m = i + 1; m < k; ++m) {
                b[n * k + i] -= j[i * k + m] * b[n * k + m];
            }
            b[n * k + i] /= j[i * k + i];
        }
    }
}
"""


def is_printable(stage: SensitivityStage) -> bool:
    """Return True for a stage without curves and least squares, which stay in Python."""
    steps = stage.steps
    solves = [step for step in steps.steps if isinstance(step, LinearSolve)]
    if any(len(step.jacobian) > len(step.jacobian[0]) for step in solves):
        return False
    roots = [step.node for step in steps.steps if not isinstance(step, LinearSolve)] + steps.results
    roots += [node for step in solves for row in (*step.jacobian, *step.columns) for node in row]
    return all(node.op != "curve" for node in reachable(roots))


def sensitivity_source(stage: SensitivityStage) -> str:
    """Return the C source of a stage."""
    count = 0

    def solve(rows: Sequence[Sequence[Any]], columns: Sequence[Sequence[Any]], names: Sequence[str]) -> list[str]:
        nonlocal count
        count += 1
        entries = ", ".join(entry for row in rows for entry in row)
        right = ", ".join(f"-({entry})" for column in columns for entry in column)
        return [
            f"double jacobian{count}[] = {{{entries}}}",
            f"double right{count}[] = {{{right}}}",
            f"solutions({len(rows)}, {len(columns)}, jacobian{count}, right{count})",
            *(f"{name} = right{count}[{k}]" for k, name in enumerate(names)),
        ]

    lines, results = stage_lines(stage.steps, stage.given, {}, solve)
    body = [line if line.startswith(("double ", "solutions(")) else f"const double {line}" for line in lines]
    given = [f"const double {identifier(name)} = given[{k}][s * step[{k}]]" for k, name in enumerate(stage.given)]
    filled = [f"results[{k} * n + s] = {result}" for k, result in zip(stage.places, results, strict=True)]
    return "\n".join(
        [
            "#include <math.h>",
            "#include <stdint.h>",
            _SOLVE if count else "",
            "/* Fill rows of results (rows, n) that are not 0; step: 1 for an array, 0 for one number. */",
            "void kf_sensitivities(int64_t n, const double *const *given, const int64_t *step, double *results)",
            "{",
            "    int64_t s;",
            "    for (s = 0; s < n; ++s) {",
            *(f"        {line};" for line in (*given, *body, *filled)),
            "    }",
            "}",
            "",
        ]
    )


def load_native_sensitivity(stage: SensitivityStage) -> Callable[[Sequence[FloatArray], FloatArray], None]:
    """Return the compiled stage: it fills the rows of results (rows, n) that are not 0, from arrays (n,) or (1,).

    Raises:
        CompilerError: There is no compiler, or it fails.

    """
    library = compiler.load({"sensitivities.c": sensitivity_source(stage)}, FLAGS)

    def fill(given: Sequence[FloatArray], results: FloatArray) -> None:
        arrays = [np.ascontiguousarray(array) for array in given]
        starts = (ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays))
        n = results.shape[1]
        steps = (ctypes.c_int64 * len(arrays))(*(int(len(array) > 1) for array in arrays))
        library.kf_sensitivities(ctypes.c_int64(n), starts, steps, ctypes.c_void_p(results.ctypes.data))

    return fill
