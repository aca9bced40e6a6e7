"""Check reports probable mistakes in a file with their place."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from kinfmu.analysis import check
from kinfmu.analysis.file_notes import file_notes, unit_notes
from kinfmu.errors import MechanismError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.joints.cam import CamOscillating
from kinfmu.mechanism.laws.sequence import MotionSequence, Segment
from kinfmu.mechanism.toml_file import parse
from kinfmu.run.continued import continued
from kinfmu.units import METRES
from tests.mechanism.test_wrong_files import CRANK_ROCKER, DRIVER
from tests.reports import unwrapped


@pytest.mark.parametrize("name", gallery.names())
def test_the_gallery_gives_no_cause(name: str) -> None:
    assert list(file_notes(gallery.load(name))) == []


def test_parameters_that_are_used_nowhere_are_reported() -> None:
    text = CRANK_ROCKER.replace("crank = 1.0", 'crank = "2*half"\nhalf = 0.5\nrod = 3\nlong = "2*rod"', 1)
    mechanism = parse(text)
    assert mechanism.unused_parameters == ("rod", "long")
    note = "[parameters] rod, long change nothing: no number of the mechanism refers to it"
    assert list(file_notes(mechanism)) == [note]
    report = check(mechanism)
    assert note in report.notes
    assert f"note {note}" in unwrapped(report)


@pytest.mark.parametrize("text", ["0.8*size", "size + 10 mm"])
def test_a_number_that_is_a_length_in_every_expression_is_reported_with_its_unit(text: str) -> None:
    mechanism = parse(CRANK_ROCKER.replace("crank = 1.0", f'crank = "{text}"\nsize = 1.25', 1))
    assert list(file_notes(mechanism)) == []  # the unit of the key is known through another parameter
    mechanism = parse(CRANK_ROCKER.replace("crank = 1.0", "size = 1.25", 1).replace('"crank", 0', f'"{text}", 0', 1))
    (note,) = file_notes(mechanism)
    assert note.startswith(
        f"[parameters] size = 1.25 has no unit and is a pure number, although '{text}' is a length: "
    )
    assert 'if size is one, write size = "1.25 m"' in note
    cured = parse(CRANK_ROCKER.replace("crank = 1.0", 'size = "1.25 m"', 1).replace('"crank", 0', f'"{text}", 0', 1))
    assert list(file_notes(cured)) == []
    assert cured.parameters["size"].kind == "length"


@pytest.mark.parametrize("text", ["rod*size", "rod/size", "size*teeth", "1 m*size"])
def test_a_factor_of_a_length_and_one_of_two_numbers_are_no_lengths(text: str) -> None:
    given = 'size = 1.25\nrod = "0.5 m"\nteeth = 12'
    mechanism = parse(CRANK_ROCKER.replace("crank = 1.0", given, 1).replace('"crank", 0', f'"{text}", 0', 1))
    assert not [note for note in file_notes(mechanism) if "no unit" in note]


def test_an_angle_that_looks_like_degrees_is_reported() -> None:
    mechanism = parse(CRANK_ROCKER.replace('phi = "60 deg"', "phi = 60", 1))
    assert list(file_notes(mechanism)) == [
        "[bodies.crank] start.phi = 60 rad is 3437.75 deg, more than a turn: "
        "a bare angle is in radians; degrees are written such as '60 deg'"
    ]


def test_an_angle_of_a_law_that_looks_like_degrees_is_reported_and_many_turns_are_not() -> None:
    assert 'start = "60 deg"' in DRIVER
    message = list(file_notes(parse(CRANK_ROCKER.replace('start = "60 deg"', "start = 60"))))
    assert [note.partition(" rad is")[0] for note in message] == ["[drivers.crank] start = 60"]
    assert list(file_notes(parse(CRANK_ROCKER.replace('start = "60 deg"', 'start = "3600 deg"')))) == []


def test_a_driven_distance_below_zero_is_reported() -> None:
    cylinder = (
        'cylinder = { type = "distance", between = ["ground.O", "coupler.Q"], law = "constant_speed", start = -3 }'
    )
    mechanism = parse(CRANK_ROCKER.replace(DRIVER, f"{cylinder}\n", 1))
    assert list(file_notes(mechanism)) == [
        "[drivers.cylinder] the distance is -3 m at the start of the run: "
        "its magnitude counts, and decreases as the value increases"
    ]


CAM = """
name = "ejector"
bodies.ground = { points = { O = [0, 0] } }
bodies.cam = { points = { O = [0, 0] } }
bodies.rod = { points = { P = [0, 0] } }
[joints]
O = { type = "revolute", between = ["ground.O", "cam.O"] }
guide = { type = "translational", between = ["ground.O", "rod.P"] }
[joints.lift]
type = "cam_translating"
between = ["ground.O", "rod.P"]
cam = "cam"
law = "sequence"
segments = [
    { law = "cycloidal", duration = "180 deg", rise = 1 },
    { law = "cycloidal", duration = "180 deg", rise = -1 },
]
[drivers]
cam = { type = "angle", of = "cam", law = "constant_speed", speed = "60 rpm" }
[run]
stop = 2
"""


def test_a_cam_that_turns_on_where_its_lift_ends_is_reported() -> None:
    note = "[joints.lift] law: its sequence does not repeat; set repeat = true; [run] turns cam by 720 deg"
    assert list(file_notes(parse(CAM))) == [note]
    assert note in check(parse(CAM)).notes
    assert list(file_notes(parse(CAM.replace("stop = 2", "stop = 1")))) == []
    assert list(file_notes(parse(CAM.replace("segments", "repeat = true\nsegments", 1)))) == []


def test_a_load_that_turns_on_where_its_table_ends_is_reported() -> None:
    force = """[loads.gas]
