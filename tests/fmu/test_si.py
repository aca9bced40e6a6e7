"""FMUs in SI units: lengths in m, shown in the unit of the file."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from fmpy.validation import validate_fmu
from lxml import etree

import kinfmu
from kinfmu.cli import main
from kinfmu.fmu import build, simulate, verify
from kinfmu.mechanism import gallery, toml_file, toml_text
from kinfmu.mechanism.gallery.load import folder
from kinfmu.units import METRES
from tests.gallery_members import mostly_long

PRESS = """
name = "small_press"
units.length = "mm"
[parameters]
arm = 40
rod = "4.5 inch"
shift = "arm/4 + 2.5"
weight = "2 N"
[bodies]
ground.points = { O = [0, 0], S = ["shift", -3] }
crank = { points = { O = [0, 0], P = ["arm", 0], E = ["2*arm + 5", "1 mm"] }, start = { phi = "60°" }, mass = 0.2 }
rod = { points = { P = [0, 0], R = ["rod", 0] }, start = { phi = "-20°" }, mass = "3*weight/(9.81 m/s2)" }
ram = { points = { R = [0, 0] }, start = { x = 120, y = 12.5, phi = 0 }, mass = 1 }
[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "rod.P"] }
R = { type = "revolute", between = ["rod.R", "ram.R"] }
guide = { type = "translational", between = ["ground.S", "ram.R"] }
[drivers.ram]
type = "coordinate"
of = "ram.R"
axis = "x"
law = "polynomial"
coefficients = ["3*arm", 15]
[loads]
spring = { type = "spring", between = ["ground.S", "ram.R"], stiffness = "3 N/mm", free_length = "rod - 10 mm" }
push = { type = "force_along", at = "ram.R", law = "external" }
[gravity]
x = 0
y = "-9.81 m/s2"
[points]
end = "crank.E"
[run]
stop = 1.0
step = 0.05
"""


@pytest.fixture(scope="module")
def press() -> kinfmu.Mechanism:
    return toml_file.parse(PRESS, "press.toml")


def assert_same_in_metres(found: kinfmu.Run, wanted: kinfmu.Run, metre: float, tolerance: float) -> None:
    """Compare every column, a length in m with one in the unit of length; errors relative to the largest number."""
    assert found.length_unit == "m"
    ours, theirs = list(found.columns()), list(wanted.columns())
    assert [one.name for one in ours] == [one.name for one in theirs]
    sizes: dict[str, float] = {}
    for other in theirs:
        if not _is_rounding(other.name):
            sizes[other.unit] = max(sizes.get(other.unit, 0.0), float(np.abs(other.values).max()))
    converted = 0
    for column, other in zip(ours, theirs, strict=True):
        base, _, per = other.unit.partition("/")
        is_length = base == wanted.length_unit
        assert column.unit == (f"m/{per}" if per else "m") if is_length else other.unit
        if not _is_rounding(other.name):
            factor = metre if is_length else 1.0
            limit = tolerance * factor * sizes[other.unit]
            assert np.abs(column.values - other.values * factor).max() <= limit, column.name
        converted += is_length
    assert converted >= 3


def _is_rounding(name: str) -> bool:
    return name.startswith(("solver.", "watch.")) or name == "message"


@pytest.mark.parametrize("name", mostly_long(name for name in gallery.names() if gallery.load(name).length_unit != "m"))
def test_a_mechanism_in_metres_moves_as_in_its_own_unit(name: str) -> None:
    mechanism = gallery.load(name)
    metric = mechanism.in_metres()
    assert toml_file.parse(toml_text.text(metric), "again.toml") == metric
    t = np.linspace(0.0, 0.1, 4)
    ours, theirs = kinfmu.solve(metric, t), kinfmu.solve(mechanism, t)
    assert_same_in_metres(ours, theirs, METRES[mechanism.length_unit], 1e-11)


def variables_of(fmu: Path) -> dict[str, etree._Element]:
    """The variables in modelDescription.xml by name, with the attributes of their type in both versions of FMI."""
    with zipfile.ZipFile(fmu) as archive:
        root = etree.fromstring(archive.read("modelDescription.xml"))
    found = {}
    for one in root.find("ModelVariables"):
        if len(one) and one.tag == "ScalarVariable":
            one.attrib.update(one[0].attrib)
        found[one.attrib["name"]] = one
    return found


@pytest.fixture(scope="module", params=[("python", 2), ("native", 2), ("native", 3)], ids=["python", "fmi2", "fmi3"])
def pair(request: pytest.FixtureRequest, press: kinfmu.Mechanism, tmp_path_factory: pytest.TempPathFactory):
    """The FMU of the press in SI units, and the one in mm, both driven by inputs."""
    flavour, fmi = request.param
    folder = tmp_path_factory.mktemp(f"si_{flavour}_{fmi}")
    return tuple(
        build(press, folder / f"{si}.fmu", flavour=flavour, fmi=fmi, drive="inputs", si=si) for si in (True, False)
    )


@pytest.mark.few(1)
def test_every_variable_is_in_si_units_and_shown_in_the_unit_of_the_file(pair: tuple[Path, Path]) -> None:
    metric, original = pair
    assert not validate_fmu(str(metric))
    ours, theirs = variables_of(metric), variables_of(original)
    assert list(ours) == list(theirs)
    lengths = 0
    for name, one in ours.items():
        unit, other = one.get("unit", "1"), theirs[name].get("unit", "1")
        base, slash, per = other.partition("/")
        is_length = base == "mm"
        assert unit == (f"m{slash}{per}" if is_length else other)
        assert one.get("displayUnit") == (other if is_length else theirs[name].get("displayUnit"))
        assert one.get("valueReference") == theirs[name].get("valueReference")
        for key in ("start", "min", "max", "nominal"):
            assert (key in one.attrib) == (key in theirs[name].attrib) or key == "nominal", (name, key)
            if is_length and key != "nominal" and key in one.attrib:
                assert float(one.get(key)) == pytest.approx(float(theirs[name].get(key)) * 1e-3, rel=1e-12)
        lengths += is_length
    assert lengths > 20
    assert {name: ours[name].get("start") for name in ("arm", "rod", "ram_position")} == {
        "arm": "0.04",
        "rod": "0.1143",
        "ram_position": "0.12",
    }
    shown = {unit.name: unit for unit in fmpy.read_model_description(str(metric)).unitDefinitions}
    assert ("mm/s", 1000.0) in [(one.name, one.factor) for one in shown["m/s"].displayUnits]


@pytest.mark.few(1)
def test_inputs_parameters_and_results_are_in_si_units(pair: tuple[Path, Path]) -> None:
    metric, original = pair
    t = np.linspace(0.0, 0.3, 7)
    columns = {"ram_position": 120.0 + 20.0 * t, "ram_speed": 20.0 + 0.0 * t, "push_force": 5.0 * t}
    in_metres = {name: values * (1.0 if name == "push_force" else 1e-3) for name, values in columns.items()}
    settings = {"arm": "42 mm", "rates": "wired"}
    given = {"stop": 0.3, "step": 0.05, "parameters": settings}
    ours = simulate(metric, inputs={"time": t, **in_metres}, **given)
    theirs = simulate(original, inputs={"time": t, **columns}, **given)
    assert ours.good.all()
    assert_same_in_metres(ours, theirs, 1e-3, 1e-11)
    assert ours["ram.x"][-1] == pytest.approx(0.126)
    assert np.abs(ours["ram.force"] - theirs["ram.force"]).max() < 1e-9
    assert ours.length_unit == "m"
    assert verify(metric).ok


def test_results_in_millimetres_are_verified_by_column_titles(pair: tuple[Path, Path], tmp_path: Path) -> None:
    metric, _ = pair
    with zipfile.ZipFile(metric) as archive:
        header, *rows = archive.read("extra/org.kinfmu/small_press_ref.csv").decode().splitlines()
    place = header.split(",").index("ram.x")
    lines = ["time,ram.x [mm]"]
    lines += [f"{row.split(',')[0]},{float(row.split(',')[place]) * 1e3!r}" for row in rows]
    (tmp_path / "host.csv").write_text("\n".join(lines) + "\n")
    assert verify(metric, tmp_path / "host.csv", columns=["ram.x"]).ok


def test_the_record_of_a_run_states_metres(pair: tuple[Path, Path], tmp_path: Path) -> None:
    run = simulate(pair[0], stop=0.1, step=0.05)
    kinfmu.log.write_mcap(run, tmp_path / "run.mcap")
    again = kinfmu.log.read(tmp_path / "run.mcap")
    assert (again.length_unit, again["ram.x"][0]) == ("m", 0.12)
    assert {column.unit for column in again.columns()} >= {"m", "m/s", "m/s2"}


def test_efforts_drive_in_si_units(press: kinfmu.Mechanism, tmp_path: Path) -> None:
    both = [
        simulate(
            build(press, tmp_path / f"{si}.fmu", flavour="python", drive="torque", si=si),
            stop=0.05,
            step=0.01,
            inputs={"time": np.array([0.0, 1.0]), "ram_force": np.array([3.0, 3.0]), "push_force": np.zeros(2)},
        )
        for si in (True, False)
    ]
    assert_same_in_metres(*both, 1e-3, 1e-7)  # two integrations, within their tolerance of 1e-9 a step


def test_a_mechanism_in_metres_is_the_same_fmu_with_si(tmp_path: Path) -> None:
    mechanism = gallery.load("fourbar")
    files = [build(mechanism, tmp_path / f"{si}.fmu", flavour="python", si=si).read_bytes() for si in (True, False)]
    assert files[0] == files[1]


def test_parameters_whose_unit_is_unknown_are_named(tmp_path: Path) -> None:
    leg = tmp_path / "leg.toml"
    text = (folder() / "jansen_leg" / "mechanism.toml").read_text("utf-8")
    leg.write_text(re.sub(r'^([dehi]) = "(.*) mm"$', r"\1 = \2", text, flags=re.MULTILINE), "utf-8")
    result = CliRunner().invoke(
        main, ["build", str(leg), "--si", "--flavour", "python", "--no-page", "-o", str(tmp_path / "leg.fmu")]
    )
    assert result.exit_code == 0
    assert result.stderr.splitlines() == [
        "kinfmu: note: d, e, h, i: without a unit, so these parameters stay numbers in mm; give them one in the file: "
        'd = "40.1 mm"'
    ]
