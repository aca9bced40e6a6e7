"""`kinfmu export`: figures, animations and profiles of cams."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import kinfmu
from kinfmu.cli import main
from kinfmu.draw import animation
from kinfmu.errors import RequestError
from kinfmu.log import read, write_mcap
from kinfmu.mechanism.toml_text import text as toml_text
from tests.cli.conftest import Command, read_csv
from tests.log.runs import fourbar
from tests.log.sheets import read_xlsx
from tests.motion.cams import followers


@pytest.fixture
def record(tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    write_mcap(fourbar(np.arange(181.0)), path)
    return path


def test_a_record_is_exported_as_csv(record: Path, command: Command, tmp_path: Path) -> None:
    result = command("export", record, "-o", "run.csv")
    assert result.exit_code == 0
    assert result.stdout == "written: run.csv\n"
    table = read_csv(tmp_path / "run.csv")
    np.testing.assert_array_equal(table["coupler.x"], read(record)["coupler.x"])
    assert list(table) == [column.name for column in read(record).columns()]


def test_values_of_parameters_are_for_mechanisms_only(record: Path, refuses: Callable[..., str]) -> None:
    message = refuses("export", record, "-o", "run.csv", "--set", "crank.speed=30rpm")
    assert message.startswith("--set crank.speed: only for mechanisms; ")
    assert message.endswith(" has the values of its run: use solve --set or simulate --set")


def test_parquet_holds_the_units(record: Path, command: Command, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    assert command("export", record, "-o", "run.parquet").exit_code == 0
    schema = parquet.read_schema(tmp_path / "run.parquet")
    assert schema.field("coupler.vx").metadata == {b"unit": b"m/s"}


def test_plots_and_moving_pictures_are_made_of_a_record(
    record: Path, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "MOST", 3)
    assert command("export", record, "-o", "run.svg", "--columns", "coupler.x,rocker.phi").exit_code == 0
    text = (tmp_path / "run.svg").read_text(encoding="utf-8")
    assert "rocker.φ" in text
    assert "coupler.y" not in text
    assert command("export", record, "-o", "run.gif").exit_code == 0
    assert (tmp_path / "run.gif").read_bytes().startswith(b"GIF89a")


def test_columns_of_a_table_are_chosen_as_channels_are(record: Path, command: Command, tmp_path: Path) -> None:
    def header(columns: str) -> list[str]:
        assert command("export", record, "-o", "run.csv", "--columns", columns).exit_code == 0
        return list(read_csv(tmp_path / "run.csv"))

    assert header("rocker.phi,coupler.x") == ["time", "coupler.x", "rocker.phi", "solver.status"]
    assert header("crank.*") == ["time", "crank.phi", "crank.omega", "crank.alpha", "solver.status"]
    assert header("q") == ["time", *read(record).names, "solver.status"]
    every = [column.name for column in read(record).columns()]
    assert header("-error") == [name for name in every if not name.startswith("solver.error")]


def test_coordinates_of_a_plot_are_chosen_as_columns_of_a_table_are(
    record: Path, command: Command, tmp_path: Path
) -> None:
    assert command("export", record, "-o", "run.svg", "--columns", "coupler.*,rocker.phi").exit_code == 0
    words = re.findall(r">([\w.]+)</text>", (tmp_path / "run.svg").read_text(encoding="utf-8"))
    assert [word for word in words if word[:1].isalpha() and "." in word] == [
        "coupler.x",
        "coupler.y",
        "coupler.φ",
        "rocker.φ",
    ]


def test_chosen_columns_go_into_every_table_with_their_units(record: Path, command: Command, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    for name in ("run.npz", "run.parquet"):
        assert command("export", record, "-o", name, "--columns", "coupler.vx").exit_code == 0
    with np.load(tmp_path / "run.npz") as file:
        assert file["kinfmu.columns"].tolist() == ["time", "coupler.vx", "solver.status"]
        assert file["kinfmu.units"].tolist() == ["s", "m/s", "1"]
        np.testing.assert_array_equal(file["coupler.vx"], read(record)["coupler.vx"])
    table = parquet.read_table(tmp_path / "run.parquet")
    assert table.column_names == ["time", "coupler.vx", "solver.status"]


def test_a_column_that_is_not_there_is_reported(record: Path, refuses: Callable[..., str], tmp_path: Path) -> None:
    message = refuses("export", record, "-o", "run.csv", "--columns", "q,cupler.x")
    expected = "channel 'cupler.x' is not known; did you mean 'coupler.x'?; channels: all, none, inputs, q"
    assert message.startswith(expected)
    assert not (tmp_path / "run.csv").exists()
    message = refuses("export", record, "-o", "run.gif", "--columns", "coupler.x")
    assert (
        message
        == "--columns coupler.x: only for tables and plots, .csv, .xlsx, .parquet, .npz, .svg, .png, .pdf, not .gif"
    )
    message = refuses("export", record, "-o", "run.svg", "--columns", "cupler.x")
    expected = "the run has no coordinate 'cupler.x'; did you mean 'coupler.x'?; coordinates: crank.phi, "
    assert message.startswith(expected)


def test_a_coordinate_that_joints_hold_is_no_column(command: Command, refuses: Callable[..., str]) -> None:
    """The piston slides along x; plots draw its y as a line, over which other columns may be plotted."""
    held = "channel 'piston.y' is not a column: the joints hold it at 0 mm"
    assert command("solve", "slider_crank", "-o", "run.mcap").exit_code == 0
    assert refuses("export", "run.mcap", "-o", "run.csv", "--columns", "piston.y") == held
    assert command("export", "run.mcap", "-o", "run.svg", "--columns", "piston.x", "--x", "piston.y").exit_code == 0
    assert refuses("simulate", "slider_crank", "--channels", "q,-piston.y") == held
    message = refuses("solve", "slider_crank", "-o", "run.csv", "--outputs", "piston.y")
    assert "outputs: 'piston.y' is not one: the joints hold it constant; outputs: crank.phi" in message


@pytest.mark.long
def test_animations_have_the_width_that_is_asked_for(
    record: Path,
    command: Command,
    refuses: Callable[..., str],
    fails: Callable[..., str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    image = pytest.importorskip("PIL.Image")
    monkeypatch.setattr(animation, "MOST", 3)
    for width in (100, 333, 1280):
        assert command("export", record, "-o", "run.gif", "--width", str(width)).exit_code == 0
        with image.open(tmp_path / "run.gif") as picture:
            assert picture.size[0] == width
            assert picture.n_frames == 4
    assert "--width 99: must be 100 to 1920 pixels" in refuses("export", record, "-o", "run.gif", "--width", "99")
    assert "--width 0: must be 100 to" in refuses("export", record, "-o", "run.html", "--width", "0")
    assert "--width 1921: must be" in refuses("export", record, "-o", "run.mp4", "--width", "1921")
    assert "'wide' is not a valid integer" in refuses("export", record, "-o", "run.gif", "--width", "wide")
    message = refuses("export", record, "-o", "run.svg", "--width", "800")
    assert "--width 800: only for animations, .gif, .mp4, not .svg" in message
    assert "a page has no other options than --set" in refuses("export", "fourbar", "-o", "run.html", "--width", "800")
    tall = tmp_path / "tall.mcap"
    write_mcap(kinfmu.solve(kinfmu.load("engine"), np.linspace(0.0, 0.01, 11)), tall)
    message = fails("export", tall, "-o", "run.gif", "--width", "1900")
    (most,) = re.findall(r"pictures of 1900 x \d+ pixels are too large; the width can be (\d+) at most", message)
    assert command("export", tall, "-o", "run.gif", "--width", most).exit_code == 0
    with image.open(tmp_path / "run.gif") as picture:
        assert 1915 <= picture.size[1] <= 1920


def test_a_part_of_a_run_is_exported(
    record: Path, command: Command, tmp_path: Path, refuses: Callable[..., str]
) -> None:
    assert command("export", record, "-o", "run.csv", "--start", "30", "--stop", "60s").exit_code == 0
    assert read_csv(tmp_path / "run.csv")["time"].tolist() == list(range(30, 61))
    assert command("export", record, "-o", "run.csv", "--start", "175").exit_code == 0
    assert read_csv(tmp_path / "run.csv")["time"].tolist() == list(range(175, 181))
    message = refuses("export", record, "-o", "run.csv", "--start", "181")
    assert "the run has no samples from 181 s on; its samples: t = 0 to 180 s" in message
    assert "no samples up to -1 s; its" in refuses("export", record, "-o", "run.csv", "--stop", "-1")
    message = refuses("export", record, "-o", "run.csv", "--start", "0.2", "--stop", "0.4")
    assert "no samples from 0.2 to 0.4 s; its" in message


def test_a_table_is_printed_and_its_names_have_units(
    record: Path, command: Command, refuses: Callable[..., str]
) -> None:
    assert command("export", record, "-o", "run.csv", "--columns", "coupler.v*", "--units").exit_code == 0
    written = Path("run.csv").read_text(encoding="utf-8")
    assert written.splitlines()[0] == "time [s],coupler.vx [m/s],coupler.vy [m/s],solver.status [1]"
    printed = command("export", record, "-o", "-", "--columns", "coupler.v*", "--units")
    assert (printed.exit_code, printed.stdout, printed.stderr) == (0, written, "")
    assert command("export", record, "-o", "run.npz", "--units").exit_code == 0  # such tables always hold them
    message = refuses("export", record, "-o", "run.svg", "--units")
    assert message == "--units: only for tables, .csv, .xlsx, .parquet, .npz, not .svg"
    assert "channel 'cupler.x' is not known" in refuses("export", record, "-o", "-", "--columns", "cupler.x")


def test_a_column_is_plotted_over_another(record: Path, command: Command, refuses: Callable[..., str]) -> None:
    over = ("--x", "coupler.x", "--columns", "coupler.y")
    assert command("export", record, record, "-o", "run.svg", *over).exit_code == 0
    text = Path("run.svg").read_text(encoding="utf-8")
    assert ">coupler.x [m]<" in text
    assert "run (wide), run (narrow)<" in text
    assert command("export", record, "-o", "run.pdf", "--overlay", "--degrees", "--columns", "*.phi").exit_code == 0
    assert Path("run.pdf").read_bytes().startswith(b"%PDF")
    message = refuses("export", record, "-o", "run.csv", "--x", "coupler.x", "--polar")
    assert message == "--x, --polar: only for plots, .svg, .png, .pdf, not .csv"
    message = refuses("export", record, record, "-o", "run.gif")
    assert message == "a second run: only for plots, .svg, .png, .pdf, not .gif"


def test_displacement_velocity_acceleration_and_jerk_are_plotted(command: Command, refuses: Callable[..., str]) -> None:
    assert command("solve", "crank_rocker", "-o", "run.mcap", "--angle", "0deg:360deg:37").exit_code == 0
    assert command("export", "run.mcap", "-o", "run.svg", "--svaj", "rocker.phi", "--degrees").exit_code == 0
    assert ">j [rad/rad³]<" in Path("run.svg").read_text(encoding="utf-8")
    message = refuses("export", "run.mcap", "-o", "run.svg", "--svaj", "rocker.phi", "--polar", "--columns", "q")
    assert message == "--svaj excludes --polar, --columns"
    message = refuses("export", "run.mcap", "-o", "run.gif", "--svaj", "rocker.phi")
    assert message == "--svaj: only for plots, .svg, .png, .pdf, not .gif; --svaj also for tables"
    message = refuses("export", "run.mcap", "-o", "run.gif", "--degrees")
    assert message == "--degrees: only for plots, .svg, .png, .pdf, not .gif; --degrees also for tables"


def test_displacement_velocity_acceleration_and_jerk_are_a_table(command: Command, refuses: Callable[..., str]) -> None:
    assert command("solve", "cam_roller", "-o", "run.mcap", "--times", "0:2:0.01").exit_code == 0
    export = ("export", "run.mcap", "--svaj", "lever.phi")
    printed = command(*export, "-o", "-", "--units").stdout.splitlines()
    names = "time [s],cam_angle [rad],position [rad],velocity [rad/s],acceleration [rad/s2],jerk [rad/s3],side [1]"
    assert printed[0] == names
    assert command(*export, "-o", "run.csv", "--units", "--degrees").stdout == "written: run.csv\n"
    header, *lines = Path("run.csv").read_text(encoding="utf-8").splitlines()
    assert header == names.replace("rad", "deg")
    table = np.array([[float(text) for text in line.split(",")] for line in lines])
    radians = np.array([[float(text) for text in line.split(",")] for line in printed[1:]])
    np.testing.assert_allclose(table[:, 1:6], np.degrees(radians[:, 1:6]), rtol=1e-14)
    run = kinfmu.log.read("run.mcap")
    samples = radians[radians[:, 6] == 0.0]
    for k, name in enumerate(("time", "cam_angle", "lever.phi", "lever.omega", "lever.alpha")):
        np.testing.assert_allclose(samples[:, k], run[name], rtol=1e-13, atol=1e-13)
    limits = radians[radians[:, 6] != 0.0]
    assert len(limits) >= 4
    np.testing.assert_array_equal(limits[:, 6], [-1.0, 1.0] * (len(limits) // 2))
    assert (np.abs(np.diff(limits[:, 5])[::2]) > 1.0).all()  # the jerk jumps
    assert command(*export, "-o", "run.npz").exit_code == 0
    with np.load("run.npz") as arrays:
        np.testing.assert_array_equal(arrays["jerk"], radians[:, 5])
        assert arrays["kinfmu.units"].tolist()[-2:] == ["rad/s3", "1"]
    parquet = pytest.importorskip("pyarrow.parquet")
    assert command(*export, "-o", "run.parquet", "--degrees").exit_code == 0
    read = parquet.read_table("run.parquet")
    assert read.schema.field("jerk").metadata == {b"unit": b"deg/s3"}
    np.testing.assert_array_equal(read.column("jerk").to_numpy(), table[:, 5])
    message = refuses(*export, "-o", "run.csv", "--columns", "q", "--polar")
    assert message == "--polar: only for plots, .svg, .png, .pdf, not .csv"
    assert refuses(*export, "-o", "run.csv", "--columns", "q") == "--svaj excludes --columns"


def test_a_pose_is_drawn_for_cad(record: Path, command: Command, refuses: Callable[..., str]) -> None:
    pytest.importorskip("ezdxf")
    assert command("export", record, "-o", "run.dxf", "--at", "45").stdout == "written: run.dxf\n"
    outside = command("export", record, "-o", "none.dxf", "--at", "4500")
    assert (outside.exit_code, outside.stderr.count("\n")) == (1, 1)
    assert "none.dxf: at t = 4500 s is outside the run, t = 0 to " in outside.stderr
    message = refuses("export", record, "-o", "run.csv", "--at", "45")
    assert message == "--at 45: only for .dxf, not .csv"
    assert "'noon' is not a number" in refuses("export", record, "-o", "run.dxf", "--at", "noon")


@pytest.mark.parametrize("suffix", [".csv", ".xlsx", ".parquet", ".npz"])
@pytest.mark.parametrize("way", ["export", "solve"])
@pytest.mark.few(2)
def test_tables_of_every_format_have_angles_in_degrees(way: str, suffix: str, command: Command) -> None:
    assert command("solve", "crank_rocker", "-o", "run.mcap").exit_code == 0
    run = kinfmu.log.read("run.mcap")
    source = ("export", "run.mcap") if way == "export" else ("solve", "crank_rocker")
    how = ("--lengths", "m") if suffix == ".xlsx" else ("--degrees", "--units", "--lengths", "m")
    result = command(*source, "-o", f"run{suffix}", *how)
    assert result.exit_code == 0, result.output
    if suffix == ".csv":
        with Path("run.csv").open(encoding="utf-8") as file:
            header, *rows = csv.reader(file)
        units = dict(re.fullmatch(r"(\S+) \[(.*)\]", name).groups() for name in header)  # type: ignore[union-attr]
        table = dict(zip(units, np.array(rows, dtype=float).T, strict=True))
    elif suffix == ".xlsx":
        sheet = read_xlsx(Path("run.xlsx"))
        units = dict(re.fullmatch(r"(\S+) \[(.*)\]", name).groups() for name in sheet)  # type: ignore[union-attr]
        table = dict(zip(units, sheet.values(), strict=True))
    elif suffix == ".npz":
        with np.load("run.npz") as arrays:
            units = dict(zip(arrays["kinfmu.columns"].tolist(), arrays["kinfmu.units"].tolist(), strict=True))
            table = {name: arrays[name] for name in units}
    else:
        read = pytest.importorskip("pyarrow.parquet").read_table("run.parquet")
        units = {field.name: field.metadata[b"unit"].decode() for field in read.schema}
        table = {name: read.column(name).to_numpy() for name in units}
    assert [column.name for column in run.columns()] == [*units]
    for name, unit, values in run.columns():
        is_angle = unit in ("rad", "rad/s", "rad/s2")
        is_length = unit in ("mm", "mm/s", "mm/s2")
        assert units[name] == (unit.replace("rad", "deg") if is_angle else unit.replace("mm", "m"))
        shown = np.degrees(values) if is_angle else 1e-3 * values if is_length else values
        np.testing.assert_allclose(table[name], shown, rtol=1e-14)


@pytest.mark.parametrize(("separator", "decimal"), [(";", ","), ("tab", ","), ("|", "."), (",", ".")])
@pytest.mark.parametrize("way", ["export", "print", "svaj", "cam", "solve"])
@pytest.mark.few(2)
def test_csv_files_have_the_separator_and_decimal_sign_of_spreadsheets(
    way: str, separator: str, decimal: str, command: Command
) -> None:
    assert command("solve", "cam_roller", "-o", "run.mcap").exit_code == 0
    given = {
        "export": ("export", "run.mcap", "-o", "run.csv"),
        "print": ("export", "run.mcap", "-o", "-"),
        "svaj": ("export", "run.mcap", "-o", "run.csv", "--svaj", "lever.phi"),
        "cam": ("export", "cam_roller", "-o", "run.csv", "--cam", "pitch"),
        "solve": ("solve", "cam_roller", "-o", "run.csv"),
    }[way]

    def lines(*more: str) -> list[str]:
        result = command(*given, "--units", *more)
        assert result.exit_code == 0, result.output
        return (result.stdout if way == "print" else Path("run.csv").read_text(encoding="utf-8")).splitlines()

    plain = [*csv.reader(lines())]
    sign = {"tab": "\t"}.get(separator, separator)
    written = [*csv.reader(lines("--separator", separator, "--decimal", decimal), delimiter=sign)]
    assert written[0] == plain[0]
    assert [[text.replace(decimal, ".") for text in row] for row in written[1:]] == plain[1:]
    assert any(decimal in text for text in written[1])


def test_forms_of_tables_that_do_not_fit_are_wrong_usage(record: Path, refuses: Callable[..., str]) -> None:
    same = "--decimal ',' needs another separator than the comma: --separator ';'"
    assert refuses("export", record, "-o", "run.csv", "--decimal", ",") == same
    assert refuses("solve", "fourbar", "-o", "run.csv", "--decimal", ",") == same
    message = refuses("solve", "fourbar", "-o", "run.npz", "--separator", ";")
    assert message == "--separator ';': only for .csv, not .npz"
    message = refuses("solve", "fourbar", "-o", "run.mcap", "--degrees")
    assert message == "--degrees: only for tables, .csv, .xlsx, .parquet, .npz; export writes those of a record"
    with pytest.raises(RequestError, match="must be two different characters"):
        kinfmu.log.write_table(kinfmu.log.read(record), "run.csv", decimal=",")


# ----------------------------------------------------------------------------------------------------------- export cam


def export(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["export", *arguments])


def test_the_dxf_of_a_cam_is_a_closed_polygon_within_the_tolerance(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    path = tmp_path / "cam.dxf"
    result = export("cam_roller", "--cam", "pitch", "-o", str(path), "--tolerance", "0.01 mm")
    assert result.exit_code == 0, result.output
    drawing = ezdxf.readfile(path)
    assert not drawing.audit().errors
    assert drawing.units == ezdxf.units.MM
    space = drawing.modelspace()
    (profile,), (pitch,) = (space.query(f'LWPOLYLINE[layer=="{layer}"]') for layer in ("PROFILE", "PITCH"))
    assert profile.closed
    assert pitch.closed
    corners, centres = (np.array(line.get_points("xy")) for line in (profile, pitch))
    np.testing.assert_allclose(np.hypot(*(corners - centres).T), 12.0, rtol=1e-12)
    angle = np.arctan2(centres[:, 1], centres[:, 0]) % (2.0 * math.pi)
    on_dwell = (angle > math.radians(121.0)) & (angle < math.radians(179.0))
    np.testing.assert_allclose(np.hypot(*corners[on_dwell].T), 48.0, rtol=1e-12)  # the dwell at 60, less the roller
    (base,), (axle,) = space.query("CIRCLE"), space.query("POINT")
    assert base.dxf.radius == pytest.approx(28.0, abs=1e-9)
    assert (base.dxf.layer, axle.dxf.layer) == ("BASE", "AXLE")
    assert tuple(base.dxf.center) == tuple(axle.dxf.location) == (0.0, 0.0, 0.0)
    assert f"({len(corners)} corners, within 0.01 mm of the curve)" in result.output


def test_the_table_of_a_cam_is_printed(tmp_path: Path) -> None:
    result = export("cam_roller", "--cam", "pitch", "-o", "-", "--units")
    lines = result.output.splitlines()
    assert lines[0].startswith("cam_angle [rad],x [mm],y [mm],pitch_x [mm]")
    assert len(lines) == 362
    assert export("cam_roller", "--cam", "pitch", "-o", str(tmp_path / "cam.csv")).exit_code == 0
    assert (tmp_path / "cam.csv").read_text(encoding="utf-8").startswith("cam_angle,x,y,")


def test_the_angles_of_the_table_of_a_cam_are_in_degrees_on_request(tmp_path: Path) -> None:
    tables = []
    for options in ((), ("--degrees",)):
        path = tmp_path / "cam.csv"
        assert export("cam_roller", "--cam", "pitch", "-o", str(path), "--units", *options).exit_code == 0
        header, *lines = path.read_text(encoding="utf-8").splitlines()
        tables.append((header.split(","), np.array([[float(text) for text in line.split(",")] for line in lines])))
    (names, radians), (shown, degrees) = tables
    angles = [k for k, name in enumerate(names) if name.endswith("[rad]")]
    assert [names[k].split()[0] for k in angles] == ["cam_angle", "follower", "pressure_angle"]
    assert shown == [name.replace("[rad]", "[deg]") for name in names]
    np.testing.assert_array_equal(degrees[:, 0], np.arange(361.0))
    np.testing.assert_allclose(degrees[:, angles], np.degrees(radians[:, angles]), atol=1e-11)
    lengths = [k for k in range(len(names)) if k not in angles]
    np.testing.assert_array_equal(degrees[:, lengths], radians[:, lengths])


def test_the_profile_of_a_cam_is_a_workbook_in_degrees_and_any_unit_of_length(tmp_path: Path) -> None:
    assert export("cam_roller", "--cam", "pitch", "-o", str(tmp_path / "cam.xlsx"), "--lengths", "cm").exit_code == 0
    table, profile = read_xlsx(tmp_path / "cam.xlsx"), kinfmu.analysis.cam_profile(kinfmu.load("cam_roller"), "pitch")
    np.testing.assert_array_equal(table["cam_angle [deg]"], np.arange(361.0))
    np.testing.assert_allclose(table["x [cm]"], 0.1 * profile.profile[:, 0], rtol=1e-14)


def test_the_profile_of_a_cam_takes_values_of_parameters(tmp_path: Path) -> None:
    text = toml_text(followers.lifted_roller(8.0)).replace("roller_radius = 8.0", 'roller_radius = "roller"')
    path = tmp_path / "tappet.toml"
    path.write_text(f'{text}\n[parameters]\nroller = "8 mm"\n', encoding="utf-8")
    tables = {}
    for radius in (8.0, 5.0):
        result = export(str(path), "--cam", "lift", "-o", "-", "--set", f"roller={radius}mm")
        assert result.exit_code == 0, result.output
        header, *lines = result.output.splitlines()
        columns = np.array([[float(one) for one in line.split(",")] for line in lines]).T
        table = dict(zip(header.split(","), columns, strict=True))
        tables[radius] = table
        np.testing.assert_allclose(
            np.hypot(table["x"] - table["pitch_x"], table["y"] - table["pitch_y"]), radius, rtol=1e-12
        )
    np.testing.assert_allclose(tables[5.0]["pitch_x"], tables[8.0]["pitch_x"], atol=1e-12)
    result = export(str(path), "--cam", "lift", "-o", "-", "--set", "rollr=5mm")
    assert result.exit_code == 2
    assert "--set: there is no parameter 'rollr'; did you mean 'roller'?" in result.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--cam", "pitsch", "-o", "a.csv"), "--cam: 'pitsch' is not a cam joint of cam_roller; did you mean 'pitch'?"),
        (
            ("--cam", "pitch", "-o", "a.gif"),
            "a.gif: the profile of a cam is written as .csv, .xlsx, .dxf, .svg, .png, .pdf",
        ),
        (("--cam", "pitch", "-o", "a.svg", "--units"), "--units: only for tables, .csv, .xlsx, not .svg"),
        (
            ("--cam", "pitch", "-o", "a.svg", "--degrees"),
            "--degrees: of a cam only for .csv, .xlsx, not .svg; its figure has angles in deg",
        ),
        (("--cam", "pitch", "-o", "a.csv", "--tolerance", "1mm"), "--tolerance 1mm: only for .dxf, not .csv"),
        (("--cam", "pitch", "-o", "a.dxf", "--tolerance", "0mm"), "--tolerance 0mm: must be a positive length"),
        (("--cam", "pitch", "-o", "a.svg", "--polar"), "--cam pitch excludes --polar"),
        (("--tolerance", "1mm", "-o", "a.html"), "--tolerance 1mm: only for the .dxf of a cam, with --cam"),
    ],
)
def test_wrong_options_of_a_cam_are_reported(
    arguments: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = export("cam_roller", *arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert not list(tmp_path.iterdir())
