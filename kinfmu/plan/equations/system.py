"""System: all constraint rows of a mechanism stacked, evaluated directly with numpy. The readable reference."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.quantities.arithmetic import floor
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement, body_of
from kinfmu.plan.equations.graph import Graph, Node, reachable
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.solver.python.curve import curve
from kinfmu.units import METRES

_SOURCES_KEPT = 256
_OPERATIONS = {"+": "{} + {}", "-": "{} - {}", "*": "{} * {}", "/": "{} / {}", "neg": "-{}"}
_CALLED = {"sin": math.sin, "cos": math.cos, "sqrt": math.sqrt, "atan2": math.atan2, "floor": floor, "curve": curve}


class RowCode(NamedTuple):
    """Functions of the coordinates [x, y, phi, ...] of the bodies of a joint or driver, and of its target.

    values: Returns Phi, a value per row. gradients: Returns Phi_q, row after row; it raises a ZeroDivisionError where a
    formula has no derivative.
    """

    values: Callable[[Sequence[float], float], tuple[float, ...]]
    gradients: Callable[[Sequence[float], float], tuple[float, ...]]


def row_code(residual: Callable[[Sequence[Node], Node], Sequence[Any]], count: int) -> RowCode:
    """Return the code of rows.

    Values are equal to the bit to those of the formulas, up to the sign of a zero.

    residual: The rows, as a function of coordinates and target.
    """
    graph = Graph()
    coordinates = [graph.symbol(f"q{k}") for k in range(count)]
    rows = [graph.lift(row) for row in residual(coordinates, graph.symbol("u"))]
    one = graph.constant(1.0)
    columns = [graph.derivative(rows, {coordinate: one}) for coordinate in coordinates]
    return RowCode(
        _function(rows, count), _function([entry for row in zip(*columns, strict=True) for entry in row], count)
    )


def _function(results: Sequence[Node], count: int) -> Callable[[Sequence[float], float], tuple[float, ...]]:
    """Return a function of coordinates and target; numbers are arguments, so that joints of one type share a source."""
    names: dict[Node, str] = {}
    constants: list[Any] = []
    lines = []
    for node in reachable(results):
        if node.op == "symbol":
            names[node] = node.name
            continue
        if node.op == "constant":
            names[node] = f"c{len(constants)}"
            constants.append(node.constant)
            continue
        arguments = [names[argument] for argument in node.args]
        names[node] = f"t{node.id}"
        if node.op == "curve":
            data, order = node.curve
            arguments = [f"c{len(constants)}", str(order), *arguments]
            constants.append(data)
        text = (
            _OPERATIONS[node.op].format(*arguments) if node.op in _OPERATIONS else f"{node.op}({', '.join(arguments)})"
        )
        lines.append(f"    {names[node]} = {text}")
    unpacked = [*(f"q{k}" for k in range(count))], [f"c{k}" for k in range(len(constants))]
    found = "".join(f"{names[result]}, " for result in results)
    head = [f"    [{', '.join(names)}] = {given}" for names, given in zip(unpacked, ("q", "constants"), strict=True)]
    source = "\n".join(["def rows(q, u, constants):", *head, *lines, f"    return ({found})"])
    return _bound(_compiled(source), tuple(constants))


def _bound(
    rows: Callable[..., tuple[float, ...]], constants: tuple[Any, ...]
) -> Callable[[Sequence[float], float], tuple[float, ...]]:
    return lambda q, u: rows(q, u, constants)


@lru_cache(maxsize=_SOURCES_KEPT)
def _compiled(source: str) -> Callable[..., tuple[float, ...]]:
    namespace: dict[str, Any] = dict(_CALLED)
    exec(compile(source, "<rows of a joint>", "exec"), namespace)  # noqa: S102  our own text, without any of the file
    function: Callable[..., tuple[float, ...]] = namespace["rows"]
    return function


FAR = 4.0  # sizes from the world's origin beyond which a mechanism is planned about a ground point of its own
RARELY = 50  # evaluations of a gradient; more are faster by code, which is made in the time of as many


class Row(NamedTuple):
    """One scalar constraint equation: row `label` of the joint or driver `owner`; '' if rows of several share it."""

    owner: str
    label: str
    scale: float  # residual per unit of length; an angle counts as the travel of a point at distance `size`
    kind: str  # 'length' or 'angle': what its gap is

    @property
    def name(self) -> str:
        return f"{self.owner}.{self.label}" if self.owner else self.label


class Member(NamedTuple):
    """A joint or a driver: its moving bodies, and places of its rows and of its bodies' coordinates in the system."""

    owner: Joint | Driver
    bodies: tuple[str, ...]
    rows: tuple[int, ...]
    columns: tuple[int, ...]  # three a body
    driver: int | None = None  # number of the driver, if it is one

    def coordinates(self, q: FloatArray) -> list[float]:
        """Return the coordinates of its columns from all coordinates, (n,)."""
        coordinates: list[float] = q[list(self.columns)].tolist()
        return coordinates


