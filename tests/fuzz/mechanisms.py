"""Hostile mechanism files: texts, names, expressions, damaged bytes, sizes, and names of files."""

from __future__ import annotations

import random
import re
import time
import unicodedata
from collections.abc import Callable
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from kinfmu.cli import main
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.mechanism.expression import Expression
from kinfmu.mechanism.toml_file import parse
from kinfmu.run.solve import solve
from tests.fuzz.generated import faults
from tests.fuzz.guarded import PATIENCE, failure, guarded
from tests.fuzz.hostile_text import CANARY, IDENTIFIERS, hostile, toml
from tests.fuzz.summary import Summary

QUICK = 1.0  # [s] of the processor that a refusal may take
LONGEST = 3000  # characters of a message
BUILDING = 120.0  # [s] for a trial that may build an FMU, of which a compiler makes the page
SAMPLES = np.linspace(0.0, 2.0, 5)  # [s]
Find = Callable[[str], None]
Kind = Callable[[random.Random, Find], None]  # does one trial

FILE = """\
name = <name>
title = <title>
units = { length = <unit> }
[parameters]
<crank> = { value = "40 mm", description = <description> }
<rod> = <expression>
[bodies.ground]
points = { O = [0, 0], C = ["120 mm", 0] }
[bodies.<arm>]
points = { O = [0, 0], <tip> = [<crank_text>, 0] }
start = { phi = "60 deg" }
[bodies.coupler]
points = { P = [0, 0], Q = ["110 mm", 0] }
start = { x = "20 mm", y = "35 mm", phi = "20 deg" }
[bodies.rocker]
points = { C = [0, 0], Q = ["80 mm", 0] }
start = { x = "120 mm", phi = "90 deg" }
[joints]
O = { type = "revolute", between = ["ground.O", <arm_O>] }
<joint> = { type = "revolute", between = [<arm_tip>, "coupler.P"] }
Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }
C = { type = "revolute", between = ["ground.C", "rocker.C"] }
[drivers]
<driver> = { type = "angle", of = <arm_text>, law = <law>, start = "60 deg", speed = "1 rad/s" }
[points]
<point> = "coupler.Q"
[outputs]
coordinates = <coordinates>
<more>
"""
PLAIN = {
    "name": '"fourbar"',
    "title": '"A title"',
    "unit": '"mm"',
    "description": '"A length"',
    "expression": '"2*crank"',
    "law": '"constant_speed"',
    "coordinates": '"moving"',
    "more": "",
    "crank": "crank",
    "rod": "rod",
    "arm": "arm",
    "tip": "P",
    "joint": "P",
    "driver": "crank",
    "point": "end",
}
TEXT_SLOTS = ("name", "title", "unit", "description", "expression", "law", "coordinates", "crank_text", "arm_O", "more")
NAME_SLOTS = ("crank", "rod", "arm", "tip", "joint", "driver", "point")
ATOMS = "crank pi 1e308 9 1e-320 0 - sin( sqrt( ( ) ** * / + , x mm 1mm 5 deg"  # of expressions
TITLES = ("title", "description")  # slots that take nearly every text


def run(seed: int, seconds: float) -> Summary:
    """Trials from `seed` on for about so many seconds."""
    return guarded("mechanisms", seed, seconds, patience=_patience, kind=kind_of)


def _patience(seed: int) -> float:
    """Time that a trial has [s]."""
    return BUILDING if kind_of(seed) in BUILDS else PATIENCE


def trial(seed: int, summary: Summary) -> None:
    """One trial."""
    drawn = random.Random(seed)  # noqa: S311  # no secret
    kind = kind_of(seed)
    name = kind.__name__.strip("_")
    summary.count(name)
    kind(drawn, lambda text: summary.find(seed, name, text[:500]))


