"""Hostile files of others: FMUs, records, tables, fit and study files, and files of other programs in their place."""

from __future__ import annotations

import io
import json
import pickle
import random
import re
import struct
import time
import tomllib
import zipfile
import zlib
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import fmpy  # noqa: F401  # which asks the system for its libraries when it is imported
import numpy as np
import zstandard
from click.testing import CliRunner

from kinfmu.design.fit import read_problem
from kinfmu.design.study import read_study
from kinfmu.errors import KinfmuError
from kinfmu.fmu import build, description, simulate
from kinfmu.fmu.unpacked import DESCRIPTION, MECHANISM, unpacked
from kinfmu.log import read, record, recover, write_mcap, write_rrd, write_table, writing
from kinfmu.log.mcap_writer import ZSTD, Opcode
from kinfmu.mechanism import gallery
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from kinfmu.run.solve import solve
from tests.design.study.linkage import TEXT as HOEKEN
from tests.fuzz.guarded import guarded
from tests.fuzz.hostile_text import CANARY, hostile
from tests.fuzz.mechanisms import Find, invoke, judge_refusal
from tests.fuzz.summary import Summary

QUICK = 3.0  # [s] of the processor for a file of some kilobytes, pictures aside
ODD_NUMBERS = ("-1", "0", "1e999", "nan", "99999999999999999999", "0x10", "1_0", "", "true", "-0.0", "1e-320", "\u0663")
ODD_VALUES = (None, True, -1, 1.5, 1e999, 10**30, "", "a", [], {}, [[]], ["a.x"], {"a": 1}, ["\ud800"], [0.0, "info"])
ODD_BYTES = (b"\xff" * 8, bytes(8), b"\xff" * 4 + bytes(4), struct.pack("<Q", 2**40))
OUTSIDE = (f"../{CANARY}", f"/tmp/{CANARY}", f"a/../../{CANARY}", f"resources/../../../{CANARY}", f"..\\{CANARY}", ".")  # noqa: S108


def run(seed: int, seconds: float) -> Summary:
    """Trials from `seed` on for about so many seconds."""
    return guarded("files", seed, seconds, kind=kind_of)


def trial(seed: int, summary: Summary) -> None:
    """One trial."""
    drawn = random.Random(seed)  # noqa: S311  # no secret
    kind = kind_of(seed)
    name = kind.__name__.strip("_")
    summary.count(name)
    kind(drawn, lambda text: summary.find(seed, name, text[:500]))


