"""Cams of a mechanism: their profiles, and the findings of a check at values of the driver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.analysis.cam_driver import CamDriver, cam_driver
from kinfmu.analysis.driver_path import DriverPath, degrees
from kinfmu.errors import KinfmuError, MechanismError, RequestError, listed, valid_names
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.joints import CamFlatFace, CamOscillating, CamTranslating
from kinfmu.mechanism.laws import Harmonic, Law, MotionSequence, Spline
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.motion.cams import (
    CAM_JOINTS,
    NO_PROFILE,
    CamExtreme,
    CamJoint,
    CamProfile,
    Critical,
    PlacedCam,
    critical_values,
    placed_cam,
    pressing_sign,
)
from kinfmu.motion.cams.profile import TURN, angles_within, profile_at
from kinfmu.motion.cams.traced import traced
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.origin import in_world
from kinfmu.run.driving import numbers_of

SLIDING_LIMIT, SWINGING_LIMIT = math.radians(30.0), math.radians(45.0)  # [rad], usual for pressure angles
_ANGLES = 361  # of a table by default, one a degree
_ROUNDING = 1e-9  # of a lift; lifts to both sides that differ less are equal
_WIDE = 1e6  # of the distance from the axle; a larger radius of curvature is that of a straight line


@dataclass(frozen=True)
class CamFindings:
    """What a check finds of one cam.

    cam: placed, None where it cannot be; critical: its values over a turn; turned_by: the driver in whose values places
    are reported, None where there are no values; reason: why there are none.
    """

    joint: str
    cam: PlacedCam | None
    critical: Critical | None
    turned_by: CamDriver | None
    length_unit: str
    reason: str = ""

    @property
    def driver(self) -> str:
        """The name of the driver in whose values places are reported, '' where there are none."""
        return "" if self.turned_by is None else self.turned_by.name

    @property
    def element(self) -> str:
        """What touches the cam: 'roller', 'knife edge', 'flat face' or 'unknown'."""
        if self.cam is None or not self.cam.is_known:
            return "unknown"
        return "flat face" if self.cam.normal is not None else "roller" if self.cam.radius else "knife edge"

    @property
    def is_cut(self) -> bool:
        """True if there is no profile that leads the follower as the law says."""
        return self.problem() is not None

    @property
    def steepest(self) -> CamExtreme | None:
        """The largest size of the pressure angle."""
        return None if self.critical is None else max(self.critical.pressure, key=lambda one: abs(one.value))

    @property
    def limit(self) -> float:
        """The usual limit of the pressure angle [rad]: 30 degrees, of swinging followers 45."""
        return SLIDING_LIMIT if self.cam is None or self.cam.pivot is None else SWINGING_LIMIT

    @property
    def program(self) -> tuple[tuple[str, float, float], ...]:
        """The parts of a law with segments, by begin: 'rise', 'dwell' or 'return', begin and end as driver values.

        A rise moves the follower away from the cam while the driver's value grows. A cam that makes several turns in a
        period of the driver has each part as often.
        """
        if self.cam is None or self.turned_by is None or not isinstance(law := self.cam.joint.law, MotionSequence):
            return ()
        edges = law.begin + np.cumsum([0.0, *(segment.duration for segment in law.segments)])
        angles = traced(self.cam, edges).angle  # of the cam
        outwards = pressing_sign(self.cam)
        parts = []
        for segment, (a, b) in zip(law.segments, pairwise(angles.tolist()), strict=True):
            is_along = (b > a) != self.turned_by.is_backward  # the law's argument grows with the driver's value
            lifted = segment.rise * outwards * (1.0 if is_along else -1.0)
            part = "rise" if lifted > 0.0 else "return" if lifted < 0.0 else "dwell"
            parts += [(part, *ends) for ends in self.turned_by.parts(*sorted((a, b)))]
        return tuple(sorted(parts, key=lambda part: part[1]))

    def at(self, angle: float) -> float:
        """Return the value of the driver at an angle of the cam [rad]."""
        return angle if self.turned_by is None else self.turned_by.at(angle)

    def place(self, angle: float) -> str:
        """Return an angle of the cam as the value of the driver: 'cam at 40 deg'."""
        return f"{self.driver} at {degrees(self.at(angle))}"

    @property
    def undercut(self) -> tuple[tuple[float, float], ...]:
        """The parts of the driver's period in which the profile is cut, by begin, each from begin to end."""
        if self.critical is None or self.turned_by is None:
            return ()
        cuts = self.critical.undercut
        return tuple(sorted(part for cut in cuts for part in self.turned_by.parts(cut.begin, cut.end)))

    def curvature(self) -> list[tuple[str, CamExtreme]]:
        """Return the smallest radii of the profile or, for an unknown roller, of the pitch curve, with their side."""
        if self.critical is None:
            return []
        convex, curve = (
            (self.critical.convex, "") if self.element != "unknown" else (self.critical.pitch, " pitch curve")
        )
        found = ((f"convex{curve}", convex), (f"concave{curve}", self.critical.concave))
        widest = _WIDE * self.critical.nearest.value
        return [(side, extreme) for side, extreme in found if extreme is not None and extreme.value < widest]

    def length(self, value: float) -> str:
        return f"{round(value, 9) + 0.0:.6g} {self.length_unit}"

    def note(self) -> str:
        """Return a line about a pressure angle above the usual limit, '' if there is none."""
        worst = self.steepest
        if worst is None or self.cam is None or abs(worst.value) <= self.limit + 1e-9:
            return ""
        kind, cure = "translating" if self.cam.pivot is None else "swinging", "a larger base circle lowers it"
        other = with_opposite_lift(self.cam)
        if other is not None and other < abs(worst.value):
            cure = (
                f"the lift moves the follower towards the cam: with lifts of the opposite sign it is {degrees(other)}"
            )
        return (
            f"cam '{self.joint}': pressure angle {degrees(worst.value)} ({self.place(worst.at)}) is above "
            f"{degrees(self.limit)}, the usual limit of {kind} followers; {cure}"
        )

    def problem(self) -> MechanismError | None:
        """Return the reason why there is no profile that leads the follower as the law says; None if there is one."""
        cam, critical = self.cam, self.critical
        if cam is None or critical is None or not cam.is_known:
            return None
        where, radius = f"[joints.{self.joint}]", self.length(cam.radius or 0.0)
        if critical.nearest.value <= (cam.radius or 0.0):
            what = f"the roller of radius {radius} reaches the cam's axle: its centre is"
            if cam.normal is not None:
                what = "the flat face reaches the cam's axle: its distance is"
            return MechanismError(
                f"{where} {what} {self.length(critical.nearest.value)} from it ({self.place(critical.nearest.at)}); "
                "the base circle must be larger",
                joint=self.joint,
            )
        if critical.undercut:
            parts = [f"{self.driver} at {degrees(begin)} to {degrees(end)}" for begin, end in self.undercut]
            return MechanismError(f"{where} {self._undercut(cam, critical)} from {listed(parts)}", joint=self.joint)
        if critical.gouge is not None:
            depth = self.length(critical.gouge.value)
            return MechanismError(
                f"{where} roller_radius = {radius}: the roller cuts {depth} into another part of the profile "
                f"({self.place(critical.gouge.at)}); it must be smaller",
                joint=self.joint,
            )
        return None

    def _undercut(self, cam: PlacedCam, critical: Critical) -> str:
        if cam.normal is None:
            least = critical.pitch or critical.nearest
            return (
                f"roller_radius = {self.length(cam.radius or 0.0)} must be smaller than the smallest radius of "
                f"curvature of the pitch curve, {self.length(least.value)} ({self.place(least.at)}), or the base "
                "circle larger: the profile is undercut"
            )
        least = critical.convex or critical.nearest
        remedy = "f + f'' of the law must be positive" if isinstance(cam.joint, CamFlatFace) else (
            "the base circle must be larger" if cam.pivot is not None
            else f"the base circle must be larger by more than {self.length(-least.value)}"
        )  # fmt: skip
        return (
            f"a flat face cannot touch a concave profile, radius of curvature {self.length(least.value)} "
            f"({self.place(least.at)}); {remedy}: the profile is undercut"
        )

    def as_json(self) -> dict[str, Any]:
        """Return the findings as plain data."""
        critical = self.critical

        def entry(extreme: CamExtreme | None) -> dict[str, float] | None:
            return None if extreme is None else {"value": extreme.value, "at": self.at(extreme.at)}

        values: dict[str, Any] = {"reason": self.reason or None}
        if self.program:
            values["program"] = [{"part": part, "begin": begin, "end": end} for part, begin, end in self.program]
        if critical is not None and self.cam is not None:
            values |= {
                "cam": self.cam.cam,
                "follower": self.cam.follower,
                "swings": self.cam.pivot is not None,
                "roller_radius": self.cam.radius,
                "smallest_pressure_angle": entry(critical.pressure[0]),
                "largest_pressure_angle": entry(critical.pressure[1]),
                "smallest_convex_radius": entry(critical.convex) if self.cam.is_known else None,
                "smallest_concave_radius": entry(critical.concave) if self.cam.is_known else None,
                "smallest_pitch_radius": entry(critical.pitch),
                "undercut": [{"begin": begin, "end": end} for begin, end in self.undercut],
                "gouge": entry(critical.gouge),
                "face": critical.width and dict(zip(("low", "high"), map(entry, critical.width), strict=True)),
            }
        return {"joint": self.joint, "element": self.element, "driver": self.driver, **values}


