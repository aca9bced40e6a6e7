"""Names of bodies in the drawing of a page: they keep their places until something covers them for a while."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from tests.page.engines import NODE, needs_node

HEAD = """
globalThis.document = {
    createElement: () => ({ getContext: () => ({ measureText: (text) => ({ width: 7 * text.length }) }) }),
};
const { Names, Spots } = await import("./names.js");
const view = { scale: 1, width: 800, height: 600 };
const spots = new Spots();
"""
COVERED = """
let at = null;
const pen = { line() {}, text(x, y) { at = [x, y]; } };
function named(covers) {
    const names = new Names(pen, view, { paper: "#fff", quiet: "#888", ink: "#000" }, spots);
    for (const [a, b] of covers) names.cover(a, b, 4);
    names.add({ text: "crank", places: [[400, 300]], colour: "#000", off: 20, rank: 1 });
    return names;
}
function frame(now, covers) {
    spots.begin(now, {}, view);
    named(covers).draw();
    return String(at);
}
function over([x, y]) {
    return [[[x - 30, y], [x + 30, y]]];
}
function apartFrom([left, top]) {
    const lines = [];
    for (let y = 180; y < 420; y += 6) {
        for (let x = 280; x < 520; x += 12) {
            if (Math.abs(x - left) > 40 || Math.abs(y - top) > 16) lines.push([[x, y], [x + 8, y]]);
        }
    }
    return lines;
}
spots.foresee([named([])]);
frame(0, []);
const best = at; // its place where nothing else is drawn
spots.known.clear();
spots.foresee([named([]), named(apartFrom(best))]);
const kept = frame(16, over(best));
const place = at;
const covered = JSON.parse(process.argv[2]);
const moves = [];
for (let now = 20; now < 2000; now += 4) {
    const moved = frame(now, now >= 1000 && now < 1000 + covered ? over(place) : []) !== kept;
    if (moved && !moves.length) moves.push(now);
}
console.log(JSON.stringify(moves));
"""


PASSING = """
const theme = { paper: "#fff", quiet: "#888", ink: "#000" };
const shown = [];
for (let now = 0; now < 4000; now += 10) {
    const texts = [];
    spots.begin(now, {}, view);
    const names = new Names({ line() {}, text: (x, y, text) => texts.push(text) }, view, theme, spots);
    const x = now ? Math.min(250 + 0.1 * now, 500) : 250;
    for (const [text, place, rank] of [["crank", [400, 300], 1], ["rod", [x, 300], 2]]) {
        names.add({ text, places: [place], colour: "#000", off: 20, rank, yields: true });
    }
    names.draw();
    if (texts.includes("rod") !== shown.at(-1)?.[1]) shown.push([now, texts.includes("rod")]);
}
console.log(JSON.stringify(shown));
"""


def printed(script: str, tmp_path: Path, *arguments: str) -> Any:
    """Return what a script that continues `HEAD` prints."""
    shutil.copytree(Path(kinfmu.__file__).parent / "page" / "web", tmp_path / "web")
    path = tmp_path / "web" / "script.mjs"
    path.write_text(HEAD + script, encoding="utf-8")
    done = subprocess.run([NODE, path, *arguments], capture_output=True, check=True, text=True)
    return json.loads(done.stdout)


@needs_node
@pytest.mark.parametrize(("covered", "moves"), [(16, []), (290, []), (320, [1300]), (600, [1300])])
def test_a_name_moves_once_it_has_been_covered_for_300_ms(covered: int, moves: list[int], tmp_path: Path) -> None:
    assert printed(COVERED, tmp_path, str(covered)) == moves


@needs_node
def test_a_name_is_hidden_while_it_passes_a_more_important_one_and_300_ms_longer(tmp_path: Path) -> None:
    (_, is_there), (begin, is_passing), (end, is_back) = printed(PASSING, tmp_path)
    assert [is_there, is_passing, is_back] == [True, False, True]
    widths = 0.5 * (7 * len("crank") + 7 * len("rod")) + 4
    assert end - begin == pytest.approx(2 * widths / 0.1 + 300, abs=30)


@needs_node
def test_a_place_without_a_name_has_no_leader(tmp_path: Path) -> None:
    script = """
    const names = new Names({}, view, {}, spots);
    for (const text of ["", "crank"]) names.add({ text, places: [[400, 300]], colour: "#000", off: 20, rank: 1 });
    console.log(JSON.stringify(names.wanted.map(({ text }) => text)));
    """
    assert printed(script, tmp_path) == ["crank"]
