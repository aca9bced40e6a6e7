"""Certificates against closed forms of 50 digits, and what they must not prove."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu import AngleDriver, Body, Certificate, ConstantSpeed, Mechanism, Revolute
from kinfmu.analysis.certified import bounds, cells, intervals, proving
from kinfmu.analysis.certified.cover import Cover, joined
from kinfmu.analysis.certified.formulas import Formulas
from kinfmu.analysis.certified.intervals import Intervals
from kinfmu.analysis.certified.proving import path_across
from kinfmu.analysis.certified.stored import proved_again
from kinfmu.analysis.driver_path import follow
from kinfmu.cli import main
from kinfmu.draw import plot
from kinfmu.errors import FigureError, KinfmuError, RequestError
from kinfmu.mechanism.gallery import load, names
from kinfmu.mechanism.joints import Distance
from kinfmu.mechanism.measures.transfer import TransmissionAngle
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from tests import oracle
from tests.analysis.certified import test_intervals
from tests.gallery_members import mostly_long
from tests.mechanisms import fourbar

CROSSING = "branches cross: a change point"
REASONS = {
    "fourbar": [CROSSING] * 2,
    "fourbar_chain": [CROSSING] * 2,
    "parallel_jaw": [CROSSING] * 2,
    "cam_roller": ["a law begins anew, or an angle passes half a turn"] * 2,
}
NOT_PROVED = "the cell from 0.498665501 to 0.598398601 is not proved"


@pytest.fixture(scope="module")
def crank_rocker() -> Certificate:
    return kinfmu.certify(load("crank_rocker"))


def test_a_turn_of_the_crank_rocker_is_certified(crank_rocker: Certificate) -> None:
    assert crank_rocker.is_complete
    assert crank_rocker.share == 1.0
    assert crank_rocker.turns == 1
    assert crank_rocker.tube > 0.01


def test_enclosures_hold_the_poses_in_50_digits(crank_rocker: Certificate) -> None:
    u = np.random.default_rng(1).uniform(0.0, math.tau, 100)
    exact = oracle.fourbar(40, 20, 50, 50, u)
    for column, name in ((1, "coupler.phi"), (2, "rocker.phi")):
        for order, table in enumerate(exact):
            low, high = crank_rocker.enclosed(name, u, order)
            values = table[:, column]
            assert all(a <= value <= b for a, value, b in zip(low, values, high, strict=True)), (name, order)
            assert (high - low).max() < (1e-3, 0.03, 2.0)[order]


def test_bounds_enclose_the_extremes_in_50_digits(crank_rocker: Certificate) -> None:
    # extremes of the rocker where crank and coupler are in line: law of cosines
    swings = [oracle.mp.acos(oracle.mp.mpf(x * x - 40 * 40 - 50 * 50) / (-2 * 40 * 50)) for x in (70, 30)]
    least, most = sorted(oracle.mp.pi - swing for swing in swings)
    found = crank_rocker.bounds("rocker.phi")
    assert found.least[0] <= least <= found.least[1]
    assert found.most[0] <= most <= found.most[1]
    assert found.most[1] - found.most[0] < 1e-4


@pytest.mark.parametrize(
    "name", mostly_long(sorted(names()), ("crank_rocker", "fourbar", "triple_rocker", "excavator"))
)
def test_the_gallery_is_certified(name: str) -> None:
    certificate = kinfmu.certify(load(name))
    reasons = [gap.reason for gap in certificate.gaps]
    assert [reason.partition(";")[0] for reason in reasons] == REASONS.get(name, [])
    joins = "; a path joins the poses before and after, along which all rows close within "
    assert all(joins in reason for reason in reasons if CROSSING in reason)
    assert certificate.share > 0.999999


@pytest.mark.parametrize(
    "name", ["crank_rocker", "jansen_leg", pytest.param("cam_roller", marks=pytest.mark.long), "excavator"]
)
def test_samples_of_solve_lie_in_the_certified_motion(name: str) -> None:
    mechanism = load(name)
    certificate = kinfmu.certify(mechanism, over="run")
    run = kinfmu.solve(mechanism)
    for output in run.outputs:
        low, high = certificate.enclosed(output, run.t)
        off = 1e-12 * np.maximum(abs(run[output]), 1.0)
        assert (low - off <= run[output]).all(), output
        assert (run[output] <= high + off).all(), output


def test_a_dead_centre_is_enclosed_and_nothing_lies_beyond() -> None:
    certificate = kinfmu.certify(load("triple_rocker"))
    low, high = certificate.dead_centres
    for centre in (low, high):
        assert 0.0 < centre.high - centre.low < 1e-9
    exact = kinfmu.check(load("triple_rocker")).ranges[0]
    assert low.low <= exact.low <= low.high
    assert high.low <= exact.high <= high.high


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9])
@pytest.mark.few(1)
def test_two_branches_that_nearly_cross_are_distinguished_or_named(gap: float) -> None:
    # a parallelogram that is not one: its two branches avoid each other by about the root of the gap
    certificate = kinfmu.certify(fourbar(4.0, 2.0, 4.0 + gap, 2.0))
    u = np.array([certificate.cover.cells.low, certificate.cover.cells.high]).ravel()
    exact = oracle.fourbar(4.0, 2.0, 4.0 + gap, 2.0, np.clip(u, certificate.low + 1e-6, certificate.high - 1e-6))
    low, high = certificate.enclosed("rocker.phi", np.clip(u, certificate.low + 1e-6, certificate.high - 1e-6))
    for a, value, b in zip(low, exact.q[:, 2], high, strict=True):
        if not math.isnan(a):
            turns = round((a - float(value)) / math.tau)
            assert a - 1e-12 <= float(value) + turns * math.tau <= b + 1e-12


def test_the_other_branch_after_a_change_point_is_not_joined() -> None:
    same, other = (kinfmu.certify(fourbar(4.0, 2.0, 4.0, 2.0, branch=branch)) for branch in (1, -1))
    before, after = same.cover, other.cover
    is_before, is_after = before.cells.high < math.pi, after.cells.low > math.pi
    apart = after.cells.path[0][:, is_after][:, 0] - before.cells.path[0][:, is_before][:, -1]
    after.cells.path[0] -= math.tau * np.rint(apart / math.tau)[:, None]
    mixed = joined(
        [
            (before.cells[is_before], before.tubes[is_before]),
            (after.cells[is_after], after.tubes[is_after]),
        ]
    )
    assert "its direction changes by less than" in path_across(same.prover, before, 1)
    assert path_across(same.prover, mixed, 1) == "the direction after it is not shown to be that before it"


def without_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("_down", "_up"):
        monkeypatch.setattr(intervals, name, lambda x: x)


def with_a_wrong_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    right = cells._times
    monkeypatch.setattr(cells, "_times", lambda y, rows: [-row for row in right(y, rows)])


def with_a_cell_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave a cell out, and state that its neighbours are joined."""
    whole = Cover.with_poses

    def without_one(self: Cover, x: np.ndarray, z: np.ndarray) -> Cover:
        found = whole(self, x, z)
        kept = np.arange(len(found.cells)) != 30
        return Cover(found.cells[kept], found.tubes[kept], np.delete(found.is_joined, 30))

    monkeypatch.setattr(Cover, "with_poses", without_one)


