"""The search: the same result whatever the number of workers, refused designs, constraints, files and messages."""

from __future__ import annotations

import math
import re
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.design.fit import (
    FunctionTarget,
    GrashofConstraint,
    MarginConstraint,
    MeasureConstraint,
    MeasureTarget,
    PathTarget,
    PoseTarget,
)
from kinfmu.design.fit.argument import crossings, nearest
from kinfmu.design.fit.equations import Equations
from kinfmu.design.fit.fit import Found, Sameness, distinct
from kinfmu.design.fit.outcome import Optimum
from kinfmu.design.fit.result import result_of
from kinfmu.design.fit.text import angle_notes, parameter_rows
from kinfmu.mechanism import toml_file, toml_text
from kinfmu.mechanism.measures import Range
from kinfmu.mechanism.parameters import Parameter
from tests.design.fit.fourbars import LENGTHS, four_bar

POINTS = [(0.5, 2.3), (0.0, 2.3), (-0.4, 1.9), (-0.4, 1.5)]
PATH = PathTarget(name="curve", of="coupler.X", points=POINTS, step="30 deg", start="120 deg")
BOUNDS = {"crank": (0.5, 2.5), "coupler": (2.0, 5.0), "px": (0.5, 3.0), "py": ("50 cm", 3)}


def _problem(**changes: Any) -> kinfmu.FitProblem:
    given: dict[str, Any] = {"mechanism": four_bar(), "unknowns": BOUNDS, "targets": [PATH], **changes}
    return kinfmu.FitProblem(**given)


@pytest.mark.long
def test_the_result_does_not_depend_on_the_number_of_workers() -> None:
    alone, together = (kinfmu.fit(_problem(), starts=2, workers=n, engine="python") for n in (1, 2))

    assert alone.parameters == together.parameters
    assert alone.optima == together.optima
    assert (alone.tried, alone.refused) == (together.tried, together.refused)


def test_designs_that_do_not_close_are_counted_with_their_reason() -> None:
    result = kinfmu.fit(_problem(unknowns={**BOUNDS, "crank": (0.5, 6.0)}), starts=2, engine="python")

    assert sum(result.refused.values()) > 0
    assert all(isinstance(reason, str) and reason for reason in result.refused)
    assert np.isfinite(result.residuals).all()
    assert result.tried > sum(result.refused.values())
    count, line = sum(result.refused.values()), str(result).splitlines()[1]
    assert line in [f"  {count} of them refused, for example: {reason}" for reason in result.refused]


def test_no_design_that_closes_is_one_line_with_the_reason() -> None:
    with pytest.raises(kinfmu.KinfmuError, match=r"none of 16 designs .* can be assembled"):
        kinfmu.fit(_problem(mechanism=four_bar(), unknowns={"crank": (5.5, 6.0)}), starts=1, engine="python")


@pytest.mark.long
def test_constraints_are_met_exactly_at_the_cost_of_the_targets() -> None:
    free = kinfmu.fit(_problem(), starts=1)
    swing = kinfmu.measures.Range("s", of="rocker.phi")
    bound = kinfmu.fit(
        _problem(
            constraints=[
                GrashofConstraint(name="turns", links=["ground", "crank", "coupler", "rocker"], gap="1 m"),
                MeasureConstraint(name="swing", of=swing, maximum="30 deg"),
                MarginConstraint(name="margin", minimum=0.1),
            ]
        ),
        starts=1,
    )

    lengths = sorted(bound.mechanism.parameters[name].value for name in ("ground", "crank", "coupler", "rocker"))
    run = kinfmu.solve(bound.mechanism, crank_angle=np.linspace(0.0, 2.0 * np.pi, 721))
    assert bound.squares > free.squares
    assert bound.holds
    assert lengths[1] + lengths[2] - lengths[0] - lengths[3] >= 1.0 - 1e-6
    assert kinfmu.measure(run, [swing])["s"].value <= np.radians(30.0) + 1e-6
    assert [one.name for one in bound.constraints] == ["turns", "swing", "margin"]


def test_a_constraint_that_cannot_hold_is_reported() -> None:
    impossible = GrashofConstraint(name="turns", links=["ground", "crank", "coupler", "rocker"], gap=9.0)

    result = kinfmu.fit(_problem(constraints=[impossible]), starts=1, engine="python")

    assert not result.holds
    assert result.constraints[0].violation > 1.0
    text = str(result)
    assert "turns: VIOLATED by" in text
    assert "note: no design that was found meets all constraints: add unknowns" in text  # none is at a bound
    assert not any(one.holds for one in result.optima)
    assert "  violated  " in text.partition("local optima")[2]


