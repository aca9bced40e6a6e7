"""Certificates against closed forms of 50 digits, and what they must not prove."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu import Certificate
from kinfmu.analysis.certified import cells
from kinfmu.analysis.certified.cover import Cover
from kinfmu.analysis.certified.intervals import Intervals
from kinfmu.analysis.certified.stored import proved_again
from kinfmu.cli import main
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism.gallery import load, names
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from tests import oracle
from tests.gallery_members import mostly_long
from tests.mechanisms import fourbar

CROSSING = "branches cross: a change point"
REASONS = {
    "fourbar": [CROSSING] * 2,
    "parallel_jaw": [CROSSING] * 2,
    "cam_roller": ["not proved"] * 2,
}  # its law repeats
SLOW = ("fourbar_chain",)  # a hundred loops
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
    "name", mostly_long(sorted({*names()} - {*SLOW}), ("crank_rocker", "fourbar", "triple_rocker", "excavator"))
)
def test_the_gallery_is_certified(name: str) -> None:
    certificate = kinfmu.certify(load(name))
    reasons = [gap.reason for gap in certificate.gaps]
    assert reasons == REASONS.get(name, [])
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


def test_a_skipped_cell_is_named(crank_rocker: Certificate, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Cover.with_poses

    def without_one(self: Cover, x: np.ndarray, z: np.ndarray) -> Cover:
        found = whole(self, x, z)
        kept = np.arange(len(found.cells)) != 30
        return Cover(
            found.cells[kept], found.tubes[kept], np.delete(found.is_joined, 30) & (np.arange(len(kept) - 2) != 29)
        )

    monkeypatch.setattr(Cover, "with_poses", without_one)
    certificate = kinfmu.certify(load("crank_rocker"))
    assert [gap.reason for gap in certificate.gaps] == ["not proved"]
    assert certificate.turns is None
    assert crank_rocker.is_complete


def test_with_a_wrong_sign_nothing_is_enclosed(monkeypatch: pytest.MonkeyPatch) -> None:
    right = cells._times
    monkeypatch.setattr(cells, "_times", lambda y, rows: [-row for row in right(y, rows)])
    certificate = kinfmu.certify(load("crank_rocker"))
    with pytest.raises(AssertionError):
        test_enclosures_hold_the_poses_in_50_digits(certificate)


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


def test_tolerances_are_in_outputs_that_depend_on_them_directly() -> None:
    certificate = kinfmu.certify(load("offset_slider_crank"), tolerances={"bodies.crank.points.P.x": 0.5})
    low, high = certificate.enclosed("rod.x", np.array([0.05]))
    for length in (29.5, 30.0, 30.5):
        assert low[0] <= length * math.cos(0.05) <= high[0]
    assert certificate.bounds("rod.x").most[1] >= 30.5


def test_a_ratio_that_is_rounded_in_the_file_does_not_repeat() -> None:
    written = text(load("geared_five_bar"))
    assert "ratio = -2.0" in written
    assert kinfmu.certify(parse(written.replace("ratio = -2.0", "ratio = -1.9999999"))).turns is None


def test_redundant_rows_have_no_certificate_of_tolerances() -> None:
    with pytest.raises(RequestError, match=r"redundant rows \(third\.across\) close for the numbers of the file only"):
        kinfmu.certify(load("elliptic_trammel"), tolerances=0.001)


def test_outputs_of_a_range_that_ends_at_a_dead_centre_are_not_bounded() -> None:
    with pytest.raises(RequestError, match="ends at a dead centre, up to which outputs are not bounded"):
        kinfmu.certify(load("triple_rocker")).bounds("left.phi")


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