def kind_of(seed: int) -> Callable[[random.Random, Find], None]:
    """The kind of a trial."""
    rare = {0: _bombs, 1: _others}.get(seed // 12 % 6) if seed % 12 == 11 else None
    usual = (
        _fmu_bytes,
        _fmu_texts,
        _fmu_files,
        _record_bytes,
        _record_texts,
        _record_samples,
        _inputs,
        _tables,
        _designs,
    )
    return rare or usual[seed % len(usual)]


@cache
def fmu() -> bytes:
    """An FMU."""
    return build(gallery.load("slider_crank"), Path("whole.fmu"), flavour="python").read_bytes()


@cache
def a_run() -> Run:
    """A run of some samples."""
    return solve(gallery.load("fourbar"), np.linspace(0.0, 100.0, 40), engine="python")


@cache
def a_record() -> bytes:
    """Its record."""
    write_mcap(a_run(), "whole.mcap")
    return Path("whole.mcap").read_bytes()


def attempt(action: Callable[[], object], find: Find, quick: float = QUICK) -> object:
    """What the action gives, None if it is refused, in one line."""
    began = time.process_time()
    try:
        return action()
    except KinfmuError as error:
        judge_refusal(str(error), 0.0, find)
        return None
    finally:
        if time.process_time() - began > quick:
            find(f"takes {time.process_time() - began:.1f} s")


def damaged(content: bytes, drawn: random.Random, first: int = 0) -> bytes:
    """The bytes with some changed, left out or repeated, from a place on."""
    changed = bytearray(content)
    for _ in range(drawn.choice((1, 1, 2, 10))):
        at = drawn.randrange(min(first, len(changed)), len(changed) + 1)
        match drawn.randrange(6):
            case 0:
                del changed[at:]
                return bytes(changed)
            case 1:
                del changed[at : at + drawn.choice((1, 8, 100))]
            case 2:
                changed[at:at] = changed[at : at + drawn.choice((1, 8, 1000))]
            case 3:
                changed[at : at + 8] = drawn.choice(
                    (b"\xff" * 8, bytes(8), b"\xff" * 4 + bytes(4), struct.pack("<Q", 2**40))
                )
            case _:
                changed[at : at + 1] = bytes(byte ^ 1 << drawn.randrange(8) for byte in changed[at : at + 1])
    return bytes(changed)


# ------------------------------------------------------------------------------------------- fit and study files

FIT = """
mechanism = "hoeken.toml"
over = "driver"
unknowns = { crank = [20, 50] }
targets.free = { type = "path", of = "coupler.Q", points = [[1, 2], [2, 3], [3, 3]], begin = 0, end = 2 }
targets.timed = { type = "path", of = "coupler.Q", points = [[1, 2]], at = [0.1], start = [0, 1], weight = [2] }
targets.steps = { type = "path", of = "coupler.Q", points = [[1, 2]], step = "10 deg", start = 0.1, weight = 2 }
targets.poses = { type = "poses", of = "coupler", poses = [[1, 2, 0.1]], length = 10, at = [0.1], start = 0 }
targets.swing = { type = "measure", of = "swing", value = "40 deg", weight = 2 }
constraints.bars = { type = "grashof", links = ["crank", "rocker", "base", "55 mm"], shortest = "crank", gap = 1 }
constraints.far = { type = "margin", minimum = 0.1, weight = 2 }
constraints.limits = { type = "measure", of = "swing", minimum = 0.1, maximum = 2, weight = 3 }
[targets.function]
type = "function"
of = "rocker.phi"
over = "coupler.phi"
points = [[0, 0.1]]
start = [0, 1]
offset = [0, 1]
begin = 0
end = 3
"""
STUDY = """
mechanism = "hoeken.toml"
sampling = "sobol"
designs = 2
seed = 1
report = ["swing", "own"]
parameters.crank = { from = 15, to = 25 }
parameters.rocker = { tolerance = 0.1, distribution = "normal", deviations = 3, nominal = 50 }
parameters.base = { values = [39, 40] }
measures.own = { type = "range", of = "rocker.phi" }
"""
MOTIONS = "run = { start = 0, stop = 1, step = 0.1 }\n", "run = { from = 0, to = 3, samples = 20, speed = 2 }\n"


def _designs(drawn: random.Random, find: Find) -> None:
    """Every key of a fit file and of a study file, left out or with odd values in its place."""
    Path("hoeken.toml").write_text(HOEKEN, encoding="utf-8")
    for text, read_file in ((FIT, read_problem), (STUDY + drawn.choice(MOTIONS), read_study)):
        usual = tomllib.loads(text)
        for place in _places(usual):
            odd = drawn.choice((*ODD_VALUES, ["a"], [1], [[1, 2]], [[1, 2], [3]], 1979, "a\nb", "1 deg", usual))
            lines = [f"{key} = {_toml(part)}" for key, part in _put(usual, place, odd).items() if part is not None]
            Path("design.toml").write_text("\n".join(lines), encoding="utf-8")
            attempt(partial(read_file, "design.toml"), find)


def _places(value: object) -> Iterator[tuple[Any, ...]]:
    """The places of all parts of tables and lists, as keys and numbers one after another."""
    for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        yield (key,)
        yield from ((key, *rest) for rest in _places(value[key]))


def _put(value: Any, place: tuple[Any, ...], part: object) -> Any:
    """The value with another part at a place; None leaves it out."""
    if not place:
        return part
    changed = value.copy()
    changed[place[0]] = _put(value[place[0]], place[1:], part)
    return changed


def _toml(value: Any) -> str:
    """A value as TOML; None is left out of tables, and an empty text in lists."""
    if isinstance(value, dict):
        entries = [f"{json.dumps(key)} = {_toml(part)}" for key, part in value.items() if part is not None]
        return "{" + ", ".join(entries) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps("" if value is None else value)


# ------------------------------------------------------------------------------------------------------------ FMUs


def _fmu_bytes(drawn: random.Random, find: Find) -> None:
    """Damaged bytes of an archive, mostly of its directory, which has no checksum."""
    whole = fmu()
    first = whole.index(b"PK\x01\x02") if drawn.random() < 0.7 else 0
    path = Path("a.fmu")
    path.write_bytes(damaged(whole, drawn, first))
    attempt(lambda: _opened(path), find)


def _opened(path: Path) -> None:
    with unpacked(path) as folder:
        description.read((folder / DESCRIPTION).read_bytes(), str(path))


def _with_files(files: dict[str, bytes | None]) -> Path:
    """The FMU with other content of files, or without them."""
    path = Path("a.fmu")
    with zipfile.ZipFile(io.BytesIO(fmu())) as old, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.namelist():
            if entry not in files:
                new.writestr(entry, old.read(entry))
        for name, content in files.items():
            if content is not None:
                new.writestr(zipfile.ZipInfo(name), content)
    return path


def _content(name: str) -> str:
    with zipfile.ZipFile(io.BytesIO(fmu())) as archive:
        return archive.read(name).decode()


def _fmu_texts(drawn: random.Random, find: Find) -> None:
    """Other values of attributes in the description, or another text of the mechanism."""
    if drawn.random() < 0.2:
        text = damaged(_content(MECHANISM).encode(), drawn)
        path = _with_files({MECHANISM: drawn.choice((text, None, hostile(drawn).encode("utf-8", "replace")))})
    else:
        text_of = _content(DESCRIPTION)
        for _ in range(drawn.choice((1, 1, 3))):
            places = list(re.finditer(r'="([^"]*)"', text_of))
            place = drawn.choice(places)
            value = drawn.choice((*ODD_NUMBERS, drawn.choice(places)[1], drawn.choice(places)[1], "../../a", "x&#10;y"))
            text_of = f'{text_of[: place.start()]}="{value}"{text_of[place.end() :]}'
        path = _with_files({DESCRIPTION: text_of.encode("utf-8", "replace")})
    attempt(lambda: simulate(path, stop=0.002, step=0.001), find)


def _fmu_files(drawn: random.Random, find: Find) -> None:
    """Files outside the archive's folder, under odd names, or in the place of others."""
    files: dict[str, bytes | None] = {}
    for _ in range(drawn.choice((1, 3))):
        name = drawn.choice(
            (*OUTSIDE, hostile(drawn).replace("\0", "")[:200] or "a", "resources", DESCRIPTION, "a/" * 200)
        )
        files[name] = drawn.choice((b"", b"a", bytes(10_000), pickle.dumps(OSError(1, "a"))))
    path = _with_files(files)
    attempt(lambda: _opened(path), find)


# --------------------------------------------------------------------------------------------------------- records


def _use(path: Path, drawn: random.Random, find: Find) -> None:
    """Read a record, write what can be made of it, and recover it."""
    again = attempt(lambda: read(path), find)
    if isinstance(again, Run):
        use = drawn.randrange(4)
        if use == 0:
            attempt(lambda: write_table(again, "out.csv"), find)
        elif use == 1:
            attempt(lambda: write_mcap(again, "out.mcap"), find)
        elif use == 2 and drawn.random() < 0.3:
            attempt(lambda: write_rrd(again, "out.rrd"), find, 30.0)
        elif use == 3 and drawn.random() < 0.1:
            invoke(CliRunner(), ["export", str(path), "-o", drawn.choice(("out.svg", "out.gif"))], find)
    attempt(lambda: recover(path, "out.mcap"), find)


def _record_bytes(drawn: random.Random, find: Find) -> None:
    """Damaged bytes."""
    path = Path("a.mcap")
    path.write_bytes(damaged(a_record(), drawn))
    _use(path, drawn, find)


def _record_texts(drawn: random.Random, find: Find) -> None:
    """Odd texts, whose checksums fit."""
    usual = record.description(a_run()) | record.ending(a_run())
    texts: dict[str, str] = {}
    for key in drawn.sample(list(usual), drawn.choice((1, 1, 2))):
        value = json.loads(usual[key]) if key != "format" else usual[key]
        texts[key] = drawn.choice(
            (
                json.dumps(drawn.choice(ODD_VALUES)),
                json.dumps(_changed(value, drawn)),
                json.dumps(_changed(value, drawn)),
                hostile(drawn).encode("utf-8", "replace").decode(),
                "[" * 10_000,
            )
        )
    run = a_run()
    if drawn.random() < 0.3:
        info = {key: hostile(drawn).encode("utf-8", "replace").decode() for key in ("name", "title")}
        run = _replaced(run, info=info, mechanism_source=_mechanism(drawn))
    _written(run, Path("a.mcap"), texts)
    _use(Path("a.mcap"), drawn, find)


def _mechanism(drawn: random.Random) -> str:
    """The text of another mechanism, or a damaged one."""
    text = (gallery.folder() / drawn.choice(gallery.names()) / "mechanism.toml").read_text(encoding="utf-8")
    return text if drawn.random() < 0.6 else damaged(text.encode(), drawn).decode("utf-8", "replace")


def _record_samples(drawn: random.Random, find: Find) -> None:
    """Odd numbers in samples."""
    run = a_run()
    odd = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 0.0, 1e19)
    tables = {name: np.array(getattr(run, name)) for name in ("t", "values", "rates", "status", "residual", "margin")}
    for name in drawn.sample(list(tables), 2):
        table = tables[name].reshape(len(run), -1)
        for _ in range(drawn.choice((1, 5, 100))):
            place = drawn.randrange(table.shape[0]), drawn.randrange(table.shape[1])
            table[place] = drawn.randrange(-3, 300) if name == "status" else drawn.choice(odd)
        tables[name] = table.reshape(tables[name].shape)
    path = Path("a.mcap")
    try:
        _written(_replaced(run, **tables), path, {}, is_checked=False)
    except (KinfmuError, ValueError, KeyError):
        return  # the writer has its own checks
    _use(path, drawn, find)


