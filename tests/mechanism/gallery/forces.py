"""Forces of the gallery's mechanisms from free bodies in 50 digits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from tests.mechanism.gallery.geometry import Quantity, Vector, decimal, turned
from tests.mechanism.gallery.references import ORIGIN, REFERENCES, cycloidal, rising
from tests.power_series import Series, mp

# --------------------------------------------------------------------------------------------------------------- forces
# Each function takes the time and the motion of the closed form; masses and loads are typed here once more.


Motion = Mapping[str, Series]
MM = 0.001

FORCES: dict[str, Callable[[float, Motion], FreeBodies]] = {}


def forces(diagrams: Callable[[float, Motion], FreeBodies]) -> Callable[[float, Motion], FreeBodies]:
    """Register the function as that of the gallery's mechanism of its name."""
    FORCES[diagrams.__name__] = diagrams
    return diagrams


def force_row(name: str, t: float) -> dict[str, Any]:
    """Return efforts and reactions of a mechanism at a time, by column; none without masses."""
    return FORCES[name](t, REFERENCES[name].motion(t)).solved() if name in FORCES else {}


def _at(motion: Motion, name: str) -> Vector:
    """Return the origin of a body's frame."""
    return Vector(motion[f"{name}.x"], motion[f"{name}.y"])


def _of_a_turn(angle: Series, start: float, *rises: tuple[float, float, float]) -> Any:
    """Return the value of cycloidal rises (begin, duration, rise) over an angle in degrees, repeated each turn."""
    turns = angle.c[0] / (2 * mp.pi)
    return rising(start, *rises, shape=cycloidal)(Series([(turns - mp.floor(turns)) * 360, 0, 0])).c[0]


# ---------------------------------------------------------------------------------------------------------- engine

GAS = (  # over a cycle of two turns: (crank's angle in degrees, force on the piston in N)
    (0, 15500), (10, 24000), (20, 21500), (30, 15000), (40, 10300), (60, 5200), (80, 3070), (100, 2060), (120, 1500),
    (140, 1000), (160, 500), (180, 250), (220, 100), (270, 80), (320, 80), (360, 20), (400, -80), (450, -100),
    (500, -80), (540, -40), (580, 10), (620, 230), (650, 800), (680, 2700), (700, 6200), (710, 9500), (720, 15500),
)  # fmt: skip


@cache
def _slopes(points: Sequence[tuple[int, int]]) -> list[Any]:
    """Return the slopes of the periodic cubic spline through points, with continuous second derivatives:

    s_k-1 / h_k-1 + 2 s_k (1 / h_k-1 + 1 / h_k) + s_k+1 / h_k = 3 (d_k-1 / h_k-1 + d_k / h_k),   d = (u_k+1 - u_k) / h_k
    """
    n = len(points) - 1
    h = [mp.mpf(points[k + 1][0] - points[k][0]) for k in range(n)]
    d = [(points[k + 1][1] - points[k][1]) / h[k] for k in range(n)]
    matrix, right = mp.matrix(n, n), mp.matrix(n, 1)
    for k in range(n):
        matrix[k, k - 1 if k else n - 1] = 1 / h[k - 1]
        matrix[k, k] = 2 * (1 / h[k - 1] + 1 / h[k])
        matrix[k, (k + 1) % n] = 1 / h[k]
        right[k] = 3 * (d[k - 1] / h[k - 1] + d[k] / h[k])
    slopes = list(mp.lu_solve(matrix, right))
    return [*slopes, slopes[0]]


def gas_force(crank: Series) -> Any:
    """Return the force on the piston [N], piece by piece in Hermite's form."""
    angle = crank.c[0] * 180 / mp.pi
    angle -= 720 * mp.floor(angle / 720)
    k = sum(at <= angle for at, _ in GAS[1:-1])
    (a, low), (b, high) = GAS[k : k + 2]
    before, after = _slopes(GAS)[k : k + 2]
    width = mp.mpf(b - a)
    s = (angle - a) / width
    return (
        low * (1 + 2 * s) * (1 - s) ** 2
        + width * before * s * (1 - s) ** 2
        + high * s**2 * (3 - 2 * s)
        - width * after * s**2 * (1 - s)
    )


