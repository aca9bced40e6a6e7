"""Figures as files: names, bytes, sizes, and the messages when one cannot be drawn."""

from __future__ import annotations

import math
import struct
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import kinfmu
from kinfmu import Angle, AngleDriver, Body, ConstantSpeed, Mechanism, Revolute
from kinfmu.draw import figure
from kinfmu.draw.drawing import placed, sheet_of
from kinfmu.draw.instant import instant, pose_note
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.scene.strokes import strokes_of
from kinfmu.errors import AssemblyError, FigureError, MissingPackageError, RequestError
from kinfmu.mechanism import gallery, toml_file, toml_text
from tests.gallery_members import every_member
from tests.mechanisms import fourbar, reference_fourbar

SVG = "{http://www.w3.org/2000/svg}"


def texts_in(path: Path) -> str:
    """All text of an SVG, with a line for each element."""
    return "\n".join(element.text or "" for element in ET.parse(path).iter(f"{SVG}text"))  # noqa: S314  ours


@every_member
@pytest.mark.few(2)
def test_a_mechanism_of_the_gallery_is_drawn_with_all_its_names(
    name: str, gallery_figure: Callable[[str], Path]
) -> None:
    mechanism = gallery.load(name)
    texts = texts_in(gallery_figure(name))
    assert mechanism.title in texts
    assert f"x [{mechanism.length_unit}]" in texts
    words = texts.replace(",", " ").split()
    for body in mechanism.moving_bodies:
        assert body.name in words
    for pin in (joint for joint in mechanism.joints if isinstance(joint, Revolute)):
        assert pin.name in words
    for driver in mechanism.drivers:
        assert f"{driver.name} = " in texts
    for point in mechanism.points:
        assert point in words


@every_member
@pytest.mark.few(2)
def test_names_are_above_all_lines_and_off_the_links_bars_and_cylinders(name: str) -> None:
    shown = instant(gallery.load(name))
    sheet = sheet_of(shown)
    canvas = FigureCanvasAgg(sheet.figure)
    canvas.draw()  # type: ignore[no-untyped-call]  # matplotlib has no types here
    point = sheet.figure.dpi / 72.0
    half = (0.5 * sheet.bar - 1.5) * point  # of a bar, whose edge a name may touch
    names = [text for text in sheet.axes.texts if text.get_transform() != sheet.axes.transAxes]
    assert min(text.get_zorder() for text in names) > max(patch.get_zorder() for patch in sheet.axes.patches)
    drawn = strokes_of(placed(shown, shapes(shown)), sheet.sizes)
    lines = [(one.shape.name, one.points) for one in drawn if one.key in ("link", "arm", "plate") and one.is_first]
    lines += [(shape.name, shape.line) for shape in placed(shown, shapes(shown)) if shape.kind == "barrel"]
    for drawn_name, line in lines:
        for a, b in pairwise(sheet.axes.transData.transform(line)):
            dots = a + np.linspace(0.0, 1.0, 300)[:, None] * (b - a)
            for text in names:
                box = text.get_window_extent().get_points()
                apart = np.maximum(np.maximum(box[0] - dots, dots - box[1]), 0.0)
                assert np.hypot(*apart.T).min() > half, f"{text.get_text()} is on {drawn_name}"


@pytest.mark.parametrize("suffix", [".svg", ".png"])
@pytest.mark.few(1)
def test_the_same_mechanism_gives_the_same_bytes(suffix: str, tmp_path: Path) -> None:
    mechanism = kinfmu.load("fourbar")
    first, second = tmp_path / f"first{suffix}", tmp_path / f"second{suffix}"
    figure(mechanism, first)
    figure(mechanism, str(second))
    assert first.read_bytes() == second.read_bytes()


def test_a_png_has_the_proportions_of_the_mechanism_at_150_dots_an_inch(tmp_path: Path) -> None:
    wide, high = tmp_path / "wide.png", tmp_path / "high.PNG"
    figure(kinfmu.load("fourbar"), wide)
    pendulum = Mechanism(
        "pendulum",
        [Body("ground", {"O": (0, 0)}), Body("rod", {"O": (0, 0), "A": (5, 0)}, (0, 0, -1.5))],
        [Revolute("O", ("ground.O", "rod.O"))],
        [AngleDriver("rod", "rod", ConstantSpeed(-1.5, 0.1))],
    )
    figure(pendulum, high)
    width, height = struct.unpack(">II", wide.read_bytes()[16:24])
    assert width > 1.5 * height
    assert 900 < width < 1500  # 6 to 10 inches
    width, height = struct.unpack(">II", high.read_bytes()[16:24])
    assert height > 1.5 * width