def _changed(value: object, drawn: random.Random) -> object:
    """The value with one part changed."""
    if isinstance(value, list) and value:
        k = drawn.randrange(len(value))
        part = drawn.choice((_changed(value[k], drawn), drawn.choice(ODD_VALUES), value[0]))
        return [*value[:k], *([part] if drawn.random() < 0.8 else []), *value[k + 1 :]]
    if isinstance(value, dict) and value:
        return {**value, drawn.choice((*value, "a.x", "")): drawn.choice(ODD_VALUES)}
    if isinstance(value, str):
        return drawn.choice((value[1:], f"{value}.x", hostile(drawn)[:50]))
    return drawn.choice(ODD_VALUES)


def _replaced(run: Run, **fields: object) -> Run:
    from dataclasses import replace

    return replace(run, **fields)  # type: ignore[arg-type]


def _written(run: Run, path: Path, texts: dict[str, str], *, is_checked: bool = True) -> None:
    """A record of the run with these texts in place of its own."""
    begin = {key: text for key, text in texts.items() if key not in ("samples", "events")}
    end = {key: text for key, text in texts.items() if key not in begin}
    kept = {name: getattr(writing, name) for name in ("description", "ending", "status_events", "sentence")}
    try:
        writing.description = lambda run: record.description(run) | begin
        writing.ending = lambda run: record.ending(run) | end
        if not is_checked:
            writing.status_events = lambda *_: []
            writing.sentence = lambda _: ""
        write_mcap(run, path, channels=["-drawn"])
    finally:
        for name, function in kept.items():
            setattr(writing, name, function)


