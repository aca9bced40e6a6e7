"""Lengths that do not close: the page keeps its last good pose, names row and gap, and comes back on its branch."""

from __future__ import annotations

import base64
import gzip
import json
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.page.engines import NODE, needs_node, text_of

SCRIPT = Path(__file__).with_name("break_lengths.mjs")
DATA = re.compile(r'id="data">([^<]*)<')
GAP = re.compile(r"rows? [\w., ]+ (do(es)? not close: gap [\d.e-]+ (mm|m)|closes? on another branch only)")
BRANCH = re.compile(r"with these values the mechanism moves on another branch beyond \w+ = [\d.-]+°")
SAME = 1e-12  # of the size, and [rad]
JUMP = 0.25  # of the size, and [rad], between neighbouring lengths
NAMES = ["crank_rocker", "fourbar", "jansen_leg"]  # with change points and redundant rows; see also tests/stress

pytestmark = needs_node


def broken(folder: Path, names: Sequence[str]) -> dict[str, list[dict[str, Any]]]:
    """Return what happens when each length of mechanisms is changed until nothing closes, at two driver values."""
    paths = []
    for name in names:
        path = folder / f"{name}.json"
        path.write_bytes(gzip.decompress(base64.b64decode(DATA.findall(text_of(name))[0])))
        paths.append(str(path))
    done = subprocess.run([NODE, SCRIPT], input=json.dumps(paths), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(zip(names, json.loads(done.stdout), strict=True))


def keeps_its_pose_and_recovers(name: str, found: Sequence[dict[str, Any]]) -> None:
    """Test all lengths of a mechanism that break."""
    for one in found:
        where = name, one["name"], one["u"]
        for text in one["texts"]:
            is_triangle = one["name"] in "bdehi" and "not finite" in text  # expressions: angles of triangles
            assert GAP.search(text) or BRANCH.fullmatch(text) or is_triangle, (*where, text)
        assert one["stays"], where
        assert one["recovers"] is not False, where
        assert one["recovers"] <= SAME, where
        assert one["returns"] is not False, where
        assert one["returns"] <= SAME, where
        assert one["largest"] <= JUMP, where


@pytest.mark.long
def test_lengths_that_do_not_close_keep_the_pose_and_name_row_and_gap(tmp_path: Path) -> None:
    for name, found in broken(tmp_path, NAMES).items():
        assert len(found) >= 8, name
        keeps_its_pose_and_recovers(name, found)
        texts = " ".join(text for one in found for text in one["texts"])
        row = {"crank_rocker": "C.x, C.y", "fourbar": "AB.length", "jansen_leg": "knee.x, knee.y"}[name]
        assert row in texts


@pytest.mark.long
def test_the_gap_is_that_of_the_triangle(tmp_path: Path) -> None:
    """With the crank at 0, crank 20, coupler 50 and rocker b: the rocker's pivot is 20 from the pin of the crank."""
    found = broken(tmp_path, ["crank_rocker"])["crank_rocker"]
    one = next(one for one in found if one["name"] == "bodies.rocker.points.Q.x" and one["u"] == 0.0)
    length = 50.0 * one["factors"][2]
    gap = float(GAP.search(one["texts"][1])[0].split(" gap ")[1].split()[0])  # type: ignore[index]
    assert abs(gap - (50.0 - 20.0 - length)) < 1e-3 * gap
