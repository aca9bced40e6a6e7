"""docs/tutorial.md, typed word for word: its file, its commands, its script, and what they print."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.log import read
from kinfmu.mechanism.toml_file import parse
from tests.docs.blocks import blocks, commands

DOCS = Path(__file__).parents[2] / "docs"
PATH = DOCS / "tutorial.md"
STEP = re.compile(
    r"((?:^    (?:kinfmu|python) .*\n)+)(?:\n(?:The report now says:\n\n)?```text\n((?:.*\n)*?)```\n)?", re.MULTILINE
)
OF_THE_MACHINE = re.compile(r"\d+ kB|FMU for [\w-]+|residual [\d.e-]+ at [\d.]+ s")
PICTURES = {"wiper.svg": "wiper.svg", "start.svg": "wiper-start.svg"}


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, and a build that chooses the flavour as it does for a user with a compiler."""
    monkeypatch.setattr(import_module("kinfmu.fmu.build"), "default_flavour", lambda *_, **__: "native")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def typed(line: str, folder: Path) -> str:
    """Return what a command of the page prints. The viewer does not open: its recording is written to a file."""
    program, *words = shlex.split(line)
    if program == "python":
        done = subprocess.run([sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, ""), line
        return done.stdout
    if words[0] == "review":
        words += ["--save", "review.rrd"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, (line, result.output)
    return result.output


def masses_added(file: str, added: str) -> str:
    """Return the file with the arm of the page's second block in place of its own, and the load at the end."""
    arm, load = added.split("\n\n")
    (own,) = re.findall(r"^\[bodies\.arm\]\n.*?(?=\n\n)", file, re.DOTALL | re.MULTILINE)
    return f"{file.replace(own, arm)}\n{load}"


def test_the_tutorial_works_word_for_word(in_folder: Path, request: pytest.FixtureRequest) -> None:
    page = PATH.read_text(encoding="utf-8")
    file, added = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (script,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    texts = iter([file, masses_added(file.replace("crank = 50", "crank = 54"), added)])
    (in_folder / "motor.py").write_text(script, encoding="utf-8")
    count = 0
    lines: list[str] = []

    def step(found: re.Match[str]) -> str:
        nonlocal count
        count += 1
        text = ""
        for line in found[1].splitlines():
            if count == 1 or "build" in line:
                (in_folder / "wiper.toml").write_text(next(texts), encoding="utf-8")
            lines.append(line.strip())
            text = typed(lines[-1], in_folder)
        if found[2] is None:
            return found[0]
        if "--set crank" in found[1]:  # shortened to what changes
            text = "".join(re.findall(r"^.*(?:transmission angle|wipe =).*\n", text, re.MULTILINE))
        same = OF_THE_MACHINE.sub("", text) == OF_THE_MACHINE.sub("", found[2])
        return found[0] if same else found[0].replace(f"```text\n{found[2]}", f"```text\n{text}")

    shown = STEP.sub(step, page)
    (in_folder / "wiper.toml").write_text(file.replace('"arm.B"', '"arm.D"'), encoding="utf-8")
    mistake = CliRunner().invoke(main, ["check", "wiper.toml"]).output
    shown = re.sub(r"```text\nkinfmu: .*?```", lambda _: f"```text\n{mistake}```", shown, flags=re.DOTALL)
    if request.config.getoption("--update"):
        PATH.write_text(shown, encoding="utf-8", newline="\n")
        for made, name in PICTURES.items():
            shutil.copy(in_folder / made, DOCS / name)
    else:
        assert shown == page, "docs/tutorial.md is old; pytest tests/docs/test_tutorial.py --update writes it anew"
    assert lines == [line for block in blocks(page) if block.kind == "commands" for line in commands(block)]
    assert all((in_folder / made).stat().st_size and (DOCS / name).is_file() for made, name in PICTURES.items())
    run = read("logs/start.mcap")
    assert run.good.all()
    assert len(run) == 201
    assert Path("review.rrd").stat().st_size > 0


def test_points_of_a_sketch_in_the_world_give_the_same_motion() -> None:
    wiper = parse(re.findall(r"```toml\n(.*?)```", PATH.read_text(encoding="utf-8"), re.DOTALL)[0])
    run = kinfmu.solve(wiper)
    pose = {name: float(run[name][0]) for name in run.names} | run.fixed

    def sketched(body: kinfmu.Body) -> kinfmu.Body:
        origin, turn = complex(pose[f"{body.name}.x"], pose[f"{body.name}.y"]), np.exp(1j * pose[f"{body.name}.phi"])
        world = {name: origin + turn * complex(*point) for name, point in body.points.items()}
        points = {name: (float(at.real), float(at.imag)) for name, at in world.items()}
        return kinfmu.Body(body.name, points, (0.0, 0.0, 0.0))

    (motor,) = wiper.drivers
    motor = replace(motor, law=replace(motor.law, start=0.0))  # type: ignore[type-var]  # a dataclass
    bodies = tuple(body if body.is_ground else sketched(body) for body in wiper.bodies)
    sketch = kinfmu.solve(replace(wiper, bodies=bodies, drivers=(motor,), parameters={}))
    for name in ("tip.x", "tip.y"):
        np.testing.assert_allclose(sketch[name], run[name], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(sketch["arm.phi"], run["arm.phi"] - run["arm.phi"][0], rtol=0.0, atol=1e-11)
