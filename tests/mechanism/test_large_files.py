"""Large files and long texts: read in time, and quoted briefly in messages."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from kinfmu.errors import KinfmuError, MechanismError
from kinfmu.fmu.host import input_table
from kinfmu.mechanism import number, toml_document
from kinfmu.mechanism.toml_document import DEEPEST_KEY
from kinfmu.mechanism.toml_file import parse
from kinfmu.units import Quantity

SECOND = 1.0  # of the processor, so that other programs do not count
TRIES = 3  # some wait for the garbage collection of what other tests left
LONGEST = 1000  # characters of a message, which lists a hundred names
START, ARM = 'name = "a"\n', "[bodies.arm]\npoints = { O = [0, 0] }\n"
BODIES = "".join(f"[bodies.b{k}]\npoints = {{ P = [{k}, 0] }}\n" for k in range(5000))
CHAIN = "".join(f'p{k} = "p{k - 1} + 1"\n' for k in range(1, 10_000))
CIRCLE = "".join(f'p{k} = "p{(k + 1) % 10_000} + 1"\n' for k in range(10_000))
FILES = {
    "ten megabytes": ("#" * 10_000_000, "too large for a mechanism (largest: 4000000 characters)"),
    "bodies": (
        f'{START}{BODIES}[joints.J]\ntype = "revolute"\nbetween = ["b0.P", "b5000.P"]\n',
        "[joints.J] between",
    ),
    "parameters": (f'{START}[parameters]\np0 = "nothing"\n{CHAIN}{ARM}', "p0"),
    "circular parameters": (f"{START}[parameters]\n{CIRCLE}{ARM}", "[parameters] p0 needs itself: p0 -> p1 -> p2 -> "),
    "a power of a power": (f'{START}[parameters]\np = "9**9**9"\n{ARM}', "expected parentheses around a power"),
    "powers in parentheses": (f'{START}[parameters]\np = "(((9**9)**9)**9)**9"\n{ARM}', "[parameters] p"),
    "parentheses": (f'{START}[parameters]\np = "{"(" * 2000}1{")" * 2000}"\n{ARM}', "too long for an expression"),
    "lists": (f"{START}x = {'[' * 1_000_000}", "not valid TOML: nested too deeply"),
    "tables": (f"{START}x{' = {x' * 100_000}", "not valid TOML: nested too deeply"),
}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.few(1)
def test_a_large_file_is_refused_in_one_line_and_less_than_a_second(name: str) -> None:
    text, reason = FILES[name]
    taken = []
    for _ in range(TRIES):
        began = time.process_time()
        with pytest.raises(KinfmuError) as refusal:
            parse(text, "a.toml", Path())
        taken.append(time.process_time() - began)
    message = str(refusal.value)
    assert message.startswith("a.toml: ")
    assert reason in message
    assert len(message.splitlines()) == 1
    assert len(message) <= LONGEST
    assert min(taken) < SECOND


# ------------------------------------------------------------------------------------------------------------ long text


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
