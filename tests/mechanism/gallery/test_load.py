"""The gallery, and finding, writing and reading mechanisms by name or file."""

from __future__ import annotations

from pathlib import Path

import pytest

import kinfmu
from kinfmu.errors import MechanismError, RequestError
from kinfmu.mechanism import gallery


def test_the_two_reference_mechanisms_are_in_the_gallery() -> None:
    assert {"fourbar", "double_pendulum"} <= set(gallery.names())
    assert gallery.names() == sorted(gallery.names())


@pytest.mark.parametrize("name", gallery.names())
def test_a_mechanism_of_the_gallery_has_its_folders_name_a_title_and_a_comment(name: str) -> None:
    mechanism = gallery.load(name)
    assert mechanism.name == name
    assert mechanism.title
    assert (gallery.folder() / name / "mechanism.toml").read_text(encoding="utf-8").startswith("# ")


def test_an_unknown_name_suggests_a_known_one() -> None:
    with pytest.raises(RequestError) as caught:
        kinfmu.load("forbar")
    assert str(caught.value) == (
        "'forbar' is not in the gallery; did you mean 'fourbar'?; "
        f"gallery: {', '.join(gallery.names())}; files end in .toml"
    )
    with pytest.raises(RequestError, match=r"^'' is not in the gallery; gallery: "):
        kinfmu.load("")


def test_a_mechanism_is_loaded_from_a_file_by_text_or_path(tmp_path: Path) -> None:
    mechanism = kinfmu.load("fourbar")
    path = kinfmu.save(mechanism, tmp_path / "mine.toml")
    assert path == tmp_path / "mine.toml"
    assert kinfmu.load(path) == kinfmu.load(str(path)) == mechanism
    other = tmp_path / "no_suffix"
    kinfmu.save(mechanism, other)
    assert kinfmu.load(other) == kinfmu.load(str(other)) == mechanism


def test_saving_to_an_unwritable_path_is_an_error(tmp_path: Path) -> None:
    mechanism = kinfmu.load("fourbar")
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "mine.toml"
    with pytest.raises(MechanismError) as caught:
        kinfmu.save(mechanism, path)
    assert str(caught.value) == f"{path}: cannot be written (Not a directory)"


def test_a_saved_file_has_the_same_bytes_on_every_system(tmp_path: Path) -> None:
    content = kinfmu.save(kinfmu.load("fourbar"), tmp_path / "mine.toml").read_bytes()
    assert b"\r" not in content
    assert content.endswith(b'\n[outputs]\ncoordinates = "moving"\n')


@pytest.mark.parametrize("purpose", ["check", "solve", "build"])
def test_a_name_in_place_of_a_mechanism_is_refused(purpose: str) -> None:
    door = getattr(kinfmu, purpose)
    with pytest.raises(RequestError) as caught:
        door("fourbar")
    assert str(caught.value) == f"{purpose} needs a Mechanism: kinfmu.load('fourbar') gives it"
    with pytest.raises(
        RequestError, match=f"^{purpose} needs a Mechanism, not dict; kinfmu.load gives one by its name$"
    ):
        door({})


def test_simulate_reports_that_a_mechanism_is_built_first() -> None:
    with pytest.raises(
        RequestError,
        match=r"^simulate steps an FMU; build\(mechanism\) makes one of mechanism 'fourbar'; .*drive='torque'\)",
    ):
        kinfmu.simulate(kinfmu.load("fourbar"))
