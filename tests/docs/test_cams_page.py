"""docs/cams.md: its file, commands and Python run, and print what the page shows."""

from __future__ import annotations

import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.commands import check_commands
from tests.draw.picture import differences, picture

PATH = Path(__file__).parents[2] / "docs" / "cams.md"
PAGE = PATH.read_text(encoding="utf-8")


def test_the_commands_and_the_python_of_the_page_run_and_print_what_it_shows(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ezdxf")
    monkeypatch.chdir(tmp_path)
    (mechanism,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    Path("tappet.toml").write_text(mechanism, encoding="utf-8")
    check_commands(PAGE)
    outputs = []
    for command in re.findall(r"^    kinfmu ([^#\n]+)", PAGE, re.MULTILINE):
        result = CliRunner().invoke(main, command.split())
        assert result.exit_code == 0, result.output
        outputs.append(result.output)
    assert re.search(r"written: tappet\.dxf \(\d+ corners, within 0\.005 mm of the curve\)", outputs[-1])
    assert len(Path("tappet.csv").read_text(encoding="utf-8").splitlines()) == 362
    committed = PATH.with_name("cam.svg")
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    printed = StringIO()
    with redirect_stdout(printed):
        exec(compile(block, "cams.md", "exec"), {})  # noqa: S102  our own page
    shown = iter([outputs[0], printed.getvalue()])
    page = re.sub(r"```text\n.*?```", lambda _: f"```text\n{next(shown)}```", PAGE, flags=re.DOTALL)
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
        committed.write_bytes(Path("tappet.svg").read_bytes())
        return
    assert page == PAGE, "docs/cams.md is old; pytest tests/docs --update writes it anew"
    assert not differences(picture(committed), picture(Path("tappet.svg"))), (
        "docs/cam.svg is old; --update draws it anew"
    )