type = "torque"
on = "cam"
law = "spline"
points = [[0, 0], [1, 50], [3, 10], ["360 deg", 0]]
over = { measure = "angle", of = "cam" }
"""
    cam = CAM.replace("segments", "repeat = true\nsegments", 1)
    note = "[loads.gas] law: its table does not repeat; set ends = 'periodic'; [run] turns cam by 720 deg"
    assert list(file_notes(parse(cam + force))) == [note]
    assert list(file_notes(parse(cam + force.replace("points", 'ends = "periodic"\npoints')))) == []
    assert list(file_notes(parse(cam.replace("stop = 2", "stop = 1") + force))) == []


def test_gravity_without_masses_is_reported() -> None:
    gravity = "[gravity]\nx = 0\ny = -9.81\n"
    cam = CAM.replace("segments", "repeat = true\nsegments", 1)
    assert list(file_notes(parse(cam + gravity))) == ["[gravity] has no effect: no body has a mass"]
    assert list(file_notes(parse(cam.replace("{ P = [0, 0] } }", "{ P = [0, 0] }, mass = 1 }") + gravity))) == []


def test_notes_are_in_the_report_of_an_invalid_mechanism_too() -> None:
    mechanism = parse(
        CRANK_ROCKER.replace("crank = 1.0", "crank = 1.0\nrod = 3", 1).replace("Q = [3.5, 0]", "Q = [9, 0]")
    )
    report = check(mechanism)
    assert report.problem is not None
    assert report.notes == ("[parameters] rod changes nothing: no number of the mechanism refers to it",)


SIX_BAR = """
name = "six_bar"
[bodies.ground]
points = { O = [0, 0], C = [3, 0], G = [6, 1] }
[bodies.crank]
points = { O = [0, 0], A = [0, 1] }
start = { x = 0, y = 0, phi = 0 }
[bodies.coupler]
points = { A = [0, 1], B = [3, 2], P = [2, 3] }
start = { x = 0, y = 0, phi = 0 }
[bodies.rocker]
points = { C = [3, 0], B = [3, 2] }
start = { x = 0, y = 0, phi = 0 }
[bodies.bar]
points = { P = [2, 3], R = [5, 3] }
start = { x = 0, y = 0, phi = 0 }
[bodies.flap]
points = { G = [6, 1], R = [5, 3] }
start = { x = 0, y = 0, phi = 0 }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
A = { type = "revolute", between = ["crank.A", "coupler.A"] }
B = { type = "revolute", between = ["coupler.B", "rocker.B"] }
C = { type = "revolute", between = ["ground.C", "rocker.C"] }
P = { type = "revolute", between = ["coupler.P", "bar.P"] }
R = { type = "revolute", between = ["bar.R", "flap.R"] }
G = { type = "revolute", between = ["ground.G", "flap.G"] }
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
"""  # in coordinates of the world


def _open_in_start_poses(text: str) -> list[str]:
    return [note for note in check(parse(text)).notes if "start poses" in note]


def test_joints_that_the_start_poses_leave_wide_open_are_reported() -> None:
    assert _open_in_start_poses(SIX_BAR) == []
    wrong = SIX_BAR.replace('"coupler.B", "rocker.B"', '"coupler.P", "rocker.B"')
    assert _open_in_start_poses(wrong) == [
        "in the start poses of the file joint B has a gap of 1.414 m; assembly closed it; check the coordinates of "
        "its points"
    ]
    posed = SIX_BAR.replace(
        "start = { x = 0, y = 0, phi = 0 }\n[bodies.coupler]", "start = { x = 0, y = 0, phi = 0.05 }\n[bodies.coupler]"
    )
    assert posed != SIX_BAR
    rough = posed.replace("B = [3, 2], P", "B = [3.1, 2.2], P")  # as read off a sketch
    assert _open_in_start_poses(rough) == []
    incomplete = wrong.replace("start = { x = 0, y = 0, phi = 0 }\n[bodies.bar]", "start = { phi = 0 }\n[bodies.bar]")
    assert _open_in_start_poses(incomplete) == []


def test_points_in_coordinates_of_the_world_close_the_joints_to_the_digits_of_the_drawing() -> None:
    assert _open_in_start_poses(SIX_BAR.replace("B = [3, 2], P", "B = [3.001, 2.001], P")) == []
    assert _open_in_start_poses(SIX_BAR.replace("B = [3, 2], P", "B = [3.02, 2], P")) == [
        "in the start poses of the file joint B has a gap of 0.02 m; assembly closed it; check the coordinates of "
        "its points"
    ]
    computed = SIX_BAR.replace("B = [3, 2], P", 'B = ["x", 2], P') + "[parameters]\nx = 3.02\n"
    assert _open_in_start_poses(computed) == []  # parameters change lengths after the drawing


def test_an_error_of_a_later_loop_names_an_earlier_joint_that_the_start_poses_leave_open() -> None:
    wrong = SIX_BAR.replace("B = [3, 2], P", "B = [-1, 0], P").replace("R = [5, 3]", "R = [4, 2]")
    problem = str(check(parse(wrong)).problem)
    assert "the loop of bodies bar, flap with joints P, R, G does not close" in problem
    assert problem.endswith("; in the start poses of the file joint B has a gap of 4.472 m")


def test_an_error_of_mobility_names_first_a_joint_at_a_wrong_point() -> None:
    other = SIX_BAR.replace("C = [3, 0]", "C = [2, 0]")
    assert check(parse(other)).problem is None
    report = check(parse(other.replace('"coupler.B", "rocker.B"', '"coupler.A", "rocker.B"')))
    assert str(report.problem).startswith(
        "in the start poses of the file joint B has a gap of 3.162 m; point coupler.B is used by no joint, driver, "
        "load, measure or point of interest; [drivers.crank] drives what the joints hold, while "
    )
    assert "remove it" not in unwrapped(report)


def test_an_error_of_mobility_names_the_point_that_no_joint_uses_also_where_it_is_the_end_of_a_rod() -> None:
    text = SIX_BAR.replace("R = [5, 3] }", 'R = [5, 3] }\nmass = "1 kg"\nrod = ["P", "R"]', 1)
    assert check(parse(text)).problem is None
    closed = text.replace('"bar.R", "flap.R"', '"bar.P", "flap.R"').replace(
        "G = [6, 1], R = [5, 3]", "G = [6, 1], R = [2, 3]"
    )
    report = check(parse(closed))
    assert str(report.problem) == (
        "point bar.R is used by no joint, driver, load, measure or point of interest; "
        "[drivers.crank] drives what the joints hold, while bar can still move"
    )


EFFORT = '[measures.motor]\ntype = "peak"\nof = "crank.torque"\n'


def test_a_measure_of_an_effort_does_not_hide_what_the_mechanism_lacks() -> None:
    heavy = SIX_BAR.replace("R = [5, 3] }", 'R = [5, 3] }\nmass = "1 kg"', 1)
    pin = 'R = { type = "revolute", between = ["bar.R", "flap.R"] }\n'
    assert check(parse(heavy + EFFORT)).problem is None
    report = check(parse(heavy.replace(pin, "") + EFFORT))
    assert "mobility is 3 but there is 1 driver" in str(report.problem)
    assert report.advice[0].text.startswith("join bar.R and flap.R: they are in the same place")
    undriven = heavy.partition("[drivers")[0]
    other = undriven + '[drivers]\nb = { type = "angle", of = "bar", law = "constant_speed" }\n'
    measure = r"\[measures\.motor\] of: 'crank.torque' is"
    for text, message in (
        (undriven, rf"\[drivers\] there is no driver: {measure} the effort of one; add \[drivers\.crank\] with .*"),
        (other, f"{measure} not there: there is no driver 'crank'; drivers: b"),
        (SIX_BAR, f"{measure} not there: without masses and loads there are no forces; give a body a mass, .*"),
    ):
        with pytest.raises(MechanismError, match=rf"^mechanism: {message}$"):
            parse(text + EFFORT)


def test_a_rise_of_a_cam_in_degrees_without_a_unit_is_reported_once() -> None:
    mechanism = gallery.load("fourbar")
    segments = (Segment("cycloidal", 3.0, -22.0), Segment("cycloidal", math.tau - 3.0, 22.0))
    cam = CamOscillating("lobe", ("ground", "rocker"), "crank", MotionSequence(segments, repeat=True))
    notes = list(file_notes(replace(mechanism, joints=(*mechanism.joints, cam))))
    assert notes == [
        "[joints.lobe] rise_1 = -22 rad is -1260.51 deg, more than a turn: a bare angle is in radians; "
        "degrees are written such as '60 deg'"
    ]


@pytest.mark.parametrize(("offset", "is_noted"), [("5", True), ("5 deg", False), ("-40 deg", True)])
@pytest.mark.few(2)
def test_an_offset_that_turns_an_oscillating_follower_far_from_its_start_pose_is_reported(
    offset: str, is_noted: bool
) -> None:
    lever = "[bodies.lever]\npoints = { H = [-2, 0], R = [0, 0.5] }\nstart = { x = 0, y = 0, phi = 0 }\n[joints]\n"
    cam = (
        f'[joints.lobe]\ntype = "cam_oscillating"\nbetween = ["ground", "lever"]\ncam = "crank"\noffset = "{offset}"\n'
        'law = "harmonic"\namplitude = "5 deg"\nfrequency = 1\n'
    ).replace('"5"', "5")
    text = SIX_BAR.replace("[joints]\n", f"{lever}H = {{ type = 'revolute', between = ['ground.H', 'lever.H'] }}\n")
    text = text.replace("G = [6, 1] }\n[bodies.crank]", "G = [6, 1], H = [-2, 0] }\n[bodies.crank]")
    found = [
        note for note in check(parse(text.replace("[drivers.crank]", f"{cam}[drivers.crank]"))).notes if "lobe" in note
    ]
    assert bool(found) == is_noted
    assert all("check offset = " in note for note in found)


def test_angles_that_are_set_are_not_reported_as_numbers_of_the_file() -> None:
    for phi in ('"60 deg"', "1.0"):
        written = parse(CRANK_ROCKER.replace('phi = "60 deg"', f"phi = {phi}", 1))
        for start in ("400 deg", 60.0):
            mechanism = continued(written, {"crank.start": start}).mechanism
            assert not [note for note in check(mechanism, written=written).notes if "bare angle" in note]
    assert not [note for note in check(parse(CRANK_ROCKER.replace('"60 deg"', '"420 deg"'))).notes if "bare" in note]


@pytest.mark.parametrize("start", ["61 rad", "400 rad", "3495.0425 deg"])
def test_a_start_that_differs_from_the_law_by_rounding_is_followed_to_it(start: str) -> None:
    mechanism = continued(parse(CRANK_ROCKER), {"crank.start": start}).mechanism
    assert not [note for note in check(mechanism).notes if "cannot be reached" in note]


BARS = """
name = "bars"
units.length = "{unit}"
[bodies]
ground.points = {{ O = [0, 0], C = [{g}, 0] }}
crank.points = {{ O = [0, 0], P = [{a}, 0] }}
coupler = {{ points = {{ P = [0, 0], Q = [{b}, 0] }}, mass = 1 }}
rocker.points = {{ C = [0, 0], Q = [{c}, 0] }}
[joints]
O = {{ type = "revolute", between = ["ground.O", "crank.O"] }}
P = {{ type = "revolute", between = ["crank.P", "coupler.P"] }}
Q = {{ type = "revolute", between = ["coupler.Q", "rocker.Q"] }}
C = {{ type = "revolute", between = ["ground.C", "rocker.C"] }}
"""
SPRING = """
[gravity]
x = 0
y = GRAVITY
[loads.coil]
type = "spring"
between = ["ground.O", "rocker.Q"]
stiffness = STIFFNESS
free_length = FREE
[loads.oil]
type = "damper"
between = ["ground.O", "rocker.Q"]
damping = DAMPING
"""
MEANT = {"GRAVITY": '"-9.81 m/s2"', "STIFFNESS": '"2 N/mm"', "FREE": '"80 mm"', "DAMPING": '"3 N s/m"'}


def _in_unit(unit: str, **given: str) -> list[str]:
    """Return the notes on a four-bar of 100 mm to 400 mm with a spring, its lengths as bare numbers."""
    lengths = {"g": 400, "a": 100, "b": 350, "c": 300}
    text = BARS.format(unit=unit, **{name: f"{one * 1e-3 / METRES[unit]:g}" for name, one in lengths.items()})
    loads = SPRING
    for key, value in (MEANT | given).items():
        loads = loads.replace(key, value)
    return [*unit_notes(parse(text + loads))]


@pytest.mark.parametrize(
    ("unit", "given", "understood", "meant"),
    [
        ("mm", {"GRAVITY": "-9.81"}, "[gravity] y = -9.81 is -9.81 mm/s2, 0.00981 m/s2 in all", "'-9.81 m/s2'"),
        ("cm", {"GRAVITY": "-9.8"}, "[gravity] y = -9.8 is -9.8 cm/s2, 0.098 m/s2 in all", "'-9.8 m/s2'"),
        ("m", {"GRAVITY": "-9810"}, "[gravity] y = -9810 is -9810 m/s2", "'-9810 mm/s2'"),
        ("m", {"GRAVITY": "-981"}, "[gravity] y = -981 is -981 m/s2", "'-981 cm/s2'"),
        (
            "mm",
            {"STIFFNESS": "2"},
            "[loads.coil] stiffness = 2 is 2 N/m, although the unit of length is mm",
            "'2 N/mm'",
        ),
        (
            "cm",
            {"STIFFNESS": "5"},
            "[loads.coil] stiffness = 5 is 5 N/m, although the unit of length is cm",
            "'5 N/cm'",
        ),
        ("mm", {"DAMPING": "5"}, "[loads.oil] damping = 5 is 5 N s/m", "'5 N s/mm'"),
        ("mm", {"FREE": "0.08"}, "[loads.coil] free_length: 0.08 is 0.08 mm, about a thousandth of", "'0.08 m'"),
        ("m", {"FREE": "80"}, "[loads.coil] free_length: 80 is 80 m, about a thousand times", "'80 mm'"),
    ],
)
def test_a_bare_number_of_another_unit_is_noted_with_what_is_understood_and_probably_meant(
    unit: str, given: dict[str, str], understood: str, meant: str
) -> None:
    (note,) = _in_unit(unit, **given)
    assert note.startswith(understood)
    assert meant in note


@pytest.mark.parametrize(
    ("unit", "given"),
    [
        ("mm", {}),
        ("mm", {"GRAVITY": "-9810"}),
        ("mm", {"GRAVITY": '"-9.81 mm/s2"'}),  # as it is written
        ("mm", {"GRAVITY": "-1620"}),  # the moon's
        ("m", {"GRAVITY": "-9.81"}),
        ("m", {"STIFFNESS": "2", "DAMPING": "5", "FREE": "0.08"}),
        ("mm", {"STIFFNESS": '"2 N/m"', "DAMPING": '"5 N s/m"'}),
        ("mm", {"FREE": "12"}),
        ("mm", {"FREE": "0"}),
        ("mm", {"FREE": '"0.08 mm"'}),
    ],
)
def test_numbers_in_a_probable_unit_are_not_noted(unit: str, given: dict[str, str]) -> None:
    assert _in_unit(unit, **given) == []


@pytest.mark.parametrize(("length", "noted"), [("0.35", True), ("3.5", False), ("350000", False), ("0.001", False)])
def test_a_length_of_a_thousandth_of_all_others_is_noted(length: str, noted: bool) -> None:
    mechanism = parse(BARS.format(unit="mm", g=400, a=100, b=length, c=300))
    notes = [*unit_notes(mechanism)]
    assert bool(notes) is noted
    if noted:
        others = "the other lengths (100 to 400 mm); write '0.35 m' if intended"
        assert notes == [f"[bodies.coupler] points.Q: 0.35 is 0.35 mm, about a thousandth of {others}"]
        assert notes[0] in check(mechanism).notes


def test_a_ground_pivot_a_thousand_times_too_far_is_noted_in_any_unit() -> None:
    for unit, meant in (("mm", "400 mm"), ("m", "400000 mm")):
        mechanism = parse(BARS.format(unit=unit, g=400000, a=100, b=350, c=300))
        (note,) = unit_notes(mechanism)
        others = f"about a thousand times the other lengths (100 to 350 {unit}); write '{meant}' if intended"
        assert note == f"[bodies.ground] points.C: 400000 is 400000 {unit}, {others}"


def test_a_point_of_interest_a_thousand_times_too_far_is_noted() -> None:
    text = BARS.format(unit="mm", g=400, a=100, b=350, c=300).replace(
        "Q = [350, 0] }", "Q = [350, 0], T = [200000, 0] }"
    )
    (note,) = unit_notes(parse(text))
    others = "about a thousand times the other lengths (100 to 400 mm); write '200 mm' if intended"
    assert note == f"[bodies.coupler] points.T: 200000 is 200000 mm, {others}"