def rounding_is_outward() -> None:
    test_intervals.test_operations_of_two_intervals_enclose_100_digits("+")


def the_crank_rocker_is_enclosed_all_around() -> None:
    certificate = kinfmu.certify(load("crank_rocker"))
    test_enclosures_hold_the_poses_in_50_digits(certificate)
    assert certificate.cover.cells.low[1:].tolist() == certificate.cover.cells.high[:-1].tolist()


@pytest.mark.parametrize(
    ("mutate", "check"),
    [
        (without_rounding, rounding_is_outward),
        (with_a_wrong_sign, the_crank_rocker_is_enclosed_all_around),
        (with_a_cell_skipped, the_crank_rocker_is_enclosed_all_around),
    ],
)
def test_a_mutation_is_found(
    mutate: Callable[[pytest.MonkeyPatch], None], check: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    check()
    mutate(monkeypatch)
    with pytest.raises(AssertionError):
        check()


def test_a_skipped_cell_is_named(crank_rocker: Certificate, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Cover.with_poses

    def without_one(self: Cover, x: np.ndarray, z: np.ndarray) -> Cover:
        found = whole(self, x, z)
        kept = np.arange(len(found.cells)) != 30
        return joined([(found.cells[kept], found.tubes[kept])])

    monkeypatch.setattr(Cover, "with_poses", without_one)
    certificate = kinfmu.certify(load("crank_rocker"))
    assert [gap.reason for gap in certificate.gaps] == ["not proved"]
    assert certificate.turns is None
    assert crank_rocker.is_complete


@pytest.mark.parametrize("seed", range(5))
def test_bounds_of_20_measures_enclose_the_extremes_in_50_digits(seed: int) -> None:
    random = np.random.default_rng(seed)
    ground, crank, coupler, rocker = (4.0, float(random.uniform(0.5, 1.9)), *random.uniform(2.6, 3.6, 2).tolist())
    bars = TransmissionAngle("mu", ("coupler.Q", "coupler.P"), ("rocker.Q", "rocker.C"))
    certificate = kinfmu.certify(replace(fourbar(ground, crank, coupler, rocker), measures=(bars,)))
    assert certificate.turns == 1
    g, a, b, c = map(oracle.mp.mpf, (ground, crank, coupler, rocker))

    def angle(x: Any, y: Any, opposite: Any) -> Any:
        return oracle.mp.acos((x * x + y * y - opposite * opposite) / (2 * x * y))

    exact = {
        "rocker.phi": sorted(oracle.mp.pi - angle(g, c, b + side * a) for side in (-1, 1)),
        "mu": [angle(b, c, g + side * a) for side in (-1, 1)],
    }
    for name, extremes in exact.items():
        found = certificate.bounds(name)
        for extreme, (low, high) in zip(extremes, found, strict=True):
            assert low <= extreme <= high, name
            assert high - low < 1e-3
    assert np.isnan(certificate.enclosed("mu", np.array([certificate.low - 1.0]))).all()
    with pytest.raises(RequestError, match="'mu' is an angle of transmission, whose rates are not bounded"):
        certificate.bounds("mu", order=1)


def test_a_certificate_of_tolerances_holds_for_every_corner() -> None:
    certificate = kinfmu.certify(load("crank_rocker"), tolerances=0.001)
    assert certificate.is_complete
    random, u = np.random.default_rng(2), np.linspace(0.0, math.tau, 50)
    for _ in range(20):
        lengths = [length * (1.0 + 0.001 * random.choice((-1.0, 1.0))) for length in (40.0, 20.0, 50.0, 50.0)]
        exact = oracle.fourbar(*lengths, u)
        low, high = certificate.enclosed("rocker.phi", u)
        assert all(a <= value <= b for a, value, b in zip(low, exact.q[:, 2], high, strict=True))
    alone = kinfmu.certify(load("crank_rocker"), tolerances={"bodies.crank.points.P.x": 0.05})
    low, high = alone.enclosed("rocker.phi", u)
    middle = oracle.fourbar(40, 20.05, 50, 50, u).q[:, 2]
    assert all(a <= value <= b for a, value, b in zip(low, middle, high, strict=True))
    with pytest.raises(RequestError, match=r"tolerance of 'crank.P': not a number of this mechanism, such as bodies"):
        kinfmu.certify(load("crank_rocker"), tolerances={"crank.P": 0.05})


def test_plots_have_the_bounds_as_a_band(tmp_path: Path, crank_rocker: Certificate) -> None:
    run = kinfmu.solve(load("crank_rocker"))
    certificate = kinfmu.certify(load("crank_rocker"), over="run", tolerances=0.005)
    drawn = {}
    for name, band in (("plain", None), ("band", certificate)):
        plot(run, tmp_path / f"{name}.svg", ["rocker.phi"], certificate=band)
        drawn[name] = (tmp_path / f"{name}.svg").read_text().count("opacity: 0.25")
    assert drawn["band"] == drawn["plain"] + 3  # position, velocity, acceleration
    over_angles = kinfmu.solve(load("crank_rocker"), crank_angle=np.linspace(0.0, 1.0, 5))
    for shown, band in ((run, crank_rocker), (over_angles, certificate)):
        with pytest.raises(FigureError, match="a band needs panels over the run and its certificate"):
            plot(shown, tmp_path / "none.svg", certificate=band)


def test_tolerances_are_in_outputs_that_depend_on_them_directly() -> None:
    certificate = kinfmu.certify(load("offset_slider_crank"), tolerances={"bodies.crank.points.P.x": 0.5})
    low, high = certificate.enclosed("rod.x", np.array([0.05]))
    for length in (29.5, 30.0, 30.5):
        assert low[0] <= length * math.cos(0.05) <= high[0]
    assert certificate.bounds("rod.x").most[1] >= 30.5


SLIDER = """
name = "slider"
units.length = "mm"
parameters = { crank = "20 mm", rod = 80.0, both = "crank + rod" }
[bodies]
ground.points.O = [0, 0]
crank = { points = { O = [0, 0], P = ["crank", 0] } }
rod = { points = { P = [0, 0], Q = ["rod", 0] }, start = { x = 20, y = 0, phi = -0.1 } }
block = { points.Q = [0, 0], start.x = 100 }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
Q = { type = "revolute", between = ["rod.Q", "block.Q"] }
guide = { type = "translational", between = ["ground.O", "block.Q"], axis = 0.0 }
[drivers]
crank = { type = "angle", of = "crank", law = "constant_speed", start = 0.0, speed = 1.0 }
"""
STUDY = 'mechanism = "slider.toml"\n[parameters]\ncrank.tolerance = 0.05\nrod = { from = 79.5, to = "80.5 mm" }\n'


@pytest.fixture
def check_slider(tmp_path: Path) -> Callable[..., str]:
    files = {"slider.toml": SLIDER, "study.toml": STUDY, "grid.toml": STUDY.replace("tolerance = 0.05", "values = [1]")}
    for name, written in files.items():
        (tmp_path / name).write_text(written)

    def check(*arguments: str) -> str:
        paths = [str(tmp_path / argument) if argument in files else argument for argument in arguments]
        return CliRunner().invoke(main, ["check", str(tmp_path / "slider.toml"), *paths]).output

    return check


@pytest.mark.parametrize(
    "options",
    [
        ("--set", "crank=20mm\N{PLUS-MINUS SIGN}0.05mm", "--set", "rod=80\N{PLUS-MINUS SIGN}0.625%"),
        ("--set", "crank=20+-0.05mm", "--set", "rod=80 mm +/- 0.5"),
        ("--tolerances", "study.toml"),
    ],
)
def test_tolerances_of_the_command_line_make_one_certificate(
    options: tuple[str, ...], check_slider: Callable[..., str], tmp_path: Path
) -> None:
    shown = check_slider("--certify", *options, "--certificate", str(tmp_path / "proof.json"))
    assert "for all mechanisms with crank = 20 mm within 0.05 mm, rod = 80 mm within 0.5 mm" in shown
    certificate = proved_again(tmp_path / "proof.json")
    assert certificate.turns == 1
    u = np.linspace(0.0, math.tau, 50)
    low, high = certificate.enclosed("block.x", u)
    for crank, rod in ((19.95, 79.5), (20.05, 80.5), (20.0, 80.0)):
        x = crank * np.cos(u) + np.sqrt(rod**2 - (crank * np.sin(u)) ** 2)
        assert ((low <= x + 1e-12) & (x - 1e-12 <= high)).all()
    assert (high - low).max() < 1.2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--set", "crank=20+-0.05"),
            "--set: crank=20+-0.05: a tolerance belongs to a certificate; use check --certify",
        ),
        (("--tolerances", "study.toml"), "--tolerances needs --certify"),
        (("--certify", "--set", "crank=20+--1"), "--set: crank=20+--1: the tolerance must be positive"),
        (("--certify", "--set", "crank=20+-1deg"), "crank = '1deg': unit 'deg' must be one of m, mm"),
        (("--certify", "--set", "crank=20+-x%"), "--set: crank=20+-x%: crank = 'x' must be a number"),
        (
            ("--certify", "--set", "crnk=20+-1"),
            "--set: crnk=20+-1: there is no parameter 'crnk'; did you mean 'crank'?",
        ),
        (
            ("--certify", "--set", "crank.speed=1+-1"),
            "crank.speed: a constant of a law has no tolerance; parameters have",
        ),
        (("--certify", "--tolerances", "grid.toml"), "only tolerances and ranges of parameters have a certificate"),
    ],
)
def test_tolerances_of_the_command_line_are_checked(
    options: tuple[str, ...], message: str, check_slider: Callable[..., str]
) -> None:
    assert message in check_slider(*options)


