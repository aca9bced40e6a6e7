"""Assembly: the start pose is closed block by block, on its own branch, whatever lies near."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, RelativeAngleDriver, Revolute
from kinfmu.errors import AmbiguousStartError
from kinfmu.mechanism import gallery
from kinfmu.plan import compile_plan
from kinfmu.plan.equations import closing
from kinfmu.plan.equations.assembly import find_assembly, in_order, start_values
from kinfmu.plan.equations.system import System
from tests.mechanisms import PINS
from tests.mechanisms import fourbar as fourbar_of_bars
from tests.stress.families import STARTS_ANYWHERE
from tests.stress.trial import trial


def near_its_limit() -> Mechanism:
    """A Stephenson III driven at its output, started so near its limit that 0.1 rad further there is another branch."""
    return Mechanism(
        "near_its_limit",
        [
            Body("ground", {"O": (0, 0), "C": (1.434, 0), "D": (0.512, -1.677)}),
            Body("crank", {"O": (0, 0), "P": (0.848, 0)}, (0, 0, 4.71)),
            Body("coupler", {"P": (0, 0), "Q": (1.455, 0), "R": (-0.718, -0.089)}, (0, -0.85, 0.09)),
            Body("rocker", {"C": (0, 0), "Q": (0.72, 0)}, (1.43, 0, -1.55)),
            Body("link", {"R": (0, 0), "S": (1.566, 0)}, (-0.71, -1.0, -1.94)),
            Body("output", {"D": (0, 0), "S": (1.951, 0)}, (0.51, -1.68, -2.73)),
        ],
        [
            *PINS,
            Revolute("R", ("coupler.R", "link.R")),
            Revolute("S", ("link.S", "output.S")),
            Revolute("D", ("ground.D", "output.D")),
        ],
        [AngleDriver("drive", "output", ConstantSpeed(-2.7290198238695482, 1.0))],
    )


def test_an_anchor_near_the_start_lies_on_the_branch_of_the_start() -> None:
    start = -2.7290198238695482
    mechanism = near_its_limit()
    run = kinfmu.solve(mechanism, drive_angle=[start, start - 0.05, start])
    assert run.good[0]
    np.testing.assert_allclose(run["crank.phi"][[0, 2]], np.radians(270.0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", gallery.names())
def test_the_start_of_the_gallery_is_where_the_files_say(name: str) -> None:
    system = System(kinfmu.load(name))
    assembled = find_assembly(system).pose
    assert assembled is not None
    np.testing.assert_array_equal(assembled.u, start_values(system).u)


def test_every_row_of_the_order_is_there_once() -> None:
    system = System(kinfmu.load("fourbar_chain:5"))
    order = in_order(system)
    assert sorted(row for rows, _ in order.blocks for row in rows) == list(range(len(system.rows)))
    assert sorted(column for _, columns in order.blocks for column in columns) == list(range(len(system.coordinates)))
    assert max(len(rows) for rows, _ in order.blocks) == 2


@pytest.mark.parametrize(
    "name", ["crank_rocker", "slider_crank", "watt_six_bar", "peaucellier", "inverted_slider_crank"]
)
def test_without_any_start_pose_a_mechanism_assembles_in_some_regular_way(name: str) -> None:
    mechanism = kinfmu.load(name)
    bodies = tuple(Body(body.name, body.points) for body in mechanism.bodies)
    assembled = find_assembly(System(replace(mechanism, bodies=bodies))).pose
    assert assembled is not None
    assert assembled.margin > 0.03


def test_a_start_angle_alone_chooses_the_assembly() -> None:
    mechanism = kinfmu.load("crank_rocker")
    for phi, side in ((1.0, 1), (-1.0, -1)):
        bodies = tuple(
            Body(body.name, body.points, (None, None, phi) if body.name == "coupler" else (None, None, None))
            for body in mechanism.bodies
        )
        report = kinfmu.check(replace(mechanism, bodies=bodies))
        assert report.problem is None, report.problem
        run = kinfmu.solve(replace(mechanism, bodies=bodies), crank_angle=[0.0, 1.0])
        assert np.sign(np.sin(run["coupler.phi"][1] - run["rocker.phi"][1])) == -side


def _started(name: str, phi: float) -> Mechanism:
    """A mechanism of the gallery whose driven body has another rough start angle."""
    mechanism = kinfmu.load(name)
    driven = mechanism.drivers[0].of  # type: ignore[attr-defined]  # an AngleDriver
    bodies = (replace(body, start=body.start._replace(phi=phi)) for body in mechanism.bodies if body.name == driven)
    (moved,) = bodies
    return replace(mechanism, bodies=tuple(moved if body.name == driven else body for body in mechanism.bodies))


@pytest.mark.parametrize("name", ["triple_rocker", "stephenson_six_bar", "inverted_slider_crank", "peaucellier"])
@pytest.mark.parametrize("turns", [1, -1, 30])
def test_whole_turns_of_a_start_pose_change_nothing(name: str, turns: int) -> None:
    """The driver's value decides how many turns a driven body has made."""
    mechanism = kinfmu.load(name)
    law = mechanism.drivers[0].law
    start, wanted = float(law.at(mechanism.run.start)), find_assembly(System(mechanism)).pose
    moved = find_assembly(System(_started(name, start + turns * math.tau))).pose
    assert wanted is not None
    assert moved is not None
    np.testing.assert_allclose(moved.u, wanted.u, rtol=0, atol=1e-13)
    np.testing.assert_allclose(moved.q, wanted.q, rtol=0, atol=1e-11 * np.abs(wanted.q).max())


