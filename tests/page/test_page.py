"""The page in a browser: it opens without errors and requests, moves under the hand, shows native poses."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest

import kinfmu
import kinfmu.page
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text as toml_text
from kinfmu.run.axis import shown_range
from tests.gallery_members import every_member
from tests.page.engines import DESKTOP, PHONE, Browser, needs_browser, text_of

pytestmark = needs_browser
LARGEST = 230_000  # [bytes] of a page
LABELS = Path(__file__).with_name("labels.js").read_text("utf-8")
CONTRASTS = Path(__file__).with_name("contrasts.js").read_text("utf-8")
JUMPS = Path(__file__).with_name("jumps.js").read_text("utf-8")
COVERED = Path(__file__).with_name("covered.js").read_text("utf-8")


@pytest.mark.parametrize("name", ["crank_rocker", "jansen_leg", "excavator"])
@pytest.mark.few(1)
def test_page_is_one_small_file_without_addresses(name: str) -> None:
    text = text_of(name)
    assert 130_000 <= len(text.encode()) <= LARGEST
    outside = text.replace("http://www.w3.org/2000/svg", "")
    assert "http://" not in outside
    assert "https://" not in outside


@pytest.mark.long
def test_page_with_a_spline_of_500_points_has_about_250_kb() -> None:
    angles = np.linspace(0.0, 2.0 * math.pi, 501)
    points = [[float(x), 50.0 + 8.0 * math.cos(x) + 2.0 * math.cos(3.0 * x)] for x in angles]
    text = toml_text(kinfmu.load("cam_roller"))
    law = text[text.index('law = "sequence"') : text.index("roller_radius")]
    mech = parse(text.replace(law, f'law = "spline"\nends = "periodic"\npoints = {points}\n'))
    assert 200_000 <= len(kinfmu.page.page(mech).encode()) <= 300_000


@pytest.mark.parametrize("name", ["crank_rocker", "jansen_leg", "excavator"])
@pytest.mark.few(1)
def test_page_opens_without_errors_and_without_requests(chromium: Browser, name: str) -> None:
    with chromium.open(text_of(name)) as page:
        page.tab.click("#tab-plots")
        page.tab.click("#play")
        page.tab.wait_for_timeout(150)
        assert page.get("k.isPlaying && k.linkage.t > 0")
        assert page.errors == []
        assert page.requests == []


def test_dragged_crank_turns_through_its_whole_range_with_the_native_poses(chromium: Browser) -> None:
    mech = kinfmu.load("crank_rocker")
    with chromium.open(text_of("crank_rocker")) as page:
        (x, y), (tip, _) = page.at("crank.O"), page.at("crank.P")
        radius = tip - x
        turn = [math.radians(10 * k) for k in range(1, 37)]
        page.drag("crank.P", [(x + radius * math.cos(a), y - radius * math.sin(a)) for a in turn])
        angle = page.get("k.linkage.u[0]")
        shown = page.get("Array.from(k.linkage.pose.q)")
        names = page.get("[...k.linkage.index.keys()]")
        assert page.errors == []
    assert angle == pytest.approx(2 * math.pi, abs=0.02)
    run = kinfmu.solve(mech, crank_angle=[angle])
    known = dict(zip(names, shown, strict=True))
    for name in run.outputs:
        assert known[name] == pytest.approx(run[name][0], abs=1e-10)


@pytest.mark.long
def test_dragged_bucket_moves_three_cylinders_whose_sliders_end_at_their_limits(chromium: Browser) -> None:
    limits = [(reach.low, reach.high) for reach in kinfmu.check(kinfmu.load("excavator")).ranges]
    with chromium.open(text_of("excavator")) as page:
        assert np.array(page.get("k.linkage.ranges")) == pytest.approx(np.array(limits), abs=1e-7)
        x, y = page.at("bucket.tip")
        page.drag("bucket.tip", [(x - 8 * k, y - 3 * k) for k in range(1, 11)])
        assert page.at("bucket.tip") == pytest.approx((x - 80, y - 30), abs=3)
        assert page.errors == []


@pytest.mark.parametrize("stop", [1e-6, 0.004, 0.2, 3.0, 100.0])
@pytest.mark.long
def test_the_clock_has_the_digits_of_the_run_and_the_speed_makes_short_runs_visible(
    chromium: Browser, stop: float
) -> None:
    text = toml_text(kinfmu.load("crank_rocker"))
    start, end = text.index("[run]"), text.index("[bodies.ground]")
    mech = parse(f"{text[:start]}[run]\nstop = {stop!r}\nstep = {stop / 100!r}\n\n{text[end:]}")
    with chromium.open(kinfmu.page.page(mech)) as page:
        shown = []
        for part in range(101):
            page.get(f"k.refresh(() => k.linkage.goToTime({stop * part / 100!r}))")
            page.settle()
            shown.append(page.tab.inner_text("#clock"))
        speed = float(page.tab.input_value("#speed"))
        assert page.errors == []
    assert len(set(shown)) == 101
    assert float(shown[-1].removesuffix(" s")) == pytest.approx(stop)
    assert len(shown[1]) <= len("0.00000001 s")
    assert 1.5 <= stop / speed <= 30.0  # [s]


def _geared(ratio: float) -> kinfmu.Mechanism:
    """Return the geared five-bar with links that are long enough for all ratios, which shift the phase too."""
    text = toml_text(kinfmu.load("geared_five_bar"))
    return parse(re.sub(r"ratio = -2(\.0)?", f"ratio = {ratio}", text).replace("T = [60", "T = [80"))


@pytest.mark.parametrize(
    ("mech", "turns"),
    [
        (kinfmu.load("engine"), 2),
        (kinfmu.load("jansen_leg_loaded"), 1),
        *((_geared(ratio), turns) for ratio, turns in ((-0.5, 2), (-2.0 / 3.0, 3), (0.75, 4), (-2.0, 1))),
    ],
    ids=lambda one: getattr(one, "name", one),
)
@pytest.mark.few(1)
def test_slider_plots_curves_and_clock_run_over_one_whole_cycle(
    chromium: Browser, mech: kinfmu.Mechanism, turns: int
) -> None:
    (driver,) = mech.drivers
    start = float(driver.law.at(0.0))
    speed = float(driver.law.at(1.0)) - start
    with chromium.open(kinfmu.page.page(mech)) as page:
        low, high = page.get("k.linkage.ranges[0]")
        assert [low, high] == pytest.approx([start, start + turns * math.tau])
        page.tab.click("#tab-plots")
        page.settle()
        shown = page.get("k.plots.plots.map(plot => plot.select.value)")
        table = page.get("({ x: [...k.plots.table.x], columns: k.plots.table.columns.map(one => [...one]) })")
        curves = page.get("k.linkage.curves([...k.linkage.data.points.keys()])")
        values = [start + part * turns * math.tau for part in (0.1, 0.264, 0.5277, 0.71, 0.95, 0.3)]
        seen = []
        for value in values:
            page.move(value)
            clock = float(page.tab.inner_text("#clock").removesuffix(" s"))
            texts = page.tab.locator("#plots .plot .reading").all_text_contents()
            slider = float(page.tab.locator("#drivers input[type=range]").input_value())
            seen.append((slider, page.get("k.linkage.t"), clock, [float(text.split(" ")[0]) for text in texts]))
        assert page.errors == []
    assert len(table["x"]) == turns * 360 + 1
    assert all(math.dist(curve[0], curve[-1]) < 1e-9 for curve in curves if curve)
    period = turns * math.tau / abs(speed)
    by_hand = kinfmu.solve(mech, (np.array(values) - start) / speed)
    for k, (value, (slider, t, clock, numbers)) in enumerate(zip(values, seen, strict=True)):
        assert slider == pytest.approx(value)
        assert math.remainder(t - (value - start) / speed, period) == pytest.approx(0.0, abs=1e-12 * period)
        assert clock == pytest.approx(t, abs=0.01 * period)
        for name, number, column in zip(shown, numbers, table["columns"], strict=True):
            factor = 180.0 / math.pi if name.endswith(".phi") else 1.0
            assert number == pytest.approx(factor * by_hand[name][k], rel=1e-4, abs=1e-6)
            reach = max(column) - min(column)
            assert number == pytest.approx(np.interp(value, table["x"], column), abs=2e-3 * reach)
    turn = kinfmu.solve(mech, (np.array(table["x"]) - start) / speed)
    for name, column in zip(shown, table["columns"], strict=True):
        assert np.abs(turn[name] - column).max() < 1e-8 * max(1.0, np.abs(column).max())


@pytest.mark.long
def test_the_cycle_is_counted_again_with_another_ratio(chromium: Browser) -> None:
    with chromium.open(kinfmu.page.page(_geared(-2.0))) as page:
        for ratio, turns in ((-0.5, 2), (-1.5, 2), (-2.25, 4), (-1.0, 1)):
            page.get(f"k.refresh(() => {{ k.design.set({{'joints.mesh.ratio': {ratio}}}); k.reshape(); }})")
            page.settle()
            low, high = page.get("k.linkage.ranges[0]")
            assert high - low == pytest.approx(turns * math.tau)
            assert page.get("k.design.isOk")
        assert page.errors == []


def test_page_fits_a_phone(chromium: Browser) -> None:
    with chromium.open(text_of("jansen_leg"), has_touch=True) as page:
        page.resize(PHONE)
        assert page.tab.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        x, y = page.at("crank.X")
        page.tab.touchscreen.tap(x, y)
        assert page.errors == []


@pytest.mark.parametrize("name", ["jansen_leg", "parallel_jaw", "peaucellier", "fourbar", "toggle_press"])
@pytest.mark.parametrize("size", [PHONE, DESKTOP])
@pytest.mark.few(1)
def test_names_cover_neither_each_other_nor_the_linkage(chromium: Browser, name: str, size: dict[str, int]) -> None:
    with chromium.open(text_of(name)) as page:
        page.resize(size)
        page.get("k.fit()")
        if size == PHONE:
            page.tab.click("#sheet")
        page.tab.click("#tab-files")
        low, high = page.get("k.linkage.ranges[0]")
        for part in (0.1, 0.3, 0.55, 0.8):
            page.move(low + part * (high - low))
            with page.tab.expect_download() as waiting:
                page.tab.click("#save-svg")
            covered = page.tab.evaluate(COVERED, waiting.value.path().read_text("utf-8"))
            assert covered["count"] > 8
            assert covered["found"] == []
        assert page.errors == []


def _light(colour: str) -> float:
    """Return the relative luminance of a colour '#rrggbb', as WCAG defines it."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