def test_tolerances_of_angles_are_in_degrees() -> None:
    tilted = SLIDER.replace("rod = 80.0,", 'rod = 80.0, tilt = "30 deg",').replace(
        "axis = 0.0", 'axis = "tilt - 30 deg"'
    )
    certificate = kinfmu.certify(parse(tilted), tolerances={"tilt": math.radians(0.1)})
    assert "for all mechanisms with tilt = 30 deg within 0.1 deg" in str(certificate)


def test_what_follows_from_parameters_has_no_tolerance_of_its_own() -> None:
    with pytest.raises(RequestError, match="tolerance of 'both': it follows from other parameters; give theirs"):
        kinfmu.certify(parse(SLIDER), tolerances={"both": 0.1})


@pytest.mark.parametrize("is_high", [True, False])
def test_a_motion_that_is_not_followed_to_an_end_is_not_complete(
    monkeypatch: pytest.MonkeyPatch, *, is_high: bool
) -> None:
    stopped = {"stopped": "too many steps", "is_stopped_high": is_high}
    monkeypatch.setattr(proving, "follow", lambda *arguments: replace(follow(*arguments), **stopped))
    certificate = kinfmu.certify(load("crank_rocker"))
    at = certificate.high if is_high else certificate.low
    assert certificate.gaps == ((at, at, "the motion is not followed farther: too many steps"),)
    assert not certificate.is_complete


