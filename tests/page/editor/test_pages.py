"""Pages of files that are drawn in part, of new files, and of files that change while they are drawn."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import kinfmu
from kinfmu.errors import KinfmuError, MechanismError, RequestError
from kinfmu.page.editor import Session
from kinfmu.page.player import PlaySource, source
from tests.page.editor.drawn import FOURBAR, drawn, ground

PARTS = [drawn(*FOURBAR[:count]).text for count in (0, 1, 3, 5)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "mine.toml"


@pytest.fixture
def data(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Return the data of all pages that are made."""
    found: list[dict[str, object]] = []
    page_of = source.page_of

    def kept(one: dict[str, object], script: str = "") -> str:
        found.append(one)
        return page_of(one, script)

    monkeypatch.setattr(source, "page_of", kept)
    return found


@pytest.mark.parametrize("text", PARTS, ids=["empty", "ground", "bar", "without a motor"])
def test_a_file_that_is_drawn_in_part_opens_as_a_drawing(path: Path, data: list[dict[str, object]], text: str) -> None:
    path.write_text(text)
    assert "<html" in PlaySource(str(path)).page()
    assert (data[-1]["modules"], data[-1]["isEditable"]) == (None, True)


def test_only_pages_of_files_can_be_edited(path: Path, data: list[dict[str, object]]) -> None:
    kinfmu.save(kinfmu.load("fourbar"), path)
    PlaySource(str(path))
    PlaySource("fourbar")
    assert [one["isEditable"] for one in data] == [True, False]
    assert data[0]["modules"]


def test_an_invalid_file_has_no_page(path: Path) -> None:
    path.write_text(PARTS[-1].replace("[joints]", "[joint]"))
    with pytest.raises(MechanismError, match=r"mine\.toml: \[joint\]: unknown key"):
        PlaySource(str(path))


def test_a_new_file_must_not_be_there(path: Path) -> None:
    with pytest.raises(RequestError, match=r"must end in \.toml: kinfmu play --new mine\.toml"):
        PlaySource("mine", is_new=True)
    with pytest.raises(RequestError, match="there is no folder"):
        PlaySource(str(path.parent / "none" / "mine.toml"), is_new=True)
    path.write_text("")
    with pytest.raises(RequestError, match="is there already; kinfmu play"):
        PlaySource(str(path), is_new=True)


def test_a_drawing_that_is_saved_in_part_is_the_page_of_its_file(path: Path, data: list[dict[str, object]]) -> None:
    played = PlaySource(str(path), is_new=True)
    session = played.session()
    session.operate(session.number, list(FOURBAR[:4]))
    session.save(session.number)
    played.look()
    played.look()
    assert played.state.problem == ""
    assert len(data[-1]["bodies"]) == 3  # type: ignore[arg-type]  # a list


def test_a_file_that_another_program_breaks_is_reported_and_keeps_its_page(path: Path) -> None:
    path.write_text(drawn(*FOURBAR).text)
    played = PlaySource(str(path))
    path.write_text(PARTS[-1])
    played.look()
    played.look()
    assert "mobility is 1 but there is no driver" in played.state.problem


def test_changes_of_another_program_are_reported(path: Path) -> None:
    played = PlaySource(str(path), is_new=True)
    other = Session(path)
    played.report_states()
    before = played.state.editor
    other.operate(other.number, [ground(1, 1)])
    played.report_states()
    assert played.state.editor == before + 1
    other.save(other.number)
    time.sleep(0.01)
    path.write_text(PARTS[2])
    played.report_states()
    assert played.state.editor == other.number
    assert other.current()[1].text == PARTS[2]


def test_the_folder_of_states_is_that_of_the_system(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from kinfmu.page.editor.session import states_folder

    monkeypatch.delenv("KINFMU_STATES")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    assert states_folder() == tmp_path / "kinfmu" / "drawings"
    monkeypatch.setattr("sys.platform", "darwin")
    assert states_folder().parts[-3:] == ("Application Support", "kinfmu", "drawings")

    def no_home() -> Path:
        raise RuntimeError

    monkeypatch.setattr(Path, "home", no_home)
    with pytest.raises(KinfmuError, match="set KINFMU_STATES to a folder"):
        states_folder()