@pytest.mark.parametrize(
    "size", [pytest.param(PHONE, id="phone"), pytest.param(DESKTOP, id="desktop", marks=pytest.mark.long)]
)
@every_member
@pytest.mark.long
def test_names_keep_their_places_in_a_turn_and_have_the_contrast_of_wcag_aa(
    chromium: Browser, name: str, size: dict[str, int]
) -> None:
    with chromium.open(text_of(name)) as page:
        page.resize(size)
        page.get("k.fit()")
        page.settle()
        played = page.tab.evaluate(JUMPS)
        assert played["frames"] >= 60
        assert len(played["found"]) <= 8, played["found"]
        pairs = [(*pair, _light(pair[0]) + 0.05, _light(pair[1]) + 0.05) for pair in played["colours"]]
        contrasts = {f"{text} on {paper}": max(a, b) / min(a, b) for text, paper, a, b in pairs}
        assert len(contrasts) > 6
        assert {pair: ratio for pair, ratio in contrasts.items() if ratio < 4.5} == {}
        assert page.errors == []


def test_a_name_without_a_place_is_shown_at_a_tap_and_under_the_mouse(chromium: Browser) -> None:
    with chromium.open(text_of("parallel_jaw"), has_touch=True) as page:
        page.resize(PHONE)
        page.get("k.fit()")
        page.tab.evaluate(
            """() => {
                window.texts = [];
                const write = CanvasRenderingContext2D.prototype.fillText;
                CanvasRenderingContext2D.prototype.fillText = function (text, ...at) {
                    window.texts.push(text);
                    write.call(this, text, ...at);
                };
            }"""
        )

        def texts() -> list[str]:
            page.get("(window.texts = [], k.refresh())")
            page.settle()
            return [str(one) for one in page.tab.evaluate("window.texts")]

        def shows_rod() -> bool:
            return sum("rod" in one.split(", ") for one in texts()) == 1

        x, y = page.at("left_crank.rod")
        assert not shows_rod()
        page.tab.touchscreen.tap(x, y)
        assert shows_rod()
        page.tab.touchscreen.tap(x - 90, y + 60)
        assert not shows_rod()
        page.tab.mouse.move(x, y)
        assert shows_rod()
        page.tab.mouse.move(x, PHONE["height"] - 20)
        assert not shows_rod()
        assert page.errors == []


