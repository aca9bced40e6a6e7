"""The native engine agrees with the Python engine, for any order of samples, past singular points too."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.codegen.lanes.lanes import emit_lanes
from kinfmu.draw.scene.completed import COST, with_estimates
from kinfmu.errors import CompilerError, KinfmuError
from kinfmu.plan import compile_plan
from kinfmu.run import Run
from kinfmu.run import native_engine as library
from kinfmu.run.engine import Driven
from tests.fmu.test_parameters import geared, linkage
from tests.gallery_members import every_member
from tests.mechanisms import uneven_chain

MODEL = import_module("kinfmu.run.model")
ENGINES = ("native", "python")
SAMPLES = 1100  # enough for samples to be solved in lanes


@pytest.fixture(scope="module", autouse=True)
def strictly_compiled() -> Iterator[None]:
    """Warnings are errors; in tests that are `optimized` the compiler is that of a user."""
    try:
        compiler.command()
    except CompilerError as error:
        pytest.skip(str(error))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(library, "FLAGS", (*library.FLAGS, "-Wall", "-Wextra", "-Wconversion", "-Werror"))
        yield


def assert_same_motion(native: Run, python: Run) -> None:
    """Positions to 1e-12 of the column's largest magnitude, rates within what both estimate of themselves."""
    np.testing.assert_array_equal(native.good, python.good)
    good = python.good
    estimates = native.error + python.error
    size = max(float(np.abs(python.values[good]).max(initial=1e-30)), 1e-30)
    for order, name in enumerate(("values", "rates", "accelerations")):
        ours, theirs = getattr(native, name)[good], getattr(python, name)[good]
        scale = np.maximum(np.abs(theirs).max(axis=0, initial=0.0), np.abs(theirs).max(initial=0.0))
        allowed = 1e-12 * scale + (estimates[good, order, None] * max(size, 1.0) if order else 0.0)
        assert (np.abs(ours - theirs) <= allowed).all(), name
    assert np.isnan(native.values[~good]).all()
    np.testing.assert_allclose(native.watch, python.watch, rtol=0, atol=1e-12)


@every_member
@pytest.mark.few(1)
def test_the_gallery_moves_as_in_python(name: str) -> None:
    mechanism = kinfmu.load(name)
    plan = compile_plan(mechanism)
    settings = mechanism.run
    t = np.linspace(settings.start, settings.stop, SAMPLES)
    native, python = (kinfmu.solve(plan, t, engine=engine) for engine in ("native", "python"))
    assert_same_motion(native, python)
    assert native.info["engine"] == "native"
    assert [(event.t, event.text) for event in native.events] == [(event.t, event.text) for event in python.events]


@every_member
@pytest.mark.few(1)
def test_loops_over_lanes_read_no_parameters_which_stores_might_change(name: str) -> None:
    text = emit_lanes(compile_plan(kinfmu.load(name))).get("lanes.c", "")
    assert not [line for line in text.splitlines() if line.startswith("        ") and "= model->" in line]


def _coarse_turns(rng: np.random.Generator) -> Iterator[np.ndarray]:
    yield np.arange(600) * np.radians(7.0) - 3.0
    yield rng.uniform(-200.0, 200.0, 600)
    yield np.linspace(0.0, 2.0 * np.pi, 130)


@pytest.mark.parametrize("name", ["crank_rocker", "fourbar", "jansen_leg"])
@pytest.mark.few(1)
def test_samples_in_many_segments_are_those_of_python(name: str) -> None:
    plan = compile_plan(kinfmu.load(name))
    driver = plan.drivers[0].inputs[0]
    for u in _coarse_turns(np.random.default_rng(8)):
        native, python = (kinfmu.solve(plan, engine=engine, **{driver: u}) for engine in ("native", "python"))
        assert_same_motion(native, python)


