"""Joints and drivers of every class, drawn by hypothesis from the annotations of their fields.

A new joint or driver is picked up by itself; one with a field of a new kind fails here and says which. Strategies are
made once: hypothesis looks through a new one every time, which takes longer than drawing from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from kinfmu.mechanism import Body, Mechanism, Point, Start
from kinfmu.mechanism.declared import Key, keys_of
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import CamFlatFace, CamRoller, Coupling, Joint
from kinfmu.mechanism.laws import LAWS, RISES, Harmonic, Law, MotionSequence, Polynomial, Segment, Spline
from kinfmu.mechanism.laws.law import number_fields
from kinfmu.mechanism.laws.spline import ENDS, PERIODIC
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.quantities import POSE_QUANTITIES, DistanceBetween, PoseQuantity
from kinfmu.mechanism.quantities.placement import Reference
from kinfmu.plan.equations.system import System, placement
from kinfmu.units import Quantity
from tests.power_series import Series

POINTS = {"ground": "O", "left": "P", "right": "Q", "third": "R"}
coordinates = st.floats(-3.0, 3.0).map(lambda x: round(x, 6))  # no numbers so small that their products vanish
lengths = st.floats(0.1, 4.0)
angles = st.floats(-7.0, 7.0).map(lambda x: round(x, 6))


@cache
def members(cls: type[Any], **given: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Draw joints or drivers of a class between ground, left and right; `third` is a third body if one is needed."""
    drawn = {"name": st.just("member"), **given}
    for key in keys_of(cls):
        if key.name not in drawn:
            drawn[key.name] = _values(cls, key)
    return st.builds(cls, **drawn)


@cache
def _values(cls: type[Any], key: Key) -> st.SearchStrategy[Any]:
    if key.takes == "law":
        if issubclass(cls, Driver | Load):
            return st.sampled_from(LAWS).flatmap(laws)
        return pitch_curves() if issubclass(cls, CamRoller | CamFlatFace) else lifts()
    if key.takes == "measure":
        drawn = st.sampled_from(POSE_QUANTITIES).flatmap(measures)
        return drawn if key.default is not None else st.none() | drawn
    if key.default is None:  # what of the follower touches the cam does not change the motion
        return st.none()
    if isinstance(key.measures, Quantity):
        return angles if key.measures.kind == "angle" else lengths
    assert key.refers is not None, (
        f"{cls.__name__}.{key.name}: tests/mechanism/joints/drawn.py does not know how to draw it"
    )
    third = any(other.name == "between" for other in keys_of(cls))
    return _references(key.refers, is_pair=key.takes == "pair", third=third)


def _references(reference: Reference, *, is_pair: bool, third: bool) -> st.SearchStrategy[Any]:
    if reference.kind == "choice":
        return st.sampled_from(reference.choices)
    names = {"point": {body: f"{body}.{point}" for body, point in POINTS.items()}, "body": {b: b for b in POINTS}}
    of = names[reference.kind]
    if not is_pair:
        return st.sampled_from([of["third"]] if third else [of["left"], of["right"]])
    bodies = [("left", "right"), ("right", "left"), ("ground", "left"), ("right", "ground")]
    return st.sampled_from([(of[a], of[b]) for a, b in bodies])


@cache
def laws(cls: type[Law]) -> st.SearchStrategy[Law]:
    """Laws of a class with drawn constants."""
    numbers = {key: lengths if quantity.is_positive else coordinates for key, quantity in number_fields(cls).items()}
    if cls is Polynomial:
        return st.builds(cls, st.lists(coordinates, min_size=1, max_size=5).map(tuple))
    if cls is MotionSequence:
        rises = st.builds(Segment, st.sampled_from([rise.type for rise in RISES]), lengths, coordinates)
        segments = st.lists(rises | lengths.map(lambda duration: Segment("dwell", duration)), min_size=1, max_size=3)
        return st.builds(cls, segments.map(tuple), repeat=st.booleans(), **numbers)
    if cls is Spline:
        return st.sampled_from(ENDS).flatmap(splines)
    return st.builds(cls, **numbers)


@cache
def lifts() -> st.SearchStrategy[Law]:
    """Laws of a cam's angle, of moderate slope: derivatives of derivatives are compared to round-off."""
    small, slow = st.floats(-1.0, 1.0).map(lambda x: round(x, 3)), st.floats(2.0, 6.0)
    rises = st.sampled_from(RISES).flatmap(lambda cls: st.builds(cls, small, slow, small, small))
    harmonics = st.builds(Harmonic, small, st.sampled_from([1.0, 2.0, 0.5]), small, small)
    polynomials = st.builds(Polynomial, st.lists(small, min_size=1, max_size=3).map(tuple))
    return rises | harmonics | polynomials | splines("natural")