def test_the_users_own_settings_have_no_effect_and_are_kept(tmp_path: Path) -> None:
    import matplotlib as mpl

    mechanism = kinfmu.load("fourbar")
    plain, other = tmp_path / "plain.svg", tmp_path / "other.svg"
    figure(mechanism, plain)
    with mpl.rc_context({"axes.facecolor": "black", "svg.fonttype": "path"}):
        figure(mechanism, other)
        assert mpl.rcParams["axes.facecolor"] == "black"
    assert other.read_bytes() == plain.read_bytes()


def test_a_title_is_not_read_as_mathematics(tmp_path: Path) -> None:
    path = tmp_path / "figure.svg"
    figure(replace(kinfmu.load("fourbar"), title="a $ for a $\\frac$ & <more>"), path)
    assert "a $ for a $\\frac$ & <more>" in texts_in(path)


@pytest.mark.parametrize(
    "drivers",
    [
        (),
        (AngleDriver("crank", "crank"), AngleDriver("rocker", "rocker")),
        (AngleDriver("crank", "crank"), AngleDriver("again", "crank", ConstantSpeed(5.0, 1.0))),
    ],
    ids=["without a driver", "with one too many", "with two that contradict"],
)
@pytest.mark.few(1)
def test_a_mechanism_that_only_closes_is_drawn(drivers: tuple[AngleDriver, ...], tmp_path: Path) -> None:
    mechanism = replace(fourbar(4.0, 1.0, 3.5, 3.0), drivers=drivers)
    assert kinfmu.check(mechanism).problem is not None
    path = tmp_path / "figure.svg"
    figure(mechanism, path)
    assert {"crank", "coupler", "rocker", "O", "P", "Q", "C"} <= set(texts_in(path).split())


def test_a_mechanism_that_does_not_close_is_drawn_with_its_gap(tmp_path: Path) -> None:
    path = tmp_path / "figure.svg"
    mechanism = fourbar(9.0, 1.0, 3.5, 3.0)
    figure(mechanism, path)
    u = float(mechanism.drivers[0].law.at(0.0))
    gap = f"gap {math.dist((9.0, 0.0), (math.cos(u), math.sin(u))) - 6.5:.4g} m"
    shown = texts_in(path)
    assert gap in shown
    assert f"does not close: {gap}" in shown
    with pytest.raises(AssemblyError, match=r"^the mechanism does not close near its start pose"):
        figure(mechanism, path, at=u)


@pytest.mark.long
def test_a_leg_that_closes_at_other_crank_angles_is_drawn_with_its_gap(tmp_path: Path) -> None:
    figure(kinfmu.load("jansen_leg").with_parameters({"j": 20.0}), tmp_path / "figure.svg")
    assert "does not close: gap 3.117 mm at knee" in texts_in(tmp_path / "figure.svg")


@pytest.mark.parametrize("name", ["figure.eps", "figure", "svg"])
def test_another_kind_of_file_is_refused(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    with pytest.raises(FigureError) as caught:
        figure(kinfmu.load("fourbar"), path)
    assert str(caught.value) == f"{path}: '{path.suffix}' is not a known format of figures; known: .svg, .png, .pdf"


def test_a_path_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    (tmp_path / "none").touch()
    path = tmp_path / "none" / "figure.svg"
    with pytest.raises(FigureError) as caught:
        figure(reference_fourbar(), path)
    assert str(caught.value) == f"{path}: cannot be written (Not a directory)"


def test_without_matplotlib_the_line_that_installs_it_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingPackageError) as caught:
        figure(kinfmu.load("fourbar"), tmp_path / "figure.svg")
    assert str(caught.value).endswith("figure.svg: drawing needs matplotlib: pip install 'kinfmu[figures]'")


def test_many_names_are_left_out_and_that_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kinfmu.draw.drawing.MOST_NAMES", 3)
    path = tmp_path / "figure.svg"
    figure(kinfmu.load("fourbar"), path)
    assert "11 names left out" in texts_in(path)
    assert "coupler" not in texts_in(path)


