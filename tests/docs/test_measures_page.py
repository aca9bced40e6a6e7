"""docs/measures.md: its file, its commands and its Python run, and print what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.commands import check_commands
from tests.docs.key_tables import with_readings

PATH = Path(__file__).parents[2] / "docs" / "measures.md"
PAGE = PATH.read_text(encoding="utf-8")
SHOWN = re.compile(r"(print\(.*\))  # (.*)")
FILE = "\n".join(re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL))


@pytest.fixture(autouse=True)
def _in_a_folder_with_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hoeken.toml").write_text(FILE, encoding="utf-8")


def printed(command: str) -> str:
    result = CliRunner().invoke(main, command.split())
    assert result.exit_code == 0, result.output
    return result.output


def test_the_commands_of_the_page_run_and_print_what_it_shows(request: pytest.FixtureRequest) -> None:
    check_commands(PAGE)
    commands = re.findall(r"^    kinfmu ([^#\n]+)", PAGE, re.MULTILINE)
    outputs = [printed(command) for command in commands]
    section = outputs[0][outputs[0].index("  measures ") :]
    page = re.sub(r"```text\n.*?```", lambda _: f"```text\n{section}```", with_readings(PAGE), flags=re.DOTALL)
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == PAGE, "docs/measures.md is old; pytest tests/docs --update writes it anew"
    assert '"measures": {' in outputs[1]
    assert "at 6.28319 rad/s" in outputs[2]


def test_the_python_of_the_page_prints_its_comments(
    capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    code = "\n".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
    exec(compile(code, "measures.md", "exec"), {})  # noqa: S102  our own page
    printed = iter(capsys.readouterr().out.splitlines())
    page = SHOWN.sub(lambda found: f"{found[1]}  # {next(printed)}", PAGE)
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == PAGE, "docs/measures.md is old; pytest tests/docs --update writes it anew"