def test_value_changes_curve_and_can_be_undone_and_read_from_the_address(chromium: Browser) -> None:
    with chromium.open(text_of("jansen_leg")) as page:
        before = page.get("k.curves[0]")
        field = page.tab.get_by_label("m mm", exact=True)
        field.fill("14")
        field.press("Enter")
        page.settle()
        changed = page.get("k.curves[0]")
        page.tab.wait_for_function("location.hash === '#m=14'")
        page.tab.click("#undo")
        page.settle()
        assert page.get("k.curves[0]") == before
        assert page.get("location.hash") == ""
    with chromium.open(text_of("jansen_leg"), "#m=14&@crank=1") as page:
        assert page.get("k.curves[0]") == changed
        assert page.get("k.linkage.u[0]") == 1.0
        assert page.errors == []
    leg = kinfmu.load("jansen_leg").with_parameters({"m": 14.0})
    run = kinfmu.solve(leg, crank_angle=np.linspace(0.0, 2.0 * np.pi, 721))
    x, y, is_of_run = np.array(changed).T
    assert np.hypot(x - run["foot.x"], y - run["foot.y"]).max() < 1e-9
    assert is_of_run.all()  # a whole turn


def test_the_part_of_a_curve_over_the_run_is_known(chromium: Browser) -> None:
    quarter = dataclasses.replace(kinfmu.load("crank_rocker"), run=kinfmu.RunSettings(0.0, 0.25))
    with chromium.open(kinfmu.page.page(quarter)) as page:
        start, stop = page.get("[0, 0.25].map((t) => k.linkage.driven(t).u[0])")
        values = np.linspace(*page.get("k.linkage.ranges[0]"), len(page.get("k.curves[0]")))
        is_of_run = np.array(page.get("k.curves[0]"))[:, 2].astype(bool)
        ahead = (values - start + 1e-5) % (2.0 * np.pi)
        np.testing.assert_array_equal(is_of_run, ahead <= stop - start + 2e-5)
        assert 0.1 < is_of_run.mean() < 0.9
        assert page.errors == []


