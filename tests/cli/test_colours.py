"""On a terminal, too, commands print no colours: their text is the same with and without NO_COLOR."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pty = pytest.importorskip("pty", reason="pseudo-terminals are those of POSIX")

COLOUR = re.compile(rb"\x1b\[[0-9;:]*m")
PROGRESS = "from kinfmu.cli.group import Progress\nwith Progress('solving', 1) as show:\n    show(1, 2); show(2, 2)"
MODULE = ("-m", "kinfmu")


def on_a_terminal(arguments: tuple[str, ...], folder: Path, variables: dict[str, str]) -> bytes:
    """Return what Python prints with these arguments where stdin, stdout and stderr are a terminal."""
    ours, its = pty.openpty()
    environment = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    environment |= {"TERM": "xterm-256color", **variables}
    process = subprocess.Popen(
        [sys.executable, *arguments], cwd=folder, env=environment, stdin=its, stdout=its, stderr=its
    )
    os.close(its)
    printed = b""
    try:
        while read := os.read(ours, 65536):
            printed += read
    except OSError:  # EIO on Linux: the program closed its side
        pass
    finally:
        os.close(ours)
        process.wait(timeout=60)
    return printed


@pytest.mark.parametrize(
    ("arguments", "contains"),
    [
        ((*MODULE, "check", "fourbar"), b"redundant   AB"),
        ((*MODULE, "check", "fourbr"), b"did you mean"),
        ((*MODULE, "check", "--help"), b"--figure"),
        ((*MODULE, "chek"), b"Usage"),
        ((*MODULE, "solve", "double_pendulum", "-o", "run.csv", "--times", "0:3:0.5"), b"crank = 6.54"),
        (("-c", PROGRESS), b"100%"),
    ],
    ids=["report", "error", "help", "usage", "limit", "progress"],
)
@pytest.mark.few(1)
def test_commands_on_a_terminal_print_no_colours(arguments: tuple[str, ...], contains: bytes, tmp_path: Path) -> None:
    printed = on_a_terminal(arguments, tmp_path, {})
    assert contains in printed
    assert not COLOUR.search(printed)
    assert on_a_terminal(arguments, tmp_path, {"NO_COLOR": "1"}) == printed


def test_a_program_with_colours_would_be_found(tmp_path: Path) -> None:
    printed = on_a_terminal(("-c", "import click; click.secho('red', fg='red')"), tmp_path, {})
    assert COLOUR.search(printed)
