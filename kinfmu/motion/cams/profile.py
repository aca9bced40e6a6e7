"""The profile of a cam over one turn, with what a designer reads off it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError, MechanismError, RequestError
from kinfmu.files import write_whole
from kinfmu.mechanism.joints import CamFlatFace, CamRoller
from kinfmu.motion.cams.placed import PlacedCam
from kinfmu.motion.cams.traced import ComplexArray, Traced, pairs, traced
from kinfmu.run import Column
from kinfmu.run.tables import csv_lines
from kinfmu.units import degrees_of

TURN = 2.0 * math.pi
_FEWEST, _MOST = 180, 100_000  # points of a polygon
_STARTS = 721  # parameters in a turn from which Newton starts
_STEPS = 8  # of Newton at most
_SAME = 1e-13  # [rad]
_DIGITS = 12  # after the point, of degrees


@dataclass(frozen=True, eq=False)
class CamProfile:
    """A cam at n of its angles, lengths in the mechanism's unit, curves in the cam's frame.

    Attributes:
        cam: The cam.
        joint: The joint that leads the follower.
        follower: The follower.
        angle: Angles of the cam against the body that holds it (n,) [rad].
        driver: Values of a driver that turns the cam through gears or the like (n,) [rad]; None for one of the cam.
        driver_name: Its name.
        position: Position of the follower along its guide from the cam's axle [length], or its angle [rad] (n,).
        pitch: The roller's centre (n, 2); None under a flat face.
        profile: The profile (n, 2), the envelope of the roller or of the face.
        pressure_angle: Angle from the follower's motion to the normal of the contact, positive counter-clockwise (n,)
            [rad].
        radius: Radius of curvature of the profile (n,) [length], positive where convex, inf where straight.
        offset: Contact along a flat face from its point, positive 90 degrees counter-clockwise from its normal (n,);
            0 for a roller.
        face: Unit vectors along the face (n, 2), 90 degrees counter-clockwise from its normal; tangents of a roller.
        roller_radius: Radius of the roller; None under a flat face.
        axle: Axle in the cam's frame (2,).
        length_unit: Unit of length.
        is_swinging: True if the follower turns, False if it slides.

    """

    cam: str
    joint: str
    follower: str
    angle: FloatArray
    position: FloatArray
    pitch: FloatArray | None
    profile: FloatArray
    pressure_angle: FloatArray
    radius: FloatArray
    offset: FloatArray
    face: FloatArray
    roller_radius: float | None
    axle: FloatArray
    length_unit: str
    is_swinging: bool
    driver: FloatArray | None = None
    driver_name: str = ""

    def write_csv(self, path: str | Path, *, degrees: bool = False, **form: Any) -> None:
        """Write the table into a .csv file; degrees: True for angles in deg; form: as `csv_lines` of tables has it.

        Raises:
            KinfmuError: The file cannot be written.

        """
        try:
            write_whole(Path(path), "".join(self.csv_lines(degrees=degrees, **form)).encode())
        except OSError as error:
            raise KinfmuError(f"{path}: cannot be written ({error.strerror or error})") from None

    def columns(self, *, degrees: bool = False) -> list[tuple[str, str, FloatArray]]:
        """Return names, units and values (n,) of the table; degrees: True for angles in deg."""
        unit = self.length_unit
        found = [("cam_angle", "rad", self.angle)]
        if self.driver is not None:
            found.append((f"{self.driver_name}_angle", "rad", self.driver))
        found += [("x", unit, self.profile[:, 0]), ("y", unit, self.profile[:, 1])]
        if self.pitch is not None:
            found += [("pitch_x", unit, self.pitch[:, 0]), ("pitch_y", unit, self.pitch[:, 1])]
        found += [
            ("follower", "rad" if self.is_swinging else unit, self.position),
            ("pressure_angle", "rad", self.pressure_angle),
            ("radius_of_curvature", unit, self.radius),
        ]
        if self.pitch is None:
            found.append(("face_offset", unit, self.offset))
        for k, (name, own, values) in enumerate(found) if degrees else ():
            shown, factor = degrees_of(own)
            if shown != own:
                found[k] = name, shown, np.round(values * factor, _DIGITS)  # 45, not 45.00000000000001
        return found

    def csv_lines(self, *, degrees: bool = False, **form: Any) -> Iterator[str]:
        """Yield the lines of a CSV table, each with its end; arguments as in `write_csv`."""
        columns = (Column(name, unit, values + 0.0) for name, unit, values in self.columns(degrees=degrees))
        return csv_lines([*columns], **form)


def turn_of(placed: PlacedCam, angles: FloatArray) -> FloatArray:
    """Return the values of a cam's parameter at angles of the cam (n,) [rad], by Newton.

    Raise a MechanismError if the follower does not allow the cam to turn all the way round.
    """
    if not isinstance(placed.joint, CamRoller | CamFlatFace):
        return angles
    starts = np.linspace(0.0, TURN, _STARTS)
    found = traced(placed, starts)
    if not ((found.rate < 0.0).all() and abs(found.angle[-1] - found.angle[0] + TURN) < 1e-6):
        raise MechanismError(
            f"cam '{placed.joint.name}': the cam cannot turn all the way round on the follower '{placed.follower}'"
        )
    wanted = found.angle[-1] + (angles - found.angle[-1]) % TURN
    s = np.interp(wanted, found.angle[::-1], starts[::-1])
    for _ in range(_STEPS):
        at = traced(placed, s)
        missing = np.remainder(wanted - at.angle + math.pi, TURN) - math.pi
        s = s + missing / at.rate
        if np.abs(missing).max(initial=0.0) < _SAME:
            break
    return np.asarray(s)


def profile_at(placed: PlacedCam, angles: FloatArray, length_unit: str) -> CamProfile:
    """Return the profile of a cam at angles of the cam (n,) [rad].

    Raise a MechanismError if the roller or the face is not known, or has no place at an angle.
    """
    if not placed.is_known:
        name = placed.joint.name
        face = "" if isinstance(placed.joint, CamRoller) else ", or 'normal' for a flat face"
        raise MechanismError(f"cam '{name}' has no profile: [joints.{name}] needs the key 'roller_radius'{face}")
    found = traced(placed, turn_of(placed, angles))
    pitch = None if placed.radius is None else pairs(found.curve + placed.axle)
    return CamProfile(
        cam=placed.cam,
        joint=placed.joint.name,
        follower=placed.follower,
        angle=angles,
        position=found.follower,
        pitch=pitch,
        profile=pairs(envelope(placed, found) + placed.axle),
        pressure_angle=found.pressure_angle,
        radius=found.curve_radius - (placed.radius or 0.0),
        offset=found.offset,
        face=pairs(1j * found.normal),
        roller_radius=placed.radius,
        axle=pairs(np.array([placed.axle]))[0],
        length_unit=length_unit,
        is_swinging=placed.pivot is not None,
    )


def angles_within(placed: PlacedCam, tolerance: float, length_unit: str) -> FloatArray:
    """Return angles of the cam over a turn, of which the last is not repeated, for polygons within a tolerance.

    Raise a RequestError if the tolerance is not positive, or needs more than 100 000 points.
    """
    if not tolerance > 0.0:
        raise RequestError(f"tolerance = {tolerance!r} must be a positive length")
    count = _FEWEST
    while count <= _MOST:
        profile = profile_at(placed, np.linspace(0.0, TURN, 2 * count, endpoint=False), length_unit)
        curves = [profile.profile] if profile.pitch is None else [profile.profile, profile.pitch]
        if max(map(_off_chords, curves)) <= tolerance:
            return profile.angle[::2]
        count *= 2
    raise RequestError(f"tolerance = {tolerance:g} {length_unit} needs more than {_MOST} points")


def _off_chords(curve: FloatArray) -> float:
    """Return the largest distance of every second point of a closed curve from the chord of its neighbours."""
    start, middle, end = curve[::2], curve[1::2], np.roll(curve[::2], -1, axis=0)
    chord = end - start
    length = np.maximum(np.hypot(*chord.T), np.finfo(float).tiny)
    across = chord[:, 0] * (middle - start)[:, 1] - chord[:, 1] * (middle - start)[:, 0]
    return float(np.abs(across / length).max())


def envelope(placed: PlacedCam, found: Traced) -> ComplexArray:
    """Return the profile from the axle: the pitch curve moved inwards by the roller's radius."""
    return np.asarray(found.curve - (placed.radius or 0.0) * found.normal)
