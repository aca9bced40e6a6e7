"""docs/cams.md: its file, commands and Python run, and print what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.blocks import DOCS
from tests.docs.follow import accept, follow, page_text
from tests.draw.picture import differences, picture


def test_the_page_runs_and_prints_what_it_shows(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    followed = follow("cams.md", tmp_path)
    report, *_, of_dxf = followed.outputs.values()
    assert re.search(r"written: tappet\.dxf \(\d+ corners, within 0\.005 mm of the curve\)", of_dxf)
    assert len((tmp_path / "tappet.csv").read_text(encoding="utf-8").splitlines()) == 362
    shown = iter([report, followed.printed])
    page = re.sub(r"```text\n.*?```", lambda _: f"```text\n{next(shown)}```", page_text("cams.md"), flags=re.DOTALL)
    accept("cams.md", page, request)
    committed, drawn = DOCS / "cam.svg", tmp_path / "tappet.svg"
    if request.config.getoption("--update"):
        committed.write_bytes(drawn.read_bytes())
    assert not differences(picture(committed), picture(drawn)), "docs/cam.svg is old; --update draws it anew"
