"""States on disk: undo, saving, other programs that write the file, other processes, and being killed."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kinfmu.errors import KinfmuError, MechanismError, RequestError
from kinfmu.page.editor import Drawing, Session, StaleState, changed
from tests.page.editor.drawn import FOURBAR, bar, ground


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "mine.toml"


def draw(session: Session, *operations: dict[str, object]) -> list[str]:
    """Make operations, one state each, and return the texts after each."""
    texts = []
    for operation in operations:
        session.operate(session.number, [operation])
        texts.append(session.current()[1].text)
    return texts


def test_undo_to_empty_and_redo_give_the_same_bytes(path: Path) -> None:
    session = Session(path)
    texts = [session.current()[1].text, *draw(session, *FOURBAR)]
    for text in reversed(texts[:-1]):
        session.undo(session.number)
        assert session.current()[1].text == text
    with pytest.raises(RequestError, match="nothing to undo"):
        session.undo(session.number)
    for text in texts[1:]:
        session.redo(session.number)
        assert session.current()[1].text == text
    with pytest.raises(RequestError, match="nothing to redo"):
        session.redo(session.number)


def test_states_are_there_after_the_program_has_ended(path: Path) -> None:
    before = Session(path)
    texts = draw(before, *FOURBAR)
    number, drawing, about = Session(path).current()
    assert (number, drawing.text) == (before.number, texts[-1])
    assert (about["isSaved"], about["canUndo"]) == (False, True)
    assert not path.exists()


def test_only_saving_writes_the_file(path: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    assert not path.exists()
    session.save(session.number)
    assert path.read_text() == text
    assert session.current()[2]["isSaved"]
    draw(session, ground(5, 5))
    assert path.read_text() == text
    assert not session.current()[2]["isSaved"]


def test_what_another_program_wrote_is_the_next_state_if_nothing_is_unsaved(path: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    session.save(session.number)
    path.write_text(f"# by hand\n{text}")
    number, drawing, about = session.current()
    assert drawing.text == f"# by hand\n{text}"
    assert about["isSaved"]
    session.undo(number)
    assert session.current()[1].text == text


def test_what_another_program_wrote_is_never_overwritten_unasked(path: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    session.save(session.number)
    mine = draw(session, ground(5, 5))[-1]
    theirs = f"# by hand\n{text}"
    path.write_text(theirs)
    assert session.current()[1].text == mine
    assert session.current()[2]["isFileChanged"]
    with pytest.raises(StaleState, match=r"mine\.toml was changed by another program"):
        session.save(session.number)
    assert path.read_text() == theirs
    session.save(session.number, force=True)
    assert path.read_text() == mine
    session.undo(session.number)
    assert session.current()[1].text == theirs
    session.undo(session.number)
    assert session.current()[1].text == text


def test_the_text_of_another_program_is_loaded_when_asked(path: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    session.save(session.number)
    mine = draw(session, ground(5, 5))[-1]
    path.write_text(f"# by hand\n{text}")
    session.operate(session.number, [{"do": "reload"}])
    assert session.current()[1].text == f"# by hand\n{text}"
    assert session.current()[2]["isSaved"]
    session.undo(session.number)
    assert session.current()[1].text == mine


def test_a_broken_file_of_another_program_is_not_loaded(path: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    session.save(session.number)
    path.write_text("name = ")
    assert session.current()[1].text == text
    with pytest.raises(MechanismError, match="not valid TOML"):
        session.operate(session.number, [{"do": "reload"}])
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(MechanismError, match="is no text"):
        session.operate(session.number, [{"do": "reload"}])
    with pytest.raises(MechanismError, match="is no text, so it is not overwritten"):
        session.save(session.number, force=True)
    assert path.read_bytes() == b"\xff\xfe"


def test_a_new_drawing_of_a_file_that_was_removed_begins_empty(path: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    session.save(session.number)
    path.unlink()
    again = Session(path)
    assert again.current()[1].document["bodies"] == {"ground": {"points": {}}}
    again.undo(again.number)
    assert again.current()[1].text == text


def test_a_program_begins_with_the_file_and_can_go_back_to_what_was_unsaved(path: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    session.save(session.number)
    mine = draw(session, ground(5, 5))[-1]
    path.write_text(f"# by hand\n{text}")
    again = Session(path)
    assert again.current()[1].text == f"# by hand\n{text}"
    again.undo(again.number)
    assert again.current()[1].text == mine


def test_requests_for_older_states_change_nothing(path: Path) -> None:
    session = Session(path)
    draw(session, *FOURBAR)
    number, drawing, _ = session.current()
    for wrong in (number - 1, number + 1, 0, None, True, "1", 1.5, [number]):
        with pytest.raises(StaleState, match=f"it is state {number} now"):
            session.operate(wrong, [ground(5, 5)])
        with pytest.raises(StaleState):
            session.undo(wrong)
        with pytest.raises(StaleState):
            session.save(wrong)
    assert session.current()[:2] == (number, drawing)


def test_two_programs_on_one_file_share_its_states(path: Path) -> None:
    first, second = Session(path), Session(path)
    number = second.number
    draw(first, *FOURBAR)
    with pytest.raises(StaleState):
        second.operate(number, [ground(5, 5)])
    assert second.current()[1].text == first.current()[1].text
    draw(second, ground(5, 5))
    first.undo(first.number)
    assert second.current()[1].text == first.current()[1].text


def test_damaged_states_begin_again_with_the_file(path: Path, states_folder: Path) -> None:
    session = Session(path)
    *_, text = draw(session, *FOURBAR)
    session.save(session.number)
    (states,) = states_folder.rglob("states.json")
    good = states.read_bytes()
    for damage in (b"", b"{", b"[]", b'{"number": "x"}', good.replace(b".toml", b".gone"), b"\xff"):
        states.write_bytes(damage)
        assert Session(path).current()[1].text == text


def test_a_folder_that_cannot_be_written_is_one_line(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path.write_text("")
    monkeypatch.setenv("KINFMU_STATES", str(path / "below_a_file"))
    with pytest.raises(KinfmuError, match="set KINFMU_STATES to a folder that you can write") as raised:
        Session(path)
    assert "\n" not in str(raised.value)


def test_a_file_with_line_ends_of_windows_keeps_them(path: Path) -> None:
    text = changed(Session(path).current()[1], [bar(("ground", 0, 0), (30, 0))]).text
    path.write_bytes(text.replace("\n", "\r\n").encode())
    session = Session(path)
    draw(session, bar("link_1.B", (50, 0)))
    session.save(session.number)
    written = path.read_bytes()
    assert written.count(b"\n") == written.count(b"\r\n")
    assert Drawing.read(path).mechanism.moving_bodies[1].name == "link_2"


_DRAWER = """
import sys
from kinfmu.page.editor import Session
session = Session(sys.argv[1])
print("begin", flush=True)
for k in range(10_000):
    session.operate(session.number, [{"do": "ground", "at": {"at": [k, int(sys.argv[2])]}}])
    print(f"state {k}", flush=True)
    session.save(session.number)
    print(f"saved {k}", flush=True)
