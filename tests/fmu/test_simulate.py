"""`simulate`: a Run from an FMU alone, and runs that end early."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from kinfmu.errors import FmuError, RequestError
from kinfmu.fmu import simulate
from kinfmu.fmu.host.samples import Samples
from kinfmu.run import Run
from kinfmu.solver.python.pose import Status


def test_fourbar_equals_its_closed_form_at_every_sample(fourbar: Path) -> None:
    run = simulate(fourbar)
    phi, w = np.radians(run.t), np.radians(1.0)
    c, s, o = np.cos(phi), np.sin(phi), 0.0 * phi
    assert np.array_equal(run.t, np.arange(181.0))
    assert run.names == ("crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi")
    assert run.q == pytest.approx(np.column_stack([phi, 1 + c, s, o, phi]), abs=1e-12)
    assert run.qd == pytest.approx(np.column_stack([o + w, -s * w, c * w, o, o + w]), abs=1e-12)
    assert run.qdd == pytest.approx(np.column_stack([o, -c * w * w, -s * w * w, o, o]), abs=1e-12)
    assert list(run.status[[0, -1]]) == [Status.BRIDGED, Status.BRIDGED]
    assert run.good.all()
    assert np.abs(run.watch).max() < 1e-12
    assert run.events == ()


def test_run_carries_the_mechanism_fixed_coordinates_driver_values_and_who_made_it(fourbar: Path) -> None:
    run = simulate(fourbar, start=10, stop=12, parameters={"crank.speed": 0.5})
    assert run.mechanism
    assert run.mechanism.name == "fourbar"
    assert run.fixed == {"crank.x": 0.0, "crank.y": 0.0, "rocker.x": 1.0, "rocker.y": 0.0}
    assert run.input_names == ("crank_angle", "crank_speed", "crank_acceleration")
    assert run.inputs == pytest.approx(np.array([[5.0, 0.5, 0.0], [5.5, 0.5, 0.0], [6.0, 0.5, 0.0]]))
    assert run.watch_names == ("AB.length",)
    assert run.info["name"] == "fourbar"
    assert run.info["parameters"] == "crank.speed = 0.5"
    assert run["A.x"] == pytest.approx(2 + np.cos(run["crank.phi"]))


def test_last_sample_is_at_stop_even_if_the_range_is_no_multiple_of_the_step(fourbar: Path) -> None:
    assert list(simulate(fourbar, stop=1.0, step=0.3).t) == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.0])
    assert simulate(fourbar, stop=0.7, step=0.1).t[-1] == 0.7
    assert len(simulate(fourbar, stop=0.7, step=0.1)) == 8
    assert len(simulate(fourbar, start=3.0, stop=3.0)) == 1


def test_progress_is_called_after_every_sample(fourbar: Path) -> None:
    calls: list[tuple[int, int]] = []
    simulate(fourbar, stop=3.0, progress=lambda done, total: calls.append((done, total)))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_law_past_the_limit_ends_the_run_with_a_sample_without_numbers_and_an_event(pendulum: Path) -> None:
    run = simulate(pendulum, stop=3.0, step=0.1)
    assert run.t[-1] == pytest.approx(2.1)
    assert run.status[-1] == Status.OUTSIDE
    assert run.good[:-1].all()
    assert np.isnan(run.values[-1]).all()
    assert np.isnan(run.accelerations[-1]).all()
    assert np.degrees(run.inputs[-1, 0]) == pytest.approx(363.0)
    (event,) = run.events
    assert event.level == "error"
    assert event.t == run.t[-1]
    assert event.text.startswith("at t = 2.1 s: crank = 6.33")
    assert "360 deg" in event.text


@pytest.mark.parametrize("stop", [0.7, 1.0])  # the sample that fails is the last one, or not
def test_inputs_past_the_limit_end_the_run_at_the_first_sample_beyond_it(pendulum: Path, stop: float) -> None:
    run = simulate(pendulum, stop=stop, step=0.1, inputs={"time": [0.0, 1.0], "crank_angle": [5.0, 7.0]})
    assert run.t[-1] == pytest.approx(0.7)
    assert run.status[-1] == Status.OUTSIDE
    assert run.inputs[-1, 0] == pytest.approx(6.4)
    (event,) = run.events
    assert event.t == run.t[-1]
    assert "360 deg" in event.text


def test_csv_inputs_are_exact_at_rows_and_linear_between_them(fourbar: Path, tmp_path: Path) -> None:
    table = tmp_path / "crank.csv"
    table.write_text("time, crank_angle, crank_speed\n0, 0.1, 2\n\n1, 0.7, 3\n3, 1.5, 4\n")
    run = simulate(fourbar, stop=3.0, step=0.5, inputs=table)
    assert run["crank.phi"] == pytest.approx([0.1, 0.4, 0.7, 0.9, 1.1, 1.3, 1.5])
    assert run["crank.phi"][2] == 0.7
    assert run["crank.omega"] == pytest.approx([2.0, 2.5, 3.0, 3.25, 3.5, 3.75, 4.0])
    assert "driven_by_time = False" in run.info["parameters"]


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_columns_of_a_csv_may_name_their_units(fourbar: Path, tmp_path: Path, delimiter: str) -> None:
    table = tmp_path / "crank.csv"
    rows = (("time [ms]", "crank_angle [deg]", "crank_speed [rpm]"), ("0", "45", "30"), ("500", "135", "60"))
    table.write_text("\n".join(delimiter.join(row) for row in rows))
    run = simulate(fourbar, stop=0.5, step=0.25, inputs=table)
    assert run["crank.phi"] == pytest.approx(np.array([0.25, 0.5, 0.75]) * np.pi)
    assert run["crank.omega"] == pytest.approx(np.array([1.0, 1.5, 2.0]) * np.pi)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,crank_angel\n0,1\n", r"'crank_angel' is not an input of this FMU; did you mean 'crank_angle'\?"),
        ("crank_angle\n0\n", "the column 'time' is missing"),
        (
            "time,crank_angle (deg)\n0,1\n",
            r"'crank_angle \(deg\)' is not an input .*; did you mean 'crank_angle \[deg\]'\?",
        ),
        ("time crank_angle\n0 1\n", "is not an input of this FMU; separate columns by commas, semicolons or tabs"),
        (
            "0,1\n1,2\n",
            "'0' is not an input of this FMU; the first line must name the columns; columns: time, crank_angle",
        ),
        ("tine,crank_angle\n0,1\n", r"'tine' is not an input of this FMU; did you mean 'time'\?"),
        ("time;crank_angle\n0;1,5\n", "line 2: crank_angle = '1,5' is not a number; decimals are written with a point"),
        ("time\n0\n", "the only column is 'time'; inputs: crank_angle, crank_speed, crank_acceleration"),
        ("time,time,crank_angle\n0,0,0\n", "column 'time' occurs twice"),
        ("time,crank_angle\n0,1\n1,1\n1,2\n", "line 4: time = 1 s does not lie after 1 s; time must increase"),
        ("time,crank_angle\n0,1\n5,nan\n", "line 3: crank_angle = nan is not a finite number"),
        ("time,crank_angle\n0,1\n5,x\n", "line 3: crank_angle = 'x' is not a number"),
        ("time,crank_angle\n0,1\n5\n", "line 3: 1 values, the header names 2 columns"),
        ("time,crank_angle\n", "holds no samples"),
        ("time,crank_angle [mm]\n0,1\n5,1\n", r"unit 'mm' of crank_angle must be one of rad, deg, rev"),
        ("time [deg],crank_angle\n0,1\n5,1\n", r"unit 'deg' of time must be one of s, ms, min, h"),
        ("", "is empty; its first line must name the columns: time, crank_angle"),
        ("\udcff", "is not a text file"),
    ],
)
def test_faults_of_a_csv_are_named_with_file_and_line(fourbar: Path, tmp_path: Path, text: str, words: str) -> None:
    table = tmp_path / "in.csv"
    table.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(FmuError, match=words) as caught:
        simulate(fourbar, stop=3.0, inputs=table)
    assert "in.csv" in str(caught.value)


def test_parameters_may_carry_their_units(fourbar: Path) -> None:
    run = simulate(fourbar, stop=0.5, step=0.5, parameters={"crank.speed": "30 rpm", "crank.start": "45 deg"})
    assert run["crank.phi"] == pytest.approx(np.array([0.25, 0.75]) * np.pi)


def test_arrays_of_unequal_length_are_refused(fourbar: Path) -> None:
    with pytest.raises(FmuError, match=r"'crank_angle' has shape \(3,\), 'time' has 2 values"):
        simulate(fourbar, inputs={"time": [0.0, 180.0], "crank_angle": [0.0, 1.0, 2.0]})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"parameters": {"crank.sped": 1.0}}, "there is no parameter 'crank.sped'; did you mean 'crank.speed'"),
        ({"parameters": {"crank.speed": float("nan")}}, "crank.speed = nan must be a finite number"),
        ({"parameters": {"crank.speed": "2 m"}}, r"four.*\.fmu: crank\.speed = '2 m': unit 'm' must be one of rad/s"),
        (
            {"parameters": {"crank.speed": "2*a"}},
            r"crank\.speed = '2\*a' must be a number, alone or with a unit: rad/s",
        ),
        ({"parameters": {"driven_by_time": 2}}, "driven_by_time = 2 must be true or false"),
        ({"parameters": {"solver.tolerance": -1.0}}, "solver.tolerance = -1.0 must be a positive number$"),
        ({"parameters": {"solver.tolerance": 2.0}}, "solver.tolerance = 2 must be at least 1e-15, at most 1$"),
        ({"step": 0.0}, "a positive step"),
        ({"start": 9.0, "stop": 1.0}, "start <= stop"),
        ({"inputs": "nowhere.csv"}, r"nowhere\.csv: cannot be read"),
        ({"wrap": True}, "wrap unwraps angles among the inputs, and no inputs are given"),
        (
            {"inputs": {"time": [0.0, 2.0], "crank_angle": [1.0, 2.0]}, "stop": 3.0},
            "inputs: holds 0 to 2 s, the run goes from 0 to 3 s; choose start and stop within the rows",
        ),
        (
            {"inputs": {"time": [1.0, 2.0], "crank_angle": [1.0, 2.0]}, "start": 0.0},
            "inputs: holds 1 to 2 s, the run goes from 0 to 2 s; choose start and stop within the rows",
        ),
    ],
)
def test_faults_of_a_call_are_named(fourbar: Path, arguments: dict[str, object], words: str) -> None:
    with pytest.raises(RequestError, match=words):
        simulate(fourbar, **arguments)  # type: ignore[arg-type]


def test_files_that_are_not_fmus_are_refused(tmp_path: Path) -> None:
    text, empty = tmp_path / "text.fmu", tmp_path / "empty.fmu"
    text.write_text("no archive")
    with zipfile.ZipFile(empty, "w") as zipped:
        zipped.writestr("readme.txt", "")
    with pytest.raises(FmuError, match="not a zip archive"):
        simulate(text)
    with pytest.raises(FmuError, match=r"modelDescription\.xml is missing"):
        simulate(empty)
    with pytest.raises(FmuError, match="No such file"):
        simulate(tmp_path / "missing.fmu")


def test_nothing_is_left_in_temporary_folder_or_path_or_terminal(
    pendulum: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "kept"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    before = list(sys.path)
    simulate(pendulum, stop=3.0)
    with pytest.raises(RequestError, match="holds"):
        simulate(pendulum, stop=1.0, inputs={"time": [0.0], "crank_angle": [5.0]})
    assert list(folder.iterdir()) == []
    assert sys.path == before
    assert capfd.readouterr() == ("", "")


HOSTILE = ("a b", "a%20b", "a%b", "a%zz", "a#b", "ä", "日本", "a'b", "a;b", "a&b", "a+b", "[a]", "~", "a" * 200)
IN_FOLDERS = """
import sys, tempfile
from pathlib import Path
from kinfmu import KinfmuError, simulate
for name in sys.argv[2:]:
    tempfile.tempdir = str(Path(name).absolute())
    try:
        print(name, simulate(sys.argv[1], stop=0.1, step=0.1).status.tolist(), list(Path(name).iterdir()))
    except KinfmuError as error:
        print(name, error)