@pytest.mark.parametrize("degrees", [425.0, -295.0, 60.0, 80.0, -65.0, 87.0, 200.0, 273.0, 447.0])
@pytest.mark.few(6)
def test_the_start_of_the_law_decides_whatever_the_rough_angle_of_the_driven_body(degrees: float) -> None:
    mechanism = kinfmu.load("triple_rocker")
    times = np.linspace(0.0, 2.0, 9)
    wanted, run = (kinfmu.solve(one, times) for one in (mechanism, _started("triple_rocker", math.radians(degrees))))
    assert run.good.all()
    np.testing.assert_allclose(run.values, wanted.values, rtol=0, atol=1e-11)


def test_a_start_pose_past_a_limit_gives_one_note() -> None:
    report = kinfmu.check(_started("triple_rocker", math.radians(87.0)))
    assert report.problem is None
    assert report.notes == (
        "the start poses give left = 1.51843645 rad (87 deg); the law starts at left = 1.13446401 rad (65 deg), which "
        "cannot be reached from there: the mechanism is assembled at the start of the law",
    )
    assert kinfmu.check(_started("triple_rocker", math.radians(60.0))).notes == ()


def test_start_poses_on_another_branch_than_the_law_can_reach_give_way() -> None:
    """Two ranges of one four-bar, mirrored: the start pose is in one, the law starts in the other."""
    bodies = [
        Body("ground", {"O": (0, 0), "C": (4, 0)}),
        Body("crank", {"O": (0, 0), "P": (3, 0)}, (0, 0, -0.9)),
        Body("coupler", {"P": (0, 0), "Q": (3, 0)}),
        Body("rocker", {"C": (0, 0), "Q": (1.2, 0)}),
    ]
    joints = [*PINS]
    low = math.acos((9 + 16 - 1.8**2) / 24)  # coupler folded over the rocker
    for start in (0.6, -0.6):
        assert low < abs(start)
        mechanism = Mechanism("ranges", bodies, joints, [AngleDriver("crank", "crank", ConstantSpeed(start, 0.0))])
        assert kinfmu.solve(mechanism, crank_angle=[start]).good.all()
        assert len(kinfmu.check(mechanism).notes) == (start > 0)


@pytest.mark.parametrize(("gap", "noise"), [(1e-3, 0.0), (1e-3, 0.03), (1e-6, 0.0), (1e-8, 0.03)])
@pytest.mark.few(2)
def test_close_to_a_dead_centre_the_start_is_assembled(gap: float, noise: float) -> None:
    """The last part before the limit of a triple rocker, where the whole Gauss-Newton step goes too far."""
    mechanism = kinfmu.load("triple_rocker")
    start = math.acos((65**2 + 100**2 - 115**2) / (2 * 65 * 100)) - gap
    for side in (1, -1):
        pin = 65 * math.cos(start), 65 * math.sin(start)
        away = math.hypot(100 - pin[0], pin[1])
        to_pivot = math.atan2(-pin[1], 100 - pin[0])
        coupler = to_pivot + side * math.acos((50**2 + away**2 - 65**2) / (2 * 50 * away))
        end = pin[0] + 50 * math.cos(coupler), pin[1] + 50 * math.sin(coupler)
        rough = {
            "left": (0.0, 0.0, start + noise),
            "coupler": (pin[0] - 65 * noise, pin[1] + 65 * noise, coupler - noise),
            "right": (100.0, 0.0, math.atan2(end[1], end[0] - 100) + noise),
        }
        bodies = [Body(body.name, body.points, rough.get(body.name, (None,) * 3)) for body in mechanism.bodies]
        (driver,) = mechanism.drivers
        at_start = replace(driver, law=ConstantSpeed(start, 0.0))  # type: ignore[type-var]
        assembled = find_assembly(System(replace(mechanism, bodies=bodies, drivers=(at_start,)))).pose
        assert assembled is not None
        assert assembled.margin > 1e-6
        found = dict(zip(mechanism.coordinate_names, assembled.q.tolist(), strict=True))
        if noise == 0.0 and gap > 1e-7:  # exact start poses tell the assemblies apart
            assert np.sign(math.sin(found["coupler.phi"] - found["right.phi"])) == np.sign(
                math.sin(coupler - rough["right"][2])
            )


@pytest.mark.parametrize("seed", [18, 19, 54, 1097])
def test_rough_starts_near_change_points_are_assembled(seed: int) -> None:
    """Crank = rod, a pin in a slot whose lever turns within 0.01 rad, a redundant bar: each was refused."""
    one = trial(seed, STARTS_ANYWHERE)
    assembled = find_assembly(System(one.drawn.mechanism)).pose
    assert assembled is not None
    assert assembled.margin > 1e-6


