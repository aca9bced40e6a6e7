"""Names of bodies in the drawing of a page: they keep their places until something covers them for a while."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

import kinfmu
from tests.page.engines import NODE, needs_node

SCRIPT = """
globalThis.document = {
    createElement: () => ({ getContext: () => ({ measureText: (text) => ({ width: 7 * text.length }) }) }),
};
const { Names, Spots } = await import("./names.js");
const view = { scale: 1, width: 800, height: 600 };
const spots = new Spots();
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


@needs_node
@pytest.mark.parametrize(("covered", "moves"), [(16, []), (290, []), (320, [1300]), (600, [1300])])
def test_a_name_moves_once_it_has_been_covered_for_300_ms(covered: int, moves: list[int], tmp_path: Path) -> None:
    shutil.copytree(Path(kinfmu.__file__).parent / "page" / "web", tmp_path / "web")
    script = tmp_path / "web" / "script.mjs"
    script.write_text(SCRIPT, encoding="utf-8")
    done = subprocess.run([NODE, script, str(covered)], capture_output=True, check=True, text=True)
    assert json.loads(done.stdout) == moves
