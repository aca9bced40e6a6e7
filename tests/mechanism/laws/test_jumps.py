"""Where laws jump: what they say, against one-sided values of the laws themselves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from kinfmu.mechanism.laws import (
    LAWS,
    RISES,
    ConstantSpeed,
    ConstantValue,
    External,
    Harmonic,
    Law,
    MotionSequence,
    Polynomial,
    SimpleHarmonic,
    Spline,
)
from tests.mechanism.laws.test_closed_forms import motion

TABLE = ((0.0, 0.0), (1.0, 1.0), (2.5, 0.5), (3.0, 2.0))
SWINGS = (("simple_harmonic", 1.0, 0.5), ("dwell", 0.5), ("simple_harmonic", 1.5, -0.5), ("cycloidal", 1.0, 0.2))
EXAMPLES: dict[str, Law] = {
    "constant_speed": ConstantSpeed(0.3, 1.5),
    "external": External(0.2),
    "harmonic": Harmonic(1.0, 2.0),
    "constant": ConstantValue(0.75),
    "polynomial": Polynomial((0.5, 1.0, -0.25, 0.125)),
    **{rise.type: rise(rise=-1.5, duration=1.25, begin=0.75) for rise in RISES},
    "sequence": MotionSequence(SWINGS, begin=0.25),
    "repeating sequence": MotionSequence(SWINGS, begin=0.25, repeat=True),
    "spline": Spline(TABLE),
    "natural spline": Spline(TABLE, "natural"),
    "periodic spline": Spline(((0.0, 0.0), (1.0, 1.0), (2.5, 0.5), (3.0, 0.0)), "periodic"),
}
EXPECTED = {
    "simple_harmonic": [0.75, 2.0],
    "sequence": [0.25, 1.25, 1.75, 3.25],
    "repeating sequence": [0.25, 1.25, 1.75, 3.25, 4.25, 5.25, 5.75, 7.25, 8.25],
    "spline": [0.0, 3.0],
    "natural spline": [0.0, 3.0],
}
FIRST, LAST = -0.6, 8.4


def jumps(law: Law) -> list[float]:
    """Every argument between FIRST and LAST at which the law says that it jumps."""
    at, period = law.jumps(**{name: constant.value for name, constant in law.constants().items()})
    times = np.arange(-9.0, 10.0) if period else np.zeros(1)
    return sorted({round(float(x + k * period), 9) for x in at for k in times if FIRST < x + k * period < LAST})


def test_there_is_an_example_of_every_law() -> None:
    assert {type(law) for law in EXAMPLES.values()} == set(LAWS)


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.few(3)
def test_laws_jump_only_at_the_arguments_they_declare(name: str) -> None:
    law = EXAMPLES[name]
    expected = EXPECTED.get(name, [])
    found = jumps(law)
    assert [x for x in found if x > 0.0 or name != "repeating sequence"] == pytest.approx(expected, abs=1e-9)
    size = np.ptp([motion(law, x) for x in np.linspace(FIRST, LAST, 500)], axis=0) + 1e-12
    for x in found:
        gap = np.abs(np.subtract(motion(law, x + 1e-9), motion(law, x - 1e-9)))
        assert (gap / size).max() > 0.1
    for start, end in pairwise([FIRST, *found, LAST]):
        rows = np.array([motion(law, x) for x in np.linspace(start + 1e-9, end - 1e-9, 1500)])
        assert (np.abs(np.diff(rows, axis=0)) / size).max() < 0.05


def test_jumps_follow_the_constants() -> None:
    law = SimpleHarmonic(1.0, 2.0)
    assert law.jumps(start=0.0, rise=1.0, begin=3.0, duration=0.5).at == (3.0, 3.5)
