"""What a designer would see: each fault has its note, and sound mechanisms have none."""

from __future__ import annotations

import math

import pytest

import kinfmu
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse
from tests.gallery_members import every_member
from tests.mechanisms import FOURBAR_DRIVER, FOURBAR_PINS
from tests.reports import unwrapped

FOURBAR = (
    """
name = "fourbar"
[units]
length = "mm"
[run]
stop = "1 s"
[bodies.ground]
points = { O = [0, 0], C = [40, 0] }
[bodies.crank]
points = { O = [0, 0], P = [20, 0] }
[bodies.coupler]
points = { P = [0, 0], Q = [50, 0] }
start = { x = 20, phi = "78 deg" }
[bodies.rocker]
points = { C = [0, 0], Q = [50, 0] }
start = { x = 40, phi = "102 deg" }
"""
    + FOURBAR_PINS
    + FOURBAR_DRIVER
    + """speed = "60 rpm"
"""
)
BACK_AND_FORTH = """
law = "harmonic"
amplitude = "60 deg"
frequency = "1 Hz"
"""


def changed(*changes: tuple[str, str]) -> Mechanism:
    text = FOURBAR
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return parse(text, "fourbar.toml")


def notes(*changes: tuple[str, str]) -> tuple[str, ...]:
    return kinfmu.check(changed(*changes)).notes


def test_a_sound_mechanism_has_no_note() -> None:
    assert notes() == ()


@every_member
@pytest.mark.few(2)
def test_no_gallery_mechanism_has_a_note(name: str) -> None:
    assert kinfmu.check(kinfmu.load(name)).notes == ()


def test_bodies_that_a_swapped_point_made_rigid_are_named() -> None:
    (note,) = [note for note in notes(('"crank.P", "coupler.P"', '"ground.O", "coupler.P"')) if "move" in note]
    assert note.startswith("coupler, rocker do not move with any driver: check the points of their joints, or weld")


def test_a_body_that_is_welded_to_the_ground_may_stand_still() -> None:
    frame = (
        '[bodies.frame]\npoints = { O = [0, 0] }\n[joints]\nF = { type = "fixed", between = ["ground.O", "frame.O"] }'
    )
    assert notes(("[joints]", frame)) == ()


FOLLOWER = """[bodies.stem]
points = { P = [0, 0] }
[bodies.tip]
points = { P = [0, 0] }
[joints.guide]
type = "translational"
between = ["ground.C", "stem.P"]
axis = "90 deg"
[joints.held]
type = "fixed"
between = ["stem.P", "tip.P"]
[joints.lift]
type = "cam_translating"
between = ["ground.C", "stem.P"]
cam = "crank"
axis = "90 deg"
law = "sequence"
repeat = true
segments = [
    { law = "dwell", duration = "180 deg" },
    { law = "cycloidal", duration = "90 deg", rise = 1 },
    { law = "cycloidal", duration = "90 deg", rise = -1 },
]
[drivers.crank]"""


@pytest.mark.parametrize("rise", ["1", "0"])
def test_a_follower_that_its_cam_holds_at_rest_is_no_body_to_be_welded(rise: str) -> None:
    follower = FOLLOWER.replace("rise = 1", f"rise = {rise}").replace("rise = -1", f"rise = -{rise}")
    mechanism = changed(("[drivers.crank]", follower))
    assert not [note for note in kinfmu.check(mechanism).notes if "move" in note]


def test_pivots_in_another_unit_are_named_where_the_mechanism_does_not_close() -> None:
    report = kinfmu.check(
        changed(
            ("C = [40, 0] }", "C = [0.04, 0] }"), ("Q = [50, 0] }\nstart = { x = 40", "Q = [90, 0] }\nstart = { x = 40")
        )
    )
    assert "does not close" in str(report.problem)
    assert report.notes == (
        "[bodies.ground] points.C: 0.04 is 0.04 mm, about a thousandth of the other lengths (20 to 90 mm); "
        "write '0.04 m' if intended",
        "ground.O and ground.C are 0.04 mm apart, the bodies there at least 20 mm long: are their points in another "
        "unit?",
    )
    sound = kinfmu.check(changed(("C = [40, 0] }", "C = [0.04, 0] }")))
    assert sound.problem is None
    assert not [note for note in sound.notes if "another unit" in note]