def _bombs(drawn: random.Random, find: Find) -> None:
    """Chunks and archives that unpack to gigabytes, and chunks that claim to."""
    kind = drawn.randrange(4)
    if kind == 0:
        path = Path("bomb.fmu")
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for k in range(40):
                with archive.open(f"resources/{k}", "w") as file:
                    for _ in range(16):
                        file.write(bytes(2**20))
        attempt(lambda: _opened(path), find)
        return
    raw = _zeros()
    size = 2**27 if kind < 3 else drawn.choice((2**40, 2**63, 2**31))
    name = ZSTD.encode()
    body = struct.pack("<QQQI", 0, 0, size, 0) + struct.pack("<I", len(name)) + name + struct.pack("<Q", len(raw)) + raw
    chunk = struct.pack("<BQ", Opcode.CHUNK, len(body)) + body
    if kind == 2:
        entries = bytes(16 * 100)
        index = struct.pack("<HI", 0, len(entries)) + entries
        chunk += struct.pack("<BQ", Opcode.MESSAGE_INDEX, len(index)) + index
    whole = a_record()
    at = whole.rindex(struct.pack("<BQ", Opcode.DATA_END, 4))
    Path("a.mcap").write_bytes(whole[:at] + chunk * 24 + whole[at:])
    attempt(lambda: read("a.mcap"), find, 10.0)
    attempt(lambda: recover("a.mcap", "out.mcap"), find, 10.0)