@forces
def engine(t: float, at: Motion) -> FreeBodies:  # noqa: ARG001
    """Crank, rod and piston; the gas pushes the piston down."""
    bodies = FreeBodies(MM)
    p, s = _at(at, "rod"), Vector(0, at["piston.y"])
    bodies.body("crank", ORIGIN, at["crank.phi"], 3.2, Vector(0, -8), 0.012)
    bodies.body("rod", p, at["rod.phi"], 0.6, Vector(0, 42), 0.0019)
    bodies.body("piston", s, 0, 0.45, Vector(0, 10))
    bodies.motor("crank", "crank")
    bodies.pin("O", GROUND, "crank", ORIGIN)
    bodies.pin("P", "crank", "rod", p)
    bodies.pin("S", "rod", "piston", s)
    bodies.slide("bore", GROUND, "piston", s, mp.pi / 2)
    bodies.push("piston", s, Vector(0, -gas_force(at["crank.phi"])))
    return bodies


# -------------------------------------------------------------------------------------------------------- four-bar


@forces
def fourbar_loaded(t: float, at: Motion) -> FreeBodies:  # noqa: ARG001
    """Crank and rocker with counterweights; the coupler is a flat steel bar, 100 x 20 x 8."""
    bodies = FreeBodies(MM)
    c, p = Vector(110, 0), _at(at, "coupler")
    mass = decimal(7850) * 100 * 20 * 8 / 10**9
    bodies.body("crank", ORIGIN, at["crank.phi"], 1.2, Vector(0, 0), 700e-6)
    bodies.body("coupler", p, at["coupler.phi"], mass, Vector(50, 0), mass * (100**2 + 20**2) / 12 / 10**6)
    bodies.body("rocker", c, at["rocker.phi"], 0.5, Vector(20, 0), 600e-6)
    bodies.motor("crank", "crank")
    bodies.pin("O", GROUND, "crank", ORIGIN)
    bodies.pin("P", "crank", "coupler", p)
    bodies.pin("Q", "coupler", "rocker", p + turned(at["coupler.phi"], 100))
    bodies.pin("C", GROUND, "rocker", c)
    return bodies


# ---------------------------------------------------------------------------------------------------- toggle press


@forces
def toggle_press(t: float, at: Motion) -> FreeBodies:  # noqa: ARG001
    """Five bodies; the workpiece pushes the ram up, the air cylinder pulls it up."""
    bodies = FreeBodies(MM)
    axle, top = Vector(-520, 300), Vector(0, 600)
    p, k, s = _at(at, "rod"), _at(at, "lower_link"), Vector(0, at["ram.y"])
    bodies.body("crank", axle, at["crank.phi"], 45, Vector(0, 0), 2.5)
    bodies.rod("rod", p, at["rod.phi"], 30, 430)
    bodies.rod("upper_link", top, at["upper_link.phi"], 40, 300)
    bodies.rod("lower_link", k, at["lower_link.phi"], 40, 300)
    bodies.body("ram", s, 0, 250, Vector(0, -70))
    bodies.motor("crank", "crank")
    bodies.pin("O", GROUND, "crank", axle)
    bodies.pin("P", "crank", "rod", p)
    bodies.pin("K", "rod", "upper_link", k)
    bodies.pin("T", GROUND, "upper_link", top)
    bodies.pin("knee", "upper_link", "lower_link", k)
    bodies.pin("S", "lower_link", "ram", s)
    bodies.slide("guide", GROUND, "ram", s, mp.pi / 2)
    tool = s + Vector(0, -120)
    bodies.push("ram", tool, Vector(0, _of_a_turn(at["crank.phi"], 400e3, (0, 10, -400e3), (320, 40, 400e3))))
    bodies.push("ram", tool, Vector(0, 3100 + 1.5 * ((top.y - tool.y.c[0]) - 650)), GROUND)
    return bodies


# ------------------------------------------------------------------------------------------------------- excavator


