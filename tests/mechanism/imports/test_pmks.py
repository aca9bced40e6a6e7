"""Links of PMKS+: twenty mechanisms, encoded after the codec, move as the same mechanisms written by hand."""

from __future__ import annotations

import pytest

from kinfmu.mechanism.imports import imported
from kinfmu.mechanism.toml_file import parse
from tests.mechanism.imports.drawn import assert_checks, assert_moves_as
from tests.mechanism.imports.pmks_links import ADDRESS, CASES, PmksCase, Settings, checked, payload


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_link_moves_as_the_mechanism_by_hand(case: PmksCase) -> None:
    assert_checks(assert_moves_as(imported(case.link).text, case.drawn))


def test_the_example_of_the_codec() -> None:
    joints = "6O,O,0,0,0.0A,A,Fe,0,0.0B,B,ku,VG,0.4C,C,_W,0,0"
    links = "YROA,crank,Fe,Fe,0,0,c5cae9,O,A,,.YRAB,coupler,Fe,Fe,0,0,c5cae9,A,B,,.YRBC,rocker,Fe,Fe,0,0,c5cae9,B,C,,"
    drawing = imported(ADDRESS + checked(f"2v.Ay,1E8.A,0.1011.{joints}..{links}...N_"))
    mechanism = parse(drawing.text)
    assert [body.name for body in mechanism.bodies] == ["ground", "crank", "coupler", "rocker"]
    assert mechanism.body_points["coupler.B"] == (3.0, 2.0)
    assert mechanism.body_points["rocker.C"] == (4.0, 0.0)
    assert drawing.notes == ()
    assert imported(checked(f"2v.Ay,1E8.A,0.1011.{joints}..{links}...N_")).text == drawing.text  # without the address


def test_masses_gravity_and_forces_have_the_units_of_the_drawing() -> None:
    welded = parse(imported(CASES["a welded coupler, with its parts and a force"].link).text)
    coupler = welded.bodies[2]
    assert coupler.mass == pytest.approx(2e-3)  # g of a drawing in cm; not once more for the parts
    assert coupler.inertia == pytest.approx(3e-4)  # kg cm2
    assert welded.gravity is not None
    assert welded.gravity.y == pytest.approx(-981.0)
    first, second = welded.loads
    assert (first.at, first.x, first.y, first.axes) == ("coupler.F1", 0.0, -12.5, "ground")  # type: ignore[attr-defined]
    assert (second.at, second.x, second.y, second.axes) == ("rocker.F2", 3.0, 0.0, "rocker")  # type: ignore[attr-defined]

    inches = parse(imported(CASES["inches and pounds"].link).text)
    assert inches.bodies[1].mass == pytest.approx(2 * 0.45359237)
    assert inches.bodies[1].inertia == pytest.approx(3 * 0.45359237 * 0.0254**2)
    assert parse(imported(CASES["metres, without gravity"].link).text).gravity is None


def test_masses_of_merged_links_are_lumped() -> None:
    merged = parse(imported(CASES["a coupler of two links"].link).text).bodies[2]
    assert merged.mass == pytest.approx(4e-3)
    assert merged.center_of_mass == pytest.approx((0.5, 0.25))
    assert merged.inertia == pytest.approx(6e-4)


def test_what_is_left_out_or_chosen_is_noted() -> None:
    notes = imported(CASES["two machines and a loose bar"].link).notes
    assert notes == ("nothing connects these with the ground, so they are left out: loose",)
    assert imported(CASES["a coupler of two links"].link).notes == (
        "coupler and plate share two pins: they are one body",
    )
    text = imported(CASES["metres, without gravity"].link).text
    assert "\n#   gravity is switched off in the link\n" in text
    star = payload("O 0 0 ground input, A 1 0, B 3 2, C 4 0 ground, D 0 2", "a O A, b A B, c B C, d O D")
    assert "joint 'O' drives a, the first of a, d" in imported(star).notes
    (note,) = imported(CASES["a parallelogram with three cranks"].link).notes
    assert note.startswith("degrees of freedom by count: 0, drivers: 1; it moves only if links are redundant")
    still = payload("O 0 0 ground, A 1 0", "a O A")
    assert imported(still).notes[-1] == "nothing drives it: add a table [drivers.NAME]"


def test_a_check_character_that_does_not_fit_is_noted() -> None:
    link = CASES["a crank-rocker"].link
    damaged = imported(link[:-1] + ("0" if link[-1] != "0" else "1"))
    assert damaged.notes == ("the last character of the link does not fit its length: it may be damaged",)
    assert parse(damaged.text) == parse(imported(link).text)


def test_a_link_that_the_ground_holds_is_ground_whatever_the_order_of_links_is() -> None:
    drawing = imported(payload("O 0 0 ground, X 1 0 ground, A 2 1 input, B 4 1", "arm A B, frame O X A"))
    mechanism = parse(drawing.text)
    assert [body.name for body in mechanism.moving_bodies] == ["arm"]
    assert (mechanism.joints[0].between, mechanism.drivers[0].type) == (("ground.A", "arm.A"), "angle")
    welded = payload("O 0 0 ground input, A 1 0, D 2 1, W 0 1 weld", "a O A W, c A D, e W D")
    assert [body.name for body in parse(imported(welded).text).moving_bodies] == ["a"]


def test_names_become_valid_and_unique() -> None:
    drawing = imported(
        payload("O 0 0 ground input, 2nd 1 0, B~1 3 2, B-1 4 1, C 4 0 ground", "crank~arm O 2nd, l 2nd B~1")
    )
    mechanism = parse(drawing.text)
    assert [body.name for body in mechanism.moving_bodies] == ["crank_arm", "l"]
    assert list(mechanism.bodies[2].points) == ["P2nd", "B_1"]
    assert (
        drawing.notes[-1] == "names made valid: '2nd' is P2nd, 'B~1' is B_1, 'B-1' is B_1_2, 'crank~arm' is crank_arm"
    )


def test_the_run_is_a_turn() -> None:
    mechanism = parse(imported(payload("O 0 0 ground input, A 1 0", "a O A", settings=Settings(rpm=15))).text)
    assert mechanism.run.stop == 4.0
    still = parse(imported(payload("O 0 0 ground input, A 1 0", "a O A", settings=Settings(rpm=0))).text)
    assert still.drivers[0].law.type == "external"
