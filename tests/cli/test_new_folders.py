"""Every command makes the missing folders of the files that it writes, and leaves none without a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Command


@pytest.fixture
def record(command: Command) -> str:
    assert command("simulate", "fourbar", "--stop", "1", "--mcap", "new/logs/run.mcap").exit_code == 0
    return "new/logs/run.mcap"


def test_simulate_makes_the_folders_of_record_and_recording(record: str) -> None:
    assert Path(record).is_file()
    assert Path("new/logs/run.rrd").is_file()
    assert not Path("logs").exists()


@pytest.mark.parametrize(
    "words",
    [
        "check fourbar --figure {}.svg",
        "new fourbar {}.toml",
        "schema -o {}.json",
        "solve fourbar --times 0:1:1 -o {}.csv",
        "solve fourbar --times 0:1:1 -o {}.mcap",
        "build fourbar -o {}.fmu",
        "build fourbar --ssp -o {}.ssp",
        "export cam_roller --cam pitch -o {}.csv",
    ],
)
@pytest.mark.few(2)
def test_a_command_makes_the_folders_of_its_file(words: str, command: Command) -> None:
    target = words.split("{}")[1]
    done = command(*words.format("new/deep/it").split())
    assert done.exit_code == 0, done.stderr
    assert Path(f"new/deep/it{target}").is_file()


@pytest.mark.parametrize("ending", [".csv", ".npz", ".svg", ".dxf"])
@pytest.mark.few(1)
def test_export_makes_the_folders_of_its_file(ending: str, record: str, command: Command) -> None:
    done = command("export", record, "-o", f"other/deep/run{ending}")
    assert done.exit_code == 0, done.stderr
    assert Path(f"other/deep/run{ending}").is_file()


@pytest.mark.parametrize(
    "words", ["solve {} -o new/run.csv", "check {} --figure new/f.svg", "simulate {} --mcap new/a.mcap"]
)
def test_a_command_that_fails_leaves_no_folder(words: str, fails: Callable[..., str]) -> None:
    Path("bad.toml").write_text('name = "bad"\n', encoding="utf-8")
    fails(*words.format("bad.toml").split())
    assert not Path("new").exists()