"""


def test_being_killed_loses_nothing(path: Path) -> None:
    rng = random.Random(7)  # noqa: S311  for times, not for secrets
    for trial in range(5):
        arguments = [sys.executable, "-c", _DRAWER, str(path), str(trial)]
        with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True, env=os.environ) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "begin\n"
            time.sleep(rng.uniform(0.1, 0.4))
            process.send_signal(signal.SIGKILL)
            lines = process.stdout.read().splitlines()
        stated, saved = (
            max([int(line.split()[1]) for line in lines if line.startswith(word)], default=-1)
            for word in ("state", "saved")
        )
        drawing = Session(path).current()[1]
        places = drawing.document["bodies"]["ground"]["points"].values()
        assert [stated, trial] in places or stated < 0
        written = Drawing.read(path).document["bodies"]["ground"]["points"].values() if path.exists() else []
        assert [saved, trial] in written or saved < 0


def test_the_list_of_states_never_names_a_text_that_is_not_there(path: Path, states_folder: Path) -> None:
    session = Session(path)
    draw(session, *FOURBAR)
    (states,) = states_folder.rglob("states.json")
    names = json.loads(states.read_text())["texts"]
    assert {one.name for one in states.parent.glob("*.toml")} == set(names)


def folders(states_folder: Path) -> list[Path]:
    return [*states_folder.iterdir()] if states_folder.exists() else []


def test_states_with_nothing_to_undo_end_with_the_program(path: Path, states_folder: Path) -> None:
    Session(path).close()
    assert folders(states_folder) == []
    session = Session(path)
    draw(session, *FOURBAR)
    session.close()
    assert len(folders(states_folder)) == 1  # not saved
    again = Session(path)
    again.save(again.number)
    again.close()
    assert Session(path).current()[2]["canUndo"]


@pytest.mark.parametrize(
    ("is_saved", "is_used", "is_kept"), [(True, False, False), (False, False, True), (True, True, True)]
)
def test_states_of_saved_drawings_go_after_a_month(
    path: Path, states_folder: Path, is_saved: bool, is_used: bool, is_kept: bool
) -> None:
    session = Session(path)
    draw(session, *FOURBAR)
    if is_saved:
        session.save(session.number)
    (listed,) = states_folder.rglob("states.json")
    age = 29 if is_used else 31
    os.utime(listed, times=(time.time() - age * 86400, time.time() - age * 86400))
    other = Session(path.with_name("other.toml"))
    assert len(folders(states_folder)) == 1 + is_kept
    draw(other, ground(0, 0))
    if is_kept:
        assert Session(path).current()[2]["canUndo"]