"""
THROUGH_FMPY = """
import os, sys
from fmpy import extract, simulate_fmu
for name in sys.argv[2:]:
    folder = extract(sys.argv[1], unzipdir=os.path.abspath(name))
    rows = simulate_fmu(folder, stop_time=0.1, output_interval=0.1, output=["solver.ok"])
    print(name, rows["solver.ok"].tolist())
"""


@pytest.mark.parametrize("flavour", ["python", "native 2", "native 3"])
@pytest.mark.parametrize("program", [IN_FOLDERS, THROUGH_FMPY], ids=["kinfmu", "fmpy"])
@pytest.mark.few(3)
def test_fmus_load_below_folders_with_any_name(
    program: str, flavour: str, fmu_of: Callable[..., Path], tmp_path: Path
) -> None:
    """In a process of its own, since pythonfmu's library crashes where it finds no file."""
    kind, _, fmi = flavour.partition(" ")
    names = HOSTILE
    if flavour == "python" and program == THROUGH_FMPY:  # it unquotes blanks only, and URIs quote all the others
        names = ("a b", "~", "a" * 200)
    for name in names:
        (tmp_path / name).mkdir()
    path = fmu_of("double_pendulum", kind, int(fmi or 2))
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2]), "PYTHONIOENCODING": "utf-8"}
    command = [sys.executable, "-c", program, str(path), *names]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    lines = dict(zip(names, done.stdout.decode().splitlines(), strict=True))
    if flavour == "python" and "a%20b" in names:
        assert "a%20b' as a blank; let TMPDIR be another folder" in lines.pop("a%20b")
    result = "[0, 0] []" if program == IN_FOLDERS else "[True, True]"
    assert [line for name, line in lines.items() if line != f"{name} {result}"] == []