def test_a_ratio_that_is_rounded_in_the_file_does_not_repeat() -> None:
    written = text(load("geared_five_bar"))
    assert "ratio = -2.0" in written
    assert kinfmu.certify(parse(written.replace("ratio = -2.0", "ratio = -1.9999999"))).turns is None


def test_redundant_rows_have_no_certificate_of_tolerances() -> None:
    with pytest.raises(RequestError, match=r"redundant rows \(third\.across\) close for the numbers of the file only"):
        kinfmu.certify(load("elliptic_trammel"), tolerances=0.001)


def coupled_wheels() -> Mechanism:
    """Two wheels coupled by two rods a quarter turn apart: each keeps the block regular where the other cannot."""
    pins = {"A": (1.0, 0.0), "B": (0.0, 1.0)}
    ground = Body("ground", {"O0": (0, 0), "O1": (3.0, 0)})
    wheels = [Body(f"wheel{k}", {"O": (0, 0), **pins}, (3.0 * k, 0, 0.3)) for k in range(2)]
    joints = [Revolute(f"O{k}", (f"ground.O{k}", f"wheel{k}.O")) for k in range(2)]
    joints += [Distance(name, (f"wheel0.{name}", f"wheel1.{name}"), 3.0) for name in pins]
    return Mechanism("wheels", [ground, *wheels], joints, [AngleDriver("drive", "wheel0", ConstantSpeed(0.3, 1.0))])


