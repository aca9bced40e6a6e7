"""`simulate` reads only the chosen channels and samples from an FMU."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinfmu.errors import RequestError
from kinfmu.fmu import simulate
from kinfmu.fmu.host.samples import PIECE
from kinfmu.fmu.host.slaves import LoadedSlave
from kinfmu.run import Run
from kinfmu.solver.python.pose import Status


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[set[str]]:
    """The names of the variables that each sample asks for, in turn."""
    calls: list[set[str]] = []
    reader = LoadedSlave.row_reader

    def recorded(slave: LoadedSlave, names: Sequence[str], rows: NDArray[np.float64]) -> Callable[[int], None]:
        read = reader(slave, names, rows)

        def read_row(row: int) -> None:
            calls.append({*names})
            read(row)

        return read_row

    monkeypatch.setattr(LoadedSlave, "row_reader", recorded)
    return calls


def test_only_the_chosen_channels_are_read(fourbar: Path, asked: list[set[str]]) -> None:
    whole = simulate(fourbar, stop=3.0)
    asked.clear()
    run = simulate(fourbar, stop=3.0, channels=["q", "residual"])
    assert asked == [{*run.names, "solver.residual"}] * 4
    np.testing.assert_array_equal(run.q, whole.q)
    assert np.isnan(run.rates).all()
    assert np.isnan(run.margin).all()
    assert "coupler.vx" in run.absent
    assert [column.name for column in run.columns()] == ["time", *run.names, "solver.status", "solver.residual"]


def test_samples_that_are_not_recorded_are_not_read(fourbar: Path, asked: list[set[str]]) -> None:
    whole = simulate(fourbar, stop=10.0, step=0.5)
    asked.clear()
    run = simulate(fourbar, stop=10.0, step=0.5, rate=0.25)
    assert run.t.tolist() == [0.0, 4.0, 8.0, 10.0]
    assert sum("coupler.x" in names for names in asked) == 4  # margin and errors, of some, are asked for by themselves
    np.testing.assert_allclose(run.values, whole.values[[0, 8, 16, 20]], rtol=0.0, atol=1e-14)


def test_no_channels_reads_no_variables(fourbar: Path, asked: list[set[str]]) -> None:
    run = simulate(fourbar, stop=5.0, channels=["none"])
    assert asked == []
    assert len(run) == 6
    assert run.good.all()


@pytest.mark.parametrize("inputs", [None, {"time": [0.0, 4.0], "crank_angle": [5.0, 7.0]}])
def test_a_sample_without_numbers_is_recorded_at_any_rate(
    pendulum: Path, inputs: dict[str, list[float]] | None
) -> None:
    run = simulate(pendulum, stop=4.0, step=0.25, rate=0.5, inputs=inputs)
    assert run.status[-1] == Status.OUTSIDE
    assert run.t[-1] % 2.0
    assert np.isfinite(run.inputs[-1, 0])
    assert run.events[-1].level == "error"


def test_invalid_channels_and_rates_are_refused(fourbar: Path) -> None:
    with pytest.raises(RequestError, match=r"channel 'qddd' is not known; did you mean 'qdd'\?"):
        simulate(fourbar, channels=["qddd"])
    with pytest.raises(RequestError, match="rate = 0 samples a second must be positive and finite"):
        simulate(fourbar, rate=0.0)


class Listing:
    """A sink that lists its calls, and fails after `most` of them."""

    def __init__(self, most: int = 1000) -> None:
        self.calls: list[str] = []
        self.rows = 0
        self.most = most

    def begin(self, run: Run) -> None:
        self.calls.append(f"begin {len(run)}")

    def add(self, run: Run) -> None:
        self.calls.append("add")
        self.rows += len(run)
        if len(self.calls) > self.most:
            raise OSError("disk full")

    def end(self, run: Run, reason: str) -> None:
        self.calls.append(f"end {len(run)} {reason}")


def test_a_sink_gets_every_sample_once_in_pieces_of_a_mebibyte(fourbar: Path) -> None:
    sink = Listing()
    run = simulate(fourbar, step=0.02, sink=sink)
    assert sink.rows == len(run) == 9001
    assert sink.calls[0] == "begin 0"
    assert sink.calls[-1] == "end 9001 "
    columns = len(list(run.columns()))
    assert len(sink.calls) - 2 >= 9001 * 8 * columns // PIECE


def test_a_sink_that_fails_ends_the_run_and_is_not_called_again(fourbar: Path) -> None:
    sink = Listing(most=2)
    with pytest.raises(OSError, match="disk full"):
        simulate(fourbar, step=0.03, sink=sink)
    assert sink.calls == ["begin 0", "add", "add"]


def test_a_sink_gets_the_reason_why_a_run_ends(fourbar: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> bool:
        raise RuntimeError("the FMU is gone")

    monkeypatch.setattr(LoadedSlave, "step", fails)
    sink = Listing()
    with pytest.raises(RuntimeError):
        simulate(fourbar, sink=sink)
    assert sink.calls == ["begin 0", "add", "end 1 the FMU is gone"]


def test_a_model_description_is_kept_with_the_run(built: Callable[..., Path]) -> None:
    run = simulate(built("fourbar", "time"), stop=1.0)
    assert run.model_description.startswith("<?xml")
    assert run.info["token"] in run.model_description
