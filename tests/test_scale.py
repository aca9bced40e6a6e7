"""Scale: accuracy is relative to the size, from 1e-6 to 1e6, long and short links mixed, far from the origin too."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import kinfmu
from kinfmu import (
    AngleBetween,
    AngleDriver,
    Body,
    ConstantSpeed,
    CoordinateDriver,
    CoordinateOf,
    Coupling,
    Distance,
    Mechanism,
    RackAndPinion,
    Revolute,
    Run,
    Translational,
)
from kinfmu.errors import AssemblyError, InconsistentError
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Status
from kinfmu.solver.python.trusted_step import trusted_step
from tests import oracle
from tests.analysis.linkages import pushed_crank
from tests.gallery_members import every_member
from tests.mechanisms import PINS, fourbar, scaled
from tests.oracle import Motion, Residual, largest_error, mp
from tests.reports import unwrapped

SCALES = [1e-6, 1e-3, 1.0, 1e3, 1e6]
BARS = (4.0, 1.0, 3.5, 3.0)  # ground, crank, coupler, rocker
ANGLES = [0.4 + 0.6 * k for k in range(10)]
FAR = (1000000.7, -999999.3)  # of which doubles keep ten digits after the point


def written(value: float) -> float:
    """The double of a decimal number of 15 digits: what a person would write."""
    return float(f"{value:.15g}")


def crank_rocker(bars: Sequence[float], at: tuple[float, float] = (0.0, 0.0)) -> Mechanism:
    """A four-bar about `at`; inputs crank_angle, ..."""
    return fourbar(*bars, at=at)


def angles_off(run: Run, exact: Motion) -> list[float]:
    """Largest errors of the three angles and of their rates."""
    names = ["crank.phi", "coupler.phi", "rocker.phi"]
    columns = [run.outputs.index(name) for name in names]
    tables = zip((run.values, run.rates, run.accelerations), exact, strict=True)
    return [largest_error(ours[:, columns], table, modulo_turns=not k) for k, (ours, table) in enumerate(tables)]


def tips_off(run: Run, crank: float, at: tuple[float, float] = (0.0, 0.0)) -> list[float]:
    """Largest errors of the crank's tip, its velocity and its acceleration, at speed 1."""
    u = [mp.mpf(float(angle)) for angle in run["crank_angle"]]
    a, (x, y) = mp.mpf(repr(crank)), map(mp.mpf, map(repr, at))
    exact = [
        [[x + a * mp.cos(b), y + a * mp.sin(b)] for b in u],
        [[-a * mp.sin(b), a * mp.cos(b)] for b in u],
        [[-a * mp.cos(b), -a * mp.sin(b)] for b in u],
    ]
    names = [("x", "y"), ("vx", "vy"), ("ax", "ay")]
    return [
        largest_error(np.column_stack([run[f"coupler.{c}"] for c in letters]), np.array(table, dtype=object))
        for letters, table in zip(names, exact, strict=True)
    ]


# --------------------------------------------------------------------------------------------------- all sizes


@every_member
@pytest.mark.few(2)
def test_a_mechanism_larger_by_a_power_of_two_moves_equally_to_the_bit(name: str) -> None:
    mechanism = kinfmu.load(name)
    times = np.linspace(mechanism.run.start, mechanism.run.stop, 9)
    original = kinfmu.solve(scaled(mechanism, 1.0), times)
    for factor in (2.0**-20, 2.0**20):
        run = kinfmu.solve(scaled(mechanism, factor), times)
        units = np.array([1.0 if output.endswith(".phi") else factor for output in run.outputs])
        for ours, theirs in zip(_tables(run), _tables(original), strict=True):
            np.testing.assert_array_equal(ours / units, theirs)
        for table in ("status", "iterations", "residual", "error"):
            np.testing.assert_array_equal(getattr(run, table), getattr(original, table))
        np.testing.assert_allclose(
            run.margin, original.margin, rtol=0.1
        )  # relative to the largest of random poses, two digits


def _tables(run: Run) -> tuple[np.ndarray, ...]:
    return run.values, run.rates, run.accelerations


@pytest.mark.parametrize(
    ("name", "factor"),
    [(name, factor) for name in ("fourbar", "slider_crank", "triple_rocker") for factor in (1e-6, 1e6)]
    + [("parallel_jaw", 1e-6), ("excavator", 1e6)],
)
@pytest.mark.few(2)
def test_check_finds_the_same_at_every_size(name: str, factor: float) -> None:
    mechanism = kinfmu.load(name)
    report, original = kinfmu.check(scaled(mechanism, factor)), kinfmu.check(mechanism)
    assert report.problem is None
    assert report.mobility == original.mobility
    assert [row.row.name for row in report.redundant] == [row.row.name for row in original.redundant]
    assert [point.kind for point in report.singular] == [point.kind for point in original.singular]
    for drivers, ours, theirs in zip(mechanism.drivers, report.singular, original.singular, strict=False):
        if drivers.measured().kind == "angle":
            assert ours.value == pytest.approx(theirs.value, abs=1e-10)
    assert len(report.notes) == len(original.notes)


