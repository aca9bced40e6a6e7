"""Wrong, damaged and hostile drawings: one line with the place and what would be valid, and exit status 1."""

from __future__ import annotations

import random
import re
import string
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from kinfmu.cli import main
from kinfmu.errors import MechanismError
from kinfmu.mechanism.imports import imported
from kinfmu.mechanism.imports.sketch import MOST_PARTS
from kinfmu.mechanism.toml_file import parse
from tests.mechanism.imports.pmks_links import ADDRESS, CASES, checked, payload
from tests.mechanism.imports.test_dxf import four_bar, slider_crank

ROOT = Path(__file__).parents[3]
FOLDER = Path(__file__).parent / "linkage"
FOUR_BAR = (FOLDER / "four_bar.linkage2").read_text(encoding="utf-8")
LINK = CASES["a crank-rocker"].link
SLOT = CASES["an inverted slider-crank"].link
BOMB = '<!DOCTYPE linkage2 [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>\n<linkage2>&b;</linkage2>'
OUTSIDE = '<!DOCTYPE linkage2 SYSTEM "file:///etc/passwd"><linkage2/>'
SECTION = "  0\nSECTION\n  2\nENTITIES\n"


def dxf(entities: str) -> str:
    return f"{SECTION}{entities}  0\nENDSEC\n  0\nEOF\n"


def point(layer: str, x: str) -> str:
    return f"  0\nPOINT\n  8\n{layer}\n 10\n{x}\n 20\n0.0\n"


def linkage(*connectors: str, links: str = "") -> str:
    return f"<linkage2>{''.join(connectors)}{links}</linkage2>"


def resized(link: str, old: str, new: str) -> str:
    """A link with another content and the check character of its length."""
    body = link.removeprefix(ADDRESS)[:-1].replace(old, new)
    assert body != link.removeprefix(ADDRESS)[:-1]
    return checked(body)


