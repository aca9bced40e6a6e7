"""Contact forces of cams with a lift law, which the bearings of the cam and the guide of its follower carry.

The row of such a joint holds the follower at a lift, so its multiplier is the contact force along the lift, or its
moment: lambda. The contact itself does the same work, but its direction also loads the bearings. With vectors from the
cam's axle, turned by 90 degrees where marked by ', all per angle of the cam:

    f' = k rho,   k = e.t      rho t: rate of the roller's centre b along its path;  e: axis of the lift
                               k = 1 where the lift is an angle;  t = s' for a pivot, s: from the pivot to b
    F = lambda k (b + rho t') / (b.t)                 a roller: along the normal of the pitch curve
    F = lambda k n / (n.t)                            a flat face with the normal n that slides
    F = lambda (f' - k) n / (p' n)                    a flat face that turns about the pivot p;  p' n: cross product
    M = lambda f'                                     moment of F about the axle: the work of the cam

The first follows from F along the normal, which is across the velocity rho t - b' of the centre in the cam, and from
the virtual work F.t = lambda k; the third from the moments about axle and pivot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from kinfmu.mechanism.joints import CamOscillating, CamTranslating, Joint, Revolute, Translational
from kinfmu.mechanism.joints.cam import Cam
from kinfmu.mechanism.quantities.placement import Placement, body_of
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.steps import Assignment

Pair = tuple[Node, Node]


class Supports(NamedTuple):
    """The joints that carry the contact force of a cam, by number: the pin of the cam and the guide of its follower."""

    axle: int
    guide: int


def supports(joints: Sequence[Joint], cam: Cam) -> Supports | None:
    """Return the joints between a cam, its follower and the body that holds both; None if one of them is missing."""
    holder, follower = cam.holder(), follower_of(cam)
    guides = (Revolute,) if isinstance(cam, CamOscillating) else (Revolute, Translational)
    axle = next((k for k, one in enumerate(joints) if isinstance(one, Revolute) and _joins(one, holder, cam.cam)), None)
    guide = next((k for k, one in enumerate(joints) if isinstance(one, guides) and _joins(one, holder, follower)), None)
    return None if axle is None or guide is None else Supports(axle, guide)


def follower_of(cam: Cam) -> str:
    """Return the follower of a cam."""
    return body_of(cam.bodies()[1])


def _joins(joint: Joint, one: str, other: str) -> bool:
    return {*joint.bodies()} == {one, other}


def known_contacts(joints: Sequence[Joint]) -> Iterator[tuple[int, Supports]]:
    """Yield the numbers of the cams whose contact force follows from their lift, each with its supports."""
    for number, joint in enumerate(joints):
        if isinstance(joint, Cam) and joint.is_contact_known:
            found = supports(joints, joint)
            if found is not None:
                yield number, found


def carried(mechanics: Mechanics, efforts: Mapping[int, Sequence[Node]]) -> dict[tuple[int, int], Node]:
    """Return what contacts add to the reactions of supports, by the numbers of joint and row [N, N m].

    Args:
        mechanics: Masses and loads of a plan.
        efforts: By the number of a joint, what its rows transmit [N, N m]; of cams that nothing loads 0.

    """
    added: dict[tuple[int, int], Node] = {}

    def add(joint: int, row: int, amount: Node, *, is_to_second: bool) -> None:
        before = added.get((joint, row), mechanics.graph.constant(0.0))
        added[joint, row] = before + amount if is_to_second else before - amount

    joints = mechanics.tracer.joints
    for number, (axle, guide) in known_contacts(joints):
        (effort,) = efforts[number]
        if effort.constant == 0.0:
            continue
        cam, pin, slide = joints[number], joints[axle], joints[guide]
        contact = _Contact(mechanics, cam, pin, slide, effort)  # type: ignore[arg-type]  # types of `supports`
        on_guide = contact.on_slide(slide) if isinstance(slide, Translational) else contact.beyond
        for row in (0, 1):
            add(axle, row, contact.force[row], is_to_second=pin.bodies()[1] == contact.cam.cam)
            add(guide, row, -on_guide[row], is_to_second=slide.bodies()[1] == contact.follower)
    return added


class _Contact:
    """The contact force on a follower.

    Attributes:
        cam: The joint, its numbers as nodes.
        follower: The follower.
        force: [N]
        beyond: What is left of it without the force that the row of the joint exerts [N].
        moment_beyond: Moment of that rest about the axle [N m].

    """

    def __init__(
        self, mechanics: Mechanics, cam: Cam, axle: Revolute, guide: Revolute | Translational, effort: Node
    ) -> None:
        self.cam, self.follower, holder = cam, follower_of(cam), cam.holder()
        self._mechanics, self._graph = mechanics, mechanics.graph
        poses = {body: mechanics.pose(body) for body in (holder, self.follower, cam.cam)}
        self._at = Placement(poses, mechanics.members.body_points)
        self._axle = axle.between[axle.bodies().index(holder)]  # the holder is solved wherever the follower is
        b = self._from_axle(cam.touching() or "")
        slope = self._slope()
        lifted: Pair | None = None
        if isinstance(cam, CamTranslating):
            lifted = self._lifted(self._at.direction(holder, cam.axis))
            slope = slope * mechanics.metre
        pivot: Pair | None = None
        if isinstance(guide, Revolute):
            pivot = self._from_axle(guide.between[guide.bodies().index(holder)])
            t = _turned((b[0] - pivot[0], b[1] - pivot[1]))
        else:
            t = self._lifted(self._at.direction(guide.bodies()[0], guide.axis))
        share = self._graph.constant(1.0) if lifted is None else _dot(lifted, t)
        if cam.normal is None:
            rate, (side_x, side_y) = slope / share, _turned(t)
            size = effort * share / _dot(b, t)
            self.force = (size * (b[0] + rate * side_x), size * (b[1] + rate * side_y))
        else:
            n = self._lifted(self._at.direction(self.follower, cam.normal))
            size = effort * share / _dot(n, t) if pivot is None else effort * (slope - share) / _cross(pivot, n)
            self.force = (size * n[0], size * n[1])
        self.beyond, self.moment_beyond = self.force, effort * slope
        if lifted is not None:
            own = (effort * lifted[0], effort * lifted[1])
            self.beyond = (self.force[0] - own[0], self.force[1] - own[1])
            self.moment_beyond = self.moment_beyond - _cross(b, own)

    def on_slide(self, guide: Translational) -> Pair:
        """Return what the rest exerts on the rows of a slide: across its axis [N], and about its point [N m]."""
        e_x, e_y = self._lifted(self._at.direction(guide.bodies()[0], guide.axis))
        moment = self.moment_beyond - _cross(self._from_axle(guide.between[1]), self.beyond)
        return _dot(self.beyond, (-e_y, e_x)), moment

    def _slope(self) -> Node:
        """Return the derivative of the lift over the angle of the cam [length or rad]."""
        graph, (law, argument) = self._graph, self.cam.led_by(self._at)
        name = f"{self.cam.name}.argument"
        self._mechanics.steps.append(Assignment(name, graph.lift(argument)))
        x = graph.symbol(name)
        return graph.derivative([graph.lift(law.at(x))], {x: graph.constant(1.0)})[0]

    def _from_axle(self, point: str) -> Pair:
        """Return the vector from the axle to a point [m]."""
        x, y = self._lifted(self._at.vector((self._axle, point)))
        return x * self._mechanics.metre, y * self._mechanics.metre

    def _lifted(self, vector: tuple[object, object]) -> Pair:
        return self._graph.lift(vector[0]), self._graph.lift(vector[1])


def _dot(a: Pair, b: Pair) -> Node:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Pair, b: Pair) -> Node:
    return a[0] * b[1] - a[1] * b[0]


def _turned(a: Pair) -> Pair:
    return -a[1], a[0]
