"""A sweep by the native engine, compared with a four-bar's closed form by hand and with pylinkage."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from benchmarks.rounds import in_turn, spread, table
from benchmarks.singular_points import FOURBAR
from kinfmu.arrays import FloatArray
from kinfmu.codegen.c import compiler
from kinfmu.errors import MissingPackageError
from kinfmu.mechanism.gallery import load
from kinfmu.mechanism.gallery.chains import fourbar_chain
from kinfmu.plan import compile_plan
from kinfmu.run.engine import Driven
from kinfmu.run.model import compile as compiled_model
from kinfmu.run.native_engine import FLAGS, Library

ROUNDS = 9
SAMPLES = 360_000  # a thousand turns by one degree
CHAIN_SAMPLES = 2000
LENGTHS = (40.0, 20.0, 50.0, 50.0)  # ground, crank, coupler, rocker of the gallery's crank_rocker
STEPS = (5, 15)  # [deg]
CLOSED = "closed form by hand, vectorized"
STORES = "as many numbers read and stored, without arithmetic"
WHOLE = "crank-rocker, q, qd, qdd"
ALONE = "the same, q alone"
PYLINKAGE = "pylinkage, by numba: points, not angles"


def run(rounds: int = ROUNDS, samples: int = SAMPLES, loops: int = 1000) -> str:
    """Return a table: nanoseconds of processor time per sample, absolute and relative to the closed form."""
    u = np.linspace(0.0, np.pi / 180.0 * samples, samples, endpoint=False)
    driven = (u[:, None].copy(), np.ones((samples, 1)), np.zeros((samples, 1)))
    crank_rocker, fourbar = (Library(compile_plan(load(name), FOURBAR)) for name in ("crank_rocker", "fourbar"))
    columns = np.empty((15, samples))
    tables = [columns[5 * k : 5 * k + 5].T for k in range(3)]
    by_samples = [np.empty((samples, 5)) for _ in range(3)]
    result, fourbar_result = (compiled.sweep(driven, tables) for compiled in (crank_rocker, fourbar))
    model = compiled_model(load("crank_rocker"), FOURBAR, engine="native")
    ways: dict[str, Callable[[], object]] = {
        CLOSED: closed_form(u, columns),
        STORES: stores(u, columns),
        WHOLE: lambda: crank_rocker.sweep(driven, tables, reuse=result),
        "the same, tables by samples": lambda: crank_rocker.sweep(driven, by_samples, reuse=result),
        ALONE: lambda: crank_rocker.sweep(driven, (tables[0], None, None), reuse=result),
        "the same, q, qd, qdd, all arrays allocated": lambda: crank_rocker.sweep(driven, _allocated(samples)),
        "the same, by Model.solve into given arrays": lambda: model.solve(
            crank_angle=u, out=(tables[0], tables[1], tables[2])
        ),
        "the same, by Model.solve": lambda: model.solve(crank_angle=u),
        "four-bar past two change points a turn": lambda: fourbar.sweep(driven, tables, reuse=fourbar_result),
        **{f"crank-rocker, samples {step} degrees apart": _coarse(crank_rocker, driven, step) for step in STEPS},
        "Jansen's leg, q, qd, qdd": _whole(Library(compile_plan(load("jansen_leg"))), driven),
    }
    absent = []
    try:
        ways[PYLINKAGE] = _pylinkage(u)
    except MissingPackageError as error:
        absent.append(str(error))
    times = [
        spread([value / samples * 1e9 for value in seconds])
        for seconds in in_turn(list(ways.values()), rounds, process_time)
    ]
    rows = [[name, *of.cells(1), f"{of.median / times[0].median:.2f}"] for name, of in zip(ways, times, strict=True)]
    lines = [f"{samples} samples of 1 degree, {rounds} rounds in turn; ns of processor time a sample"]
    lines += table(("", "median", "min", "max", "times closed form"), rows)
    medians = dict(zip(ways, (time.median for time in times), strict=True))
    lines.append(
        f"of the closed form {medians[STORES] / medians[CLOSED]:.2f}, and of the sweep "
        f"{medians[STORES] / medians[WHOLE]:.2f}, is the time of reading and storing alone"
    )
    lines.append(f"q alone takes {medians[ALONE] / medians[WHOLE]:.2f} of the time of q, qd, qdd")
    if PYLINKAGE in medians:
        lines.append(f"{PYLINKAGE}: {medians[PYLINKAGE] / medians[WHOLE]:.1f} times that time")
    return "\n".join([*lines, *_chain(rounds, loops), *absent])


def _coarse(library: Library, driven: Driven, step: int) -> Callable[[], object]:
    """Return a sweep of as many samples that are further apart."""
    u, ud, udd = driven
    return _whole(library, (u * step, ud, udd))


def _whole(library: Library, driven: Driven) -> Callable[[], object]:
    """Return a sweep into given arrays."""
    shape = 3, len(library.plan.outputs), len(driven[0])
    tables = [table.T for table in np.empty(shape)]
    result = library.sweep(driven, tables)
    return lambda: library.sweep(driven, tables, reuse=result)


def _allocated(samples: int) -> list[FloatArray]:
    return [np.empty((samples, len(FOURBAR)), order="F") for _ in range(3)]


def _chain(rounds: int, count: int) -> list[str]:
    """Return lines on a long chain: microseconds per sample, and seconds to plan and to compile."""
    start = perf_counter()
    plan = compile_plan(fourbar_chain(count))
    planned = perf_counter()
    library = Library(plan)
    ready = perf_counter()
    u = plan.anchor_values[0][0] + np.linspace(0.0, 1.5, CHAIN_SAMPLES)
    driven = (u[:, None], np.ones((CHAIN_SAMPLES, 1)), np.zeros((CHAIN_SAMPLES, 1)))
    tables = [np.empty((CHAIN_SAMPLES, len(plan.outputs)), order="F") for _ in range(3)]
    (seconds,) = in_turn([lambda: library.sweep(driven, tables)], rounds, process_time)
    of = spread([value / CHAIN_SAMPLES * 1e6 for value in seconds])
    return [
        f"chain of {count} four-bars, q, qd, qdd: {of.median:.1f} us a sample ({of.low:.1f} to {of.high:.1f}); "
        f"planned in {planned - start:.1f} s, C written and compiled (or found) in {ready - planned:.1f} s"
    ]


def closed_form(u: FloatArray, columns: FloatArray) -> Callable[[], object]:
    """Return a function that fills columns (15, n): FOURBAR at u (n,), rates and accelerations, by hand-written C."""
    lengths = [ctypes.c_double(length) for length in LENGTHS]
    return _by_hand("closed_form", u, columns, lengths)


def stores(u: FloatArray, columns: FloatArray) -> Callable[[], object]:
    """Return a function that fills columns (15, n) as fast as memory allows."""
    return _by_hand("stores", u, columns)


def _by_hand(name: str, u: FloatArray, columns: FloatArray, lengths: Sequence[object] = ()) -> Callable[[], object]:
    """Return a function of closed_form.c that fills columns."""
    files = {"closed_form.c": Path(__file__).with_name("closed_form.c").read_text("utf-8")}
    function = getattr(compiler.load(files | compiler.sources(("sincos.h",)), FLAGS), name)
    ud, udd = np.ones(len(u)), np.zeros(len(u))
    pointers = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (u, ud, udd)]
    out = columns.ctypes.data_as(ctypes.POINTER(ctypes.c_double))

    def way() -> object:
        function(ctypes.c_int64(len(u)), *pointers, *lengths, out)
        return (u, ud, udd)  # to live as long as what points at them

    return way


def _pylinkage(u: FloatArray) -> Callable[[], object]:
    """Return a function that computes positions, velocities and accelerations of the two moving joints."""
    if find_spec("pylinkage") is None or find_spec("numba") is None:
        raise MissingPackageError("pylinkage with numba is not installed: pip install 'kinfmu[bench]'")
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    ground, crank, coupler, rocker = LENGTHS
    step = float(u[1] - u[0])
    o, c = Ground(0.0, 0.0), Ground(ground, 0.0)
    p = Crank(o, crank, step, float(u[0]) - step)
    q = RRRDyad(p.output, c, coupler, rocker, 30.0, 50.0)  # where the circles meet: above
    parts: list[Any] = [o, c, p, q]
    linkage = Linkage(parts)
    linkage.set_input_velocity(p, 1.0, 0.0)
    start = [(part.x, part.y) for part in parts]

    def way() -> object:
        for part, (x, y) in zip(parts, start, strict=True):
            part.x, part.y = x, y
        return linkage.step_fast_with_kinematics(len(u))

    return way
