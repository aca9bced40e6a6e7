"""kinfmu check: findings as text, as JSON and as matrices; an invalid mechanism is reported and exits with 1."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.mechanism import toml_text
from tests.cli.conftest import Command


def test_the_check_as_json_has_the_findings_by_name(command: Command) -> None:
    result = command("check", "fourbar", "--json")
    assert result.exit_code == 0
    found = json.loads(result.stdout)
    assert found["mobility"] == 1
    assert found["gruebler"] == 0
    assert [(row["name"], row["implied_by"]) for row in found["redundant"]] == [("AB", ["O", "P", "C", "Q"])]
    assert found["inconsistent"] == []
    assert found["coordinates"] == ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]
    assert found["fixed"] == {"crank.x": 0.0, "crank.y": 0.0, "rocker.x": 1.0, "rocker.y": 0.0}
    assert found["blocks"] == [
        {
            "unknowns": ["coupler.phi", "rocker.phi"],
            "rows": ["Q.x", "Q.y"],
            "determinant": "sin(coupler.phi - rocker.phi)",
        }
    ]
    assert [point["value"] for point in found["singular"]] == pytest.approx([0.0, math.pi], abs=1e-9)
    assert found["problem"] is None
    assert "matrices" not in found


def test_the_check_of_the_fourbar_with_its_matrices_is_the_golden_file(
    command: Command, golden: Callable[[str, str], None]
) -> None:
    golden("fourbar_check.txt", command("check", "fourbar", "--detail", "--matrices").stdout)


@pytest.mark.parametrize("arguments", [("crank_rocker", "--assemblies"), ("excavator", "--detail"), ("engine",)])
def test_checks_of_the_gallery_are_golden_files(
    arguments: tuple[str, ...], command: Command, golden: Callable[[str, str], None]
) -> None:
    golden(f"{arguments[0]}_check.txt", command("check", *arguments).stdout)


def test_over_chooses_the_motion_that_is_measured(command: Command) -> None:
    """A crank that swings by 30 deg to each side: the rocker's swing over the run, and over a whole turn."""
    text = toml_text.text(kinfmu.load("crank_rocker"))
    law = re.search(r'law = "constant_speed"\n(\w+ = .*\n)+', text)
    assert law is not None
    swinging = 'law = "harmonic"\nstart = "90 deg"\namplitude = "30 deg"\nfrequency = "1 Hz"\n'
    measure = '\n[measures.swing]\ntype = "range"\nof = "rocker.phi"\n'
    Path("swing.toml").write_text(text.replace(law[0], swinging) + measure, encoding="utf-8")
    found = {}
    for over in ("run", "turn"):
        measures = json.loads(command("check", "swing.toml", "--over", over, "--json").stdout)["measures"]
        found[over] = measures["values"][0]["value"]
    turn = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=np.linspace(0.0, 2.0 * math.pi, 3601))["rocker.phi"]
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=np.radians(np.linspace(60.0, 120.0, 3601)))[
        "rocker.phi"
    ]
    assert found["turn"] == pytest.approx(np.ptp(turn), rel=1e-6)
    assert found["run"] == pytest.approx(np.ptp(run), rel=1e-6)
    result = command("check", "swing.toml", "--over", "cycle")
    assert result.exit_code == 2
    assert "'cycle' is not one of 'run', 'turn'" in result.stderr


def test_the_matrices_at_sixty_degrees_are_those_of_the_report(command: Command) -> None:
    matrices = json.loads(command("check", "fourbar", "--json", "--matrices").stdout)["matrices"]
    joints, system = matrices[:2]
    assert joints["columns"] == ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]
    assert joints["rows"] == ["P.x", "P.y", "Q.x", "Q.y", "AB.length"]
    s, c = math.sqrt(0.75), 0.5
    expected = [[s, 1, 0, 0, 0], [-c, 0, 1, -1, 0], [0, 1, 0, 0, s], [0, 0, 1, 0, -c], [0, 1, 2 * s, 2 * s, 0]]
    np.testing.assert_allclose(joints["entries"], expected, atol=1e-12)
    assert [matrix["rank"] for matrix in matrices] == [4, 5, 4, 5, 4, 5]
    assert not any(joints["reduced"][4])
    assert system["rows"] == ["P.x", "P.y", "Q.x", "Q.y", "crank.angle"]
    np.testing.assert_allclose(system["reduced"], np.eye(5), atol=1e-12)


