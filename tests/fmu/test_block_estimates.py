"""`simulate` computes margins and estimated errors of many samples at once: equal to the FMU's own, to the bit."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinfmu.fmu import build, simulate
from kinfmu.fmu.block_estimates import BlockEstimates
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from kinfmu.solver.python.status import Status
from tests.fmu.conftest import GALLERY

SIMULATE = sys.modules["kinfmu.fmu.simulate"]
COLUMNS = "values", "rates", "accelerations", "inputs", "residual", "watch", "status", "iterations", "margin", "error"
STEPS = {  # [s]: with bridges, a slide, a rack, two drivers, two blocks
    "fourbar": 3.0,
    "offset_slider_crank": 0.03,
    "rack_steering": 0.1,
    "five_bar": 0.1,
    "watt_six_bar": 0.04,
}
INPUTS = {"time": [0.0, 10.0], "crank_angle": [0.3, 6.9], "crank_speed": [0.7, 0.6], "crank_acceleration": [1.0, 2.0]}


@pytest.fixture
def counts(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many samples were computed in each block."""
    blocks: list[int] = []
    compute = BlockEstimates.__call__

    def counted(self: BlockEstimates, *columns: Any) -> Any:
        blocks.append(len(columns[0]))
        return compute(self, *columns)

    monkeypatch.setattr(BlockEstimates, "__call__", counted)
    return blocks


@pytest.fixture
def by_fmu(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Run]:
    """Return `simulate` with every margin and error read from the FMU."""

    def asked(*args: Any, **kwargs: Any) -> Run:
        with monkeypatch.context() as patch:
            patch.setattr(SIMULATE, "block_estimates", lambda *_: None)
            return simulate(*args, **kwargs)

    return asked


def _assert_same(found: Run, expected: Run) -> None:
    assert found.absent == expected.absent
    for name in COLUMNS:
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes(), name


@pytest.mark.parametrize(("name", "step"), STEPS.items())
def test_estimates_of_blocks_equal_those_of_the_fmu(
    name: str, step: float, built: Callable[..., Path], by_fmu: Callable[..., Run], counts: list[int]
) -> None:
    run = simulate(built(name), step=step)
    assert sum(counts) == np.count_nonzero(run.status == Status.OK) > 30
    _assert_same(run, by_fmu(built(name), step=step))


def test_estimates_near_singular_poses_are_read_from_the_fmu(
    fourbar: Path, by_fmu: Callable[..., Run], counts: list[int]
) -> None:
    run = simulate(fourbar, start=175.0, stop=185.0, step=0.05)
    assert {Status.OK, Status.BRIDGED} <= set(run.status.tolist())
    assert sum(counts) == np.count_nonzero(run.status == Status.OK)
    _assert_same(run, by_fmu(fourbar, start=175.0, stop=185.0, step=0.05))


@pytest.mark.parametrize("name", ["cam_roller", "jansen_leg", "stephenson_six_bar"])
def test_estimates_are_read_from_the_fmu_if_functions_take_no_arrays(
    name: str, built: Callable[..., Path], by_fmu: Callable[..., Run], counts: list[int]
) -> None:
    run = simulate(built(name), step=0.2)
    assert counts == []
    _assert_same(run, by_fmu(built(name), step=0.2))


def test_estimates_use_the_parameters_as_set(tmp_path: Path, by_fmu: Callable[..., Run], counts: list[int]) -> None:
    written = (GALLERY / "crank_rocker" / "mechanism.toml").read_text().replace("Q = [50, 0]", 'Q = ["bar", 0]')
    linkage = parse(written.replace("[bodies.ground]", "[parameters]\nbar = 50\n\n[bodies.ground]"))
    fmu = build(linkage, tmp_path / "bars.fmu", flavour="python", drive="time")
    runs = [simulate(fmu, step=0.05, parameters={"bar": bar}) for bar in (50.0, 53.0)]
    assert sum(counts) == sum(map(len, runs))
    assert not np.array_equal(runs[0].error, runs[1].error)
    for run, bar in zip(runs, (50.0, 53.0), strict=True):
        _assert_same(run, by_fmu(fmu, step=0.05, parameters={"bar": bar}))


