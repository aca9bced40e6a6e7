"""Assemblies: they are found, distinguished and chosen by start poses; start poses may be left out."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute, Start
from kinfmu.analysis.assemblies import Assemblies, find_assemblies
from kinfmu.errors import AssemblyError, MobilityError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.joints import Coordinate, Distance, Translational
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.plan.equations.start_poses import open_joints, start_from_poses
from kinfmu.plan.equations.system import System
from tests.analysis.linkages import digger, five_bar_arm, pushed_crank
from tests.gallery_members import mostly_long
from tests.mechanisms import bar_linkage, five_bar, fourbar, reference_fourbar, six_bar, slider_crank


def found_for(mechanism: Mechanism) -> Assemblies:
    return find_assemblies(mechanism, compile_plan(mechanism))


def started(mechanism: Mechanism, starts: dict[str, Start]) -> Mechanism:
    """The mechanism with other start poses of some bodies."""
    bodies = [replace(body, start=starts.get(body.name, body.start)) for body in mechanism.bodies]
    return replace(mechanism, bodies=tuple(bodies))


def chain(loops: int) -> Mechanism:
    """Crank-rockers one after the other, each rocker the next one's crank."""
    bodies, joints = [Body("link0", {"O": (0, 0), "P": (1, 0)}, (0, 0, 1.0))], [Revolute("O", ("ground.O", "link0.O"))]
    pivots: dict[str, tuple[float, float]] = {"O": (0, 0)}
    for k in range(loops):
        pivots[f"C{k}"] = (4.0 * (k + 1), 0)
        bodies.append(Body(f"bar{k}", {"P": (0, 0), "Q": (3.5, 0)}, (4 * k + 0.5, 0.8, 0.6)))
        bodies.append(Body(f"link{k + 1}", {"C": (0, 0), "Q": (3, 0), "P": (0.8, 0.2)}, (4 * k + 4, 0, 1.8)))
        joints.append(Revolute(f"P{k}", (f"link{k}.P", f"bar{k}.P")))
        joints.append(Revolute(f"Q{k}", (f"bar{k}.Q", f"link{k + 1}.Q")))
        joints.append(Revolute(f"C{k}", (f"ground.C{k}", f"link{k + 1}.C")))
    return Mechanism(
        "chain", [Body("ground", pivots), *bodies], joints, [AngleDriver("crank", "link0", ConstantSpeed(1.0, 1.0))]
    )


def test_a_four_bar_goes_together_in_two_ways() -> None:
    lengths = 4.0, 1.0, 3.5, 3.0
    assemblies = found_for(fourbar(*lengths))
    expected = []
    for branch in (1, -1):
        mirrored = fourbar(*lengths, branch=branch)
        expected.append({body.name: body.start.phi for body in mirrored.moving_bodies})
    assert [one.is_chosen for one in assemblies.found] == [True, False]
    for one, phis in zip(assemblies.found, expected, strict=True):
        for name, phi in phis.items():
            assert phi is not None
            assert math.remainder(one.coordinates[f"{name}.phi"] - phi, math.tau) == pytest.approx(0.0, abs=1e-11)
    assert assemblies.distinguished_by == ("coupler.phi",)
    assert assemblies.drivers == {"crank": pytest.approx(1.0)}
    assert assemblies.complete
    assert assemblies.ended == "with the proof that there are no others"


def same_but_for_turns(a: np.ndarray, b: np.ndarray) -> bool:
    apart = b - a
    apart[2::3] = np.remainder(apart[2::3] + math.pi, math.tau) - math.pi
    return bool(np.abs(apart).max() < 1e-8)


def closed_ways_of_the_six_bar(output: float) -> int:
    """How often link RS of the six-bar closes while its crank turns once, by circles alone."""
    sx, sy = 5.5 + 2.5 * math.cos(output), 1 + 2.5 * math.sin(output)
    count = 0
    for branch in (1, -1):
        crank = np.linspace(0.0, math.tau, 20001)
        px, py = 1.5 * np.cos(crank), 1.5 * np.sin(crank)
        diagonal = np.hypot(4 - px, py)
        lean = np.arctan2(-py, 4 - px) + branch * np.arccos((3.5**2 - 3**2 + diagonal**2) / (7 * diagonal))
        rx, ry = px + 3 * np.cos(lean) - 2 * np.sin(lean), py + 3 * np.sin(lean) + 2 * np.cos(lean)
        open_by = np.hypot(sx - rx, sy - ry) - 3.5
        count += int((open_by[1:] * open_by[:-1] < 0).sum())
    return count


