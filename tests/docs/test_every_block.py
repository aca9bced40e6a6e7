"""Every command and every block of Python of every page runs, or a list states why not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kinfmu.cli import main
from tests.docs.blocks import PAGES, ROOT, Block, blocks, commands, is_typed
from tests.docs.follow import NOT_RUN, files, follow

OWN_TESTS = {  # pages that their own test follows: what their reader edits between the commands is special
    "adding-a-joint.md": "test_adding_a_joint.py",
    "tutorial.md": "test_tutorial.py",
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
    ("tutorial.md", "tip"): "a sketch",
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
            is_shown = FORMULA.match(block.text) or name.startswith("fmus/")  # there are sketches of the mechanism
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


def test_a_block_that_no_test_executes_is_found() -> None:
    page = "Text:\n\n```console\n$ kinfmu list\n```\n\n    motor -e 5\n    kinfmu list\n\n```text\nfourbar\n```\n"
    wrong = problems("page.md", blocks(page))
    assert [line.split("'")[1] for line in wrong] == ["$ kinfmu list", "motor -e 5", "fourbar"]


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


def test_pages_with_a_test_of_their_own_have_it() -> None:
    for name, test in OWN_TESTS.items():
        assert name in (Path(__file__).parent / test).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "name", [name if name == "README.md" else pytest.param(name, marks=pytest.mark.long) for name in FOLLOWED]
)
def test_the_commands_and_the_python_of_a_page_run(name: str, tmp_path: Path) -> None:
    follow(name, tmp_path)