def test_assemblies_are_listed_with_the_start_angle_that_chooses_each(command: Command) -> None:
    message = command("check", "double_pendulum", "--assemblies").stdout
    assert "assemblies  2 found at crank = 5 pi/3 (300 deg), distinguished by lower.phi" in message
    assert '              choose it by [bodies.lower] start = { x = -0.491, y = -1, phi = "-172.3 deg" }' in message
    found = json.loads(command("check", "double_pendulum", "--assemblies", "--json").stdout)["assemblies"]
    assert [one["chosen"] for one in found["found"]] == [True, False]
    assert "assemblies" not in json.loads(command("check", "double_pendulum", "--json").stdout)


def test_a_mechanism_at_fault_has_no_assemblies_to_list(
    command: Command, fails: Callable[..., str], fourbar_file: Callable[..., Path]
) -> None:
    path = fourbar_file("length = 1\n", "length = 1.01\n")
    assert "contradicts the other joints" in fails("check", path, "--assemblies")
    assert json.loads(command("check", path, "--assemblies", "--json").stdout)["assemblies"] is None


def test_a_bar_of_a_wrong_length_is_reported_by_name_and_gap(
    command: Command, fails: Callable[..., str], fourbar_file: Callable[..., Path]
) -> None:
    path = fourbar_file("length = 1\n", "length = 1.01\n")
    message = fails("check", path)
    assert message.startswith(f"{path}: [joints.AB] contradicts the other joints: with O, P, C, Q closed, ")
    assert ": gap 0.01 m" in message
    assert "contradicts  AB.length" in command("check", path, "--detail").stdout
    found = json.loads(command("check", path, "--json").stdout)
    assert [(row["name"], round(abs(row["gap"]), 12)) for row in found["inconsistent"]] == [("AB", 0.01)]
    assert f"{path}: {found['problem']}" == message


def test_a_driver_too_many_or_too_few_is_reported(fails: Callable[..., str], fourbar_file: Callable[..., Path]) -> None:
    second = '[drivers.two]\ntype = "angle"\nof = "rocker"\nlaw = "constant_speed"\n[points]'
    path = fourbar_file("[points]", second)
    assert fails("check", path) == f"{path}: [drivers] mobility is 1 but there are 2 drivers (crank, two): remove 1"
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.index("[drivers.crank]")], encoding="utf-8")
    assert fails("check", path) == (
        f"{path}: [drivers] mobility is 1 but there is no driver: "
        "crank, coupler, rocker can still move; add 1 driver, or joints"
    )


_DRIVER = """[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
start = 0
speed = "1 deg/s"
"""
_SWING = '[measures.swing]\ntype = "range"\nof = "rocker.phi"\n'
_PUSH = '[loads.push]\ntype = "force"\nat = "rocker.Q"\nx = 3\ny = 0\n'
_SPRING = '[loads.bad]\ntype = "spring"\n'
_PEAK = '[measures.peak]\ntype = "maximum"\nof = "crank.torque"\n'


