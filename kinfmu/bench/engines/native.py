"""kinfmu's native engine: the generated C of a plan, compiled here, a whole array of samples at a call."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kinfmu.backends.c.library import Library
from kinfmu.bench.case import Case, Motion
from kinfmu.bench.engines.engine import Engine, Way
from kinfmu.bench.setting import Setting
from kinfmu.errors import CompilerError, MissingPackageError


class Native(Engine):
    """What `kinfmu.solve(engine="native")` runs on, the way from the anchor to the first sample included."""

    name = "kinfmu native"
    settings: Sequence[Setting] = (Setting(),)
    usual = Setting()

    def way(self, case: Case, setting: Setting) -> Way:  # noqa: ARG002  there is one
        try:
            library = Library(case.plan)
        except CompilerError as error:
            raise MissingPackageError(f"{self.name}: {error}") from None
        u, ud, udd = (np.array(table) for table in (case.u, case.ud, case.udd))  # (n, d) each

        def take(n: int) -> Motion:
            tables = [np.empty((n, len(case.columns)), order="F") for _ in range(3)]
            library.sweep((u[:n], ud[:n], udd[:n]), tables)
            return np.hstack(tables)  # type: ignore[return-value]  # rows all the same

        return take
