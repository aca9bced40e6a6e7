"""Files of Linkage: ten mechanisms, written after its format, move as the same mechanisms by hand."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from kinfmu import Distance, DistanceDriver, Gear, Harmonic, PointOnLine
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.imports import Imported, imported
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.toml_file import parse
from tests.mechanism.imports.drawn import Drawn, assert_checks, assert_moves_as, places_of, words_of

FOLDER = Path(__file__).parent / "linkage"
PINS = "O ground crank, A crank coupler, B coupler rocker, C ground rocker"


def read(name: str) -> Imported:
    return imported((FOLDER / f"{name}.linkage2").read_bytes(), f"{name}.linkage2")


def drawn(places: str, bars: str, pins: str, turns: dict[str, float], **more: object) -> Drawn:
    return Drawn(places_of(places), words_of(bars), pins, turns, **{"unit": "mm", **more})  # type: ignore[arg-type]


def on_rail(_: Drawn) -> Iterator[Joint]:
    yield PointOnLine("B", ("ground.G", "rod.B"), math.atan2(35, 140))


def in_lever(_: Drawn) -> Iterator[Joint]:
    yield PointOnLine("A", ("lever.C", "crank.A"), 0.0)


def ram(the: Drawn) -> Iterator[Driver]:
    length = the.distance("P", "Q")
    law = Harmonic(7.5, 2 * math.pi * 0.2, length + 7.5, -math.pi / 2)
    yield DistanceDriver("ram", ("ground.Q", "boom.P"), law)


def meshing(the: Drawn) -> Iterator[Joint]:
    first, second = the.angle("small"), the.angle("large")
    yield Gear("mesh", ("small", "large"), -0.5, offset=second + 0.5 * first)


def rolling(the: Drawn) -> Iterator[Joint]:
    # The planet of 20 rolls around a sun of 30 that does not turn: it turns 1 + 30/20 times as far as the arm.
    yield Gear("mesh", ("arm", "pointer"), 2.5, offset=the.angle("pointer") - 2.5 * the.angle("arm"))


def in_arc(_: Drawn) -> Iterator[Joint]:
    yield Distance("B", ("ground.M", "rod.B"), 50.0)


def in_both(_: Drawn) -> Iterator[Joint]:
    yield PointOnLine("B", ("ground.N", "rod.B"), 0.0)
    yield PointOnLine("C", ("ground.N", "bar.C"), math.pi / 2)


CASES = {
    "four_bar": drawn(
        "O 0 0, A 20 15, B 90 60, C 100 0, T 60 80", "crank O A, coupler A B T, rocker B C", PINS, {"crank": -15.0}
    ),
    "slider_crank": drawn(
        "O 0 0, A 30 20, G 60 -10, B 130 7.5",
        "crank O A, rod A B",
        "O ground crank, A crank rod",
        {"crank": -15.0},
        others=on_rail,
    ),
    "swinging_lever": drawn(
        "O 0 0, A 12 16, C 0 -60, D 24 92",
        "crank O A, lever C D",
        "O ground crank, C ground lever",
        {"crank": 30.0},
        others=in_lever,
    ),
    "boom": drawn("O 0 0, P 40 50, Q 60 -10, T 90 80", "boom O P T", "O ground boom", {}, others=ram, stop=5.0),
    "gears": drawn(
        "O 0 0, Q 60 0, A 10 10, B 75 20, T 40 70",
        "small O A, large Q B, left A T, right B T",
        "O ground small, Q ground large, A small left, B large right, T left right",
        {"small": -15.0},
        others=meshing,
        stop=8.0,
    ),
    "planet": drawn(
        "O 0 0, A 50 10, T 70 30, E -40 30",
        "arm O A E, pointer A T",
        "O ground arm, A arm pointer",
        {"arm": -15.0},
        others=rolling,
        stop=8.0,
    ),
    "two_inputs": drawn(
        "O 0 0, A -0.5 1, B 1.5 4, C 4 1.25, D 3.5 0",
        "left O A, long A B, short B C, right C D",
        "O ground left, A left long, B long short, C short right, D ground right",
        {"left": -20.0, "right": 10.0},
        unit="in",
    ),
    "fastened": drawn(
        "O 0 0, A 20 15, B 90 60, C 100 0, T 60 80, U 30 45, V 95 30, W -20 15",
        "crank O A W, coupler A B T U, rocker B C V",
        PINS,
        {"crank": -15.0},
    ),
    "arc_slot": drawn(
        "O 0 0, A 10 15, M 120 -40, B 134 8",
        "crank O A, rod A B",
        "O ground crank, A crank rod",
        {"crank": -15.0},
        others=in_arc,
    ),
    "trammel": drawn(
        "O -100 10, A -96 13, B -30 0, C 0 40, T 30 80, N 0 0",
        "crank O A, rod A B, bar B C T",
        "O ground crank, A crank rod, B rod bar",
        {"crank": -15.0},
        others=in_both,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_file_moves_as_the_mechanism_by_hand(name: str) -> None:
    assert_checks(assert_moves_as(read(name).text, CASES[name]))


def test_every_file_has_a_case() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == set(CASES)


def test_connectors_are_in_parts_of_an_inch() -> None:
    mechanism = parse(read("four_bar").text)
    assert mechanism.name == "four_bar"
    assert mechanism.body_points["coupler.T"] == (60.0, 80.0)
    assert dict(mechanism.points) == {"T": "coupler.T"}
    assert read("four_bar").notes == ()
    assert parse(read("two_inputs").text).body_points["long.B"] == (1.5, 4.0)


def test_a_scale_factor_and_unknown_attributes_are_noted() -> None:
    text = (FOLDER / "four_bar.linkage2").read_text(encoding="utf-8")
    drawing = imported(
        text.replace('scalefactor="1.000000"', 'scalefactor="2"').replace('rpm="', 'limitangle="90" rpm="')
    )
    assert parse(drawing.text).body_points["coupler.T"] == (120.0, 160.0)
    assert drawing.notes == (
        "scalefactor = 2: all lengths are multiplied by it",
        "limitangle of connector 0 is not read",
    )


def test_what_is_left_out_or_chosen_is_noted() -> None:
    assert read("fastened").notes == ("3 elements of drawing layers and dimensions are left out",)
    assert read("boom").notes == (
        "actuator 1 moves to and fro along a cosine of the same stroke and period, in place of a constant speed",
    )
