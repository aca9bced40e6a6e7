"""All pages: links, names and blocks."""

from __future__ import annotations

import re
import zipfile
from importlib.util import find_spec
from itertools import chain, repeat
from pathlib import Path

import pytest
from click.testing import CliRunner
from fmpy.ssp.ssd import read_ssd

from kinfmu.cli import main
from kinfmu.log import read
from tests.docs.blocks import DOCS, PAGES, ROOT, Block, blocks, commands, is_typed, words
from tests.docs.follow import NOT_RUN, SHOWN, accept, files, follow, page_text, typed
from tests.docs.key_tables import with_readings
from tests.draw.picture import differences, picture

SCRIPT = "".join((ROOT / path).read_text(encoding="utf-8") for path in ("scripts/pictures", "tests/docs/pictures.py"))
MOST_WORDS = 35_000  # in docs
MOST = 600_000  # [bytes] of a picture; pages load it


def test_pages_stay_short() -> None:
    assert words(page_text("README.md")) <= 600
    assert sum(words(page.read_text(encoding="utf-8")) for page in DOCS.glob("*.md")) <= MOST_WORDS


def with_outputs(page: str, *outputs: str) -> str:
    """Return a page with these outputs in its blocks of text, the last one also in those that follow."""
    shown = chain(outputs, repeat(outputs[-1]))
    return re.sub(r"```text\n.*?```", lambda _: f"```text\n{next(shown)}```", page, flags=re.DOTALL)


