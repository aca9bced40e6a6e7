"""Follow a page: type its commands and run its Python, block after block, in a folder."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from contextlib import chdir, redirect_stdout
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from tests.docs.blocks import DOCS, PAGES, ROOT, blocks, commands
from tests.fmu.native.test_hosts import ecos_command

PYTHON = os.environ.get("KINFMU_HOSTS", sys.executable)  # with the hosts
HOSTS = re.compile(r"^ *from (fmpy|libcosimpy|ecospy)\b", re.MULTILINE)

NOT_RUN = {  # beginnings of the commands and blocks that no page runs in the tests, and why
    "scripts/demo": "installs kinfmu; tests/cli/test_demo.py runs the demonstration",
    "scripts/test": "runs the tests",
    "source .venv/bin/activate": "acts on the shell",
    "pip install omsimulator": "downloads a program from a server that is no package registry",
    "python examples/dc_motor/stability.py": "takes a minute; tests/docs/test_pages.py",
    "scripts/bench": "measures for minutes; tests/benchmarks runs the parts",
    "kinfmu build mine.toml --fmi 3 --platforms all": "zig compiles for minutes; tests/fmu/native/test_build.py",
    "kinfmu build fourbar --platforms all": "zig compiles for minutes; tests/fmu/native/test_build.py",
    "kinfmu simulate mine.toml --live": "opens the viewer; tests/log/viewer/test_reviewing.py",
    "kinfmu review logs/fourbar.mcap --screenshot": "needs a graphics driver; tests/log/viewer/test_reviewing.py",
    "kinfmu review designs": "opens the viewer; tests/design/study/test_recordings.py",
    "kinfmu study tolerances.toml --dask": "needs a cluster; tests/design/study/test_workers.py",
    "from OMSimulator import": "OMSimulator is not installed",
    "from pyfmi import": "PyFMI is not installed",
    'import numpy as np\n\nt = np.linspace(0.0, 10.0, 1001)\nmodel = load_fmu("fourbar.fmu"': "PyFMI is not installed",
}
NEEDS: dict[str, Callable[[], object]] = {  # parts of commands and blocks that need more than kinfmu[dev]
    ".mp4": lambda: shutil.which("ffmpeg"),
    ".dxf": lambda: find_spec("ezdxf"),
    "kinfmu play": lambda: os.name == "posix",
    "kinfmu.play": lambda: find_spec("anywidget"),
    "ecos simulate": ecos_command,
    "from ecospy": lambda: find_spec("ecospy"),
    "from libcosimpy": lambda: find_spec("libcosimpy"),
}
OPTIONS = {  # options that tests add, by the beginning of the command
    "kinfmu fit": ["--starts", "2", "--workers", "1"],
    "kinfmu study": ["--workers", "1"],
}

FILES = {  # the file of each block of TOML, where the text above does not announce it
    "fitting.md": ["flat.toml"],
    "forces.md": ["pump.toml"],
    "measures.md": ["hoeken.toml"],
}
BEFORE = {  # commands for the files that a page takes as given
    "commands.md": ["kinfmu solve crank_rocker -o host.csv"],
    "fmu.md": ["kinfmu solve fourbar -o host.csv", "kinfmu new toggle_press press.toml"],
    "host-omsimulator.md": ["kinfmu solve fourbar -o fourbar_res.csv"],
    "host-openmodelica.md": ["kinfmu solve fourbar -o fourbar_res.csv"],
    "host-pyfmi.md": ["kinfmu solve fourbar -o pyfmi.csv"],
    "host-simulink.md": ["kinfmu build fourbar --si", "kinfmu solve fourbar -o simulink.csv"],
    "hosts.md": ["kinfmu build fourbar", "kinfmu solve fourbar -o host.csv"],
    "plots.md": [
        "kinfmu simulate fourbar",
        "kinfmu simulate jansen_leg --mcap logs/leg.mcap",
        "kinfmu simulate jansen_leg --set j=48.5 --mcap logs/shorter.mcap",
    ],
    "playing.md": ["kinfmu new crank_rocker mine.toml", "kinfmu simulate mine.toml"],
}
FROM_PAGES = {
    "commands.md": ["fitting.md", "studies.md"],
    "torque.md": ["forces.md"],
}  # pages whose files a page takes as given
SHOWN = re.compile(r"(print\(.*\))  # (.*)")
INPUTS = {  # files that pages take as given
    "crank.csv": "time,crank_angle\n0,0\n0.5,0.5\n1,1\n",
    "press.linkage2": (ROOT / "tests/mechanism/imports/linkage/slider_crank.linkage2").read_text(encoding="utf-8"),
    "torque.csv": "time,crank_torque [N m]\n0,50\n0.2,50\n",
}


class Followed(NamedTuple):
    """What following a page gave."""

    outputs: dict[str, str]  # of each command
    printed: str  # by the page's Python
    names: dict[str, Any]  # that the page's Python defines
    in_host: str  # the page's Python for hosts, which runs in a process of its own
    printed_in_host: str

    def commented(self, page: str) -> str:
        """Return the page with the comment behind each `print(...)` as the page's Python prints it."""
        lines = iter(self.printed.splitlines())
        return SHOWN.sub(lambda found: f"{found[1]}  # {next(lines)}", page)


