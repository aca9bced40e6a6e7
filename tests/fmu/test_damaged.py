"""Damaged and malicious FMUs, and faulty tables of inputs: a message of one line, and no file outside the folder."""

from __future__ import annotations

import io
import random
import re
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.fmu import description
from kinfmu.fmu import unpacked as unpacking
from kinfmu.fmu.description.description import MOST_TAGS
from kinfmu.fmu.host import input_table
from kinfmu.fmu.unpacked import DESCRIPTION, MECHANISM, unpacked

FLIPS = 150


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The bytes of an FMU."""
    path = tmp_path_factory.mktemp("fmu") / "slider_crank.fmu"
    return kinfmu.build(kinfmu.load("slider_crank"), path, flavour="python").read_bytes()


def with_file(whole: bytes, name: str, content: bytes | None) -> bytes:
    """The FMU with other content of a file, or without it."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(whole)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.namelist():
            if entry != name:
                new.writestr(entry, old.read(entry))
        if content is not None:
            new.writestr(name, content)
    return out.getvalue()


def content_of(whole: bytes, name: str) -> str:
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        return archive.read(name).decode()


def refusal(content: bytes, folder: Path) -> str:
    """The one line on an FMU, without its name in front."""
    path = folder / "a.fmu"
    path.write_bytes(content)
    with pytest.raises(KinfmuError) as caught:
        kinfmu.simulate(path, stop=0.1, step=0.05)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ")
    return line.removeprefix(f"{path}: ")


@pytest.mark.long
def test_an_fmu_with_a_flipped_bit_is_whole_or_one_line(whole: bytes, tmp_path: Path) -> None:
    """Half of the bits in the directory of the archive, which has no checksum."""
    drawn = random.Random(0)  # noqa: S311  # no secret
    path = tmp_path / "a.fmu"
    lines: list[str] = []
    directory = whole.index(b"PK\x01\x02")
    for k in range(FLIPS):
        content = bytearray(whole)
        content[drawn.randrange(directory if k % 2 else 0, len(content))] ^= 1 << drawn.randrange(8)
        path.write_bytes(content)
        try:
            with unpacked(path) as folder:
                description.read((folder / DESCRIPTION).read_bytes(), str(path))
        except KinfmuError as error:
            lines.append(str(error))
    assert all(line.startswith(f"{path}: ") and len(line.splitlines()) == 1 for line in lines)
    assert len(lines) > FLIPS // 10
    assert list(tmp_path.iterdir()) == [path]


