"""Pages whose numbers and outputs are those of the code: method, tutorial, records, overviews."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

import kinfmu
from kinfmu.cli import main
from kinfmu.display import COLOURS
from kinfmu.errors import RequestError
from kinfmu.log import McapLog, read
from kinfmu.mechanism import gallery
from kinfmu.mechanism.toml_file import parse
from kinfmu.run.channels import absent_columns
from tests.docs import follow
from tests.docs.blocks import blocks, commands, executed

DOCS = Path(__file__).parents[2] / "docs"
PATH = DOCS / "method.md"


def test_the_python_of_the_page_prints_what_it_shows(request: pytest.FixtureRequest) -> None:
    page = executed(PATH)
    if request.config.getoption("--update"):
        PATH.write_text(page, encoding="utf-8", newline="\n")
    else:
        assert page == PATH.read_text(encoding="utf-8"), "docs/method.md is old; pytest tests/docs --update"
    assert "False" not in page


def test_the_jacobian_of_the_page_is_that_of_check() -> None:
    page = PATH.read_text(encoding="utf-8")
    shown = page.split("show(jacobian(q60))\n```\n\n```text\n")[1].split("```")[0]
    rows = [[float(cell) for cell in re.findall(r"-?\d+\.\d*", line)] for line in shown.splitlines()]
    printed = CliRunner().invoke(main, ["check", "fourbar", "--matrices"]).output.split("Phi_K,q at")[1]
    (*joints, _) = rows
    for label, row in zip(("P.x", "P.y", "Q.x", "Q.y", "AB.length"), joints, strict=True):
        (line,) = re.findall(rf"^{label} (.*)$", printed.split("row-reduced")[0], re.MULTILINE)
        assert [float(cell) for cell in line.split()] == row, label


def test_every_file_and_constant_of_the_algorithm_exists() -> None:
    page = (DOCS / "algorithm.md").read_text(encoding="utf-8")
    files = re.findall(r"`(kinfmu/[\w/]+(?:\.py)?)/?`", page)
    assert len(files) > 10
    for name in files:
        assert (DOCS.parent / name).exists(), name
    cited = set(re.findall(r"\[(\d+)\](?!\()", page.split("## References")[0]))
    assert cited == set(re.findall(r"^(\d+)\. ", page.split("## References")[1], re.MULTILINE))


# ------------------------------------------------------------------------------------------------------------- tutorial


TUTORIAL_PATH = DOCS / "tutorial.md"
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
    if line.startswith("kinfmu play"):
        return follow.typed(line)
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
    page = TUTORIAL_PATH.read_text(encoding="utf-8")
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
            text = "".join(re.findall(r"^ +(?:transmission|link, arm|measure|wipe) .*\n", text, re.MULTILINE))
        same = OF_THE_MACHINE.sub("", text) == OF_THE_MACHINE.sub("", found[2])
        return found[0] if same else found[0].replace(f"```text\n{found[2]}", f"```text\n{text}")

    shown = STEP.sub(step, page)
    (in_folder / "wiper.toml").write_text(file.replace('"arm.B"', '"arm.D"'), encoding="utf-8")
    mistake = CliRunner().invoke(main, ["check", "wiper.toml"]).output
    shown = re.sub(r"```text\nkinfmu: .*?```", lambda _: f"```text\n{mistake}```", shown, flags=re.DOTALL)
    if request.config.getoption("--update"):
        TUTORIAL_PATH.write_text(shown, encoding="utf-8", newline="\n")
        for made, name in PICTURES.items():
            shutil.copy(in_folder / made, DOCS / name)
    else:
        assert shown == page, "docs/tutorial.md is old; pytest tests/docs/test_single_pages.py --update writes it anew"
    assert lines == [line for block in blocks(page) if block.kind == "commands" for line in commands(block)]
    assert all((in_folder / made).stat().st_size and (DOCS / name).is_file() for made, name in PICTURES.items())
    run = read("logs/start.mcap")
    assert run.good.all()
    assert len(run) == 201
    assert Path("review.rrd").stat().st_size > 0


def test_points_of_a_sketch_in_the_world_give_the_same_motion() -> None:
    wiper = parse(re.findall(r"```toml\n(.*?)```", TUTORIAL_PATH.read_text(encoding="utf-8"), re.DOTALL)[0])
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


# --------------------------------------------------------------------------------------------------------- records page


PAGE = (gallery.folder().parent / "docs" / "records.md").read_text(encoding="utf-8")
CODE = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0]


@pytest.fixture
def record(tmp_path: Path) -> Path:
    fmu = kinfmu.build(kinfmu.load("fourbar"), tmp_path / "fourbar.fmu")
    kinfmu.simulate(fmu, stop=2.0, sink=McapLog(tmp_path / "run.mcap"))
    return tmp_path / "run.mcap"


def rows(heading: str) -> dict[str, str]:
    """The second column of the table under this heading of its first column, by the first."""
    lines = PAGE[PAGE.index(f"| {heading} |") :].split("\n\n")[0].splitlines()[2:]
    cells = [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]
    return {row[0]: row[1] for row in cells}


def test_the_code_runs_and_its_comments_are_true(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow")
    monkeypatch.chdir(tmp_path)
    exec(compile(CODE, "records.md", "exec"), {})  # noqa: S102  our own page
    promised = [line.partition("  # ")[2] for line in CODE.splitlines() if line.startswith("print")]
    for printed, comment in zip(capsys.readouterr().out.splitlines(), promised, strict=True):
        assert comment.startswith(printed)


def test_topics_and_metadata_are_those_of_a_file(record: Path) -> None:
    with record.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        types = {one.topic: summary.schemas[one.schema_id].name for one in summary.channels.values()}
        metadata = {one.name: one.metadata for one in reader.iter_metadata()}
        attached = [one.name for one in reader.iter_attachments()]
        sample = next(one.metadata for one in summary.channels.values() if one.topic == "/sample")
    assert rows("topic") == types
    assert set(rows("metadata")) == set(metadata)
    assert metadata["kinfmu.end"]["outcome"] == "completed"
    assert metadata["kinfmu.about"]["kinfmu"] == kinfmu.VERSION
    assert attached == ["mechanism.toml", "modelDescription.xml"]
    assert all(f"`{name}`" in PAGE for name in attached)
    assert (sample["unit.coupler_vx"], sample["column.coupler_vx"]) == ("m/s", "coupler.vx")


def test_a_run_that_ends_at_a_limit_has_it_as_its_outcome(tmp_path: Path) -> None:
    fmu = kinfmu.build(kinfmu.load("double_pendulum"), tmp_path / "pendulum.fmu")
    run = kinfmu.simulate(fmu, stop=3.0, step=0.5, sink=McapLog(tmp_path / "run.mcap"))
    with (tmp_path / "run.mcap").open("rb") as file:
        outcome = next(one.metadata for one in make_reader(file).iter_metadata() if one.name == "kinfmu.end")["outcome"]
    assert outcome == next(event.text for event in run.events if event.level == "error")
    assert outcome.startswith("at t = 2.5 s: crank = 6.54498")


def test_every_channel_is_on_the_page() -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), [0.0])
    with pytest.raises(RequestError) as caught:
        absent_columns(run, ["nothing"])
    known = re.findall(r"channels: (.*), or columns", str(caught.value))[0].split(", ")
    section = PAGE[PAGE.index("## Channels") : PAGE.index("## Failures")]
    assert {name for name in known if f"`{name}`" not in section} == {"all", "none", "status"}


@pytest.mark.long
def test_the_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    block = PAGE.split("\n\n")[2]
    for line in block.splitlines():
        arguments = shlex.split(line.strip(), comments=True)
        assert arguments[0] == "kinfmu"
        result = CliRunner().invoke(main, arguments[1:])
        assert result.exit_code == 0, (line, result.output)
    assert len(read(tmp_path / "logs" / "fourbar-recovered.mcap")) == 181


# ------------------------------------------------------------------------------------------------------- overview pages


ROOT = Path(__file__).parents[2]
ARCHITECTURE, GALLERY, COMMANDS, README = (
    (ROOT / name).read_text(encoding="utf-8")
    for name in ("docs/architecture.md", "docs/gallery.md", "docs/commands.md", "README.md")
)


def test_the_architecture_lists_every_package() -> None:
    packages = {path.name for path in (ROOT / "kinfmu").iterdir() if (path / "__init__.py").is_file()}
    assert set(re.findall(r"`kinfmu/(\w+)/", ARCHITECTURE)) == packages


def test_the_architecture_lists_every_module_outside_packages() -> None:
    modules = {path.name for path in (ROOT / "kinfmu").glob("*.py")} - {"__init__.py", "__main__.py"}
    listed = ARCHITECTURE.partition("\n## Other folders")[0]
    assert modules <= set(re.findall(r"(\w+\.py)`", listed))


def test_the_architecture_lists_packages_in_the_order_of_imports() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (layers,) = (each["layers"] for each in config["tool"]["importlinter"]["contracts"] if each["type"] == "layers")
    level = {name.strip(): k for k, layer in enumerate(reversed(layers)) for name in layer.split("|")}
    listed = [level[name] for name in re.findall(r"^\| `kinfmu/(\w+)/", ARCHITECTURE, re.MULTILINE)]
    assert listed == sorted(listed)


def test_the_first_page_lists_every_extra_for_users() -> None:
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = set(config["project"]["optional-dependencies"]) - {"dev", "docs", "hosts"}  # those of a checkout
    assert set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)) == extras


def test_the_paths_of_the_architecture_exist() -> None:
    paths = re.findall(r"`((?:kinfmu|scripts|fmus|tests|docs)/[\w/.]*)[ `]", ARCHITECTURE)
    assert len(paths) > 30
    for path in set(paths) - {"docs/_build"}:  # there once scripts/docs has run
        assert (ROOT / path).exists(), path


def test_the_architecture_lists_every_script() -> None:
    scripts = {path.name for path in (ROOT / "scripts").iterdir() if path.is_file() and not path.suffix}
    assert set(re.findall(r"^\| `scripts/(\w+)` \|", ARCHITECTURE, re.MULTILINE)) == scripts
    assert "docs/architecture.md#scripts" in README


def test_the_gallery_page_lists_every_mechanism_with_its_title() -> None:
    listed = re.findall(r"^\| \[`(\w+)`\]\(\.\./fmus/(\w+)/README\.md\) \| (.+?) \| .+ \|$", GALLERY, re.MULTILINE)
    assert sorted(listed) == [(name, name, kinfmu.load(name).title) for name in gallery.names()]
    assert f"comes with {len(gallery.names())} mechanisms" in GALLERY


def test_the_commands_page_shows_every_command() -> None:
    assert set(re.findall(r"^    kinfmu (\w+)", COMMANDS, re.MULTILINE)) == set(main.commands)


def test_the_commands_page_explains_every_line_of_the_report() -> None:
    source = (ROOT / "kinfmu" / "analysis" / "summary.py").read_text(encoding="utf-8")
    subjects = set(re.findall(r"yield f?\"([a-z ]+?)(?: \{k\})?\", ", source))
    assert len(subjects) > 12
    subjects |= COLOURS.keys()
    table = COMMANDS.split("## The report of `check`")[1].split("\n## ")[0]
    explained = re.findall(r"`([^`]+)`", " ".join(re.findall(r"^\| (.+?) \|", table, re.MULTILINE)))
    assert subjects <= set(explained)


def test_messages_of_mechanisms_that_do_not_move_are_those_of_the_code() -> None:
    page = (ROOT / "docs" / "why-not.md").read_text(encoding="utf-8")
    messages = re.findall(r"^\| `([^`]+)` \|", page, re.MULTILINE)
    code = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "kinfmu").rglob("*.py"))
    assert len(messages) > 10
    assert [message for message in messages if message not in code] == []


def test_every_link_between_the_pages_leads_to_a_file() -> None:
    made = ("reference/",)  # while the site is built; scripts/docs checks links to them
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for target in re.findall(r"\]\(([\w./-]+)(?:#[\w-]+)?\)", page.read_text(encoding="utf-8")):
            assert target.startswith(made) or (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_readme_leads_to_every_page() -> None:
    for_the_site = {
        "docs/index.md",
        "docs/howto.md",
        "docs/method.md",
        "docs/reference.md",
    }
    pages = {f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")} - for_the_site
    assert pages <= set(re.findall(r"\((docs/[\w-]+\.md)\)", README))
