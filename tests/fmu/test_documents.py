"""What people and hosts read in an FMU: page, icon, terminals, limits and quantities of variables."""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from click.testing import CliRunner

import kinfmu
from kinfmu.cli import main
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.scene import scene
from kinfmu.errors import RequestError
from kinfmu.fmu.documents import documents
from kinfmu.fmu.interface import Drive
from kinfmu.fmu.picture import picture
from kinfmu.fmu.variables import interface
from kinfmu.plan import compile_plan
from tests.fmu.conftest import Build
from tests.mechanism.loads.every_load import every_load, fourbar

Built = Callable[[str, Drive], Path]


def test_the_page_has_picture_law_range_wiring_and_check(built: Built) -> None:
    with zipfile.ZipFile(built("toggle_press", "time")) as zipped:
        text = zipped.read("documentation/index.html").decode()
        icon = zipped.read("model.png")
    _, tag, rest = text.partition("<svg")
    root = ET.fromstring(tag + rest.partition("</svg>")[0] + "</svg>")  # noqa: S314  # written by this test's FMU
    assert len(list(root)) > 20
    for words in (
        "constant_speed: start = 90 deg, speed = 60 rpm",  # as the file writes it
        "<td>crank.speed</td><td>parameter</td><td>rad/s</td><td>6.283185307179586 (60 rpm)</td>",
        "<td>unlimited; no change points</td>",
        "torque of crank = <code>crank.reduced_inertia</code> &middot; acceleration + <code>crank.bias_torque</code>",
        "kinfmu verify toggle_press.fmu --results host.csv",
        'href="licenses/license.txt"',
        "<td>crank_angle</td><td>input</td><td>rad</td>",
    ):
        assert words in text
    pixels = _pixels(icon)
    assert pixels.shape == (100, 100, 4)
    assert 0.02 < (pixels[:, :, 3] > 128).mean() < 0.5
    assert {tuple(one) for one in pixels.reshape(-1, 4)[:, :3].tolist()} >= {
        palette.lighter(palette.body(0))
    }  # the crank