def why_not_run(text: str) -> str | None:
    """Return why no page runs a command or block in the tests, None for one that is run."""
    return next((why for begin, why in NOT_RUN.items() if text.startswith(begin)), None)


def page_text(name: str) -> str:
    """Return the text of a page."""
    return PAGES[name].read_text(encoding="utf-8")


def files(name: str) -> dict[str, str]:
    """Return the text of each file of TOML that a page shows, in one block or several, by its name."""
    found: dict[str, str] = {}
    given = iter(FILES.get(name, ()))
    for block in blocks(page_text(name)):
        if block.kind == "toml":
            file = block.file or next(given)
            found[file] = found.get(file, "") + f"{block.text}\n"
    return found


def follow(name: str, folder: Path) -> Followed:
    """Type the commands and run the Python of a page in a folder, in their order; each must succeed."""
    outputs: dict[str, str] = {}
    names: dict[str, Any] = {}
    printed = StringIO()
    in_host, printed_in_host = "", ""
    for page in (name, *FROM_PAGES.get(name, ())):
        for file, text in files(page).items():
            (folder / file).write_text(text, encoding="utf-8")
    for file, text in INPUTS.items():
        (folder / file).write_text(text, encoding="utf-8")
    with chdir(folder):
        for line in BEFORE.get(name, ()):
            typed(line)
        for block in blocks(page_text(name)):
            if block.kind == "commands":
                outputs |= {line: typed(line) for line in commands(block) if _can_run(line)}
            elif block.kind == "python" and _can_run(block.text):
                if block.file.endswith(".py"):  # a command below starts it
                    assert not Path(block.file).exists(), f"{name}: two blocks for {block.file}, or a sentence names it"
                    Path(block.file).write_text(block.text, encoding="utf-8")
                elif in_host or HOSTS.search(block.text):
                    in_host += block.text
                    printed_in_host = run_in_host(in_host)
                else:
                    with redirect_stdout(printed):
                        exec(compile(block.text, name, "exec"), names)  # noqa: S102  our own page
    return Followed(outputs, printed.getvalue(), names, in_host, printed_in_host)


def typed(line: str) -> str:
    """Return what a command prints. The viewer does not open: its recording is written to a file."""
    program, *words = (name for word in shlex.split(line) for name in _matching(word) or [word])
    if line.startswith("kinfmu play"):
        return _played(words)
    if program == "kinfmu":
        words += next((more for begin, more in OPTIONS.items() if line.startswith(begin)), [])
        if words[0] == "review" and "--save" not in words:
            words += ["--save", "review.rrd"]
        result = CliRunner().invoke(main, words)
        assert result.exit_code == 0, (line, result.output)
        return result.output
    programs = {"python": [sys.executable], "fmpy": [sys.executable, "-m", "fmpy"], "ecos": [str(ecos_command())]}
    here = [str(ROOT / word) if word.startswith("examples/") else word for word in words]
    done = subprocess.run([*programs[program], *here], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, (line, done.stdout, done.stderr)
    return done.stdout


def _matching(word: str) -> list[str]:
    """Return the files that a word of a command names by a pattern, as a shell does."""
    return sorted(map(str, Path().glob(word))) if "*" in word else []


def _can_run(text: str) -> bool:
    return why_not_run(text) is None and all(there() for part, there in NEEDS.items() if part in text)


def run_in_host(code: str) -> str:
    """Run Python for a host, which may end its process, and return what it prints."""
    done = subprocess.run([PYTHON, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, (code, done.stderr)
    return done.stdout


def _played(words: list[str]) -> str:
    """Start the server of a page, load the page, and end the server with Ctrl-C."""
    arguments = [sys.executable, "-m", "kinfmu", *words, "--no-browser"]
    states = {**os.environ, "KINFMU_STATES": str(Path("states").absolute())}  # of drawings
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True, env=states) as play:
        try:
            assert play.stdout is not None
            address = play.stdout.readline().strip()
            with urllib.request.urlopen(address, timeout=60) as answer:  # noqa: S310  its own server
                assert b"<title>" in answer.read()
            play.send_signal(signal.SIGINT)
            assert play.wait(timeout=60) == 0
        finally:
            play.kill()  # else leaving the block waits for a program that does not end
    return address


def accept(name: str, page: str, request: pytest.FixtureRequest) -> None:
    """Compare a page with the one in docs, or write it with --update."""
    if request.config.getoption("--update"):
        (DOCS / name).write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == page_text(name), f"docs/{name} is old; pytest tests/docs --update writes it anew"
