"""A stage of steps in C: the statements of `kinfmu.codegen.python.stage`, compiled, for samples side by side."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.codegen.c import compiler
from kinfmu.codegen.c.model import curve_tables
from kinfmu.codegen.c.text import array
from kinfmu.codegen.python.stage import CompiledStage, stage_curves, stage_lines
from kinfmu.codegen.writer import identifier
from kinfmu.errors import KinfmuError
from kinfmu.plan.steps import LinearSolve

HEADERS = ("stream.h", "vectors.h", "sincos.h")  # of the run time
FUNCTIONS = {"sin": "kf_sin_lane", "cos": "kf_cos_lane", "atan2": "kf_atan2"}
LINE = 8  # numbers in a line of the caches
ITEM = 8  # [bytes] of a number
LARGE = 1 << 20  # numbers; larger tables are written past the caches
_Byte = ctypes.c_char
_UNEVEN = 512  # numbers; rows whose pitch is a multiple of it would share few places of the caches


class _Stage(ctypes.Structure):
    """kf_stage of stage.h."""

    _fields_ = (
        ("count", ctypes.c_int64),
        ("given", ctypes.c_void_p),
        ("step", ctypes.c_void_p),
        ("results", ctypes.c_void_p),
        ("pitch", ctypes.c_int64),
        ("is_large", ctypes.c_bool),
        ("is_checked", ctypes.c_bool),
    )


class _Solve(NamedTuple):
    """A linear solve between two loops: expressions of J, row after row, and of -b, column after column."""

    size: int
    columns: int
    jacobian: list[str]
    right: list[str]
    names: Sequence[str]


Strided = tuple[int, int]  # numbers that the caller keeps: address of the first, and the step to the next in numbers
Given = FloatArray | Strided | float  # of all samples


def is_printable(stage: CompiledStage) -> bool:
    """Return True for a stage without least squares, which stay in Python."""
    solves = [step for step in stage.steps.steps if isinstance(step, LinearSolve)]
    return all(len(step.jacobian) == len(step.jacobian[0]) for step in solves)


def stage_source(stage: CompiledStage) -> str:
    """Return the C source of a stage: loops over the samples of a block, with linear solves between them."""
    solves: list[_Solve] = []

    def solve(rows: Sequence[Sequence[Any]], columns: Sequence[Sequence[Any]], names: Sequence[str]) -> list[str]:
        entries = [entry for row in rows for entry in row]
        right = [f"-({entry})" for column in columns for entry in column]
        solves.append(_Solve(len(rows), len(columns), entries, right, names))
        return [_BREAK]

    curves = {data: f"&{name.lower()}" for data, name in stage_curves(stage.steps).items()}
    lines, results = stage_lines(stage.steps, stage.given, curves, solve, FUNCTIONS)
    loops: list[list[str]] = [[]]
    for line in lines:
        if line == _BREAK:
            loops.append([])
        else:
            loops[-1].append(line)
    places = {identifier(name): k for k, name in enumerate(stage.given)}
    jacobian = _places_of_values(places, loops, solves, results)
    body: list[str] = []
    for k, loop in enumerate(loops):
        stores = []
        if k < len(solves):
            one = solves[k]
            stores = [f"x[{jacobian + n}][i] = {entry}" for n, entry in enumerate(one.jacobian)]
            stores += [f"x[{places[name]}][i] = {entry}" for name, entry in zip(one.names, one.right, strict=True)]
        else:
            stores = [f"results[{n}][i] = {result}" for n, result in enumerate(results)]
        body += _loop(loop, stores, places, len(stage.given))
        if k < len(solves):
            body.append(f"    kf_solutions({one.size}, {one.columns}, x + {jacobian}, x + {places[one.names[0]]});")
    values = jacobian + max((len(one.jacobian) for one in solves), default=0)
    return "\n".join(
        [
            f"#define KF_GIVEN {len(stage.given)}",
            f"#define KF_VALUES {values}",
            f"#define KF_RESULTS {len(results)}",
            *(['#include "curve.h"'] if curves else []),
            '#include "stage.h"',
            "",
            *curve_tables(curves),
            *array("static int places", stage.places),
            "",
            "static void fill(const double **given, kf_numbers *x, double **results)",
            "{",
            "    int i;",
            "    (void)given;",
            "    (void)x;",
            *body,
            "}",
            "",
            "int kf_evaluate(const kf_stage *stage)",
            "{",
            "    return kf_fill(stage, places, fill);",
            "}",
            "",
        ]
    )


_BREAK = "between two loops"


def _places_of_values(
    places: dict[str, int], loops: Sequence[Sequence[str]], solves: Sequence[_Solve], results: Sequence[str]
) -> int:
    """Add places for the solutions and for values that later loops read; return the first place after them."""
    last: dict[str, int] = {}
    for k, loop in enumerate(loops):
        own = results if k == len(solves) else (*solves[k].jacobian, *solves[k].right)
        last |= dict.fromkeys(_words([*loop, *own]), k)
    for k, loop in enumerate(loops):
        for name in (_assigned(line) for line in loop):
            if last.get(name, k) > k:
                places[name] = len(places)
        if k < len(solves):
            for name in solves[k].names:
                places[name] = len(places)
    return len(places)


def _loop(lines: Sequence[str], stores: Sequence[str], places: dict[str, int], given: int) -> Iterator[str]:
    """Yield a loop over the samples of a block: it reads and writes values with places; the first ones are given."""
    own = [_assigned(line) for line in lines]
    read = [name for name in _words([*lines, *stores]) if name in places and name not in own]
    kept = [f"x[{places[name]}][i] = {name}" for name in own if name in places]
    yield "    KF_EACH (i) {"
    for name in read:
        table = "given" if places[name] < given else "x"
        yield f"        const double {name} = {table}[{places[name]}][i];"
    yield from (f"        const double {line};" for line in lines)
    yield from (f"        {line};" for line in (*kept, *stores))
    yield "    }"


def _assigned(line: str) -> str:
    return line.partition(" = ")[0]


def _words(lines: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(re.findall(r"\b[A-Za-z_]\w*", "\n".join(lines))))


def load_native_stage(stage: CompiledStage) -> Callable[[Sequence[Given], FloatArray, bool], bool]:
    """Return the compiled stage.

    It fills the rows of `empty_results` that are not 0, from arrays (n,) or single numbers. The last argument: whether
    all are finite is wanted, and returned.

    Raise a CompilerError if there is no compiler, or it fails.
    """
    head = Path(__file__).with_name("stage.h").read_text("utf-8")
    files = {"evaluate.c": stage_source(stage), "stage.h": head} | compiler.sources(HEADERS)
    if stage_curves(stage.steps):
        files |= compiler.sources(("curve.h", "curve.c"))
    evaluate = compiler.load(files, compiler.VECTORIZED).kf_evaluate
    numbers, places, counts = (kind * len(stage.given) for kind in (ctypes.c_double, ctypes.c_size_t, ctypes.c_int64))

    def fill(given: Sequence[Given], results: FloatArray, is_checked: bool) -> bool:
        single, starts, steps = numbers(), places(), counts()
        first = ctypes.addressof(single)
        for k, number in enumerate(given):
            if isinstance(number, tuple):
                starts[k], steps[k] = number
            elif isinstance(number, np.ndarray):
                starts[k], steps[k] = address_of(number), number.strides[0] // ITEM
            else:
                single[k] = number
                starts[k] = first + k * ITEM
        job = _Stage(
            results.shape[1],
            ctypes.addressof(starts),
            ctypes.addressof(steps),
            address_of(results),
            results.strides[0] // ITEM,
            results.size > LARGE,
            is_checked,
        )
        answer: int = evaluate(ctypes.byref(job))
        if answer < 0:
            raise KinfmuError(f"no memory is left for the results of {results.shape[1]} samples")
        return answer == 1

    return fill


def strided_columns(tables: Sequence[FloatArray], places: Sequence[tuple[int, int]]) -> list[Given]:
    """Return columns of tables (n, m) with at least one sample, by table and column, without a view for each.

    Of a table whose rows repeat, a column is one number.
    """
    starts: dict[int, int] = {}
    found: list[Given] = []
    for table, column in places:
        row, pitch = tables[table].strides
        if row == 0:
            found.append(float(tables[table][0, column]))
            continue
        if table not in starts:
            starts[table] = address_of(tables[table].T)  # often by outputs
        found.append((starts[table] + column * pitch, row // ITEM))
    return found


def address_of(array: NDArray[Any]) -> int:
    """Return the address of an array's first number."""
    try:
        return ctypes.addressof(_Byte.from_buffer(array))  # type: ignore[arg-type]  # an array is a buffer
    except (TypeError, ValueError):  # read-only, empty, or with gaps between its numbers
        address: int = array.__array_interface__["data"][0]
        return address


def empty_results(rows: int, n: int, of: Callable[[int], FloatArray] = np.empty) -> FloatArray:
    """Return an array (rows, n) without values, or with those of `of`, whose rows begin at lines of the caches."""
    pitch = -(-n // LINE) * LINE
    pitch += LINE if pitch % _UNEVEN == 0 else 0
    whole = of(rows * pitch + LINE)
    first = -address_of(whole) // ITEM % LINE
    return whole[first : first + rows * pitch].reshape(rows, pitch)[:, :n]
