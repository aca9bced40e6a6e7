"""The follower's path round its cam: the pitch curve or the tangents of the profile, with two derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.errors import MechanismError
from kinfmu.mechanism.joints import CamFlatFace, CamRoller
from kinfmu.mechanism.laws import Law
from kinfmu.motion.cams.placed import PlacedCam
from kinfmu.plan.equations.taylor import Taylor

ComplexArray = NDArray[np.complex128]
_LEAST = 1e-12  # of the size; a follower whose face turns with the cam at this rate has no profile


@dataclass(frozen=True, eq=False)
class Traced:
    """A cam at n values of its parameter: the cam's angle for a lift, the angle in the cam for a given curve.

    Vectors are complex numbers, curves from the cam's axle and in its frame, with derivatives over the parameter.

    angle: of the cam against the holder (n,) [rad]; follower: its position along the guide from the axle [length], or
    its angle against the holder [rad]; along: unit vector in which the follower moves at the contact, in the holder's
    frame; curve: the pitch curve, or the profile under a flat face; normal: outward unit normal there, in the cam's
    frame; curve_radius: radius of curvature of `curve`, positive where it is convex; offset: of the contact along the
    face from its point [length], 0 for a roller; rate: derivative of `angle` over the parameter.
    """

    angle: FloatArray
    follower: FloatArray
    along: ComplexArray
    curve: ComplexArray
    normal: ComplexArray
    curve_radius: FloatArray
    offset: FloatArray
    rate: FloatArray

    @property
    def pressure_angle(self) -> FloatArray:
        """Angle from the follower's motion to the normal of the contact, positive counter-clockwise (n,) [rad]."""
        turned = self.normal * np.exp(1j * self.angle) * self.along.conj()
        return np.asarray(np.angle(np.where(turned.real < 0.0, -turned, turned)))


