"""docs/studies.md: its files, commands and Python run, and print what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.commands import check_commands

PATH = Path(__file__).parents[2] / "docs" / "studies.md"
PAGE = PATH.read_text(encoding="utf-8")
SHOWN = re.compile(r"(print\(.*\))  # (.*)")


@pytest.fixture(autouse=True)
def _in_a_folder_with_the_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    files = re.findall(r"`(\w+\.toml)`:\n\n```toml\n(.*?)```", PAGE, re.DOTALL)
    assert [name for name, _ in files] == ["hoeken.toml", "tolerances.toml", "lengths.toml"]
    for name, text in files:
        (tmp_path / name).write_text(text, encoding="utf-8")


def test_the_commands_of_the_page_run_and_print_what_it_shows(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    check_commands(PAGE)
    commands = re.findall(r"^    kinfmu ([^#\n]+)", PAGE, re.MULTILINE)
    outputs = []
    for command in commands:
        if "--dask" in command:  # tests/studies/test_workers.py
            continue
        alone = ["--workers", "1"] if command.startswith("study") else []
        result = CliRunner().invoke(main, [*command.split(), *alone])
        assert result.exit_code == 0, result.output
        outputs.append(result.output)
    page = re.sub(r"```text\n.*?```", lambda _: f"```text\n{outputs[0]}```", PAGE, flags=re.DOTALL)
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == PAGE, "docs/studies.md is old; pytest tests/docs --update writes it anew"
    assert "42 designs (on a grid)" in outputs[1]
    made = {path.name for path in tmp_path.iterdir()}
    assert {"tolerances.svg", "lengths.png", "swing.svg", "tolerances.parquet", "lengths.parquet"} <= made


def test_the_python_of_the_page_prints_its_comments(
    capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(code, "studies.md", "exec"), {})  # noqa: S102  our own page
    printed = iter(capsys.readouterr().out.splitlines())
    page = PATH.read_text(encoding="utf-8")
    shown = SHOWN.sub(lambda found: f"{found[1]}  # {next(printed)}", page)
    if request.config.getoption("--update"):
        PATH.write_text(shown, encoding="utf-8", newline="\n")
    else:
        assert shown == page, "docs/studies.md is old; pytest tests/docs --update writes it anew"
