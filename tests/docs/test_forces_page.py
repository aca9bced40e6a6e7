"""docs/forces.md: its file, its commands and its Python run, and print what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.commands import check_commands

PATH = Path(__file__).parents[2] / "docs" / "forces.md"
PAGE = PATH.read_text(encoding="utf-8")
SHOWN = re.compile(r"(print\(.*\))  # (.*)")
FILE = "\n".join(re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL))


@pytest.fixture(autouse=True)
def _in_a_folder_with_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pump.toml").write_text(FILE, encoding="utf-8")


def accept(page: str, request: pytest.FixtureRequest) -> None:
    """Compare the page, or write it with --update."""
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == PAGE, "docs/forces.md is old; pytest tests/docs --update writes it anew"


def test_the_commands_of_the_page_run_and_print_what_it_shows(request: pytest.FixtureRequest) -> None:
    check_commands(PAGE)
    outputs = []
    for command in re.findall(r"^    kinfmu ([^#\n]+)", PAGE, re.MULTILINE):
        result = CliRunner().invoke(main, command.split())
        assert result.exit_code == 0, result.output
        outputs.append(result.output)
    section = outputs[0][outputs[0].index("  forces ") :]
    accept(re.sub(r"```text\n.*?```", lambda _: f"```text\n{section}```", PAGE, flags=re.DOTALL), request)
    assert "at 62.8319 rad/s" in outputs[1]
    assert ",crank.torque," in Path("pump.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert Path("pump.svg").is_file()


def test_the_python_of_the_page_prints_its_comments(
    capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    code = "\n".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
    assert len(SHOWN.findall(code)) == code.count("print(")
    exec(compile(code, "forces.md", "exec"), {})  # noqa: S102  our own page
    printed = iter(capsys.readouterr().out.splitlines())
    page = PATH.read_text(encoding="utf-8") if request.config.getoption("--update") else PAGE
    accept(SHOWN.sub(lambda found: f"{found[1]}  # {next(printed)}", page), request)
