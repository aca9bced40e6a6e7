"""docs/fitting.md: its files are valid, its commands exist, its Python runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.commands import check_commands

PAGE = (Path(__file__).parents[2] / "docs" / "fitting.md").read_text(encoding="utf-8")
MECHANISM, FIT = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "guide.toml").write_text(MECHANISM, encoding="utf-8")
    (tmp_path / "arch.toml").write_text(FIT, encoding="utf-8")
    return tmp_path


def test_the_commands_of_the_page(folder: Path) -> None:
    check_commands(PAGE)
    arguments = ["fit", "arch.toml", "-o", "fitted.toml", "--figure", "fitted.png", "--starts", "2", "--workers", "1"]

    done = CliRunner().invoke(main, arguments)

    assert done.exit_code == 0, done.output
    assert "turns: holds" in done.output
    assert "local optima" in done.output
    assert (folder / "fitted.png").stat().st_size > 10_000
    assert CliRunner().invoke(main, ["check", "fitted.toml"]).exit_code == 0


@pytest.mark.long
def test_the_python_of_the_page(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:  # noqa: ARG001  its files
    code = "\n".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
    exec(compile(code, "fitting.md", "exec"), {})  # noqa: S102  our own page
    arch, timed = capsys.readouterr().out.splitlines()
    assert float(arch.split()[0]) < 0.2
    assert arch.endswith("mm, True")
    assert float(timed) < 10.0
