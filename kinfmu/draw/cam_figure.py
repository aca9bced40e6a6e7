"""cam(): the profile of a cam as a figure or as a DXF drawing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.chart import SMALL, degree_ticks, dress
from kinfmu.draw.dxf_file import written_drawing
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.palette import DRIVER
from kinfmu.draw.sheet import GREY, INK, arc, ink, titled_figure
from kinfmu.draw.writing import SUFFIXES, check_suffix, write
from kinfmu.files import suffix_of
from kinfmu.mechanism.imports.dxf import imported_ezdxf
from kinfmu.motion.cams import CamProfile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DXF = ".dxf"
_FIGURE, _PLOT = 300.0, (270.0, 124.0)  # [pt]
_LEFT, _BOTTOM, _TOP, _GAP, _EDGE = 46.0, 36.0, 44.0, 62.0, 10.0  # [pt]
_LIMITS = {False: 30.0, True: 45.0}  # [deg] of the pressure angle, for sliding and swinging followers
_ARROW, _ROTATION = 0.5, 0.7  # radii of the arrows about the axle, of the base circle
_FLAT = 20.0  # of the largest distance from the axle; larger radii of curvature are not plotted


def cam(profile: CamProfile, path: str | Path) -> None:
    """Draw the profile of a cam into a figure (.svg, .png, .pdf) or a CAD drawing (.dxf).

    A figure shows profile, pitch curve, base circle and the roller or face at the first angle, with an arrow in the
    sense in which the angle of the cam grows. Of a geared cam a second arrow shows how it turns while the value of its
    driver grows. Next to them are pressure angle and radius of curvature over the cam's angle. A drawing has the closed
    polygons through the points of profile and pitch curve, the base circle and the axle as a point, on the layers
    PROFILE, PITCH, BASE and AXLE.

    Args:
        profile: The profile, from `kinfmu.cam_profile`; for a drawing with its argument `tolerance`.
        path: The file.

    Raises:
        FigureError: The suffix is unknown, or the file cannot be written.
        MissingPackageError: matplotlib, or for a drawing ezdxf, is not installed.

    """
    path = Path(str(path))
    check_suffix(path, (*SUFFIXES, _DXF), "cam profiles")
    if suffix_of(path) == _DXF:
        _write_drawing(profile, path)
    else:
        write(path, lambda: _figure(profile))


def _base_radius(profile: CamProfile) -> float:
    return float(np.hypot(*(profile.profile - profile.axle).T).min())


def _write_drawing(profile: CamProfile, path: Path) -> None:
    with written_drawing(imported_ezdxf(path), path, profile.length_unit) as drawing:
        space, axle = drawing.modelspace(), tuple(map(float, profile.axle))
        for layer, curve in (("PROFILE", profile.profile), ("PITCH", profile.pitch)):
            if curve is not None:
                drawing.layers.add(layer)
                space.add_lwpolyline(_open(curve).tolist(), close=True, dxfattribs={"layer": layer})
        for layer in ("BASE", "AXLE"):
            drawing.layers.add(layer)
        space.add_circle(axle, _base_radius(profile), dxfattribs={"layer": "BASE"})
        space.add_point(axle, dxfattribs={"layer": "AXLE"})


def _open(curve: FloatArray) -> FloatArray:
    """Return a closed curve without its last point if that is the first one."""
    apart = float(np.hypot(*(curve[-1] - curve[0])))
    return curve[:-1] if len(curve) > 1 and apart <= 1e-9 * float(np.abs(curve).max()) else curve


def _figure(profile: CamProfile) -> Figure:
    width = _LEFT + _FIGURE + _GAP + _PLOT[0] + _EDGE
    height = _TOP + _FIGURE + _BOTTOM
    element = "flat face" if profile.pitch is None else f"roller {profile.roller_radius:.4g} {profile.length_unit}"
    made = titled_figure(width, height, [f"{profile.cam}, {element}: joint {profile.joint}"], _EDGE)
    axes = made.add_axes((_LEFT / width, _BOTTOM / height, _FIGURE / width, _FIGURE / height))
    _outline(axes, profile)
    left = (_LEFT + _FIGURE + _GAP) / width
    across = np.degrees(profile.angle)
    for k in range(2):
        bottom = _BOTTOM + (1 - k) * (_FIGURE - _PLOT[1])
        plot = made.add_axes((left, bottom / height, _PLOT[0] / width, _PLOT[1] / height))
        (_pressure if k == 0 else _curvature)(plot, profile, across)
        degree_ticks(plot.xaxis, 9)
        plot.margins(x=0.01)
        plot.set_xlabel("angle of the cam [deg]", fontsize=SMALL, color=ink(GREY), labelpad=1.0)
    return made


def _outline(axes: Axes, profile: CamProfile) -> None:
    """Paint the cam in its own frame, with the roller or the face at the first angle."""
    colour = palette.BODIES[0]
    axes.fill(*profile.profile.T, facecolor=ink(palette.lighter(colour)), edgecolor=ink(palette.darker(colour)), lw=1.2)
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    axes.plot(*(profile.axle + _base_radius(profile) * circle).T, color=ink(GREY), lw=0.7, ls=":", label="base circle")
    axes.plot(*profile.axle, "+", color=ink(INK), ms=9.0)
    first = f"at {np.degrees(profile.angle[0]):.4g}\N{DEGREE SIGN}"
    if profile.pitch is not None:
        axes.plot(*profile.pitch.T, color=ink(GREY), lw=0.8, ls="--", label="pitch curve")
        if profile.roller_radius:
            roller = profile.pitch[0] + profile.roller_radius * circle
            axes.plot(*roller.T, color=ink(INK), lw=1.0, label=f"roller {first}")
    else:
        along = profile.face[0]
        ends = np.array([profile.offset.min(), profile.offset.max()]) - profile.offset[0]
        axes.plot(*(profile.profile[0] + ends[:, None] * along).T, color=ink(INK), lw=1.6, label=f"face {first}")
    _turning(axes, profile)
    dress(axes, "")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    _legend(axes, "left")
    unit = profile.length_unit
    axes.set_xlabel(f"x of {profile.cam} [{unit}]", fontsize=SMALL, color=ink(GREY), labelpad=1.0, parse_math=False)
    axes.set_ylabel(f"y of {profile.cam} [{unit}]", fontsize=SMALL, color=ink(GREY), labelpad=1.0, parse_math=False)


def _legend(axes: Axes, side: str) -> None:
    """Write the names of the lines above the axes, from their left or right end on."""
    look: dict[str, Any] = {"ncols": 5, "frameon": False, "fontsize": SMALL, "labelcolor": ink(GREY)}
    look |= {"borderaxespad": 0.2, "borderpad": 0.2, "handlelength": 1.8, "columnspacing": 1.2}
    is_left = side == "left"
    axes.legend(loc="lower left" if is_left else "lower right", bbox_to_anchor=(0.0 if is_left else 1.0, 1.0), **look)


def _turning(axes: Axes, profile: CamProfile) -> None:
    """Draw arrows about the axle: the sense in which the cam's angle grows, and that in which its driver turns it."""
    _arrow(axes, profile, _ARROW, DRIVER, "angle of the cam")
    if profile.driver is not None and len(profile.driver) > 1:
        falls = np.median(np.sign(np.diff(profile.driver) * np.diff(profile.angle))) < 0.0  # it jumps after its period
        label = f"rotation with {profile.driver_name}"
        _arrow(axes, profile, -_ROTATION if falls else _ROTATION, palette.BODIES[2], label)


