"""docs/reviewing-a-run.md: its commands and its Python run, its pictures are there and made by the script."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.follow import follow

ROOT = Path(__file__).parents[2]
SCRIPT = (ROOT / "scripts" / "pictures").read_text(encoding="utf-8")
MOST = 600_000  # [bytes] of a picture; pages load it


@pytest.mark.long
def test_the_page_runs_and_its_table_has_units(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    names = follow("reviewing-a-run.md", tmp_path).names
    assert names["table"].attrs["units"]["coupler.vx"] == "m/s"


@pytest.mark.parametrize(
    ("page", "folder"),
    [("docs/reviewing-a-run.md", "docs"), ("docs/gallery.md", "docs"), ("README.md", "")],
    ids=["page", "gallery", "readme"],
)
def test_pictures_are_there_of_a_size_to_load_and_made_by_the_script(page: str, folder: str) -> None:
    found = re.findall(r"!\[[^\]]+\]\(([\w./-]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    assert found
    for name in found:
        path = (ROOT / folder / name).resolve()
        assert 0 < path.stat().st_size < MOST, name
        assert path.name in SCRIPT
