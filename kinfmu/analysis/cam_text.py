"""The findings of a cam as text."""

from __future__ import annotations

from kinfmu.analysis.cams import CamFindings
from kinfmu.analysis.values import degrees
from kinfmu.motion.cams import CamExtreme, Critical, PlacedCam

_WIDE = 1e6  # of the distance from the axle; a larger radius of curvature is that of a straight line


def cam_lines(cam: CamFindings) -> list[str]:
    """Return the findings of a cam: the first line has its name."""
    placed, found = cam.cam, cam.critical
    if placed is None or found is None:
        return [f"{cam.joint}: no profile, because {cam.reason}"]
    texts = [f"{cam.joint}: {placed.cam} moves {placed.follower}, {_element(cam, placed)}"]
    if cam.program:
        parts = [f"{part} {degrees(begin)} to {degrees(end)}" for part, begin, end in cam.program]
        texts.append(f"program over {cam.driver}: {', '.join(parts)}")
    texts.append(_pressure(cam, found))
    if not cam.is_cut:
        texts.append(_curvature(cam, found))
    if found.width is not None:
        low, high = found.width
        texts.append(
            f"contact on the face from {cam.length(low.value)} ({cam.place(low.at)}) to {cam.length(high.value)} "
            f"({cam.place(high.at)}): width {cam.length(high.value - low.value)}"
        )
    return texts


def _element(cam: CamFindings, placed: PlacedCam) -> str:
    if placed.normal is not None:
        return "flat face"
    if placed.radius is None:
        return "roller of unknown radius: 'roller_radius' in the file gives the profile"
    return f"roller of radius {cam.length(placed.radius)}" if placed.radius else "knife edge"


def _pressure(cam: CamFindings, found: Critical) -> str:
    low, high = found.pressure
    if max(abs(low.value), abs(high.value)) < 1e-12:
        return "pressure angle 0 everywhere"
    worst = max(abs(low.value), abs(high.value))
    verdict = "within" if worst <= cam.limit + 1e-9 else "above"
    return f"pressure angle {_angle(cam, low)} to {_angle(cam, high)}: {verdict} {degrees(cam.limit)}"


def _angle(cam: CamFindings, extreme: CamExtreme) -> str:
    return f"{degrees(extreme.value)} ({cam.place(extreme.at)})"


def _curvature(cam: CamFindings, found: Critical) -> str:
    """Return the smallest radii of curvature, of the profile or, for an unknown roller, of the pitch curve."""
    is_known = cam.element != "unknown"
    convex, concave = (found.convex, found.concave) if is_known else (found.pitch, found.concave)
    sides = [
        f"{cam.length(extreme.value)} {side} ({cam.place(extreme.at)})"
        for side, extreme in (("convex", convex), ("concave", concave))
        if extreme is not None and extreme.value < _WIDE * found.nearest.value
    ]
    curve = "profile" if is_known else "pitch curve, larger than the roller's"
    return f"smallest radius of curvature of the {curve}: {', '.join(sides) or 'none'}"
