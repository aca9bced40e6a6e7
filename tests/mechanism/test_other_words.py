"""Messages about words of other programs and of drawings suggest the words that files accept."""

from __future__ import annotations

import pytest

from kinfmu.errors import OTHER_WORDS, MechanismError, suggestion
from kinfmu.mechanism.toml_file import parse
from tests.analysis.test_design_notes import FOURBAR


@pytest.mark.parametrize(
    ("old", "new", "meant"),
    [
        ('O = { type = "revolute"', 'O = { type = "pin"', "revolute"),
        ('O = { type = "revolute"', 'O = { type = "hinge"', "revolute"),
        ('O = { type = "revolute"', 'O = { type = "prismatic"', "translational"),
        ('O = { type = "revolute"', 'O = { type = "slider"', "translational"),
        ('"78 deg"', '"78 degrees"', "deg"),
        ("x = 20,", 'x = "20 inches",', "in"),
        ('length = "mm"', 'length = "inches"', "in"),
    ],
)
def test_a_word_of_another_program_suggests_the_word_of_kinfmu(old: str, new: str, meant: str) -> None:
    with pytest.raises(MechanismError, match=rf"; did you mean '{meant}'\?"):
        parse(FOURBAR.replace(old, new), "fourbar.toml")


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ('"78 deg"', '"78°"', '"78 deg"'),
        ('"78 deg"', '"78 °"', '"78 deg"'),
        ('"78 deg"', '"30° + 48°"', '"30 deg + 48 deg"'),
        ("x = 20,", 'x = "20 inch",', 'x = "20 in",'),
        ("x = 20,", 'x = "2*(4 inch + 0.5inch)",', 'x = "2*(4 in + 0.5in)",'),
        ('length = "mm"', 'length = "inch"', 'length = "in"'),
    ],
)
def test_degree_sign_and_inch_are_units(old: str, new: str, same: str) -> None:
    assert old in FOURBAR
    found, wanted = (parse(FOURBAR.replace(old, text), "fourbar.toml") for text in (new, same))
    assert (found.bodies, found.length_unit) == (wanted.bodies, wanted.length_unit)


def test_another_word_is_suggested_only_where_its_meaning_is_known() -> None:
    assert suggestion("pin", ["crank", "coupler"]) == ""
    assert {suggestion(word, [meant]) for word, meant in OTHER_WORDS.items()} == {
        f"; did you mean '{meant}'?" for meant in OTHER_WORDS.values()
    }


@pytest.mark.parametrize("word", ["ram.X", "RAM.X", "Ram.x"])
def test_another_case_is_the_nearest_spelling(word: str) -> None:
    for known in (["ram.x", "ram.y", "ram.vx"], ["ram.y", "ram.z", "ram.x"]):
        assert suggestion(word, known) == "; did you mean 'ram.x'?"


@pytest.mark.parametrize(
    ("word", "known", "meant"),
    [
        ("tol", ("from", "to", "tolerance", "nominal"), "tolerance"),
        ("Tol", ("from", "to", "tolerance", "nominal"), "tolerance"),
        ("tol", ("crank.start", "solver.tolerance"), "solver.tolerance"),
        ("amp", ("amplitude", "frequency"), "amplitude"),
        ("Couplr.X", ("coupler.x", "coupler.y"), "coupler.x"),
    ],
)
def test_the_beginning_of_a_word_is_taken_for_the_word(word: str, known: tuple[str, ...], meant: str) -> None:
    assert suggestion(word, known) == f"; did you mean '{meant}'?"


def test_the_beginning_of_several_words_is_taken_for_none() -> None:
    assert suggestion("tol", ["tolerance", "tolerable"]) == ""