def test_violations_have_the_least_squares_where_a_constraint_cannot_hold() -> None:
    links = ["ground", "crank", "coupler", "rocker"]  # 4 m, 0.5 to 2.5 m, 2 to 5 m, 3 m
    impossible = GrashofConstraint(name="turns", links=links, shortest="crank", gap="5 m")

    result = kinfmu.fit(_problem(constraints=[impossible]), starts=1, engine="python")

    # violations with each link as the longest at crank = 0.5 m: b - 1.5 m, 6.5 m - b, 4.5 m - b
    assert result.parameters["coupler"] == pytest.approx(25.0 / 6.0, abs=1e-4)
    assert result.constraints[0].violation == pytest.approx(8.0 / 3.0, abs=1e-4)
    assert "widen the bounds of crank, loosen the limit of turns, or raise --starts" in str(result)


ARCS = {
    "cup": [(0, 30), (6, 24), (12, 22), (18, 24), (25, 32)],
    "five": [(0, 20), (6, 26), (12, 28), (18, 26), (25, 18)],
}


@pytest.mark.long
@pytest.mark.parametrize(
    ("points", "limit", "weight"),
    [("cup", 40.0, 100.0), ("cup", 30.0, 100.0), ("five", 30.0, 100.0), ("five", 30.0, 1e-3)],
)
def test_a_limit_in_degrees_holds_for_a_path_in_millimetres(points: str, limit: float, weight: float) -> None:
    page = Path("docs/fitting.md").read_text(encoding="utf-8")
    mechanism = toml_file.parse(page.split("```toml\n")[1].partition("```")[0], "guide.toml")
    bounds = {
        "ground": (25, 60),
        "crank": (5, 20),
        "coupler": (20, 60),
        "rocker": (20, 60),
        "px": (5, 40),
        "py": (-5, 40),
    }
    lines = ("coupler.P", "coupler.Q"), ("rocker.C", "rocker.Q")
    deviation = kinfmu.measures.TransmissionAngle("mu", *lines)
    good = MeasureConstraint(name="good", of=deviation, maximum=f"{limit} deg", weight=weight)
    links = GrashofConstraint(
        name="turns", links=["ground", "crank", "coupler", "rocker"], shortest="crank", gap="2 mm", weight=weight
    )
    target = PathTarget(name="arch", of="coupler.pen", points=ARCS[points])
    result = kinfmu.fit(kinfmu.FitProblem(mechanism, bounds, [target], [links, good]), starts=2)

    assert result.holds, result
    turn = kinfmu.solve(result.mechanism, crank_angle=np.linspace(0.0, 2.0 * np.pi, 721))
    assert kinfmu.measure(turn, [deviation])["mu"].value <= np.radians(limit) + 2e-6
    assert [one.name for one in result.constraints] == ["turns", "good"]
    assert "note: no design" not in str(result)


def test_the_first_line_and_the_first_optimum_have_the_same_sum_of_squares() -> None:
    mechanism = four_bar()
    at = np.radians([10.0, 50.0, 90.0, 130.0])
    traced = kinfmu.solve(mechanism, crank_angle=at)
    points = list(zip(at, traced["rocker.phi"], strict=True))
    target = FunctionTarget(name="f", of="rocker.phi", points=points)
    result = kinfmu.fit(_problem(unknowns={"crank": (0.5, 2.5), "coupler": (2.0, 5.0)}, targets=[target]), starts=2)
    text = str(result)
    first = re.search(r"sum of squares (\S+) ", text)
    row = re.search(r"sum of squares  .*\n +1 +(\S+) ", text)
    assert first is not None
    assert row is not None
    assert first[1] == row[1]
    assert float(first[1]) < 1e-24


