"""Reactions of joints, with the contact forces of cams, and shaking forces on the ground.

Reactions are the multipliers of the joints' rows, block after block in reverse order:

    Phi_q^T lambda = Q - M qdd        Q: generalized forces of gravity and loads

A row that gives a coordinate outright has its multiplier from the equation of that coordinate; a block has those of its
rows from the transposed Jacobian. The effort along a row, per unit of its gap, is what the joint transmits: the force
or moment that its first body exerts on its second. Haug (1989), Lagrange multipliers and reaction forces. The bearings
of a cam and the guide of its follower carry its contact force too, beyond what the multiplier of its lift exerts.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from typing import NamedTuple

from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.force_names import reaction_names_of as reaction_names_of
from kinfmu.mechanism.force_names import shaking_names
from kinfmu.mechanism.joints import CamOscillating, CamTranslating, Joint, Revolute, Translational
from kinfmu.mechanism.joints.cam import Cam
from kinfmu.mechanism.quantities.placement import Placement, body_of
from kinfmu.plan.block import Block
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.equations.system import System
from kinfmu.plan.forces import ForceSteps, chosen_steps
from kinfmu.plan.mechanics import Mechanics
from kinfmu.plan.origin import localized
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import Assignment
from kinfmu.plan.structure import RowTracer
from kinfmu.units import CoordinateName

Pair = tuple[Node, Node]


def reaction_steps(plan: SolvePlan, wanted: Container[str] | None = None) -> ForceSteps:
    """Return the steps to the reactions of all joints and on the ground, in the order of `reaction_names_of`.

    Where redundant rows share a load, the steps give one of the possible distributions. What the unknown contact of a
    cam loads lacks its force.

    wanted: Names of those of joints that are wanted, without those on the ground. Default: all.
    """
    mechanics = Mechanics(plan)
    multipliers = _Multipliers(plan, mechanics).of_row
    zero = mechanics.graph.constant(0.0)
    efforts: dict[int, list[Node]] = {}
    row = 0
    for number, joint in enumerate(mechanics.tracer.joints):
        efforts[number] = []
        for kind, scale in zip(joint.kinds(), joint.scales(), strict=True):
            effort = -(multipliers.get(row, zero) * scale)
            efforts[number].append(effort / mechanics.metre if kind == "length" else effort)
            row += 1
    for (number, row), amount in carried(mechanics, efforts).items():
        efforts[number][row] = efforts[number][row] + amount
    results = [effort for own in efforts.values() for effort in own]
    names = reaction_names_of(plan.mechanism)
    if wanted is None:
        results += shaking_nodes(plan, mechanics)
    return chosen_steps(names[: len(results)], results, mechanics.steps, wanted)


class _Multipliers:
    """The multipliers of all rows, as steps on a graph.

    Attributes:
        of_row: The multiplier of each row, by its index; rows that nothing loads have none.

    """

    def __init__(self, plan: SolvePlan, mechanics: Mechanics) -> None:
        self.of_row: dict[int, Node] = {}
        self._mechanics = mechanics
        self._graph = mechanics.graph
        self._system = System(localized(plan.mechanism)[0])
        self._row = RowTracer(self._system, mechanics.tracer)
        self._index = {row.name: index for index, row in enumerate(self._system.rows)}
        self._open = mechanics.unbalanced(mechanics.members.loads)
        mechanics.steps += [Assignment(name, node) for name, node in mechanics.known.items()]
        for block in reversed(plan.blocks):
            self._block(block)
        for name, row in reversed(list(plan.known_by.items())):
            self._outright(name, self._index[row])

    def _block(self, block: Block) -> None:
        """Balance the coordinates of a block by its rows."""
        if block.unknowns:
            self._solve(block)
        for (name, _), row in zip(reversed(block.assigned), reversed(block.assigned_by), strict=True):
            self._outright(name, self._index[row.name])

    def _solve(self, block: Block) -> None:
        """Add the multipliers of a block's rows, J^T lambda = -w; w: the open forces along its unknowns."""
        graph, one = self._graph, self._graph.constant(1.0)
        assigned = self._mechanics.copied([motion[0] for _, motion in block.assigned])
        forces = []
        for unknown in block.unknowns:
            along = self._open_along(unknown)
            slopes = graph.derivative(assigned, {graph.symbol(unknown): one})
            for (name, _), slope in zip(block.assigned, slopes, strict=True):
                along = along + self._open_along(name) * slope
            forces.append(along)
        if all(force.constant == 0.0 for force in forces):
            return
        jacobian = self._mechanics.jacobian(block)
        transposed = tuple(zip(*jacobian, strict=True))
        names = tuple(f"{row.name}.multiplier" for row in block.rows)
        solved = self._mechanics.solutions(transposed, [tuple(forces)], [names])[0]
        is_relative = len(block.rows) > len(block.unknowns)  # least squares weigh rows relative to the size
        for row, multiplier in zip(block.rows, solved, strict=True):
            scale = row.scale * self._system.size if is_relative else 1.0
            self._add(self._index[row.name], multiplier / scale)

    def _outright(self, name: CoordinateName, index: int) -> None:
        """Balance a coordinate by the row that gives it."""
        force = self._open_along(name)
        if force.constant != 0.0:
            self._add(index, -(force / self._slope(index, name)))

    def _add(self, index: int, multiplier: Node) -> None:
        """Add the multiplier of a row, and what it exerts along the coordinates of its bodies."""
        if multiplier.args:
            name = f"{self._system.rows[index].name}.lambda"
            self._mechanics.steps.append(Assignment(name, multiplier))
            multiplier = self._graph.symbol(name)
        self.of_row[index] = multiplier
        for column in self._system.members[self._system.member_of[index]].columns:
            coordinate = self._system.coordinates[column]
            self._open[coordinate] = self._open_along(coordinate) + self._slope(index, coordinate) * multiplier

    def _open_along(self, name: str) -> Node:
        return self._open.get(name, self._graph.constant(0.0))

    def _slope(self, index: int, name: str) -> Node:
        """Return the derivative of a row with respect to a coordinate, the others where they are."""
        row = self._row(index, {other: node for other, node in self._mechanics.known.items() if other != name})
        return self._graph.derivative([row], {self._graph.symbol(name): self._graph.constant(1.0)})[0]


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
            carriers = supports(joints, joint)
            if carriers is not None:
                yield number, carriers


