"""A checkout in miniature: the real scripts, with a program in place of Python that records what it is asked to do."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[2]

# Understands what the scripts ask of Python: its version, a new environment, pip, and modules to run.
PYTHON = r"""#!/bin/sh
case "$*" in
"-c import sys; print"*) echo "${PYTHON_VERSION:-3.11}"; exit ;;
"-c import sys; sys.exit"*) [ "${PYTHON_VERSION:-3.11}" != 3.9 ]; exit ;;
"-c import ensurepip"*) [ -z "${NO_VENV:-}" ]; exit ;;
"-c "*) exit ;;
"--version") echo "Python 3.11"; exit ;;
"-m venv "*) mkdir -p "$3/bin"; cp "$0" "$3/bin/python"; cp "$0" "$3/bin/kinfmu" ;;
esac
case "$*" in "-m pip show kinfmu") printf '%b' "${PIP_SHOWS:-}"; exit ;; esac
echo "$(basename "$0") $*" >>"$ASKED"
echo "PYTHONPATH=${PYTHONPATH-unset} VIRTUAL_ENV=${VIRTUAL_ENV-unset} cwd=$(pwd -P)" >>"$ASKED.environment"
case "$*" in "-m pip install"*) exit "${PIP_FAILS:-0}" ;; esac
"""


class Miniature:
    """A folder with the scripts, a pyproject.toml, and a PATH on which the stand-in is the only Python."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "a checkout"
        self.asked_file = folder / "asked"
        self.bin = folder / "bin"
        self.bin.mkdir(parents=True)
        shutil.copytree(CHECKOUT / "scripts", self.root / "scripts")
        (self.root / "pyproject.toml").write_text("[project]\n")
        for tool in ("bash", "sh", "dirname", "basename", "cat", "cp", "mkdir", "rm", "sed", "touch", "flock"):
            found = shutil.which(tool)
            if found:
                (self.bin / tool).symlink_to(found)
        self.python = self.bin / "python3"
        self.python.write_text(PYTHON)
        self.python.chmod(0o755)

    def run(self, script: str, *arguments: str, cwd: Path | None = None, **environment: str) -> tuple[int, str]:
        """Exit status of a script, and what it printed on either channel."""
        self.asked_file.unlink(missing_ok=True)
        done = subprocess.run(
            [self.root / "scripts" / script, *arguments],
            cwd=cwd or self.root,
            env={"PATH": str(self.bin), "ASKED": str(self.asked_file), **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout

    @property
    def asked(self) -> list[str]:
        """What Python was asked to do in the last run, in order; version questions left out."""
        return self.asked_file.read_text().splitlines() if self.asked_file.exists() else []

    @property
    def environment(self) -> str:
        """PYTHONPATH, VIRTUAL_ENV and working folder as the stand-in saw them last."""
        return Path(f"{self.asked_file}.environment").read_text().splitlines()[-1]


@pytest.fixture
def miniature(tmp_path: Path) -> Miniature:
    if os.name == "nt":
        pytest.skip("the scripts are for POSIX shells")
    return Miniature(tmp_path)