@pytest.mark.usefixtures("optimized")
@pytest.mark.long
def test_change_points_are_crossed_at_full_accuracy_in_any_order() -> None:
    rng = np.random.default_rng(5)
    turns = np.concatenate(
        [np.arange(-720, 1800) * (np.pi / 180.0), np.pi * np.arange(-4, 9), rng.uniform(-9, 30, 500)]
    )
    for u in (np.sort(turns), rng.permutation(turns)):
        run = kinfmu.solve(kinfmu.load("fourbar"), crank_angle=u, engine="native")
        assert (run.status <= 2).all()
        np.testing.assert_allclose(run["coupler.phi"], 0.0, rtol=0, atol=1e-12)
        np.testing.assert_allclose(run["rocker.phi"], u, rtol=0, atol=1e-12)
        np.testing.assert_allclose(run["rocker.omega"], 1.0, rtol=0, atol=1e-10)
        np.testing.assert_allclose(run["rocker.alpha"], 0.0, rtol=0, atol=1e-8)
        np.testing.assert_allclose(run["coupler.ax"], -np.cos(u), rtol=0, atol=1e-8)


@pytest.mark.long
def test_optimizing_compilers_find_nothing_to_warn_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library, "FLAGS", (*library.FLAGS, "-O2"))
    assert kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=[1.0, 2.0], engine="native").good.all()


@pytest.mark.long
def test_optimization_changes_no_bit(request: pytest.FixtureRequest) -> None:
    plan = compile_plan(kinfmu.load("jansen_leg"))
    angles = driven(np.linspace(0.0, 6.0, 120))  # too few for lanes, which fuse on purpose
    found = [np.zeros((3, 120, len(plan.outputs))) for _ in range(2)]
    library.Library(plan).sweep(angles, found[0])
    request.getfixturevalue("optimized")
    library.Library(plan).sweep(angles, found[1])
    np.testing.assert_array_equal(*found)


def test_most_samples_are_solved_in_lanes() -> None:
    plan = compile_plan(kinfmu.load("crank_rocker"))
    result = library.Library(plan).sweep(driven(np.linspace(0.0, 300.0, SAMPLES)), tables(plan.outputs))
    assert result.side_by_side == SAMPLES  # the last ones together with some that are solved already
    assert (result.outcomes[:, 0] == 0).all()


@pytest.mark.usefixtures("optimized")
@pytest.mark.long
def test_loops_of_one_kind_with_other_lengths_agree_with_python() -> None:
    u = np.linspace(1.0, 8.0, SAMPLES)
    native, python = (kinfmu.solve(uneven_chain(4), crank_angle=u, engine=engine) for engine in ("native", "python"))
    assert_same_motion(native, python)


@pytest.mark.usefixtures("optimized")
def test_windows_of_bridges_are_read_in_lanes() -> None:
    u = 0.3 + np.arange(64 * 60) * (np.pi / 180.0)
    plan = compile_plan(kinfmu.load("fourbar"), ("coupler.x", "rocker.phi"))
    values, rates, accelerations = (np.empty((len(u), 2)) for _ in range(3))
    speed, acceleration = np.sin(u), np.cos(3.0 * u)
    inputs = (u[:, None], speed[:, None], acceleration[:, None])
    result = library.Library(plan).sweep(inputs, (values, rates, accelerations))
    assert result.side_by_side > len(u) - 2 * 8  # in either window few may be left over
    bridged = (result.outcomes[:, 0] == 2).sum()
    assert 90 <= bridged <= 150  # at 21 change points windows of 0.1 rad: five or six samples each
    np.testing.assert_allclose(values, np.stack([1.0 + np.cos(u), u], axis=1), rtol=0, atol=1e-12)
    np.testing.assert_allclose(rates, np.stack([-np.sin(u) * speed, speed], axis=1), rtol=0, atol=1e-10)
    exact = np.stack([-np.cos(u) * speed**2 - np.sin(u) * acceleration, acceleration], axis=1)
    np.testing.assert_allclose(accelerations, exact, rtol=0, atol=1e-8)
    assert result.residual.max() <= 1e-12


@pytest.mark.parametrize("offset", [0, 3, 7])
@pytest.mark.parametrize("order", ["C", "F"])
def test_large_tables_are_filled_wherever_they_begin(offset: int, order: Literal["C", "F"]) -> None:
    plan = compile_plan(kinfmu.load("crank_rocker"))
    compiled = library.Library(plan)
    count, columns = 24_037, len(plan.outputs)  # more than goes through the caches, and no whole number of lanes
    assert count * columns * 3 * 8 > 4e6
    u = np.linspace(0.0, 70.0, count)
    arrays = [np.full(count * columns + offset + 1, 7.0) for _ in range(3)]
    large = [array[offset:-1].reshape((count, columns), order=order) for array in arrays]
    result = compiled.sweep(driven(u), large)
    assert all((array[:offset] == 7.0).all() and array[-1] == 7.0 for array in arrays)
    assert (result.outcomes[:, 0] == 0).all()
    for part in np.array_split(np.arange(count), 5):
        small = [np.empty((len(part), columns), order=order) for _ in range(3)]
        few = compiled.sweep(driven(u[part]), small)
        np.testing.assert_array_equal(result.outcomes[part, 1] > 0, few.outcomes[:, 1] > 0)
        for one, other in zip(large, small, strict=True):
            np.testing.assert_allclose(one[part], other, rtol=0, atol=1e-11)
            assert np.abs(other).max() > 1.0


