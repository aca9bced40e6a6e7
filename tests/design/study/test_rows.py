"""The rows of a study: its designs and tolerances, and the measures of each."""

from __future__ import annotations

import itertools
import math
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.stats import kstest, qmc

import kinfmu
from kinfmu.design.study import StudyResult
from kinfmu.design.study.definition import define
from kinfmu.design.study.sampling import Sampling, Tolerance, UniformRange
from kinfmu.errors import MissingPackageError, StudyError
from kinfmu.mechanism import toml_file
from kinfmu.mechanism.measures import Minimum, PeakAcceleration, Range
from kinfmu.mechanism.toml_file import parse
from tests.design.study.linkage import RANGES, TEXT, linkage, swing


def test_measures_are_those_of_the_closed_form_and_of_single_calls() -> None:
    found = kinfmu.study(linkage(), RANGES, designs=20, seed=3, workers=1)
    closed = [swing(crank, 50.0, base) for crank, base in zip(found["crank"], found["base"], strict=True)]
    assert np.abs(found["swing"] - closed).max() < 1e-9
    angles = np.linspace(0.0, 2.0 * np.pi, 361)
    model = kinfmu.compile(linkage())
    for k in (0, 7, 19):
        run = model.solve(
            crank_angle=angles, crank_speed=np.pi, parameters={"crank": found["crank"][k], "base": found["base"][k]}
        )
        for name, one in kinfmu.measure(run).items():
            assert found[name][k] == pytest.approx(one.value, rel=1e-11)
            columns = [f"{name}.at", f"{name}.at2"][: len(one.at)]
            assert [found[column][k] for column in columns] == pytest.approx(one.at, abs=1e-7)


def test_grids_are_combined_with_the_last_one_fastest_and_each_point_with_the_same_samples() -> None:
    parameters = {
        "base": {"values": ["40 mm", 45, "5 cm"]},
        "crank": {"from": 15, "to": 25, "count": 2},
        "rocker": {"tolerance": "0.1 mm"},
    }
    study = define(linkage(), parameters, designs=4)
    values = study.sampling.values(0, len(study))
    rows = list(itertools.product([40.0, 45.0, 50.0], [15.0, 25.0], range(4)))
    assert len(study) == len(rows) == 24
    assert list(zip(values["base"], values["crank"], strict=True)) == [row[:2] for row in rows]
    assert np.array_equal(values["rocker"].reshape(6, 4), np.tile(values["rocker"][:4], (6, 1)))


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube"])
def test_the_numbers_of_a_design_do_not_depend_on_the_part_it_is_in(method: str) -> None:
    variations = (UniformRange("a", "mm", 1.0, 2.0), Tolerance("b", "mm", 3.0, 0.3, "normal", 3.0))
    sampling = Sampling(variations, method, 1000, 5)
    whole = sampling.values(0, 1000)
    for first, count in ((0, 1), (1, 1), (3, 64), (511, 2), (512, 488)):
        part = Sampling(variations, method, 1000, 5).values(first, count)
        for name in whole:
            assert np.array_equal(part[name], whole[name][first : first + count])
    other = Sampling(variations, method, 1000, 6).values(0, 1000)
    assert not np.array_equal(other["a"], whole["a"])


def test_samples_have_their_distributions_and_fill_the_space_evenly() -> None:
    variations = (
        UniformRange("a", "mm", 1.0, 2.0),
        Tolerance("b", "mm", 3.0, 0.3, "normal", 3.0),
        Tolerance("c", "mm", 3.0, 0.3, "uniform", 3.0),
    )
    for method in ("sobol", "latin_hypercube"):
        found = Sampling(variations, method, 1024, 1).values(0, 1024)
        assert kstest(found["a"], "uniform", (1.0, 1.0)).statistic < 2e-3
        assert kstest(found["b"], "norm", (3.0, 0.1)).statistic < 2e-3
        assert kstest(found["c"], "uniform", (2.7, 0.6)).statistic < 2e-3
        assert variations[2].deviation == pytest.approx(found["c"].std(), rel=2e-3)
        points = np.column_stack([found["a"] - 1.0, (found["c"] - 2.7) / 0.6])
        evenness = qmc.discrepancy(points)
        assert evenness < 0.2 * qmc.discrepancy(np.random.default_rng(1).random((1024, 2)))


