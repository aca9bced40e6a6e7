"""kinfmu import: what it prints, writes and notes."""

from __future__ import annotations

from pathlib import Path

import pytest

import kinfmu
from kinfmu.mechanism.imports import imported
from tests.cli.conftest import Command
from tests.mechanism.imports.pmks_links import CASES

FOLDER = Path(__file__).parents[1] / "mechanism" / "imports" / "linkage"


def test_a_link_is_printed_as_a_mechanism_file(command: Command) -> None:
    link = CASES["two machines and a loose bar"].link
    result = command("import", link)
    assert result.exit_code == 0
    assert result.stdout == imported(link).text
    assert result.stderr == "kinfmu: note: nothing connects these with the ground, so they are left out: loose\n"


def test_a_file_is_written_with_its_notes_and_checks(command: Command, tmp_path: Path) -> None:
    result = command("import", FOLDER / "boom.linkage2", "-o", "new/boom.toml")
    assert (result.exit_code, result.stdout) == (0, "new/boom.toml: written; next: kinfmu check new/boom.toml\n")
    text = (tmp_path / "new" / "boom.toml").read_text(encoding="utf-8")
    note = result.stderr.removeprefix("kinfmu: note: ")
    assert f"# Left out, or chosen:\n#   {note}" in text
    assert kinfmu.load(tmp_path / "new" / "boom.toml").name == "boom"
    assert command("check", "new/boom.toml").exit_code == 0


def test_the_content_shows_the_format(command: Command, tmp_path: Path) -> None:
    (tmp_path / "link.txt").write_text(CASES["a crank-rocker"].link + "\n", encoding="utf-8")
    assert 'name = "link"' in command("import", "link.txt").stdout
    (tmp_path / "ansi.dat").write_bytes((FOLDER / "four_bar.linkage2").read_bytes().replace(b'"crank"', b'"K\xfcrbel"'))
    result = command("import", "ansi.dat")
    assert "[bodies.K_rbel]" in result.stdout
    assert result.stderr == "kinfmu: note: names made valid: 'Kürbel' is K_rbel\n"


@pytest.mark.parametrize("name", ["-", "none.linkage2"])
def test_a_missing_file_is_wrong_usage(name: str, command: Command) -> None:
    assert command("import", name).exit_code == 2