def test_points_that_nothing_uses_are_named() -> None:
    assert notes(("Q = [50, 0] }\nstart = { x = 20", "Q = [50, 0], R = [9, 9] }\nstart = { x = 20")) == (
        "point coupler.R is used by no joint, driver, load, measure or point of interest",
    )
    two = notes(("P = [20, 0] }", "P = [20, 0], A = [1, 1], B = [2, 2] }"))
    assert two == ("points crank.A, crank.B are used by no joint, driver, load, measure or point of interest",)
    force = '[loads]\npush = { type = "force", at = "crank.A", x = 5 }\n'
    assert notes(("P = [20, 0] }", "P = [20, 0], A = [1, 1] }"), ("[drivers.crank]", f"{force}[drivers.crank]")) == ()
    assert notes(("P = [20, 0] }", 'P = [20, 0], A = [1, 1] }\nmass = 1\nrod = ["O", "A"]')) == ()
    interest = ("[drivers.crank]", '[points]\ntip = "crank.A"\n[drivers.crank]')
    assert notes(("P = [20, 0] }", "P = [20, 0], A = [1, 1] }"), interest) == ()
    distance = '[measures]\nm = { type = "range", of = { measure = "distance", between = ["ground.O", "crank.A"] } }\n'
    assert (
        notes(("P = [20, 0] }", "P = [20, 0], A = [1, 1] }"), ("[drivers.crank]", f"{distance}[drivers.crank]")) == ()
    )


def test_joints_that_hold_the_same_bodies_in_one_place_are_named() -> None:
    twice = 'P2 = { type = "revolute", between = ["coupler.P", "crank.P"] }\nQ = {'
    assert "joints P, P2 connect coupler, crank at the same point: one of them is enough" in [
        note.replace("crank, coupler", "coupler, crank") for note in notes(("Q = {", twice))
    ]


@pytest.mark.parametrize(("length", "names"), [('"50 m"', ["coupler", "rocker"]), ("900", [])])
def test_links_in_another_unit_that_share_a_pin_are_reported(length: str, names: list[str]) -> None:
    pin = f"Q = [{length}, 0] }}"
    found = notes(
        ("P = [0, 0], Q = [50, 0] }", f"P = [0, 0], {pin}"), ("C = [0, 0], Q = [50, 0] }", f"C = [0, 0], {pin}")
    )
    assert [note.split()[0] for note in found if "the median of all is 40 mm" in note] == names


@pytest.mark.parametrize(("length", "is_noted"), [("0.02", True), ("0.019", True), ("0.051", False), ("20", False)])
def test_a_link_in_another_unit_is_reported(length: str, is_noted: bool) -> None:
    found = notes(("P = [20, 0] }", f"P = [{length}, 0] }}"), ("C = [40, 0]", "C = [60, 0]"))
    message = [note for note in found if "are its points in another unit?" in note]
    assert len(message) == is_noted
    if is_noted:
        assert message[0].startswith(f"crank is {length} mm long between its joints, its neighbours at least 50 mm:")


def test_a_step_longer_than_the_run_is_reported() -> None:
    found = notes(('stop = "1 s"', 'stop = "1 s"\nstep = "2 s"'))
    assert found == ("[run] step = 2 s is longer than the run, 0 to 1 s: it has one sample",)


def test_a_step_too_long_for_smooth_curves_is_reported() -> None:
    (found,) = notes(('speed = "60 rpm"', 'speed = "600 rpm"'))
    assert found == "[run] step = 0.01 s takes 10 samples of a cycle of crank: step = 0.0002778 takes 360"
    assert not notes(('stop = "1 s"', 'over = "run"'), ('speed = "60 rpm"', 'speed = "600 rpm"'))


def toggles_of(mechanism: Mechanism) -> list[tuple[str, float]]:
    """The toggle positions of a mechanism, which are information: not among its notes."""
    report = kinfmu.check(mechanism)
    assert not [note for note in report.notes if "toggle" in note]
    for toggle in report.toggles:
        assert f"toggle {toggle.happens} at {toggle.driver} = " in unwrapped(report)
    return [(toggle.happens, toggle.value) for toggle in report.toggles]


# Crank and coupler fall in line, stretched, where the rocker's pin Q is 20 + 50 from O; folded, where it is 50 - 20.
STRETCHED = math.acos((70.0**2 + 40.0**2 - 50.0**2) / (2.0 * 70.0 * 40.0))
FOLDED = math.acos((30.0**2 + 40.0**2 - 50.0**2) / (2.0 * 30.0 * 40.0)) + math.pi


@pytest.mark.parametrize("start", [0.0, 60.0, 360.0, -300.0])
@pytest.mark.parametrize("speed", ["30 rpm", "60 rpm", "150 rpm", "-90 rpm"])
@pytest.mark.few(4)
def test_toggle_positions_are_listed_for_runs_of_any_length(start: float, speed: str) -> None:
    mechanism = changed(('speed = "60 rpm"', f'start = "{start} deg"\nspeed = "{speed}"'))
    run = math.radians(start), math.radians(start) + float(speed.split()[0]) / 60.0 * math.tau
    low, high = min(run), max(run)
    within = sorted(low + (at - low) % math.tau for at in (STRETCHED, FOLDED))
    expected = [at for at in within if low < at < high]
    assert [at for _, at in toggles_of(mechanism)] == pytest.approx(expected, abs=1e-8)
    assert {what for what, _ in toggles_of(mechanism)} <= {"crank, coupler fall in line"}


