"""docs/records.md says what is in a record, and its code runs."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

import kinfmu
from kinfmu.cli import main
from kinfmu.errors import RequestError
from kinfmu.log import McapLog, read
from kinfmu.mechanism import gallery
from kinfmu.run.channels import absent_columns

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
