"""Commands that messages suggest can be pasted into a shell, whatever the folder of the file is called."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import kinfmu
from kinfmu.cli import main
from tests.cli.conftest import Command
from tests.design.study.linkage import write

NAMES = "|".join(sorted(main.commands))
HINT = re.compile(rf"kinfmu ((?:{NAMES}) [^;|]*)")
FOLDERS = ["a b", "it's", 'the "best" one', "$HOME & more"]
FIT = """mechanism = "mine.toml"
unknowns.crank = [0.9, 1.1]
[targets.curve]
type = "path"
of = "coupler.B"
points = [[1.0, 1.0], [1.5, 1.0]]
step = "30 deg"
start = "80 deg"
"""


def hints(text: str) -> dict[str, list[str]]:
    """Return the words of the commands in a text, by the name of the command; a ValueError where quotes are open."""
    found = [shlex.split(match[1]) for line in text.splitlines() for match in HINT.finditer(line)]
    return {words[0]: words[1:] for words in found}


def test_a_hint_without_quotes_is_found() -> None:
    assert hints("run.mcap: written; next: kinfmu check a b/mine.toml") == {"check": ["a", "b/mine.toml"]}
    with pytest.raises(ValueError, match="No closing quotation"):
        hints("run.mcap: written; next: kinfmu check it's/mine.toml")


@pytest.mark.parametrize("name", FOLDERS)
@pytest.mark.parametrize("is_absolute", [False, True])
@pytest.mark.few(1)
def test_suggested_commands_name_the_file_also_in_folders_with_blanks_and_quotes(
    name: str, is_absolute: bool, command: Command, tmp_path: Path
) -> None:
    folder = (tmp_path if is_absolute else Path()) / name
    (tmp_path / name).mkdir()
    mine, run, fmu = folder / "mine.toml", folder / "run.mcap", folder / "mine.fmu"
    suggested: dict[str, dict[str, list[str]]] = {}

    def says(*arguments: object, status: int = 0) -> None:
        result = command(*arguments)
        assert result.exit_code == status, result.stderr
        suggested.setdefault(str(arguments[0]), {}).update(hints(result.stdout + result.stderr))

    says("new", "fourbar", mine)
    says("check", mine)
    says("solve", mine, "-o", folder / "solved.csv")
    says("export", mine, "-o", folder / "mine.gif", status=2)
    assert suggested["export"] == {"solve": [str(mine), "-o", str(folder / "mine.mcap")]}
    assert command("solve", *suggested.pop("export")["solve"]).exit_code == 0
    says("build", mine, "-o", fmu, "--flavour", "python")
    says("simulate", fmu, "--stop", 0.2, "--step", 0.1, "--mcap", run)
    says("export", run, "-o", folder / "run.csv")
    content = run.read_bytes()
    cut = folder / "cut.mcap"
    cut.write_bytes(content[: 9 * len(content) // 10])
    says("export", cut, "-o", folder / "cut.csv", status=1)
    says("review", cut, "--save", folder / "cut.rrd", status=1)
    driven = folder / "driven.fmu"
    says("build", "fourbar_loaded", "-o", driven, "--flavour", "python", "--drive", "torque")
    says("verify", driven, "--results", folder / "run.csv", status=1)

    assert {one: found for one, found in suggested.items() if found} == {
        "new": {"check": [str(mine)]},
        "simulate": {"review": [str(run)]},
        "export": {"recover": [str(cut), "keeps", "what", "is", "left"]},
        "review": {"recover": [str(cut), "keeps", "what", "is", "left"]},
        "verify": {"simulate": [str(driven)]},
    }


@pytest.mark.parametrize("name", FOLDERS)
@pytest.mark.few(2)
def test_studies_and_fits_suggest_no_command_that_names_a_file_without_quotes(
    name: str, tmp_path: Path, command: Command
) -> None:
    folder = tmp_path / name
    folder.mkdir()
    study = write(folder, 'mechanism = "hoeken.toml"\nparameters.base = { from = 40, to = 300, count = 3 }\n')
    kinfmu.save(kinfmu.load("fourbar"), folder / "mine.toml")
    (folder / "fit.toml").write_text(FIT, encoding="utf-8")
    for arguments in (
        ("study", study, "-o", folder / "found.parquet", "--workers", 1),
        ("fit", folder / "fit.toml", "-o", folder / "fitted.toml", "--starts", 1, "--workers", 1),
    ):
        result = command(*arguments)
        for words in hints(result.stdout + result.stderr).values():
            assert all(Path(word).exists() for word in words if str(tmp_path) in word)
