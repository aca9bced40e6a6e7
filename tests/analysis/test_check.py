"""The report of `check`, and its drivers: missing and surplus ones."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Distance, Fixed, Mechanism, Revolute
from kinfmu.analysis.singular import row_reduced
from kinfmu.errors import AssemblyError, MobilityError
from kinfmu.mechanism.gallery.chains import fourbar_chain
from tests.mechanisms import bar_as_body, five_bar, fourbar, reference_fourbar, six_bar, slider_crank
from tests.reports import unwrapped


def test_the_fourbar_is_reported_with_its_redundant_row_and_the_reason() -> None:
    text = unwrapped(kinfmu.check(reference_fourbar()))
    assert "3 moving bodies, 5 joints, mobility 1 (Gruebler's count 0: it counts redundant rows)" in text
    assert "note AB is redundant: it follows from O, P, C, Q; set aside, residual monitored" in text
    assert "redundant AB.length: at every pose it follows from O, P, C, Q, to within 1e-11 m" in text
    assert "determinant sin(coupler.phi - rocker.phi)" in text
    assert "note Branches cross at crank = 0 deg, 180 deg; the motion goes on (bridged)" in text
    assert "turns all the way round" in text


def test_findings_are_plain_data_too() -> None:
    findings = json.loads(json.dumps(kinfmu.check(reference_fourbar()).as_json()))
    assert findings["mobility"] == 1
    assert findings["coordinates"] == ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]
    assert findings["redundant"][0]["name"] == "AB"
    assert findings["redundant"][0]["implied_by"] == ["O", "P", "C", "Q"]
    assert findings["blocks"] == [
        {
            "unknowns": ["coupler.phi", "rocker.phi"],
            "rows": ["Q.x", "Q.y"],
            "determinant": "sin(coupler.phi - rocker.phi)",
        }
    ]
    assert findings["problem"] is None


@pytest.mark.parametrize(
    ("mechanism", "expected"),
    [
        (reference_fourbar(), [0.0, math.pi]),
        (fourbar(4, 1, 3, 2), [math.pi]),
        (fourbar(2, 1, 2, 1), [math.pi, math.tau]),  # the laws of these start at 1 rad
        (fourbar(2, 1, 2, 1, branch=-1), [math.pi, math.tau]),
        (fourbar(4, 1, 3.5, 3), []),
    ],
)
def test_change_points_are_found_to_rounding(mechanism: kinfmu.Mechanism, expected: list[float]) -> None:
    report = kinfmu.check(mechanism)
    assert [point.kind for point in report.singular] == ["change point"] * len(expected)
    np.testing.assert_allclose([point.value for point in report.singular], expected, rtol=0, atol=1e-11)


def test_the_range_of_a_triple_rocker_ends_at_its_dead_centres() -> None:
    ground, crank, coupler, rocker = 4.0, 3.0, 1.5, 1.0  # longest + shortest > the others: no link turns round
    report = kinfmu.check(fourbar(ground, crank, coupler, rocker, start=0.2))
    reach = coupler + rocker
    exact = math.acos((ground**2 + crank**2 - reach**2) / (2 * ground * crank))
    assert report.range is not None
    assert report.range.high == pytest.approx(exact, abs=1e-10)
    assert report.range.low == pytest.approx(-exact, abs=1e-10)
    assert {point.kind for point in report.singular} == {"limit"}


def test_a_driver_off_the_loop_of_a_triad_has_its_range() -> None:
    report = kinfmu.check(six_bar())
    assert report.range is not None
    assert report.range.low is not None
    run = kinfmu.solve(six_bar(), drive_angle=[report.range.low + 1e-6, report.range.low - 1e-6])
    assert run.status.tolist()[1] == 3
    assert run.status.tolist()[0] < 3


def test_several_drivers_have_a_range_each() -> None:
    report = kinfmu.check(five_bar())
    assert report.range is None
    assert [reach.driver for reach in report.ranges] == ["shoulder", "elbow"]
    assert report.mobility == 2


def test_findings_have_ranges_loops_and_transmission_as_numbers() -> None:
    findings = json.loads(json.dumps(kinfmu.check(fourbar(4, 3, 1.5, 1, start=0.2)).as_json()))
    limit = math.acos((16 + 9 - 2.5**2) / 24)
    (reach,) = findings["ranges"]
    assert (reach["driver"], reach["kind"], reach["turns"]) == ("crank", "angle", None)
    assert [reach["low"], reach["high"]] == pytest.approx([-limit, limit], abs=1e-10)
    assert [place["bodies"] for place in reach["limits"]] == [["coupler", "rocker"]] * 2
    assert reach["limits"][1]["coordinates"]["crank.phi"] == pytest.approx(limit, abs=1e-9)
    assert [(point["driver"], point["kind"], point["block"]) for point in findings["singular"]] == [
        ("crank", "limit", 1)
    ] * 2
    (loop,) = findings["loops"]
    assert loop["lengths"] == {"ground": 4.0, "crank": 3.0, "coupler": 1.5, "rocker": 1.0}
    assert (loop["kind"], loop["class"], loop["sums"]) == ("four-bar", "triple rocker", [5.0, 4.5])
    assert loop["transmission"][0]["largest"] == math.pi
    assert findings["assembled"] == {"crank": pytest.approx(0.2)}
    assert findings["length_unit"] == "m"


def test_findings_have_the_keys_that_their_docstring_names() -> None:
    described = kinfmu.Report.as_json.__doc__ or ""
    for mechanism in (reference_fourbar(), five_bar(), slider_crank(), reference_fourbar(bar=1.01)):
        for key in kinfmu.check(mechanism).as_json():
            assert re.search(rf"\b{key}\b", described)


def test_ranges_need_no_more_outputs_than_the_file_asks_for() -> None:
    report = kinfmu.check(replace(five_bar(), coordinates=("forearm.phi",), points={}))
    assert report.plan is not None
    assert report.plan.coordinates == ("forearm.phi",)
    assert [reach.turns for reach in report.ranges] == [1, 1]
    assert len(report.assemblies().found) == 2


def test_a_large_mechanism_has_a_short_report() -> None:
    report = kinfmu.check(fourbar_chain(30))
    assert report.range is not None
    assert report.range.turns == 1
    assert len(report.loops) == 30
    assert {named.grashof.shape for named in report.loops} == {"parallelogram"}
    text = str(report)
    assert text.count("and 22 more") == 2  # loops, and their transmission angles
    assert "61 moving bodies, " in text
    assert len(text) < 5_000
    assert "bodies bar_0, bar_1, coupler_1" in (detail := unwrapped(report))
    assert "and 37 more" in detail


def test_a_contradiction_is_in_the_report_and_does_not_raise() -> None:
    report = kinfmu.check(reference_fourbar(bar=1.01))
    assert report.plan is None
    assert report.inconsistent[0].row.owner == "AB"
    assert "contradicts AB.length does not close with O, P, C, Q: gap 0.01 m at every pose" in unwrapped(report)
    assert "0.01 m" in str(report.problem)
    assert report.as_json()["inconsistent"][0]["gap"] == pytest.approx(-0.01)


def test_matrices_are_the_reports() -> None:
    matrices = {matrix.title: matrix for matrix in kinfmu.check(reference_fourbar()).matrices()}
    plain = matrices["Phi_K,q at crank = pi/3 (60 deg)"]
    s, c = math.sin(math.pi / 3), 0.5
    expected = [
        [s, 1, 0, 0, 0],
        [-c, 0, 1, -1, 0],
        [0, 1, 0, 0, s],
        [0, 0, 1, 0, -c],
        [0, 1, 2 * s, 2 * s, 0],
    ]
    np.testing.assert_allclose(plain.entries, expected, atol=1e-12)
    assert plain.rows == ("P.x", "P.y", "Q.x", "Q.y", "AB.length")
    assert plain.rank == 4
    assert matrices["Phi_q at crank = pi (180 deg), singular point"].rank == 4
    near = matrices["Phi_q at crank = 3.15904595 rad (181 deg), after a small turn"]
    assert near.rank == 5
    np.testing.assert_array_equal(near.reduced, np.eye(5))


def test_rank_is_lost_at_a_dead_centre_and_restored_next_to_it() -> None:
    ranks = [matrix.rank for matrix in kinfmu.check(kinfmu.load("double_pendulum")).matrices()]
    assert ranks == [5, 6, 5, 6, 5, 6]


def test_row_reduction_equals_exact_arithmetic() -> None:
    matrix = np.array([[2.0, 1.0, -1.0, 8.0], [-3.0, -1.0, 2.0, -11.0], [-2.0, 1.0, 2.0, -3.0]])
    np.testing.assert_allclose(row_reduced(matrix), [[1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 1, -1]], atol=1e-14)
    np.testing.assert_array_equal(row_reduced(np.zeros((2, 3))), np.zeros((2, 3)))
    assert row_reduced(np.array([[1.0, 2.0], [2.0, 4.0]])).tolist() == [[1.0, 2.0], [0.0, 0.0]]


@pytest.mark.parametrize("turn", [0.0, math.pi / 2])
def test_a_bar_as_a_body_is_singular_where_the_linkage_is_and_nowhere_else(turn: float) -> None:
    values = [point.value for point in kinfmu.check(bar_as_body(turn)).singular]
    np.testing.assert_allclose(values, [turn, math.pi + turn], atol=1e-11)


# -------------------------------------------------------------------------------------------------------------- drivers


def with_arm(*drivers: kinfmu.AngleDriver) -> Mechanism:
    """A crank-rocker with an arm of its own on the rocker's pivot, two degrees of freedom."""
    linkage = fourbar(4, 1, 3.5, 3)
    arm = Body("arm", {"C": (0, 0), "end": (1, 0)}, (4, 0, 0.3))
    return replace(
        linkage,
        bodies=(*linkage.bodies, arm),
        joints=(*linkage.joints, Revolute("arm", ("ground.C", "arm.C"))),
        drivers=(*linkage.drivers, *drivers),
    )


