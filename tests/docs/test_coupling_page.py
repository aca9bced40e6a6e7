"""docs/coupling.md: its commands and its Python run, and print what the page shows."""

from __future__ import annotations

import importlib.util
import re
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.commands import check_commands

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "coupling.md").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def _in_a_folder_with_the_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    spec = importlib.util.spec_from_file_location("build", ROOT / "examples" / "dc_motor" / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert "python examples/dc_motor/build.py drive " in PAGE
    module.build(Path("drive"))


def test_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    check_commands(PAGE)
    for command in re.findall(r"^    kinfmu ((?:simulate|export) [^#\n]+)", PAGE, re.MULTILINE):
        result = CliRunner().invoke(main, command.split())
        assert result.exit_code == 0, result.output
    assert "current [A]" in Path("drive.svg").read_text(encoding="utf-8")
    capsys.readouterr()
    code = "\n".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
    exec(compile(code, "coupling.md", "exec"), {})  # noqa: S102  our own page
    shown = re.findall(r"^print\(.*\)  # (.*)$", code, re.MULTILINE)
    assert capsys.readouterr().out.splitlines() == shown


def test_constants_and_the_message_of_the_page(tmp_path: Path) -> None:
    command = [
        "simulate",
        "drive/press_drive.ssp",
        "--set",
        "motor.voltage=600 V",
        "--stop",
        "0.05",
        "--mcap",
        "a.mcap",
    ]
    result = CliRunner().invoke(main, [*command, "--channels", "signals", "--exchange", "jacobi"])
    assert result.exit_code == 0, result.output
    (message,) = re.findall(r"^kinfmu: drive\.ssp: (connection .*)$", PAGE, re.MULTILINE)
    with zipfile.ZipFile("drive/press_drive.ssp") as old, zipfile.ZipFile("drive.ssp", "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data.replace(b'endConnector="crank_angle"', b'endConnector="crank_speed"'))
    result = CliRunner().invoke(main, ["simulate", "drive.ssp"])
    assert result.exit_code == 1
    assert result.output.splitlines()[-1].endswith(message)
    assert "logs" not in {path.name for path in tmp_path.iterdir()} or not list((tmp_path / "logs").iterdir())