def carried(mechanics: Mechanics, efforts: Mapping[int, Sequence[Node]]) -> dict[tuple[int, int], Node]:
    """Return what contacts add to the reactions of supports, by the numbers of joint and row [N, N m].

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
    """The contact force of a cam on its follower, which the bearings of the cam and the guide of the follower carry.

    The row of such a joint holds the follower at a lift, so its multiplier is the contact force along the lift, or its
    moment: lambda. The contact itself does the same work, but its direction also loads the bearings. With vectors from
    the cam's axle, turned by 90 degrees where marked by ', all per angle of the cam:

        f' = k rho,   k = e.t      rho t: rate of the roller's centre b along its path;  e: axis of the lift
                                   k = 1 where the lift is an angle;  t = s' for a pivot, s: from the pivot to b
        F = lambda k (b + rho t') / (b.t)                 a roller: along the normal of the pitch curve
        F = lambda k n / (n.t)                            a flat face with the normal n that slides
        F = lambda (f' - k) n / (p' n)                    a flat face that turns about the pivot p;  p' n: cross product
        M = lambda f'                                     moment of F about the axle: the work of the cam

    The first follows from F along the normal, which is across the velocity rho t - b' of the centre in the cam, and
    from the virtual work F.t = lambda k; the third from the moments about axle and pivot.

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
            of_row = (effort * lifted[0], effort * lifted[1])
            self.beyond = (self.force[0] - of_row[0], self.force[1] - of_row[1])
            self.moment_beyond = self.moment_beyond - _cross(b, of_row)

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


def shaking_steps(plan: SolvePlan, wanted: Container[str] | None = None) -> ForceSteps:
    """Return the steps to shaking force and moment alone; they solve nothing.

    wanted: Names of those that are wanted. Default: all.
    """
    mechanics = Mechanics(plan, coefficients="given")
    nodes = shaking_nodes(plan, mechanics)  # of loads too, whose slopes are along symbols of known coordinates
    mechanics.steps += [Assignment(name, node) for name, node in mechanics.known.items()]
    return chosen_steps(shaking_names(plan.mechanism), nodes, mechanics.steps, wanted)


def shaking_nodes(plan: SolvePlan, mechanics: Mechanics) -> list[Node]:
    """Return force (x, y) [N] and moment [N m] on the ground.

        F = sum m (g - a) + sum f,   M = sum r_c x m (g - a) - sum I alpha + sum (r x f)

    Sums go over the moving bodies and the loads f that act on them from outside; r is seen from the origin of the
    ground. What acts between bodies, or between a body and the ground, is no load from outside: the ground takes its
    other end. Berkof and Lowen (1969) define both by the inertia forces alone; here with weights and loads.
    """
    graph, metre = mechanics.graph, mechanics.metre
    outside = [load for load in mechanics.members.loads if len(set(load.acts_on())) == 1]
    needed = mechanics.unbalanced(outside)
    f_x = f_y = moment = graph.constant(0.0)
    for body in mechanics.members.bodies:
        if body.name == GROUND_NAME:
            continue
        x, y, turning = (needed[f"{body.name}.{axis}"] for axis in ("x", "y", "phi"))
        pose = mechanics.pose(body.name)
        f_x, f_y = f_x - x / metre, f_y - y / metre
        moment = moment - turning - (pose.x + plan.origin[0]) * y + (pose.y + plan.origin[1]) * x
    return [f_x, f_y, moment]
