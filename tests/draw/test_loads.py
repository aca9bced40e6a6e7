"""Loads in figures and animations: their symbols and texts, the support of a spring, the direction of gravity."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.draw import animate, animation, figure
from kinfmu.draw.drawing import sheet_of
from kinfmu.draw.instant import instant
from kinfmu.draw.scene import palette
from kinfmu.draw.sheet import Sheet, ink
from kinfmu.mechanism import Mechanism
from tests.draw.picture import picture
from tests.gallery_members import every_member
from tests.mechanism.loads.every_load import every_load, fourbar

image = pytest.importorskip("PIL.Image")
pytest.importorskip("matplotlib")
VIOLET = "#7e22ce"


def lines(sheet: Sheet) -> list[FloatArray]:
    """The lines of loads on a sheet, in the world."""
    patches = (one for one in sheet.axes.patches if hasattr(one, "get_edgecolor"))
    found = [one for one in patches if one.get_edgecolor()[:3] == ink(palette.LOAD)]
    return [np.asarray(one.get_path().vertices) for one in found]


def texts(sheet: Sheet) -> dict[str, FloatArray]:
    """The texts on a sheet with their places in the world."""
    return {text.get_text(): np.array(text.get_position()) for text in sheet.axes.texts}


def test_a_figure_names_every_load_next_to_its_symbol() -> None:
    mechanism = every_load()
    shown = instant(mechanism)
    sheet = sheet_of(shown)
    found = texts(sheet)
    wanted = {"coil", "oil", "strut", "muscle (input)", "weight = 50 N", "wind (input)", "brake = 2 N m", "clock"}
    assert wanted | {"grease"} <= set(found)
    drawn = lines(sheet)
    for name in ("coil", "strut", "weight = 50 N", "clock"):
        nearest = min(np.hypot(*(line - found[name]).T).min() for line in drawn)
        assert nearest < 45.0 * sheet.point, name
    ends = [(line[0], line[-1]) for line in drawn if len(line) > 12 and np.ptp(line, axis=0).max() > 100.0]
    (a, b) = ends[0]  # the zigzag
    np.testing.assert_allclose(a, shown.point("ground.D"), atol=1e-9)
    np.testing.assert_allclose(b, shown.point("coupler.M"), atol=1e-9)


def test_a_figure_without_loads_and_masses_has_no_symbols_and_no_gravity() -> None:
    bare = fourbar(has_gravity=True)
    massless = Mechanism(
        "bare", [kinfmu.Body(b.name, b.points, b.start) for b in bare.bodies], bare.joints, bare.drivers
    )
    sheet = sheet_of(instant(massless))
    assert lines(sheet) == []
    assert "g" not in texts(sheet)
    assert "g" in texts(sheet_of(instant(bare)))
    assert "g" not in texts(sheet_of(instant(fourbar())))


@pytest.mark.parametrize(("pull", "way"), [((0.0, -9.81), (0.0, -1.0)), ((5.0, 0.0), (1.0, 0.0))])
def test_the_arrow_of_gravity_points_its_way_in_a_free_corner(
    pull: tuple[float, float], way: tuple[float, float]
) -> None:
    sheet = sheet_of(instant(replace(fourbar(), gravity=kinfmu.mechanism.body.Gravity(*pull))))
    at = texts(sheet)["g"]
    near = [np.asarray(one.get_path().vertices) for one in sheet.axes.patches]
    arrow = [line for line in near if np.hypot(*(line - at).T).max() < 45.0 * sheet.point]
    head = next(line for line in arrow if len(line) == 4)
    shaft = next(line for line in arrow if len(line) == 2)
    np.testing.assert_allclose((head[0] - shaft[0]) / np.hypot(*(head[0] - shaft[0])), way, atol=1e-9)


def test_a_committed_kind_of_svg_has_the_violet_lines(tmp_path: Path) -> None:
    figure(kinfmu.load("toggle_press"), tmp_path / "press.svg")
    shapes = [shape for shape in picture(tmp_path / "press.svg").shapes if VIOLET in shape.look]
    assert max(len(shape.points) for shape in shapes) > 20  # the spring of the ram
    assert len(shapes) == 3  # and the two parts of the arrow of the press force
    figure(kinfmu.load("slider_crank"), tmp_path / "none.svg")
    assert VIOLET not in (tmp_path / "none.svg").read_text("utf-8")


@every_member
@pytest.mark.few(2)
def test_loads_are_the_only_violet_lines_of_the_gallery(name: str) -> None:
    mechanism = kinfmu.load(name)
    assert bool(lines(sheet_of(instant(mechanism)))) == bool(mechanism.loads)


def test_an_animation_shows_the_spring_as_it_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "MOST", 4)
    spring = '[loads.coil]\ntype = "spring"\nbetween = ["ground.E", "rocker.Q"]\nstiffness = 1\nfree_length = 0\n'
    animate(kinfmu.solve(fourbar(spring)), tmp_path / "run.gif")
    widths = []
    with image.open(tmp_path / "run.gif") as pictures:
        for k in range(pictures.n_frames):
            pictures.seek(k)
            page = np.asarray(pictures.convert("RGB"), dtype=int)
            violet = (page == np.array(palette.LOAD)).all(axis=2)
            assert violet.sum() > 50
            widths.append(int(np.ptp(np.flatnonzero(violet.any(axis=0)))))
    assert max(widths) > 1.3 * min(widths)


@pytest.mark.parametrize(("pull", "side"), [((0.0, -9.81), 1), ((0.0, 9.81), -1), ((0.0, 0.0), 0)])
@pytest.mark.few(1)
def test_an_animation_shows_the_direction_of_gravity_at_one_place(
    pull: tuple[float, float], side: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "MOST", 4)
    animate(kinfmu.solve(replace(fourbar(), gravity=kinfmu.mechanism.body.Gravity(*pull))), tmp_path / "run.gif")
    corners = []
    with image.open(tmp_path / "run.gif") as pictures:
        for k in range(pictures.n_frames):
            pictures.seek(k)
            page = np.asarray(pictures.convert("L"), dtype=int)
            corners.append(page[28:70, 10:31])  # [px] below the title, left of the letter
    for corner in corners[1:]:
        np.testing.assert_array_equal(corner, corners[0])
    rows, columns = np.nonzero(corners[0] < 200)
    assert bool(len(rows)) == bool(side)
    if side:  # the head is the widest part, at the end to which gravity pulls
        widths = {row: np.ptp(columns[rows == row]) + 1 for row in np.unique(rows)}
        widest = max(widths, key=lambda row: widths[row])
        assert np.sign(widest - 0.5 * (rows.min() + rows.max())) == side


def test_small_arrows_keep_their_colour_in_an_animation_of_many_colours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "MOST", 4)
    animate(kinfmu.solve(kinfmu.load("excavator_loaded"), np.linspace(0.0, 5.0, 21)), tmp_path / "run.gif")
    with image.open(tmp_path / "run.gif") as pictures:
        assert (np.asarray(pictures.convert("RGB")) == np.array(palette.LOAD)).all(axis=2).sum() > 20


def test_gravity_is_left_out_where_no_corner_is_free() -> None:
    corners = {"A": (0.0, 0.0), "B": (4.0, 0.0), "C": (4.0, 3.0), "D": (0.0, 3.0)}
    plate = kinfmu.Body("plate", corners, mass=1.0)
    held = kinfmu.Revolute("A", ("ground.A", "plate.A"))
    mechanism = kinfmu.Mechanism(
        "plate",
        [kinfmu.Body("ground", {"A": (0.0, 0.0)}), plate],
        [held],
        [kinfmu.AngleDriver("plate", "plate", kinfmu.ConstantSpeed(0.0, 1.0))],
        run=kinfmu.RunSettings(0.0, 0.01),
        gravity=(0.0, -9.81),
    )
    assert "g" not in texts(sheet_of(instant(mechanism)))
