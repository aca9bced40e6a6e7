"""Transmission angles and instant centres that a page draws, against the geometry of a crank-rocker."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from tests.page.engines import NODE, needs_node

SCRIPT = """
import { centres, transmissions } from "./instants.js";
const { points, bodies, qd } = JSON.parse(process.argv[2]);
const triples = bodies.map((_, k) => (k === 0 ? [-1, -1, -1] : [3 * k - 3, 3 * k - 2, 3 * k - 1]));
const linkage = {
    data: { loops: [{ pins: ["P", "Q", "C"] }] },
    bodies,
    pose: { triples, qd },
    point: (pin) => points[pin],
    motionOf: (body) => ({ v: atOrigin(body) }),
};
// The velocity of the point of a body that is at the world's origin.
function atOrigin(body) {
    if (body === 0) return [0, 0];
    const { at, omega } = JSON.parse(process.argv[2]).frames[body];
    return [qd[3 * body - 3] + omega * at[1], qd[3 * body - 2] - omega * at[0]];
}
console.log(JSON.stringify({ centres: centres(linkage), angles: transmissions(linkage).map((one) => one.angle) }));
"""


def crossing(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Where the line through a and b meets that through c and d."""
    s, _ = np.linalg.solve(np.column_stack([b - a, c - d]), c - a)
    return np.asarray(a + s * (b - a))


@needs_node
@pytest.mark.parametrize("crank_angle", [0.3, 1.4, 4.0])
def test_centres_and_transmission_angle_are_those_of_the_links(crank_angle: float, tmp_path: Path) -> None:
    mechanism = kinfmu.load("crank_rocker")
    run = kinfmu.solve(mechanism, crank_angle=[crank_angle])
    bodies = ["ground", "crank", "coupler", "rocker"]
    place = {
        body: np.array([run[f"{body}.x"][0], run[f"{body}.y"][0]]) if body != "ground" else np.zeros(2)
        for body in bodies
    }

    def point(name: str) -> np.ndarray:
        body, _, _ = name.partition(".")
        s_x, s_y = mechanism.body_points[name]
        phi = run[f"{body}.phi"][0] if body != "ground" else 0.0
        c, s = math.cos(phi), math.sin(phi)
        return np.asarray(place[body] + [c * s_x - s * s_y, s * s_x + c * s_y])

    o, c, p, q = (point(name) for name in ("ground.O", "ground.C", "crank.P", "rocker.Q"))
    frames = [
        {"at": place[body].tolist(), "omega": float(run[f"{body}.omega"][0]) if body != "ground" else 0.0}
        for body in bodies
    ]
    given = {
        "points": {"P": p.tolist(), "Q": q.tolist(), "C": c.tolist()},
        "bodies": bodies,
        "qd": [float(run[f"{body}.{rate}"][0]) for body in bodies[1:] for rate in ("vx", "vy", "omega")],
        "frames": frames,
    }
    source = Path(kinfmu.page.__file__).parent / "web" / "instants.js"
    shutil.copy(source, tmp_path / "instants.js")
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "script.js").write_text(SCRIPT)
    done = subprocess.run(
        [NODE, "script.js", json.dumps(given)], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)
    expected = {"12": o, "13": crossing(o, p, c, q), "14": c, "23": p, "24": crossing(o, c, p, q), "34": q}
    assert {one["label"] for one in found["centres"]} == set(expected)
    for one in found["centres"]:
        np.testing.assert_allclose(one["at"], expected[one["label"]], rtol=0, atol=1e-9 * np.abs(one["at"]).max())
    to_p, to_c = p - q, c - q
    cosine = to_p @ to_c / np.linalg.norm(to_p) / np.linalg.norm(to_c)
    assert found["angles"] == pytest.approx([math.acos(cosine)], abs=1e-12)
