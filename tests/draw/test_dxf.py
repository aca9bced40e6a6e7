"""DXF drawings and MP4 videos: what they hold, and what is refused."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import kinfmu
import kinfmu.mechanism.gallery
from kinfmu.draw import animate, animation, dxf
from kinfmu.draw.animation import encoder, mp4
from kinfmu.errors import FigureError, MissingPackageError
from kinfmu.mechanism.toml_file import parse
from kinfmu.run.axis import axis_of
from tests.log.runs import fourbar


def test_a_pose_is_drawn_in_layers_with_its_true_dimensions(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    mechanism = kinfmu.load("cam_roller")
    run = kinfmu.solve(mechanism, cam_angle=np.radians(np.arange(0.0, 361.0)))
    for name in ("a.dxf", "b.dxf"):
        dxf(run, tmp_path / name, at=100.2)
    assert (tmp_path / "a.dxf").read_bytes() == (tmp_path / "b.dxf").read_bytes()
    drawing = ezdxf.readfile(tmp_path / "a.dxf")
    assert not drawing.audit().errors
    assert drawing.units == ezdxf.units.MM
    space = drawing.modelspace()
    profile, pitch = [line for line in space.query("LWPOLYLINE") if line.dxf.layer == "cam"]
    corners = np.array(pitch.get_points("xy"))
    inside = np.array(profile.get_points("xy"))
    (law,) = [joint.law for joint in mechanism.joints if joint.name == "pitch"]
    angle = np.radians(np.arange(360.0))
    radii = np.array([law.at(one) for one in angle])
    turned = angle + np.radians(100.2)
    np.testing.assert_allclose(corners, radii[:, None] * np.column_stack([np.cos(turned), np.sin(turned)]), atol=1e-9)
    assert pitch.closed
    points = {tuple(np.round([*one.dxf.location.vec2], 9)) for one in space.query("POINT") if one.dxf.layer == "lever"}
    there = kinfmu.solve(mechanism, cam_angle=np.radians([0.0, 100.0, 100.2]))
    assert points == {(90.0, 0.0), tuple(np.round([there["roller.x"][2], there["roller.y"][2]], 9))}
    (roller,) = space.query("CIRCLE")
    assert roller.dxf.radius == 12.0
    np.testing.assert_allclose(np.hypot(*(inside - corners).T), 12.0, rtol=1e-12)
    gaps = np.hypot(*(inside - np.array([*roller.dxf.center.vec2])).T) - 12.0
    assert abs(gaps.min()) < 4e-3  # the profile has a corner at each degree


def crank_angle_drawn(path: Path) -> float:
    """Return the angle [deg] of the crank of a four-bar in a drawing, from the points of the crank."""
    ezdxf = pytest.importorskip("ezdxf")
    points = ezdxf.readfile(path).modelspace().query("POINT")
    ends = sorted(
        (np.array([*one.dxf.location.vec2]) for one in points if one.dxf.layer == "crank"), key=np.linalg.norm
    )
    return float(np.degrees(np.arctan2(*(ends[-1] - ends[0])[::-1])) % 360.0)


@pytest.mark.parametrize("kind", ["driver", "backwards", "law", "inputs"])
def test_a_pose_between_samples_is_solved(kind: str, tmp_path: Path) -> None:
    mechanism, t = kinfmu.load("crank_rocker"), np.linspace(0.0, 1.0, 21)
    if kind in ("driver", "backwards"):
        angles = np.radians(np.linspace(0.0, 360.0, 37))
        run, at, wanted = kinfmu.solve(mechanism, crank_angle=angles[:: 1 if kind == "driver" else -1]), 15.0, 15.0
    elif kind == "law":
        run, at = kinfmu.solve(mechanism, t), 0.513
        wanted = np.degrees(float(mechanism.drivers[0].law.at(at))) % 360.0
    else:
        u = 0.3 + t**4
        run = kinfmu.solve(mechanism, crank_angle=u, crank_speed=4.0 * t**3, crank_acceleration=12.0 * t**2)
        run, at = run.replaced(t=t, axis="time"), 0.525
        wanted = np.degrees(0.3 + at**4)
    dxf(run, tmp_path / "a.dxf", at=at)
    assert crank_angle_drawn(tmp_path / "a.dxf") == pytest.approx(wanted, abs=1e-5 if kind == "inputs" else 1e-9)
    dxf(run, tmp_path / "b.dxf", at=float(axis_of(run).values[7]))
    wanted = np.degrees(run["crank.phi"][7]) % 360.0
    assert crank_angle_drawn(tmp_path / "b.dxf") == pytest.approx(wanted, abs=1e-9)


def test_a_pose_that_the_run_does_not_have_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    run = kinfmu.solve(kinfmu.load("crank_rocker"), crank_angle=np.radians(np.linspace(0.0, 360.0, 37)))
    for at in (400.0, -50.0):
        with pytest.raises(
            FigureError, match=rf"a\.dxf: at crank = {at:g} deg is outside the run, crank = 0 to 360 deg$"
        ):
            dxf(run, tmp_path / "a.dxf", at=at)
    with pytest.raises(FigureError, match=r"at sample = 1\.5 is between two samples, .* cannot be solved .*: 1 and 2$"):
        dxf(run.replaced(axis="sample", t=np.arange(37.0)), tmp_path / "a.dxf", at=1.5)
    status = np.array(run.status)
    status[3] = 3
    with pytest.raises(FigureError, match=r"a\.dxf: the run has no numbers at crank = 25 deg$"):
        dxf(run.replaced(status=status), tmp_path / "a.dxf", at=25.0)
    assert not (tmp_path / "a.dxf").exists()


def with_loads(name: str) -> tuple[kinfmu.Mechanism, kinfmu.Mechanism]:
    """A mechanism of the gallery with its loads, gravity and a spring, and without them."""
    loaded = kinfmu.load(name)
    ends = [f"{body.name}.{[*body.points][-1]}" for body in (loaded.bodies[0], loaded.bodies[-1])]
    spring = kinfmu.Spring("back", (ends[0], ends[1]), 100.0, 0.1)
    assert loaded.loads
    assert loaded.gravity is not None
    bare = replace(loaded, loads=(), gravity=None)
    return replace(loaded, loads=(*loaded.loads, spring)), bare


def test_loads_springs_and_gravity_are_left_out(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    for name, mechanism in zip(("loaded", "bare"), with_loads("excavator_loaded"), strict=True):
        dxf(kinfmu.solve(mechanism, [0.0, 0.1]), tmp_path / f"{name}.dxf", at=0.1)
    assert (tmp_path / "loaded.dxf").read_bytes() == (tmp_path / "bare.dxf").read_bytes()


def test_drawings_and_videos_that_cannot_be_made_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = fourbar(np.arange(5.0))
    with pytest.raises(FigureError, match=r"a\.dwg: '\.dwg' is not a known format of CAD drawings; known: \.dxf"):
        dxf(run, tmp_path / "a.dwg")
    with pytest.raises(FigureError, match=r"a\.dxf: the run has no sample with numbers to draw"):
        dxf(run.part(slice(0, 0)), tmp_path / "a.dxf")
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MissingPackageError, match=r"a\.dxf: a DXF file needs ezdxf: pip install 'kinfmu\[dxf\]'"):
        dxf(run, tmp_path / "a.dxf")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        MissingPackageError,
        match=r"a\.mp4: .* ffmpeg, which is not found; install it \(Debian, Ubuntu: apt-get install ffmpeg\), or",
    ):
        animate(run, tmp_path / "a.mp4")
    broken = tmp_path / "ffmpeg"
    broken.write_text("#!/bin/sh\necho no encoder >&2\nexit 1\n", encoding="utf-8")
    broken.chmod(0o755)
    monkeypatch.setattr(animation, "MOST", 2)
    with pytest.raises(FigureError, match=r"a\.mp4: ffmpeg failed: no encoder$"):
        animate(run, tmp_path / "a.mp4")


def test_a_video_holds_every_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        ffmpeg = encoder(tmp_path)
    except MissingPackageError:
        pytest.skip("ffmpeg is not installed; scripts/video installs it")
    drawn: list[Image.Image] = []

    def keep(images: Sequence[Image.Image], seconds: float, path: Path) -> bytes:
        drawn.extend(images)
        return mp4(images, seconds, path)

    monkeypatch.setattr(animation, "MOST", 6)
    monkeypatch.setattr(animation, "mp4", keep)
    animate(fourbar(np.arange(0.0, 91.0)), tmp_path / "a.mp4")
    data = (tmp_path / "a.mp4").read_bytes()
    assert data[4:8] == b"ftyp"
    assert data.index(b"moov") < data.index(b"mdat")  # players begin before the whole file is there
    assert b"avc1" in data
    subprocess.run([ffmpeg, "-v", "error", "-i", tmp_path / "a.mp4", tmp_path / "%d.png"], check=True)
    assert len(list(tmp_path.glob("*.png"))) == len(drawn) == 7
    for k, image in enumerate(drawn, start=1):
        with Image.open(tmp_path / f"{k}.png") as shown:
            seen = np.asarray(shown.convert("RGB"), float)[: image.height, : image.width]
        own, others = (np.abs(seen - np.asarray(one, float)).mean() for one in (image, drawn[k % len(drawn)]))
        assert own < 2.0  # of 255; the format is lossy
        assert others > 2.0 * own


CROSSING = """
name = "bars"
[bodies]
ground.points = { O = [0, 0] }
lever.points = { O = [0, 0], A = [2, 0], B = [4, 0], C = [2, 0], D = [1, 0] }
plate.points = { B = [0, 0], E = [3, 0], F = [3, 2], G = [1, 0], H = [0, 0] }
slider.points = { S = [0, 0] }
[joints]
O = { type = "revolute", between = ["ground.O", "lever.O"] }
B = { type = "revolute", between = ["lever.B", "plate.B"] }
S = { type = "translational", between = ["lever.O", "slider.S"] }
[drivers]
lever = { type = "angle", of = "lever", law = "constant_speed" }
plate = { type = "angle", of = "plate", law = "constant_speed" }
slider = { type = "distance", between = ["lever.B", "slider.S"], law = "constant_speed", start = 1.5, speed = 0.1 }
"""


@pytest.mark.parametrize("name", ["bars", *kinfmu.mechanism.gallery.names()])
@pytest.mark.few(4)
def test_no_line_has_length_0_and_none_is_drawn_twice(name: str, tmp_path: Path) -> None:
    """Sides of one layer that lie on one line overlap nowhere; together they are those of the shapes."""
    ezdxf = pytest.importorskip("ezdxf")
    mechanism = parse(CROSSING) if name == "bars" else kinfmu.load(name)
    dxf(kinfmu.solve(mechanism), tmp_path / "a.dxf")
    space = ezdxf.readfile(tmp_path / "a.dxf").modelspace()
    sides: dict[str, list[np.ndarray]] = {}
    for line in space.query("LWPOLYLINE"):
        corners = np.array(line.get_points("xy"))
        corners = np.concatenate([corners, corners[:1]]) if line.closed else corners
        sides.setdefault(line.dxf.layer, []).extend(np.stack([corners[:-1], corners[1:]], axis=1))
    circles = [(one.dxf.layer, *one.dxf.center.vec2, one.dxf.radius) for one in space.query("CIRCLE")]
    assert len(circles) == len(set(circles))
    for own in map(np.array, sides.values()):
        extent = np.ptp(own.reshape(-1, 2), axis=0).max()
        along = own[:, 1] - own[:, 0]
        lengths = np.hypot(*along.T)
        assert (lengths > 1e-9 * extent).all()
        for k, (begin, unit) in enumerate(zip(own[:, 0], along / lengths[:, None], strict=True)):
            others = own[k + 1 :] - begin
            off = np.abs(others[..., 0] * unit[1] - others[..., 1] * unit[0]).max(axis=1)
            low, high = np.sort(others @ unit, axis=1).T
            common = np.minimum(high, lengths[k]) - np.maximum(low, 0.0)
            assert not ((off < 1e-9 * extent) & (common > 1e-9 * extent)).any()
    if name == "bars":
        total = {layer: float(np.hypot(*np.diff(own, axis=1)[:, 0].T).sum()) for layer, own in sides.items()}
        assert total["lever"] == pytest.approx(4.0)
        assert total["plate"] == pytest.approx(3.0 + 2.0 + math.hypot(3.0, 2.0))