def test_blocks_with_redundant_rows_are_proved_and_the_rows_bounded(tmp_path: Path) -> None:
    certificate = kinfmu.certify(coupled_wheels())
    assert any(block.is_tall for block in certificate.prover.formulas.blocks)
    assert certificate.turns == 1
    assert certificate.is_complete
    assert len(certificate.redundant) == 2
    assert max(certificate.redundant.values()) <= 1e-9
    u = np.linspace(0.3, 0.3 + math.tau, 50)
    low, high = certificate.enclosed("wheel1.phi", u)
    assert ((low <= u) & (u <= high)).all()
    assert "redundant rows close, relative to the size: " in str(certificate)
    path = tmp_path / "proof.json"
    certificate.write(path)
    assert proved_again(path).is_complete
    content = json.loads(path.read_text())
    content["states"]["redundant_rows"] = {"A.length": 0.0}
    path.write_text(json.dumps(content))
    with pytest.raises(KinfmuError, match=r"the redundant row A\.length is not proved to close within 0"):
        proved_again(path)


def test_a_redundant_row_whose_bound_is_given_up_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "_MOST_CLOSING", 0)
    certificate = kinfmu.certify(coupled_wheels())
    assert not certificate.is_complete
    reasons = {gap.reason for gap in certificate.gaps}
    assert reasons <= {f"the redundant row {row}.length is not shown to close within 1e-09" for row in "AB"}
    assert max(certificate.redundant.values()) <= 1e-9