def with_opposite_lift(cam: PlacedCam) -> float | None:
    """Return the largest pressure angle with the opposite lift [rad]; None for lifts away from the cam, or unknown.

    A lift counts from where a sequence or a table begins, a harmonic one from 0: it goes to both sides of its middle,
    so that it must be towards the cam as a whole. Other laws do not repeat after a turn.
    """
    joint = cam.joint
    if not isinstance(joint, CamTranslating | CamOscillating):
        return None
    opposite: Law
    match joint.law:
        case MotionSequence(segments=segments) as law:
            lifts = np.cumsum([segment.rise for segment in segments])
            opposite = replace(law, segments=tuple(segment._replace(rise=-segment.rise) for segment in segments))
        case Spline(points=points) as law:
            base = points[0][1]
            lifts = np.array([u - base for _, u in points])
            opposite = replace(law, points=tuple((x, 2.0 * base - u) for x, u in points))
        case Harmonic(start=middle, amplitude=amplitude) as law if abs(middle) >= abs(amplitude) * (1.0 - _ROUNDING):
            lifts = np.array([middle - amplitude, middle + amplitude])
            opposite = replace(law, start=-middle, amplitude=-amplitude)
        case _:
            return None
    lifts = lifts * pressing_sign(cam)
    if -lifts.min() <= lifts.max() * (1.0 + _ROUNDING):
        return None
    try:
        of_opposite = critical_values(replace(cam, joint=replace(joint, law=opposite)))
    except MechanismError:
        return None
    return max(abs(extreme.value) for extreme in of_opposite.pressure)


