"""Critical values of a cam: pressure angle, radii of curvature, undercut, the width of a flat face."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.motion.cams.placed import PlacedCam
from kinfmu.motion.cams.profile import TURN, envelope
from kinfmu.motion.cams.traced import ComplexArray, Traced, traced

_SAMPLES = 721  # in a turn, between which extremes are searched
_REFINED = 33  # places in an interval that is searched
_FINEST, _FINEST_END = 1e-10, 2e-12  # [rad]; width of the interval that holds an extreme, and the end of a part
_EDGE = 1e-12  # [rad] before a jump of the law, where the values of the left side count
_SAME_ANGLE = 1e-7  # [rad]; places of extremes are known to half the digits
_NOISE = 1e-13  # of the largest value; smaller differences are rounding
_TOUCH = 1e-9  # of the size; smaller radii of curvature and overlaps are rounding


@dataclass(frozen=True)
class CamExtreme:
    """A value and the angle of the cam where it occurs [rad]."""

    value: float
    at: float


@dataclass(frozen=True)
class Cut:
    """A part of the turn in which the profile is cut: angles of the cam from begin to end [rad]."""

    begin: float
    end: float


@dataclass(frozen=True)
class Critical:
    """The critical values of a cam over a turn.

    pressure: smallest and largest pressure angle [rad]; convex, concave: smallest radius of curvature of the profile
    where it is convex and where it is concave, as positive lengths, None where it is not; pitch: smallest convex radius
    of the pitch curve, None under a flat face; nearest: smallest distance of the roller's centre or of the face from
    the axle; undercut: where the roller is larger than the radius of the pitch curve, or a flat face cannot touch;
    gouge: where the roller cuts the profile of another angle; width: of the flat face that the contact needs, with its
    ends along the face from its point.
    """

    pressure: tuple[CamExtreme, CamExtreme]
    convex: CamExtreme | None
    concave: CamExtreme | None
    pitch: CamExtreme | None
    nearest: CamExtreme
    undercut: tuple[Cut, ...]
    gouge: CamExtreme | None
    width: tuple[CamExtreme, CamExtreme] | None

    @property
    def is_cut(self) -> bool:
        """True if there is no profile that leads the follower as the law says."""
        return bool(self.undercut) or self.gouge is not None


def critical_values(placed: PlacedCam) -> Critical:
    """Return the critical values of a cam, to round-off in the angles where they are smooth.

    Raise a MechanismError if the follower cannot touch the cam everywhere.
    """
    parts = _intervals(placed)
    s = np.concatenate([np.linspace(a, b, max(int(_SAMPLES * (b - a) / TURN), 5)) for a, b in parts])
    found = traced(placed, s)
    search = _Search(placed, parts, s, found)
    radius = placed.radius or 0.0

    def bend(at: Traced) -> FloatArray:
        """Return the curvature of the pitch curve or of the profile under a face; a face has the radius itself."""
        return at.curve_radius if placed.normal is not None else 1.0 / at.curve_radius

    convex = concave = pitch = None
    if placed.normal is not None:
        convex = search.least(bend)
        cuts = search.below(lambda at: bend(at) - _TOUCH * float(np.abs(found.curve).max()))
    else:
        sharpest, hollow = search.most(bend), search.least(bend)
        if sharpest.value > 0.0:
            pitch = CamExtreme(1.0 / sharpest.value, sharpest.at)
            convex = CamExtreme(pitch.value - radius, pitch.at)
        if hollow.value < 0.0:
            concave = CamExtreme(radius - 1.0 / hollow.value, hollow.at)
        cuts = search.below(lambda at: 1.0 - radius * bend(at) - _TOUCH) if radius else ()
    nearest, width = search.least(lambda at: np.abs(at.curve)), None
    if placed.normal is not None:
        nearest = search.least(lambda at: (at.curve * at.normal.conj()).real)
        width = search.least(lambda at: at.offset), search.most(lambda at: at.offset)
    return Critical(
        pressure=(search.least(lambda at: at.pressure_angle), search.most(lambda at: at.pressure_angle)),
        convex=convex,
        concave=concave,
        pitch=pitch,
        nearest=nearest,
        undercut=cuts,
        gouge=None if cuts or not radius else _gouge(placed, found),
        width=width,
    )


def _intervals(placed: PlacedCam) -> list[tuple[float, float]]:
    """Return the parts of a turn of the parameter between jumps of the law."""
    law = placed.joint.law
    jumps = law.own_breaks()
    period = float(jumps.period) or TURN
    at = {0.0, TURN}
    for jump in map(float, jumps.at):
        first = jump % period
        at |= {first + k * period for k in range(int(TURN / period) + 1) if _EDGE < first + k * period < TURN - _EDGE}
    edges = sorted(at)
    return [(a, b - _EDGE) for a, b in pairwise(edges) if b - a > 1e-9]


@dataclass(frozen=True, eq=False)
class _Search:
    """A search over the parameter of a cam, from samples s (n,) of the parts."""

    placed: PlacedCam
    parts: Sequence[tuple[float, float]]
    s: FloatArray
    found: Traced

    def _at(self, x: float) -> Traced:
        return traced(self.placed, np.array([x]))

    def most(self, of: Callable[[Traced], FloatArray]) -> CamExtreme:
        """Return the largest value of a quantity."""
        least = self.least(lambda at: -of(at))
        return CamExtreme(-least.value, least.at)

    def least(self, of: Callable[[Traced], FloatArray]) -> CamExtreme:
        """Return the smallest value of a quantity: that of the samples, improved between their neighbours."""
        values = of(self.found)
        noise = _NOISE * float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
        k = int(np.argmax(values <= values.min() + noise))  # the first of equal ones
        best, at = float(values[k]), float(self.s[k])
        a, b = next(part for part in self.parts if part[0] <= at <= part[1])
        low, high = max(a, self.s[max(k - 1, 0)]), min(b, self.s[min(k + 1, len(self.s) - 1)])
        refined, there = best, at
        while high - low > _FINEST:
            s = np.linspace(low, high, _REFINED)
            values = of(traced(self.placed, s))
            k = int(np.argmin(values))
            if values[k] < refined:
                refined, there = float(values[k]), float(s[k])
            low, high = s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)]
        if refined < best - noise:
            best, at = refined, there
        return CamExtreme(best, _in_turn(float(self._at(at).angle[0])))

    def below(self, of: Callable[[Traced], FloatArray]) -> tuple[Cut, ...]:
        """Return the parts of the turn where a quantity is negative."""
        negative = of(self.found) < 0.0
        if negative.all():
            return (Cut(0.0, TURN),)
        if not negative.any():
            return ()
        ends: list[tuple[float, bool]] = []
        for k in np.flatnonzero(negative[1:] != negative[:-1]):
            low, high = float(self.s[k]), float(self.s[k + 1])
            while high - low > _FINEST_END:
                s = np.linspace(low, high, _REFINED)
                has_changed = (of(traced(self.placed, s)) < 0.0) == negative[k + 1]
                has_changed[-1] = True  # also where rounding differs from that of the samples
                after = max(int(np.argmax(has_changed)), 1)
                low, high = float(s[after - 1]), float(s[after])
            ends.append((high, bool(negative[k + 1])))
        if not ends:
            return ()
        first = next(k for k, (_, begins) in enumerate(ends) if begins)
        ends = ends[first:] + ends[:first]
        found = []
        for (begin, _), (end, _) in zip(ends[::2], ends[1::2], strict=True):
            angles = sorted(float(self._at(x).angle[0]) % TURN for x in (begin, end))
            middle = begin + ((end - begin) % TURN) / 2.0
            is_inside = angles[0] <= float(self._at(middle).angle[0]) % TURN <= angles[1]
            found.append(Cut(*(angles if is_inside else angles[::-1])))
        return tuple(sorted(found, key=lambda cut: cut.begin))


def _in_turn(angle: float) -> float:
    """Return an angle in [0, 2 pi), 0 for one that rounding leaves below 2 pi."""
    angle %= TURN
    return 0.0 if TURN - angle < _SAME_ANGLE else angle


def _gouge(placed: PlacedCam, found: Traced) -> CamExtreme | None:
    """Return where the roller cuts a part of the profile that it touches at another angle, and how deep; else None."""
    radius = placed.radius or 0.0
    profile, size = envelope(placed, found), float(np.abs(found.curve).max())
    depths = cut_depths(found.curve, profile, radius)
    k = int(np.argmax(depths))
    return CamExtreme(float(depths[k]), float(found.angle[k]) % TURN) if depths[k] > _TOUCH * size else None


def cut_depths(curve: ComplexArray, profile: ComplexArray, radius: float) -> FloatArray:
    """Return how deep the roller, at the places (n,) of its centre, cuts the profile at its points (k,) [length]."""
    return np.array([radius - float(np.abs(curve - point).min()) for point in profile])