@pytest.mark.parametrize("offset", range(4))
def test_nan_inputs_are_reported_in_large_tables_too(offset: int) -> None:
    plan = compile_plan(kinfmu.load("crank_rocker"))
    count, columns = 24_037, len(plan.outputs)
    u = np.linspace(0.0, 70.0, count)
    for k, nothing in enumerate((np.nan, np.inf, -np.inf)):
        u[60 + k :: 64] = nothing  # at the end of the lanes, where a line of the tables may still be to be written
    space = np.full((3, count * columns + offset), 7.0)
    large = [one[offset:].reshape((count, columns), order="F") for one in space]
    result = library.Library(plan).sweep(driven(u), large)
    np.testing.assert_array_equal(result.outcomes[:, 0], np.where(np.isfinite(u), 0, 3))
    for table in large:
        np.testing.assert_array_equal(np.isfinite(table).all(axis=1), np.isfinite(u))
        np.testing.assert_array_equal(np.isnan(table).all(axis=1), ~np.isfinite(u))
    np.testing.assert_array_equal(np.isfinite(result.residual), np.isfinite(u))
    assert result.failures[0] == (60, "crank = nan rad (nan deg) is not a finite number")


def test_the_result_of_an_earlier_sweep_can_be_reused() -> None:
    plan = compile_plan(kinfmu.load("crank_rocker"))
    compiled = library.Library(plan)
    first = compiled.sweep(driven(np.linspace(0.0, 7.0, SAMPLES)), tables(plan.outputs))
    expected = first.residual.copy()
    first.residual[:] = -1.0
    again = compiled.sweep(driven(np.linspace(0.0, 7.0, SAMPLES)), tables(plan.outputs), reuse=first)
    assert again.residual is first.residual
    np.testing.assert_array_equal(again.residual, expected)
    with pytest.raises(KinfmuError, match=r"the result to reuse has \(1100, 0\) samples and watches, not \(2, 0\)"):
        compiled.sweep(driven(np.zeros(2)), [np.zeros((2, len(plan.outputs)))] * 3, reuse=first)


def test_intervals_beyond_the_reported_ones_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library, "MOST_FAILURES", 2)
    plan = compile_plan(kinfmu.load("triple_rocker"))
    u = np.where(np.arange(SAMPLES) % 100 < 50, 1.0, 9.0)
    failures = library.Library(plan).sweep(driven(u), tables(plan.outputs)).failures
    assert [sample for sample, _ in failures] == [50, 150, 250]
    assert failures[-1][1] == "9 more intervals without numbers begin here or later; 2 are reported"


def test_running_out_of_memory_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = compile_plan(kinfmu.load("crank_rocker"))
    compiled = library.Library(plan)
    for name, nothing in (("kf_sweep_new", None), ("kf_sweep_run", False)):
        with monkeypatch.context() as patch:
            patch.setattr(compiled._library, name, lambda *_, nothing=nothing: nothing)
            with pytest.raises(
                KinfmuError, match=f"no memory is left for a sweep of {SAMPLES} samples of 'crank_rocker'"
            ):
                compiled.sweep(driven(np.linspace(0.0, 7.0, SAMPLES)), tables(plan.outputs))


def test_samples_past_a_limit_are_reported_and_the_branch_comes_back() -> None:
    mechanism = kinfmu.load("triple_rocker")
    u = np.concatenate([np.linspace(0.9, 4.0, 700), np.linspace(4.0, 0.9, 700)])
    native, python = (kinfmu.solve(mechanism, left_angle=u, engine=engine) for engine in ("native", "python"))
    assert_same_motion(native, python)
    assert 0 < native.good.sum() < len(u)
    assert [event.text for event in native.events] == [event.text for event in python.events]


