"""FMUs of other tools, and systems of several that an SSP connects, stepped and recorded as one run."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.draw.scene.completed import component_runs
from kinfmu.draw.scene.forces import arrows
from kinfmu.draw.scene.scene import drawable
from kinfmu.errors import FmuError, KinfmuError, RequestError
from kinfmu.fmu.host.slaves import LoadedSlave
from kinfmu.log import LiveView, McapLog, read, write_mcap, write_rrd
from kinfmu.log.viewer.card import card
from kinfmu.units import SignalName
from tests.fmu.test_drive_example import HOSTS, STOP, example, fmus  # noqa: F401  # fixtures

Ssp = Callable[..., Path]


@pytest.fixture
def ssp(fmus: Mapping[str, Path], tmp_path: Path) -> Ssp:  # noqa: F811
    """`ssp((old, new), ...)`: the SSP of the example with another structure."""

    def write(*changes: tuple[str, str]) -> Path:
        path = tmp_path / "other.ssp"
        with zipfile.ZipFile(fmus["press_drive"]) as before, zipfile.ZipFile(path, "w") as after:
            for name in before.namelist():
                data = before.read(name)
                if name == "SystemStructure.ssd":
                    text = data.decode()
                    for old, new in changes:
                        assert old in text
                        text = text.replace(old, new)
                    data = text.encode()
                after.writestr(name, data)
        return path

    return write


def test_the_ordered_exchange_is_the_loop_of_the_example(fmus: Mapping[str, Path], example) -> None:  # noqa: F811
    run = kinfmu.simulate(fmus["press_drive"], stop=STOP, step=1e-3)
    rows = example.coupled(fmus, "port", 1.1, 1e-3, STOP)
    np.testing.assert_allclose(np.column_stack([run["motor.angle"], run["motor.speed"]]), rows, rtol=1e-12)
    np.testing.assert_array_equal(run["crank.phi"], run["motor.angle"])  # nothing is a step late
    np.testing.assert_array_equal(run["crank.alpha"], run["motor.acceleration"])
    torque = run["crank.torque"] + 1.1 * run["motor.acceleration"]
    np.testing.assert_allclose(run["motor.torque"], torque, rtol=1e-10)
    assert run.info["title"] == "DC motor and toggle press, coupled by bias torque and reduced inertia"
    assert run.mechanism is not None
    assert not run.events


def test_a_system_reads_only_the_chosen_channels(fmus: Mapping[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: F811
    asked: list[str] = []
    reader = LoadedSlave.row_reader
    monkeypatch.setattr(
        LoadedSlave, "row_reader", lambda one, names, rows: asked.extend(names) or reader(one, names, rows)
    )
    run = kinfmu.simulate(fmus["press_drive"], stop=0.1, step=0.01, channels=["ram.y", "motor.speed"])
    assert [place.name for place in run.places()] == ["time", "ram.y", "motor.speed", "solver.status"]
    assert asked == ["ram.y"]
    whole = kinfmu.simulate(fmus["press_drive"], stop=0.1, step=0.01)
    for name in ("ram.y", "motor.speed"):
        np.testing.assert_array_equal(run[name], whole[name])


def test_the_jacobi_exchange_has_the_numbers_of_another_host(fmus: Mapping[str, Path], tmp_path: Path) -> None:  # noqa: F811
    from tests.fmu.test_drive_example import PYTHON, subprocess

    if subprocess.run([PYTHON, "-c", "import libcosimpy"], capture_output=True).returncode:
        pytest.skip("libcosimpy is not installed")
    command = [PYTHON, "-c", HOSTS["libcosimpy"], str(fmus["press_drive"]), "0.002", "200"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=120)
    rows = np.array([line.split()[1:] for line in done.stdout.splitlines() if line.startswith("row ")], float)
    run = kinfmu.simulate(fmus["press_drive"], stop=0.4, step=2e-3, exchange="jacobi")
    wanted = np.column_stack([run["motor.angle"], run["motor.speed"]])[1:]
    np.testing.assert_allclose(rows, wanted, rtol=1e-11)


def test_the_ecos_command_runs_the_ssp_with_the_same_numbers(fmus: Mapping[str, Path], tmp_path: Path) -> None:  # noqa: F811
    from tests.fmu.native.test_hosts import ecos_command, table_of_ecos

    if ecos_command() is None:
        pytest.skip("ecospy is not installed: no ecos command")
    header, lines = table_of_ecos(fmus["press_drive"], 0.4, 2e-3, tmp_path, "--parameterSet", "initialValues")
    names = [cell.strip() for cell in header]
    run = kinfmu.simulate(fmus["press_drive"], stop=0.398, step=2e-3, exchange="jacobi")
    assert [float(line[1]) for line in lines] == pytest.approx(run.t.tolist(), abs=1e-6)
    for theirs, ours in (
        ("motor::angle", "motor.angle"),
        ("motor::speed", "motor.speed"),
        ("press::ram.y", "ram.y"),
        ("press::crank.reduced_inertia", "crank.reduced_inertia"),
    ):
        column = [float(line[names.index(f"{theirs}[REAL]")]) for line in lines]
        np.testing.assert_allclose(column, run[ours], rtol=0, atol=6e-7)  # the command writes 6 decimals


def test_a_foreign_fmu_is_stepped_recorded_and_drawn(fmus: Mapping[str, Path], tmp_path: Path) -> None:  # noqa: F811
    path = tmp_path / "motor.mcap"
    given = {"time": [0.0, 0.1, 0.3], "voltage": [0.0, 640.0, 640.0]}
    run = kinfmu.simulate(
        fmus["dc_motor"], inputs=given, step=0.01, parameters={"inertia": "2 kg m2"}, sink=McapLog(path)
    )
    assert run.signal_names == ("angle", "speed", "acceleration", "torque", "current", "voltage")
    assert [name.unit for name in run.signal_names] == ["rad", "rad/s", "rad/s2", "N m", "A", "V"]
    np.testing.assert_allclose(run["voltage"], np.interp(run.t, given["time"], given["voltage"]))
    np.testing.assert_allclose(run["torque"], 80.0 * (run["voltage"] - 80.0 * run["speed"]) / 32.0, rtol=1e-12)
    np.testing.assert_allclose(run["acceleration"], run["torque"] / 2.0, rtol=1e-12)
    again = read(path)
    assert again.signal_names == run.signal_names
    assert [name.unit for name in again.signal_names] == [name.unit for name in run.signal_names]
    np.testing.assert_array_equal(again.signals, run.signals)
    write_rrd(again, tmp_path / "motor.rrd")
    kinfmu.draw.plot(again, tmp_path / "motor.svg", ["speed", "current"])
    drawn = (tmp_path / "motor.svg").read_text(encoding="utf-8")
    assert "current [A]" in drawn
    assert "acceleration" not in drawn
    thin = kinfmu.simulate(fmus["dc_motor"], stop=0.1, step=0.01, channels=["current"], rate=20)
    np.testing.assert_allclose(thin.t, [0.0, 0.05, 0.1])
    assert [place.name for place in thin.places()] == ["time", "current", "solver.status"]


def test_a_system_is_recorded_with_its_linkage(fmus: Mapping[str, Path], tmp_path: Path) -> None:  # noqa: F811
    path = tmp_path / "drive.mcap"
    run = kinfmu.simulate(fmus["press_drive"], stop=0.1, step=1e-3, sink=McapLog(path), rate=100)
    again = read(path)
    assert len(again) == 11
    for column, other in zip(run.columns(), again.columns(), strict=True):
        assert column[:2] == other[:2]
        np.testing.assert_array_equal(column.values, other.values)
    assert again.mechanism_text == run.mechanism_text
    assert again["motor.current"].any()
    write_rrd(again, tmp_path / "drive.rrd")
    kinfmu.draw.animate(again, tmp_path / "drive.gif")
    write_mcap(again, tmp_path / "copy.mcap")
    assert read(tmp_path / "copy.mcap").info == run.info


def test_an_input_of_the_system_and_units_of_connections(ssp: Ssp) -> None:
    supply = '<ssd:Connectors><ssd:Connector name="supply" kind="input"><ssc:Real unit="V"/></ssd:Connector>'
    path = ssp(
        ("<ssd:Elements>", f"{supply}</ssd:Connectors><ssd:Elements>"),
        (
            "<ssd:Connections>",
            '<ssd:Connections><ssd:Connection startConnector="supply" endElement="motor" endConnector="voltage"/>',
        ),
    )
    given = {"time": [0.0, 0.1], "supply": [100.0, 300.0]}
    run = kinfmu.simulate(path, inputs=given, step=0.01)
    np.testing.assert_allclose(run["supply"], np.interp(run.t, *given.values()))
    np.testing.assert_allclose(run["motor.current"], (run["supply"] - 80.0 * run["motor.speed"]) / 32.0, rtol=1e-12)


def test_an_algebraic_loop_is_named(ssp: Ssp) -> None:
    path = ssp(("crank.bias_torque", "crank.torque"), ("crank.reduced_inertia", "crank.power"), ("kg m2", "W"))
    with pytest.raises(FmuError, match=r"connection press\.crank\.power -> motor\.load_inertia: unit 'W' does not fit"):
        kinfmu.simulate(path)
    path = ssp(
        ("crank.bias_torque", "crank.torque"),
        (
            '<ssd:Connection startElement="press" startConnector="crank.reduced_inertia" endElement="motor" '
            'endConnector="load_inertia"/>',
            "",
        ),
    )
    run = kinfmu.simulate(path, stop=0.02, step=1e-3, parameters={"motor.inertia": 20.0})
    (event,) = run.events
    assert event.level == "warning"
    assert event.text.startswith("algebraic loop: ")
    assert "motor.acceleration -> press.crank_acceleration" in event.text
    assert "press.crank.torque -> motor.load_torque" in event.text


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            [('endConnector="crank_angle"', 'endConnector="crank_angel"')],
            "toggle_press.fmu has no variable 'crank_angel'",
        ),
        ([('startElement="motor" startConnector="angle"', 'startElement="moter" startConnector="angle"')], "'moter'"),
        (
            [('startConnector="angle"', 'startConnector="voltage"')],
            "motor.voltage is connected as output, but is of causality input",
        ),
        (
            [('endConnector="crank_angle"', 'endConnector="crank_speed"')],
            "connection motor.angle -> press.crank_speed: unit 'rad' does not fit 'rad/s'",
        ),
        (
            [
                ('endConnector="load_torque"', 'endConnector="load_inertia"'),
                ("crank.bias_torque", "crank.reduced_inertia"),
            ],
            "input motor.load_inertia has two sources; an input has one",
        ),
        ([("resources/dc_motor.fmu", "resources/ac_motor.fmu")], "the SSP holds no file 'resources/ac_motor.fmu'"),
        ([("resources/dc_motor.fmu", "../../etc/passwd")], "the SSP holds no file '../../etc/passwd'"),
        ([("<ssd:Connections>", "<ssd:Connexions>")], "SystemStructure.ssd is not valid"),
    ],
)
def test_faults_of_a_structure_have_one_line(ssp: Ssp, changes: list[tuple[str, str]], message: str) -> None:
    with pytest.raises(FmuError, match=re.escape(message)) as raised:
        kinfmu.simulate(ssp(*changes))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"parameters": {"motor.inertai": 1.0}},
            "'motor.inertai' is no parameter or input; did you mean 'motor.inertia'?",
        ),
        ({"parameters": {"motor.inertia": "1 kg"}}, "motor.inertia: unit 'kg' must be one of"),
        ({"parameters": {"motor.inertia": "heavy"}}, "motor.inertia = 'heavy' must be a number, such as '1 kg m2'"),
        ({"inputs": {"time": [0, 1], "motor.volt": [0, 1]}}, "'motor.volt' is not an input of this FMU"),
        ({"exchange": "both"}, "exchange = 'both' must be one of ordered, jacobi"),
        ({"parameters": {"motor.inertia": -1.0}}, "inertia must be positive"),
        ({"channels": ["motor.*", "motr.angle"]}, "channel 'motr.angle' is not known; did you mean 'motor.angle'?"),
        ({"wrap": True}, "wrap is for FMUs of kinfmu"),
    ],
)
def test_invalid_settings_of_a_system(fmus: Mapping[str, Path], settings: dict[str, object], message: str) -> None:  # noqa: F811
    with pytest.raises(KinfmuError, match=re.escape(message)):
        kinfmu.simulate(fmus["press_drive"], **settings)


def test_a_failing_fmu_ends_the_run_with_its_message(fmus: Mapping[str, Path]) -> None:  # noqa: F811
    given = {"time": [0.0, 0.1, 0.2], "load_inertia": [1.0, 1.0, -1.0]}
    run = kinfmu.simulate(fmus["dc_motor"], inputs=given, step=0.01)
    assert 0.1 < run.t[-1] < 0.16
    assert any("load_inertia must not be negative" in event.text for event in run.events if event.level == "error")


def test_what_is_no_system_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.ssp"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("other.txt", "")
    with pytest.raises(FmuError, match=r"no\.ssp: is no SSP \(SystemStructure\.ssd is missing\)"):
        kinfmu.simulate(path)
    with pytest.raises(RequestError, match="exchange"):
        kinfmu.simulate(path, exchange="none")


def test_names_of_signals_have_owners() -> None:
    owners = {name: SignalName(name).owner for name in ("h", "motor.i", "der(x.y)", "motor.der(x)")}
    assert owners == {"h": "", "motor.i": "motor", "der(x.y)": "", "motor.der(x)": "motor"}


def test_each_mechanism_of_a_system_is_drawn_under_its_name(ssp: Ssp, tmp_path: Path) -> None:
    from tests.log.viewer.test_rerun_file import entities, verified

    rr = pytest.importorskip("rerun")
    inputs = ("crank_angle", "crank_speed", "crank_acceleration")
    connectors = "".join(f'<ssd:Connector name="{name}" kind="input"><ssc:Real/></ssd:Connector>' for name in inputs)
    second = (
        '<ssd:Component name="second press" type="application/x-fmu-sharedlibrary" '
        f'source="resources/toggle_press.fmu"><ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component>'
    )
    wires = "".join(
        f'<ssd:Connection startElement="motor" startConnector="{of}" endElement="second press" endConnector="{to}"/>'
        for of, to in zip(("angle", "speed", "acceleration"), inputs, strict=True)
    )
    path = ssp(("</ssd:Elements>", f"{second}</ssd:Elements>"), ("<ssd:Connections>", f"<ssd:Connections>{wires}"))
    record = tmp_path / "presses.mcap"
    run = kinfmu.simulate(path, stop=0.1, step=1e-3, sink=McapLog(record))
    for one in (run, read(record)):
        parts = component_runs(one)
        assert list(parts) == ["press", "second press"]
        second_run = parts["second press"]
        np.testing.assert_array_equal(second_run["ram.y"], one["ram.y"])  # the same press at the same crank
        assert second_run.fixed == one.fixed
        assert second_run.good.all()
        first, second_arrows = (arrows(part, part.mechanism, drawable(part)[0]) for part in (one, second_run))
        assert set(first.along) == set(second_arrows.along)
        for name, along in first.along.items():  # the same forces, to the same scale
            np.testing.assert_allclose(second_arrows.along[name], along, rtol=1e-9, atol=1e-9)
        found, note = drawable(second_run)
        assert found is not None
        assert not note
    write_rrd(run, tmp_path / "presses.rrd")
    assert verified(tmp_path / "presses.rrd")
    drawn = entities(tmp_path / "presses.rrd")
    live = tmp_path / "live.rrd"
    stream = rr.RecordingStream("kinfmu_test", recording_id="presses")
    stream.save(live)
    view = LiveView(stream)
    view.begin(run.part(slice(0, 0)))
    view.add(run.part(slice(0, 40)))
    view.add(run.part(slice(40, len(run))))
    view.end(run, "")
    stream.disconnect()
    for name in ("press", "second\\ press"):
        parts_drawn = {f"/linkage/{name}/bodies/{body}" for body in ("crank", "ram")}
        parts_drawn |= {f"/linkage/{name}/forces/{kind}" for kind in ("joints/guide", "loads/work")}
        assert parts_drawn <= drawn
        assert parts_drawn <= entities(live)
    assert not any(entity.startswith("/linkage/bodies") for entity in drawn)
    assert "[bodies" not in card(run)
