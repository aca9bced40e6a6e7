"""docs/designing.md: its Python runs and prints what the page shows; its commands exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.commands import check_commands

PATH = Path(__file__).parents[2] / "docs" / "designing.md"
PAGE = PATH.read_text(encoding="utf-8")
SHOWN = re.compile(r"(print\(.*\))  # (.*)")


def test_the_commands_of_the_page_exist() -> None:
    check_commands(PAGE)


@pytest.mark.long
def test_the_python_of_the_page_prints_its_comments(
    capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    code = "\n".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
    exec(compile(code, "designing.md", "exec"), {})  # noqa: S102  our own page
    printed = iter(capsys.readouterr().out.splitlines())
    page = SHOWN.sub(lambda found: f"{found[1]}  # {next(printed)}", PAGE)
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == PAGE, "docs/designing.md is old; pytest tests/docs --update writes it anew"