@pytest.mark.long
def test_after_thousands_of_turns_samples_are_as_good_as_at_first() -> None:
    u = 2.0 * np.pi * 3_000 + np.linspace(0.0, 7.0, 700)  # the last ones fill no lanes
    native, python = (kinfmu.solve(kinfmu.load("jansen_leg"), engine=engine, crank_angle=u) for engine in ENGINES)
    assert (native.status == 0).all()
    assert native.residual.max() <= 1e-14
    is_length = [not name.endswith(".phi") for name in native.outputs]  # of angles, digits are lost to the turns
    for order, name in enumerate(("values", "rates", "accelerations")):
        ours, theirs = (getattr(run, name)[:, is_length] for run in (native, python))
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=(1e-12, 1e-11, 1e-10)[order] * np.abs(theirs).max())


def test_no_good_sample_has_a_residual_above_the_tolerance() -> None:
    u = np.linspace(9e4, 9e4 + 7.0, 700)
    run = kinfmu.solve(kinfmu.load("jansen_leg"), engine="native", crank_angle=u, tolerance=1e-12)
    assert run.good.all()
    assert run.residual[run.good].max() <= 1e-12


def test_tables_may_be_laid_out_by_samples_or_by_outputs() -> None:
    u = np.linspace(0.5, 2.0, SAMPLES)
    mechanism = kinfmu.load("fourbar")
    runs = []
    for order in ("C", "F"):
        out = tuple(np.full((SAMPLES, 7), 7.0, order=order) for _ in range(3))  # type: ignore[call-overload]
        run = kinfmu.solve(mechanism, crank_angle=u, engine="native", out=out)  # type: ignore[arg-type]
        assert run.values is out[0]
        runs.append(run)
    np.testing.assert_array_equal(runs[0].accelerations, runs[1].accelerations)


def test_positions_alone_can_be_solved() -> None:
    plan = compile_plan(kinfmu.load("crank_rocker"))
    whole, alone = tables(plan.outputs), tables(plan.outputs)
    samples = driven(np.linspace(0.0, 7.0, SAMPLES))
    compiled = library.Library(plan)
    compiled.sweep(samples, whole)
    compiled.sweep(samples, (alone[0], None, None))
    np.testing.assert_array_equal(alone[0], whole[0])


def test_other_parameters_are_reached_by_continuation() -> None:
    others = {"ground": 4.2, "crank": 1.3, "coupler": 3.1, "rocker": 3.3}
    native, python = (
        kinfmu.solve(linkage(), np.linspace(0.0, 6.0, SAMPLES), parameters=others, engine=engine)
        for engine in ("native", "python")
    )
    assert_same_motion(native, python)
    with pytest.raises(KinfmuError, match="leave a gap of"):
        library.Library(compile_plan(linkage())).sweep(
            driven(np.zeros(2)), tables(("a",) * 13), parameters=[4.0, 1.0, 0.5, 0.5]
        )