def _pixels(data: bytes) -> np.ndarray:
    """The pixels of a PNG without filters; checks its checksums."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, found = 8, {}
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        chunk = data[at + 4 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(chunk)
        found[chunk[:4]] = chunk[4:]
        at += 12 + length
    width, height = struct.unpack(">II", found[b"IHDR"][:8])
    rows = np.frombuffer(zlib.decompress(found[b"IDAT"]), np.uint8).reshape(height, 1 + 4 * width)
    assert not rows[:, 0].any()
    return rows[:, 1:].reshape(height, width, 4)


@pytest.mark.parametrize("name", ["triple_rocker", "excavator", "cam_roller", "rack_steering", "double_pendulum"])
@pytest.mark.few(2)
def test_documents_are_the_same_again_and_valid(name: str) -> None:
    plan = compile_plan(kinfmu.load(name))
    variables = interface(plan, has_time=True)
    made = documents(plan, 3).files(variables)
    assert made == documents(compile_plan(kinfmu.load(name)), 3).files(variables)
    assert {"terminalsAndIcons/icon.png", "terminalsAndIcons/icon.svg"} <= set(made)
    root = ET.fromstring(made["terminalsAndIcons/terminalsAndIcons.xml"])  # noqa: S314  # written here
    assert [one.get("name") for one in root.iter("Terminal")] == [driver.name for driver in plan.drivers]
    names = {variable.name for variable in variables}
    assert {one.get("variableName") for one in root.iter("TerminalMemberVariable")} <= names


def test_terminals_hold_the_port_of_a_drive(built_native: Build) -> None:
    with zipfile.ZipFile(built_native("toggle_press", 3)) as zipped:
        root = ET.fromstring(zipped.read("terminalsAndIcons/terminalsAndIcons.xml"))  # noqa: S314  # our own
        description = ET.fromstring(zipped.read("modelDescription.xml"))  # noqa: S314  # our own
    members = {one.get("memberName"): one.get("variableName") for one in root.iter("TerminalMemberVariable")}
    assert members["acceleration"] == "crank_acceleration"
    assert members["bias_torque"] == "crank.bias_torque"
    assert members["reduced_inertia"] == "crank.reduced_inertia"
    quantities = {one.get("name"): one.get("quantity") for one in description.iter("Float64")}
    assert quantities["crank_speed"] == "AngularVelocity"
    assert quantities["ram.vy"] == "Velocity"
    assert quantities["crank.reduced_inertia"] == "MomentOfInertia"
    assert not any(quantity for name, quantity in quantities.items() if name.startswith("solver."))


def test_limits_of_the_only_driver_are_those_of_check() -> None:
    mechanism = kinfmu.load("triple_rocker")
    plan = compile_plan(mechanism)
    reach = kinfmu.check(mechanism).range
    assert reach is not None
    assert reach.low is not None
    inputs = interface(plan, reach=documents(plan, 2).reach).part("inputs")
    assert reach.high is not None
    limits = [(one.minimum, one.maximum) for one in inputs]
    assert limits == [pytest.approx((reach.low, reach.high), abs=1e-11), (None, None), (None, None)]
    for value in limits[0]:  # both are reached
        values: Any = {inputs[0].name: [inputs[0].start, value]}
        assert kinfmu.solve(mechanism, **values).status.tolist() == [0, 1]
    text = documents(plan, 2).files(interface(plan))["documentation/index.html"].decode()
    assert f"up to {np.degrees(reach.high):.8g} deg (dead centre)" in text


def test_metadata_are_stated_on_request(tmp_path: Path) -> None:
    from fmpy import read_model_description

    given = {"author": "A. & B.", "version": "2.1", "license": "CC0", "copyright": "(c) us"}
    options = [text for name, value in given.items() for text in (f"--{_OPTIONS.get(name, name)}", value)]
    command = ["build", "double_pendulum", "--flavour", "python", "-o", str(tmp_path / "stated.fmu"), *options]
    done = CliRunner().invoke(main, [*command, "--date", "2026-05-01T12:00:00+02:00"])
    assert done.exit_code == 0, done.output
    about = read_model_description(str(tmp_path / "stated.fmu"), validate=True)
    assert {name: getattr(about, name) for name in given} == given
    assert about.generationDateAndTime == "2026-05-01T10:00:00Z"
    with zipfile.ZipFile(tmp_path / "stated.fmu") as zipped:
        text = zipped.read("documentation/index.html").decode()
    assert "<p>Author: A. &amp; B.</p>" in text
    plain = kinfmu.build(kinfmu.load("double_pendulum"), tmp_path / "plain.fmu", flavour="python")
    assert read_model_description(str(plain)).guid == about.guid
    assert read_model_description(str(plain)).generationDateAndTime is None


_OPTIONS = {"version": "model-version"}


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({"autor": "me"}, "metadata: 'autor' is not known; did you mean 'author'"),
        ({"author": " "}, "author = ' ' must be one line of text"),
        ({"date": "yesterday"}, "date = 'yesterday' must be a date such as 2026-05-01"),
    ],
)
def test_invalid_metadata_have_one_line(metadata: dict[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match=message):
        kinfmu.build(kinfmu.load("double_pendulum"), tmp_path, flavour="python", metadata=metadata)


def test_the_picture_of_an_fmu_shows_loads() -> None:
    run = kinfmu.solve(every_load(), [0.0, 0.1])
    drawn = picture(run)
    assert drawn is not None
    violet = [line for line in drawn.lines if line.colours[0] == palette.LOAD]
    strips = [shape.strips for shape in scene(run, every_load()).shapes if shape.is_load]
    assert len(violet) == sum(map(len, strips)) > 20
    bare = picture(kinfmu.solve(fourbar(), [0.0, 0.1]))
    assert bare is not None
    assert not [line for line in bare.lines if line.colours[0] == palette.LOAD]