@forces
def excavator_loaded(t: float, at: Motion) -> FreeBodies:
    """Boom, stick, idler, link, bucket; three cylinders without mass; soil in the bucket, the ground at its tip."""
    bodies = FreeBodies(1)
    phi = {name: at[f"{name}.phi"] for name in ("boom", "stick", "idler", "link", "bucket")}
    p, i, n, q = (_at(at, name) for name in ("stick", "idler", "link", "bucket"))
    bodies.body("boom", ORIGIN, phi["boom"], 1900, Vector(2.7, 0.45), 6200)
    bodies.body("stick", p, phi["stick"], 900, Vector(0.9, 0.12), 1100)
    bodies.rod("idler", i, phi["idler"], 60, 0.6)
    bodies.rod("link", n, phi["link"], 80, 0.6)
    bodies.body("bucket", q, phi["bucket"], 700, Vector(0.6, 0.3), 180)
    boom_eye, stick_foot = turned(phi["boom"], 2.4, 0.9), turned(phi["boom"], 2.9, 1.3)
    stick_eye, bucket_foot = p + turned(phi["stick"], -0.8, 0.3), p + turned(phi["stick"], 0.3, 0.5)
    bodies.cylinder("boom_cylinder", GROUND, "boom", Vector(0.5, -0.4), boom_eye)
    bodies.cylinder("stick_cylinder", "boom", "stick", stick_foot, stick_eye)
    bodies.cylinder("bucket_cylinder", "stick", "idler", bucket_foot, n)
    bodies.pin("O", GROUND, "boom", ORIGIN)
    bodies.pin("P", "boom", "stick", p)
    bodies.pin("Q", "stick", "bucket", q)
    bodies.pin("I", "stick", "idler", i)
    bodies.pin("N", "idler", "link", n)
    bodies.pin("M", "link", "bucket", q + turned(phi["bucket"], 0, 0.45))
    bodies.push("bucket", q + turned(phi["bucket"], 0.7, 0.35), Vector(0, -14700))
    digging = rising(60e3, (0.5, 1, -60e3), shape=cycloidal)(Series([t, 0, 0])).c[0]
    bodies.push("bucket", _at(at, "tip"), turned(phi["bucket"].c[0], 0, digging))
    return bodies


# ----------------------------------------------------------------------------------------------------- Jansen's leg


def _apex(base: Any, left: Any, right: Any) -> Vector:
    """Return the third corner of a triangle whose base goes from the origin along x."""
    x = (base * base + left * left - right * right) / (2 * base)
    return Vector(x, mp.sqrt(left * left - x * x))


@forces
def jansen_leg_loaded(t: float, at: Motion) -> FreeBodies:  # noqa: ARG001
    """Seven bodies; the ground pushes the foot up while it is down."""
    bodies = FreeBodies(MM)
    b, c, d, e, g, h, i = (decimal(length) for length in (41.5, 39.3, 40.1, 55.8, 36.7, 65.7, 49))
    pin = Vector(-38, -7.8)
    third, left_own, foot_own = mp.mpf(1) / 3, _apex(b, d, e), _apex(g, i, h)
    left, ankle = _at(at, "link"), _at(at, "leg")
    upper, lower, leg = at["upper_triangle.phi"], at["lower_rocker.phi"], at["leg.phi"]
    x = _at(at, "upper_rod")
    bodies.body("crank", ORIGIN, at["crank.phi"], 0.02, Vector(7.5, 0), 2e-6)
    bodies.rod("upper_rod", x, at["upper_rod.phi"], 0.02, 50)
    bodies.body("upper_triangle", pin, upper, 0.055, (Vector(b, 0) + left_own) * third, 20e-6)
    bodies.rod("lower_rod", x, at["lower_rod.phi"], 0.025, 61.9)
    bodies.rod("lower_rocker", pin, lower, 0.016, c)
    bodies.rod("link", left, at["link.phi"], 0.016, 39.4)
    bodies.body("leg", ankle, leg, 0.06, (Vector(g, 0) + foot_own) * third, 45e-6)
    bodies.motor("crank", "crank")
    bodies.pin("axle", GROUND, "crank", ORIGIN)
    bodies.pin("X_upper", "crank", "upper_rod", x)
    bodies.pin("X_lower", "crank", "lower_rod", x)
    bodies.pin("pin_upper", GROUND, "upper_triangle", pin)
    bodies.pin("pin_lower", GROUND, "lower_rocker", pin)
    bodies.pin("top", "upper_rod", "upper_triangle", pin + turned(upper, b))
    bodies.pin("bottom", "lower_rod", "lower_rocker", ankle)
    bodies.pin("ankle", "lower_rocker", "leg", ankle)
    bodies.pin("left", "upper_triangle", "link", left)
    bodies.pin("knee", "link", "leg", ankle + turned(leg, g))
    weight = _of_a_turn(at["crank.phi"], 15, (70, 20, -15), (280, 20, 15))
    bodies.push("leg", _at(at, "foot"), Vector(0, weight))
    return bodies


# ---------------------------------------------------------------------------------------------------------- free bodies
# Every body is cut free. The unknown forces on it and the known ones balance what its motion needs:
#
#     sum F = m (a - g),   sum (r - r_c) x F + sum M = I alpha        r_c, a: of the centre of mass
#
# These are three equations a body, and as many unknowns: one linear system, without virtual work and without Jacobians.


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