def test_laws_depend_on_parameters() -> None:
    t = np.linspace(0.0, 1.0, SAMPLES)
    runs = [kinfmu.solve(geared(), t, parameters={"pace": 2.0}, engine=engine) for engine in ("python", "native")]
    np.testing.assert_allclose(runs[1].values, runs[0].values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(runs[1].accelerations, runs[0].accelerations, rtol=0, atol=1e-9)


def test_auto_takes_python_for_few_samples_and_native_for_many(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.linspace(0.0, 90.0, 50)
    assert kinfmu.solve(kinfmu.load("fourbar"), t).info["engine"] == "python"
    monkeypatch.setattr(MODEL, "WORTH_COMPILING", 50)
    assert kinfmu.solve(kinfmu.load("fourbar"), t).info["engine"] == "native"


def test_estimates_of_a_record_are_native_if_the_library_is_compiled(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    mechanism = kinfmu.load("crank_rocker")
    run = with_estimates(kinfmu.solve(mechanism, np.linspace(0.0, 2.0, MODEL.WORTH_LOADING // COST)))
    few = with_estimates(run.part(slice(0, 10)))
    model = kinfmu.compile(mechanism)
    assert not model.is_native(MODEL.WORTH_LOADING, if_cached=True)
    estimates = run.part(slice(0, len(run))).error  # by Python
    model.by("native").load_library()
    assert model.is_native(MODEL.WORTH_LOADING, if_cached=True)
    assert not model.is_native(10, if_cached=True)
    assert not model.is_native(MODEL.WORTH_LOADING)
    assert few.error.tobytes() == estimates[:10].tobytes()
    by_c = with_estimates(run).error
    assert by_c.tobytes() != estimates.tobytes()
    np.testing.assert_allclose(by_c, estimates, rtol=0.9)


def test_without_a_compiler_auto_is_python_and_native_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> tuple[str, ...]:
        raise CompilerError("no C compiler: cc, gcc and clang are not found")

    monkeypatch.setattr(compiler, "command", none)
    monkeypatch.setattr(MODEL, "WORTH_COMPILING", 0)
    fourbar = kinfmu.load("fourbar")
    assert kinfmu.compile(fourbar).solve([0.0]).info["engine"] == "python"
    with pytest.raises(CompilerError, match="no C compiler"):
        kinfmu.compile(fourbar, engine="native")


def test_times_and_tables_may_be_views_of_others() -> None:
    mechanism = kinfmu.load("crank_rocker")
    t = np.linspace(0.0, 4.0, 3 * SAMPLES)[::3]
    out = tuple(np.zeros((SAMPLES, 7), dtype=[("a", "f8"), ("b", "i4")])["a"] for _ in range(3))
    strided = kinfmu.solve(mechanism, t, engine="native", out=out)  # type: ignore[arg-type]
    plain = kinfmu.solve(mechanism, t.copy(), engine="native")
    np.testing.assert_array_equal(strided.values, plain.values)
    np.testing.assert_array_equal(strided.accelerations, plain.accelerations)
    size = SAMPLES * 7 * 8
    odd = tuple(np.zeros(size + 3, dtype=np.uint8)[3:].view(np.float64).reshape(SAMPLES, 7) for _ in range(3))
    kinfmu.solve(mechanism, t, engine="native", out=odd)  # type: ignore[arg-type]
    np.testing.assert_array_equal(odd[2], plain.accelerations)
    out[1].flags.writeable = False
    with pytest.raises(KinfmuError, match="out: rates is read-only"):
        kinfmu.solve(mechanism, t, engine="native", out=out)  # type: ignore[arg-type]


@pytest.mark.parametrize("engine", ["python", "native"])
def test_tables_that_share_memory_are_refused(engine: str) -> None:
    mechanism = kinfmu.load("crank_rocker")
    t = np.linspace(0.0, 1.0, 5)
    whole = np.zeros((14, 7))
    one, apart = whole[:5], whole[9:]
    for out, names in (
        ((one, one, one), "values and rates"),
        ((one, whole[4:9], apart), "values and rates"),  # by a row
        ((one, apart, whole[:10:2]), "values and accelerations"),
        ((apart, one, whole[4:9]), "rates and accelerations"),
    ):
        with pytest.raises(KinfmuError, match=f"^out: {names} share memory; each needs an array of its own$"):
            kinfmu.solve(mechanism, t, engine=engine, out=out)
    between = np.zeros((5, 3, 7))  # side by side in memory
    run = kinfmu.solve(mechanism, t, engine=engine, out=tuple(between[:, k] for k in range(3)))  # type: ignore[arg-type]
    np.testing.assert_array_equal(run.rates, kinfmu.solve(mechanism, t, engine=engine).rates)


def test_only_what_angles_turn_in_sines_and_cosines_is_taken_to_repeat() -> None:
    def repeats(name: str) -> bool:
        return "KF_REPEATS 1" in emit_lanes(compile_plan(kinfmu.load(name)))["lane_sizes.h"]

    assert [repeats(name) for name in ("fourbar", "jansen_leg", "fourbar_chain:3")] == [True, True, True]
    assert [repeats(name) for name in ("geared_five_bar", "rack_steering", "stephenson_six_bar")] == [False] * 3


def driven(u: np.ndarray) -> Driven:
    column = np.asarray(u, dtype=float)[:, None]
    return column, np.ones_like(column), np.zeros_like(column)


def tables(outputs: tuple[str, ...]) -> list[np.ndarray]:
    return [np.zeros((SAMPLES, len(outputs)), order="F") for _ in range(3)]