def test_fmu_driven_by_inputs_stays_at_its_start_without_inputs_and_warns(built: Callable[..., Path]) -> None:
    run = simulate(built("double_pendulum", "inputs"), stop=0.3, step=0.1)
    assert run["upper.phi"] == pytest.approx(np.full(4, np.radians(300.0)))
    assert run["upper.omega"] == pytest.approx(np.zeros(4))
    assert [event.level for event in run.events] == ["warning"]
    assert run.events[0].text == (
        "no inputs are given: crank_angle stays at 5.23599 rad; "
        "to set them, give a CSV file with the columns time, crank_angle (--input)"
    )


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt, also where the tests run in the background, where it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_ends_the_run_and_keeps_its_samples(fourbar: Path) -> None:
    def press(done: int, _count: int) -> None:
        if done == 20:
            signal.raise_signal(signal.SIGINT)

    run = simulate(fourbar, progress=press)
    assert len(run) == 20
    assert run.good.all()
    assert run.events[-1].text == "at t = 20 s: interrupted; the run ends here"
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)  # afterwards Ctrl-C does what it did before


class Watching:
    """A sink that notes what it is given, and does something when it begins."""

    def __init__(self, at_begin: Callable[[], None] = lambda: None) -> None:
        self.at_begin, self.calls = at_begin, list[str]()

    def begin(self, _run: Run) -> None:
        self.calls.append("begin")
        self.at_begin()

    def add(self, run: Run) -> None:
        self.calls.append(f"{len(run)} samples")

    def end(self, _run: Run, _reason: str) -> None:
        self.calls.append("end")