def test_an_fmu_cut_anywhere_is_one_line(whole: bytes, tmp_path: Path) -> None:
    for k in range(20):
        assert refusal(whole[: k * len(whole) // 20], tmp_path) == "is no FMU (not a zip archive)"


def changed(whole: bytes, flags: int, method: int) -> bytes:
    """The FMU whose model description has other flags, and another method of compression."""
    content = bytearray(whole)
    for signature, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        struct.pack_into("<HH", content, content.index(signature) + at, flags, method)
    return bytes(content)


def test_encryption_and_unknown_compression_are_one_line(whole: bytes, tmp_path: Path) -> None:
    assert refusal(changed(whole, 1, 8), tmp_path) == "file 'modelDescription.xml' is encrypted; FMUs are not"
    assert refusal(changed(whole, 0, 97), tmp_path) == (
        "file 'modelDescription.xml' is damaged: That compression method is not supported"
    )


@pytest.mark.parametrize("name", ["../outside.txt", "/../outside.txt", "a/../../outside.txt", "resources/../../a"])
def test_a_file_outside_the_folder_of_the_fmu_is_refused(whole: bytes, tmp_path: Path, name: str) -> None:
    assert refusal(with_file(whole, name, b"a"), tmp_path) == f"is no FMU (file {name!r} lies outside its folder)"
    assert [path.name for path in tmp_path.iterdir()] == ["a.fmu"]


def test_an_fmu_that_takes_gigabytes_is_not_unpacked(
    whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bomb = with_file(whole, "resources/zeros", bytes(2**20))
    assert len(bomb) < len(whole) + 5000
    monkeypatch.setattr(unpacking, "LARGEST", 2**20)
    assert refusal(bomb, tmp_path).endswith("bytes unpacked; an FMU has at most 1048576")
    monkeypatch.setattr(unpacking, "MOST_FILES", 3)
    assert refusal(whole, tmp_path).endswith("files; an FMU has at most 3")


def test_a_file_without_a_name_is_one_line(whole: bytes, tmp_path: Path) -> None:
    content = bytearray(with_file(whole, "a", b""))
    for signature in (b"PK\x03\x04", b"PK\x01\x02"):
        name = content.rindex(signature) + (30 if signature.endswith(b"\x04") else 46)
        assert content[name : name + 1] == b"a"
        content[name] = 0  # names end at a zero
    assert refusal(bytes(content), tmp_path) == "is no FMU (damaged: a file without a name)"


def test_a_file_larger_than_declared_is_not_unpacked_further(whole: bytes, tmp_path: Path) -> None:
    bomb = bytearray(with_file(whole, "resources/zeros", bytes(2**20)))
    at = bomb.rindex(b"PK\x01\x02")
    struct.pack_into("<I", bomb, at + 24, 1000)
    assert refusal(bytes(bomb), tmp_path).startswith("file 'resources/zeros' is damaged: Bad CRC-32")


MECHANISMS = {
    "missing": (None, f"{MECHANISM} is missing; kinfmu simulates FMUs that kinfmu built"),
    "not text": (b"name = '\xff'", f"{MECHANISM} is not a text file (byte 8 is not UTF-8)"),
    "not TOML": (b"name = ", f"{MECHANISM}: not valid TOML: Invalid value (at end of document)"),
    "too large": (b"#" * 4_000_001, f"{MECHANISM} is too large (largest: 4000000 bytes)"),
    "naming a file": (
        b'name = "a"\n[bodies.arm]\n[drivers.arm]\ntype = "angle"\nof = "arm"\nlaw = "spline"\nfile = "/etc/passwd"\n',
        f"{MECHANISM}: [drivers.arm] file = '/etc/passwd': only a mechanism file can name a file; "
        "text needs the points themselves",
    ),
}


@pytest.mark.parametrize("case", MECHANISMS)
def test_a_damaged_mechanism_inside_is_one_line(whole: bytes, tmp_path: Path, case: str) -> None:
    content, line = MECHANISMS[case]
    assert refusal(with_file(whole, MECHANISM, content), tmp_path) == line


def bomb(text: str) -> str:
    """A description whose entities unfold to gigabytes."""
    levels = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(10))
    document = f'<!DOCTYPE fmiModelDescription [<!ENTITY a0 "aaaaaaaaaa">{levels}]>'
    return text.replace("<fmiModelDescription", f"{document}<fmiModelDescription", 1).replace("kinfmu", "&a10;", 1)


DESCRIPTIONS: dict[str, tuple[Callable[[str], str], str]] = {
    "a start that is no number": (
        lambda text: text.replace('start="', 'start="one', 1),
        "damaged: could not conv",
    ),
    "a count that is no number": (
        lambda text: text.replace('variables="', 'variables="x', 1),
        "damaged: invalid liter",
    ),
    "a count of millions": (lambda text: text.replace('variables="', 'variables="9999999', 1), "damaged: part"),
    "no type": (lambda text: text.replace("<Real ", "<Unreal ", 1).replace("/Real>", "/Unreal>", 0), "damaged: a vari"),
    "a dependency on nothing": (lambda text: text.replace('dependencies="1', 'dependencies="77777', 1), "'77777' is "),
    "a unit that is unknown": (lambda text: text.replace('lengthUnit="', 'lengthUnit="x', 1), "unit of length 'xm"),
    "a library elsewhere": (
        lambda text: text.replace('modelIdentifier="', 'modelIdentifier="../../', 1),
        "damaged: modelIdentifier '../../slider_crank' must consist of at most 100 letters",
    ),
    "another part": (lambda text: text.replace('name="counts"', 'name="count"', 1), "part counts does not hold"),
    "outputs that are no coordinates": (lambda text: text.replace('.phi"', '.psi"'), "is no coordinate such as"),
    "another version": (lambda text: text.replace('fmiVersion="2.0"', 'fmiVersion="2&#10;"'), r"FMI version 2\n; kin"),
    "a bomb of entities": (bomb, "modelDescription.xml is not XML (limit on input amplification"),
    "half a document": (lambda text: text[: len(text) // 2], "modelDescription.xml is not XML ("),
}


@pytest.mark.parametrize("case", DESCRIPTIONS)
@pytest.mark.few(4)
def test_a_damaged_description_is_one_line(whole: bytes, tmp_path: Path, case: str) -> None:
    change, words = DESCRIPTIONS[case]
    text = content_of(whole, DESCRIPTION)
    assert change(text) != text
    assert words in refusal(with_file(whole, DESCRIPTION, change(text).encode()), tmp_path)


def test_a_watch_of_another_name_is_one_line(tmp_path: Path) -> None:
    fmu = kinfmu.build(kinfmu.load("fourbar"), tmp_path / "whole.fmu", flavour="python").read_bytes()
    text = content_of(fmu, DESCRIPTION).replace('"watch.', '"clock.')
    line = refusal(with_file(fmu, DESCRIPTION, text.encode()), tmp_path)
    assert re.search(r"'clock\.[\w.]+' is no name of a watch such as 'watch.rod.length'$", line)


def test_a_description_of_millions_of_tags_is_not_read(whole: bytes, tmp_path: Path) -> None:
    tags = content_of(whole, DESCRIPTION).replace("<ModelVariables>", f"<ModelVariables>{'<a/>' * MOST_TAGS}")
    text = refusal(with_file(whole, DESCRIPTION, tags.encode()), tmp_path)
    assert text == f"modelDescription.xml has more than {MOST_TAGS} tags"


def test_a_table_of_inputs_has_as_many_rows_as_a_run_has_samples(
    whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(input_table, "MOST_SAMPLES", 3)
    (tmp_path / "a.fmu").write_bytes(whole)
    (tmp_path / "in.csv").write_text("time,crank_angle\n0,1\n1,1\n\n2,1\n3,1\n")
    with pytest.raises(KinfmuError, match=r"in.csv, line 6: more than 3 rows$"):
        kinfmu.simulate(tmp_path / "a.fmu", stop=0.1, step=0.05, inputs=tmp_path / "in.csv")


INPUTS = {
    "a field of megabytes": (
        f"time,crank_angle\n0,{'1' * 200_000}\n",
        "line 2: field larger than field limit (131072)",
    ),
    "a text without an end": (f'time,crank_angle\n0,"1\n{"1" * 200_000}', "line 3: field larger than field limit"),
    "a number with an underscore": ("time,crank_angle\n0,1_000\n", "line 2: crank_angle = '1_000' is not a number"),
    "digits of another script": ("time,crank_angle\n0,٣\n", "line 2: crank_angle = '٣' is not a number"),
    "infinity": ("time,crank_angle\n0,Infinity\n", "line 2: crank_angle = 'Infinity' is not a number"),
    "a hexadecimal number": ("time,crank_angle\n0,0x1p3\n", "line 2: crank_angle = '0x1p3' is not a number"),
    "a title of two lines": ('time,"crank\nangle"\n0,1\n', r"'crank\nangle' is not an input of this FMU"),
    "a title of megabytes": (f"time,{'crank_angle' * 10_000}\n0,1\n", "crank_angle' is not an input of this FMU"),
    "a unit of two lines": ('time,"crank_angle (d\neg)"\n0,1\n', r"did you mean 'crank_angle [d\neg]'?"),
    "a cell of two lines": ('time,crank_angle\n0,"1\n2"\n', r"line 3: crank_angle = '1\n2' is not a number"),
    "a number too large": ("time,crank_angle\n0,1e999\n", "line 2: crank_angle = inf is not a finite number"),
}


@pytest.mark.parametrize("case", INPUTS)
def test_a_faulty_table_of_inputs_is_refused_in_one_line(whole: bytes, tmp_path: Path, case: str) -> None:
    (tmp_path / "a.fmu").write_bytes(whole)
    content, words = INPUTS[case]
    (tmp_path / "in.csv").write_text(content, encoding="utf-8")
    with pytest.raises(KinfmuError) as caught:
        kinfmu.simulate(tmp_path / "a.fmu", stop=0.1, step=0.05, inputs=tmp_path / "in.csv")
    (line,) = str(caught.value).splitlines()
    assert words in line
    assert len(line) < 1000