def test_a_joint_that_has_no_picture_is_named(tmp_path: Path) -> None:
    level = Mechanism(
        "level",
        [
            Body("ground", {"O": (0, 0)}),
            Body("arm", {"O": (0, 0), "L": (2, 0)}, (0, 0, 1.0)),
            Body("basket", {"L": (0, 0), "rim": (1, 0)}, (1, 1.7, 0)),
        ],
        [
            Revolute("O", ("ground.O", "arm.O")),
            Revolute("L", ("arm.L", "basket.L")),
            Angle("upright", "basket"),
        ],
        [AngleDriver("arm", "arm")],
    )
    path = tmp_path / "figure.svg"
    figure(level, path)
    assert "not drawn: upright" in texts_in(path)


def test_check_draws_the_figure_asked_for(run_cli: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    path = tmp_path / "figure.svg"
    status, out, err = run_cli("check", "fourbar", "--figure", path)
    assert (status, err) == (0, "")
    assert out.endswith(f"{path}: written\n")
    assert "coupler" in texts_in(path)


def test_check_as_json_stays_json_with_a_figure(run_cli: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    import json

    path = tmp_path / "figure.png"
    status, out, _ = run_cli("check", "fourbar", "--json", "--figure", path)
    assert status == 0
    assert json.loads(out)["name"] == "fourbar"
    assert path.stat().st_size > 1000


def test_check_draws_a_mechanism_that_does_not_close_and_still_fails(
    run_cli: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    kinfmu.save(fourbar(9.0, 1.0, 3.5, 3.0), path)
    status, out, err = run_cli("check", path, "--figure", tmp_path / "figure.svg")
    assert status == 1
    assert "mobility" in out
    (line,) = err.splitlines()
    assert line.startswith(f"kinfmu: {path}: the mechanism does not close near its start pose")
    assert "gap " in (tmp_path / "figure.svg").read_text(encoding="utf-8")


def test_check_draws_a_mechanism_without_a_driver_and_still_fails(
    run_cli: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    path, picture = tmp_path / "mine.toml", tmp_path / "figure.svg"
    kinfmu.save(replace(fourbar(4.0, 1.0, 3.5, 3.0), drivers=()), path)
    status, out, err = run_cli("check", path, "--figure", picture)
    assert status == 1
    assert f"{picture}: written\n" in out
    assert len(err.splitlines()) == 1
    assert "coupler" in texts_in(picture)


def test_check_refuses_another_kind_of_figure_before_it_works(run_cli: Callable[..., tuple[int, str, str]]) -> None:
    status, out, err = run_cli("check", "fourbar", "--figure", "F.eps")
    assert (status, out) == (2, "")
    assert err.endswith("F.eps: its name must end in one of .svg, .png, .pdf\n")


def test_a_figure_is_drawn_at_the_given_value_of_the_driver(tmp_path: Path) -> None:
    mechanism = kinfmu.load("crank_rocker")
    figure(mechanism, tmp_path / "at.svg", math.radians(45.0))
    words = (tmp_path / "at.svg").read_text(encoding="utf-8")
    assert "crank = 45°" in words
    assert "the run starts at crank = 0°" in words
    with pytest.raises(FigureError, match=r"left = 3.490659 rad \(200 deg\) cannot be reached: the limit is"):
        figure(kinfmu.load("triple_rocker"), tmp_path / "at.svg", math.radians(200.0))
    with pytest.raises(FigureError, match=r"needs a mechanism with one driver; drivers: left, right$"):
        figure(kinfmu.load("five_bar"), tmp_path / "at.svg", 1.0)


def test_a_figure_shows_where_the_law_starts_or_reports_it() -> None:
    assert pose_note(instant(kinfmu.load("jansen_leg"))) == ""
    clearest = "clearest pose; the run starts at crank = 0°"  # there all links lie in line
    assert pose_note(instant(kinfmu.load("fourbar"))) == clearest
    assert pose_note(instant(kinfmu.load("fourbar"), 1.0)) == "the run starts at crank = 0°"
    mechanism = kinfmu.load("crank_rocker")
    text = toml_text.text(mechanism).replace("start = 0.0\nspeed", "start = 60.0\nspeed")
    shown = instant(toml_file.parse(text, "radians.toml"))
    assert shown.value("crank") == pytest.approx(60.0)  # radians, not turned back by whole turns
    assert pose_note(shown) == ""


def test_a_figure_of_something_else_than_a_mechanism_is_refused(tmp_path: Path) -> None:
    run = kinfmu.solve(kinfmu.load("fourbar"), [0.0])
    with pytest.raises(RequestError, match=r"^figure needs a Mechanism, not Run; "):
        figure(run, tmp_path / "run.svg")  # type: ignore[call-overload]