@pytest.mark.long
def test_a_file_gives_what_python_gives(tmp_path: Path) -> None:
    (tmp_path / "bar.toml").write_text(toml_text.text(four_bar()), encoding="utf-8")
    (tmp_path / "points.csv").write_text("x [m], y [cm]\n0.5, 230\n0.0, 230\n-0.4, 190\n-0.4, 150\n", encoding="utf-8")
    (tmp_path / "fit.toml").write_text(
        'mechanism = "bar.toml"\n[unknowns]\ncrank = [0.5, 2.5]\ncoupler = [2, 5]\npx = [0.5, 3]\npy = ["50 cm", 3]\n'
        '[targets.curve]\ntype = "path"\nof = "coupler.X"\nfile = "points.csv"\nstep = "30 deg"\nstart = "120 deg"\n',
        encoding="utf-8",
    )
    out, figure = tmp_path / "out.toml", tmp_path / "out.svg"

    done = CliRunner().invoke(
        main, ["fit", str(tmp_path / "fit.toml"), "-o", str(out), "--figure", str(figure), "--starts", "1",
               "--workers", "1"],
    )  # fmt: skip

    assert done.exit_code == 0, done.output
    expected = kinfmu.fit(_problem(), starts=1)
    saved = kinfmu.load(str(out))
    assert {name: saved.parameters[name].value for name in BOUNDS} == pytest.approx(dict(expected.parameters))
    assert "curve: wanted" in figure.read_text(encoding="utf-8")
    page = expected._repr_html_()
    assert page is not None
    assert all(f">{name}<" in page for name in (*BOUNDS, "curve"))
    assert page.count("<img ") == 1
    assert "curve: wanted" in str(expected._repr_svg_())


@pytest.mark.long
def test_starts_and_offsets_are_listed_with_their_units() -> None:
    points = [("0 deg", 0.0), ("30 deg", 0.1), ("60 deg", 0.2)]
    angle = FunctionTarget(name="f", of="rocker.phi", points=points, start=(1, 2), offset=(1, 3))
    length = FunctionTarget(name="g", of="coupler.y", points=points, over="rocker.phi", start=(1, 3), offset=(-1, 1))
    rows = {row[0]: row[2] for row in parameter_rows(kinfmu.fit(_problem(targets=[angle, length]), starts=1))}
    unit = four_bar().length_unit
    units = {"f.start": "rad", "f.offset": "rad", "g.start": "rad", "g.offset": unit}
    assert {name: rows[name] for name in units} == units


@pytest.mark.long
def test_the_report_shows_numbers_in_the_units_in_which_they_are_written() -> None:
    written = four_bar()
    tilted = kinfmu.Mechanism(
        **{field.name: getattr(written, field.name) for field in fields(written) if field.init}
        | {"parameters": {**written.parameters, "tilt": "10 deg", "spin": 0.2}}
    )
    points = [("0 deg", "5 deg"), ("30 deg", 0.1), ("60 deg", "10 deg")]
    swing = kinfmu.measures.Range("s", of="rocker.phi")
    result = kinfmu.fit(
        kinfmu.FitProblem(
            tilted,
            {"crank": ("50 cm", "250 cm"), "coupler": (2.0, 5.0), "tilt": (0.0, np.pi), "spin": (0.0, 1.0)},
            [
                FunctionTarget(name="f", of="rocker.phi", points=points, start=("60 deg", 2), offset=("90 deg", 3)),
                MeasureTarget(name="s", of=swing, value="50 deg", weight=1e-3),
            ],
            [MeasureConstraint(name="small", of=swing, maximum="1 deg", weight=1e-9)],
        ),
        starts=1,
    )
    text, found = str(result), result.parameters
    assert {row[0]: row[2:4] for row in parameter_rows(result)} == {
        "crank": ("cm", "[50, 250]"),
        "coupler": ("m", "[2, 5]"),
        "tilt": ("deg", "[0, 180]"),
        "spin": ("", "[0, 1]"),
        "f.start": ("deg", "[60, 114.592]"),
        "f.offset": ("deg", "[90, 171.887]"),
    }
    values = {row[0]: float(row[1]) for row in parameter_rows(result)}
    assert values["crank"] == pytest.approx(100.0 * found["crank"], rel=1e-9)
    assert values["tilt"] == pytest.approx(np.degrees(found["tilt"]), rel=1e-9)
    function, measure = result.errors
    assert f"f (function): rms error {np.degrees(function.rms):.6g} deg" in text
    assert "rocker.phi [deg], wanted" in text
    for k in range(3):
        assert f" {np.degrees(function.wanted[k, 0]):.6g} " in text
    assert f"s (measure): {np.degrees(measure.reached[0, 0]):.9g} deg, wanted 50 deg" in text
    assert f"small: VIOLATED by {np.degrees(result.constraints[0].violation):.3g} deg; range = " in text
    assert "deg, at most 1 deg" in text
    optima = next(line for line in text.splitlines() if "sum of squares  " in line)
    assert re.split(" {2,}", optima.strip())[-6:] == [
        "crank [cm]", "coupler [m]", "tilt [deg]", "spin", "f.start [deg]", "f.offset [deg]",
    ]  # fmt: skip
    assert function.units == ("rad",)  # numbers of the result keep the units used inside
    assert f">{np.degrees(function.rms):.6g}<" in str(result._repr_html_())