def test_a_design_that_does_not_close_has_no_numbers_and_a_reason() -> None:
    found = kinfmu.study(linkage(), {"base": {"values": [40, 300, 45]}}, workers=1)
    assert list(found.failures) == [1]
    assert np.isfinite(found["swing"]).tolist() == [True, False, True] == found.good().tolist()
    assert (found["solver.status"] >= 3).tolist() == [False, True, False]
    assert found.statistics["swing"].missing == 1
    assert "1 of 3 designs lack a measure, the first is design 1: " in str(found)


def test_measures_of_the_call_and_times_and_law_constants() -> None:
    measures = [Range("height", of="coupler.y"), "swing", Minimum("slowest", of="rocker.omega")]
    t = np.linspace(0.0, 2.0, 181)
    found = kinfmu.study(
        linkage(), {"crank.speed": {"values": ["30 rpm", "60 rpm"]}}, measures=measures, t=t, workers=1
    )
    assert found.measures == ("height", "swing", "slowest")
    assert (found.units["crank.speed"], found.units["slowest"]) == ("rad/s", "rad/s")
    assert found["slowest"][1] == pytest.approx(2.0 * found["slowest"][0], rel=1e-7)


SPEEDS = {"crank.speed": {"from": "60 rpm", "to": "-400 rpm", "count": 4}}


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("varied", ["crank.speed", "crank.start", "w", "crank.speed and crank"])
@pytest.mark.few(1)
def test_every_design_makes_a_cycle_at_its_own_speed_as_check_does(varied: str, engine: str) -> None:
    mechanism = linkage()
    grids = {
        "crank.speed": SPEEDS,
        "crank.start": {"crank.start": {"values": ["10 deg", "200 deg"]}},
        "w": {"w": {"values": ["30 rpm", "45 rpm"]}},
        "crank.speed and crank": {**SPEEDS, "crank": {"values": [20, "21 mm"]}},
    }[varied]
    if varied == "w":
        text = TEXT.replace('speed = "30 rpm"', 'speed = "2*w"')
        mechanism = toml_file.parse(text.replace('base = "40 mm"', 'base = "40 mm", half = "w/2", w = "15 rpm"'))
    found = kinfmu.study(mechanism, grids, engine=engine, workers=1)
    assert len(found) > 1
    for k in range(len(found)):
        settings = {name: float(found[name][k]) for name in grids}
        measured = kinfmu.check(mechanism.with_parameters(settings)).measured
        assert measured is not None
        for one in measured.values:
            assert found[one.name][k] == pytest.approx(one.value, rel=1e-7)
            columns = [f"{one.name}.at", f"{one.name}.at2"][: len(one.at)]
            assert [found[column][k] for column in columns] == pytest.approx(one.at, abs=1e-6)
    assert "one turn of crank at the speed of each design" in str(found)