def law_values(law: Law, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return f, f' and f'' at arguments (n,)."""
    value = law.at(Taylor.of(2, x, np.ones(len(x))))
    number = value if isinstance(value, Taylor) else Taylor.of(2, value)  # a constant
    f, f1, f2 = (np.broadcast_to(number.derivative(order), x.shape) for order in range(3))
    return f, f1, f2


def traced(placed: PlacedCam, s: FloatArray) -> Traced:
    """Return a cam at values s (n,) of its parameter [rad].

    Raise a MechanismError if the follower cannot reach the curve everywhere, or its face turns with the cam.
    """
    values = law_values(placed.joint.law, s)
    if isinstance(placed.joint, CamRoller):
        return _on_pitch_curve(placed, s, *values)
    if placed.normal is None:
        return _led_roller(placed, s, *values)
    face = _on_tangents if isinstance(placed.joint, CamFlatFace) else _led_face
    return face(placed, placed.normal, s, *values)


def _led_roller(placed: PlacedCam, s: FloatArray, f: FloatArray, f1: FloatArray, f2: FloatArray) -> Traced:
    """Return the pitch curve that a lift makes: c(theta) of the roller's centre, seen from the turning cam.

    z = e^(-i theta) c,   z' = e^(-i theta) (c' - i c),   z'' = e^(-i theta) (c'' - 2 i c' - c)
    """
    moved = placed.joint.offset + f - placed.quantity  # type: ignore[union-attr]  # a lift has an offset
    if placed.pivot is None:
        e = placed.direction
        c, c1, c2 = placed.point + moved * e, f1 * e, f2 * e
        follower, along = np.asarray((c * e.conjugate()).real), np.full(len(s), e)
    else:
        arm = (placed.point - placed.pivot) * np.exp(1j * moved)
        c, c1, c2 = placed.pivot + arm, 1j * f1 * arm, (1j * f2 - f1 * f1) * arm
        follower, along = placed.swing + moved, 1j * arm / np.abs(arm)
    back = np.exp(-1j * s)
    z, z1, z2 = back * c, back * (c1 - 1j * c), back * (c2 - 2j * c1 - c)
    return _rolled(s, follower, along, (z, z1, z2), np.ones(len(s)), -1.0)


def given_curve(joint: CamRoller | CamFlatFace, s: FloatArray) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return a given pitch curve or profile, from its pole: points, outward normals and radii of curvature (n,).

    s: Angles in the cam's frame, of the points or of the normals (n,) [rad].
    """
    f, f1, f2 = law_values(joint.law, s)
    out = np.exp(1j * s)
    if isinstance(joint, CamFlatFace):
        return out * (f + 1j * f1), out, f + f2
    z = f * out
    return z, *_bent((f1 + 1j * f) * out, (f2 + 2j * f1 - f) * out, 1.0)


def _bent(slope: ComplexArray, bend: ComplexArray, sense: float) -> tuple[ComplexArray, FloatArray]:
    """Return outward normals and radii of curvature of a curve from its derivatives; sense: 1 if counter-clockwise.

    rho = |z'|^3 / Im(z'* z'')
    """
    speed = np.abs(slope)
    normal = -1j * sense * slope / np.where(speed == 0.0, 1.0, speed)
    turning = sense * (slope.conj() * bend).imag
    with np.errstate(divide="ignore"):
        return normal, np.where(turning == 0.0, np.inf, speed**3 / turning)


def _rolled(
    angle: FloatArray,
    follower: FloatArray,
    along: ComplexArray,
    z: tuple[ComplexArray, ComplexArray, ComplexArray],
    rate: FloatArray,
    sense: float,
) -> Traced:
    """Return a pitch curve z with its derivatives, which goes round the axle in a sense, 1 counter-clockwise."""
    place, slope, bend = z
    normal, radius = _bent(slope, bend, sense)
    return Traced(angle, follower, along, place, normal, radius, np.zeros(len(angle)), rate)


def _led_face(placed: PlacedCam, m0: complex, s: FloatArray, f: FloatArray, f1: FloatArray, f2: FloatArray) -> Traced:
    """Return the profile under a flat face: the envelope of the face's lines, seen from the turning cam.

    The face has the distance h from the axle and the normal m = e^(i mu) in the cam:

        h = m.z,   z = m (h + i h' / mu'),   rho = h + (h' / mu')' / mu'
    """
    moved = placed.joint.offset + f - placed.quantity  # type: ignore[union-attr]  # a lift has an offset
    if placed.pivot is None:
        e, m = placed.direction, np.full(len(s), m0)
        point = placed.point + moved * e
        lifted = (e * m0.conjugate()).real
        h, h1, h2 = (point * m.conj()).real, f1 * lifted, f2 * lifted
        mu1, mu2 = np.full(len(s), -1.0), np.zeros(len(s))
        follower = np.asarray((point * e.conjugate()).real)
    else:
        turn = np.exp(1j * moved)
        m, point = m0 * turn, placed.pivot + (placed.point - placed.pivot) * turn
        radial, across = (placed.pivot * m.conj()).real, (placed.pivot * (1j * m).conj()).real
        h, h1, h2 = (point * m.conj()).real, f1 * across, f2 * across - f1 * f1 * radial
        mu1, mu2 = f1 - 1.0, f2
        if (np.abs(mu1) < _LEAST).any():
            at = _degrees(s[np.abs(mu1) < _LEAST][0])
            raise MechanismError(f"cam '{placed.joint.name}': the face turns as fast as the cam at {at}")
        follower = placed.swing + moved
    slide, bend = h1 / mu1, (h2 - h1 * mu2 / mu1) / mu1**2
    touching = m * (h + 1j * slide)  # in the holder's frame
    along = _motion(placed, touching)
    back = np.exp(-1j * s)
    offset = ((touching - point) * (1j * m).conj()).real
    return Traced(s, follower, along, back * touching, back * m, h + bend, offset, np.ones(len(s)))


def _on_pitch_curve(placed: PlacedCam, s: FloatArray, f: FloatArray, f1: FloatArray, f2: FloatArray) -> Traced:
    """Return the follower on a given pitch curve z = pole + f e^(i s).

    The roller's centre c is where its guide has the distance |z| from the axle: theta = arg c - arg z. The rates c' and
    e^(i theta) (z' + i theta' z) are along the guide.
    """
    out = np.exp(1j * s)
    z, z1, z2 = placed.pole + f * out, (f1 + 1j * f) * out, (f2 + 2j * f1 - f) * out
    size = np.abs(z)
    if placed.pivot is None:
        e = placed.direction
        foot = placed.point - (placed.point * e.conjugate()).real * e
        square = size**2 - abs(foot) ** 2
    else:
        distance, arm = abs(placed.pivot), abs(placed.point - placed.pivot)
        side = placed.pivot / distance
        near = (distance**2 + size**2 - arm**2) / (2.0 * distance)
        square = size**2 - near**2
    if (square < 0.0).any():
        raise _unreachable(placed, s[square < 0.0])
    root = np.sqrt(square)
    if placed.pivot is None:
        c, along, follower = foot + root * e, np.full(len(s), e), root
    else:
        c = side * (near + 1j * np.sign((placed.point * side.conjugate()).imag) * root)
        arms = (c - placed.pivot) / arm
        along, follower = 1j * arms, _turned_from(placed, arms / ((placed.point - placed.pivot) / arm))
    angle = _angle(c / z)
    turn = np.exp(1j * angle)
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = -(along.conj() * turn * z1).imag / (along.conj() * turn * 1j * z).imag
    return _rolled(angle, follower, along, (z, z1, z2), rate, 1.0)


def _on_tangents(
    placed: PlacedCam, m0: complex, s: FloatArray, f: FloatArray, f1: FloatArray, f2: FloatArray
) -> Traced:
    """Return the follower on a profile given by its support function f over the direction s of the normal."""
    out = np.exp(1j * s)
    pole, across = (placed.pole * out.conj()).real, (placed.pole * (1j * out).conj()).real
    h, h1, h2 = f + pole, f1 + across, f2 - pole
    if placed.pivot is None:
        e, m = placed.direction, np.full(len(s), m0)
        lifted = (e * m0.conjugate()).real
        if abs(lifted) < _LEAST:
            raise MechanismError(f"cam '{placed.joint.name}': the face is parallel to the slide of its follower")
        moved = (h - (placed.point * m0.conjugate()).real) / lifted
        point, turned = placed.point + moved * e, np.zeros(len(s))
        follower = (point * e.conjugate()).real
    else:
        distance, side = abs(placed.pivot), placed.pivot / abs(placed.pivot)
        cosine = (h - ((placed.point - placed.pivot) * m0.conjugate()).real) / distance
        if (np.abs(cosine) > 1.0).any():
            raise _unreachable(placed, s[np.abs(cosine) > 1.0])
        sine = np.sign((m0 * side.conjugate()).imag) * np.sqrt(1.0 - cosine**2)
        m = side * (cosine + 1j * sine)
        point = placed.pivot + (placed.point - placed.pivot) * m / m0
        follower = _turned_from(placed, m / m0)
        with np.errstate(divide="ignore", invalid="ignore"):
            turned = -h1 / (distance * sine)
    touching = m * (h + 1j * h1)
    along = _motion(placed, touching)
    offset = ((touching - point) * (1j * m).conj()).real
    return Traced(_angle(m / out), follower, along, out * (h + 1j * h1), out, h + h2, offset, turned - 1.0)


def pressing_sign(placed: PlacedCam) -> int:
    """Return 1 if a positive reaction of the joint presses follower and cam together, -1 if a negative one does.

    The reaction of a joint with a given curve is along its outward normal. That of a lift is along the lift, which may
    go towards the cam.
    """
    if isinstance(placed.joint, CamRoller | CamFlatFace):
        return 1
    at = traced(placed, np.zeros(1))
    outward = at.normal * np.exp(1j * at.angle)
    return 1 if float((outward * at.along.conj()).real[0]) > 0.0 else -1


def _motion(placed: PlacedCam, touching: ComplexArray) -> ComplexArray:
    """Return the unit vectors in which points of the follower move, all in the holder's frame."""
    if placed.pivot is None:
        return np.full(len(touching), placed.direction)
    arm = touching - placed.pivot
    return np.asarray(1j * arm / np.abs(arm))


def _turned_from(placed: PlacedCam, turns: ComplexArray) -> FloatArray:
    """Return the follower's angles, turned from its pose by unit vectors."""
    return np.asarray(placed.swing + np.angle(turns))


def pairs(points: ComplexArray) -> FloatArray:
    """Return points as pairs of real numbers (n, 2)."""
    return np.column_stack([points.real, points.imag])


def _angle(turns: ComplexArray) -> FloatArray:
    return np.asarray(np.unwrap(np.angle(turns)))


def _unreachable(placed: PlacedCam, s: FloatArray) -> MechanismError:
    return MechanismError(
        f"cam '{placed.joint.name}': the follower cannot touch the curve at {_degrees(s[0])} in the cam's frame; the "
        "cam cannot turn all the way round"
    )


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.6g} deg"
