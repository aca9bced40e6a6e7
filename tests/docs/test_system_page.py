"""docs/system.md: its files, commands and Python run, in Ecos and libcosim too, and print what the page shows."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path

import pytest
from fmpy.ssp.ssd import read_ssd

from kinfmu.log import read
from tests.docs.follow import SHOWN, accept, follow, page_text

NAME = "system.md"


@pytest.mark.long
def test_the_page_runs_in_ecos_and_libcosim_too_and_prints_what_it_shows(
    request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    followed = follow(NAME, tmp_path)
    before, in_hosts = page_text(NAME).split("## 5.")
    accept(NAME, f"{followed.commented(before)}## 5.{in_hosts}", request)
    assert (tmp_path / "machine.csv").read_text(encoding="utf-8").startswith("time,rocker.phi,slide.block.x")
    assert {one.name for one in read_ssd(tmp_path / "machine.ssp", validate=True).system.elements} == {
        "feeder",
        "slide",
    }
    same, longer = (read(tmp_path / name) for name in ("machine.mcap", "longer.mcap"))
    assert abs(same["rocker.phi"] - longer["rocker.phi"]).max() > 0.01
    if find_spec("ecospy") and find_spec("libcosimpy"):
        comments = [comment for _, comment in SHOWN.findall(in_hosts)]
        printed = [line for line in followed.printed_in_host.splitlines() if re.fullmatch(r"[\d.]+ mm", line)]
        assert printed == comments
        ((late, last),) = re.findall(r"# ([\d.]+ mm), ([\d.]+ mm)$", before, re.MULTILINE)
        assert comments == [last, late]  # Ecos, libcosim
