"""Free-body diagrams in 50 digits: efforts of drivers and reactions of joints by Newton's and Euler's equations.

Every body is cut free. The unknown forces on it and the known ones balance what its motion needs:

    sum F = m (a - g),   sum (r - r_c) x F + sum M = I alpha        r_c, a: of the centre of mass

These are three equations a body, and as many unknowns: one linear system, without virtual work and without Jacobians.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from tests.mechanism.gallery.geometry import Quantity, Vector, decimal, turned
from tests.power_series import Series, mp

GRAVITY = Vector(0, -9.81)  # [m/s2]
GROUND = "ground"


class _Body(NamedTuple):
    center: tuple[Any, Any]  # [m]
    needs: tuple[Any, Any, Any]  # m (a - g), I alpha
    energy: Any  # kinetic [J]


class FreeBodies:
    """Bodies cut free, the known and the unknown forces on them.

    Points are given in the file's unit of length, as series or numbers; metre: that unit [m].
    """

    def __init__(self, metre: float) -> None:
        self._metre = decimal(metre)
        self._bodies: dict[str, _Body] = {}
        self._known: dict[str, list[Any]] = {GROUND: [mp.mpf(0)] * 3}
        self._unknown: dict[str, dict[str, list[Any]]] = {}  # by column: force and moment on each body per unit

    def body(self, name: str, at: Vector, phi: Quantity, mass: float, center: Vector, inertia: float = 0) -> None:
        """Add a body: its frame, its mass [kg], its centre of mass in the frame, its moment of inertia [kg m2]."""
        constant, mass, inertia = Series([0, 0, 0]), decimal(mass), decimal(inertia)
        there = at + turned(phi, center.x, center.y)
        x, y = ((constant + value) * self._metre for value in (there.x, there.y))
        angle = constant + phi
        needs = (
            mass * (2 * x.c[2] - GRAVITY.x),
            mass * (2 * y.c[2] - GRAVITY.y),
            inertia * 2 * angle.c[2],
        )
        energy = (mass * (x.c[1] ** 2 + y.c[1] ** 2) + inertia * angle.c[1] ** 2) / 2
        self._bodies[name] = _Body((x.c[0], y.c[0]), needs, energy)
        self._known[name] = [mp.mpf(0)] * 3

    def rod(self, name: str, at: Vector, phi: Quantity, mass: float, length: Quantity) -> None:
        """Add a uniform rod from the origin of its frame along x."""
        inertia = decimal(mass) * (decimal(length) * self._metre) ** 2 / 12
        self.body(name, at, phi, mass, Vector(decimal(length) / 2, 0), inertia)

    def push(self, body: str, at: Vector, force: Vector, against: str = "") -> None:
        """Add a known force on a body at a point [N], from outside or with its opposite on another body."""
        for name, sign in ((body, 1), (against, -1)):
            if name:
                for k, amount in enumerate(self._on(name, at, (sign * _now(force.x), sign * _now(force.y)))):
                    self._known[name][k] += amount

    def pin(self, name: str, first: str, second: str, at: Vector) -> None:
        """Add a pin: an unknown force of the first body on the second."""
        self._pair(f"{name}.force_x", first, second, at, (1, 0))
        self._pair(f"{name}.force_y", first, second, at, (0, 1))

    def slide(self, name: str, first: str, second: str, at: Vector, axis: Quantity) -> None:
        """Add a slide: an unknown force of the first body on the second to the left of its axis, and a moment."""
        self._pair(f"{name}.force", first, second, at, (-mp.sin(axis), mp.cos(axis)))
        self._unknown[f"{name}.moment"] = {first: [0, 0, -1], second: [0, 0, 1]}

    def motor(self, name: str, body: str) -> None:
        """Add an unknown torque of the ground on a body."""
        self._unknown[f"{name}.torque"] = {body: [0, 0, 1], GROUND: [0, 0, -1]}

    def cylinder(self, name: str, first: str, second: str, a: Vector, b: Vector) -> None:
        """Add an unknown force that pushes two points apart."""
        x, y = _now(b.x - a.x), _now(b.y - a.y)
        length = mp.sqrt(x * x + y * y)
        self._pair(f"{name}.force", first, second, b, (x / length, y / length))

    def solved(self) -> dict[str, Any]:
        """Return the unknowns by column, in the order in which they were added; kinetic energy and shaking force last.

        The shaking force and moment are the sum of all that is exerted on the ground, about its origin.
        """
        names = list(self._bodies)
        columns = list(self._unknown.values())
        matrix = mp.matrix(3 * len(names), len(columns))
        right = mp.matrix(3 * len(names), 1)
        for i, name in enumerate(names):
            for k in range(3):
                right[3 * i + k] = self._bodies[name].needs[k] - self._known[name][k]
                for j, column in enumerate(columns):
                    matrix[3 * i + k, j] = column.get(name, (0, 0, 0))[k]
        found = dict(zip(self._unknown, mp.lu_solve(matrix, right), strict=True))
        energy = {"kinetic_energy": mp.fsum(body.energy for body in self._bodies.values())}
        exerted = [(force, self._unknown[name].get(GROUND, (0, 0, 0))) for name, force in found.items()]
        shaking = ("shaking_force_x", "shaking_force_y", "shaking_moment")
        on_ground = {
            column: self._known[GROUND][k] + mp.fsum(force * per_unit[k] for force, per_unit in exerted)
            for k, column in enumerate(shaking)
        }
        return found | energy | on_ground

    def _pair(self, column: str, first: str, second: str, at: Vector, force: tuple[Any, Any]) -> None:
        """Add an unknown force on the second body, and its opposite on the first, at one point or along one line."""
        opposite = (-force[0], -force[1])
        self._unknown[column] = {first: self._on(first, at, opposite), second: self._on(second, at, force)}

    def _on(self, body: str, at: Vector, force: tuple[Any, Any]) -> list[Any]:
        """Return a force, and its moment about the centre of mass, of the ground about its origin."""
        x, y = (0, 0) if body == GROUND else self._bodies[body].center
        moment = (_now(at.x) * self._metre - x) * force[1] - (_now(at.y) * self._metre - y) * force[0]
        return [*force, moment]


def _now(value: Quantity) -> Any:
    """Return the value of a quantity, without its rates."""
    return value.c[0] if isinstance(value, Series) else value