@pytest.mark.parametrize("seed", [577, 1690, 1926])
def test_a_start_between_limits_close_to_each_other_is_reached(seed: int) -> None:
    """Bars too long by 1e-11: within 1e-5 rad no pose closes, and the law starts a little beyond."""
    assert trial(seed, STARTS_ANYWHERE).judged().faults == []


@pytest.mark.parametrize("miss", [1e-13, 1e-10, 1e-8, 1e-6, 1e-5, 1e-3])
@pytest.mark.parametrize(("bars", "angle"), [((2, 1, 2, 1), 0.0), ((4, 1, 3, 2), math.pi), ((3, 3, 2, 2), 0.0)])
@pytest.mark.few(4)
def test_a_start_that_misses_a_change_point_is_assembled_or_reported_as_ambiguous(
    bars: tuple[int, ...], angle: float, miss: float
) -> None:
    for side in (1.0, -1.0):
        mechanism = fourbar_of_bars(*map(float, bars), start=angle + side * miss)
        try:
            (u,) = compile_plan(mechanism).anchor.u
        except AmbiguousStartError as error:
            u, message = angle + side * miss, str(error)
        else:
            message = "and 2 branches leave it: at crank = "
        assert "and 2 branches leave it: at crank = " in message
        assert abs(u - angle - side * miss) <= 0.1001
    if miss == 1e-3:
        compile_plan(mechanism)


def chain_of_four_bars(count: int) -> Mechanism:
    """Four-bars in a row, each driven by a corner of the rocker before, and that of the last rocker is held too."""
    ground, bodies, joints = {"O": (0.0, 0.0)}, [Body("crank", {"O": (0, 0), "end": (0, 40)}, (0, 0, 0))], []
    joints.append(Revolute("O", ("ground.O", "crank.O")))
    tip, end = "crank.end", (0.0, 40.0)
    for k in range(1, count + 1):
        top, foot, corner = (100.0 * k + 20.0, 80.0 - 3.0 * (k % 3)), (100.0 * k, 0.0), (100.0 * k + 8.0, 36.0)
        ground[f"C{k}"] = foot
        bodies.append(Body(f"coupler{k}", {"P": end, "Q": top}, (0, 0, 0)))
        bodies.append(Body(f"rocker{k}", {"Q": top, "C": foot, "end": corner}, (0, 0, 0)))
        joints += [
            Revolute(f"P{k}", (tip, f"coupler{k}.P")),
            Revolute(f"Q{k}", (f"coupler{k}.Q", f"rocker{k}.Q")),
            Revolute(f"C{k}", (f"ground.C{k}", f"rocker{k}.C")),
        ]
        tip, end = f"rocker{k}.end", corner
    ground["end"] = end
    joints.append(Revolute("held", ("ground.end", tip)))
    return Mechanism(
        "chain", [Body("ground", ground), *bodies], joints, [AngleDriver("drive", "crank", ConstantSpeed(0.0, 1.0))]
    )


def straight_chain(count: int) -> Mechanism:
    """Bars in a straight line between two pins of the ground, with drivers of all angles that are free but there."""
    bodies = [Body(f"bar{k}", {"A": (10 * k, 0), "B": (10 * k + 10, 0)}, (0, 0, 0)) for k in range(count)]
    joints = [Revolute(f"P{k}", (f"bar{k - 1}.B", f"bar{k}.A")) for k in range(1, count)]
    joints += [Revolute("O", ("ground.O", "bar0.A")), Revolute("E", ("ground.E", f"bar{count - 1}.B"))]
    drivers = [
        RelativeAngleDriver(f"drive{k}", (f"bar{k - 1}", f"bar{k}"), ConstantSpeed(0.0, 0.1))
        for k in range(1, count - 1)
    ]
    return Mechanism("straight", [Body("ground", {"O": (0, 0), "E": (10 * count, 0)}), *bodies], joints, drivers)


@pytest.mark.parametrize(
    ("mechanism", "most"), [(chain_of_four_bars(6), 2), (chain_of_four_bars(19), 16), (straight_chain(39), 30)]
)
def test_long_chains_that_are_singular_or_cannot_move_are_judged_in_few_steps(
    mechanism: Mechanism, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With 19 four-bars the crank hardly feels that the last rocker is held: a step is as short as the margin."""
    closes = []
    monkeypatch.setattr(closing, "close", lambda *given, close=closing.close: closes.append(1) or close(*given))
    assert find_assembly(System(mechanism)).pose is not None
    assert len(closes) <= most


def test_a_path_to_where_it_begins_has_no_steps() -> None:
    system = System(kinfmu.load("fourbar"))
    pose = find_assembly(system).pose
    assert pose is not None
    q, u = closing.followed(system, pose.q, pose.u, pose.u, trust=10.0)
    np.testing.assert_array_equal(q, pose.q)
    np.testing.assert_array_equal(u, pose.u)
