"""Where the follower of a cam is on its program: rises, dwells and returns as values of the driver."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.mechanism.toml_file import parse
from tests.motion.test_breaks import TEXT, tappet

GIVEN = {
    "cam_roller": 'type = "cam_roller"\nbetween = ["cam.O", "stem.roller"]\nstart = 0.05',
    "cam_flat_face": 'type = "cam_flat_face"\nbetween = ["cam.O", "stem.roller"]\nstart = 0.05\nnormal = "90 deg"',
}


def test_the_parts_of_a_lift_are_those_of_its_law() -> None:
    report = kinfmu.check(tappet("cycloidal", "40 deg"))
    assert "program over cam: rise 40 deg to 110 deg, dwell 110 deg to 170 deg, return 170 deg to 280 deg, " in str(
        report
    )
    assert "dwell 280 deg to 40 deg" in str(report)
    (cam,) = report.cams
    assert [part["part"] for part in cam.as_json()["program"]] == ["rise", "dwell", "return", "dwell"]
    at_start = kinfmu.check(tappet("cycloidal", "0 deg"))
    assert "rise 0 deg to 70 deg, dwell 70 deg to 130 deg, return 130 deg to 240 deg, dwell 240 deg to 360 deg" in str(
        at_start
    )


@pytest.mark.parametrize("joint", GIVEN)
def test_the_parts_of_given_cams_are_those_of_the_motion(joint: str) -> None:
    """The law is over the angle in the cam, which goes backwards while the cam turns: the motion shows its parts."""
    old = TEXT[TEXT.index('type = "cam_translating"') : TEXT.index('law = "sequence"')]
    text = TEXT.replace(old, GIVEN[joint] + "\n").replace("LAW", "cycloidal").replace("BEGIN", "10 deg")
    mechanism = parse(text)
    (cam,) = kinfmu.check(mechanism).cams
    assert [part for part, _, _ in cam.program].count("dwell") == 2
    assert {part for part, _, _ in cam.program} == {"rise", "dwell", "return"}
    for (_, _, end), (_, begin, _) in pairwise(cam.program):
        assert end == pytest.approx(begin, abs=1e-9)
    for part, begin, end in cam.program:
        width = (end - begin) % math.tau
        inside = begin + width * np.linspace(0.01, 0.99, 9)
        speed = kinfmu.solve(mechanism, cam_angle=inside)["stem.vy"]
        assert {"rise": (speed > 0.0).all(), "return": (speed < 0.0).all(), "dwell": (speed == 0.0).all()}[part]


def test_a_cam_that_cannot_be_made_has_matrices_and_assemblies(tmp_path: Path) -> None:
    """A roller that reaches the axle is a problem of the profile, not of the motion."""
    text = TEXT.replace("LAW", "cycloidal").replace("BEGIN", "0 deg")
    path = tmp_path / "cut.toml"
    path.write_text(text.replace("offset = 0.05", "offset = 0.05\nroller_radius = 0.06"), encoding="utf-8")
    plain, matrices, assemblies = (
        CliRunner().invoke(main, ["check", str(path), *more]) for more in ([], ["--matrices"], ["--assemblies"])
    )
    for result in (plain, matrices, assemblies):
        assert result.exit_code == 1
        assert "the roller of radius 0.06 m reaches the cam's axle" in result.stderr
    assert "row-reduced" in matrices.stdout
    assert len(assemblies.stdout) > len(plain.stdout)