def test_errors_of_poses_are_lengths_in_the_report_too() -> None:
    poses = [(1.0, 0.5, "30 deg"), (0.8, 0.9, "35 deg")]
    target = PoseTarget(name="part", of="coupler", poses=poses, length="50 cm", step="20 deg", start="60 deg")
    result = kinfmu.fit(_problem(targets=[target]), starts=1, engine="python")
    (found,) = result.errors
    sizes = np.sqrt(found.errors**2 @ [1.0, 1.0, 0.25])
    np.testing.assert_allclose(found.sizes, sizes, rtol=1e-12)
    assert found.largest == found.sizes.max()
    lines = str(result).splitlines()
    (k,) = (k for k, line in enumerate(lines) if line.endswith("error [m]"))
    assert [line.split()[-1] for line in lines[k + 1 : k + 3]] == [f"{size:.3g}" for size in sizes]


def test_the_first_line_names_the_unit_of_the_errors() -> None:
    points = [("120 deg", "60 deg"), ("150 deg", "63 deg"), ("180 deg", "70 deg")]
    target = FunctionTarget(name="f", of="rocker.phi", points=points, offset=("0 deg", "90 deg"))
    result = kinfmu.fit(_problem(unknowns={"crank": (0.5, 2.5)}, targets=[target]), starts=1, engine="python")
    first = str(result).splitlines()[0]
    assert (
        f"sum of squares {result.squares:.9g} (errors in rad), rms residual {np.degrees(result.rms):.6g} deg, " in first
    )
    path = str(kinfmu.fit(_problem(targets=[PATH, target]), starts=1, engine="python")).splitlines()[0]
    assert " (errors in m, rad), rms residual " in path


def test_a_design_that_does_not_reach_a_point_is_refused_with_angle_and_status() -> None:
    result = kinfmu.fit(_problem(unknowns={**BOUNDS, "crank": (0.5, 6.0)}), starts=2, engine="python")
    assert any(re.search(r"crank\w* = \d+ deg \(status \d: [a-z ]+\)", reason) for reason in result.refused), (
        result.refused
    )


def test_ends_of_searches_at_one_optimum_are_one() -> None:
    z = np.array([1.0, 0.5])
    totals = {0.0: 2.554e-4, 0.0009: 2.557e-4, 0.002: 2.559e-4}
    ends = [(Found(z - [shift, 0.0], total, 1), 1) for shift, total in totals.items()]
    same = Sameness(np.full(2, np.inf))
    assert [(one.total, count) for one, count in distinct(ends, same)] == [(2.554e-4, 2), (2.559e-4, 1)]
    assert len(distinct([(Found(z, 1.0, 1), 1), (Found(z, 1.1, 1), 1)], same)) == 2


def test_ends_whole_turns_of_an_angle_apart_are_one_optimum() -> None:
    same = Sameness(np.array([np.inf, 0.25]))
    ends = [(Found(np.array([0.3, part]), total, 1), 1) for part, total in ((0.1, 1e-9), (0.6004, 2e-9), (0.2, 3e-9))]
    alone = [(Found(np.array([0.1, 0.3]), 1.0, 1), 1), (Found(np.array([0.35, 0.3]), 1.0, 1), 1)]
    assert [count for _, count in distinct(ends, same._replace(typical=1e-2))] == [2, 1]
    assert len(distinct(ends, same)) == 3  # the sums differ by their double
    assert len(distinct(alone, same)) == 2  # a length has no turns


