"""kinfmu export --cam: profiles of cams as files, and messages about wrong options."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from kinfmu.cli import main
from kinfmu.mechanism.toml_text import text as toml_text
from tests.motion.cams import followers


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
        (("--cam", "pitch", "-o", "a.gif"), "a.gif: the profile of a cam is written as .csv, .dxf, .svg, .png, .pdf"),
        (("--cam", "pitch", "-o", "a.svg", "--units"), "--units: only for .csv, not .svg"),
        (
            ("--cam", "pitch", "-o", "a.svg", "--degrees"),
            "--degrees: of a cam only for .csv, not .svg; its figure has angles in deg",
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