def kind_of(seed: int) -> Kind:
    """The kind of a trial."""
    rare = RARE.get(seed // 10 % 8) if seed % 10 == 9 else None
    return rare or (_titles, _words, _names, _expressions, _bytes)[seed % 5]


def written(changes: dict[str, str]) -> str:
    """The file with other values in its slots."""
    slots = PLAIN | changes
    slots.setdefault("crank_text", f'"{slots["crank"]}"')
    slots.setdefault("arm_O", f'"{slots["arm"]}.O"')
    slots.setdefault("arm_tip", f'"{slots["arm"]}.{slots["tip"]}"')
    slots.setdefault("arm_text", f'"{slots["arm"]}"')
    slots["expression"] = slots["expression"].replace("crank", slots["crank"])
    return re.sub(r"<(\w+)>", lambda match: slots[match[1]], FILE)


def read(text: str, find: Find) -> Mechanism | None:
    """The mechanism, None if it is refused in one line and less than a second."""
    began = time.process_time()
    try:
        return parse(text, "a.toml", Path())
    except KinfmuError as error:
        judge_refusal(str(error), time.process_time() - began - len(text) / 1e6, find)  # a second a megabyte
        return None


def judge_refusal(message: str, seconds: float, find: Find) -> None:
    """Find a refusal that is slow, long, or more than one line."""
    if seconds > QUICK:
        find(f"the refusal takes {seconds:.1f} s: {message[:100]}")
    if len(message.splitlines()) != 1 or any(unicodedata.category(c) == "Cc" for c in message):
        find(f"the refusal is not one line: {message[:200]!r}")
    if len(message) > LONGEST:
        find(f"the refusal has {len(message)} characters: {message[:100]}")


def _titles(drawn: random.Random, find: Find) -> None:
    """Title and description, which take nearly every text: what is generated is looked through."""
    mechanism = read(written({slot: toml(hostile(drawn)) for slot in TITLES}), find)
    if mechanism is not None:
        _look_through(mechanism, f"title {mechanism.title[:80]!r}", find)


def _look_through(mechanism: Mechanism, origin: str, find: Find) -> None:
    """Find texts that became code in what is generated; a name that the FMU has already is refused."""
    try:
        for fault in faults(mechanism):
            find(f"{fault} ({origin})")
    except KinfmuError as error:
        judge_refusal(str(error), 0.0, find)


def _words(drawn: random.Random, find: Find) -> None:
    """A text in any place, and raw in place of a whole value."""
    slot = drawn.choice((*TEXT_SLOTS, *NAME_SLOTS))
    text = hostile(drawn)
    if slot == "more":
        key = drawn.choice(("file", toml(text), "x"))
        lines = f'[joints.Z]\ntype = "cam"\nlaw = "spline"\n{key} = {toml(text)}'
        read(written({"more": lines}), find)
        return
    value = toml(text) if drawn.random() < 0.8 else text
    if slot == "coordinates" and drawn.random() < 0.5:
        value = f"[{value}]"
    mechanism = read(written({slot: value}), find)
    if mechanism is not None and CANARY in mechanism.name:
        find(f"the name {mechanism.name!r} is taken")


def _names(drawn: random.Random, find: Find) -> None:
    """Other names change nothing but the names."""
    words = drawn.sample(IDENTIFIERS, len(NAME_SLOTS) + 1)
    changes = dict(zip(NAME_SLOTS, words, strict=False))
    mechanism = read(written(changes | {"name": f'"{words[-1]}"'}), find)
    if mechanism is None:
        return
    plain = solve(parse(written({})), SAMPLES, engine="python")
    other = solve(mechanism, SAMPLES, engine="python")
    same = np.array_equal(plain.values, other.values) and np.array_equal(plain.accelerations, other.accelerations)
    if not (same and np.array_equal(plain.status, other.status)):
        find(f"with names {changes} the numbers are others")
    _look_through(mechanism, str(changes), find)


def _expressions(drawn: random.Random, find: Find) -> None:
    """Expressions that are long, deep, or explode."""
    atoms = ATOMS.split()
    kind = drawn.randrange(8)
    number = drawn.choice((3, 50, 2000, 200_000))
    text = {
        0: "**".join(["9"] * number),
        1: "(" * number + "1" + ")" * number,
        2: "-" * number + "1",
        3: "sin(" * number + "1" + ")" * number,
        4: "crank*" * number + "1",
        5: "9" * number,
        6: "1" + "0**20" * min(number, 180),
    }.get(kind, "".join(drawn.choice(atoms) for _ in range(min(number, 300))))
    began = time.process_time()
    try:
        expression = Expression(text, "mm")
        expression.value({"crank": drawn.choice((1.0, 0.0, -1.0, 1e300))})
    except KinfmuError as error:
        judge_refusal(str(error), time.process_time() - began, find)
    if time.process_time() - began > QUICK:
        find(f"{text[:80]!r} takes {time.process_time() - began:.1f} s")
    read(written({"expression": toml(text)}), find)


def _bytes(drawn: random.Random, find: Find) -> None:
    """A file of the gallery with damaged bytes."""
    name = drawn.choice(gallery.names())
    content = bytearray((gallery.folder() / name / "mechanism.toml").read_bytes())
    for _ in range(drawn.choice((1, 1, 2, 5, 50))):
        at = drawn.randrange(max(len(content), 1))
        match drawn.randrange(5):
            case 0:
                content[at : at + 1] = bytes(byte ^ 1 << drawn.randrange(8) for byte in content[at : at + 1])
            case 1:
                del content[at : at + drawn.choice((1, 10, 1000))]
            case 2:
                content[at:at] = content[at : at + drawn.choice((1, 10, 1000))]
            case 3:
                content[at:at] = drawn.choice((b"1e999", b"-", b'"', b"[", b"nan", b"\x00", b"9" * 5000, b"=", b"\n"))
            case _:
                content[at : at + 1] = bytes([drawn.randrange(256)])
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return
    mechanism = read(text, find)
    if mechanism is not None and drawn.random() < 0.1:
        began = time.process_time()
        try:
            solve(mechanism, mechanism.run.start + SAMPLES, engine="python")
        except KinfmuError as error:
            judge_refusal(str(error), 0.0 * began, find)


def _large(drawn: random.Random, find: Find) -> None:
    """Files of megabytes, thousands of bodies and parameters."""
    n = drawn.choice((5000, 10_000, 30_000))
    kind = drawn.randrange(8)
    bodies = "".join(f"[bodies.b{k}]\npoints = {{ P = [{k}, 0] }}\n" for k in range(n if kind == 0 else 0))
    parameters = {
        1: "".join(f'p{k} = "p{k - 1} + 1"\n' if k else "p0 = 1\n" for k in range(n)),
        2: "".join(f'p{k} = "p{(k + 1) % n} + 1"\n' for k in range(n)),
        3: "".join(f"p{k} = {k}\n" for k in range(n)),
    }
    text = {
        4: "#" * 10_000_000,
        5: 'name = "a"\nx = ' + "[" * 1_000_000,
        6: 'name = "a"\nx' + " = {x" * 100_000,
        7: f'name = "{"a" * 3_900_000}"\n[bodies.arm]\n',
    }.get(kind, f'name = "a"\n[parameters]\n{parameters.get(kind, "")}[bodies.arm]\n{bodies}[joints.J]\ntype = "pin"\n')
    read(text, find)


def _paths(drawn: random.Random, find: Find) -> None:
    """Names of files on the command line, to read and to write."""
    runner = CliRunner()
    Path("plain.toml").write_text(written({}))
    name = hostile(drawn).replace("\0", "")[:100] + drawn.choice(("", ".toml", ".csv", ".mcap", ".fmu", ".svg"))
    commands = (
        ["solve", "plain.toml", "-o", name],
        ["solve", name, "-o", "out.csv"],
        ["build", "plain.toml", "--flavour", "python", "-o", name],
        ["check", name],
        ["check", "plain.toml", "--figure", name],
        ["simulate", name],
        ["new", "fourbar", name],
        ["recover", name],
        ["export", name, "-o", "out.csv"],
        ["schema", "-o", name],
        ["solve", "plain.toml", "-o", "out.csv", "--set", f"crank={name}"],
        ["solve", "plain.toml", "-o", "out.csv", "--angle", name],
        ["solve", "plain.toml", "-o", "out.csv", "--outputs", name],
    )
    command = drawn.choice(commands)
    if name.startswith(("/", "..")) or "/" in name or "\\" in name:
        command = drawn.choice([one for one in commands if "-o" not in one[-2:-1] and one[0] != "new"])
        if "--figure" in command:
            return  # the user asks for that place
    invoke(runner, command, find)


def _commands(drawn: random.Random, find: Find) -> None:
    """Every command on a mechanism with a hostile title."""
    Path("hostile.toml").write_text(written({slot: toml(hostile(drawn)) for slot in TITLES}), encoding="utf-8")
    runner = CliRunner()
    command = drawn.choice(
        (
            ["check", "hostile.toml", "--figure", "out.svg"],
            ["check", "hostile.toml", "--json"],
            ["solve", "hostile.toml", "-o", "out.mcap", "--times", "0:1:0.1"],
            ["simulate", "hostile.toml", "--stop", "0.2", "--step", "0.1", "--mcap", "out.mcap", "--rrd", "out.rrd"],
            ["build", "hostile.toml", "--flavour", "python"],
        )
    )
    invoke(runner, command, find)
    if command[0] == "solve" and Path("out.mcap").exists():
        invoke(runner, ["export", "out.mcap", "-o", drawn.choice(("out.svg", "out.csv", "out.parquet"))], find)
        Path("out.mcap").unlink()


def invoke(runner: CliRunner, command: list[str], find: Find) -> None:
    """Run a command; find a traceback, another status than 0 to 2, and errors of several lines."""
    result = runner.invoke(main, command)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        find(f"{command}: {failure(result.exception)}")
    elif result.exit_code not in (0, 1, 2):
        find(f"{command}: exit status {result.exit_code}")
    elif result.exit_code == 1:
        ours = ("kinfmu: note", "kinfmu: warn")
        lines = [line for line in result.stderr.split("\n") if line and not line.startswith(ours)]
        if len(lines) != 1:
            find(f"{command}: {len(lines)} lines: {result.stderr[:300]!r}")
    odd = {c for c in result.output if unicodedata.category(c) == "Cc"} - {"\n", "\t", *"".join(command)}
    if odd:
        find(f"{command}: control characters are printed: {result.output[:300]!r}")


RARE: dict[int, Kind] = {0: _large, 1: _paths, 2: _commands}
BUILDS = (_paths, _commands)