@pytest.mark.parametrize("scale", SCALES)
def test_four_bars_of_all_sizes_are_right_to_round_off(scale: float) -> None:
    bars = [written(bar * scale) for bar in BARS]
    run = kinfmu.solve(crank_rocker(bars), crank_angle=ANGLES)
    assert max(angles_off(run, oracle.fourbar(*map(repr, bars), ANGLES))) < 2e-15
    assert max(tips_off(run, bars[1])) < 1e-15 * max(bars)


@pytest.mark.parametrize("scale", SCALES)
def test_slides_of_all_sizes_are_right_to_round_off(scale: float) -> None:
    crank, rod = written(1.1 * scale), written(3.2 * scale)
    run = kinfmu.solve(_slider_crank(crank, rod), crank_angle=ANGLES)
    exact = oracle.slider_crank(repr(crank), repr(rod), "0", ANGLES)
    for order, column in enumerate(("slider.x", "slider.vx", "slider.ax")):
        assert largest_error(run[column], exact[order][:, 2]) < 2e-15 * rod


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_fmus_of_all_sizes_are_right_to_round_off(scale: float, tmp_path: Path) -> None:
    bars = [written(bar * scale) for bar in BARS]
    run = kinfmu.simulate(kinfmu.build(crank_rocker(bars), tmp_path / "small.fmu"), stop=5.0, step=0.5)
    assert run.good.all()
    u = run["crank_angle"].tolist()
    assert max(angles_off(run, oracle.fourbar(*map(repr, bars), u))) < 2e-15
    assert max(tips_off(run, bars[1])) < 1e-15 * max(bars)