class System:
    """Phi(q, u) = [Phi_K(q); Phi_D(q, u)]: joint rows in file order, then one row for each driver.

    q: (n,) all coordinates x, y, phi of the moving bodies in file order; u: (d,) driver values. Haug (1989), chapter 3:

        position       Phi(q, u) = 0             Newton: Phi_q dq = -Phi
        velocity       Phi_q qd  = nu            nu = -Phi_t
        acceleration   Phi_q qdd = gamma         gamma = -(Phi_q qd)_q qd - 2 Phi_qt qd - Phi_tt
    """

    def __init__(self, mechanism: Mechanism, size: float | None = None) -> None:
        """Take the size of the mechanism [length], or another one, of which this mechanism is a part."""
        self.mechanism = mechanism
        self.coordinates = mechanism.coordinate_names
        self.size = size_of(mechanism) if size is None else size
        per_length = {"angle": 1.0 / self.size, "length": 1.0}
        rows = [
            Row(joint.name, label, scale * per_length[kind], kind)
            for joint in mechanism.joints
            for label, scale, kind in zip(joint.labels, joint.scales(), joint.kinds(), strict=True)
        ]
        for driver in mechanism.drivers:
            quantity = driver.measured()
            scale = quantity.scale(self.size) * per_length[quantity.kind]
            rows.append(Row(driver.name, driver.noun, scale, quantity.kind))
        self.rows = tuple(rows)
        self.joint_row_count = len(rows) - len(mechanism.drivers)
        self.scales: FloatArray = np.array([row.scale for row in rows])  # (m,)
        is_angle = [name.is_angle for name in self.coordinates]
        self.column_scales: FloatArray = np.where(is_angle, 1.0, self.size)  # (n,) coordinates per unit of motion
        self._evaluations = Counter[tuple[int, ...]]()  # of joints and drivers, by their rows
        self._codes: dict[tuple[int, ...], RowCode] = {}

    def evaluate(self, q: Sequence[Any], u: Sequence[Any]) -> list[Any]:
        """Return Phi, one value per row, in the arithmetic of q and u."""
        at = placement(self.mechanism, q)
        phi = [value for joint in self.mechanism.joints for value in joint.residual(at)]
        return phi + [driver.residual(at, target) for driver, target in zip(self.mechanism.drivers, u, strict=True)]

    def residual(self, q: ArrayLike, u: ArrayLike) -> FloatArray:
        """Return Phi(q, u), (m,)."""
        return np.array(self.evaluate(_floats(q), _floats(u)))

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Return Phi_q, (m, n)."""
        at = np.asarray(q, dtype=float)
        matrix = np.zeros((len(self.rows), len(self.coordinates)))
        for member in self.members:
            matrix[np.ix_(member.rows, member.columns)] = self.gradients(member, member.coordinates(at))
        return matrix

    @cached_property
    def members(self) -> tuple[Member, ...]:
        """Joints, then drivers."""
        number = {body.name: k for k, body in enumerate(self.mechanism.moving_bodies)}
        members, first = [], 0
        owners: tuple[Joint | Driver, ...] = (*self.mechanism.joints, *self.mechanism.drivers)
        for owner in owners:
            bodies = tuple(dict.fromkeys(name for name in owner.bodies() if name in number))
            columns = tuple(3 * number[name] + k for name in bodies for k in range(3))
            count = len(owner.labels) if isinstance(owner, Joint) else 1
            driver = None if isinstance(owner, Joint) else first - self.joint_row_count
            members.append(Member(owner, bodies, tuple(range(first, first + count)), columns, driver))
            first += count
        return tuple(members)

    @cached_property
    def member_of(self) -> tuple[int, ...]:
        """Number of the joint or driver to which each row belongs, by index into `members`."""
        return tuple(number for number, member in enumerate(self.members) for _ in member.rows)

    def values(self, member: Member, coordinates: Sequence[float], u: FloatArray) -> Sequence[float]:
        """Return Phi of one joint or driver, a value per row; coordinates: of its columns."""
        target = 0.0 if member.driver is None else float(u[member.driver])
        code = self._codes.get(member.rows)
        return code.values(coordinates, target) if code else list(map(float, self._alone(member, coordinates, target)))

    def gradients(self, member: Member, coordinates: Sequence[float]) -> FloatArray:
        """Return Phi_q of one joint or driver, (its rows, its columns); coordinates: of its columns."""
        shape = len(member.rows), len(coordinates)
        code = self._code(member)
        if code is not None:
            with suppress(ZeroDivisionError):
                return np.array(code.gradients(coordinates, 0.0)).reshape(shape)
        along = [Taylor(pair) for pair in zip(coordinates, np.eye(len(coordinates)), strict=True)]
        gradients = np.zeros(shape)
        for row, phi in enumerate(self._alone(member, along, 0.0)):
            gradients[row] = _derivative(phi, 1)
        return gradients

    def columns_met(self, member: Member, poses: FloatArray) -> list[list[int]]:
        """Return for each row of one joint or driver those of its columns along which it moves in any of some poses.

        poses: (n, its columns).
        """
        self._evaluations[member.rows] += len(poses)
        units = np.eye(poses.shape[1])[:, :, None]
        along = [Taylor(pair) for pair in zip(poses.T, units, strict=True)]
        slopes = [np.asarray(_derivative(phi, 1)) for phi in self._alone(member, along, 0.0)]
        return [np.flatnonzero((slope != 0.0).any(axis=-1)).tolist() if slope.ndim else [] for slope in slopes]

    def _code(self, member: Member) -> RowCode | None:
        """Return the code of a joint or driver; None as long as its formulas are evaluated rarely."""
        code = self._codes.get(member.rows)
        if code is None:
            self._evaluations[member.rows] += 1
            if self._evaluations[member.rows] > RARELY:
                code = self._codes[member.rows] = self._new_code(member)
        return code

    def use_code(self) -> None:
        """Evaluate all joints and drivers by code from now on."""
        self._codes = {member.rows: self._new_code(member) for member in self.members}

    def _new_code(self, member: Member) -> RowCode:
        return row_code(partial(self._alone, member), len(member.columns))

    def _alone(self, member: Member, coordinates: Sequence[Any], target: Any) -> Sequence[Any]:
        """Return the rows of one joint or driver, in the arithmetic of its bodies' coordinates."""
        at, owner = Placement(_frames(member.bodies, coordinates), self._points), member.owner
        return owner.residual(at) if isinstance(owner, Joint) else (owner.residual(at, target),)

    @cached_property
    def _points(self) -> dict[str, tuple[float, float]]:
        return self.mechanism.body_points

    def nu(self, q: ArrayLike, u: ArrayLike, ud: ArrayLike) -> FloatArray:
        """Return the right side of the velocity equation, -Phi_t = -Phi_u ud, (m,)."""
        moving = [Taylor((value, rate)) for value, rate in zip(_floats(u), _floats(ud), strict=True)]
        return np.array([-_derivative(phi, 1) for phi in self.evaluate(_floats(q), moving)])

    def gamma(self, q: ArrayLike, qd: ArrayLike, u: ArrayLike, ud: ArrayLike, udd: ArrayLike) -> FloatArray:
        """Return the right side of the acceleration equation, (m,): -Phi'' along q + qd t, u(t)."""
        along = [Taylor.of(2, value, rate) for value, rate in zip(_floats(q), _floats(qd), strict=True)]
        moving = [Taylor.of(2, *target) for target in zip(_floats(u), _floats(ud), _floats(udd), strict=True)]
        return np.array([-_derivative(phi, 2) for phi in self.evaluate(along, moving)])

    def scaled_jacobian(self, q: ArrayLike) -> FloatArray:
        """Return Phi_q, rows as lengths over the size and columns in sizes and radians: pure numbers of order one."""
        return self.jacobian(q) / self.scales[:, None] * self.column_scales / self.size

    def gaps(self, phi: ArrayLike) -> FloatArray:
        """Return the gap of each joint row, as a length or in radians by its kind, (joint rows,)."""
        values = _floats(phi)
        gaps: list[float] = []
        for joint in self.mechanism.joints:
            count = len(joint.labels)
            gaps += joint.gaps(tuple(values[:count]))
            values = values[count:]
        return np.array(gaps)

    def measure(self, q: ArrayLike) -> FloatArray:
        """Return the driven quantities in a pose, (d,)."""
        at = placement(self.mechanism, _floats(q))
        return np.array([driver.measured().value(at) for driver in self.mechanism.drivers])

    def gap_unit(self, row: Row) -> str:
        """Return the unit of a row's gap."""
        return "rad" if row.kind == "angle" else self.mechanism.length_unit