def test_all_rows_are_open_on_a_path_if_a_redundant_one_is(monkeypatch: pytest.MonkeyPatch) -> None:
    certificate = kinfmu.certify(fourbar(4.0, 2.0, 4.0, 2.0))
    formulas = certificate.prover.formulas
    monkeypatch.setattr(formulas, "redundant", {"wrong": formulas.graph.constant(1e-3)})
    crossing = path_across(certificate.prover, certificate.cover, 1)
    assert crossing == "on the path from the pose before to that after rows are open by 0.001 of the size"


def test_a_redundant_row_that_does_not_close_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Formulas.__init__

    def with_a_wrong_row(self: Formulas, *arguments: Any, **options: Any) -> None:
        made(self, *arguments, **options)
        angle = self.outputs[list(self.plan.outputs).index("rocker.phi")][0]
        self.redundant = {"wrong": angle - self.graph.constant(2.0)}

    monkeypatch.setattr(Formulas, "__init__", with_a_wrong_row)
    monkeypatch.setattr(proving, "_jumps_within", lambda *_: True)  # what is known of a row comes first
    certificate = kinfmu.certify(load("crank_rocker"))
    assert {gap.reason for gap in certificate.gaps} == {"the redundant row wrong does not close"}
    assert certificate.share < 0.2
    assert certificate.turns is None


def test_outputs_of_a_range_that_ends_at_dead_centres_are_bounded() -> None:
    bars = TransmissionAngle("mu", ("coupler.D", "coupler.C"), ("right.D", "right.B"))
    certificate = kinfmu.certify(replace(load("triple_rocker"), measures=(bars,)))
    largest = certificate.bounds("mu").most  # there these bars are in line
    assert math.pi - 1e-3 < largest[0] < math.pi <= largest[1]
    ground, left, coupler, right = 100, 65, 50, 65
    diagonal = oracle.mp.mpf(coupler + right)  # where both are in line
    swing = oracle.mp.acos((ground**2 + left**2 - diagonal**2) / (2 * oracle.mp.mpf(ground * left)))
    for ends, exact in zip(certificate.bounds("left.phi"), (-swing, swing), strict=True):
        assert ends[0] <= exact <= ends[1]
        assert ends[1] - ends[0] < 1e-4
    with pytest.raises(RequestError, match="ends at a dead centre, up to which rates grow without bound"):
        certificate.bounds("right.phi", order=1)


def test_over_and_outputs_are_checked(crank_rocker: Certificate) -> None:
    with pytest.raises(RequestError, match=r"over = 'turn' is not known; known are 'range' and 'run'"):
        kinfmu.certify(load("crank_rocker"), over="turn")
    with pytest.raises(RequestError, match="several drivers have no range in common; use over = 'run'"):
        kinfmu.certify(load("excavator"), over="range")
    with pytest.raises(RequestError, match="'rocker' is no output; outputs: "):
        crank_rocker.bounds("rocker")