def test_other_law_constants_vary_over_the_run_of_the_file() -> None:
    text = TEXT.replace('law = "constant_speed", speed = "30 rpm"', 'law = "polynomial", coefficients = [0, 3, 0.5]')
    mechanism = toml_file.parse(text + "run = { start = 0, stop = 1, step = 0.01 }\n")
    found = kinfmu.study(mechanism, {"crank.c2": {"values": [0.5, 1.0]}}, workers=1)
    assert "the run of the file, t = 0 to 1 s" in str(found)
    for k, value in enumerate(found["crank.c2"]):
        run = kinfmu.solve(mechanism.with_parameters({"crank.c2": float(value)}))
        assert found["fastest"][k] == pytest.approx(kinfmu.measure(run)["fastest"].value, rel=1e-9)


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_the_file_says_what_it_was_made_from(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"rows{suffix}"
    found = kinfmu.study(linkage(), RANGES, designs=8, seed=4, output=path, workers=1)
    assert sorted(one.name for one in tmp_path.iterdir()) == [path.name, "rows.csv.json"][: 1 + (suffix == ".csv")]
    again = StudyResult.read(path)
    assert again.definition == found.definition
    assert (again.definition["seed"], again.definition["designs"]) == (4, 8)
    assert again.mechanism.parameters == linkage().parameters
    assert again.version == kinfmu.VERSION
    assert (again.units["crank"], again.units["swing"], again.units["swing.at2"]) == ("mm", "rad", "rad")
    frame = again.to_pandas()
    assert frame.attrs["units"]["fastest"] == "rad/s"
    assert frame["design"].tolist() == list(range(8)) == again.to_polars()["design"].to_list()
    assert np.array_equal(frame["swing"], found["swing"])
    with pytest.raises(StudyError, match="no column 'swin'; did you mean 'swing'"):
        again["swin"]


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_a_finished_study_is_not_measured_again(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"rows{suffix}"
    kinfmu.study(linkage(), RANGES, designs=8, output=path, workers=1)
    calls: list[int] = []
    again = kinfmu.study(
        linkage(), RANGES, designs=8, output=path, workers=1, progress=lambda *done: calls.extend(done)
    )
    assert (calls, len(again)) == ([], 8)
    other = kinfmu.study(linkage(), RANGES, designs=9, output=path, workers=1, restart=True)
    assert len(other) == 9


def test_it_shows_itself_in_notebooks() -> None:
    found = kinfmu.study(linkage(), {"base": {"from": 40, "to": 50, "count": 3}}, workers=1)
    page = found._repr_html_()
    assert page is not None
    assert page.count("<tr>") == 3
    assert page.count(">swing<") == 1
    assert page.count("<img ") == 1
    picture = found._repr_svg_()
    assert picture is not None
    assert "swing [deg]" in picture
    assert repr(found) == "<Study of hoeken: 3 designs; swing, fastest>"


def test_another_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"path = 5 must be the path of a \.parquet or \.csv file"):
        StudyResult.read(5)  # type: ignore[arg-type]
    other = tmp_path / "run.parquet"
    kinfmu.log.write_table(kinfmu.solve(linkage(), crank_angle=[0.0, 0.1]), other)
    with pytest.raises(StudyError, match="not the results of a study"):
        StudyResult.read(other)
    other.write_bytes(b"PAR1")
    with pytest.raises(StudyError, match="cannot be read"):
        StudyResult.read(other)
    table = tmp_path / "rows.csv"
    with pytest.raises(StudyError, match=r"rows\.csv: cannot be read \(No such file"):
        StudyResult.read(table)
    kinfmu.study(linkage(), RANGES, designs=4, output=table, workers=1)
    table.write_text("design\n0\n")
    with pytest.raises(StudyError, match=r"rows\.csv: cannot be read \(its columns are others"):
        StudyResult.read(table)["swing"]
    table.with_name("rows.csv.json").write_text("[]")
    with pytest.raises(StudyError, match=r"rows\.csv: not the results of a study: rows\.csv\.json is not about it"):
        StudyResult.read(table)


def test_rows_are_the_same_in_every_format_and_without_pyarrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {"crank": {"values": [20, 200]}, "base": {"from": 40, "to": 50, "count": 2}}  # 200: does not close
    found = kinfmu.study(linkage(), given, workers=1)
    files = [kinfmu.study(linkage(), given, output=tmp_path / name, workers=1) for name in ("a.parquet", "a.csv")]
    for other in files:
        assert other.units == found.units
        assert (other.failures, other.first_failure) == (found.failures, found.first_failure)
        assert other.statistics == found.statistics
        assert other.to_arrow().schema.equals(found.to_arrow().schema, check_metadata=True)
        for name, _, column in found.columns():
            assert other[name].dtype == column.dtype
            np.testing.assert_array_equal(other[name], column)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    again = kinfmu.study(linkage(), given, output=tmp_path / "b.csv", workers=1)
    assert (tmp_path / "b.csv").read_bytes() == (tmp_path / "a.csv").read_bytes()
    assert again.to_pandas().shape == (4, len(found.units))
    for refused in (lambda: kinfmu.study(linkage(), given, output=tmp_path / "b.parquet", workers=1), again.to_arrow):
        with pytest.raises(MissingPackageError, match="pyarrow"):
            refused()
    with pytest.raises(MissingPackageError, match=r"reading Parquet needs pyarrow: pip install 'kinfmu\[parquet\]'"):
        StudyResult.read(tmp_path / "a.parquet")


# --------------------------------------------------------------------------------------------------------------- masses


# A steel bar turns at 4 rad/s about one end, with a weight fixed on it.
LEVER = """
name = "lever"
units = { length = "mm" }
gravity = { x = 0, y = "-10 m/s2" }
parameters = { weight = "2 kg", density = "7850 kg/m3" }

[bodies]
ground.points = { O = [0, 0] }
lever = { points = { O = [0, 0], E = [500, 0] }, rod = ["O", "E"], width = 20, thickness = 10, density = "density" }
weight = { points = { O = [0, 0] }, mass = "weight", center_of_mass = [-100, 0] }

[joints]
O = { type = "revolute", between = ["ground.O", "lever.O"] }
screw = { type = "fixed", between = ["lever.O", "weight.O"] }

[drivers.lever]
type = "angle"
of = "lever"
law = "constant_speed"
speed = 4

[measures]
torque = { type = "peak", of = "lever.torque" }
shaking = { type = "peak", of = "shaking_force" }
"""
BAR = 0.5 * 0.02 * 0.01  # [m3]


def test_a_study_over_a_mass_and_a_density() -> None:
    """Weight times arm; at the lowest point, or the highest, the weight with the centrifugal force."""
    grids = {"weight": {"values": [1.0, 2.0, -1.0]}, "density": {"values": ["1 g/cm3", 7850.0]}}
    table = kinfmu.study(parse(LEVER, "lever.toml"), grids, workers=1)
    weight, density = (np.array(table[name]) for name in ("weight", "density"))
    moment, mass = 0.25 * BAR * density - 0.1 * weight, BAR * density + weight
    valid = weight > 0.0
    np.testing.assert_allclose(table["torque"][valid], 10.0 * np.abs(moment[valid]), rtol=1e-9)
    np.testing.assert_allclose(table["shaking"][valid], (10.0 * mass + 16.0 * np.abs(moment))[valid], rtol=1e-9)
    assert np.isnan(table["torque"][~valid]).all()
    reason = "[bodies.weight] mass = -1.0 must be 0 or more"
    assert f"2 of 6 designs lack a measure, the first is design 4: {reason}" in str(table)


# ----------------------------------------------------------------------------------------------------------- tolerances


TOLERANCES = {
    "crank": {"tolerance": "0.06 mm", "deviations": 2},
    "rocker": {"tolerance": "0.1 mm", "distribution": "uniform"},
    "base": {"tolerance": "0.09 mm"},
}
DEVIATIONS = {"crank": 0.03, "rocker": 0.1 / math.sqrt(3.0), "base": 0.03}
AT = {"crank": 20.0, "rocker": 50.0, "base": 40.0}


def slope(name: str) -> float:
    """Return the derivative of the swing angle in 30 digits."""

    def closed(value: mpmath.mpf) -> mpmath.mpf:
        crank, rocker, base = (value if one == name else mpmath.mpf(AT[one]) for one in AT)

        def angle(reach: mpmath.mpf) -> mpmath.mpf:
            return mpmath.acos((base**2 + rocker**2 - reach**2) / (2 * base * rocker))

        return angle(rocker + crank) - angle(rocker - crank)

    with mpmath.workdps(30):
        assert float(closed(mpmath.mpf(AT[name]))) == pytest.approx(swing(**AT), rel=1e-12)
        return float(mpmath.diff(closed, AT[name]))


def test_an_extreme_of_a_coordinate_has_exact_derivatives() -> None:
    found = kinfmu.study(linkage(), TOLERANCES, measures="swing", designs=16, workers=1).nominal
    assert found.measures["swing"].method == "sensitivities"
    assert found.deviations == pytest.approx(DEVIATIONS)
    for name, value in found.measures["swing"].slopes.items():
        assert value == pytest.approx(slope(name), rel=1e-9)
    variances = {name: (slope(name) * DEVIATIONS[name]) ** 2 for name in AT}
    assert found.deviation("swing") == pytest.approx(math.sqrt(sum(variances.values())), rel=1e-9)
    parts = found.contributions("swing")
    assert parts == pytest.approx({name: one / sum(variances.values()) for name, one in variances.items()}, rel=1e-9)
    assert list(parts.values()) == sorted(parts.values(), reverse=True)


def test_differences_agree_with_the_designs() -> None:
    measures = ["swing", "fastest", PeakAcceleration("jolt", of="rocker.phi")]
    found = kinfmu.study(linkage(), TOLERANCES, measures=measures, designs=256, workers=1)
    for name in found.measures:
        first_order, sampled = found.nominal.deviation(name), found.statistics[name].deviation
        assert first_order == pytest.approx(sampled, rel=0.02)
        assert found.nominal.measures[name].value == pytest.approx(found.statistics[name].mean, abs=0.1 * sampled)
    assert found.nominal.measures["jolt"].method == "differences"
    text = str(found)
    assert "first order" in text.splitlines()[2]
    assert "warning" not in text
    assert "(by sensitivities)" in text


def test_a_study_with_other_variations_has_no_first_order_analysis() -> None:
    mixed = {"crank": {"tolerance": 0.1}, "base": {"values": [40, 45]}}
    found = kinfmu.study(linkage(), mixed, measures="swing", designs=4, workers=1)
    assert (len(found), found.nominal.deviations) == (8, {})
    assert "first order" not in str(found)


SLIDER_CRANK = """
name = "press"
parameters = { crank = "1 m", rod = "3 m", offset = "%s m" }
bodies.ground.points = { O = [0, 0], G = [0, "offset"] }
bodies.crank.points = { O = [0, 0], P = ["crank", 0] }
bodies.rod = { points = { P = [0, 0], S = ["rod", 0] }, start = { x = 1, phi = "1 deg" } }
bodies.ram = { points = { S = [0, 0] }, start = { x = 4, y = "offset" } }
joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
joints.P = { type = "revolute", between = ["crank.P", "rod.P"] }
joints.S = { type = "revolute", between = ["rod.S", "ram.S"] }
joints.guide = { type = "translational", between = ["ground.G", "ram.S"] }
drivers.crank = { type = "angle", of = "crank", law = "constant_speed", speed = 1 }
measures.stroke = { type = "range", of = "ram.x" }
"""


@pytest.mark.parametrize(
    ("offset", "tolerance", "warns"),
    [
        (0.0, 0.3, True),  # stroke = sqrt((r + l)^2 - e^2) - sqrt((l - r)^2 - e^2) is even in e
        (0.0, 1e-3, True),
        (0.1, 0.3, True),  # the mean is shifted
        (1.0, 0.03, False),
    ],
)
@pytest.mark.few(1)
def test_a_study_warns_where_first_order_and_samples_disagree(offset: float, tolerance: float, warns: bool) -> None:
    mechanism = toml_file.parse(SLIDER_CRANK % offset)
    found = kinfmu.study(mechanism, {"offset": {"tolerance": tolerance}}, measures="stroke", designs=256, workers=1)

    def stroke(e: float) -> float:
        return math.sqrt(16.0 - e * e) - math.sqrt(4.0 - e * e)

    sampled, first = found.statistics["stroke"], found.nominal.deviation("stroke")
    slope = offset / math.sqrt(4.0 - offset**2) - offset / math.sqrt(16.0 - offset**2)
    assert first == pytest.approx(slope * tolerance / 3.0, abs=1e-9)
    shift = sampled.mean - stroke(offset)
    disagrees = abs(first - sampled.deviation) > 0.3 * sampled.deviation or abs(shift) > 0.3 * sampled.deviation
    assert disagrees is warns
    assert ("warning: stroke is not linear within the tolerances" in str(found)) is warns