@cache
def _zeros() -> bytes:
    """128 MB of records of no length, packed to some kilobytes."""
    packer = zstandard.ZstdCompressor(level=1).compressobj(size=2**27)
    return b"".join([*(packer.compress(bytes(2**20)) for _ in range(128)), packer.flush()])


# ---------------------------------------------------------------------------------------------------------- tables


def _table(drawn: random.Random, header: str) -> bytes:
    """Lines of odd cells under a header."""
    odd = (*ODD_NUMBERS, '"', '""', '"a\nb"', "1,5", "a" * 200_000, "\0", "1 deg", "#", "\ufeff", "'", "=1+1", "\u2028")
    mark = drawn.choice((",", ";", "\t"))
    lines = [header.replace(",", mark)]
    for k in range(drawn.choice((0, 2, 20))):
        cells = [
            str(0.1 * k),
            *(drawn.choice(odd) if drawn.random() < 0.2 else "0.5" for _ in range(header.count(","))),
        ]
        lines.append(mark.join(cells))
    content = drawn.choice(("\n", "\r\n", "\r")).join(lines).encode("utf-8", "replace")
    return damaged(content, drawn) if drawn.random() < 0.5 else content


def _inputs(drawn: random.Random, find: Find) -> None:
    """Tables of inputs."""
    title = drawn.choice(("crank_angle", "crank_angle [deg]", "crank_angle (deg)", hostile(drawn).replace(",", " ")))
    Path("in.csv").write_bytes(_table(drawn, f"time,{title}"))
    Path("a.fmu").write_bytes(fmu())
    attempt(lambda: simulate("a.fmu", inputs="in.csv", step=0.1, stop=1.0), find)


def _tables(drawn: random.Random, find: Find) -> None:
    """Tables of splines, and files in their place."""
    title = drawn.choice(("x,u", "x [rad],u [mm]", "x [,u ]", hostile(drawn)))
    Path("table.csv").write_bytes(_table(drawn, title))
    name = drawn.choice(("table.csv", "table.csv", "/dev/null", "/proc/self/mem", ".", "../x.csv", "", "a\\u0000b"))
    file = (
        'name = "a"\n[bodies.arm]\npoints = { O = [0, 0] }\n[joints.O]\ntype = "revolute"\n'
        'between = ["ground.O", "arm.O"]\n'
        "[bodies.ground]\npoints = { O = [0, 0] }\n"
        f'[drivers.arm]\ntype = "angle"\nof = "arm"\nlaw = "spline"\nfile = "{name}"\n'
    )
    attempt(lambda: parse(file, "a.toml", Path()), find)


class _Evil:
    """What a pickle may ask for."""

    def __reduce__(self) -> tuple[object, ...]:
        return Path.touch, (Path(CANARY),)


def _others(drawn: random.Random, find: Find) -> None:
    """Files of other programs under names that kinfmu reads."""
    contents: dict[str, bytes] = {"pickle": pickle.dumps(_Evil()), "nothing": b"", "zeros": bytes(100_000)}
    buffer = io.BytesIO()
    np.savez(buffer, a=np.array([_Evil()], dtype=object))
    contents["npz"] = buffer.getvalue()
    buffer = io.BytesIO()
    np.save(buffer, np.array([_Evil()], dtype=object), allow_pickle=True)
    contents["npy"] = buffer.getvalue()
    write_table(a_run(), "run.parquet")
    contents["parquet"] = damaged(Path("run.parquet").read_bytes(), drawn)
    contents["zlib"] = zlib.compress(bytes(10**7))
    contents["record"], contents["fmu"] = a_record()[:5000], fmu()[:5000]
    suffix = drawn.choice((".mcap", ".fmu", ".toml", ".csv", ".rrd", ".npz", ".parquet"))
    path = Path(f"other{suffix}")
    path.write_bytes(drawn.choice(list(contents.values())))
    Path("a.fmu").write_bytes(fmu())
    commands = (
        ["check", str(path)],
        ["solve", str(path), "-o", "out.csv"],
        ["simulate", str(path)],
        ["simulate", "a.fmu", "--input", str(path), "--channels", "none"],
        ["export", str(path), "-o", "out.csv"],
        ["recover", str(path), "-o", "out.mcap"],
        ["review", str(path), "--save", "out.rrd"],
        ["new", str(path), "out.toml"],
    )
    invoke(CliRunner(), drawn.choice(commands), find)
    Path("out.toml").unlink(missing_ok=True)
    if Path(CANARY).exists():
        find(f"{path} was executed")