def test_a_fit_lists_an_optimum_once_for_all_turns_of_its_angles() -> None:
    mechanism = four_bar()
    turn = np.radians(np.arange(0, 360, 30))
    swing = kinfmu.solve(mechanism, crank_angle=turn)["rocker.phi"]
    target = FunctionTarget(
        name="f", of="rocker.phi", points=list(zip(turn, swing, strict=True)), offset=("-720 deg", "720 deg")
    )
    result = kinfmu.fit(_problem(unknowns={"crank": (0.5, 2.5), "coupler": (2.0, 5.0)}, targets=[target]), starts=6)
    turns = result.parameters["f.offset"] / (2.0 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    exact = [one for one in result.optima if one.total < 1e-12]
    assert [one.searches for one in exact] == [6], result.optima


def test_a_fitted_mechanism_is_written_in_the_units_of_its_file(tmp_path: Path) -> None:
    text = toml_text.text(four_bar(), as_written=True).replace('px = "1.7 m"', 'px = "170 cm"\ntilt = "20 deg"')
    text = text.replace("[1.7, 1.2]", '["px*cos(tilt)", "py"]')
    (tmp_path / "bar.toml").write_text(text.replace("speed = 1.0", 'speed = "30 rpm"'), encoding="utf-8")
    bar = kinfmu.load(tmp_path / "bar.toml")
    unknowns = {"px": (0.5, 3.0), "tilt": (0.0, 1.0), "crank.speed": ("20 rpm", "40 rpm")}
    result = kinfmu.fit(
        kinfmu.FitProblem(bar, unknowns, [replace(PATH, step="0.1 s", start="0.1 s")], over="time"), starts=1
    )
    kinfmu.save(result.mechanism, tmp_path / "out.toml")

    lines = dict(line.split(" = ", 1) for line in (tmp_path / "out.toml").read_text().splitlines() if " = " in line)
    assert (lines["crank"], lines["px"][-4:], lines["tilt"][-5:]) == ('"1.0 m"', ' cm"', ' deg"')
    assert lines["speed"].endswith(' rpm"')
    written = (tmp_path / "out.toml").read_text()
    assert written.count("phi = ") == written.count(' deg" }') == 3
    assert 'start = "60 deg"' in written
    again = kinfmu.load(tmp_path / "out.toml")
    assert again == result.mechanism
    assert again.law_constants[1].value == result.parameters["crank.speed"]
    assert again.parameters["tilt"].value == result.parameters["tilt"]


def test_an_unknown_without_effect_is_noted() -> None:
    written = four_bar()
    mechanism = replace(written, parameters={**written.parameters, "spare": Parameter(1.0)})
    found = kinfmu.fit(_problem(mechanism=mechanism, unknowns={**BOUNDS, "spare": (0.0, 2.0)}), starts=1)
    assert found.idle == ("spare",)
    assert "note: spare has no effect on the targets: any value between its bounds is as good" in str(found)
    assert kinfmu.fit(_problem(), starts=1).idle == ()


@pytest.mark.parametrize(
    ("points", "offset", "noted"),
    [
        ([(90, 0), (130, 12)], (90, 150), ["points, x: 90 rad", "points, y: 12 rad is 687.549 deg", "offset: 90 rad"]),
        ([(20.0, 0.1), (21.0, 0.2)], (0.0, 6.0), []),  # values of a driver may be some turns
        ([("90 deg", "0 deg"), ("130 deg", "12 deg")], ("90 deg", "150 deg"), []),
    ],
)
def test_bare_angles_of_a_function_that_are_probably_degrees_are_noted(
    points: Any, offset: Any, noted: list[str]
) -> None:
    target = FunctionTarget(name="f", of="rocker.phi", points=points, offset=offset)
    lines = angle_notes(_problem(targets=[target]))
    assert len(lines) == len(noted)
    for line, text in zip(lines, noted, strict=True):
        assert line.startswith(f"[targets.f] {text}")
        assert line.endswith(' deg" for degrees')


@pytest.mark.long
def test_bare_angles_of_measures_and_poses_that_are_probably_degrees_are_noted() -> None:
    swing = Range(name="swing", of="rocker.phi")
    targets = [
        MeasureTarget(name="s", of=swing, value=45),
        PoseTarget(name="p", of="coupler", poses=[(1.0, 0.5, 0.5), (0.8, 0.9, 35)], length="50 cm", step="20 deg"),
    ]
    constraints = [MeasureConstraint(name="c", of=swing, minimum="20 deg", maximum=80)]
    found = angle_notes(_problem(targets=targets, constraints=constraints))
    assert [line.partition(":")[0] for line in found] == [
        "[targets.p] poses, phi",
        "[targets.s] value",
        "[constraints.c] maximum",
    ]
    assert found[1] == (
        "[targets.s] value: 45 rad is 2578.31 deg, more than a turn: a bare number is in radians; "
        'write "45 deg" for degrees'
    )
    result = kinfmu.fit(_problem(targets=[replace(targets[0], value=0.7)], constraints=[]), starts=1)
    assert "note: [targets" not in str(result)
    result = kinfmu.fit(_problem(targets=targets[:1]), starts=1)
    assert f"  note: {found[1]}" in str(result).splitlines()


def test_the_files_of_a_fit_are_never_replaced_by_its_result(tmp_path: Path) -> None:
    (tmp_path / "linkage.toml").write_text(toml_text.text(four_bar()), encoding="utf-8")
    path = tmp_path / "fit.toml"
    path.write_text('mechanism = "linkage.toml"\nunknowns = { crank = [1, 2] }\n', encoding="utf-8")
    for name, what in (("linkage.toml", "its mechanism"), ("fit.toml", "the fit file")):
        before = (tmp_path / name).read_bytes()
        done = CliRunner().invoke(main, ["fit", str(path), "-o", str(tmp_path / name)])
        assert done.exit_code == 2
        assert f"would replace {what}; choose another name" in done.output
        assert (tmp_path / name).read_bytes() == before
    (tmp_path / "linkage.toml").unlink()
    (tmp_path / "other.toml").write_text("kept", encoding="utf-8")
    done = CliRunner().invoke(main, ["fit", str(path), "-o", str(tmp_path / "other.toml")])
    assert done.exit_code == 1
    assert "linkage.toml" in done.output
    assert len(done.output.splitlines()) == 1
    assert (tmp_path / "other.toml").read_text(encoding="utf-8") == "kept"
    with pytest.raises(kinfmu.KinfmuError, match="fit needs a FitProblem or the path of a fit file, not int"):
        kinfmu.fit(5)  # type: ignore[arg-type]


def _path(**keys: Any) -> dict[str, Any]:
    return {"targets": [PathTarget(**{"name": "t", "of": "coupler.X", "points": POINTS, **keys})]}


def _poses(**keys: Any) -> dict[str, Any]:
    return {"targets": [PoseTarget(**{"name": "p", "of": "rocker", "poses": [(0, 0, 0)], "length": 1.0, **keys})]}


def _function(**keys: Any) -> dict[str, Any]:
    return {"targets": [FunctionTarget(**{"name": "f", "of": "rocker.phi", "points": [(0, 1)], **keys})]}


def _swing(minimum: str, maximum: str) -> MeasureConstraint:
    return MeasureConstraint(name="swing", of=Range("swing", of="rocker.phi"), minimum=minimum, maximum=maximum)


def _grashof(*links: str) -> dict[str, Any]:
    return {"constraints": [GrashofConstraint(name="g", links=links)]}


NO_NAMES: list[Any] = [["coupler.X"], {"a": 1}, 3, 1.5, True, None]
CASES: list[tuple[dict[str, Any], str]] = [
    ({"unknowns": {"cranck": (0, 1)}}, r"\[unknowns\] .*'cranck'; did you mean 'crank'"),
    ({"unknowns": {"crank": (2, 1)}}, r"\[unknowns\] crank = \(2, 1\): the low bound must be below"),
    ({"unknowns": {"crank": 1}}, r"\[unknowns\] crank = 1 must be bounds \[low, high\]"),
    ({"unknowns": {"crank": ("1 deg", 2)}}, r"\[unknowns\] crank = '1 deg': unit 'deg' must be one of"),
    ({"unknowns": {}}, "needs unknowns"),
    ({"unknowns": {"crank.speed": (1, 2)}}, r"crank.speed is a law constant, .* over = 'time'"),
    ({"targets": []}, "needs targets"),
    ({"targets": [PATH, PATH]}, "two targets or constraints have the name 'curve'"),
    (_path(of="coupler.Z"), "'coupler.Z' is not a point; did you mean"),
    *((_path(of=name), "of = .* must be a name") for name in NO_NAMES),
    *((_poses(of=name), "must be a name") for name in NO_NAMES),
    *((_function(of=name), "must be a name") for name in NO_NAMES),
    *((_function(over=name), "over = .* must be a name") for name in NO_NAMES[:-1]),
    *(
        ({"targets": [MeasureTarget(name="m", of=name, value=1)]}, r"\[targets.m\] of = .* must be a name")
        for name in NO_NAMES
    ),
    (_path(points=[(1, 2, 3)]), r"list \[\[x, y\], ...\]; number 1 is"),
    (_path(at=[1]), "at must be a list of 4 values of crank"),
    (_path(start=1), "start needs 'at' or 'step'"),
    (_path(step="0 deg"), "step = '0 deg' must not be 0"),
    ({"constraints": [GrashofConstraint(name="g", links=[*LENGTHS][:4], gap=-1)]}, "gap = -1 must be 0 or more"),
    ({"constraints": [MarginConstraint(name="m", minimum=2)]}, "minimum = 2 must be between 0 and 1"),
    (
        {"constraints": [_swing("70 deg", "50 deg")]},
        r"\[constraints.swing\] minimum = '70 deg' is above maximum = '50 deg': no value is valid",
    ),
    (_path(weight=-1.0), "weights must be 0 or more"),
    (_poses(of="rokker"), "moving body; did you mean 'rocker'"),
    (_poses(length=0), "length = 0 must be positive"),
    (_function(of="rocker.ph"), "did you mean 'rocker.phi'"),
    ({"targets": [MeasureTarget(name="m", of="stroke", value=1)]}, "'stroke' is not a measure"),
    (_grashof("crank"), "must be four lengths"),
    (_grashof("crank", "coupler", "rocker", "groun"), "did you mean 'ground'"),
    ({"over": "tme"}, "over = 'tme' must be 'driver' or 'time'"),
]


@pytest.mark.parametrize(("changes", "message"), CASES, ids=[message for _, message in CASES])
def test_messages_name_the_place_and_what_would_be_valid(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(kinfmu.KinfmuError, match=message) as caught:
        _problem(**changes)
    assert "\n" not in str(caught.value)


TARGET = 'mechanism = "crank_rocker"\n[targets.t]\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[bodies.crank]", "fit.toml: this is a mechanism file; a fit file names it"),
        ('mechanism = "fourbar"\n[parameters]', "this is a study file, not a fit file; the command is 'kinfmu study'"),
        ("targetz = 1", "targetz: unknown key; did you mean 'targets'"),
        ("", "mechanism is missing"),
        ('mechanism = "fourba"', "did you mean 'fourbar'"),
        ('mechanism = "none.toml"', "none.toml: cannot be read"),
        (TARGET + 'type = "pth"', r"\[targets.t\] type = 'pth' is not known; did you mean 'path'"),
        (TARGET + 'type = "path"\nof_ = 1', r"\[targets.t\] of_: unknown key; did you mean 'of'"),
        (TARGET + 'type = "path"\nof = "a"', "needs the key 'points' or 'file'"),
    ],
)
def test_messages_about_files(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "fit.toml"
    path.write_text(text, encoding="utf-8")

    with pytest.raises(kinfmu.KinfmuError, match=message) as caught:
        kinfmu.design.read_problem(path)
    assert str(caught.value).startswith(str(path))

    done = CliRunner().invoke(main, ["fit", str(path)])
    assert done.exit_code == 1
    assert done.output.count("\n") == 1


def test_law_constants_are_unknowns_over_time() -> None:
    times = np.array([0.1, 0.4, 0.9])
    speed = 1.7
    run = kinfmu.solve(four_bar(), crank_angle=np.pi / 3.0 + speed * times)
    points = np.column_stack([times, run["rocker.phi"]])
    target = FunctionTarget(name="f", of="rocker.phi", points=points)

    result = kinfmu.fit(
        _problem(unknowns={"crank.speed": (0.5, 3.0)}, targets=[target], over="time"), starts=1, engine="python"
    )

    assert result.parameters["crank.speed"] == pytest.approx(speed, abs=1e-9)
    assert LENGTHS["crank"] == result.mechanism.parameters["crank"].value


@pytest.mark.long
def test_unknowns_that_the_targets_leave_free_together_are_noted() -> None:
    swing = MeasureTarget(name="swing", of=Range("swing", "rocker.phi"), value="40 deg")
    unknowns = {"crank": (0.5, 1.5), "coupler": (2.0, 5.0)}
    found = kinfmu.fit(_problem(unknowns=unknowns, targets=[swing]), starts=1)
    assert found.squares < 1e-18
    assert found.undetermined == ("crank", "coupler")
    assert "note: the targets do not determine crank, coupler: others fit as well" in str(found)
    alone = kinfmu.fit(_problem(unknowns={"crank": (0.5, 1.5)}, targets=[swing]), starts=1)
    assert alone.squares < 1e-18
    assert alone.undetermined == ()
    assert kinfmu.fit(_problem(), starts=1).undetermined == ()


def test_lengths_that_a_function_of_angles_leaves_free_are_noted_with_exact_derivatives() -> None:
    angles = np.radians([80.0, 120.0, 160.0, 220.0, 300.0])
    run = kinfmu.solve(four_bar(), crank_angle=angles)
    points = list(zip(angles.tolist(), run["rocker.phi"].tolist(), strict=True))
    target = FunctionTarget(name="swing", of="rocker.phi", points=points)
    lengths = {name: (0.7 * LENGTHS[name], 1.5 * LENGTHS[name]) for name in ("ground", "crank", "coupler", "rocker")}
    whole = kinfmu.fit(_problem(unknowns=lengths, targets=[target]), starts=2)
    assert whole.squares < 1e-18
    assert set(whole.undetermined) == {*lengths}
    del lengths["ground"]
    assert kinfmu.fit(_problem(unknowns=lengths, targets=[target]), starts=2).undetermined == ()


AT = np.radians(np.arange(67.0, 427.0, 20.0))  # none at the change point, 180 deg


def _at_a_change_point() -> kinfmu.FitProblem:
    """A fit whose best design is nearly at its bound, where crank + ground = coupler + rocker."""
    mechanism = four_bar(ground=3.8, coupler=3.0, rocker=2.0)
    wanted = kinfmu.solve(mechanism, crank_angle=AT, parameters={"ground": 3.999})["rocker.phi"]
    far = kinfmu.solve(mechanism, crank_angle=AT, parameters={"ground": 3.7})["rocker.phi"]
    target = FunctionTarget(name="f", of="rocker.phi", points=np.column_stack([AT, wanted + 0.3 * (wanted - far)]))
    return kinfmu.FitProblem(mechanism, {"ground": (3.5, 4.0), "rocker": (1.7, 2.0)}, [target])


@pytest.mark.long
def test_an_optimum_at_a_change_point_is_reported_with_the_sums_of_the_search_and_of_its_file() -> None:
    result = kinfmu.fit(_at_a_change_point(), starts=2, engine="python")
    found = re.search(r"its sum of squares is (\S+), that of the search (\S+)$", result.note)
    assert found is not None, result.note
    assert float(found[1]) == pytest.approx(result.squares, rel=1e-5)
    assert float(found[2]) < 1e-2 * result.squares
    _, rocker = np.array(result.problem.targets[0].points).T
    own = kinfmu.solve(result.mechanism, crank_angle=AT)["rocker.phi"]  # what a user of the file sees
    turns = math.tau * round(float((own - rocker).mean()) / math.tau)
    assert result.squares == pytest.approx(float(((own - rocker - turns) ** 2).sum()), rel=1e-6)
    assert result.optima[0].squares == result.squares


def test_another_optimum_is_chosen_where_a_file_does_not_give_the_fitted_motion() -> None:
    problem = _at_a_change_point()
    equations = Equations(problem)
    optima = []
    for ground in (4.0 - 4e-12, 3.95, 3.9):
        found, _ = equations.at(np.array([(ground - 3.5) / 0.5, 1.0]))
        optima.append(Optimum({"ground": ground, "rocker": 2.0}, found.squares, found.total, 1, holds=True))
    assert optima[0].squares < optima[1].squares < optima[2].squares
    result = result_of(equations, optima, tried=3, refused={})
    assert result.parameters["ground"] == 3.95
    assert result.squares == pytest.approx(optima[1].squares, rel=1e-9)
    assert result.note.startswith(
        "the optimum at ground = 4, rocker = 2 is not chosen: the mechanism file assembles in"
    )
    assert result.note.endswith(f"that of the search {optima[0].squares:.6g}")
    assert [one.parameters["ground"] for one in result.optima] == [3.95, 3.9, 4.0 - 4e-12]
    assert result.optima[2].squares > 100.0 * optima[0].squares  # that of its file


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.parametrize("side", [-1.0, 0.0, 2.0])
@pytest.mark.few(1)
def test_the_nearest_point_of_a_path_is_converged_close_to_a_dead_centre(side: float, engine: str) -> None:
    """Points at a distance from the path along its normal have their foot where they were set off."""
    model = kinfmu.compile(kinfmu.load("triple_rocker"), engine=engine)
    places = [[str(name) for name in model.outputs].index(name) for name in ("tracer.x", "tracer.y")]
    limits = kinfmu.check(model.mechanism).range
    assert limits is not None
    assert limits.low is not None
    assert limits.high is not None

    def curve(u: Any) -> Any:
        run = model.solve(left_angle=u)
        return tuple(table[:, places] for table in (run.values, run.rates, run.accelerations))

    for near in (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        feet = np.array([limits.low + near, 0.3, limits.high - near])
        p, v, _ = curve(feet)
        normal = np.column_stack([-v[:, 1], v[:, 0]]) / np.hypot(*v.T)[:, None]
        ends = (limits.low, limits.high)
        found = nearest(np.linspace(*ends, 181), curve, p + side * normal, np.full(2, np.inf), ends)
        np.testing.assert_allclose(curve(found)[0], p, rtol=0, atol=1e-9)
        level = crossings(np.linspace(*ends, 181), lambda u: tuple(one[:, :1] for one in curve(u)), p[1:2, 0])
        assert curve(level)[0][0, 0] == pytest.approx(p[1, 0], abs=1e-11)