def _arrow(axes: Axes, profile: CamProfile, radius: float, colour: palette.Colour, label: str) -> None:
    """Draw an arrow about the axle, counter-clockwise; clockwise if the radius, in base circles, is negative."""
    first, last = np.radians([20.0, 110.0])[:: 1 if radius > 0.0 else -1]
    route = arc(profile.axle, abs(radius) * _base_radius(profile), first, last)
    axes.plot(*route.T, color=ink(colour), lw=1.2, label=label)
    head: dict[str, Any] = {"arrowstyle": "-|>", "color": ink(colour), "lw": 1.2, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", route[-1], route[-2], arrowprops=head)


def _pressure(axes: Axes, profile: CamProfile, across: FloatArray) -> None:
    limit = _LIMITS[profile.is_swinging]
    axes.plot(across, np.degrees(profile.pressure_angle), color=ink(palette.BODIES[5]), lw=1.2)
    for value in (-limit, limit):
        axes.axhline(value, color=ink(palette.RUNS[0]), lw=0.8, ls="--", label="usual limit" if value > 0.0 else "_")
    dress(axes, "")
    _legend(axes, "right")
    axes.set_ylabel("pressure angle [deg]", fontsize=SMALL, color=ink(GREY))


def _curvature(axes: Axes, profile: CamProfile, across: FloatArray) -> None:
    """Plot the radius of curvature, with gaps where the profile is nearly straight."""
    most = _FLAT * float(np.hypot(*(profile.profile - profile.axle).T).max())
    shown = np.where(np.abs(profile.radius) <= most, profile.radius, np.nan)
    axes.plot(across, shown, color=ink(palette.BODIES[4]), lw=1.2)
    axes.axhline(0.0, color=ink(GREY), lw=0.7)
    dress(axes, "")
    axes.set_ylabel(f"radius of curvature [{profile.length_unit}]", fontsize=SMALL, color=ink(GREY))
