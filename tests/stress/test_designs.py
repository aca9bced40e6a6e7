"""Random designs of the gallery in short: batches against files with the same numbers."""

from __future__ import annotations

import pytest

from kinfmu.mechanism.gallery import names
from tests.stress.designs import faults

DESIGNS = {"elliptic_trammel": 1, "fourbar": 1, "parallel_jaw": 1}  # one that does not close: it is assembled in vain


@pytest.mark.parametrize("name", names())
def test_a_batch_equals_files_with_the_numbers_of_its_designs(name: str) -> None:
    count = DESIGNS.get(name, 3)
    assert list(faults(name, count, 0, ["python"])) == [], f"python -m tests.stress.designs {name} --count {count}"


@pytest.mark.parametrize("name", ["crank_rocker", "five_bar", "jansen_leg", "slider_crank"])
def test_a_batch_in_c_equals_files_with_the_numbers_of_its_designs(name: str) -> None:
    assert list(faults(name, 6, 1, ["native"])) == [], f"python -m tests.stress.designs {name} --count 6 --seed 1"