def placement(mechanism: Mechanism, q: Sequence[Any]) -> Placement:
    """Return the poses of the bodies from all coordinates q, in any arithmetic."""
    return Placement(_frames([body.name for body in mechanism.moving_bodies], q), mechanism.body_points)


def _frames(bodies: Iterable[str], q: Sequence[Any]) -> dict[str, BodyFrame]:
    """Return the frames of the ground and of bodies from their coordinates x, y, phi."""
    frames = {name: BodyFrame.of(*q[3 * k : 3 * k + 3]) for k, name in enumerate(bodies)}
    return {GROUND_NAME: GROUND, **frames}


def size_of(mechanism: Mechanism) -> float:
    """Return the mechanism's size [length]: that of its longest body or joint."""
    longest = max((*lengths_of(mechanism).values(), *(float(joint.reach()) for joint in mechanism.joints)), default=0.0)
    return longest or 1.0 / METRES[mechanism.length_unit]


def lengths_of(mechanism: Mechanism) -> dict[str, float]:
    """Return the length of each body [length], measured between its named points (and its frame, unless ground)."""
    places: dict[str, list[tuple[float, float]]] = {body.name: [(0.0, 0.0)] for body in mechanism.moving_bodies}
    for name, point in mechanism.named_points.items():
        places.setdefault(body_of(name), []).append(point)
    return {body: float(np.hypot(*np.ptp(xy, axis=0))) for body, xy in places.items()}


def _floats(values: ArrayLike) -> list[float]:
    return [float(value) for value in np.asarray(values, dtype=float)]


def _derivative(phi: Any, order: int) -> Any:
    """Return a derivative of a residual; 0 if it is a plain number."""
    return phi.derivative(order) if isinstance(phi, Taylor) else 0.0
