"""DXF sketches made with ezdxf: each moves as the same mechanism by hand; drawings of kinfmu itself are read, too."""

from __future__ import annotations

import io
import math
import sys
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import pytest

import kinfmu
from kinfmu import PointOnLine
from kinfmu.errors import MissingPackageError
from kinfmu.mechanism.imports import imported
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.toml_file import parse
from tests.mechanism.imports.drawn import Drawn, assert_checks, assert_moves_as, places_of, words_of

MM, INCH = 4, 1
NAMES = {  # of pins: their places in the sketches, which have no names
    "four_bar": "O 0 0, A 20 15, B 90 60, C 100 0, T 60 80",
    "slider_crank": "O 0 0, A 30 20, B 130 7.5, G 60 -10, H 200 25",
    "swinging_lever": "O 0 0, A 12 16, C 0 -60, D 24 92",
    "polylines": "O -1.5 2, A -1 2.5, B 2.125 5.75, C 4.25 1.5, T 1 6",
    "slide": "O 0 0, A 6 8, B 40 5, Q 50 5, G 20 5, H 80 5",
}


class Sheet:
    """A drawing, with lines and circles between named places."""

    def __init__(self, name: str, units: int = MM) -> None:
        self.places = places_of(NAMES[name])
        self.drawing = ezdxf.new("R2010", units=units)  # type: ignore[attr-defined]
        self.space: Any = self.drawing.modelspace()

    def line(self, layer: str, *names: str, polyline: bool = False) -> None:
        points = [self.places[name] for name in names]
        if polyline:
            self.space.add_lwpolyline(points, dxfattribs={"layer": layer})
        else:
            for a, b in pairwise(points):
                self.space.add_line(a, b, dxfattribs={"layer": layer})

    def circle(self, layer: str, *names: str) -> None:
        for name in names:
            self.space.add_circle(self.places[name], 3.0, dxfattribs={"layer": layer})

    def point(self, layer: str, *names: str) -> None:
        for name in names:
            self.space.add_point(self.places[name], dxfattribs={"layer": layer})

    def text(self) -> str:
        stream = io.StringIO()
        self.drawing.write(stream)
        return stream.getvalue()


def four_bar() -> Sheet:
    sheet = Sheet("four_bar")
    sheet.circle("ground", "O", "C")
    sheet.line("crank", "O", "A")
    sheet.line("coupler", "A", "B", "T")
    sheet.line("rocker", "B", "C")
    sheet.space.add_text("motor", dxfattribs={"layer": "crank"})
    return sheet


def slider_crank() -> Sheet:
    sheet = Sheet("slider_crank")
    sheet.point("ground", "O")
    sheet.line("Crank", "O", "A")
    sheet.line("rod", "A", "B")
    sheet.line("SLOT", "G", "H")
    return sheet


def swinging_lever() -> Sheet:
    sheet = Sheet("swinging_lever")
    sheet.point("ground", "O", "C")
    sheet.line("crank", "O", "A")
    sheet.line("lever", "C", "D")
    sheet.line("slot_lever", "C", "D")
    return sheet


def polylines() -> Sheet:
    sheet = Sheet("polylines", INCH)
    sheet.line("0", "O", "C")
    sheet.line("input arm", "O", "A", polyline=True)
    sheet.line("coupler", "A", "T", "B", polyline=True)
    sheet.space.add_polyline2d([sheet.places["B"], sheet.places["C"]], dxfattribs={"layer": "rocker"})
    sheet.space.add_lwpolyline([(k, k * k) for k in range(30)], dxfattribs={"layer": "rocker"})  # an outline
    sheet.drawing.layers.add("notes").off()
    sheet.line("notes", "O", "T")
    return sheet


def slide() -> Sheet:
    sheet = Sheet("slide")
    sheet.point("ground", "O")
    sheet.line("crank", "O", "A")
    sheet.line("rod", "A", "B")
    sheet.line("block", "B", "Q")
    sheet.line("slot", "G", "H")
    return sheet


def on_rail(_: Drawn) -> Iterator[Joint]:
    yield PointOnLine("B", ("ground.G", "rod.B"), math.atan2(35, 140))


def in_lever(_: Drawn) -> Iterator[Joint]:
    yield PointOnLine("A", ("lever.C", "crank.A"), 0.0)


