"""Margins and estimated errors that `simulate` does not read from the FMU: as those that the FMU gives if asked."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Distance, Mechanism, Revolute, Translational
from kinfmu.fmu import build, simulate
from kinfmu.fmu.build import FLAVOURS
from kinfmu.log import McapLog, read
from kinfmu.log.record import ESTIMATES
from kinfmu.mechanism.toml_file import parse
from kinfmu.plan import compile_plan
from kinfmu.run import Run
from kinfmu.solver.python.pose import Status
from tests.fmu.conftest import GALLERY

ALL = ["all"]  # margins and errors are read from the FMU if the channels name them
STEPS = {  # [s]: with bridges, a slide, a rack, two drivers, two blocks, blocks of three unknowns, a cam
    "fourbar": 3.0,
    "offset_slider_crank": 0.03,
    "rack_steering": 0.1,
    "five_bar": 0.1,
    "watt_six_bar": 0.04,
    "stephenson_six_bar": 0.2,
    "cam_roller": 0.2,
}
INPUTS = {"time": [0.0, 10.0], "crank_angle": [0.3, 6.9], "crank_speed": [0.7, 0.6], "crank_acceleration": [1.0, 2.0]}


def _assert_as_asked(run: Run, asked: Run) -> None:
    """Check that estimates computed by the engine of Python are those of a Python FMU, to the bit."""
    assert run.is_lazy("margin")
    assert run.is_lazy("error")
    assert not asked.is_lazy("error")
    assert np.array_equal(run.status, asked.status)
    for name in ("margin", "error"):
        assert getattr(run, name).tobytes() == getattr(asked, name).tobytes(), name


@pytest.mark.parametrize(("name", "step"), STEPS.items())
@pytest.mark.few(2)
def test_estimates_equal_those_of_the_fmu(name: str, step: float, built: Callable[..., Path]) -> None:
    _assert_as_asked(simulate(built(name), step=step), simulate(built(name), step=step, channels=ALL))


def test_estimates_near_singular_poses_equal_those_of_the_fmu(fourbar: Path) -> None:
    more: dict[str, Any] = {"start": 175.0, "stop": 185.0, "step": 0.05}
    run = simulate(fourbar, **more)
    assert {Status.OK, Status.BRIDGED} <= set(run.status.tolist())
    _assert_as_asked(run, simulate(fourbar, **more, channels=ALL))


def _with_a_length(at: tuple[float, float]) -> Mechanism:
    """Return a crank of 1 and a bar of 2 to a block on a line, whose place is the unknown."""
    x, y = at
    far = math.cos(1.0) + math.sqrt(4.0 - math.sin(1.0) ** 2)
    bodies = [
        Body("ground", {"O": (x, y)}),
        Body("crank", {"O": (0, 0), "P": (1, 0)}, (x, y, 1.0)),
        Body("block", {"S": (0, 0)}, (x + far, y, 0.0)),
    ]
    joints = [
        Revolute("O", ("ground.O", "crank.O")),
        Translational("slide", ("ground.O", "block.S")),
        Distance("rod", ("crank.P", "block.S"), length=2.0),
    ]
    return Mechanism("length", bodies, joints, [AngleDriver("crank", "crank", ConstantSpeed(1.0, 1.0))])


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize("at", [(-14.0, 3.0), (300.0, -150.0), (0.25, 1e6)])
@pytest.mark.few(1)
def test_estimates_of_a_length_far_from_the_origin(at: tuple[float, float], flavour: str, tmp_path: Path) -> None:
    mechanism, record, more = _with_a_length(at), tmp_path / "far.mcap", {"stop": 6.0, "step": 0.25}
    fmu = build(mechanism, tmp_path / "far.fmu", flavour=flavour, drive="time")
    run, asked = simulate(fmu, **more, sink=McapLog(record)), simulate(fmu, **more, channels=ALL)
    near = kinfmu.solve(_with_a_length((0.0, 0.0)), run.t)
    plan = compile_plan(mechanism)
    assert plan.unknowns == ("block.x",)
    phi = run["crank_angle"]
    exact = at[0] + np.cos(phi) + np.sqrt(4.0 - np.sin(phi) ** 2)
    rounding = 2.0 * np.spacing(max(map(abs, at))) / plan.size  # of a coordinate
    for found in (run, asked, read(record)):
        np.testing.assert_allclose(found.margin, near.margin, rtol=1e-9)
        assert (np.abs(found["block.x"] - exact) / plan.size <= found.error[:, 0] + rounding).all()
        assert (found.error[:, 1:] <= 4.0 * near.error[:, 1:] + 1e-15).all()


def test_estimates_use_the_parameters_as_set(tmp_path: Path) -> None:
    written = (GALLERY / "crank_rocker" / "mechanism.toml").read_text().replace("Q = [50, 0]", 'Q = ["bar", 0]')
    linkage = parse(written.replace("[bodies.ground]", "[parameters]\nbar = 50\n\n[bodies.ground]"))
    fmu = build(linkage, tmp_path / "bars.fmu", flavour="python", drive="time")
    found = []
    for bar in (50.0, 53.0):
        run, asked = (simulate(fmu, step=0.05, parameters={"bar": bar}, channels=names) for names in (None, ALL))
        assert run.margin.tobytes() == kinfmu.solve(linkage.with_parameters({"bar": bar}), run.t).margin.tobytes()
        assert (run.error < 4.0 * asked.error).all()  # other roundings: planned as a file with this bar
        assert (asked.error < 4.0 * run.error).all()
        found.append(run.margin)
    assert not np.allclose(*found, rtol=1e-3)


@pytest.mark.parametrize(
    ("channels", "is_computed"),
    [
        (["-error"], True),
        (["-margin", "-watch", "-residual"], True),
        (["-solver.error_q"], True),
        (["-coupler.*"], True),
        (["-inputs"], False),  # without what they follow from
        (["q", "inputs", "solver.error_q"], False),
        (["error", "margin"], False),
        (["-error", "-margin"], False),
    ],
)
@pytest.mark.few(5)
def test_chosen_channels(channels: Sequence[str], is_computed: bool, fourbar: Path) -> None:
    run = simulate(fourbar, step=2.5, channels=channels, rate=0.2)
    asked = simulate(fourbar, step=2.5, channels=ALL, rate=0.2)
    assert (run.is_lazy("margin") or run.is_lazy("error")) == is_computed
    columns = dict(zip(ESTIMATES, np.column_stack([run.margin, run.error]).T, strict=True))
    for name, column in columns.items():
        if name in run.absent:
            assert np.isnan(column).all()
        else:
            np.testing.assert_allclose(column, asked[name], rtol=0.5, atol=1e-16)  # larger steps to each pose


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
def test_inputs(left_out: Sequence[str], rates: str, is_computed: bool, built: Callable[..., Path]) -> None:
    inputs = {name: values for name, values in INPUTS.items() if name not in left_out}
    more: dict[str, Any] = {"inputs": inputs, "step": 0.2, "parameters": {"rates": rates}}
    run, asked = (simulate(built("fourbar", "inputs"), **more, channels=names) for names in (None, ALL))
    assert run.is_lazy("error") == is_computed
    assert run.error.tobytes() == asked.error.tobytes()


def test_a_limit_ends_a_run_with_a_row_without_numbers(pendulum: Path) -> None:
    inputs = {"time": [0.0, 4.0], "crank_angle": [5.0, 7.0], "crank_speed": [0.5] * 2, "crank_acceleration": [1e-9] * 2}
    more: dict[str, Any] = {"inputs": inputs, "step": 0.05}
    run = simulate(pendulum, **more)
    assert run.status[-1] == Status.OUTSIDE
    assert np.isnan(run.error[-1]).all()
    _assert_as_asked(simulate(pendulum, **more), simulate(pendulum, **more, channels=ALL))


def test_pieces_for_a_sink_have_estimates(fourbar: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Pieces:
        def __init__(self) -> None:
            self.found: list[Run] = []

        def begin(self, run: Run) -> None: ...

        def add(self, run: Run) -> None:
            self.found.append(run)

        def end(self, run: Run, reason: str) -> None: ...

    monkeypatch.setattr("kinfmu.fmu.host.samples.PIECE", 8 * 1024)
    sink = Pieces()
    run = simulate(fourbar, step=1.0, sink=sink)
    assert len(sink.found) > 3
    for name in ("margin", "error"):
        pieces = np.concatenate([getattr(piece, name) for piece in sink.found])
        np.testing.assert_allclose(pieces, getattr(run, name), rtol=1e-3, atol=1e-14)


def test_errors_are_unknown_where_rates_overflow(fourbar: Path) -> None:
    """A speed so large that squares overflow: errors are unknown from there on, and known before."""
    inputs: Mapping[str, Sequence[float]] = {
        "time": [0.0, 1.0, 1.0 + 1e-9, 2.0],
        "crank_angle": [0.3, 0.6, 0.6, 0.9],
        "crank_speed": [0.3, 0.3, 1e80, 1e80],
        "crank_acceleration": [0.1, 0.1, 1e99, 1e99],
    }
    more: dict[str, Any] = {"inputs": inputs, "step": 0.1}
    run = simulate(fourbar, **more)
    assert np.isfinite(run.error[:11]).all()
    assert (run.error[11:, 2] > 1e80).all()