def test_a_missing_driver_is_reported_with_what_is_loose() -> None:
    report = kinfmu.check(with_arm())
    assert report.mismatch is not None
    assert (report.mismatch.missing, report.mismatch.loose, report.mismatch.surplus) == (1, ("arm.phi",), ())
    assert "loose arm.phi: 1 more driver needed" in unwrapped(report)


def test_a_driver_too_many_is_named_with_the_one_it_fights() -> None:
    linkage = fourbar(4, 1, 3.5, 3)
    two = AngleDriver("two", "rocker", ConstantSpeed(1.9, 1.0))
    report = kinfmu.check(replace(linkage, drivers=(*linkage.drivers, two)))
    assert report.mismatch is not None
    assert report.mismatch.surplus == (("two", ("crank",)),)
    assert "note driver two is surplus: crank and the joints determine what it drives" in unwrapped(report)
    assert report.as_json()["mismatch"]["surplus"] == [{"name": "two", "implied_by": ["crank"]}]


def test_two_drivers_on_one_freedom_while_another_is_free_are_reported() -> None:
    report = kinfmu.check(with_arm(AngleDriver("two", "rocker", ConstantSpeed(1.9, 1.0))))
    assert isinstance(report.problem, MobilityError)
    assert str(report.problem) == "[drivers.two] drives what crank and the joints determine, while arm can still move"