@pytest.mark.parametrize(
    ("old", "new", "problem", "left_out", "lines"),
    [
        (
            "[points]",
            f"{_PEAK}[points]",
            "[measures.peak] of: 'crank.torque' is not there: without masses and loads there are no forces; give a "
            "body a mass, such as mass = '1.2 kg'",
            "[measures.peak]",
            ["note     AB is redundant", "crank turns all the way round"],
        ),
        (
            "[points]",
            "[gravity]\nx = 0\n[points]",
            "[gravity] needs the key 'y'; downwards: x = 0, y = '-9.81 m/s2'",
            "[gravity]",
            ["mobility 1 ", "crank turns all the way round"],
        ),
        (
            "[bodies.rocker]",
            "[bodies.rocker]\ninertia = 2.0",
            "[bodies.rocker] inertia needs a mass, such as mass = '1.2 kg'",
            "masses",
            ["mobility 1 ", "crank turns all the way round"],
        ),
        (
            _DRIVER,
            _PEAK,
            "[drivers] there is no driver: [measures.peak] of: 'crank.torque' is the effort of one; add "
            "[drivers.crank] with the keys type, of and law",
            "[measures.peak]",
            [
                "mobility 1 (Gruebler's count 0: it counts redundant rows), no driver",
                "advice   drive crank: nothing drives the mechanism",
            ],
        ),
        (
            _DRIVER,
            '[drivers.crank]\ntype = "angle"\nlaw = "constant_speed"\n',
            "[drivers.crank] needs the key 'of'; keys: of, law",
            "[drivers.crank]",
            ["redundant rows), without [drivers.crank]", "ground, crank, coupler,"],
        ),
        (
            'speed = "1 deg/s"',
            'speed = "60 rmp"',
            "[drivers.crank] speed = '60 rmp': unit 'rmp' must be one of rad/s, rad/min, deg/s, deg/min, rev/s, "
            "rev/min, rpm, Hz; did you mean 'rpm'?",
            "[drivers.crank]",
            ["redundant rows), without [drivers.crank]", "ground, crank, coupler,"],
        ),
        (
            "[points]",
            f"{_SWING}[points]\nrocker = 'coupler.P'",
            "[points] rocker: a body has this name already, so 'rocker.x' would be ambiguous",
            "[points] rocker",
            ["crank turns all the way round", "           swing "],
        ),
        (
            "[points]",
            f"{_SWING}{_PEAK}[points]",
            "[measures.peak] of: 'crank.torque' is not there: without masses and loads there are no forces; give a "
            "body a mass, such as mass = '1.2 kg'",
            "[measures.peak]",
            ["crank turns all the way round", "           swing "],
        ),
        *(
            (
                "[points]",
                f"{_PUSH}{_SWING}{_PEAK}{bad}[points]",
                problem,
                "[loads.bad]",
                [
                    "           swing ",
                    "           peak     3 N m ",
                    "turn of crank at 1 deg/s, without [loads.bad]",
                    "           crank.torque ",
                ],
            )
            for bad, problem in (
                (
                    '[loads.bad]\ntype = "force"\nat = "rocker.Z"\n',
                    "[loads.bad] at: body 'rocker' has no point 'Z'; its points: C, Q",
                ),
                (
                    '[loads.bad]\ntype = "spring"\n',
                    "[loads.bad] needs the key 'between'; keys: between, stiffness, free_length, preload",
                ),
                (
                    f'{_SPRING}between = ["ground.C", "rocker.C"]\nstiffness = 1\nfree_length = 1\n',
                    "[loads.bad] between: ground.C and rocker.C are in the same place at the start, so the force has "
                    "no direction; move a point or the start pose",
                ),
            )
        ),
    ],
)
@pytest.mark.few(2)
def test_what_is_valid_of_a_file_is_reported_before_its_problem(
    old: str,
    new: str,
    problem: str,
    left_out: str,
    lines: list[str],
    command: Command,
    fourbar_file: Callable[..., Path],
) -> None:
    path = fourbar_file(old, new)
    result = command("check", path.name)
    assert result.exit_code == 1
    assert result.stderr == f"kinfmu: mine.toml: {problem}\n"
    report = " ".join(result.stdout.split())
    for line in [*lines, f"note     this report leaves out {left_out}, because", f"problem  {problem}"]:
        assert " ".join(line.split()) in report
    if "[drivers" in left_out:
        assert "advice" not in result.stdout
    found = json.loads(command("check", path.name, "--json").stdout)
    assert (found["mobility"], found["problem"]) == (1, problem)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('"rocker.C"', '"rocker.Z"', "body 'rocker' has no point 'Z'"),
        ('name = "fourbar"', 'name = "fourbar', "not valid TOML"),
        ("[bodies.rocker]", "[rest]", "[rest]: unknown key"),
    ],
)
def test_a_file_whose_bodies_or_joints_are_invalid_has_no_report(
    old: str, new: str, problem: str, command: Command, fourbar_file: Callable[..., Path]
) -> None:
    result = command("check", fourbar_file(old, new).name)
    assert (result.exit_code, result.stdout) == (1, "")
    assert problem in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(("old", "new"), [('speed = "1 deg/s"', 'speed = "60 rmp"'), ("P = [1, 0]", "P = [9, 0]")])
