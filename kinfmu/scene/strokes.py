"""Lines that joints add to bodies: cams, rollers, wheels, racks, slots, rods, blocks; to the ground: rails."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from kinfmu.measures.placement import body_of
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.run import FloatArray
from kinfmu.scene.cams import cam_shapes
from kinfmu.scene.instant import Instant
from kinfmu.scene.slides import place, racks_of, rods, slides
from kinfmu.scene.wheels import WheelShape, gear_pairs, rack_pairs

FINE, LINK, BROAD = 0.004, 0.012, 0.022  # radii of lines, as parts of the linkage's size
BLOCK = 0.03  # half length of a block
_RACK_TOOTH = 0.25  # of the pinion's radius, from tooth to tooth; half of that is the rack's height
_ROUND = np.linspace(0.0, 2.0 * np.pi, 73)  # [rad], corners of a circle


@dataclass(frozen=True, eq=False)
class Stroke:
    """A line (k, 2) in the frame of a body.

    name: path below the body's; radius: relative to the linkage's size; tone: 'own' (the body's colour), 'grey' or
    'dark' (the background's colour); layer: height above the body.
    """

    name: str
    points: FloatArray
    radius: float
    tone: str = "own"
    layer: float = 0.0

    @property
    def extent(self) -> FloatArray:
        """Some of the points, (at most 25, 2), for bounds."""
        return self.points[:: max(len(self.points) // 24, 1)]


def strokes(shown: Instant) -> dict[str, list[Stroke]]:
    """Return the lines that joints add, by body ('ground' included), in the body's frame."""
    found: dict[str, list[Stroke]] = {}
    for body, stroke in (*_cams(shown), *_wheels(shown), *_racks(shown), *_slides(shown)):
        found.setdefault(body, []).append(replace(stroke, points=shown.seen(body, stroke.points)))
    return found


_Found = Iterator[tuple[str, Stroke]]  # bodies and strokes in the world as drawn


def _cams(shown: Instant) -> _Found:
    for cam in cam_shapes(shown):
        yield cam.cam, Stroke(f"cam/{cam.joint}", _closed(cam.profile), 1.5 * FINE)
        yield cam.follower, Stroke(f"roller/{cam.joint}", _circle(cam.roller, cam.radius), FINE, "grey", layer=3.0)


def _wheels(shown: Instant) -> _Found:
    for gears in gear_pairs(shown):
        for wheel in gears.wheels:
            yield from _wheel(shown, wheel, gears.joint)
        if gears.is_belt:
            for k, ends in enumerate(gears.belt()):
                yield gears.carrier, Stroke(f"belt/{gears.joint}/{k}", ends, FINE, "grey")


def _racks(shown: Instant) -> _Found:
    for pair in rack_pairs(shown):
        yield from _wheel(shown, pair.pinion, pair.joint)
        teeth = _teeth(pair.ends, pair.towards, _RACK_TOOTH * pair.pinion.radius)
        yield pair.rack, Stroke(f"rack/{pair.joint}", teeth, FINE)


def _wheel(shown: Instant, wheel: WheelShape, joint: str) -> _Found:
    """Yield a pitch circle and a spoke, which shows the rotation."""
    angle = shown.angle(wheel.body)
    rim = wheel.centre + wheel.radius * np.array([np.cos(angle), np.sin(angle)])
    yield wheel.body, Stroke(f"wheel/{joint}", _circle(wheel.centre, wheel.radius), 1.5 * FINE)
    yield wheel.body, Stroke(f"spoke/{joint}", np.array([wheel.centre, rim]), FINE)


def _slides(shown: Instant) -> _Found:
    """Yield rails of the ground, slots and rods of bodies, and the blocks on them."""
    sliding = slides(shown)
    for body, ends in rods(shown, sliding).items():
        for k, rod in enumerate(ends):
            yield body, Stroke(f"rod/{k}", shown.placed(body, rod), LINK)
    racks = racks_of(shown)
    half = BLOCK * _reach(shown) if sliding else 0.0
    for slide in sliding:
        line = shown.placed(slide.holder, slide.ends)
        if slide.holder == GROUND_NAME:
            yield GROUND_NAME, Stroke(f"rail/{slide.name}", line, FINE, "grey")
        elif slide.turns:
            yield slide.holder, Stroke(f"slot/{slide.name}", line, 0.5 * LINK, "dark", layer=0.5)
        if not slide.turns and slide.slider not in racks:
            at, along = place(shown, slide)
            block = np.array([at - half * along, at + half * along])
            tone = "grey" if slide.slider == GROUND_NAME else "own"
            yield slide.slider, Stroke(f"block/{slide.name}", block, BROAD, tone)


def _reach(shown: Instant) -> float:
    """Return the extent of the mechanism over the run [length], the reference size of blocks."""
    tracks = [shown.track(name) for name in shown.body_points if body_of(name) in shown.poses]
    return float(np.nanmax(np.ptp(np.vstack(tracks), axis=0))) if tracks else 1.0


def _circle(centre: FloatArray, radius: float) -> FloatArray:
    return centre + radius * np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])


def _closed(points: FloatArray) -> FloatArray:
    return np.vstack([points, points[:1]])


def _teeth(ends: FloatArray, towards: FloatArray, pitch: float) -> FloatArray:
    """Return the outline of a rack: teeth along its pitch line, a straight back."""
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    count = max(round(length / pitch), 2)
    profile = ((0.0, 0.25), (0.25, 0.25), (0.4, -0.25), (0.6, -0.25), (0.75, 0.25))  # of a tooth: along, deep
    teeth = [
        ends[0] + (k + part) / count * along + depth * pitch * towards for k in range(count) for part, depth in profile
    ]
    back = [ends[1] + 0.25 * pitch * towards, ends[1] + pitch * towards, ends[0] + pitch * towards]
    return np.array([*teeth, *back, teeth[0]])