def test_check_prints_the_certificate() -> None:
    shown = CliRunner().invoke(main, ["check", "crank_rocker", "--certify"])
    assert "certified   crank from 0 deg to 360 deg, 100 % of it" in shown.output
    shown = CliRunner().invoke(main, ["check", "fourbar", "--certify"])
    assert shown.output.count("not proved  crank = ") == 2
    found = json.loads(CliRunner().invoke(main, ["check", "triple_rocker", "--certify", "--json"]).output)[
        "certificate"
    ]
    assert found["complete"]
    assert len(found["dead_centres"]) == 2


@pytest.mark.parametrize("name", ["crank_rocker", "triple_rocker", "fourbar", "excavator"])
def test_a_certificate_is_proved_again(name: str, tmp_path: Path) -> None:
    certificate = kinfmu.certify(load(name))
    certificate.write(tmp_path / "proof.json")
    shown = CliRunner().invoke(main, ["verify", str(tmp_path / "proof.json")])
    assert shown.exit_code == 0, shown.output
    assert shown.output == f"{certificate}\n"


def test_a_certificate_of_tolerances_is_proved_again(tmp_path: Path) -> None:
    kinfmu.certify(load("crank_rocker"), tolerances=0.001).write(tmp_path / "proof.json")
    assert proved_again(tmp_path / "proof.json").is_complete


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda of: of["cells"]["path"][0][0].__setitem__(5, 9.0), NOT_PROVED),
        (lambda of: of["cells"]["radii"][0].__setitem__(5, 1.0), NOT_PROVED),
        (lambda of: [of["cells"][key].pop(5) for key in ("low", "high", "u")], "cells.path must be 3 x 2 x 62 finite"),
        (lambda of: of["states"].update(high=7.0), "its range is not that of the mechanism"),
        (lambda of: of["states"].update(turns=2), "its range is not that of the mechanism"),
        (lambda of: of.update(mechanism=of["mechanism"].replace("[20.0, 0.0]", "[45.0, 0.0]")), "proof.json: "),
        (lambda of: of["states"].update(high=math.inf), "not a complete certificate"),
        (lambda of: of["states"].update(high="x"), "not a complete certificate"),
        (lambda of: of["states"].update(driver="rocker"), "'driver' is 'crank', not 'rocker'"),
        (lambda of: of["states"].update(tube=0.2), "its tube or its share is not proved"),
        (lambda of: of.pop("cells"), "not a complete certificate"),
        (lambda of: of.update(format="x"), "not a certificate of kinfmu; its format is 'kinfmu certificate 1'"),
    ],
)
def test_a_changed_certificate_is_refused(
    change: Callable[[dict[str, Any]], object], message: str, crank_rocker: Certificate, tmp_path: Path
) -> None:
    path = tmp_path / "proof.json"
    crank_rocker.write(path)
    content = json.loads(path.read_bytes())
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(KinfmuError, match=re.escape(message)):
        proved_again(path)


def test_a_missing_cell_is_missed_when_it_is_proved_again(crank_rocker: Certificate, tmp_path: Path) -> None:
    path = tmp_path / "proof.json"
    crank_rocker.write(path)
    content = json.loads(path.read_bytes())
    for row in (content["cells"][key] for key in ("low", "high", "u")):
        del row[5]
    for row in (*content["cells"]["radii"], *(row for table in content["cells"]["path"] for row in table)):
        del row[5]
    path.write_text(json.dumps(content))
    with pytest.raises(KinfmuError, match=r"0\.498665501 to 0\.598398601 is not proved: not proved"):
        proved_again(path)


def test_intervals_of_a_cell_are_ordered(crank_rocker: Certificate) -> None:
    tube: Intervals = crank_rocker.cover.tubes.narrow
    assert (tube.low <= tube.high).all()