@pytest.mark.parametrize(
    ("channels", "is_computed"),
    [
        (["-error"], True),
        (["-margin", "-watch", "-residual"], True),
        (["q", "inputs", "solver.error_q"], True),
        (["error", "margin"], False),  # without what they follow from
        (["qd", "inputs", "error"], False),
        (["-error", "-margin"], False),
    ],
)
def test_chosen_channels(
    channels: Sequence[str], is_computed: bool, fourbar: Path, by_fmu: Callable[..., Run], counts: list[int]
) -> None:
    run = simulate(fourbar, step=2.5, channels=channels, rate=0.2)
    assert bool(counts) == is_computed
    _assert_same(run, by_fmu(fourbar, step=2.5, channels=channels, rate=0.2))


@pytest.mark.parametrize(
    ("left_out", "rates", "is_computed"),
    [
        ((), "auto", True),
        (("crank_acceleration",), "wired", True),
        (("crank_acceleration",), "auto", False),  # errors of estimated rates count, too
        (("crank_speed", "crank_acceleration"), "auto", False),
        ((), "estimated", False),
    ],
)
def test_inputs(
    left_out: Sequence[str],
    rates: str,
    is_computed: bool,
    built: Callable[..., Path],
    by_fmu: Callable[..., Run],
    counts: list[int],
) -> None:
    inputs = {name: values for name, values in INPUTS.items() if name not in left_out}
    more: dict[str, Any] = {"inputs": inputs, "step": 0.2, "parameters": {"rates": rates}}
    run = simulate(built("fourbar", "inputs"), **more)
    assert bool(counts) == is_computed
    _assert_same(run, by_fmu(built("fourbar", "inputs"), **more))


def test_a_limit_ends_a_run_with_a_row_without_numbers(
    pendulum: Path, by_fmu: Callable[..., Run], counts: list[int]
) -> None:
    inputs = {"time": [0.0, 4.0], "crank_angle": [5.0, 7.0], "crank_speed": [0.5] * 2, "crank_acceleration": [1e-9] * 2}
    more: dict[str, Any] = {"inputs": inputs, "step": 0.05}
    run = simulate(pendulum, **more)
    assert run.status[-1] == Status.OUTSIDE
    assert np.isnan(run.error[-1]).all()
    assert sum(counts) == np.count_nonzero(run.status == Status.OK)
    _assert_same(run, by_fmu(pendulum, **more))


def test_pieces_for_a_sink_hold_the_estimates(
    fourbar: Path, by_fmu: Callable[..., Run], counts: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Pieces:
        def __init__(self) -> None:
            self.found: list[Run] = []

        def begin(self, run: Run) -> None: ...

        def add(self, run: Run) -> None:
            self.found.append(run)

        def end(self, run: Run, reason: str) -> None: ...

    monkeypatch.setattr("kinfmu.fmu.samples.PIECE", 8 * 1024)
    sink = Pieces()
    run = simulate(fourbar, step=1.0, sink=sink)
    assert len(sink.found) > 3
    assert sum(counts) == np.count_nonzero(run.status == Status.OK)  # each once
    for name in ("margin", "error"):
        assert np.concatenate([getattr(piece, name) for piece in sink.found]).tobytes() == getattr(run, name).tobytes()
    _assert_same(run, by_fmu(fourbar, step=1.0))


def test_samples_that_overflow_in_arrays_are_computed_alone(fourbar: Path, by_fmu: Callable[..., Run]) -> None:
    """A speed so large that squares overflow: errors are unknown from there on, and known before."""
    inputs: Mapping[str, Sequence[float]] = {
        "time": [0.0, 1.0, 1.0 + 1e-9, 2.0],
        "crank_angle": [0.3, 0.6, 0.6, 0.9],
        "crank_speed": [0.3, 0.3, 1e80, 1e80],
        "crank_acceleration": [0.1, 0.1, 1e99, 1e99],
    }
    more: dict[str, Any] = {"inputs": inputs, "step": 0.1}
    run = simulate(fourbar, **more)
    assert np.isfinite(run.error[:10]).all()
    _assert_same(run, by_fmu(fourbar, **more))
