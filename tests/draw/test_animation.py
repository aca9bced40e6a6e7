"""Animations: what moves, the duration, and what is refused."""

from __future__ import annotations

import dataclasses
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.draw import animate, animation
from kinfmu.draw.animation import _film, placed_run
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant
from kinfmu.draw.scene.shapes import shapes
from kinfmu.errors import FigureError
from kinfmu.run import Run
from kinfmu.run.driving import run_times
from tests.log.runs import fourbar, with_gap

image = pytest.importorskip("PIL.Image")


@pytest.fixture(autouse=True)
def few_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "MOST", 6)


def solved(name: str, step: int = 4) -> Run:
    mechanism = kinfmu.load(name)
    return kinfmu.solve(mechanism, run_times(mechanism.run)[::step])


def pages(path: Path) -> tuple[list[np.ndarray], list[int]]:
    with image.open(path) as picture:
        found, times = [], []
        for k in range(picture.n_frames):
            picture.seek(k)
            found.append(np.asarray(picture.convert("RGB"), dtype=int))
            times.append(picture.info["duration"])
        return found, times


def test_a_turning_linkage_repeats_without_a_pause(tmp_path: Path) -> None:
    animate(solved("crank_rocker"), tmp_path / "run.gif")
    found, times = pages(tmp_path / "run.gif")
    assert len(found) == 6
    assert times == [500] * 6  # a run of 2 s is shown in 3 s
    assert len({page.shape for page in found}) == 1
    for page, after in pairwise(found):
        assert (page != after).any()


def test_bodies_are_in_their_colours_on_white(tmp_path: Path) -> None:
    animate(solved("crank_rocker"), tmp_path / "run.gif")
    page = pages(tmp_path / "run.gif")[0][0].reshape(-1, 3)
    assert (page == 255).all(axis=1).mean() > 0.5
    for colour in palette.BODIES[:3]:
        assert (np.abs(page - palette.lighter(colour)).max(axis=1) <= 12).sum() > 100


def test_a_motion_that_does_not_return_pauses_at_its_end(tmp_path: Path) -> None:
    run = fourbar(np.arange(181.0))
    animate(run, tmp_path / "run.gif")
    found, times = pages(tmp_path / "run.gif")
    assert len(found) == 7
    assert times[-1] == times[0] + 1000
    film = _film(run, placed_run(run, tmp_path)[1], tmp_path)
    assert (film.rows[0], film.rows[-1]) == (0, 180)
    assert not film.repeats


def test_more_turns_than_the_pictures_can_show_are_refused_with_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = kinfmu.solve(kinfmu.load("crank_rocker"), np.arange(0.0, 8.1, 0.0625))  # 4 turns
    message = r"run\.gif: 'crank' turns by 24\d deg from one of 7 pictures to the next, .* no longer than 2\.9\d s$"
    with pytest.raises(FigureError, match=message):
        animate(run, tmp_path / "run.gif")
    monkeypatch.setattr(animation, "MOST", 20)
    animate(run, tmp_path / "run.gif")


def test_an_animation_for_dark_pages_has_their_paper_and_strokes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "MOST", 3)
    animate(solved("excavator"), tmp_path / "run.gif", dark=True)
    page = pages(tmp_path / "run.gif")[0][0]
    assert tuple(page[0, 0]) == palette.DARK
    for k in range(5):
        fill = palette.tint("fill", palette.body(k), is_dark=True)
        assert (page == fill).all(axis=2).sum() > 20, f"body {k}"


def test_a_gap_holds_the_last_pose_that_closed(tmp_path: Path) -> None:
    run = with_gap(fourbar(np.arange(181.0)), 100, 120)
    _, poses = placed_run(run, tmp_path)
    np.testing.assert_array_equal(poses["crank"][100:121], np.tile(poses["crank"][99], (21, 1)))
    late = with_gap(fourbar(np.arange(181.0)), 0, 30)
    film = _film(late, placed_run(late, tmp_path)[1], tmp_path)
    assert film.rows[0] == 31
    animate(run, tmp_path / "run.gif")
    reddish = [
        ((page[..., 0] > 150) & (page[..., 1] < 90) & (page[..., 2] < 90)).sum()
        for page in pages(tmp_path / "run.gif")[0]
    ]
    shown = [count - min(reddish) for count in reddish]  # the arrow of the driver is always there
    assert [count > 40 for count in shown] == [False, False, False, False, True, False, False]


def test_shapes_of_one_instant_serve_all_pictures(tmp_path: Path) -> None:
    run = solved("excavator")
    mechanism, poses = placed_run(run, tmp_path)
    directions = {driver.name: 1.0 for driver in mechanism.drivers}
    found = [
        shapes(Instant(mechanism, {body: np.vstack([pose[row], pose]) for body, pose in poses.items()}, directions))
        for row in (0, 60, 100)
    ]
    assert len([shape for shape in found[0] if shape.kind in ("barrel", "shaft")]) == 6
    for other in found[1:]:
        for one, same in zip(found[0], other, strict=True):
            assert (one.kind, one.name, one.frame) == (same.kind, same.name, same.frame)
            np.testing.assert_allclose(one.points, same.points, atol=1e-9)


def test_the_same_run_gives_the_same_bytes(tmp_path: Path) -> None:
    run = fourbar(np.arange(0.0, 181.0, 30.0))
    animate(run, tmp_path / "a.gif")
    animate(run, tmp_path / "b.gif")
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_what_cannot_be_drawn_is_reported(tmp_path: Path) -> None:
    run = fourbar(np.arange(181.0))
    path = tmp_path / "run.gif"
    with pytest.raises(FigureError, match=r"run\.gif: the run does not hold its mechanism, so there"):
        animate(dataclasses.replace(run, mechanism_source=""), path)
    with pytest.raises(FigureError, match=r"run\.gif: the run's mechanism: not valid TOML"):
        animate(dataclasses.replace(run, mechanism_source="name = ["), path)
    remedy = r"without which the linkage cannot be drawn; keep them: --channels all"
    with pytest.raises(FigureError, match=rf"the run does not hold coupler\.x, coupler\.y, {remedy}"):
        animate(run.without(["coupler.x", "coupler.y"]), path)
    with pytest.raises(FigureError, match=r"needs two samples with numbers; the run has 1$"):
        animate(fourbar(np.array([60.0])), path)
    with pytest.raises(
        FigureError, match=r"run\.avi: '\.avi' is not a known format of animations; known: \.gif, \.mp4"
    ):
        animate(run, tmp_path / "run.avi")
    (tmp_path / "a_file").touch()
    with pytest.raises(FigureError, match=r"run\.gif: cannot be written"):
        animate(fourbar(np.arange(0.0, 181.0, 60.0)), tmp_path / "a_file" / "run.gif")
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]
