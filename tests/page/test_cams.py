"""Cams on the page after a change: what does not enter a cam keeps it, the rest draws the cam of the saved file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.toml_file import parse
from kinfmu.page import page as page_of
from tests.page.engines import PHONE, Browser, Opened, needs_browser, text_of
from tests.run.test_reactions import HEAD, JOINTS, SLIDING

pytestmark = needs_browser

CAMS = """
name = "four_cams"

[units]
length = "mm"

[parameters]
h = "4 mm"
swing = "-6 deg"
r = "9 mm"
load = "5 N"
reach = "-50 mm"

[bodies.ground]
points = { O = [0, 0], E = [90, 20], G = [6, 0], D = [-50, -80], Q = [200, 0] }
[bodies.cam]
points = { O = [0, 0] }
[bodies.lever]
points = { E = [0, 0], F = ["reach", 25], tip = [0, 60] }
start = { x = 90, y = 20, phi = 0 }
mass = 1
[bodies.stem]
points = { roller = [0, 0] }
start = { x = 6, y = 40 }
[bodies.flap]
points = { D = [0, 0], T = [0, 80] }
start = { x = -50, y = -80, phi = 0 }
[bodies.slow]
points = { Q = [0, 0] }
start = { x = 200 }
[bodies.plunger]
points = { P = [0, 0] }
start = { x = 200, y = 50 }

[joints]
O = { type = "revolute", between = ["ground.O", "cam.O"] }
E = { type = "revolute", between = ["ground.E", "lever.E"] }
D = { type = "revolute", between = ["ground.D", "flap.D"] }
Q = { type = "revolute", between = ["ground.Q", "slow.Q"] }
guide = { type = "translational", between = ["ground.G", "stem.roller"], axis = "90 deg" }
bush = { type = "translational", between = ["ground.Q", "plunger.P"], axis = "90 deg" }
mesh = { type = "gear", between = ["cam", "slow"], ratio = 2 }

[joints.lobe]
type = "cam_oscillating"
between = ["ground", "lever"]
cam = "cam"
contact = "lever.F"
roller_radius = "r"
law = "harmonic"
amplitude = "swing"
frequency = 1

[joints.lift]
type = "cam_translating"
between = ["ground.O", "stem.roller"]
cam = "cam"
axis = "90 deg"
offset = 40
roller_radius = "8 mm + 0*r"
law = "harmonic"
amplitude = "h"
frequency = 2

[joints.pad]
type = "cam_oscillating"
between = ["ground", "flap"]
cam = "cam"
contact = "flap.T"
normal = "180 deg"
law = "harmonic"
amplitude = "0.5*swing"
frequency = 1

[joints.press]
type = "cam_translating"
between = ["ground.Q", "plunger.P"]
cam = "slow"
axis = "90 deg"
offset = 50
normal = "90 deg"
law = "harmonic"
amplitude = "h"
frequency = 1

[drivers.cam]
type = "angle"
of = "cam"
law = "constant_speed"
speed = "60 rpm"