@pytest.mark.parametrize("scale", [2.0**-20, 1e-6, 1.0, 1e6])
def test_change_points_are_bridged_equally_at_all_sizes_where_the_unknown_is_a_length(scale: float) -> None:
    angles = np.array([1.0, math.pi / 2 - 1e-3, math.pi / 2, math.pi / 2 + 0.04, 2.5, 3 * math.pi / 2, 6.0])
    folding = Mechanism(
        "folding",
        [
            Body("ground", {"O": (0, 0)}),
            Body("crank", {"O": (0, 0), "P": (scale, 0)}, (0, 0, 1.0)),
            Body("block", {"S": (0, 0)}, (1.08 * scale, 0, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Translational("slide", ("ground.O", "block.S")),
            Distance("rod", ("crank.P", "block.S"), length=scale),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(1.0, 1.0))],
    )
    assert compile_plan(folding).unknowns == ("block.x",)
    run = kinfmu.solve(folding, crank_angle=angles)
    assert run.status.tolist().count(Status.BRIDGED) == 4
    assert (run.status <= Status.BRIDGED).all()
    np.testing.assert_allclose(run["block.x"] / scale, 2 * np.cos(angles), rtol=0, atol=1e-13)
    np.testing.assert_allclose(run["block.ax"] / scale, -2 * np.cos(angles), rtol=0, atol=1e-10)


# ------------------------------------------------------------------------------------------- long and short links


@pytest.mark.parametrize("ratio", [1e2, 1e4])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.few(3)
def test_short_cranks_on_long_links_are_right_relative_to_the_size(ratio: float, scale: float) -> None:
    bars = [written(bar * scale) for bar in (ratio + 0.3, 1.1, ratio, 1.7)]
    run = kinfmu.solve(crank_rocker(bars), crank_angle=ANGLES)
    exact = oracle.fourbar(*map(repr, bars), ANGLES)
    angles = angles_off(run, exact)
    assert max(tips_off(run, bars[1])) < 1e-15 * ratio * scale
    assert max(angles) < 2e-15 * ratio  # of a short link between ends that are known to eps of the size
    assert (np.array(angles) <= run.error.max(axis=0)).all()
    report = kinfmu.check(crank_rocker(bars))
    assert (report.mobility, report.redundancy.dependent, report.problem) == (1, (), None)


# ----------------------------------------------------------------------------------------------- redundant bars


def third_crank(ratio: float, wrong: float, *, is_body: bool, at: tuple[float, float] = (0.0, 0.0)) -> Mechanism:
    """Three parallel cranks of length 1.1 under a coupler `ratio` long; the third is longer by `wrong` of itself."""
    crank, ground, (x, y) = 1.1, written(0.9 * ratio), (written(0.4 * ratio), 0.3)
    wrong_crank = crank * (1.0 + wrong)
    there = (written(at[0] + x), written(at[1] + y))
    bodies = [
        Body("ground", {"O": at, "C": (written(at[0] + ground), at[1]), "B": there}),
        Body("crank", {"O": (0, 0), "P": (crank, 0)}, (*at, 1.0)),
        Body("coupler", {"P": (0, 0), "Q": (ground, 0), "A": (x, y)}, (at[0] + 0.594, at[1] + 0.926, 0)),
        Body("rocker", {"C": (0, 0), "Q": (crank, 0)}, (at[0] + ground, at[1], 1.0)),
    ]
    joints: list[Revolute | Distance] = [*PINS]
    if is_body:
        bodies.append(Body("bar", {"B": (0, 0), "A": (wrong_crank, 0)}, (*there, 1.0)))
        joints += [Revolute("B", ("ground.B", "bar.B")), Revolute("A", ("coupler.A", "bar.A"))]
    else:
        joints.append(Distance("AB", ("ground.B", "coupler.A"), length=wrong_crank))
    return Mechanism("third_crank", bodies, joints, [AngleDriver("crank", "crank", ConstantSpeed(1.0, 1.0))])


@pytest.mark.parametrize("is_body", [False, True])
@pytest.mark.parametrize(
    ("ratio", "scale", "at"),
    [
        (2.0, 1.0, (0.0, 0.0)),
        (2.0, 1e-6, (0.0, 0.0)),
        (2.0, 1e6, FAR),
        (1e4, 1.0, (0.0, 0.0)),
    ],
)
@pytest.mark.few(2)
def test_a_third_crank_wrong_by_1e_9_of_its_length_is_distinguished_from_a_right_one(
    ratio: float, scale: float, at: tuple[float, float], is_body: bool
) -> None:
    def made(wrong: float) -> Mechanism:
        return scaled(third_crank(ratio, wrong, is_body=is_body, at=at), scale)

    report = kinfmu.check(made(0.0))
    assert (len(report.redundant), len(report.inconsistent)) == (1, 0)
    assert report.plan is not None
    run = kinfmu.solve(report.plan, crank_angle=ANGLES[:4])
    np.testing.assert_allclose(run["rocker.phi"], ANGLES[:4], rtol=0, atol=3e-15 * ratio)
    report = kinfmu.check(made(-1e-9 if is_body else 1e-9))
    assert (len(report.redundant), len(report.inconsistent)) == (0, 1)
    assert isinstance(report.problem, InconsistentError)


def test_the_tolerance_is_1e_11_of_the_link_and_check_states_it() -> None:
    report = kinfmu.check(third_crank(2.0, 0.0, is_body=False))
    (row,) = report.redundant
    assert row.tolerance == pytest.approx(1e-11 * 1.1)
    assert "it follows from O, P, Q, C, to within 1.1e-11 m" in unwrapped(report)
    report = kinfmu.check(third_crank(2.0, 1e-9, is_body=False))
    gap = "gap 1.1e-09 m at every pose; up to 1.1e-11 m would count as redundant"
    assert f"does not close with O, P, Q, C: {gap}" in unwrapped(report)


# --------------------------------------------------------------------------------------------- far from the origin


@pytest.mark.parametrize("at", [FAR, (1e6, -1e6), (-123456.7, 1000000.9)])
@pytest.mark.few(1)
def test_far_from_the_origin_angles_and_rates_are_as_near_it(at: tuple[float, float], tmp_path: Path) -> None:
    mechanism, exact = crank_rocker(BARS, at), oracle.fourbar(*map(repr, BARS), ANGLES)
    run = kinfmu.solve(mechanism, crank_angle=ANGLES)
    position, velocity, acceleration = tips_off(run, BARS[1], at)
    assert max(angles_off(run, exact)) < 2e-15
    assert max(velocity, acceleration) < 4e-15
    assert position < 1.5e-16 * math.hypot(*at)
    assert position <= run.error[:, 0].max() * 4.0  # sizes
    assert kinfmu.check(mechanism).problem is None

    simulated = kinfmu.simulate(kinfmu.build(mechanism, tmp_path / "far.fmu"), stop=5.0, step=0.5)
    exact = oracle.fourbar(*map(repr, BARS), simulated["crank_angle"].tolist())
    position, velocity, acceleration = tips_off(simulated, BARS[1], at)
    assert max(angles_off(simulated, exact)) < 2e-15
    assert max(velocity, acceleration) < 4e-15
    assert position < 1.5e-16 * math.hypot(*at)


def test_coordinates_held_far_from_the_origin_are_decimal_numbers_too() -> None:
    def folded(at: float) -> Mechanism:
        return Mechanism(
            "pin_on_a_line",
            [
                Body("ground", {"O": (at, at)}),
                Body("crank", {"O": (0, 0), "P": (0.5, 0)}, (at, at, 1.0)),
                Body("rod", {"P": (0, 0), "S": (1.3, 0)}, (at + 0.27, at + 0.42, -0.1)),
            ],
            [
                Revolute("O", ("ground.O", "crank.O")),
                Revolute("P", ("crank.P", "rod.P")),
                kinfmu.Coordinate("line", "rod.S", "y", written(at + 0.3)),
            ],
            [AngleDriver("crank", "crank", ConstantSpeed(1.0, 1.0))],
        )

    far, near = (kinfmu.solve(folded(at), crank_angle=ANGLES) for at in (1000000.1, 0.0))
    np.testing.assert_allclose(far["rod.phi"], near["rod.phi"], rtol=0, atol=1e-15)
    np.testing.assert_allclose(far["rod.omega"], near["rod.omega"], rtol=0, atol=1e-15)


def _slider_crank(crank: float, rod: float) -> Mechanism:
    return replace(pushed_crank(crank, rod, 0.0), drivers=[AngleDriver("crank", "crank", ConstantSpeed(0.8, 1.0))])


def far_slider_crank(x: float, y: float) -> tuple[Mechanism, Residual]:
    """Its slider is driven by its coordinate in the world."""
    mechanism = Mechanism(
        "slider_crank",
        [
            Body("ground", {"O": (x, y)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (x, y, 0.5)),
            Body("rod", {"P": (0, 0), "S": (2.5, 0)}, (x + 0.88, y + 0.48, -0.19)),
            Body("slider", {"S": (0, 0)}, (x + 3.3, y, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "rod.P")),
            Revolute("S", ("rod.S", "slider.S")),
            Translational("rail", ("ground.O", "slider.S")),
        ],
        [CoordinateDriver("slide", "slider.S", "x", ConstantSpeed(x + 3.3, -1.0))],
        coordinates=("crank.phi", "rod.phi", "slider.x"),
    )

    def residual(q: Sequence[Any], u: Any) -> list[Any]:
        crank, rod = ((oracle.cos(phi), oracle.sin(phi)) for phi in q[:2])
        return [x + crank[0] + rod[0] * 2.5 - q[2], crank[1] + rod[1] * 2.5, q[2] - u]

    return mechanism, residual


def far_bar(x: float, y: float) -> tuple[Mechanism, Residual]:
    """The same with the rod as a distance."""
    mechanism = Mechanism(
        "slider_bar",
        [
            Body("ground", {"O": (x, y)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (x, y, 0.5)),
            Body("slider", {"S": (0, 0)}, (x + 3.3, y, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Distance("rod", ("crank.P", "slider.S"), 2.5),
            Translational("rail", ("ground.O", "slider.S")),
        ],
        [CoordinateDriver("slide", "slider.S", "x", ConstantSpeed(x + 3.3, -1.0))],
        coordinates=("crank.phi", "slider.x"),
    )

    def residual(q: Sequence[Any], u: Any) -> list[Any]:
        dx, dy = x + oracle.cos(q[0]) - q[1], oracle.sin(q[0])
        return [dx * dx + dy * dy - 6.25, q[1] - u]

    return mechanism, residual


def far_tip(x: float, y: float) -> tuple[Mechanism, Residual]:
    """A crank driven by a coordinate of its tip."""
    mechanism = Mechanism(
        "tip",
        [Body("ground", {"O": (x, y)}), Body("crank", {"O": (0, 0), "P": (1, 0)}, (x, y, 0.5))],
        [Revolute("O", ("ground.O", "crank.O"))],
        [CoordinateDriver("tip", "crank.P", "x", ConstantSpeed(x + 0.9, -1.0))],
        coordinates=("crank.phi",),
    )
    return mechanism, lambda q, u: [x + oracle.cos(q[0]) - u]


def far_coupling(x: float, y: float) -> tuple[Mechanism, Residual]:
    """An arm whose angle follows a coordinate of a crank's tip."""
    slope, start = 20.0, -20.0 * (x + 0.9)
    mechanism = Mechanism(
        "coupling",
        [
            Body("ground", {"O": (x, y), "B": (x + 3.0, y)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (x, y, 0.5)),
            Body("arm", {"B": (0, 0), "E": (1, 0)}, (x + 3.0, y, 0.0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("B", ("ground.B", "arm.B")),
            Coupling("follow", CoordinateOf("crank.P", "x"), AngleBetween("arm"), ConstantSpeed(start, slope)),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(0.5, 1.0))],
        coordinates=("crank.phi", "arm.phi"),
    )
    return mechanism, lambda q, u: [q[0] - u, q[1] - (start + slope * (x + oracle.cos(q[0])))]


def far_rack(x: float, y: float) -> tuple[Mechanism, Residual]:
    """A rack on a slope, driven by its coordinate in the world; the angle of its small pinion follows."""
    axis, radius = 0.7, 0.05
    mechanism = Mechanism(
        "rack",
        [
            Body("ground", {"O": (x, y)}),
            Body("pinion", {"O": (0, 0)}, (x, y, 0)),
            Body("rack", {"p": (0, 0), "q": (1, 0)}, (x, y, axis)),
        ],
        [
            Revolute("O", ("ground.O", "pinion.O")),
            Translational("rail", ("ground.O", "rack.p"), axis, axis),
            RackAndPinion("mesh", ("ground.O", "rack.p"), "pinion", radius, axis),
        ],
        [CoordinateDriver("push", "rack.p", "x", ConstantSpeed(x, 0.5))],
        coordinates=("pinion.phi", "rack.x", "rack.y"),
    )

    def residual(q: Sequence[Any], u: Any) -> list[Any]:
        c, s, dx, dy = mp.cos(axis), mp.sin(axis), q[1] - x, q[2] - y
        return [q[1] - u, dy * c - dx * s, dx * c + dy * s - radius * q[0]]

    return mechanism, residual


TIED = (far_slider_crank, far_bar, far_tip, far_coupling, far_rack)


@pytest.mark.parametrize("made", TIED)
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(2)
def test_estimates_count_the_offset_of_what_is_tied_to_the_world(
    made: Callable[[float, float], tuple[Mechanism, Residual]], engine: Literal["python", "native"]
) -> None:
    for sizes in (30.0, 1000.7, 1e6 + 0.7, *([] if made in (far_slider_crank, far_bar) else [1e8 + 0.7])):
        mechanism, residual = made(sizes, -sizes)
        run = kinfmu.solve(mechanism, np.linspace(0.0, 1.2, 13), engine=engine)
        assert run.good.all()
        u, ud, udd = run.inputs.T.tolist()
        exact = oracle.solve(residual, run.q, u, ud, udd)
        for ours, wanted, estimate in zip((run.q, run.qd, run.qdd), exact, run.error.T, strict=True):
            off = [largest_error(row, true) for row, true in zip(ours, wanted, strict=True)]
            assert (np.array(off) <= estimate).all()
        assert np.median(run.error[:, 0]) < 500.0 * sizes * 2.0**-52


@pytest.mark.parametrize("at", [(1e8 + 0.7, -1e8 - 0.7), (78596057.401366, -8518.29741191125)])
def test_a_rod_that_rounding_keeps_from_closing_far_from_the_origin_is_refused(at: tuple[float, float]) -> None:
    """The square of a length between ends that are known to 1e-8 has no zero."""
    mechanism, _ = far_bar(*at)
    message = (
        r"gap \S+e-09 m at 'rod' .*; this is rounding, \S+e\+07 sizes from the world's origin, to which it is tied"
    )
    with pytest.raises(AssemblyError, match=message):
        kinfmu.solve(mechanism, [0.0])


@pytest.mark.parametrize("engine", ["python", "native"])
def test_a_path_whose_steps_are_lost_in_the_rounding_of_its_driver_ends(
    monkeypatch: pytest.MonkeyPatch, engine: Literal["python", "native"]
) -> None:
    """Up to 1e-6 steps do not move a driver at -5e9."""
    steps = 0

    def counted(*arguments: Any) -> Any:
        nonlocal steps
        steps += 1
        return trusted_step(*arguments)

    monkeypatch.setattr("kinfmu.solver.python.advance.trusted_step", counted)
    mechanism, _ = far_bar(-4820000000.0, -188.244405023817)
    run = kinfmu.solve(mechanism, [0.0, 0.1, 0.2], engine=engine)
    assert run.status.tolist() == [0, 3, 3]
    assert steps < 200
    reason = "; 1.9e+09 sizes from the world's origin the rows are rounded to 4.2e-07 sizes"
    assert all(event.text.endswith(reason) for event in run.events if "cannot be reached" in event.text)
    assert any("cannot be reached" in event.text for event in run.events)
