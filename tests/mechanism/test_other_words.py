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
        ('"78 deg"', '"78°"', "deg"),
        ('"78 deg"', '"78 degrees"', "deg"),
        ("x = 20,", 'x = "20 inch",', "in"),
        ('length = "mm"', 'length = "inch"', "in"),
    ],
)
def test_a_word_of_another_program_suggests_the_word_of_kinfmu(old: str, new: str, meant: str) -> None:
    with pytest.raises(MechanismError, match=rf"; did you mean '{meant}'\?"):
        parse(FOURBAR.replace(old, new), "fourbar.toml")


def test_another_word_is_suggested_only_where_its_meaning_is_known() -> None:
    assert suggestion("pin", ["crank", "coupler"]) == ""
    assert {suggestion(word, [meant]) for word, meant in OTHER_WORDS.items()} == {
        f"; did you mean '{meant}'?" for meant in OTHER_WORDS.values()
    }
