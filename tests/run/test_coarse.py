"""The note about samples that are too far apart to show a motion, and the step that would do."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kinfmu.run.verdict import coarse_samples
from kinfmu.units import InputName

CRANK, SLIDE = InputName("crank", "angle"), InputName("slide", "position")
Motion = Callable[[Any], tuple[Any, Any]]  # t -> value, speed
MOTIONS: dict[str, tuple[InputName, Motion]] = {
    "turns": (CRANK, lambda t: (20.0 * t, 20.0 + 0.0 * t)),
    "swings": (CRANK, lambda t: (0.3 * np.sin(20.0 * t + 0.4), 6.0 * np.cos(20.0 * t + 0.4))),
    "slides to and fro": (SLIDE, lambda t: (80.0 * np.sin(20.0 * t), 1600.0 * np.cos(20.0 * t))),
    "settles": (SLIDE, lambda t: (1.0 - np.exp(-50.0 * t), 50.0 * np.exp(-50.0 * t))),
}


def note_of(name: InputName, motion: Motion, step: float, stop: float = 3.0) -> str:
    t = step * np.arange(round(stop / step) + 1)
    u, ud = motion(t)
    return coarse_samples(t, [name], u[:, None], ud[:, None])


@pytest.mark.parametrize("which", MOTIONS)
@pytest.mark.parametrize("step", [0.1, 0.15, np.pi / 10.0])
def test_coarse_samples_are_noted_with_a_step_that_would_do(which: str, step: float) -> None:
    name, motion = MOTIONS[which]
    text = note_of(name, motion, step)
    found = re.fullmatch(
        rf"samples {step:.6g} s apart do not show the motion: .*{name.driver}.*; a step of (\S+) s would", text
    )
    assert found, text
    assert not note_of(name, motion, float(found[1]))
    assert float(found[1]) >= 0.001  # not finer than needed: the period is 0.3 s


@pytest.mark.parametrize("motion", [lambda t: (0.5 * 3.0 * t * t, 3.0 * t), lambda t: (0.0 * t + 7.0, 0.0 * t)])
def test_few_samples_of_a_plain_motion_are_no_matter(motion: Motion) -> None:
    assert not note_of(CRANK, motion, 0.25, 0.5)
    assert not note_of(SLIDE, motion, 0.25, 0.5)


def test_a_sample_without_numbers_and_fewer_than_three_samples_are_no_matter() -> None:
    t = np.array([0.0, 0.1, 0.2])
    u = np.array([[0.0], [0.1], [np.nan]])
    assert not coarse_samples(t, [CRANK], u, np.ones((3, 1)))
    assert not coarse_samples(t[:2], [CRANK], 50.0 * u[:2], 500.0 * np.ones((2, 1)))


def test_the_note_states_the_angle() -> None:
    assert note_of(*MOTIONS["turns"], 0.1) == (
        "samples 0.1 s apart do not show the motion: crank turns by up to 115 deg from one to the next; "
        "a step of 0.005 s would"
    )