@pytest.mark.few(1)
def test_a_terminal_shows_a_problem_once(old: str, new: str, fourbar_file: Callable[..., Path]) -> None:
    """Of a file that is reported in part, and of a mechanism that does not close."""
    on_a_terminal = pytest.importorskip("tests.cli.test_command_line").on_a_terminal
    path = fourbar_file(old, new)
    shown = on_a_terminal(("-m", "kinfmu", "check", path.name), path.parent, {}).decode()
    assert "kinfmu: " not in shown.partition("\n")[2]
    assert shown.replace("because of the problem", "").count("problem") == 1
    assert "\x1b[1;31m  problem" in shown


def test_a_problem_is_stated_once_where_stdout_and_stderr_are_one_file(fourbar_file: Callable[..., Path]) -> None:
    path = fourbar_file("P = [1, 0]", "P = [9, 0]")
    program = (sys.executable, "-m", "kinfmu", "check", path.name)
    both = subprocess.run(program, cwd=path.parent, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    apart = subprocess.run(program, cwd=path.parent, capture_output=True, text=True)
    assert (both.returncode, apart.returncode) == (1, 1)
    assert both.stdout == apart.stdout
    assert apart.stdout.count("has a gap of 8 m") == 1
    assert apart.stderr.startswith("kinfmu: mine.toml: in the start poses of the file joint P has a gap of 8 m")


def test_the_figure_is_drawn_at_the_pose_asked_for(command: Command, tmp_path: Path) -> None:
    """45 degrees are not 45 rad, and not the start; the same pose in radians gives the same picture."""
    pictures = []
    for k, pose in enumerate(["45deg", repr(math.pi / 4), "60deg"]):
        path = tmp_path / f"{k}.svg"
        result = command("check", "crank_rocker", "--figure", str(path), "--at", pose)
        assert result.exit_code == 0, result.stderr
        pictures.append(path.read_text("utf-8"))
    assert "45 deg" in pictures[0] or "45°" in pictures[0]
    assert pictures[0] == pictures[1]
    assert pictures[0] != pictures[2]
    refused = command("check", "crank_rocker", "--figure", str(tmp_path / "a.svg"), "--at", "45mm")
    assert refused.exit_code != 0
    assert "--at" in refused.stderr
    assert not (tmp_path / "a.svg").exists()


@pytest.mark.parametrize(
    ("text", "kind"),
    [("[targets.a]", "fit"), ("[unknowns]", "fit"), ("[parameters]", "study"), ('sampling = "sobol"', "study")],
)
def test_the_message_on_a_fit_or_study_file_names_its_command(
    text: str, kind: str, tmp_path: Path, fails: Callable[..., str]
) -> None:
    path = tmp_path / "design.toml"
    path.write_text(f'mechanism = "crank_rocker"\n{text}\n')
    assert f"this is a {kind} file, not a mechanism file; the command is 'kinfmu {kind}'" in fails("check", path)


def test_advice_is_printed_after_the_problem(command: Command, fourbar_file: Callable[..., Path]) -> None:
    path = fourbar_file("[points]", '[drivers.two]\ntype = "angle"\nof = "rocker"\nlaw = "constant_speed"\n[points]')
    lines = command("check", path.name).stdout.splitlines()
    levels = [line[2:11].strip() for line in lines if line[2:11].strip()]
    assert levels[levels.index("problem") + 1] == "advice"
    assert any(line.strip() == "# remove [drivers.two]" for line in lines)
