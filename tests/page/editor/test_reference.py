"""Mechanisms that are drawn move as those that are written by hand, and become FMUs."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu

import kinfmu
from kinfmu.analysis import check
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.gallery.load import folder
from kinfmu.mechanism.toml_file import parse
from kinfmu.page.editor import Drawing
from tests.page.editor.drawn import FOURBAR, bar, drawn, interest, put, target

SAME = 1e-9  # of the largest value
Drawn = tuple[Drawing, Mechanism, list[str]]  # by operations, by hand, and the columns that are equal


def gallery(name: str) -> Drawing:
    """Return a mechanism of the gallery, in its assembled start pose."""
    return Drawing.read(folder() / name / "mechanism.toml")


def motor(mechanism: Mechanism, name: str = "motor") -> tuple[dict[str, object], ...]:
    """Return operations that give a motor the speed of the only driver of a mechanism, and the file its run."""
    run, (driver,) = mechanism.run, mechanism.drivers
    return (
        put("drivers", name, "speed", value=float(driver.law.speed)),
        put("run", value={"start": float(run.start), "stop": float(run.stop), "step": float(run.step)}),
    )


def fourbar() -> Drawn:
    coupler, rocker = math.hypot(120, 40), math.hypot(20, 80)
    reference = parse(
        f"""
        name = "by_hand"
        units.length = "mm"
        run = {{ stop = 2 }}
        points = {{ P = "crank.P", Q = "rocker.Q" }}
        [bodies]
        ground.points = {{ O = [0, 0], C = [100, 0] }}
        crank = {{ points = {{ O = [0, 0], P = [40, 0] }}, start = {{ phi = "90 deg" }} }}
        coupler = {{ points = {{ P = [0, 0], Q = [{coupler!r}, 0] }}, start = {{ phi = "18 deg" }} }}
        rocker = {{ points = {{ C = [0, 0], Q = [{rocker!r}, 0] }}, start = {{ phi = "76 deg" }} }}
        [joints]
        O = {{ type = "revolute", between = ["ground.O", "crank.O"] }}
        P = {{ type = "revolute", between = ["crank.P", "coupler.P"] }}
        Q = {{ type = "revolute", between = ["coupler.Q", "rocker.Q"] }}
        C = {{ type = "revolute", between = ["ground.C", "rocker.C"] }}
        [drivers.motor]
        type = "angle"
        of = "crank"
        law = "constant_speed"
        start = "90 deg"
        speed = "30 rpm"
        """
    )
    drawing = drawn(*FOURBAR, interest("crank.C", "P"), interest("rocker.D", "Q"))
    return drawing, reference, ["P.x", "P.y", "Q.x", "Q.y", "Q.vx", "Q.ay"]


def slider_crank() -> Drawn:
    reference = parse(
        f"""
        name = "by_hand"
        units.length = "mm"
        run = {{ stop = 2 }}
        points.Q = "piston.Q"
        [bodies]
        ground.points = {{ O = [0, 0], S = [0, 10] }}
        crank = {{ points = {{ O = [0, 0], P = [30, 0] }} }}
        rod = {{ points = {{ P = [0, 0], Q = [{math.hypot(90, 10)!r}, 0] }}, start = {{ x = 30 }} }}
        piston = {{ points = {{ Q = [0, 0] }}, start = {{ x = 120, y = 10 }} }}
        [joints]
        O = {{ type = "revolute", between = ["ground.O", "crank.O"] }}
        P = {{ type = "revolute", between = ["crank.P", "rod.P"] }}
        Q = {{ type = "revolute", between = ["rod.Q", "piston.Q"] }}
        S = {{ type = "translational", between = ["ground.S", "piston.Q"] }}
        [drivers.motor]
        type = "angle"
        of = "crank"
        law = "constant_speed"
        speed = "30 rpm"
        """
    )
    drawing = drawn(
        bar(("ground", 0, 0), (30, 0), "crank"),
        bar("crank.B", (120, 10), "rod"),
        bar("rod.C", (140, 10), "piston"),
        {"do": "slider", "point": "piston.C", "along": [1, 0], "block": True},
        {"do": "motor", "body": "crank"},
        interest("piston.C", "Q"),
    )
    return drawing, reference, ["Q.x", "Q.y", "Q.vx", "Q.ax"]


def inverted_slider_crank() -> Drawn:
    hand = gallery("inverted_slider_crank")
    reference = parse(
        hand.text.replace("[joints]", '[points]\nP = "crank.P"\nend = "lever.tip"\nR = "ram.R"\n\n[joints]')
    )
    pin, tip, end = hand.at("crank.P"), hand.at("lever.tip"), hand.at("ram.R")
    drawing = drawn(
        bar(("ground", 0, 300), pin, "crank"),
        bar(("ground", 0, 0), tip, "lever"),
        {"do": "slot", "point": "crank.B", "body": "lever", "from": [0, 0], "to": list(tip)},
        bar("lever.D", end, "link"),
        {"do": "slider", "point": "link.E", "along": [2, 0]},
        {"do": "motor", "body": "crank"},
        *motor(reference),
        interest("crank.B", "P"),
        interest("lever.D", "end"),
        interest("link.E", "R"),
    )
    return drawing, reference, ["P.x", "P.y", "end.x", "end.y", "R.x", "R.vx", "R.ax"]


def watt_six_bar() -> Drawn:
    hand = gallery("watt_six_bar")
    drawing = drawn(
        bar(("ground", 0, 0), hand.at("crank.P"), "crank"),
        bar("crank.B", hand.at("coupler.Q"), "coupler"),
        bar("coupler.C", ("ground", 80, 0), "rocker"),
        bar(("coupler", *hand.at("coupler.R")), hand.at("left.T"), "left"),
        bar("left.F", ("rocker", *hand.at("rocker.S")), "right"),
        {"do": "motor", "body": "crank"},
        *motor(hand.mechanism),
        interest("left.F", "T"),
    )
    return drawing, hand.mechanism, ["T.x", "T.y", "T.vx", "T.ay"]


def excavator() -> Drawn:
    hand = gallery("excavator")

    def at(point: str) -> list[float]:
        return list(hand.at(point))

    def cylinder(first: object, last: object, name: str, **numbers: float) -> tuple[dict[str, object], ...]:
        stroke = {"do": "cylinder", "from": target(first), "to": target(last), "stroke": numbers.pop("stroke")}
        law = (put("drivers", "cylinder_1", key, value=value) for key, value in numbers.items())
        return stroke, *law, {"do": "rename", "place": ["drivers", "cylinder_1"], "name": name}

    drawing = drawn(
        {"do": "units", "length": "m"},
        bar(("ground", 0, 0), at("boom.P"), "boom"),
        bar("boom.B", at("stick.Q"), "stick"),
        bar(("stick", *at("stick.I")), at("idler.N"), "idler"),
        bar("stick.C", at("bucket.M"), "bucket"),
        bar("idler.E", "bucket.F", "link"),
        {"do": "point", "body": "bucket", "at": at("bucket.tip")},
        *cylinder(
            at("ground.boom_foot"), ("boom", *at("boom.boom_eye")), "boom_cylinder", stroke=0.4, begin=1, duration=4
        ),
        *cylinder(
            ("boom", *at("boom.stick_foot")),
            ("stick", *at("stick.stick_eye")),
            "stick_cylinder",
            stroke=0.45,
            duration=4,
        ),
        *cylinder(("stick", *at("stick.bucket_foot")), "idler.E", "bucket_cylinder", stroke=0.5, begin=0.5, duration=4),
        put("run", value={"start": 0, "stop": 5, "step": 0.0125}),
        interest("bucket.G", "tip"),
    )
    return drawing, hand.mechanism, ["tip.x", "tip.y", "tip.vx", "tip.ay"]


def cam_with_roller() -> Drawn:
    hand = gallery("cam_roller")
    roller = hand.at("lever.roller")
    drawing = drawn(
        bar(("ground", 0, 0), (20, 0), "cam"),
        bar(("ground", 90, 0), roller, "lever"),
        {"do": "cam", "body": "cam", "follower": "lever.D", "kind": "roller", "rise": 20},
        {"do": "motor", "body": "cam"},
        put("joints", "cam_1", "start", value=40),
        put("joints", "cam_1", "begin", value=0),
        put("joints", "cam_1", "roller_radius", value=12),
        *motor(hand.mechanism),
        interest("lever.D", "roller"),
    )
    return drawing, hand.mechanism, ["roller.x", "roller.y", "roller.vx", "roller.ay"]


def geared_five_bar() -> Drawn:
    hand = gallery("geared_five_bar")
    drawing = drawn(
        bar(("ground", 0, 0), hand.at("gear.P"), "gear"),
        bar(("ground", 60, 0), hand.at("pinion.Q"), "pinion"),
        {"do": "gear", "bodies": ["gear", "pinion"], "ratio": -2},
        bar("gear.B", hand.at("left.T"), "left"),
        bar("pinion.D", "left.E", "right"),
        {"do": "motor", "body": "gear"},
        *motor(hand.mechanism),
        interest("left.E", "T"),
    )
    return drawing, hand.mechanism, ["T.x", "T.y", "T.vx", "T.ay"]


def toggle_clamp() -> Drawn:
    drawing = drawn(
        bar(("ground", 0, 0), (30, 40), "handle"),
        bar("handle.B", (80, 30), "link"),
        bar("link.C", ("ground", 90, 10), "arm"),
        {"do": "point", "body": "arm", "at": [130, 5]},
        {"do": "spring", "from": {"at": [90, 70]}, "to": {"point": "arm.E"}, "stiffness": "2 N/mm"},
        {"do": "force", "at": {"point": "arm.E"}, "vector": [-3, 40]},
        {"do": "motor", "body": "handle"},
        put("drivers", "motor", "speed", value="-4 rpm"),
        interest("arm.E", "jaw"),
    )
    return drawing, _clamp(), ["jaw.x", "jaw.y", "motor.torque", "spring_1.force"]


def _clamp() -> Mechanism:
    """Return the clamp with frames along its links."""
    arm, jaw, free = math.atan2(20, -10), math.atan2(-5, 40), math.hypot(40, 65)
    tip = math.hypot(40, 5)
    return parse(
        f"""
        name = "by_hand"
        units.length = "mm"
        run = {{ stop = 2 }}
        points.jaw = "arm.jaw"
        [bodies]
        ground.points = {{ O = [0, 0], C = [90, 10], S = [90, 70] }}
        handle = {{ points = {{ O = [0, 0], P = [50, 0] }}, start = {{ phi = {math.atan2(40, 30)!r} }} }}
        link = {{ points = {{ P = [0, 0], Q = [{math.hypot(50, 10)!r}, 0] }}, start = {{ phi = -0.2 }} }}
        [bodies.arm]
        start = {{ phi = {arm!r} }}
        [bodies.arm.points]
        C = [0, 0]
        Q = [{math.hypot(10, 20)!r}, 0]
        jaw = [{tip * math.cos(jaw - arm)!r}, {tip * math.sin(jaw - arm)!r}]
        [joints]
        O = {{ type = "revolute", between = ["ground.O", "handle.O"] }}
        P = {{ type = "revolute", between = ["handle.P", "link.P"] }}
        Q = {{ type = "revolute", between = ["link.Q", "arm.Q"] }}
        C = {{ type = "revolute", between = ["ground.C", "arm.C"] }}
        [loads]
        work = {{ type = "force", at = "arm.jaw", x = -3, y = 40 }}
        [loads.spring_1]
        type = "spring"
        between = ["ground.S", "arm.jaw"]
        stiffness = "2 N/mm"
        free_length = {free!r}
        [drivers.motor]
        type = "angle"
        of = "handle"
        law = "constant_speed"
        start = {math.atan2(40, 30)!r}
        speed = "-4 rpm"
        """
    )


MAKERS: tuple[Callable[[], Drawn], ...] = (
    fourbar,
    slider_crank,
    inverted_slider_crank,
    watt_six_bar,
    excavator,
    cam_with_roller,
    geared_five_bar,
    toggle_clamp,
)


@pytest.mark.parametrize("make", MAKERS, ids=lambda make: make.__name__)
def test_what_is_drawn_moves_as_what_is_written_by_hand(make: Callable[[], Drawn], tmp_path: Path) -> None:
    drawing, reference, columns = make()
    path = tmp_path / "drawn.toml"
    path.write_text(drawing.text)
    mechanism = kinfmu.load(path)
    report = check(mechanism)
    assert report.problem is None
    times = np.linspace(0.0, float(mechanism.run.stop), 41)
    ours, theirs = kinfmu.solve(mechanism, times), kinfmu.solve(reference, times)
    assert ours.good.all()
    for column in columns:
        expected = theirs[column]
        np.testing.assert_allclose(ours[column], expected, rtol=0.0, atol=SAME * max(1.0, np.abs(expected).max()))
    assert validate_fmu(str(kinfmu.build(mechanism, tmp_path))) == []
