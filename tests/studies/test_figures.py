"""Pictures of studies: each kind shows its names, and equal results give equal bytes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from kinfmu.errors import FigureError, StudyError
from kinfmu.studies.figure import picture_of
from tests.studies.linkage import linkage

KINDS: dict[str, dict[str, Any]] = {
    "response": {"crank": {"from": 10, "to": 25, "count": 5}},
    "contours": {"crank": {"from": 10, "to": 30, "count": 4}, "base": {"values": [60, 30, 40]}},
    "scatter": {"crank": {"from": 10, "to": 25}, "base": {"tolerance": 1}},
    "contributions": {"crank": {"tolerance": 0.1}, "base": {"tolerance": 0.1}},
}
SHOWN = {
    "response": ["crank [mm]", "swing [rad]", "fastest [rad/s]"],
    "contours": ["crank [mm]", "base [mm]", "swing [rad]", "fastest [rad/s]"],
    "scatter": ["crank [mm]", "base [mm]", "swing [rad]", "fastest [rad/s]", "hoeken: 16 designs"],
    "contributions": ["crank", "base", "part of the variance [%]", "hoeken: tolerances"],
}


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_names_what_it_shows_and_is_the_same_every_time(kind: str, tmp_path: Path) -> None:
    found = kinfmu.study(linkage(), KINDS[kind], designs=16, workers=1)
    assert picture_of(found) == kind
    path = tmp_path / "figure.svg"
    found.figure(path)
    first = path.read_text()
    texts = re.findall(r"<text [^>]*>([^<]*)</text>", first)
    assert set(SHOWN[kind]) <= set(texts)
    found.figure(path)
    assert path.read_text() == first
    found.figure(tmp_path / "figure.png", ("swing",))
    assert (tmp_path / "figure.png").read_bytes()[:4] == b"\x89PNG"


def test_contributions_are_written_at_their_bars(tmp_path: Path) -> None:
    found = kinfmu.study(linkage(), KINDS["contributions"], measures="swing", designs=4, workers=1)
    found.figure(tmp_path / "figure.svg")
    text = (tmp_path / "figure.svg").read_text()
    for part in found.nominal.contributions("swing").values():
        assert f">{100.0 * part:.1f} %<" in text


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    found = kinfmu.study(linkage(), KINDS["response"], workers=1)
    with pytest.raises(StudyError, match="no measure 'swin'; did you mean 'swing'"):
        found.figure(tmp_path / "figure.svg", ("swin",))
    with pytest.raises(FigureError, match="not a known format of figures"):
        found.figure(tmp_path / "figure.gif")
