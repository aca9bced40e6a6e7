"""Many designs: a call with other lengths, and thousands of crank-rockers over a turn, compared with other ways."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from itertools import cycle
from time import perf_counter, process_time
from typing import Any

import numpy as np
from scipy.optimize import fsolve

from benchmarks import design_measures
from benchmarks.crank_rockers import ANGLES, closed_form, crank_rocker, drawn
from benchmarks.rounds import in_turn, spread, table
from benchmarks.sensitivities import sensitivity_lines
from kinfmu.arrays import FloatArray
from kinfmu.run.model import compile as compiled
from kinfmu.run.solve import solve

ROUNDS = 7
DESIGNS = 10_000
FEW = 5  # samples of a short call
ALONE = 200  # designs that slow ways solve
OUTPUTS = ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]
PER_DESIGN = 1e6  # [us/s]


def run(rounds: int = ROUNDS, designs: int = DESIGNS) -> str:
    """Return tables: microseconds of a short call and of a design over a turn; measures and sensitivities."""
    more = [*design_measures.lines(rounds, designs), "", *sensitivity_lines(rounds)]
    return "\n".join([*_short_calls(rounds), "", *_batches(rounds, designs), "", *more])


def _short_calls(rounds: int) -> list[str]:
    mechanism = crank_rocker()
    python, native = (compiled(mechanism, OUTPUTS, engine=engine) for engine in ("python", "native"))
    angles = np.linspace(0.0, 1.0, FEW)
    lengths = cycle(drawn(1000)["coupler_link"].tolist())
    calls: dict[str, Callable[[], object]] = {
        "Model.solve, Python engine": lambda: python.solve(
            crank_angle=angles, parameters={"coupler_link": next(lengths)}
        ),
        "Model.solve, native engine": lambda: native.solve(
            crank_angle=angles, parameters={"coupler_link": next(lengths)}
        ),
        "kinfmu.solve, the mechanism solved before": lambda: solve(
            mechanism, outputs=OUTPUTS, engine="python", crank_angle=angles, parameters={"coupler_link": next(lengths)}
        ),
        "closed form in numpy, q alone": lambda: closed_form(angles, 42.0, 15.0, next(lengths), 45.0),
    }
    repeats = 200
    ways = [_repeated(call, repeats) for call in calls.values()]
    times = [spread([s / repeats * PER_DESIGN for s in seconds]) for seconds in in_turn(ways, rounds, process_time)]
    rows = [[name, *of.cells(1)] for name, of in zip(calls, times, strict=True)]
    return [
        f"crank-rocker with another length at {FEW} angles, {rounds} rounds in turn; us of processor time a call",
        *table(("", "median", "min", "max"), rows),
    ]


def _repeated(call: Callable[[], object], times: int) -> Callable[[], object]:
    def way() -> None:
        for _ in range(times):
            call()

    return way


def _batches(rounds: int, count: int) -> list[str]:
    mechanism, angles, lengths = crank_rocker(), np.linspace(0.0, 2.0 * np.pi, ANGLES), drawn(count)
    native = compiled(mechanism, OUTPUTS, engine="native")
    few = min(count, ALONE)
    sets = [{name: float(values[k]) for name, values in lengths.items()} for k in range(few)]

    def one_after_another() -> None:
        for values in sets:
            native.solve(crank_angle=angles, parameters=values)

    def by_fsolve() -> None:
        for values in sets[:2]:
            guess = np.array([1.0, 1.8])
            for angle in angles:
                guess = fsolve(_loop_closure, guess, args=(angle, *values.values()))

    ways: dict[str, tuple[int, Callable[[], object]]] = {
        "solve_designs, q, qd, qdd": (count, lambda: native.solve_designs(lengths, crank_angle=angles)),
        "solve_designs, q alone": (count, lambda: native.solve_designs(lengths, crank_angle=angles, derivatives=0)),
        "Model.solve, design after design, q, qd, qdd": (few, one_after_another),
        "closed form in a loop, by numba, q alone": (count, _numba(angles, lengths)),
        "pylinkage, by numba: points, not angles": (few, _pylinkage(angles, sets)),
        "scipy.optimize.fsolve, q alone": (min(2, few), by_fsolve),
    }
    if find_spec("numba") is None:
        del ways["closed form in a loop, by numba, q alone"]
    if find_spec("numba") is None or find_spec("pylinkage") is None:
        del ways["pylinkage, by numba: points, not angles"]
    measured = in_turn([way for _, way in ways.values()], rounds, process_time)
    rows = []
    for (name, (designs, _)), seconds in zip(ways.items(), measured, strict=True):
        of = spread([value / designs * PER_DESIGN for value in seconds])
        rows.append([name, *of.cells(1), f"{of.median * 1e3 / ANGLES:.1f}"])
    walls = in_turn(
        [lambda n=n: native.solve_designs(lengths, crank_angle=angles, workers=n) for n in (1, 2)],  # type: ignore[misc]
        rounds,
        perf_counter,
    )
    one, two = (spread(seconds).median for seconds in walls)
    return [
        f"{count} crank-rockers at {ANGLES} angles, {rounds} rounds in turn; us of processor time a design",
        *table(("", "median", "min", "max", "ns a sample"), rows),
        f"two threads: {one / two:.2f} times faster ({one:.2f} s and {two:.2f} s by the clock, q, qd, qdd)",
    ]


def _loop_closure(z: FloatArray, u: float, g: float, a: float, b: float, c: float) -> list[float]:
    return [
        a * np.cos(u) + b * np.cos(z[0]) - g - c * np.cos(z[1]),
        a * np.sin(u) + b * np.sin(z[0]) - c * np.sin(z[1]),
    ]


def _pylinkage(angles: FloatArray, sets: Sequence[dict[str, float]]) -> Callable[[], object]:
    """Return a function that computes positions, velocities and accelerations of the two pins, design after design."""
    if find_spec("numba") is None or find_spec("pylinkage") is None:
        return lambda: None
    from pylinkage.actuators import Crank
    from pylinkage.components import Ground
    from pylinkage.dyads import RRRDyad
    from pylinkage.simulation import Linkage

    step = float(angles[1] - angles[0])

    def way() -> None:
        for values in sets:
            ground, crank, coupler, rocker = values.values()
            o, c = Ground(0.0, 0.0), Ground(ground, 0.0)
            p = Crank(o, crank, step, float(angles[0]) - step)
            linkage = Linkage([o, c, p, RRRDyad(p.output, c, coupler, rocker, ground, rocker)])
            linkage.set_input_velocity(p, 1.0, 0.0)
            linkage.step_fast_with_kinematics(len(angles))

    return way


def _numba(angles: FloatArray, lengths: dict[str, FloatArray]) -> Callable[[], object]:
    if find_spec("numba") is None:
        return lambda: None
    import numba

    one: Any = numba.njit(closed_form)

    def all_of(u: FloatArray, g: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, out: FloatArray) -> None:
        for k in range(len(g)):
            for i in range(len(u)):
                out[k, 0, i], out[k, 1, i] = one(u[i], g[k], a[k], b[k], c[k])

    loop: Any = numba.njit(all_of)
    out = np.empty((len(lengths["crank_link"]), 2, len(angles)))
    return lambda: loop(angles, *lengths.values(), out)
