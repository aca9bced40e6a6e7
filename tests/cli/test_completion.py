"""What bash completes, by click's own script."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from kinfmu.mechanism import gallery

SCRIPT = """
eval "$(_KINFMU_COMPLETE=bash_source kinfmu)"
for line in "kinfmu rev" "kinfmu check four" "kinfmu simulate --st" "kinfmu check mi"; do
    read -ra COMP_WORDS <<<"$line"
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
    COMPREPLY=()
    compopt() { COMPREPLY+=("by bash"); } # outside a completion there is nothing to set
    _kinfmu_completion kinfmu
    echo "${COMPREPLY[*]}"
done
"""


def test_bash_completes_commands_gallery_options_and_files(tmp_path: Path) -> None:
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("there is no bash")
    program = tmp_path / "kinfmu"
    program.write_text(
        f'#!/bin/sh\nexec "{sys.executable}" -c "from kinfmu.cli import main; main(prog_name=\'kinfmu\')" "$@"\n',
        encoding="utf-8",
    )
    program.chmod(0o755)
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        [bash, "-c", SCRIPT], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    commands, names, options, files = done.stdout.splitlines()
    assert commands == "review"
    assert names.split() == [name for name in gallery.names() if name.startswith("four")]
    assert options.split() == ["--start", "--stop", "--step"]
    assert files == "by bash"
