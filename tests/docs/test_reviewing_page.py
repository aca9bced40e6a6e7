"""docs/reviewing-a-run.md: its commands exist, its Python runs, its pictures are there and made by the script."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from kinfmu.log import write_mcap
from tests.docs.commands import check_commands
from tests.log.runs import fourbar

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reviewing-a-run.md").read_text(encoding="utf-8")
SCRIPT = (ROOT / "scripts" / "pictures").read_text(encoding="utf-8")
MOST = 600_000  # [bytes] of a picture; pages load it


def test_every_command_and_option_of_the_page_exists() -> None:
    check_commands(PAGE)


def test_the_python_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logs").mkdir()
    write_mcap(fourbar(np.arange(181.0)), "logs/fourbar.mcap")
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(block, "reviewing-a-run.md", "exec"), names)  # noqa: S102  our own page
    assert names["table"].attrs["units"]["coupler.vx"] == "m/s"  # type: ignore[attr-defined]


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
