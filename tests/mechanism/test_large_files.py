"""Files of megabytes, of thousands of bodies and parameters, and deep ones: refused in one line within a second."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from kinfmu.errors import KinfmuError
from kinfmu.mechanism.toml_file import parse

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
