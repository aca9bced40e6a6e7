"""Long texts: every pattern takes time in proportion to the text, and words with dots are not keys."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

from kinfmu.errors import MechanismError
from kinfmu.fmu.host import input_table
from kinfmu.mechanism import number, toml_document
from kinfmu.mechanism.toml_document import DEEPEST_KEY
from kinfmu.mechanism.toml_file import parse
from kinfmu.units import Quantity

LONG = 200_000  # characters
BODY = "\n[bodies.bar]\npoints = { P = [1, 0] }\n"
DOTTED = "a.b " * DEEPEST_KEY + "1.2." * DEEPEST_KEY
DEEP_KEYS = {
    "bare": "a." * DEEPEST_KEY + "a = 1",
    "in a header": "[" + "a . " * DEEPEST_KEY + "a]",
    "in quotes": "\"a b\". 'c'." * DEEPEST_KEY + "a = 1",
    "behind a text": 'x = """\n# "" \'\n""""\n' + "a." * DEEPEST_KEY + "a = 1",
    "behind a comment": "# ''' \"\"\"\n" + "a." * DEEPEST_KEY + "a = 1",
    "in a table": "x = { " + "a." * DEEPEST_KEY + "a = 1 }",
    "behind a value": "x = ['''a''', " + '"""b"""' + "]\n" + "a." * DEEPEST_KEY + "a = 1",
}
HOLDERS = {
    "a comment": f"# {DOTTED}",
    "a comment behind a value": f"title = 'a' # {DOTTED}",
    "a title": f'title = "{DOTTED}"',
    "a title with quotes": f'title = "\\"{DOTTED}\\" {DOTTED}"',
    "a title in single quotes": f"title = '\"{DOTTED}'",
    "a title on several lines": f'title = """\\\n  ""{DOTTED} \'"""',
}


def _numbers(text: str) -> None:
    with pytest.raises(MechanismError):
        number.read_number("x", text, Quantity("length"), "m")


PATTERNS: dict[str, Callable[[str], object]] = {
    "a number": _numbers,
    "a unit of a table": toml_document._unit,
    "a title of inputs": input_table._title,
    "keys": toml_document._deep_key,
}
REPEATED = (
    " ",
    "a ",
    "a",
    "1",
    "1.",
    "[",
    "[]",
    "- ",
    "\t.",
    "a.",
    '"',
    "'",
    '"\\"',
    '"""\\"',
    "'''\n",
    "#",
    "a" * 40 + ".",
)


@pytest.mark.parametrize("repeated", REPEATED)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_long_text_is_searched_in_less_than_a_second(pattern: str, repeated: str) -> None:
    for end in ("!", "a", "]"):
        began = time.process_time()
        PATTERNS[pattern]("a" + repeated * (LONG // len(repeated)) + end)
        assert time.process_time() - began < 1.0


@pytest.mark.parametrize("holder", HOLDERS)
def test_words_with_dots_in_comments_and_texts_are_not_keys(holder: str) -> None:
    assert parse(f'name = "a"\n{HOLDERS[holder]}{BODY}').name == "a"


@pytest.mark.parametrize("place", DEEP_KEYS)
def test_a_key_of_too_many_parts_is_refused_wherever_it_is(place: str) -> None:
    text = f'name = "a"\n{HOLDERS["a title"]}\n{DEEP_KEYS[place]}\n'
    line = text[: text.index(DEEP_KEYS[place])].count("\n") + DEEP_KEYS[place].count("\n") + 1
    with pytest.raises(MechanismError, match=f"a key of more than {DEEPEST_KEY} parts [(]at line {line}[)]"):
        parse(text)


def test_messages_list_a_hundred_names_at_most() -> None:
    parameters = "".join(f"p{k} = {k}\n" for k in range(3000))
    bodies = "".join(f"[bodies.b{k}]\n" for k in range(3000))
    references = '[joints.J]\ntype = "revolute"\nbetween = ["body.P", "b1.P"]\n'
    outputs = '[outputs]\ncoordinates = ["body.x"]\n'
    for more in ('q = "parameter + 1"\n[bodies.bar]\n', f"{bodies}{references}", f"{bodies}{outputs}"):
        with pytest.raises(MechanismError) as caught:
            parse(f'name = "a"\n[parameters]\n{parameters}{more}')
        assert len(str(caught.value)) < 1500
        assert str(caught.value).endswith("in all)")


def test_numbers_and_keys_of_few_parts_are_accepted() -> None:
    points = ", ".join(["[0.5, 0.25]"] * 200)
    text = f'name = "a"\nbodies.bar.points.P = [1.5, 0.5]\n[joints]\nx = {{ type = "nothing", points = [{points}] }}\n'
    with pytest.raises(MechanismError, match="type = 'nothing' is not known"):
        parse(text)