def test_cams(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    followed = follow("cams.md", tmp_path)
    report, *_, of_dxf = followed.outputs.values()
    assert re.search(r"written: tappet\.dxf \(\d+ corners, within 0\.005 mm of the curve\)", of_dxf)
    assert len((tmp_path / "tappet.csv").read_text(encoding="utf-8").splitlines()) == 362
    accept("cams.md", with_outputs(page_text("cams.md"), report, followed.printed), request)
    committed, drawn = DOCS / "cam.svg", tmp_path / "tappet.svg"
    if request.config.getoption("--update"):
        committed.write_bytes(drawn.read_bytes())
    assert not differences(picture(committed), picture(drawn)), "docs/cam.svg is old; --update draws it anew"


def test_the_sketch_of_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ezdxf")
    monkeypatch.chdir(tmp_path)
    found = blocks(page_text("commands.md"))
    at = next(k for k, block in enumerate(found) if "ezdxf.new" in block.text)
    exec(found[at].text, {})  # noqa: S102  the Python of the page
    result = CliRunner().invoke(main, commands(found[at + 1])[0].split()[1:])
    assert result.output == found[at + 2].text


@pytest.mark.long
def test_coupling(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("coupling.md", tmp_path)
    accept("coupling.md", followed.commented(page_text("coupling.md")), request)
    assert "current [A]" in (tmp_path / "drive.svg").read_text(encoding="utf-8")


@pytest.mark.long
def test_constants_and_the_message_of_coupling(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    typed("python examples/dc_motor/build.py drive")
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
    (message,) = re.findall(r"^kinfmu: drive\.ssp: (connection .*)$", page_text("coupling.md"), re.MULTILINE)
    with zipfile.ZipFile("drive/press_drive.ssp") as old, zipfile.ZipFile("drive.ssp", "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data.replace(b'endConnector="crank_angle"', b'endConnector="crank_speed"'))
    result = CliRunner().invoke(main, ["simulate", "drive.ssp"])
    assert result.exit_code == 1
    assert result.output.splitlines()[-1].endswith(message)
    assert "logs" not in {path.name for path in tmp_path.iterdir()} or not list((tmp_path / "logs").iterdir())


@pytest.mark.long
def test_the_figure_of_coupling_is_what_its_command_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    typed("python examples/dc_motor/stability.py F.svg")
    drawn, committed = (path.read_text(encoding="utf-8") for path in (Path("F.svg"), DOCS / "drive-coupling.svg"))
    labels = re.compile(r"<!-- (.*?) -->|<text[^>]*>([^<]*)|<(use)")
    assert len(labels.findall(committed)) > 50
    assert labels.findall(drawn) == labels.findall(committed)


@pytest.mark.long
def test_designing(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    accept("designing.md", follow("designing.md", tmp_path).commented(page_text("designing.md")), request)


@pytest.mark.long
def test_fitting(tmp_path: Path) -> None:
    outputs, printed, *_ = follow("fitting.md", tmp_path)
    fitted = outputs["kinfmu fit arch.toml -o fitted.toml --figure fitted.png"]
    assert "turns: holds" in fitted
    assert "local optima" in fitted
    assert (tmp_path / "fitted.png").stat().st_size > 10_000
    arch, timed = printed.splitlines()
    assert float(arch.split()[0]) < 0.2
    assert arch.endswith("mm, True")
    assert float(timed) < 10.0


@pytest.mark.long
def test_the_target_with_an_offset_finds_a_straight_line_at_any_height(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    head = 'mechanism = "jansen_leg"\nunknowns = { c = [35, 45] }\n'
    Path("flat.toml").write_text(head + files("fitting.md")["flat.toml"], encoding="utf-8")
    done = CliRunner().invoke(main, ["fit", "flat.toml", "-o", "leg.toml", "--starts", "1", "--workers", "1"])
    assert done.exit_code == 0, done.output
    assert "flat" in done.output


def over_motion(report: str) -> str:
    """The tables of measures and forces of a report."""
    return re.findall(r"^ +Over .*", report, re.MULTILINE | re.DOTALL)[0]


@pytest.mark.long
def test_forces(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("forces.md", tmp_path)
    report = followed.outputs["kinfmu check pump.toml"]
    page = with_outputs(page_text("forces.md"), over_motion(report))
    accept("forces.md", followed.commented(page), request)
    faster = followed.outputs["kinfmu check pump.toml --set piston_mass=1.2kg --set crank.speed=600rpm"]
    assert "at 600 rpm" in faster
    assert ",crank.torque," in (tmp_path / "pump.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert (tmp_path / "pump.svg").is_file()


@pytest.mark.long
@pytest.mark.parametrize("name", ["forces-reference.md", "torque.md"])
def test_forces_that_are_looked_up(name: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    accept(name, follow(name, tmp_path).commented(page_text(name)), request)


@pytest.mark.long
def test_measures(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("measures.md", tmp_path)
    report, as_json, faster = followed.outputs.values()
    page = with_outputs(page_text("measures.md"), over_motion(report))
    accept("measures.md", followed.commented(page), request)
    assert '"measures": {' in as_json
    assert "at 60 rpm" in faster


def test_the_types_of_measures_are_what_the_classes_declare(request: pytest.FixtureRequest) -> None:
    accept("measures-reference.md", with_readings(page_text("measures-reference.md")), request)


@pytest.mark.long
def test_own_linkage(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("own-linkage.md", tmp_path)
    page = with_outputs(page_text("own-linkage.md"), followed.outputs["kinfmu check press.toml"])
    accept("own-linkage.md", page, request)
    assert len((tmp_path / "turn.csv").read_text(encoding="utf-8").splitlines()) == 38
    assert {"press.svg", "press.html", "mine.toml"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.long
def test_playing_has_a_live_mechanism_with_the_length_of_the_page(tmp_path: Path) -> None:
    pytest.importorskip("anywidget", reason="anywidget is not installed")
    live = follow("playing.md", tmp_path).names["live"]
    assert live.parameters.m == 14.5
    assert live.values["crank.speed"] > 0.0


@pytest.mark.long
def test_plots_have_a_table_with_units(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    names = follow("plots.md", tmp_path).names
    assert names["table"].attrs["units"]["coupler.vx"] == "m/s"


@pytest.mark.parametrize(
    ("page", "folder"),
    [("docs/reviewing-a-run.md", "docs"), ("docs/plots.md", "docs"), ("README.md", "")],
    ids=["review", "plots", "readme"],
)
def test_pictures_are_there_of_a_size_to_load_and_made_by_the_script(page: str, folder: str) -> None:
    found = re.findall(r"(?:!\[[^\]]+\]\(|src(?:set)?=\")([\w./-]+)[)\"]", (ROOT / page).read_text(encoding="utf-8"))
    assert found
    for name in found:
        path = (ROOT / folder / name).resolve()
        assert 0 < path.stat().st_size < MOST, name
        assert path.name in SCRIPT


def test_studies(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    assert list(files("studies.md")) == ["hoeken.toml", "tolerances.toml", "lengths.toml"]
    followed = follow("studies.md", tmp_path)
    report, _, on_a_grid, _ = followed.outputs.values()
    accept("studies.md", followed.commented(with_outputs(page_text("studies.md"), report)), request)
    assert "42 designs (on a grid)" in on_a_grid
    made = {path.name for path in tmp_path.iterdir()}
    assert {"designs", "tolerances.svg", "lengths.png", "swing.svg", "tolerances.parquet", "lengths.parquet"} <= made


@pytest.mark.long
def test_system_in_ecos_and_libcosim_too(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    followed = follow("system.md", tmp_path)
    before, in_hosts = page_text("system.md").split("## 5.")
    accept("system.md", f"{followed.commented(before)}## 5.{in_hosts}", request)
    assert (tmp_path / "machine.csv").read_text(encoding="utf-8").startswith("time,rocker.phi,slide.block.x")
    assert {one.name for one in read_ssd(tmp_path / "machine.ssp", validate=True).system.elements} == {
        "feeder",
        "slide",
    }
    same, longer = (read(tmp_path / name) for name in ("machine.mcap", "longer.mcap"))
    assert abs(same["rocker.phi"] - longer["rocker.phi"]).max() > 0.01
    if find_spec("ecospy") and find_spec("libcosimpy"):
        comments = [comment for _, comment in SHOWN.findall(in_hosts)]
        printed = [line for line in followed.printed_in_host.splitlines() if re.fullmatch(r"[\d.]+ mm", line)]
        assert printed == comments
        ((late, last),) = re.findall(r"# ([\d.]+ mm), ([\d.]+ mm)$", before, re.MULTILINE)
        assert comments == [last, late]  # Ecos, libcosim


# ---------------------------------------------------------------------------------------------------------- every block


OWN_TESTS = {  # pages that their own test follows: what their reader edits between the commands is special
    "adding-a-joint.md": "test_adding_a_joint.py",
    "tutorial.md": "test_single_pages.py",
}
OWN_TOML = {"mechanism-files.md": "test_mechanism_files.py"} | OWN_TESTS  # their TOML is no file to type
CHECKED_ELSEWHERE = {  # other blocks than commands, Python and what these print: page and beginning; where, or why not
    ("coupling.md", "kinfmu: drive.ssp: connection motor.angle"): "tests/docs/test_pages.py",
    ("fitting.md", "[targets.flat]"): "tests/docs/test_pages.py",
    ("host-openmodelica.md", "importFMU("): "OpenModelica is not installed",
    ("host-osp.md", "<Simulator name="): "tests/docs/test_host_pages.py",
    ("host-osp.md", "<VariableGroupConnection>"): "tests/docs/test_host_pages.py",
    ("mechanism-files.md", "time, crank_angle [deg]"): "tests/docs/test_mechanism_files.py",
    ("mechanism-files.md", "kinfmu: press.toml: [joints.P]"): "tests/docs/test_mechanism_files.py",
}
FORMULA = re.compile(r"[^\n\"{]*( = | -> )[^\n\"{]*\n")  # neither a command nor TOML
BY_NAME = {name: blocks(page.read_text(encoding="utf-8")) for name, page in PAGES.items()}
BY_OTHERS = {
    name
    for test in Path(__file__).parent.glob("test_*.py")
    for name in re.findall(r'follow\("([\w.-]+)"', test.read_text(encoding="utf-8"))
}
FOLLOWED = [
    name
    for name, found in BY_NAME.items()
    if name not in OWN_TESTS.keys() | BY_OTHERS and any(block.kind in ("commands", "python") for block in found)
]


def _is_used(name: str, block: Block) -> bool:
    """Return whether a command, Python or another file of a page names the file that a block of TOML belongs to."""
    (file,) = (file for file, text in files(name).items() if block.text in text)
    others = [other.text for other in BY_NAME[name] if other.text != block.text]
    return any(file in text for text in others)


def problems(name: str, found: list[Block]) -> list[str]:
    """Return the blocks of a page that no test executes."""
    wrong = []
    for before, block in zip([Block("", ""), *found], found, strict=False):
        listed = any(name == page and block.head.startswith(begin) for page, begin in CHECKED_ELSEWHERE)
        if block.kind == "indented":
            is_shown = FORMULA.match(block.text)
            executed = is_shown and not any(map(is_typed, block.text.splitlines()))
        elif block.kind == "text":
            executed = before.kind in ("commands", "python", "text")  # what they print
        elif block.kind == "toml":
            executed = name in OWN_TOML or _is_used(name, block)
        elif block.file.endswith(".py"):
            executed = any(f"python {block.file}" in other.text for other in found)
        else:
            executed = block.kind in ("commands", "python")
        if not (executed or listed):
            wrong.append(f"{name}: '{block.head}': no test executes this block of kind '{block.kind}'")
    return wrong


@pytest.mark.parametrize("name", BY_NAME)
def test_every_block_of_a_page_is_executed_or_listed(name: str) -> None:
    assert problems(name, BY_NAME[name]) == []


def test_every_exception_of_the_lists_is_on_a_page() -> None:
    for page, begin in CHECKED_ELSEWHERE:
        assert any(block.head.startswith(begin) for block in BY_NAME[page]), begin
    typed = [
        line for found in BY_NAME.values() for block in found if block.kind == "commands" for line in commands(block)
    ]
    texts = [block.text for found in BY_NAME.values() for block in found if block.kind == "python"]
    for begin in NOT_RUN:
        assert any(text.startswith(begin) for text in (*typed, *texts)), begin
    for why in (*NOT_RUN.values(), *CHECKED_ELSEWHERE.values()):
        for path in re.findall(r"tests/[\w/.]+", why):
            assert (ROOT / path).exists(), path


@pytest.mark.parametrize("name", PAGES)
def test_commands_within_sentences_exist_with_their_options(name: str) -> None:
    for line in re.findall(r"`kinfmu ([a-z][^`]*)`", PAGES[name].read_text(encoding="utf-8")):
        command, *words = line.split()
        known = {name for option in main.commands[command].params for name in option.opts}
        assert {word.partition("=")[0] for word in words if re.match("--?[a-z]", word)} <= known, line


@pytest.mark.parametrize(
    "name", [name if name == "README.md" else pytest.param(name, marks=pytest.mark.long) for name in FOLLOWED]
)
def test_the_commands_and_the_python_of_a_page_run(name: str, tmp_path: Path) -> None:
    follow(name, tmp_path)
