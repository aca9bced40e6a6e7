"""docs/fitting.md: its files are valid, its commands and its Python run."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.follow import files, follow


@pytest.mark.long
def test_the_page_runs(tmp_path: Path) -> None:
    outputs, printed, *_ = follow("fitting.md", tmp_path)
    fitted = outputs["kinfmu fit arch.toml -o fitted.toml --figure fitted.png"]
    assert "turns: holds" in fitted
    assert "local optima" in fitted
    assert (tmp_path / "fitted.png").stat().st_size > 10_000
    arch, timed = printed.splitlines()
    assert float(arch.split()[0]) < 0.2
    assert arch.endswith("mm, True")
    assert float(timed) < 10.0


def test_the_target_with_an_offset_finds_a_straight_line_at_any_height(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    head = 'mechanism = "jansen_leg"\nunknowns = { c = [35, 45] }\n'
    Path("flat.toml").write_text(head + files("fitting.md")["flat.toml"], encoding="utf-8")
    done = CliRunner().invoke(main, ["fit", "flat.toml", "-o", "leg.toml", "--starts", "1", "--workers", "1"])
    assert done.exit_code == 0, done.output
    assert "flat" in done.output