@pytest.mark.long
def test_every_key_press_and_value_within_one_frame_counts(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        press = "['ArrowRight', 'ArrowRight', 'ArrowRight'].forEach(key => k.canvas.dispatchEvent(new KeyboardEvent("
        page.get(f"{press}'keydown', {{ key, bubbles: true }})))")
        page.settle()
        assert page.get("k.linkage.u[0]") == pytest.approx(math.radians(3))
        page.tab.click("#tab-plots")
        page.settle()
        page.get("document.querySelector('.plot canvas').focus()")
        press = press.replace("k.canvas", "document.activeElement")
        page.get(f"{press}'keydown', {{ key, bubbles: true }})))")
        page.settle()
        assert page.get("k.linkage.u[0]") == pytest.approx(math.radians(6))
        crank, rocker = "bodies.crank.points.P.x", "bodies.rocker.points.Q.x"
        page.get(
            f"(k.setValues({{ '{crank}': 19 }}), k.setValues({{ '{rocker}': 51 }}), k.commit(), k.undo(), k.undo(true))"
        )
        page.settle()
        assert page.get("Object.fromEntries(k.design.changes())") == {crank: 19, rocker: 51}
        assert page.errors == []


def test_lengths_that_do_not_close_keep_the_last_pose_in_grey(chromium: Browser) -> None:
    with chromium.open(text_of("jansen_leg")) as page:
        pose = page.get("Array.from(k.linkage.pose.q)")
        field = page.tab.get_by_label("m mm", exact=True)
        field.fill("45")
        field.press("Enter")
        page.settle()
        banner = page.tab.text_content("#banner")
        assert re.match(r"Does not close: joint knee does not close: gap [\d.]+ mm\. (The last good|In grey)", banner)
        assert page.get("k.extra().isGhost")
        assert page.get("Array.from(k.linkage.pose.q)") == pose
        field.fill("15")
        field.press("Enter")
        page.settle()
        assert page.tab.is_hidden("#banner")
        assert page.get("Array.from(k.linkage.pose.q)") == pose
        assert page.errors == []


def test_a_crank_at_its_limit_names_joint_and_gap(chromium: Browser) -> None:
    with chromium.open(text_of("triple_rocker")) as page:
        limit = max(one["at"] for one in page.get("k.linkage.limits"))
        page.move(limit + 0.2)
        banner = page.tab.text_content("#banner")
        assert re.match(r"Stops here: .* cannot close; there, joint \w+ does not close: gap [\d.]+ mm\.$", banner)
        assert page.get("k.linkage.u[0]") == pytest.approx(limit, abs=1e-3)
        assert page.errors == []


def test_dragged_pin_changes_lengths_and_the_saved_file_has_them(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        x, y = page.at("rocker.Q")
        page.tab.get_by_text("All numbers of the file").click()
        page.tab.locator("summary", has_text=re.compile("^coupler$")).click()
        page.tab.get_by_text("coordinates of coupler that are 0").click()
        page.tab.click("#edit")
        page.tab.get_by_label("Lock coupler.Q y").click()
        page.drag("rocker.Q", [(x + 4 * k, y - 3 * k) for k in range(1, 9)])
        values = page.get("Object.fromEntries(k.design.changes())")
        assert values
        assert all(name.startswith(("bodies.coupler.points.Q.x", "bodies.rocker.points.Q")) for name in values)
        assert page.at("rocker.Q") == pytest.approx((x + 32, y - 24), abs=2)
        page.move(2.0)
        names, shown = page.get("[...k.linkage.index.keys()]"), page.get("Array.from(k.linkage.pose.q)")
        page.tab.click("#tab-files")
        with page.tab.expect_download() as waiting:
            page.tab.click("#save-file")
        text = waiting.value.path().read_text("utf-8")
        assert waiting.value.suggested_filename == "crank_rocker.toml"
        with page.tab.expect_download() as waiting:
            page.tab.click("#save-driver")
        table = np.genfromtxt(waiting.value.path(), delimiter=",", names=True, deletechars="")
        assert page.errors == []
    mech = parse(text)
    run = kinfmu.solve(mech, crank_angle=[2.0])
    known = dict(zip(names, shown, strict=True))
    for name in run.outputs:
        assert known[name] == pytest.approx(run[name][0], abs=1e-10)
    speed = math.pi  # [rad/s], of the file
    turn = kinfmu.solve(mech, crank_angle=np.radians(table["crank_angle_[deg]"]), crank_speed=np.full(361, speed))
    assert np.abs(turn["tracer.y"] - table["tracer.y_[mm]"]).max() < 1e-10
    assert np.abs(turn["tracer.vx"] - table["tracer.vx_[mm/s]"]).max() < 1e-9


@pytest.mark.long
def test_pin_dragged_too_far_stays_where_the_lengths_close(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        page.tab.click("#edit")
        x, y = page.at("ground.C")
        page.drag("ground.C", [(x + 60 * k, y) for k in range(1, 15)])
        assert page.get("k.design.isOk")
        reached, _ = page.at("ground.C")
        assert x < reached < x + 60 * 14
        pins = [page.at("coupler.Q"), page.at("rocker.Q")]
        assert pins[0] == pytest.approx(pins[1], abs=1e-6)
        assert page.errors == []


@pytest.mark.long
def test_slides_and_wheels_follow_new_lengths(chromium: Browser) -> None:
    with chromium.open(text_of("scotch_yoke")) as page:
        page.get("k.design.set({'bodies.crank.points.P.x': 52}) && k.reshape()")
        shapes = {one["kind"]: one["points"] for one in page.get("k.linkage.shapes")}
        assert np.abs(shapes["rail"]) == pytest.approx(np.array([[52, 0], [52, 0]]), abs=1e-6)
        assert np.abs(shapes["slot"]) == pytest.approx(np.array([[0, 52], [0, 52]]), abs=1e-6)
        page.settle()
        assert page.errors == []
    with chromium.open(text_of("geared_five_bar")) as page:
        page.get("k.design.set({'bodies.ground.points.C.x': 66}) && k.reshape()")
        assert sorted(page.get("k.linkage.shapes.flatMap(one => one.radius || [])")) == pytest.approx([22, 44])
        page.get("k.design.set({'joints.mesh.offset': 0.1}) && k.reshape()")
        assert page.get("k.linkage.shapes.every(one => one.kind !== 'wheel')")
        page.settle()
        assert page.errors == []


@pytest.mark.long
def test_flat_face_touches_its_cam_and_a_roller_runs_on_its_pitch_curve(chromium: Browser) -> None:
    with chromium.open(text_of("flat_face_lever")) as page:
        page.move(0.7)
        page.tab.click("#tab-files")
        with page.tab.expect_download() as saved:
            page.tab.click("#save-svg")
        text = Path(saved.value.path()).read_text("utf-8")
        assert page.errors == []
    found = [
        (np.array([float(x) for x in re.findall(r"-?[0-9.]+", path)]).reshape(-1, 2), float(width))
        for path, width in re.findall(r'<path d="([^"]+)"[^>]* stroke-width="([^"]+)"', text)
    ]
    (cam,) = (line for line, _ in found if len(line) == 360)
    width = max(width for _, width in found)  # of the edges of links
    bars = [line for line, own in found if own == width]
    assert len(bars) == 2  # the lever's link, and the line of its face
    for (ax, ay), (bx, by) in bars:
        along = np.array([bx - ax, by - ay]) / math.hypot(bx - ax, by - ay)
        gaps = np.abs((cam - [ax, ay]) @ [-along[1], along[0]])
        assert gaps.min() == pytest.approx(0.5 * width, abs=1.0)  # [px], with the width of the edge
    with chromium.open(text_of("cam_roller")) as page:
        kinds = page.get("k.linkage.shapes.map(one => one.kind)")
        assert {"cam", "pitch", "roller"} <= set(kinds)
        (pitch,) = page.get("k.linkage.shapes.filter(one => one.kind === 'pitch').map(one => one.points)")
        page.move(2.0)
        at = page.get("[k.linkage.data.points.findIndex(one => one.body === 'lever' && one.name === 'roller')]")
        place = page.get(f"k.linkage.point({at[0]})")
        x, y, phi = page.get("k.linkage.bodyPose(k.linkage.body('cam'))")
        c, s = math.cos(phi), math.sin(phi)
        curve = np.array(pitch) @ [[c, s], [-s, c]] + [x, y]
        assert np.hypot(*(curve - place).T).min() < 0.5 * np.hypot(*(curve[1] - curve[0])) * 1.1


@pytest.mark.long
def test_masses_and_gravity_have_the_limits_and_the_effects_of_the_file(chromium: Browser) -> None:
    mech = kinfmu.load("fourbar_loaded")
    with chromium.open(text_of("fourbar_loaded")) as page:
        for key in ("mass", "inertia"):
            before = page.get("Array.from(k.linkage.pose.forces)")
            page.get(f"k.refresh(() => {{ k.design.set({{'bodies.rocker.{key}': -1}}); k.reshape(); }})")
            page.settle()
            text = page.tab.inner_text("#banner")
            assert text.startswith(f"Not valid: [bodies.rocker] {key} = -1 must be 0 or more.")
            assert page.get("Array.from(k.linkage.pose.forces)") == before
            page.get(f"k.refresh(() => {{ k.design.set({{'bodies.rocker.{key}': 0.5}}); k.reshape(); }})")
            page.settle()
            assert page.tab.is_hidden("#banner")
        page.get("k.refresh(() => { k.design.set({'gravity.x': 0.7, 'gravity.y': -1.62}); k.reshape(); })")
        page.settle()
        page.move(2.0)
        forces = page.get("Array.from(k.linkage.pose.forces)")
        names = page.get("k.linkage.part.forces.map(one => one.name)")
        page.tab.click("#tab-files")
        with page.tab.expect_download() as waiting:
            page.tab.click("#save-file")
        changed = parse(waiting.value.path().read_text("utf-8"))
        assert page.errors == []
    assert changed.gravity == (0.7, -1.62)
    assert mech.gravity != changed.gravity
    (driver,) = mech.drivers
    value, speed, _ = driver.inputs()
    rate = float(driver.law.at(1.0)) - float(driver.law.at(0.0))
    run = kinfmu.solve(changed, **{value: [2.0], speed: [rate]})
    for name, force in zip(names, forces, strict=True):
        assert run[name][0] == pytest.approx(force, rel=1e-9, abs=1e-9)


@pytest.mark.long
def test_change_points_are_found_again_with_new_lengths(chromium: Browser) -> None:
    with chromium.open(text_of("fourbar")) as page:  # its third bar moves along the coupler and stays parallel
        page.get("k.design.set({'bodies.coupler.points.A.x': 0.8, 'bodies.ground.points.B.x': 1.8}) && k.reshape()")
        assert page.get("k.linkage.isChanged && k.design.isOk")
        assert [one["at"] for one in page.get("k.linkage.changePoints")] == pytest.approx([0.0, math.pi], abs=1e-6)
        page.settle()
        assert page.errors == []


@pytest.mark.long
def test_text_has_the_contrast_of_wcag_aa_and_controls_have_names_and_marks(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        page.get("document.querySelectorAll('details').forEach(one => { one.open = true; })")
        for _ in range(2):
            for tab in ("values", "plots", "show", "files"):
                page.tab.click(f"#tab-{tab}")
                page.settle()
                page.tab.wait_for_timeout(150)  # colours of buttons fade
                found = page.tab.evaluate(CONTRASTS)
                assert len(found) > 20
                assert [one for one in found if one["ratio"] < one["least"]] == []
                controls = page.tab.evaluate(LABELS)
                assert controls["count"] > 20
                assert controls["found"] == []
            page.tab.click("#theme")


def test_forces_in_joints_are_drawn_to_one_scale_and_only_computed_when_shown(chromium: Browser) -> None:
    mech = kinfmu.load("engine")
    angle = 0.7
    run = kinfmu.solve(mech, crank_angle=[angle], crank_speed=[100.0 * math.pi])
    with chromium.open(text_of("engine")) as page:
        page.get("k.linkage.shown.reactions = () => { throw new Error('not shown'); }")
        page.move(angle)
        page.get("delete k.linkage.shown.reactions")
        page.tab.click("#tab-show")
        page.tab.click("#show-forces")
        page.tab.click("#show-shaking")
        page.settle()
        drawn, legend = page.get("k.extra().arrows"), page.get("k.extra().legend")
        assert page.errors == []
    assert [one["text"].split(" N ")[1] for one in legend] == ["in joints", "shaking force"]
    scale = legend[0]["length"] / float(legend[0]["text"].split(" ")[0])  # [pixel/N]
    at_pin = drawn[1]["along"]
    assert at_pin == pytest.approx([scale * run["P.force_x"][0], scale * run["P.force_y"][0]], rel=1e-6)


@pytest.mark.long
def test_every_dyad_has_its_transmission_angle_in_the_drawing_and_the_plots(chromium: Browser) -> None:
    angles = {}
    for loop in (*(report := kinfmu.check(kinfmu.load("watt_six_bar"))).loops, *report.dyads):
        (angle,) = loop.transmission
        angles[f"transmission angle {angle.coupler}-{angle.output}"] = angle
    assert len(angles) == 2
    with chromium.open(text_of("watt_six_bar")) as page:
        offered = page.tab.locator("#plots select option").all_text_contents()
        assert {f"{name} [deg]" for name in angles} <= {*offered}
        page.tab.click("#tab-files")
        for angle in angles.values():
            page.move(angle.at_smallest)
            with page.tab.expect_download() as waiting:
                page.tab.click("#save-svg")
            shown = f"{round(math.degrees(angle.smallest), 1):g}\N{DEGREE SIGN}"
            assert f">{shown}</text>" in waiting.value.path().read_text("utf-8")
        assert page.errors == []


@pytest.mark.parametrize(
    ("more", "shown"),
    [
        ('[points]\nbase = "ground.O"\nram = "piston.S"', ["ram.x"]),
        ('[points]\nbase = "ground.O"', ["piston.x"]),
        (
            '[points]\nram = "piston.S"\n[loads.cut]\ntype = "force"\nat = "piston.S"\nx = -5000',
            ["crank.torque", "ram.x"],
        ),
    ],
)
@pytest.mark.long
def test_the_first_plots_are_of_coordinates_that_move(chromium: Browser, more: str, shown: list[str]) -> None:
    mech = parse(toml_text(kinfmu.load("slider_crank")) + more)
    with chromium.open(kinfmu.page.page(mech)) as page:
        page.tab.click("#tab-plots")
        page.settle()
        chosen = page.tab.locator("#plots .plot select")
        assert [chosen.nth(k).input_value() for k in range(chosen.count())] == shown
        for k in range(chosen.count()):
            value = page.get(f"[...k.plots.table.columns[{k}]]")
            assert max(value) - min(value) > 10.0
        assert page.errors == []


@pytest.mark.parametrize("name", ["triple_rocker", "peaucellier", "stephenson_six_bar", "crank_rocker"])
@pytest.mark.long
def test_plots_over_a_driver_clip_poles_as_export_does(chromium: Browser, name: str) -> None:
    mech = kinfmu.load(name)
    body = mech.moving_bodies[1].name
    text = toml_text(mech).replace(f"[bodies.{body}]\n", f'[bodies.{body}]\nmass = "1 kg"\n')
    is_flat_without = []
    with chromium.open(kinfmu.page.page(parse(text))) as page:
        page.tab.click("#tab-plots")
        page.settle()
        offered = [one for one in page.get("k.plots.all.map(one => one.id)") if "omega" in one or "torque" in one]
        for quantity in offered[:6]:
            page.tab.locator("#plots .plot select").first.select_option(quantity)
            page.settle()
            ticks = page.tab.evaluate(
                """() => {
                    const write = CanvasRenderingContext2D.prototype.fillText;
                    const ticks = [];
                    CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
                        if (this.textAlign === "right" && /^-?[0-9.e+-]+$/.test(text)) ticks.push(Number(text));
                    };
                    window.kinfmu.plots.plots[0].painter.draw(window.kinfmu.plots.plots[0].painter.last);
                    CanvasRenderingContext2D.prototype.fillText = write;
                    return ticks;
                }"""
            )
            values = np.array(page.get("[...k.plots.table.columns[0]].map(one => one ?? NaN)"), dtype=float)
            known = values[np.isfinite(values)]
            if np.ptp(known) < 1e-9:
                continue  # the speed of the driver itself
            low, high = shown_range(known, 0.0) or (known.min(), known.max())
            edge = 0.061 * (high - low) + 1e-6  # space around the curve
            assert len(ticks) >= 2
            assert [tick for tick in ticks if not low - edge <= tick <= high + edge] == [], (quantity, low, high)
            assert max(ticks) - min(ticks) >= 0.2 * (high - low)
            is_flat_without.append(np.ptp(known) > 3.0 * (high - low))
        assert page.errors == []
    assert any(is_flat_without) == (name != "crank_rocker")


def test_click_in_a_plot_moves_the_crank(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        page.tab.click("#tab-plots")
        page.settle()
        box = page.tab.locator(".plot canvas").first.bounding_box()
        left, right = 58, 10  # margins of a plot
        page.tab.mouse.click(box["x"] + left + 0.25 * (box["width"] - left - right), box["y"] + 60)
        page.settle()
        assert page.get("k.linkage.u[0]") == pytest.approx(math.pi / 2, abs=0.05)
        assert page.errors == []


def test_the_keys_of_the_page_work_after_a_click_on_a_tab(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        keyboard = page.tab.keyboard
        page.tab.click("#tab-files")
        keyboard.press("ArrowRight")
        page.settle()
        assert page.get("k.linkage.u[0]") == pytest.approx(math.radians(1))
        keyboard.press("Space")
        page.tab.wait_for_function("window.kinfmu.isPlaying")
        keyboard.press("?")
        assert page.tab.locator("#keys").is_visible()
        keyboard.press("Escape")
        page.tab.focus("#tab-files")  # by keyboard alone, the arrows choose tabs
        keyboard.press("ArrowLeft")
        assert page.tab.locator("#tab-files").get_attribute("aria-selected") == "false"
        assert page.errors == []


@pytest.mark.parametrize("button", ["#fit", "#theme", "#tab-show", "#edit", "#play"])
@pytest.mark.few(2)
def test_space_plays_after_a_click_on_a_button(chromium: Browser, button: str) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        page.tab.click(button)
        before = page.get("k.isPlaying")
        page.tab.keyboard.press("Space")
        page.settle() if before else page.tab.wait_for_function("window.kinfmu.isPlaying")
        assert page.get("k.isPlaying") != before
        page.tab.focus("#play")  # by keyboard alone, space presses the button that has the focus
        page.tab.keyboard.press("Space")
        assert page.get("k.isPlaying") == before
        page.tab.focus("#time")
        page.tab.keyboard.press("Space")
        assert page.get("k.isPlaying") != before
        assert page.errors == []


def test_a_play_that_has_stopped_begins_again(chromium: Browser) -> None:
    text = toml_text(kinfmu.load("triple_rocker"))
    mech = parse(re.sub(r"(?ms)^law = .*?(?=^\[)", 'law = "constant_speed"\nstart = 1.0\nspeed = 1.0\n\n', text))
    with chromium.open(kinfmu.page.page(mech)) as page:
        page.tab.click("#play")
        page.tab.wait_for_function("window.kinfmu.blocked && !window.kinfmu.isPlaying")
        stopped = page.get("k.linkage.t")
        assert stopped > 0.4
        page.tab.wait_for_selector("#banner")
        page.tab.click("#play")
        page.tab.wait_for_function(
            f"window.kinfmu.isPlaying && window.kinfmu.linkage.t < {stopped / 2!r} && banner.hidden"
        )
        assert page.errors == []


def test_a_page_moves_once_when_it_opens_unless_less_motion_is_wanted(chromium: Browser, tmp_path: Path) -> None:
    text = text_of("crank_rocker")
    with chromium.open(text) as page:
        assert not page.get("k.isPlaying")
    with chromium.open(text, "#@crank=1", reduced_motion="no-preference") as page:
        assert not page.get("k.isPlaying")
    path = tmp_path / "page.html"
    path.write_text(text, "utf-8")
    with chromium.tab(reduced_motion="no-preference") as page:
        page.tab.goto(path.as_uri())
        page.tab.wait_for_function("window.kinfmu?.isPlaying && window.kinfmu.linkage.t > 0")
        page.get("k.motion.oncePace = 10")
        page.tab.wait_for_function("!window.kinfmu.isPlaying")
        assert page.get("[k.linkage.u[0], k.linkage.t, location.hash]") == [0, 0, ""]
        page.get("k.motion.showOnce()")
        page.tab.click("#play")
        assert not page.get("k.isPlaying")
        page.get("k.motion.showOnce()")
        page.tab.mouse.click(300, 300)
        assert not page.get("k.isPlaying")
        page.get("k.motion.showOnce()")
        page.tab.keyboard.press("Space")
        assert not page.get("k.isPlaying")
        assert page.errors == []


@pytest.mark.parametrize("size", [PHONE, {"width": 390, "height": 844}, {"width": 700, "height": 480}])
@pytest.mark.parametrize("name", ["jansen_leg", "excavator"])
@pytest.mark.few(1)
def test_on_a_small_page_the_drawing_has_most_of_the_height(chromium: Browser, size: dict[str, int], name: str) -> None:
    with chromium.open(text_of(name)) as page:
        page.resize(size)
        assert page.get("k.view.height") >= 0.7 * size["height"]
        controls = ["#play", "#sheet", "#drivers input[type=range]" if name == "jansen_leg" else "#time"]
        controls.append("#drivers input[type=number]" if name == "jansen_leg" else "#clock")
        boxes = [page.tab.locator(one).bounding_box() for one in controls]
        middles = [box["y"] + box["height"] / 2 for box in boxes if box]
        assert len(middles) == len(controls)
        assert max(middles) - min(middles) < 6.0  # one line
        assert page.tab.evaluate("document.documentElement.scrollHeight") <= size["height"]
        assert page.tab.is_hidden("#values")
        page.tab.click("#sheet")
        assert page.tab.is_visible("#values")
        assert page.tab.is_visible("#speed")
        page.tab.click("#tab-plots")
        page.settle()
        assert page.tab.is_visible(".plot canvas >> nth=0")
        page.tab.click("#sheet")
        page.settle()
        assert page.get("k.view.height") >= 0.7 * size["height"]
        assert page.errors == []


def test_values_are_lengths_of_links_with_their_colours_and_locks_belong_to_changing_lengths(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        rows = page.tab.locator("#values > .value")
        assert rows.locator(".text").all_inner_texts() == [
            "ground",
            "crank",
            "coupler\nP\u2013Q",
            "coupler\nP\u2013tracer",
            "rocker",
        ]
        assert rows.locator(".swatch").count() == 5
        assert page.tab.locator(".lock:visible").count() == 0
        page.tab.click("#edit")
        assert page.tab.locator(".lock:visible").count() == 5
        page.tab.click("[aria-label='Lock rocker length']")
        assert page.get("[...k.design.locked]") == [
            f"bodies.rocker.points.{one}" for one in ("Q.x", "Q.y", "C.x", "C.y")
        ]
        field = page.tab.get_by_label("coupler P\u2013tracer mm", exact=True)
        field.fill("120")
        field.press("Enter")
        page.settle()
        assert page.get("Object.fromEntries(k.design.changes())") == {"bodies.coupler.points.tracer.x": 120}
        assert page.get("k.design.past.length") == 1
        page.tab.click("#undo")
        page.settle()
        assert field.input_value() == "100"
        assert page.errors == []


def test_the_ring_of_a_driver_is_on_its_pin(chromium: Browser) -> None:
    with chromium.open(text_of("jansen_leg")) as page:
        page.move(0.7)
        ((x, y),) = page.get("k.handles.map((one) => one.at)")
        box = page.tab.locator("#drawing").bounding_box()
        assert (x + box["x"], y + box["y"]) == pytest.approx(page.at("crank.X"), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "label", "value", "button"),
    [("jansen_leg", "m mm", "45", "closes up to 22 mm"), ("slider_crank", "rod length mm", "20", "closes from 40 mm")],
)
@pytest.mark.few(1)
def test_what_does_not_close_is_drawn_with_its_gap_and_a_way_back(
    chromium: Browser, name: str, label: str, value: str, button: str
) -> None:
    with chromium.open(text_of(name)) as page:
        page.move(1.0)
        pose = page.get("Array.from(k.linkage.pose.q)")
        field = page.tab.get_by_label(label, exact=True)
        field.fill(value)
        field.press("Enter")
        back = page.tab.locator("#banner button")
        back.wait_for()
        assert back.inner_text() == button
        gaps = page.get("k.open.gaps")
        assert gaps
        size = page.get("k.linkage.data.size")
        assert all(math.dist(*gap) > 0.01 * size for gap in gaps)
        page.tab.click("#tab-files")
        with page.tab.expect_download() as waiting:
            page.tab.click("#save-svg")
        assert waiting.value.path().read_text("utf-8").count('stroke-dasharray="7 5"') == len(gaps)
        page.tab.click("#tab-values")
        assert page.get("Array.from(k.linkage.pose.q)") == pose
        page.tab.click("#play")
        page.tab.click("#play")
        page.tab.wait_for_timeout(300)
        button = back.inner_text()  # of this pose
        back.click()
        page.settle()
        assert page.tab.is_hidden("#banner")
        assert page.get("k.design.isOk && k.open === null")
        assert field.input_value() == button.split(" ")[-2]
        page.tab.click("#undo")
        page.settle()
        assert field.input_value() == value
        assert page.errors == []


def test_plots_have_what_joints_do(chromium: Browser) -> None:
    mech = kinfmu.load("slider_crank")
    angles = np.radians(np.linspace(0.0, 360.0, 361))
    speed = float(mech.drivers[0].law.at(1.0) - mech.drivers[0].law.at(0.0))
    run = kinfmu.solve(mech, crank_angle=angles, crank_speed=np.full(361, speed))
    with chromium.open(text_of("slider_crank")) as page:
        page.tab.click("#tab-plots")
        select = page.tab.locator("#plots .plot select").first
        groups = select.locator("optgroup").evaluate_all("all => all.map((one) => one.label)")
        assert groups.index("joint P") < groups.index("frame of rod")
        found = {}
        for name in (
            "joint P.x",
            "joint P.speed",
            "joint P.acceleration",
            "joint P.angle",
            "joint bore.travel",
            "joint bore.speed",
        ):
            select.select_option(name)
            page.settle()
            found[name] = np.array(page.get("[...k.plots.table.columns[0]]"))
        assert page.errors == []
    radius = 45.0
    assert found["joint P.x"] == pytest.approx(radius * np.cos(angles), abs=1e-9)
    assert found["joint P.speed"] == pytest.approx(np.full(361, radius * speed))
    assert found["joint P.acceleration"] == pytest.approx(np.full(361, radius * speed**2))
    assert found["joint P.angle"] == pytest.approx(np.degrees(run["rod.phi"] - angles), abs=1e-9)
    assert found["joint bore.travel"] == pytest.approx(run["piston.x"], abs=1e-9)
    assert found["joint bore.speed"] == pytest.approx(run["piston.vx"], abs=1e-6)


def test_keyboard_alone_moves_plays_and_changes_values(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        keyboard = page.tab.keyboard
        page.tab.focus("#drawing")
        keyboard.press("ArrowRight")
        page.settle()
        keyboard.press("Shift+ArrowRight")
        page.settle()
        assert page.get("k.linkage.u[0]") == pytest.approx(math.radians(11))
        keyboard.press("Space")
        page.tab.wait_for_function("window.kinfmu.isPlaying")
        keyboard.press("Space")
        assert not page.get("k.isPlaying")
        field = page.tab.get_by_label("crank length mm", exact=True)
        field.focus()
        keyboard.press("Control+A")
        keyboard.type("18")
        keyboard.press("Enter")
        page.settle()
        assert page.get("k.design.values.get('bodies.crank.points.P.x')") == 18
        page.tab.focus("#drawing")
        keyboard.press("Control+Z")
        page.settle()
        assert page.get("k.design.values.get('bodies.crank.points.P.x')") == 20
        assert page.errors == []


@pytest.mark.parametrize("name", ["crank_rocker", "jansen_leg", "slider_crank"])
@pytest.mark.few(1)
def test_a_pin_is_chosen_and_moved_by_keys(chromium: Browser, name: str) -> None:
    with chromium.open(text_of(name)) as page:
        keyboard, ring = page.tab.keyboard, "k.linkage.pose && k.hand.place"
        page.tab.focus("#drawing")
        start = page.get("k.linkage.u[0]")
        seen = set()
        for _ in range(20):
            keyboard.press("p")
            page.settle()
            hint = page.tab.inner_text("#hint")
            body, _, point = hint.split(" at ")[0].partition(".")
            at = page.get(
                "k.linkage.point(k.linkage.data.points.findIndex("
                f"one => one.body === '{body}' && one.name === '{point}'))"
            )
            assert page.get(ring) == pytest.approx(at)
            seen.add((body, point))
        assert 2 <= len(seen) < 20
        keyboard.press("Shift+p")
        keyboard.press("p")
        page.settle()
        step = 10.0 ** math.floor(math.log10(page.get("k.linkage.data.size")) - 2)
        tried = moved = 0
        for key, way in (
            ("ArrowRight", (1, 0)),
            ("ArrowUp", (0, 1)),
            ("Shift+ArrowLeft", (-10, 0)),
            ("ArrowDown", (0, -1)),
        ):
            before = page.get(ring)
            keyboard.press(key)
            page.settle()
            tried += 1
            moved += page.get(ring) == pytest.approx([before[k] + way[k] * step for k in (0, 1)], abs=0.35 * step)
        assert moved >= 2, tried
        assert page.get("k.linkage.u[0]") == start  # the driver rests
        assert page.get("k.design.changes().length") > 0
        keyboard.press("Control+z")
        keyboard.press("Escape")
        page.settle()
        assert page.get("k.hand.place") is None
        keyboard.press("ArrowRight")
        page.settle()
        assert page.get("k.linkage.u[0]") != start
        assert page.errors == []


def test_nothing_is_spoken_at_frame_rate_and_the_drawing_states_its_pose(chromium: Browser) -> None:
    live = "[aria-live]:not([aria-live=off]), [role=status], [role=alert], [role=log], [role=timer], output"
    with chromium.open(text_of("crank_rocker")) as page:
        page.tab.click("#tab-plots")
        page.move(math.radians(45.0))
        label = page.tab.locator("#drawing").get_attribute("aria-label")
        assert "crank = 45 deg" in str(label)
        assert page.tab.inner_text("#clock") in str(label)
        page.tab.evaluate(
            """live => {
                window.spoken = [];
                new MutationObserver((changes) => changes.forEach(({ target }) => {
                    const one = target.nodeType === 1 ? target : target.parentElement;
                    if (one.closest(live) || one.matches("canvas")) window.spoken.push(one.id || one.outerHTML);
                })).observe(document.body, { subtree: true, childList: true, characterData: true, attributes: true });
            }""",
            live,
        )
        clock = page.tab.inner_text("#clock")
        page.tab.click("#play")
        page.tab.wait_for_timeout(400)
        page.tab.click("#play")
        assert page.tab.inner_text("#clock") != clock
        spoken = page.tab.evaluate("window.spoken")
        assert len(spoken) <= 4, spoken  # when it stops
        assert str(page.tab.locator("#drawing").get_attribute("aria-label")) != label
        assert page.errors == []


@pytest.mark.parametrize(
    "name", ["crank_rocker", "triple_rocker", "cam_roller", "slider_crank", "toggle_press", "five_bar"]
)
@pytest.mark.parametrize("size", [PHONE, DESKTOP], ids=["phone", "desktop"])
@pytest.mark.few(1)
def test_fit_shows_the_circles_of_the_drivers(chromium: Browser, name: str, size: dict[str, int]) -> None:
    with chromium.open(text_of(name)) as page:
        page.resize(size)
        page.get("k.fit()")
        page.settle()
        page.tab.evaluate(
            """() => {
                const { context: c, canvas } = window.kinfmu;
                const [line, dash] = [c.lineTo.bind(c), c.setLineDash.bind(c)];
                let [points, kept] = [[], []];
                const [begin, move] = [c.beginPath.bind(c), c.moveTo.bind(c)];
                c.beginPath = () => { points = []; begin(); };
                c.moveTo = (x, y) => { points.push([x, y]); move(x, y); };
                c.lineTo = (x, y) => { points.push([x, y]); line(x, y); };
                c.setLineDash = (of) => { if (String(of) === "2,4") kept.push(...points); dash(of); };
                window.kinfmu.paint();
                window.dial = kept;
            }"""
        )
        dial = np.array(page.get("window.dial"))
        width, height = page.get("[k.view.width, k.view.height]")
        assert len(dial) >= 73
        assert dial.min() >= 8.0  # the handle has a radius of 8 px
        assert dial[:, 0].max() <= width - 8.0
        assert dial[:, 1].max() <= height - 8.0


@pytest.mark.long
def test_notes_and_long_rows_leave_scale_and_check_boxes_alone(chromium: Browser) -> None:
    with chromium.open(text_of("geared_five_bar")) as page:
        page.get("k.design.set({'joints.mesh.offset': 0.1}) && k.reshape()")
        for size in (PHONE, DESKTOP):
            page.resize(size)
            if size == PHONE:
                page.tab.click("#sheet")
            page.tab.click("#tab-show")
            assert page.tab.locator("#note").is_visible()
            left = page.tab.locator("#note").bounding_box()["x"]  # type: ignore[index]
            scale = page.tab.evaluate(
                """() => {
                    const { context: c } = window.kinfmu;
                    const write = c.fillText.bind(c);
                    const ends = [];
                    c.fillText = (text, x, y) => {
                        if (x === 4) ends.push(x + c.measureText(text).width);
                        write(text, x, y);
                    };
                    window.kinfmu.paint();
                    delete c.fillText;
                    return ends;
                }"""
            )
            assert scale
            assert left >= max(scale)
            boxes = page.tab.locator(".check input")
            sizes = {
                (box["width"], box["height"])
                for box in (boxes.nth(k).bounding_box() for k in range(boxes.count()))
                if box
            }
            assert sizes == {(18, 18)}
        assert page.errors == []


@pytest.mark.long
def test_a_length_that_closes_on_another_branch_only_names_no_gap(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        assert (
            page.get("k.inWords('rows C.x, C.y close on another branch only')")
            == "joint C closes on another branch only"
        )
        page.get("k.design.set({ 'bodies.crank.points.P.x': 20.5 }) && k.reshape()")  # now by the engine of all numbers
        page.get("k.linkage.shown.bind = () => ({ ok: false, result: 'refused', message: '' })")
        page.get("k.linkage.shown.gap = () => ({ hasGap: false, text: 'rows C.x, C.y close on another branch only' })")
        page.get("k.refresh(() => { k.design.set({ 'bodies.crank.points.P.x': 21 }); })")
        page.settle()
        banner = page.tab.inner_text("#banner")
        assert banner.startswith("Another branch: ")
        assert "joint C closes on another branch only. The last good" in banner


@pytest.mark.long
def test_a_pose_that_is_too_far_is_refused_by_that_reason_alone(chromium: Browser) -> None:
    with chromium.open(text_of("crank_rocker")) as page:
        assert page.get("k.linkage.goTo([1.2e6])") is False
        text = page.get("k.linkage.failure")
        assert text.startswith("crank = ")
        assert text.endswith("steps on one path")