def test_a_driver_of_a_coordinate_that_a_joint_holds_is_reported() -> None:
    bodies = [Body("ground", {"G": (0, 0)}), Body("block", {"P": (0, 0)})]
    stuck = Mechanism("stuck", bodies, [Fixed("weld", ("ground.G", "block.P"))], [AngleDriver("turn", "block")])
    assert "driver turn is surplus: the joints alone determine what it drives" in unwrapped(kinfmu.check(stuck))


def test_a_bar_that_closes_only_where_the_links_are_in_line_is_reported() -> None:
    """The singular pose leaves a direction free in which no motion follows."""
    linkage = kinfmu.load("fourbar")
    brace = Distance("brace", ("coupler.A", "rocker.C"), 2.0)
    report = kinfmu.check(replace(linkage, joints=(*linkage.joints, brace)))
    assert report.problem is not None
    assert report.advice[0].text.startswith("remove joint brace: ")


def test_drivers_that_match_need_no_advice() -> None:
    report = kinfmu.check(five_bar())
    assert (report.mismatch, report.advice) == (None, ())
    assert (report.as_json()["mismatch"], report.as_json()["advice"]) == (None, [])


@pytest.mark.parametrize("lengths", [(8, 1, 3.5, 3), (6, 2, 5, 2)])
def test_too_many_joints_that_do_not_close_are_no_advice_to_remove_drivers(lengths: tuple[float, ...]) -> None:
    linkage = fourbar(*lengths)
    weld = Fixed("weld", ("crank.P", "coupler.P"), math.pi)
    report = kinfmu.check(replace(linkage, joints=(*linkage.joints, weld)))
    assert report.mobility == -2
    assert isinstance(report.problem, AssemblyError)
    assert str(report.problem).startswith("the mechanism does not close near its start pose (")
    assert str(report.problem).endswith("; 11 rows of the joints hold 9 coordinates: is a joint too many?")
    assert "remove [drivers" not in unwrapped(report)
    assert "note 3 moving bodies, 5 joints, the joints do not close, " in unwrapped(report)