[loads.push]
type = "force_along"
at = "lever.tip"
angle = 0
law = "constant"
level = "load"
"""
SHAPES = "k.linkage.shapes.filter((one) => ['cam', 'pitch', 'roller', 'face'].includes(one.kind))"

STOP_AT_6 = """(() => {
    const [, probe] = k.linkage.engines.opened;
    const own = probe.at;
    probe.at = (u, ...rest) => (u[0] > 6 ? 5 : own.call(probe, u, ...rest)); // 5: no pose
})()"""


@pytest.fixture(scope="module")
def cams(chromium: Browser) -> Iterator[Opened]:
    with chromium.open(page_of(parse(CAMS))) as opened:
        yield opened
        assert opened.errors == []


def shapes(page: Opened, joint: str) -> dict[str, dict[str, Any]]:
    return {one["kind"]: one for one in page.get(SHAPES) if one["name"] == joint}


def set_values(page: Opened, **values: float) -> kinfmu.Mechanism:
    """Set values from those of the file; return the mechanism that the page saves."""
    page.get(f"(k.design.reset(), k.design.set({values!r}), k.reshape())")
    page.settle()
    assert page.get("k.design.isOk")
    page.tab.click("#tab-files")
    with page.tab.expect_download() as waiting:
        page.tab.click("#save-file")
    return parse(waiting.value.path().read_text("utf-8"))


def apart(points: Any, line: NDArray[np.float64]) -> float:
    """Return the largest distance of points from a closed polyline."""
    ends = np.roll(line, -1, axis=0) - line
    found = np.array(points)[:, None] - line
    part = np.clip((found * ends).sum(-1) / (ends**2).sum(-1), 0.0, 1.0)
    return float(np.hypot(*np.moveaxis(found - part[..., None] * ends, -1, 0)).min(axis=1).max())


def perimeter(line: Any) -> float:
    return float(np.hypot(*(np.array(line) - np.roll(line, 1, axis=0)).T).sum())


def is_that_of(mechanism: kinfmu.Mechanism, joint: str, drawn: dict[str, dict[str, Any]]) -> None:
    """Test the shapes of a cam against the profile of `kinfmu.cam_profile`, an independent computation by its law."""
    known = kinfmu.cam_profile(mechanism, joint, np.linspace(0.0, 2.0 * math.pi, 3601)[:-1])
    curves = {"cam": known.profile} | ({"pitch": known.pitch} if known.pitch is not None else {})
    for kind, line in curves.items():
        assert apart(drawn[kind]["points"], np.array(line)) < 1e-4, (joint, kind)
        assert perimeter(drawn[kind]["points"]) == pytest.approx(perimeter(line), rel=2e-4)
    if known.pitch is None:
        (ax, ay), (bx, by) = drawn["face"]["points"]
        reach = np.hypot(*(known.profile - known.axle).T).max()
        width = known.offset.max() - known.offset.min()
        assert math.hypot(bx - ax, by - ay) == pytest.approx(width + 0.3 * max(width, reach), rel=1e-3)
    else:
        assert drawn["roller"]["radius"] == pytest.approx(known.roller_radius)


@pytest.mark.long
def test_values_that_do_not_enter_a_cam_keep_its_shapes(cams: Opened) -> None:
    page = cams
    before = {joint: shapes(page, joint) for joint in ("lobe", "lift", "pad", "press")}
    assert all(before.values())
    for values in ({"load": 9.0}, {"bodies.lever.mass": 3.0}):
        set_values(page, **values)
        assert {joint: shapes(page, joint) for joint in before} == before
    set_values(page, swing=math.radians(-9))
    assert shapes(page, "lift") == before["lift"]
    assert shapes(page, "press") == before["press"]
    assert shapes(page, "lobe")["cam"] != before["lobe"]["cam"]
    assert page.tab.is_hidden("#note")


@pytest.mark.parametrize(
    "values",
    [
        {"swing": math.radians(-9), "h": 6.0},
        pytest.param(
            {"reach": -44.0, "bodies.ground.points.D.y": -70.0, "joints.press.offset": 58.0}, marks=pytest.mark.long
        ),
        pytest.param(
            {"bodies.ground.points.E.x": 84.0, "joints.pad.normal": math.radians(176), "joints.press.normal": 1.4},
            marks=pytest.mark.long,
        ),
        pytest.param(
            {"joints.mesh.ratio": 0.5, "bodies.ground.points.Q.x": 180.0, "joints.lift.offset": 36.0},
            marks=pytest.mark.long,
        ),
    ],
)
def test_values_that_enter_a_cam_draw_the_cam_of_the_saved_file(cams: Opened, values: dict[str, float]) -> None:
    saved = set_values(cams, **values)
    for joint in ("lobe", "lift", "pad", "press"):
        is_that_of(saved, joint, shapes(cams, joint))
    assert all("cam" not in one and "profile" not in one for one in cams.get("k.linkage.leftOut"))


@pytest.mark.long
def test_roller_of_a_given_curve_can_be_changed(chromium: Browser) -> None:
    with chromium.open(text_of("cam_roller")) as page:
        before = shapes(page, "pitch")["pitch"]["points"]
        saved = set_values(page, **{"joints.pitch.roller_radius": 7.0, "bodies.lever.points.roller.x": 84.0})
        is_that_of(saved, "pitch", shapes(page, "pitch"))
        assert apart(shapes(page, "pitch")["pitch"]["points"], np.array(before)) < 0.01  # [mm], chords of a degree
        assert page.errors == []


@pytest.mark.parametrize(
    ("values", "joint", "note"),
    [
        (
            {"r": 75.0},
            "lobe",
            "the profile of joint lobe, into which its roller cuts; the profile of joint lift, whose roller",
        ),
        ({"h": 35.0}, "lift", "the profile of joint lift, into which its roller cuts"),
        ({"swing": -1.2}, "pad", "the profile of joint pad, which would not be convex"),
    ],
)
@pytest.mark.few(1)
def test_profile_that_cannot_be_is_left_out_and_the_page_states_why(
    cams: Opened, values: dict[str, float], joint: str, note: str
) -> None:
    saved = set_values(cams, **values)
    text = cams.tab.text_content("#note")
    assert text.startswith("Not drawn with these values: ")
    assert note in text
    assert "cam" not in shapes(cams, joint)
    with pytest.raises(KinfmuError, match=joint):
        kinfmu.cam_profile(saved, joint)
    cams.tab.set_viewport_size(PHONE)
    cams.settle()
    assert cams.tab.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    cams.tab.set_viewport_size({"width": 1280, "height": 800})
    cams.get("(k.design.reset(), k.reshape())")
    cams.settle()
    assert cams.tab.is_hidden("#note")


@pytest.mark.long
def test_cam_that_does_not_turn_all_the_way_is_left_out(cams: Opened) -> None:
    cams.get(STOP_AT_6)
    set_values(cams, **{"joints.lift.offset": 44.0})
    cams.get("delete k.linkage.engines.opened[1].at")
    assert shapes(cams, "lift") == {}
    assert (
        "Not drawn with these values: the cam of joint lift, which no driver turns all the way round."
        in cams.tab.text_content("#note")
    )


@pytest.mark.long
def test_the_page_states_why_a_contact_force_is_unknown(chromium: Browser) -> None:
    text = HEAD + JOINTS["up"] + SLIDING
    line = "lift: contact force unknown, the key 'roller_radius' or 'normal' is missing; without a value: O.force_x, "
    with chromium.open(page_of(parse(text.replace("roller_radius = 0.01", "")))) as page:
        page.tab.click("#tab-show")
        (shown,) = page.tab.get_by_text("contact force unknown").all_inner_texts()
        assert shown == f"{line}O.force_y, guide.force, guide.moment."
        assert "undetermined: O, guide" in page.tab.inner_text("#show")
        assert page.errors == []
    with chromium.open(page_of(parse(text))) as page:
        page.tab.click("#tab-show")
        assert page.tab.get_by_text("contact force unknown").count() == 0


@pytest.mark.long
def test_the_block_of_a_follower_is_behind_the_cam_and_under_the_edge_of_the_roller(chromium: Browser) -> None:
    mechanism = parse(HEAD + JOINTS["up"] + SLIDING)
    with chromium.open(page_of(mechanism)) as page:
        page.tab.click("#tab-files")
        with page.tab.expect_download() as waiting:
            page.tab.click("#save-svg")
        drawn = waiting.value.path().read_text("utf-8").splitlines()
        scale = page.get("k.view.scale")
        assert page.errors == []
    (block,) = (k for k, line in enumerate(drawn) if re.match(r'<path d="M[^LZ]*(L[^LZ]*){3}Z" fill="(?!none)', line))
    (profile,) = (k for k, line in enumerate(drawn) if line.count("L") > 300 and 'fill="none"' not in line)
    filled, edge = (k for k, line in enumerate(drawn) if f'r="{0.01 * scale:.2f}"' in line)
    assert filled < block < profile < edge
    assert 'fill="none"' in drawn[edge]
