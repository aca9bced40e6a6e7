"""Engines side by side: every one solves what it can state, to what its setting promises."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

from benchmarks import singular
from benchmarks.accuracy import largest, prepared
from benchmarks.case import Case, along_driver, of_gallery
from benchmarks.charts import LOOKS
from benchmarks.engine import BenchEngine, EngineSetting
from benchmarks.engines import (
    CASADI,
    ENGINES,
    FSOLVE,
    GENERATED,
    KIMECH,
    NATIVE,
    NUMPY_NEWTON,
    PYLINKAGE,
    READABLE,
    SHIPPED,
)
from benchmarks.singular_points import POINTS, exact_fourbar
from kinfmu.errors import CompilerError, MissingPackageError
from kinfmu.mechanism.toml_file import parse
from kinfmu.plan import compile_plan
from kinfmu.plan.equations.reference import solve_reference
from tests.oracle import follow, fourbar, largest_error, reference_fourbar, slider_crank
from tests.power_series import Series, cos, sin

ROUND_OFF = 5e-13  # relative to a column's largest magnitude
KIMECH_CLOSES = 1e-9  # relative: the residual that kimech accepts

BAR_FOURBAR = """
name = "bar_fourbar"
[bodies]
ground = { points = { O = [0, 0], C = [40, 0] } }
crank = { points = { O = [0, 0], P = [20, 0] } }
coupler = { points = { P = [0, 0], Q = [50, 0] }, start = { x = 20, phi = "78 deg" } }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "coupler.P"] }
rocker = { type = "distance", between = ["ground.C", "coupler.Q"], length = 50 }
[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = 0, speed = 1 }
"""


@pytest.fixture(scope="module", params=["slider_crank", "excavator"])
def case(request: pytest.FixtureRequest) -> Case:
    return of_gallery(request.param)


@pytest.mark.parametrize("engine", [SHIPPED, NATIVE, GENERATED, NUMPY_NEWTON, READABLE], ids=lambda engine: engine.name)
@pytest.mark.few(2)
def test_newton_to_round_off_agrees_with_the_50_digits(engine: BenchEngine, case: Case) -> None:
    sampler = engine.sampler(case, engine.usual)
    assert sampler is not None
    assert max(largest(case, sampler)) <= ROUND_OFF


def test_fsolve_is_as_good_as_its_tolerance(case: Case) -> None:
    rough, fine = (largest(case, FSOLVE.sampler(case, EngineSetting(0, xtol)))[0] for xtol in (1e-3, 1e-15))
    assert fine <= ROUND_OFF
    assert fine <= rough <= 1e-2


PEERS = [(CASADI, "casadi", 1e-11), (PYLINKAGE, "pylinkage", 1e-11), (KIMECH, "kimech", KIMECH_CLOSES)]


@pytest.mark.parametrize(("engine", "package", "within"), PEERS, ids=["casadi", "pylinkage", "kimech"])
@pytest.mark.few(1)
def test_peers_agree_where_they_are_installed(engine: BenchEngine, package: str, within: float) -> None:
    pytest.importorskip(package)
    jansen = of_gallery("jansen_leg")
    absent: dict[str, None] = {}
    sampler = prepared(engine, jansen, engine.usual, absent)
    assert sampler is not None
    assert not absent
    assert max(largest(jansen, sampler)) <= within


@pytest.mark.parametrize(
    ("engine", "package", "name"),
    [(CASADI, "casadi", "CasADi"), (PYLINKAGE, "pylinkage", "pylinkage"), (KIMECH, "kimech", "kimech")],
)
def test_a_peer_that_is_not_installed_is_reported_in_one_line(
    engine: BenchEngine, package: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    crank_rocker = of_gallery("crank_rocker")
    message = f"{name} is not installed: pip install 'kinfmu[bench]'"
    with pytest.raises(MissingPackageError) as caught:
        engine.sampler(crank_rocker, engine.usual)
    assert str(caught.value) == message
    absent: dict[str, None] = {}
    assert prepared(engine, crank_rocker, engine.usual, absent) is None
    assert list(absent) == [message]


def test_without_a_compiler_the_native_engine_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def none_found(_: object) -> None:
        raise CompilerError("no C compiler is found")

    monkeypatch.setattr("benchmarks.engines.native.Library", none_found)
    absent: dict[str, None] = {}
    assert prepared(NATIVE, of_gallery("slider_crank"), EngineSetting(), absent) is None
    assert list(absent) == ["kinfmu native: no C compiler is found"]


def test_pylinkage_is_not_asked_for_what_it_cannot_state(case: Case) -> None:
    assert PYLINKAGE.sampler(case, PYLINKAGE.usual) is None


@pytest.mark.few(1)
def test_kimech_agrees_on_slides_and_on_driven_distances(case: Case) -> None:
    pytest.importorskip("kimech")
    sampler = KIMECH.sampler(case, KIMECH.usual)
    assert sampler is not None
    assert max(largest(case, sampler)) <= KIMECH_CLOSES


def test_kimech_agrees_on_a_distance_kept_by_a_bar() -> None:
    pytest.importorskip("kimech")
    u = np.linspace(0.0, 6.0, 31).tolist()
    exact = [table[:, :2] for table in fourbar(40, 20, 50, 50, u)]  # crank.phi, coupler.phi
    plan = compile_plan(parse(BAR_FOURBAR, "bar_fourbar"), ("crank.phi", "coupler.x", "coupler.y", "coupler.phi"))
    bar = along_driver("bar_fourbar", plan, u, range(len(u)), lambda _: np.zeros((3, 4)))
    sampler = KIMECH.sampler(bar, KIMECH.usual)
    assert sampler is not None
    rows = np.array(sampler(len(u))).reshape(-1, 3, 4)
    for order, table in enumerate(exact):
        assert largest_error(rows[:, order, [0, 3]], table, modulo_turns=order == 0) <= KIMECH_CLOSES


@pytest.mark.parametrize("name", ["fourbar", "cam_roller"])  # a redundant constraint; a cam
def test_kimech_is_not_asked_for_what_it_refuses(name: str) -> None:
    pytest.importorskip("kimech")
    assert KIMECH.sampler(of_gallery(name), KIMECH.usual) is None


def test_a_sample_that_kimech_refuses_is_a_gap_and_those_after_it_are_solved() -> None:
    pytest.importorskip("kimech")
    equal = singular.case_of(POINTS[2])
    sampler = KIMECH.sampler(equal, KIMECH.usual)
    assert sampler is not None
    errors = equal.errors(sampler(len(equal.t)))
    at = len(singular.DISTANCES)
    assert np.isnan(errors[at]).all()
    assert max(errors[0].max(), errors[-1].max()) <= KIMECH_CLOSES
    assert np.array_equal(equal.errors(sampler(len(equal.t))), errors, equal_nan=True)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("name", ["fourbar", "crank_rocker", "slider_crank", "stephenson_six_bar", "excavator"])
@pytest.mark.few(2)
def test_numpy_newton_agrees_on_every_kind_of_row_it_states(name: str, order: int) -> None:
    stated = of_gallery(name)
    sampler = NUMPY_NEWTON.sampler(stated, NUMPY_NEWTON.usual._replace(predictor=order))
    assert sampler is not None
    assert max(largest(stated, sampler)) <= 4e-14


def test_numpy_newton_is_not_asked_for_what_it_cannot_state() -> None:
    assert NUMPY_NEWTON.sampler(of_gallery("cam_roller"), NUMPY_NEWTON.usual) is None


def test_better_predictors_need_fewer_corrections_for_the_same_error() -> None:
    crank_rocker = of_gallery("crank_rocker")
    samplers = [READABLE.sampler(crank_rocker, EngineSetting(order, corrections=1)) for order in range(3)]
    errors = [largest(crank_rocker, sampler)[0] for sampler in samplers]
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]


def test_the_engine_of_the_readable_reference_equals_it_to_the_bit(case: Case) -> None:
    system = case.system
    u, ud, udd = (np.array(table[0]) for table in (case.u, case.ud, case.udd))
    solution = solve_reference(system, case.rows, case.start_coordinates, u, ud, udd)
    chosen = [system.coordinates.index(name) for name in case.columns]
    sampler = READABLE.sampler(case, EngineSetting(0))
    assert sampler(1)[0] == [*solution.q[chosen], *solution.qd[chosen], *solution.qdd[chosen]]


def test_a_column_that_is_zero_is_judged_by_its_kind_and_a_sample_not_found_is_no_number() -> None:
    mechanism = of_gallery("fourbar")
    flat = mechanism.columns.index("coupler.phi")
    assert mechanism.scale[:, flat] == pytest.approx(mechanism.scale[:, mechanism.columns.index("crank.phi")])
    assert mechanism.scale[2, flat] == 1.0  # no angle of it accelerates
    rows = [[math.nan] * (3 * len(mechanism.columns))] * len(mechanism.t)
    assert np.isnan(mechanism.errors(rows)).all()


def test_every_engine_has_a_name_and_a_look_of_its_own_and_its_usual_setting_among_those_measured() -> None:
    assert len({engine.name for engine in ENGINES}) == len(ENGINES)
    assert {engine.name for engine in ENGINES} == set(LOOKS)
    for engine in ENGINES:
        assert engine.usual in engine.settings
        assert len(set(engine.settings)) == len(engine.settings)


# ------------------------------------------------------------------------------------------------- singular points


@pytest.mark.parametrize("u", [0.4, 2.0, 3.1, 3.2, 5.0])
def test_the_oracle_of_the_change_point_is_the_closed_form_near_it(u: float) -> None:
    exact = fourbar(4, 1, 3, 2, u, branch=1 if u < math.pi else -1)
    ours = exact_fourbar(4, 1, 3, 2, u)
    columns = [0, 3, 4]
    for k, table in enumerate(exact):
        assert largest_error(ours[k, columns], table, modulo_turns=k == 0) <= 1e-14


@pytest.mark.long
def test_the_oracle_of_the_change_point_goes_on_smoothly_exactly_at_it() -> None:
    def closure(q: object, u: object) -> list[Series]:
        coupler, rocker = q  # type: ignore[misc]
        return [
            cos(u) + 3 * cos(coupler) - 4 - 2 * cos(rocker),
            sin(u) + 3 * sin(coupler) - 2 * sin(rocker),
        ]

    at = [math.pi - 1e-8, math.pi, math.pi + 1e-8]
    found = follow(closure, [0.4, 1.9], 2.8, at)
    for k, u in enumerate(at):
        for order, table in enumerate(found):
            assert largest_error(exact_fourbar(4, 1, 3, 2, u)[order, 3:], table[k]) <= 1e-14


@pytest.mark.parametrize("u", [0.4, 1.5, 1.6, 3.1, 3.2])
def test_closed_forms_in_doubles_are_those_of_50_digits(u: float) -> None:
    parallelogram, isosceles = (point.closed_form(u) for point in POINTS[1:])
    for order, exact in enumerate(reference_fourbar(u)):
        assert largest_error(parallelogram[order], exact) <= 1e-15
    branch = 1 if u < math.pi / 2 else -1  # the rod goes on past the pivot
    columns = [0, 3, 4]  # crank.phi, rod.phi, piston.x
    for order, exact in enumerate(slider_crank(1, 1, 0, u, branch=branch)):
        assert largest_error(isosceles[order, columns], exact, modulo_turns=order == 0) <= 1e-15


def test_without_mpmath_it_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mpmath", None)
    near, absent = singular.measure(1, engines=[SHIPPED])
    assert absent == ("four-bar 4-1-3-2 at 180 deg: mpmath is not installed: pip install 'kinfmu[bench]'",)
    assert [one.point for one in near] == [point.title for point in POINTS[1:]]


@pytest.mark.parametrize("engine", [SHIPPED, NATIVE], ids=lambda engine: engine.name)
@pytest.mark.parametrize("point", POINTS, ids=lambda point: point.title)
@pytest.mark.few(2)
def test_kinfmu_keeps_its_digits_through_the_point_and_stays_on_the_branch(
    point: singular.Point, engine: BenchEngine
) -> None:
    case = singular.case_of(point)
    sampler = engine.sampler(case, EngineSetting())
    assert sampler is not None
    q, qd, qdd = case.errors(sampler(len(case.t))).max(axis=0)
    assert q <= 1e-13
    assert qd <= 1e-11
    assert qdd <= 1e-9


@pytest.mark.long
def test_plain_newton_loses_them_and_the_table_shows_it() -> None:
    near, _ = singular.measure(1, engines=[SHIPPED, GENERATED])
    change_point = [one for one in near if one.point == POINTS[0].title]
    shipped, plain = change_point
    assert plain.before[-1][2] > 1e3  # the acceleration, 1e-8 rad before the point
    assert plain.at[1] > 0.1
    assert plain.beyond[0][1] > 0.5  # and it leaves on the other branch
    assert max(map(np.max, (shipped.before, shipped.at, shipped.beyond))) < 1e-9