def cam_profile(
    mechanism: Mechanism, joint: str, angles: ArrayLike | None = None, *, tolerance: float | None = None
) -> CamProfile:
    """Return the profile of a cam: the envelope of the roller, or of the flat face, that the law leads round it.

    Args:
        mechanism: The mechanism.
        joint: Name of a joint `cam_translating`, `cam_oscillating`, `cam_roller` or `cam_flat_face`.
        angles: Angles of the cam against the body that holds it (n,) [rad]. Default: a turn in steps of a degree.
        tolerance: In place of angles: so many in a turn that a closed polygon through the points of profile and pitch
            curve is nowhere further from them [length].

    Returns:
        The profile in the cam's frame, with pressure angle and radius of curvature.

    Raises:
        RequestError: There is no such joint, or the tolerance is invalid.
        MechanismError: The joint states no roller or flat face, the guides of cam and follower give no profile, or
            there is none that leads the follower as the law says: it would be undercut, or reach the axle.

    """
    require_mechanism(mechanism, "cam_profile")
    cam = _named(mechanism, joint)
    plan = compile_plan(mechanism)
    placed = placed_cam(mechanism, cam, _poses(plan))
    unit = mechanism.length_unit
    turned_by = cam_driver(plan, placed, None)
    profile_at(placed, np.zeros(1), unit)  # an unknown roller is reported before its consequences
    problem = CamFindings(joint, placed, critical_values(placed), turned_by, unit).problem()
    if problem is not None:
        raise problem
    if tolerance is not None:
        asked = angles_within(placed, tolerance, unit)
    else:
        asked = np.linspace(0.0, TURN, _ANGLES) if angles is None else numbers_of("angles", angles).reshape(-1)
    profile = profile_at(placed, asked, unit)
    if turned_by.transmission is None:
        return profile  # the driver's value is the cam's angle, or no single driver turns the cam
    values = np.array([turned_by.at(one) for one in asked.tolist()])
    return replace(profile, driver=values, driver_name=turned_by.name)


def cam_findings(plan: SolvePlan, paths: Sequence[DriverPath]) -> tuple[CamFindings, ...]:
    """Return what is found of each cam of a mechanism; paths: of its drivers."""
    mechanism, poses = plan.mechanism, None
    findings = []
    for joint in mechanism.joints:
        if not isinstance(joint, CAM_JOINTS):
            continue
        poses = poses or _poses(plan)
        try:
            placed = placed_cam(mechanism, joint, poses)
            turned_by = cam_driver(plan, placed, paths)
            findings.append(CamFindings(joint.name, placed, critical_values(placed), turned_by, mechanism.length_unit))
        except KinfmuError as reason:
            text = str(reason).removeprefix(f"cam '{joint.name}': ").removeprefix(f"{NO_PROFILE}: ")
            findings.append(CamFindings(joint.name, None, None, None, mechanism.length_unit, text))
    return tuple(findings)


def _named(mechanism: Mechanism, name: str) -> CamJoint:
    cams = [joint for joint in mechanism.joints if isinstance(joint, CAM_JOINTS)]
    for joint in cams:
        if joint.name == name:
            return joint
    if not cams:
        raise RequestError(f"{mechanism.name} has no cam; joints of cams: {listed(cls.type for cls in CAM_JOINTS)}")
    names = [joint.name for joint in cams]
    raise RequestError(f"'{name}' is not a cam joint of {mechanism.name}{valid_names(name, names)}")


def _poses(plan: SolvePlan) -> dict[str, tuple[float, float, float]]:
    """Return the poses of all bodies at the plan's anchor."""
    rows = in_world(plan.origin, plan.anchor.q).reshape(-1, 3).tolist()
    bodies = [body.name for body in plan.mechanism.moving_bodies]
    return {GROUND_NAME: (0.0, 0.0, 0.0), **{body: (x, y, phi) for body, (x, y, phi) in zip(bodies, rows, strict=True)}}
