"""Titles: long ones are wrapped and stay within the picture, short ones are one line."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from kinfmu import load
from kinfmu.draw import figure, plot
from kinfmu.draw.plots import _sheet
from kinfmu.draw.sheet import Sheet, title_lines
from kinfmu.draw.stacks import stacks_of
from kinfmu.run import Run
from tests.log.runs import fourbar

pytest.importorskip("matplotlib")

LONG = "Gripper with parallel jaws whose piston opens two of them through bell cranks of a kind"


def titled(title: str) -> Run:
    run = fourbar(np.arange(10.0))
    return dataclasses.replace(run, info={**run.info, "title": title})


def test_a_title_that_fits_is_one_line() -> None:
    assert title_lines("Gripper with parallel jaws", 400.0) == ["Gripper with parallel jaws"]
    assert title_lines("", 400.0) == []
    assert title_lines("A", 400.0) == ["A"]


def test_a_long_title_continues_on_a_second_line_and_ends_in_an_ellipsis() -> None:
    assert " ".join(title_lines(LONG, 400.0)) == LONG
    assert title_lines(LONG, 200.0) == ["Gripper with parallel jaws whose", "piston opens two of them through…"]
    first, second = title_lines("W" * 90, 200.0)
    assert set(first) == {"W"}
    assert second == f"{first}…"


@pytest.mark.parametrize(
    "title", ["\U0001f468\ue1ff", pytest.param("a" * 10_000, marks=pytest.mark.long), "$\\frac{$ {} %s <b>&amp;"]
)
@pytest.mark.few(1)
def test_any_line_of_text_is_a_title_of_every_picture(title: str, tmp_path: Path) -> None:
    mechanism = dataclasses.replace(load("fourbar"), title=title)
    figure(mechanism, tmp_path / "a.svg")
    plot(titled(title), tmp_path / "b.svg")
    for name in ("a.svg", "b.svg"):
        ET.parse(tmp_path / name)  # noqa: S314  # written just now


@pytest.mark.parametrize("title", ["Four-bar", LONG, "W" * 200])
@pytest.mark.parametrize("unit", ["m", None])
def test_the_title_of_a_figure_is_in_the_picture(title: str, unit: str | None) -> None:
    figure = Sheet(np.array([[0.0, 0.0], [0.5, 4.0]]), 1.0, unit, title).figure
    figure.canvas.draw()
    texts = [*figure.axes[0].texts, figure.axes[0]._left_title]
    boxes = [text.get_window_extent() for text in texts if text.get_text()]
    assert len(boxes) == 1
    assert boxes[0].x0 >= 0.0
    assert boxes[0].x1 <= figure.bbox.x1
    assert boxes[0].y1 <= figure.bbox.y1


@pytest.mark.parametrize("title", ["Four-bar", LONG, "W" * 200])
def test_the_title_of_plots_is_in_the_picture_and_above_the_names(title: str) -> None:
    figure = _sheet([titled(title)], stacks_of(fourbar(np.arange(10.0)), ["coupler.x"]))
    figure.canvas.draw()
    (box,) = (text.get_window_extent() for text in figure.texts)
    assert box.x1 <= figure.bbox.x1
    assert box.y1 <= figure.bbox.y1
    assert box.y0 > figure.axes[0]._left_title.get_window_extent().y1


@pytest.mark.parametrize("stop", [1.0, 1e5, 9e5, 0.0123456])
@pytest.mark.few(2)
def test_the_number_of_the_last_tick_is_in_the_picture(stop: float) -> None:
    run = fourbar(np.arange(10.0))
    figure = _sheet(
        [dataclasses.replace(run, t=np.linspace(0.0, stop, 10))],
        stacks_of(run, ["coupler.x", "coupler.y"]),
    )
    figure.canvas.draw()
    assert figure.axes[-1].xaxis.get_tightbbox().x1 <= figure.bbox.x1
