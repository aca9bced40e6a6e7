"""The compiled solver of pages is that of its sources."""

from __future__ import annotations

from kinfmu.codegen.wasm import Binary
from tests.page import solver_file


def test_the_solver_of_pages_is_compiled_from_the_sources_as_they_are() -> None:
    compiled = Binary(solver_file.FILE.read_bytes()).custom[solver_file.SECTION]
    assert compiled == solver_file.hash_of(solver_file.sources()), "run scripts/solver"


def test_the_solver_of_pages_is_small() -> None:
    assert solver_file.FILE.stat().st_size < 200_000
