"""Code of rows: when it is used, and where a formula has no derivative. Its numbers: the contracts of joints."""

from __future__ import annotations

import numpy as np
import pytest

import kinfmu
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.mechanism.body import Body
from kinfmu.mechanism.joints import Coupling
from kinfmu.mechanism.laws import Polynomial
from kinfmu.mechanism.quantities import AngleBetween, DistanceBetween
from kinfmu.plan import compile_plan
from kinfmu.plan.equations import system as system_module
from kinfmu.plan.equations.system import RARELY, System


def test_rows_get_code_when_they_are_evaluated_often(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    real = system_module.row_code
    monkeypatch.setattr(system_module, "row_code", lambda *given: made.append(given) or real(*given))
    system = System(kinfmu.load("crank_rocker"))
    own = system.members[0].coordinates(np.linspace(0.0, 1.0, len(system.coordinates)))
    for _ in range(RARELY):
        system.gradients(system.members[0], own)
    assert not made
    for _ in range(RARELY):
        system.gradients(system.members[0], own)
    assert len(made) == 1


def test_a_regular_mechanism_is_planned_without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system_module, "row_code", lambda *_: pytest.fail("code was made"))
    compile_plan(kinfmu.load("jansen_leg"))


@pytest.mark.parametrize("name", gallery.names())
def test_a_mechanism_has_the_same_rows(name: str) -> None:
    plain, coded = System(kinfmu.load(name)), System(kinfmu.load(name))
    coded.use_code()
    rng = np.random.default_rng(5)
    q = rng.normal(size=len(plain.coordinates)) * plain.column_scales
    u = rng.normal(size=len(plain.mechanism.drivers))
    for member, same in zip(plain.members, coded.members, strict=True):
        own = member.coordinates(q)
        assert list(plain.values(member, own, u)) == list(coded.values(same, own, u))
        scale = max(1.0, float(np.abs(q).max()))
        np.testing.assert_allclose(
            coded.gradients(same, own), plain.gradients(member, own), rtol=1e-14, atol=1e-15 * scale
        )


def test_where_a_root_is_zero_the_gradient_is_that_of_a_point_at_rest() -> None:
    """A coupling measures the distance of two points that are in one place."""
    bodies = [Body("ground", {"O": (0.0, 0.0)}), Body("bar", {"P": (0.0, 0.0)}, (0.0, 0.0, 0.0))]
    coupling = Coupling("turned", AngleBetween("bar"), DistanceBetween(("ground.O", "bar.P")), Polynomial((0.0, 2.0)))
    plain, coded = (System(Mechanism("touching", bodies, [coupling], [])) for _ in range(2))
    coded.use_code()
    at_rest = [0.0, 0.0, 0.0]
    gradients = [system.gradients(system.members[0], at_rest) for system in (coded, plain)]
    np.testing.assert_array_equal(*gradients)