WRONG: dict[str, tuple[str | bytes, str]] = {  # case: the drawing, part of the message
    "nothing": ("", "is not a link of PMKS+, a .linkage2 file of Linkage, or a DXF drawing"),
    "a mechanism file": ('name = "a"\n', "is not a link of PMKS+"),
    "binary": (b"\x89PNG\r\n\x1a\n\x00\x00", "is a binary file"),
    "a binary DXF": (b"AutoCAD Binary DXF\r\n\x1a\x00\x00\x00SECTION\x00", "save a binary DXF drawing as a text DXF"),
    "random bytes": (random.Random(1).randbytes(1000).replace(b"\x00", b"\x01"), "is not a link of PMKS+"),  # noqa: S311
    "50 MB": (b"<linkage2>" + b" " * 50_000_000, "too large for a drawing to import (largest: 4000000 bytes)"),
    # links of PMKS+
    "an address without a drawing": ("https://app.pmksplus.com/", "has it after a '?'"),
    "an address of something else": ("https://example.org/?q=1", "is cut short or no link of PMKS+"),
    "a link that is cut short": (LINK[:90], "is cut short or no link of PMKS+: joints, links and forces are lists"),
    "a link over two lines": (LINK[:90] + "\n" + LINK[90:], "is more than a link: it has several lines"),
    "a number with a sign of no digit": (resized(LINK, "4C,C", "4C,C,é"), "joint 'C': 'é' is not a number"),
    "a number of many digits": (resized(LINK, "4C,C", "4C,C," + "z" * 10), "is not a number of at most 9 digits"),
    "a joint without a place": (resized(LINK, "4C,C,_W,0,0", "4C,C,_W"), "joint 'C' has 3 fields; it needs at least 5"),
    "two joints of one id": (resized(LINK, "0B,B", "0A,B"), "has two joints of one id"),
    "a link of an unknown joint": (resized(LINK, "c5cae9,O,A", "c5cae9,O,Z"), "link 'crank': there is no joint 'Z'"),
    "an unknown kind of link": (resized(LINK, "YRcrank", "?Rcrank"), "'?R' is no known kind of link, such as 'YR'"),
    "half a slot": (resized(SLOT, ",CD,C,D.", ",CD,C."), "joint 'P': a slot needs a sliding joint, a link and two"),
    "a slot on no link": (resized(SLOT, ",CD,C,D.", ",XX,C,D."), "joint 'P': its slot must name a link"),
    "a slot of one joint": (resized(SLOT, ",CD,C,D.", ",CD,C,C."), "two different joints of this link"),
    "an unknown unit": (resized(LINK, ".1011.", ".7011."), "the settings name an unknown unit of length, '7'"),
    "a force on no link": (
        payload("O 0 0 ground, A 1 0", "a O A", "F1 2 b 0 0 1 1 1"),
        "force 'F1': there is no link 'b'",
    ),
    "a drawing without ground": (payload("A 1 0, B 3 2", "a A B"), "no link is connected with the ground"),
    "too many joints": (
        payload(",".join(f"J{k} {k} 0" for k in range(MOST_PARTS + 1)), "a J0 J1"),
        f"has more than {MOST_PARTS} pins, the most that are imported",
    ),
    # files of Linkage
    "a file that is cut short": (FOUR_BAR[:700], "is not a complete XML file: unclosed token: line"),
    "elements that do not close": (
        FOUR_BAR.replace("</Link>", "</link>", 1),
        "is not a complete XML file: mismatched tag",
    ),
    "other XML": ("<svg xmlns='http://www.w3.org/2000/svg'/>", "its root is 'svg', not 'linkage2'"),
    "a bomb of entities": (BOMB, "has a DOCTYPE, which files of Linkage do not have"),
    "an entity from outside": (OUTSIDE, "has a DOCTYPE"),
    "an entity without a declaration": ("<linkage2>&a;</linkage2>", "is not a complete XML file: undefined entity"),
    "a deep nest": ("<linkage2>" + "<a>" * 100_000, "elements are nested too deeply"),
    "a place that is no number": (
        FOUR_BAR.replace('"75.590551"', '"nan"'),
        "connector 1: x = 'nan' must be a finite number",
    ),
    "a place that is a word": (FOUR_BAR.replace('"75.590551"', '"left"'), "connector 1: x = 'left' must be a number"),
    "a place far away": (FOUR_BAR.replace('"75.590551"', '"1e300"'), "connector 1: x = '1e300' is too large"),
    "a connector without a place": (linkage('<connector id="1" y="0"/>'), "connector 1 needs x, a number"),
    "a connector without an id": (linkage('<connector x="0" y="0"/>'), "<connector> has no id"),
    "two connectors of one id": (linkage('<connector id="1" x="0" y="0"/>' * 2), "<connector> has the id 1 of another"),
    "a slot across links": (
        (FOLDER / "slider_crank.linkage2")
        .read_text(encoding="utf-8")
        .replace('slidelimit id="4"', 'slidelimit id="2"'),
        "connector 6 slides between connectors 3, 2, which are not on one link",
    ),
    "an actuator of three connectors": (
        (FOLDER / "boom.linkage2")
        .read_text(encoding="utf-8")
        .replace(
            '<connector id="1"/>\n\t</Link>\n\t<selected>', '<connector id="1"/><connector id="3"/></Link><selected>'
        ),
        "actuator 1 has 3 connectors; an actuator has two",
    ),
    "no links": (linkage('<connector id="1" x="0" y="0" anchor="true"/>'), "a mechanism needs a body that can move"),
    # DXF
    "a drawing that is cut short": (four_bar().text()[:3000], "is not a valid DXF drawing: "),
    "a drawing of nothing": (dxf(""), "needs a layer 'ground' (or '0') with the fixed points; each layer is a body"),
    "a drawing without layers": (dxf(point("0", "0.0") + point("0", "1.0")), "needs layers that move next to 0"),
    "a drawing with NaN": (
        dxf(point("ground", "nan") + point("a", "0.0")),
        "POINT on layer 'ground': x = nan must be a finite",
    ),
    "a drawing with a word": (dxf(point("ground", "left") + point("a", "0.0")), "is not a valid DXF drawing: "),
    "a slot of no layer": (slider_crank().text().replace("SLOT", "slot_x"), "layer slot_x: there is no layer 'x'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_drawing_is_one_line(case: str, tmp_path: Path) -> None:
    drawing, part = WRONG[case]
    with pytest.raises(MechanismError) as caught:
        imported(drawing, "drawing")
    assert str(caught.value).startswith("drawing: ")
    assert part in str(caught.value)
    assert "\n" not in str(caught.value)

    file = tmp_path / "drawing"
    file.write_bytes(drawing if isinstance(drawing, bytes) else drawing.encode())
    result = CliRunner().invoke(main, ["import", str(file), "-o", str(tmp_path / "out.toml")])
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"kinfmu: {file}: ")
    assert not (tmp_path / "out.toml").exists()


def test_warnings_of_ezdxf_with_texts_of_the_file_are_not_printed(tmp_path: Path) -> None:
    file = tmp_path / "drawing.dxf"
    file.write_text(four_bar().text().replace("\nCLASS\n", "\n\x1b[31m\n", 1), encoding="utf-8")
    called = subprocess.run(  # in a process of its own: pytest has handlers for logs
        [sys.executable, "-m", "kinfmu", "import", str(file)], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert [line[:14] for line in called.stderr.splitlines()] == ["kinfmu: note: "] * 2
    assert parse(called.stdout).name == "drawing"


def test_large_drawings_are_refused_or_read_in_seconds() -> None:
    star = "".join(f'<Link id="{k}"><connector id="0"/><connector id="{k + 1}"/></Link>' for k in range(900))
    pins = "".join(f'<connector id="{k}" x="{k}" y="{k % 7}" anchor="{str(k == 0).lower()}"/>' for k in range(901))
    begin = time.monotonic()
    assert len(parse(imported(linkage(pins, links=star)).text).bodies) == 901
    with pytest.raises(MechanismError, match="needs a body that can move"):
        imported(linkage(pins.replace("false", "true"), links=star))
    assert time.monotonic() - begin < 60.0


def damaged(text: str, chance: random.Random) -> str:
    """The text with parts cut out, repeated or replaced."""
    for _ in range(chance.randint(1, 4)):
        a = chance.randrange(len(text))
        b = min(len(text), a + chance.randint(1, 30))
        middle = chance.choice(
            ["", text[a:b] * 2, "".join(chance.choices(string.printable, k=5)), "nan", "1e308", "-", "0"]
        )
        text = text[:a] + middle + text[b:]
    return text


@pytest.mark.parametrize(
    "source",
    [
        lambda: LINK,
        lambda: SLOT,
        lambda: CASES["a Scotch yoke"].link,
        *(lambda path=path: path.read_text(encoding="utf-8") for path in sorted(FOLDER.iterdir())),
        lambda: slider_crank().text(),
    ],
)
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long), pytest.param(3, marks=pytest.mark.long)])
def test_a_damaged_drawing_is_an_error_or_a_mechanism(source: Callable[[], str], seed: int) -> None:
    chance = random.Random(seed)  # noqa: S311
    text = source()
    for _ in range(60):
        hostile = damaged(text, chance)
        try:
            drawing = imported(hostile, "drawing")
        except MechanismError as error:
            assert re.fullmatch(r"drawing: .+", str(error)), hostile  # noqa: PT017
        else:
            parse(drawing.text)
            assert all(len(note.splitlines()) == 1 for note in drawing.notes)