def test_ctrl_c_before_the_first_sample_is_raised_and_the_sink_is_not_called(
    fourbar: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Samples, "read_fixed", lambda *_: signal.raise_signal(signal.SIGINT))
    sink = Watching()
    with pytest.raises(KeyboardInterrupt):
        simulate(fourbar, sink=sink)
    assert sink.calls == []


def test_a_run_that_has_begun_holds_a_sample_whenever_ctrl_c_comes(fourbar: Path) -> None:
    sink = Watching(lambda: signal.raise_signal(signal.SIGINT))
    run = simulate(fourbar, sink=sink)
    assert run.t.tolist() == [0.0]
    assert run.events[-1].text == "at t = 1 s: interrupted; the run ends here"
    assert sink.calls == ["begin", "1 samples", "end"]


def test_fmpys_own_loop_ends_past_a_limit_with_the_last_good_pose(pendulum: Path) -> None:
    from fmpy import simulate_fmu

    names = ["lower.phi", "solver.status"]
    rows = simulate_fmu(str(pendulum), start_time=0.0, stop_time=3.0, output_interval=0.5, output=names)
    assert rows["time"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 2.0]
    assert rows["solver.status"].tolist() == [0, 0, 0, 0, 1, 3]
    assert rows["lower.phi"][-1] == rows["lower.phi"][-2]


def test_errors_without_an_estimate_are_infinite_in_the_run_and_finite_in_the_fmu(built: Callable[..., Path]) -> None:
    run = simulate(
        built("fourbar", "inputs"), stop=0.5, step=0.1, inputs={"time": [0.0, 1.0], "crank_angle": [0.1, 0.6]}
    )
    assert np.isinf(run.error[:2, 1:]).all()
    assert np.isfinite(run.error[:, 0]).all()
    assert (run.error[3:] < 1e-3).all()