@cache
def pitch_curves() -> st.SearchStrategy[Law]:
    """Radii over a turn."""
    whole = st.builds(Harmonic, st.floats(0.1, 0.5), st.sampled_from([1.0, 2.0]), st.floats(1.0, 2.0), angles)
    return whole | st.builds(lambda r: Polynomial((r,)), st.floats(1.0, 2.0))


@cache
def measures(cls: type[PoseQuantity]) -> st.SearchStrategy[PoseQuantity]:
    """Measures of a class between the bodies left and right."""
    drawn: dict[str, st.SearchStrategy[Any]] = {}
    for key in keys_of(cls):
        if key.refers is None:
            drawn[key.name] = angles
        elif key.name == "to":
            drawn[key.name] = st.sampled_from([None, "third"])
        else:
            drawn[key.name] = _references(key.refers, is_pair=key.takes == "pair", third=False)
    return st.builds(cls, **drawn)


@cache
@st.composite
def splines(draw: st.DrawFn, ends: str) -> Spline:
    """Tables of points at uneven distances."""
    widths = draw(st.lists(st.floats(0.5, 2.0), min_size=3, max_size=6))
    x = [draw(coordinates)]
    for width in widths:
        x.append(x[-1] + width)
    u = [draw(coordinates) for _ in x]
    if ends == PERIODIC:
        u[-1] = u[0]
    return Spline(tuple(zip(x, u, strict=True)), ends)


@cache
@st.composite
def systems(draw: st.DrawFn, member: type[Joint] | type[Driver], **given: st.SearchStrategy[Any]) -> System:
    """A ground and three bodies with a drawn point each, and one drawn joint or driver; `given`: its keys."""
    bodies = [
        Body(
            name,
            {point: Point(draw(coordinates), draw(coordinates))},
            Start() if name == "ground" else Start(0.0, 0.0, 0.0),
        )
        for name, point in POINTS.items()
    ]
    one = draw(members(member, **given))
    of_kind: Mapping[str, Any] = {"joints": (one,)} if isinstance(one, Joint) else {"drivers": (one,)}
    return System(Mechanism("drawn", tuple(bodies), **of_kind))


def are_apart(system: System, q: NDArray[np.float64]) -> bool:
    """True unless points whose distance the joint measures lie so near each other that its derivatives are large."""
    at = placement(system.mechanism, q)
    pairs = []
    for joint in system.mechanism.joints:
        if isinstance(joint, CamRoller):
            pairs.append(joint.between)
        elif isinstance(joint, Coupling):
            pairs += [m.between for m in (joint.input, joint.output) if isinstance(m, DistanceBetween)]
    return all(DistanceBetween(pair).value(at) >= 1.0 for pair in pairs)


def regular_poses(system: System) -> st.SearchStrategy[NDArray[np.float64]]:
    """All coordinates q, where the joint is smooth."""
    return poses(system).filter(lambda q: are_apart(system, q))


def poses(system: System) -> st.SearchStrategy[NDArray[np.float64]]:
    """All coordinates q, or their rates."""
    return _rows(len(system.coordinates))


@cache
def _rows(n: int) -> st.SearchStrategy[NDArray[np.float64]]:
    return st.lists(coordinates, min_size=n, max_size=n).map(np.array)


def jacobian_by_complex_step(system: System, q: NDArray[np.float64], u: list[float]) -> NDArray[np.float64]:
    """Phi_q, (m, n), to round-off: Im Phi(q + i h e_k) / h."""
    h = 1e-30
    columns = []
    for k in range(len(q)):
        moved = [complex(x, h if j == k else 0.0) for j, x in enumerate(q)]
        columns.append([complex(phi).imag / h for phi in system.evaluate(moved, u)])
    return np.array(columns).T


def second_derivative(system: System, q: list[Series], u: list[Series]) -> NDArray[np.float64]:
    """Phi'' along a motion given as power series in time, (m,), from 50 digits."""
    rows = [phi if isinstance(phi, Series) else Series([phi, 0, 0]) for phi in system.evaluate(q, u)]
    return np.array([float(2 * phi.c[2]) for phi in rows])


def size(system: System, *vectors: NDArray[np.float64]) -> float:
    """A bound on the numbers that meet in the evaluation, against which rounding is measured."""
    return max(system.size, 1.0, *(float(np.abs(vector).max(initial=0.0)) for vector in vectors)) ** 4
