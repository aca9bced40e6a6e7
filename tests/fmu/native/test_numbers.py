"""Native FMUs equal the Python engine, for the whole gallery, in fmpy's loops and in kinfmu's."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import FmuError
from kinfmu.mechanism import gallery
from kinfmu.solver.python.pose import Status
from tests.fmu.conftest import Build
from tests.fmu.test_parameters import OTHERS, linkage
from tests.gallery_members import mostly_long


@pytest.mark.parametrize(
    "name", mostly_long(gallery.names(), few=("excavator", "fourbar", "jansen_leg", "triple_rocker"))
)
@pytest.mark.few(1)
def test_run_of_a_gallery_mechanism_equals_that_of_the_python_engine(built_native: Build, name: str) -> None:
    wanted = kinfmu.solve(kinfmu.load(name))
    run = kinfmu.simulate(built_native(name, 2 + len(name) % 2, "time"))  # half of them of FMI 3.0
    assert run.outputs == wanted.outputs
    assert run.coordinate_count == wanted.coordinate_count
    assert run.fixed == pytest.approx(wanted.fixed, abs=1e-15)
    np.testing.assert_allclose(run.t, wanted.t, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(run.status, wanted.status)
    size = max(1.0, np.nanmax(np.abs(wanted.values)))
    np.testing.assert_allclose(run.values, wanted.values, rtol=0, atol=1e-12 * size)
    for got, exact, error in ((run.rates, wanted.rates, 1), (run.accelerations, wanted.accelerations, 2)):
        within = run.error[:, error] + wanted.error[:, error]
        gap = np.abs(got - exact).max(axis=1)
        assert (gap <= np.maximum(within * size, 1e-12 * size)).all()
    np.testing.assert_allclose(run.margin, wanted.margin, rtol=1e-6, atol=1e-9)


def test_limit_ends_a_run_as_it_does_with_the_python_flavour(built_native: Build, fmi: int) -> None:
    run = kinfmu.simulate(built_native("double_pendulum", fmi, "time"), stop=9.0, step=0.1)
    assert run.status[-1] == Status.OUTSIDE
    assert np.isnan(run.values[-1]).all()
    assert run.t[-1] == pytest.approx(2.1)
    assert np.degrees(run.inputs[-1, 0]) == pytest.approx(363.0)
    assert "360 deg" in run.events[-1].text


def test_parameters_and_inputs_reach_the_fmu(built_native: Build, fmi: int) -> None:
    fmu = built_native(linkage(), fmi, "time")
    run = kinfmu.simulate(fmu, parameters=OTHERS)
    wanted = kinfmu.solve(linkage(OTHERS))
    np.testing.assert_allclose(run.values, wanted.values, rtol=0, atol=1e-12)
    run = kinfmu.simulate(fmu, stop=1.0, step=0.5, inputs={"time": [0.0, 1.0], "crank_angle": [1.0, 1.6]})
    assert run["crank.phi"] == pytest.approx([1.0, 1.3, 1.6])
    with pytest.raises(FmuError, match=r"^parameters coupler = 9: the mechanism does not close"):
        kinfmu.simulate(fmu, parameters={"coupler": 9.0})


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_fmpy_simulates_it(built_native: Build, fmi: int, kind: str) -> None:
    from fmpy import simulate_fmu

    names = ["coupler.x", "coupler.phi", "rocker.omega"]
    fmu = built_native(linkage(), fmi, "time")
    rows = simulate_fmu(str(fmu), fmi_type=kind, start_time=0.0, stop_time=3.0, output_interval=0.25, output=names)
    run = kinfmu.solve(linkage(), rows["time"])
    for name in names:
        np.testing.assert_allclose(rows[name], run[name], rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_fmpy_ends_past_a_limit_and_its_recorder_holds_the_rows(
    built_native: Build, fmi: int, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    from fmpy import simulate_fmu

    page = (Path(__file__).parents[3] / "docs" / "host-fmpy.md").read_text(encoding="utf-8")
    (block,) = (block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "step_finished" in block)
    options: dict[str, Any] = {
        "fmi_type": kind,
        "start_time": 0.0,
        "stop_time": 3.0,
        "output_interval": 0.5,
        "output": ["lower.phi"],
    }
    call = f"simulate_fmu({str(built_native('double_pendulum', fmi, 'time'))!r}, **options, "
    names: dict[str, Any] = {"simulate_fmu": simulate_fmu, "options": options}
    exec(compile(block.replace('simulate_fmu("fourbar.fmu", ', call), "host-fmpy.md", "exec"), names)  # noqa: S102  our page
    assert names["kept"]
    times = names["rows"]["time"].tolist()  # an event, such as a new status at the limit, is recorded twice
    assert times == [0.0, 0.5, 1.0, 1.5, 2.0, *([2.0] if kind == "ModelExchange" else [])]
    message = "at t = 2.5 s: crank = 6.544985 rad (375 deg) cannot be reached: the limit is crank = 6.2831853072 rad"
    assert message in capfd.readouterr().out


def test_fmpy_ends_silently_past_a_limit_of_a_python_fmu_before_the_stop_time(built: Build) -> None:
    from fmpy import simulate_fmu

    path, names = str(built("double_pendulum", "time")), ["solver.ok", "upper.phi"]
    rows = simulate_fmu(path, start_time=0.0, stop_time=3.0, output_interval=0.5, output=names)
    assert rows["time"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 2.0]
    assert rows["solver.ok"].tolist() == 5 * [True] + [False]
    assert rows["upper.phi"][-1] == rows["upper.phi"][-2]