def test_a_six_bar_goes_together_as_often_as_circles_say() -> None:
    assemblies = found_for(six_bar())
    assert len(assemblies.found) == closed_ways_of_the_six_bar(assemblies.drivers["drive"]) == 2


@pytest.mark.parametrize(
    ("mechanism", "count"),
    [
        (reference_fourbar(), 1),  # the third bar does not allow the antiparallelogram
        (kinfmu.load("double_pendulum"), 2),
        (bar_linkage(), 2),
        (five_bar(), 2),
        (slider_crank(), 2),
        (pushed_crank(), 2),
        (digger(), 4),
        (kinfmu.load("parallel_jaw"), 8),  # a redundant gear, in some of them a turn away
        (chain(3), 8),
        (fourbar(4, 1, 3.5, 3, at=(300.0, -200.0)), 2),
    ],
)
@pytest.mark.few(4)
def test_every_assembly_is_found_and_its_start_poses_lead_to_it(mechanism: Mechanism, count: int) -> None:
    assemblies = found_for(mechanism)
    assert len(assemblies.found) == count
    assert assemblies.complete
    assert [one.is_chosen for one in assemblies.found] == [True] + [False] * (count - 1)
    for one in assemblies.found[1:]:
        plan = compile_plan(started(mechanism, dict(one.start)))
        if plan.anchor.u.tolist() == pytest.approx(list(assemblies.drivers.values())):
            world = plan.anchor.q + np.tile([plan.origin.x, plan.origin.y, 0.0], len(plan.anchor.q) // 3)
            assert same_but_for_turns(world, np.array(list(one.coordinates.values())))


def test_one_start_angle_chooses_a_four_bar() -> None:
    text = str(found_for(fourbar(4, 1, 3.5, 3)))
    assert "  assemblies  2 found at crank = 1 rad (57.2957795 deg), distinguished by coupler.phi" in text
    assert "  * 1         coupler.phi 36.609 deg, that of the file" in text
    assert '              choose it by [bodies.rocker] start.phi = "-129.9 deg"' in text


def test_complete_start_poses_are_replaced_by_complete_ones_that_close_the_joints() -> None:
    places = {"O": (0, 0), "A": (0, 30), "B": (85, 70), "C": (100, 0)}  # of a sketch, in the world
    links = {"crank": "OA", "coupler": "AB", "rocker": "BC"}
    bodies = [Body(name, {end: places[end] for end in ends}, (0, 0, 0)) for name, ends in links.items()]
    joints = [
        Revolute("O", ("ground.O", "crank.O")),
        Revolute("A", ("crank.A", "coupler.A")),
        Revolute("B", ("coupler.B", "rocker.B")),
        Revolute("C", ("ground.C", "rocker.C")),
    ]
    ground = Body("ground", {end: places[end] for end in "OC"})
    drawn = Mechanism("drawn", [ground, *bodies], joints, [AngleDriver("motor", "crank", ConstantSpeed(0.0, 1.0))])
    assemblies = found_for(drawn)
    assert len(assemblies.found) == 2
    assert "[bodies.rocker] start = { x = " in str(assemblies)
    other = System(localized(started(drawn, dict(assemblies.found[1].start)))[0])
    assert open_joints(other, start_from_poses(other).q) == []


def test_assemblies_are_plain_data_too() -> None:
    found = json.loads(json.dumps(found_for(fourbar(4, 1, 3.5, 3)).as_json()))
    assert found["complete"] is True
    assert found["ended"] == "with the proof that there are no others"
    assert found["distinguished_by"] == ["coupler.phi"]
    assert [one["chosen"] for one in found["found"]] == [True, False]
    assert found["found"][0]["start"] == {}
    assert found["found"][1]["start"]["rocker"]["phi"] == pytest.approx(math.radians(-129.9))


@pytest.mark.long
def test_a_search_that_finds_very_many_reports_it() -> None:
    every = found_for(chain(7))
    assert every.complete
    assert len(every.found) == 128
    assemblies = found_for(chain(9))
    assert len(assemblies.found) == 256
    assert "assemblies  256 found at crank" in str(assemblies)
    assert "there may be more: the search ended at 256 assemblies" in str(assemblies)


Pair = tuple[float, float]
Pose = tuple[float, float, float]

PUBLISHED = ((0.0, 0.0), (15.91, 0.0), (0.0, 10.0)), (17.04, 16.54, 20.84), (14.98, 15.38, 12.0)  # six assemblies


def table_on_bars(base: Sequence[Pair], table: Sequence[Pair], pose: Pose, motor: Pair) -> Mechanism:
    """A table on three bars, one block of three unknowns, which closes in `pose`; a wheel drives nothing else."""
    x, y, phi = pose
    places = [(x + math.cos(phi) * a - math.sin(phi) * b, y + math.sin(phi) * a + math.cos(phi) * b) for a, b in table]
    ground = Body("ground", {**{f"B{k}": point for k, point in enumerate(base)}, "M": motor})
    bodies = [Body("table", {f"P{k}": p for k, p in enumerate(table)}, pose), Body("wheel", {"M": (0, 0)}, (*motor, 0))]
    bars = [
        Distance(f"bar{k}", (f"ground.B{k}", f"table.P{k}"), math.dist(base[k], places[k])) for k in range(len(base))
    ]
    joints = [*bars, Revolute("M", ("ground.M", "wheel.M"))]
    return Mechanism("table", [ground, *bodies], joints, [AngleDriver("motor", "wheel", ConstantSpeed(0.0, 1.0))])


def angles_of_the_table(base: Sequence[Pair], table: Sequence[Pair], lengths: Sequence[float]) -> list[float]:
    """All angles at which three bars hold the table: the real roots of a sextic in t = tan(phi/2).

    With U, V a bar's vector at x = y = 0 times D = 1 + t^2, differences of (x + U/D)^2 + (y + V/D)^2 = L^2 are linear
    in x and y; their solution in the first of these leaves t alone.
    """
    t = np.polynomial.Polynomial([0.0, 1.0])
    d, c, s = 1 + t**2, 1 - t**2, 2 * t
    u = [a * c - b * s - x * d for (a, b), (x, _) in zip(table, base, strict=True)]
    v = [a * s + b * c - y * d for (a, b), (_, y) in zip(table, base, strict=True)]
    squares = [u[k] ** 2 + v[k] ** 2 - lengths[k] ** 2 * d**2 for k in range(3)]
    (a1, b1, r1), (a2, b2, r2) = ((2 * (u[k] - u[0]), 2 * (v[k] - v[0]), -(squares[k] - squares[0])) for k in (1, 2))
    det, x, y = a1 * b2 - a2 * b1, r1 * b2 - r2 * b1, a1 * r2 - a2 * r1
    closed = (x + u[0] * det) ** 2 + (y + v[0] * det) ** 2 - lengths[0] ** 2 * det**2 * d**2
    while abs((closed % d).coef).max() < 1e-9 * abs(closed.coef).max():
        closed //= d
    return sorted(2 * math.atan(root.real) for root in closed.roots() if abs(root.imag) < 1e-9 * (1 + abs(root)))


def tables() -> Iterator[tuple[Sequence[Pair], Sequence[Pair], Sequence[float]]]:
    """Base and table of the published truss and of random ones, with the lengths of their bars."""
    base, (l1, l2, l3), lengths = PUBLISHED
    x = (l1 * l1 + l3 * l3 - l2 * l2) / (2 * l1)
    yield base, ((0.0, 0.0), (l1, 0.0), (x, math.sqrt(l3 * l3 - x * x))), lengths
    rng = np.random.default_rng(11)
    for _ in range(9):
        base, table = ([(float(x), float(y)) for x, y in rng.uniform(-1.0, 1.0, (3, 2))] for _ in range(2))
        bars = rng.uniform(-1.0, 1.0, 2) + np.array(table) - np.array(base)  # closed at phi = 0
        yield base, table, [float(length) for length in np.hypot(*bars.T)]


@pytest.mark.parametrize("number", range(10))
@pytest.mark.few(2)
def test_a_table_on_three_bars_goes_together_as_often_as_its_sextic_has_roots(number: int) -> None:
    base, table, lengths = [*tables()][number]
    expected = angles_of_the_table(base, table, lengths)
    assert (number > 0) or len(expected) == 6
    size = max(lengths)
    start = closed_at(base, table, lengths, expected[0])
    for motor in ((0.0, 0.0), (300.0 * size, 0.0)):  # a motor far away moves nothing of it
        assemblies = found_for(table_on_bars(base, table, start, motor))
        assert assemblies.complete
        angles = sorted(one.coordinates["table.phi"] for one in assemblies.found)
        assert angles == pytest.approx(expected, abs=1e-7)


def closed_at(base: Sequence[Pair], table: Sequence[Pair], lengths: Sequence[float], phi: float) -> Pose:
    """The pose of the table at an angle at which it closes, from the circles about the first two ends."""
    c, s = math.cos(phi), math.sin(phi)
    ends = [(x - c * a + s * b, y - s * a - c * b) for (a, b), (x, y) in zip(table, base, strict=True)]
    rows = [[2 * (ends[0][i] - ends[k][i]) for i in (0, 1)] for k in (1, 2)]
    right = [lengths[k] ** 2 - lengths[0] ** 2 - sum(ends[k][i] ** 2 - ends[0][i] ** 2 for i in (0, 1)) for k in (1, 2)]
    x, y = np.linalg.solve(rows, right)
    return float(x), float(y), phi


def test_a_singular_start_pose_is_no_hindrance() -> None:
    flat = fourbar(2, 1, 2, 1, start=0.0)
    report = kinfmu.check(flat)
    assert isinstance(report.problem, kinfmu.KinfmuError)
    assemblies = report.assemblies()
    assert [one.is_chosen for one in assemblies.found] == [False, False]  # parallelogram and antiparallelogram
    for one in assemblies.found:
        chosen = started(flat, dict(one.start))
        assert kinfmu.check(chosen).problem is None


def test_what_a_driver_holds_is_not_advised() -> None:
    thrown = started(six_bar(), {"rocker": Start(3.0, 3.0, 3.0)})
    with pytest.raises(AssemblyError, match="does not close near its start pose"):
        compile_plan(thrown)
    assemblies = kinfmu.check(thrown).assemblies()
    assert len(assemblies.found) == 2
    for one in assemblies.found:
        assert one.start
        assert "output" not in one.start  # the driver turns it
        assert compile_plan(started(thrown, dict(one.start)))


def test_what_a_joint_holds_stays_as_the_file_says() -> None:
    crank = slider_crank()
    piston = Body("piston", {"S": (0, 0)}, (3.7, 0.01, 0.01))
    joints = [joint for joint in crank.joints if joint.name != "guide"]
    joints += [Revolute("S", ("rod.S", "piston.S")), Translational("guide", ("ground.O", "piston.S"))]
    again = Coordinate("again", "rod.S", "y")  # redundant: with it all that is elsewhere is advised, nothing less
    held = Mechanism("held", [*crank.bodies, piston], [*joints, again], crank.drivers)
    assemblies = found_for(held)
    other = assemblies.found[1]
    assert other.start["rod"] == held.bodies[2].start._replace(phi=other.start["rod"].phi)
    assert other.start["piston"] == piston.start._replace(x=other.start["piston"].x)
    assert found_for(started(held, dict(other.start))).found[0].coordinates == pytest.approx(other.coordinates)
    assert str(assemblies).endswith("and by [bodies.piston] start.x = -2.165")


def test_a_mechanism_at_fault_has_no_assemblies() -> None:
    loose = replace(fourbar(4, 1, 3.5, 3), drivers=())
    with pytest.raises(MobilityError, match="mobility is 1 but there is no driver"):
        kinfmu.check(loose).assemblies()


def all_starts_or_one(plan: SolvePlan) -> list[list[str]]:
    """Bodies whose start poses are left out: all together, and, where that takes no seconds, some alone."""
    bodies = [body.name for body in plan.mechanism.moving_bodies]
    is_slow = len(plan.drivers) > 2 or plan.watches
    return [bodies] if is_slow else [*([name] for name in bodies[:: 1 + len(bodies) // 5]), bodies]


@pytest.mark.parametrize(
    "given",
    [
        # Peaucellier's rhombus may fold flat, where it has another mobility. Loads change no pose.
        *mostly_long(
            (name for name in gallery.names() if name != "peaucellier" and not name.endswith("_loaded")),
            few=("cam_roller", "fourbar", "jansen_leg", "triple_rocker"),
        ),
        bar_linkage(),
        five_bar_arm(),
        six_bar(),
        digger(),
        pushed_crank(),
    ],
    ids=lambda given: given if isinstance(given, str) else given.name,
)
@pytest.mark.few(2)
def test_start_poses_left_out_give_an_assembly_that_is_listed(given: Mechanism | str) -> None:
    mechanism = kinfmu.load(given) if isinstance(given, str) else given
    whole = compile_plan(mechanism)
    full = find_assemblies(mechanism, whole)
    known = [np.array(list(one.coordinates.values())) for one in full.found]
    for left_out in all_starts_or_one(whole):
        short = started(mechanism, dict.fromkeys(left_out, Start()))
        try:
            plan = compile_plan(short)
        except AssemblyError:  # rough zeros do not close, but the assemblies are still reported
            assemblies = kinfmu.check(short).assemblies()
            assert len(assemblies.found) == len(full.found)
            for one in assemblies.found:
                assert compile_plan(started(short, dict(one.start)))
            continue
        if plan.anchor.u.tolist() == pytest.approx(list(full.drivers.values())):
            world = plan.anchor.q + np.tile([plan.origin.x, plan.origin.y, 0.0], len(plan.anchor.q) // 3)
            assert any(same_but_for_turns(world, pose) for pose in known)