def held_twice(_: Drawn) -> Iterator[Joint]:
    yield PointOnLine("B", ("ground.G", "block.B"), 0.0)
    yield PointOnLine("Q", ("ground.G", "block.Q"), 0.0)


PINS = "O ground crank, A crank coupler, B coupler rocker, C ground rocker"
CASES: dict[str, tuple[Callable[[], Sheet], str, str, dict[str, Any]]] = {
    "four_bar": (four_bar, "crank O A, coupler A B T, rocker B C", PINS, {}),
    "slider_crank": (slider_crank, "crank O A, rod A B", "O ground crank, A crank rod", {"others": on_rail}),
    "swinging_lever": (swinging_lever, "crank O A, lever C D", "O ground crank, C ground lever", {"others": in_lever}),
    "polylines": (polylines, "crank O A, coupler A B T, rocker B C", PINS, {"unit": "in"}),
    "slide": (
        slide,
        "crank O A, rod A B, block B Q",
        "O ground crank, A crank rod, B rod block",
        {"others": held_twice},
    ),
}


def named(text: str, name: str) -> str:
    """The file with the names of the places instead of P1, P2, ..."""
    mechanism = parse(text)
    for point, place in places_of(NAMES[name]).items():
        found = {key.partition(".")[2] for key, at in mechanism.body_points.items() if math.dist(at, place) < 1e-9}
        if found:
            (old,) = found
            for end in ('"', " ="):
                text = text.replace(f"{old}{end}", f"{point}{end}")
    return text


@pytest.mark.parametrize("name", CASES)
def test_a_sketch_moves_as_the_mechanism_by_hand(name: str) -> None:
    sheet, bars, pins, more = CASES[name]
    by_hand = Drawn(places_of(NAMES[name]), words_of(bars), pins, {"crank": 60.0}, **{"unit": "mm", **more})
    mechanism = assert_moves_as(named(imported(sheet().text()).text, name), by_hand)
    assert_checks(mechanism)


def test_what_is_chosen_and_left_out_is_noted() -> None:
    assert imported(four_bar().text()).notes == (
        "left out: 1 TEXT",
        "crank is driven at 60 rpm: a drawing has no drivers",
    )
    assert imported(polylines().text()).notes == (
        "left out: 1 LWPOLYLINE, 1 elements of hidden layers",
        "layer 0 is part of the ground",
        "input_arm is driven at 60 rpm: a drawing has no drivers",
        "names made valid: 'input arm' is input_arm",
    )
    assert "slot 1 on ground holds rod.P3" in imported(slider_crank().text()).notes
    no_unit = Sheet("four_bar", 0)
    no_unit.line("ground", "O", "C")
    no_unit.line("a", "O", "A")
    assert "the drawing has no unit of length that is known ($INSUNITS = 0): mm" in imported(no_unit.text()).notes


def test_the_shortest_link_on_the_ground_is_driven() -> None:
    sheet = Sheet("four_bar")
    sheet.circle("ground", "O", "C")
    for layer, ends in {"x": "BC", "y": "OA", "z": "AB"}.items():
        sheet.line(layer, *ends)
    assert [driver.name for driver in parse(imported(sheet.text()).text).drivers] == ["y"]


@pytest.mark.parametrize("name", ["crank_rocker", "slider_crank", "peaucellier"])
def test_a_drawing_of_kinfmu_has_the_same_pins(name: str, tmp_path: Path) -> None:
    mechanism = kinfmu.load(name)
    run = kinfmu.solve(mechanism)
    kinfmu.draw.dxf(run, tmp_path / "pose.dxf")
    again = parse(imported((tmp_path / "pose.dxf").read_bytes(), "pose.dxf").text)
    pairs = [
        sorted(
            sorted(place.partition(".")[0] for place in joint.between)
            for joint in one.joints
            if joint.type == "revolute"
        )
        for one in (mechanism, again)
    ]
    assert pairs[0] == pairs[1]


def test_a_missing_ezdxf_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    text = four_bar().text()
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MissingPackageError, match=r"sketch: a DXF file needs ezdxf: pip install 'kinfmu\[dxf\]'"):
        imported(text, "sketch.dxf")
