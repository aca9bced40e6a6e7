"""The scripts of the checkout: what they print when asked for help, and that they are careful."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]
SCRIPTS = sorted(path for path in (CHECKOUT / "scripts").iterdir() if not path.suffix)


@pytest.mark.parametrize("script", ["setup", "demo", "check", "docs", "graphics", "browser", "video", "shape"])
def test_help_is_printed_without_setting_anything_up(script: str, tmp_path: Path) -> None:
    shutil.copytree(CHECKOUT / "scripts", tmp_path / "scripts")
    done = subprocess.run([tmp_path / "scripts" / script, "--help"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith(f"scripts/{script}")
    assert "set -euo" not in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["scripts"]


@pytest.mark.parametrize("script", ["setup", "demo", "docs", "graphics", "browser", "video"])
def test_an_argument_without_meaning_is_wrong_usage(script: str) -> None:
    done = subprocess.run([CHECKOUT / "scripts" / script, "all"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, f"kinfmu: scripts/{script} takes no arguments, got 'all'\n")


@pytest.mark.parametrize("script", [*SCRIPTS, CHECKOUT / ".ci" / "run"], ids=lambda path: path.name)
def test_every_script_is_executable_and_ends_at_an_error(script: Path) -> None:
    assert script.stat().st_mode & 0o111 == 0o111
    assert "\nset -euo pipefail\n" in script.read_text()
