"""kinfmu play: the address it prints, and how it ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip("ziglang", reason="pages are compiled by zig")


@pytest.mark.skipif(os.name != "posix", reason="sends Ctrl-C as a signal")
def test_play_prints_the_address_of_the_page_and_ends_with_ctrl_c(tmp_path: Path) -> None:
    arguments = [sys.executable, "-m", "kinfmu", "play", "crank_rocker", "--no-browser"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as play:
        assert play.stdout is not None
        address = play.stdout.readline().strip()
        with urllib.request.urlopen(address, timeout=30) as answer:  # noqa: S310  its own server
            assert b"<title>crank_rocker</title>" in answer.read()
        play.send_signal(signal.SIGINT)
        try:
            assert "Traceback" not in play.communicate(timeout=30)[1]
        finally:
            play.kill()  # else leaving the block waits for a program that does not end
        assert play.returncode == 0