def test_a_toggle_position_that_the_run_crosses_is_reported_with_its_position() -> None:
    ((what, at),) = toggles_of(changed(('law = "constant_speed"\nspeed = "60 rpm"', BACK_AND_FORTH)))
    assert (what, at) == ("crank, coupler fall in line", pytest.approx(STRETCHED, abs=1e-8))


@pytest.mark.parametrize("start", [0.0, 100.0, -20.0, 700.0])
def test_angles_of_a_report_are_within_one_turn_from_the_start(start: float) -> None:
    report = kinfmu.check(changed(('speed = "60 rpm"', f'start = "{start} deg"\nspeed = "60 rpm"')))
    (angle,) = report.loops[0].transmission
    first = math.radians(start)
    assert all(first <= at < first + math.tau for at in (angle.at_smallest, angle.at_largest))
    assert math.cos(angle.at_smallest) == pytest.approx(1.0)
    assert math.cos(angle.at_largest) == pytest.approx(-1.0)


SLIDER_CRANK = """
name = "press"
[run]
stop = "1 s"
[bodies.ground]
points = { O = [0, 0], G = [0, 5] }
[bodies.crank]
points = { O = [0, 0], P = [20, 0] }
start = { phi = "START" }
[bodies.rod]
points = { P = [0, 0], S = [30, 0] }
start = { phi = "ROD" }
[bodies.ram]
points = { S = [0, 0] }
start = { phi = 0 }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
S = { type = "revolute", between = ["rod.S", "ram.S"] }
guide = { type = "translational", between = ["ground.G", "ram.S"] }
[drivers]
"""
BY_CRANK = (
    'crank = { type = "angle", of = "crank", law = "harmonic", start = "START", amplitude = "50 deg", frequency = 6 }'
)
BY_RAM = """
ram = { type = "coordinate", of = "ram.S", axis = "x", law = "harmonic", start = 21, amplitude = 10, frequency = 6 }
"""


def toggles(text: str, start: str, rod: str) -> list[tuple[str, float]]:
    return toggles_of(parse(text.replace("START", start).replace("ROD", rod), "press.toml"))


def test_a_crank_and_its_rod_in_line_are_reported_with_their_position() -> None:
    # Stretched, the ram's pin is 20 + 30 from O, 5 above it.
    ((what, at),) = toggles(SLIDER_CRANK + BY_CRANK, "20 deg", "-5 deg")
    assert (what, at) == ("crank, rod fall in line", pytest.approx(math.asin(5.0 / 50.0), abs=1e-8))
    assert toggles(SLIDER_CRANK + BY_CRANK, "80 deg", "-30 deg") == []


def test_a_rod_across_the_slide_of_its_driver_is_reported_with_its_position() -> None:
    # The rod points down from P to the slide at height 5: P is 35 above O, which a crank of 40 reaches.
    text = (SLIDER_CRANK + BY_RAM).replace("P = [20, 0]", "P = [40, 0]")
    ((what, at),) = toggles(text, "58 deg", "-88 deg")
    assert (what, at) == ("rod is perpendicular to the slide", pytest.approx(math.sqrt(40.0**2 - 35.0**2), rel=1e-8))


@pytest.mark.parametrize("far", [9.0, 3e3, 1e7])
@pytest.mark.parametrize(
    "starts",
    [
        ("78 deg", "102 deg", "0 deg"),
        ("78 deg", "-102 deg", "60 deg"),  # a gap in the drawing, and another driver value than the law's
        ("170 deg", "20 deg", "100 deg"),
    ],
)
@pytest.mark.few(2)
def test_a_point_that_nothing_uses_decides_nothing(starts: tuple[str, str, str], far: float) -> None:
    coupler, rocker, crank = starts
    drawn = (
        ('start = { x = 20, phi = "78 deg" }', f'start = {{ x = 20, y = 0, phi = "{coupler}" }}'),
        ('start = { x = 40, phi = "102 deg" }', f'start = {{ x = 40, y = 0, phi = "{rocker}" }}'),
        ("P = [20, 0] }", f'P = [20, 0] }}\nstart = {{ x = 0, y = 0, phi = "{crank}" }}'),
    )
    plain = kinfmu.check(changed(*drawn))
    for place in ("O = [0, 0], C", "O = [0, 0], P", "P = [0, 0], Q", "C = [0, 0], Q"):
        report = kinfmu.check(changed(*drawn, (place, f"E = [{far}, {far}], {place}")))
        unused, *others = report.notes
        assert unused.endswith("used by no joint, driver, load, measure or point of interest")
        assert tuple(others) == plain.notes
        assert report.plan == plain.plan
        assert [reach.as_json() for reach in report.ranges] == [reach.as_json() for reach in plain.ranges]
