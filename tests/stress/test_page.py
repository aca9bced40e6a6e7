"""Every gallery mechanism and a long chain, in the modules of pages: one process of Node runs all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import Status
from kinfmu.mechanism import gallery
from kinfmu.mechanism.opened import Opened, opened
from kinfmu.page.module import page_module
from tests.page import test_lengths
from tests.page.engines import (
    StepByStep,
    answers,
    drag_call,
    driven_of,
    driven_through,
    needs_node,
    rows_of,
    sweep_call,
    table,
)

MEMBERS = (*gallery.names(), "fourbar_chain:100")
UNBREAKABLE = ("scotch_yoke",)  # its slides are straight lines without ends
CLOSE = 1e-11  # of the largest number of a table
NARROW = 1e-8  # of the same, at poses interpolated across a singular point

pytestmark = needs_node


@pytest.mark.parametrize("is_page", [False, True], ids=["as written", "with the open numbers of a page"])
def test_every_mechanism_has_the_bits_of_the_native_engine(is_page: bool, tmp_path: Path) -> None:
    modules, runs = [], []
    for name in MEMBERS:
        found = opened(kinfmu.load(name)) if is_page else Opened(kinfmu.load(name), {})
        modules.append(page_module(found.mechanism, found.labels))
        runs.append(driven_through(found.mechanism, StepByStep(found.mechanism)))
    jobs = []
    for module, run in zip(modules, runs, strict=True):
        driven = driven_of(run)
        jobs.append((module, [sweep_call(module, driven), ["restart"], drag_call(driven)]))
    for name, run, (sweep, _, drag) in zip(MEMBERS, runs, answers(tmp_path, jobs), strict=True):
        expected = rows_of(run)
        assert sweep["status"] == run.status.tolist(), name
        found_rows = table(sweep["values"], expected.shape[1])
        assert np.array_equal(found_rows, expected, equal_nan=True), name
        good = run.status <= Status.BRIDGED
        assert np.array_equal(np.array(drag["rows"])[good], expected[good]), name


@pytest.mark.usefixtures("optimized")
def test_optimized_code_has_the_same_bits(tmp_path: Path) -> None:
    leg = kinfmu.load("jansen_leg")
    run, module = driven_through(leg, StepByStep(leg)), page_module(leg)
    ((sweep,),) = answers(tmp_path, [(module, [sweep_call(module, driven_of(run))])])
    expected = rows_of(run)
    assert np.array_equal(table(sweep["values"], expected.shape[1]), expected)


def test_every_opened_mechanism_moves_as_it_is_written(tmp_path: Path) -> None:
    jobs, runs, modules = [], [], []
    for name in MEMBERS:
        mechanism = kinfmu.load(name)
        found = opened(mechanism)
        module = page_module(found.mechanism, found.labels)
        run = driven_through(mechanism, StepByStep(mechanism))
        jobs.append((module, [sweep_call(module, driven_of(run))]))
        runs.append(run)
        modules.append(module)
    for name, module, run, (sweep,) in zip(MEMBERS, modules, runs, answers(tmp_path, jobs), strict=True):
        outputs = module.plan.outputs
        columns = [outputs.index(output) for output in run.outputs]
        found_rows = table(sweep["values"], 3 * len(outputs))
        assert sweep["status"] == run.status.tolist(), name
        for order, values in enumerate((run.values, run.rates, run.accelerations)):
            ours = found_rows[:, order * len(outputs) :][:, columns]
            gap = np.abs(ours - values).max(axis=1) / np.nanmax(np.abs(values))
            assert np.max(gap[run.status == Status.OK], initial=0.0) < CLOSE, name
            assert np.max(gap[run.status == Status.BRIDGED], initial=0.0) < NARROW, name


def test_every_length_of_the_gallery_that_does_not_close_keeps_the_pose(tmp_path: Path) -> None:
    by_name = test_lengths.broken(tmp_path, gallery.names())
    for name, found in by_name.items():
        assert bool(found) == (name not in UNBREAKABLE), name
        test_lengths.keeps_its_pose_and_recovers(name, found)
    (other,) = {
        text for one in by_name["fourbar_chain"] for text in one["texts"] if test_lengths.BRANCH.fullmatch(text)
    }
    assert other.endswith("crank = 180°")
