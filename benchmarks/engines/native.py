"""kinfmu's native engine: the generated C of a plan, compiled here, a whole array of samples at a call."""

from __future__ import annotations

import numpy as np

from benchmarks.case import Case, Motion
from benchmarks.engine import BenchEngine, EngineSetting, Sampler
from kinfmu.errors import CompilerError, MissingPackageError
from kinfmu.run.native_engine import Library

LAPS = 50  # how often a call solves the samples


def _sampler(case: Case, _setting: EngineSetting) -> Sampler:
    """Return a sampler by the library of `kinfmu.solve(engine="native")`.

    A call solves the samples forwards and backwards, LAPS times in all, so that its fixed cost, such as the path from
    the anchor to the first sample, counts as little as in a long sweep.
    """
    try:
        library = Library(case.plan)
    except CompilerError as error:
        raise MissingPackageError(f"kinfmu native: {error}") from None
    u, ud, udd = (np.array(table) for table in (case.u, case.ud, case.udd))  # (n, d) each

    def take(n: int) -> Motion:
        there = np.arange(n)
        order = np.tile(np.concatenate([there, there[::-1]]), -(-LAPS // 2))[: LAPS * n]
        tables = [np.empty((len(order), len(case.columns)), order="F") for _ in range(3)]
        library.sweep((u[order], ud[order], udd[order]), tables)
        return list(np.hstack([table[:n] for table in tables]))

    return take


NATIVE = BenchEngine("kinfmu native", _sampler, laps=LAPS)
