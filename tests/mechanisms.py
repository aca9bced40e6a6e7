"""Mechanisms for the tests of several packages: built in Python, scaled, and with lengths as parameters."""

from __future__ import annotations

import cmath
import math
import re
from dataclasses import replace
from typing import Any

from kinfmu import AngleDriver, Body, ConstantSpeed, Coordinate, Distance, Mechanism, Revolute, load
from kinfmu.mechanism.members import NumberPath
from kinfmu.mechanism.operations import Dimension
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.units import Quantity

PINS = (
    Revolute("O", ("ground.O", "crank.O")),
    Revolute("P", ("crank.P", "coupler.P")),
    Revolute("Q", ("coupler.Q", "rocker.Q")),
    Revolute("C", ("ground.C", "rocker.C")),
)
FOURBAR_PINS = """[joints]
O = { type = "revolute", between = ["ground.O", "crank.O"] }
P = { type = "revolute", between = ["crank.P", "coupler.P"] }
Q = { type = "revolute", between = ["coupler.Q", "rocker.Q"] }
C = { type = "revolute", between = ["ground.C", "rocker.C"] }
"""
FOURBAR_DRIVER = """[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
"""


def reference_fourbar(bar: float = 1.0, start_degrees: float = 60.0) -> Mechanism:
    """The gallery's four-bar, with another length of its redundant bar AB or another start pose."""
    start = math.radians(start_degrees)
    written = text(load("fourbar")).replace("length = 1.0\n", f"length = {bar!r}\n")
    written = written.replace("phi = 1.0471975511965976 ", f"phi = {start!r} ")
    return parse(written.replace("x = 1.5, y = 0.866", f"x = {1 + math.cos(start)!r}, y = {math.sin(start)!r}"))


def tight_jaw(pin: tuple[float, float] = (-6.05, 19.06)) -> Mechanism:
    """The gallery's gripper with its rods' pins elsewhere: branches cross 0.25 mm before the dead centre."""
    written = text(load("parallel_jaw"))
    for side, mirrored in (("", 1.0), ("-", -1.0)):
        written = written.replace(f"rod = [0.0, {side}20.0]", f"rod = [{pin[0]!r}, {mirrored * pin[1]!r}]")
    return parse(written)


def bar_as_body(turn: float = 0.0) -> Mechanism:
    """The reference four-bar with AB as a body of its own and the ground turned [rad]: 12 coordinates, 12 rows."""
    c, s, start = math.cos(turn), math.sin(turn), math.radians(60.0) + turn

    def turned(x: float, y: float) -> tuple[float, float]:
        return c * x - s * y, s * x + c * y

    return Mechanism(
        "bar_as_body",
        [
            Body("ground", {"O": turned(0, 0), "C": turned(1, 0), "B": turned(2, 0)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (*turned(0, 0), start)),
            Body("coupler", {"P": (-1, 0), "Q": (0, 0), "A": (1, 0)}, (*turned(1.5, 0.866), turn)),
            Body("rocker", {"C": (0, 0), "Q": (1, 0)}, (*turned(1, 0), start)),
            Body("bar", {"B": (0, 0), "A": (1, 0)}, (*turned(2, 0), start)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "coupler.P")),
            Revolute("C", ("ground.C", "rocker.C")),
            Revolute("Q", ("rocker.Q", "coupler.Q")),
            Revolute("B", ("ground.B", "bar.B")),
            Revolute("A", ("coupler.A", "bar.A")),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(turn, math.radians(1.0)))],
    )


def fourbar(
    ground: float,
    crank: float,
    coupler: float,
    rocker: float,
    start: float = 1.0,
    branch: int = 1,
    at: tuple[float, float] = (0.0, 0.0),
) -> Mechanism:
    """Any four-bar, started closed at a crank angle [rad]; branch 1: rocker pin left of the diagonal, as in the oracle.

    Frames of crank and rocker sit at their pivots, that of the coupler at the crank's tip; `at` moves the whole.
    """
    px, py = crank * math.cos(start), crank * math.sin(start)
    dx, dy = ground - px, -py
    diagonal = math.hypot(dx, dy)
    along = (coupler**2 - rocker**2 + diagonal**2) / (2.0 * diagonal)
    across = branch * math.sqrt(max(coupler**2 - along**2, 0.0))
    qx = px + (along * dx - across * dy) / diagonal
    qy = py + (along * dy + across * dx) / diagonal
    x0, y0 = at
    return Mechanism(
        "fourbar_general",
        [
            Body("ground", {"O": (x0, y0), "C": (x0 + ground, y0)}),
            Body("crank", {"O": (0, 0), "P": (crank, 0)}, (x0, y0, start)),
            Body("coupler", {"P": (0, 0), "Q": (coupler, 0)}, (x0 + px, y0 + py, math.atan2(qy - py, qx - px))),
            Body("rocker", {"C": (0, 0), "Q": (rocker, 0)}, (x0 + ground, y0, math.atan2(qy, qx - ground))),
        ],
        [*PINS],
        [AngleDriver("crank", "crank", ConstantSpeed(start, 1.0))],
    )


def six_bar() -> Mechanism:
    """A six-bar driven where no dyad order exists: one block of four unknowns."""
    return Mechanism(
        "six_bar",
        [
            Body("ground", {"A": (0, 0), "B": (4, 0), "C": (5.5, 1)}),
            Body("crank", {"A": (0, 0), "P": (1.5, 0)}, (0, 0, 1.0)),
            Body("ternary", {"P": (0, 0), "Q": (3.5, 0), "R": (3, 2)}, (0.8, 1.26, 0.4)),
            Body("rocker", {"B": (0, 0), "Q": (3, 0)}, (4, 0, 1.3)),
            Body("link", {"R": (-1.5, 0), "S": (2, 0)}, (4.5, 3, -0.3)),
            Body("output", {"C": (0, 0), "S": (2.5, 0)}, (5.5, 1, 1.6)),
        ],
        [
            Revolute("A", ("ground.A", "crank.A")),
            Revolute("B", ("ground.B", "rocker.B")),
            Revolute("C", ("ground.C", "output.C")),
            Revolute("P", ("crank.P", "ternary.P")),
            Revolute("Q", ("rocker.Q", "ternary.Q")),
            Revolute("R", ("ternary.R", "link.R")),
            Revolute("S", ("link.S", "output.S")),
        ],
        [AngleDriver("drive", "output", ConstantSpeed(1.6, 0.1))],
    )


def five_bar() -> Mechanism:
    """A five-bar with two drivers."""
    return Mechanism(
        "five_bar",
        [
            Body("ground", {"A": (0, 0), "B": (3, 0)}),
            Body("left", {"A": (0, 0), "P": (1, 0)}, (0, 0, 2.0)),
            Body("right", {"B": (0, 0), "Q": (1, 0)}, (3, 0, 1.0)),
            Body("forearm", {"P": (-1.5, 0), "T": (1.5, 0)}, (1, 2, 0.7)),
            Body("strut", {"Q": (0, 0), "T": (2.5, 0)}, (3.5, 0.8, 2.2)),
        ],
        [
            Revolute("A", ("ground.A", "left.A")),
            Revolute("B", ("ground.B", "right.B")),
            Revolute("P", ("left.P", "forearm.P")),
            Revolute("Q", ("right.Q", "strut.Q")),
            Revolute("T", ("forearm.T", "strut.T")),
        ],
        [
            AngleDriver("shoulder", "left", ConstantSpeed(2.0, 0.3)),
            AngleDriver("elbow", "right", ConstantSpeed(1.0, -0.2)),
        ],
        points={"tip": "forearm.T"},
    )


def slider_crank(crank: float = 1.0, rod: float = 3.0, offset: float = 0.0, start: float = 0.7) -> Mechanism:
    """A slider-crank from a revolute crank, started at an angle [rad], and a rod whose end stays on y = offset."""
    px, py = crank * math.cos(start), crank * math.sin(start)
    lean = math.asin((offset - py) / rod)
    return Mechanism(
        "slider_crank",
        [
            Body("ground", {"O": (0, 0)}),
            Body("crank", {"O": (0, 0), "P": (crank, 0)}, (0, 0, start)),
            Body("rod", {"P": (0, 0), "S": (rod, 0)}, (px, py, lean)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("P", ("crank.P", "rod.P")),
            Coordinate("guide", "rod.S", "y", offset),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(start, 1.0))],
        points={"slider": "rod.S"},
    )


def with_arm(linkage: Mechanism) -> Mechanism:
    """Return a four-bar with an arm next to it that has its own driver."""
    ground = Body("ground", {**linkage.bodies[0].points, "T": (9, 0)})
    return replace(
        linkage,
        bodies=(ground, *linkage.bodies[1:], Body("arm", {"T": (0, 0), "end": (1, 0)}, (9, 0, 0.3))),
        joints=(*linkage.joints, Revolute("T", ("ground.T", "arm.T"))),
        drivers=(*linkage.drivers, AngleDriver("arm", "arm", ConstantSpeed(0.3, 1.0))),
    )


def side_by_side(one: Mechanism, other: Mechanism, apart: float = 9.0) -> Mechanism:
    """Return a mechanism of pins and another one next to it in one file, whose names end in 2."""
    ground, *bodies = other.bodies
    pins = {f"{name}2": (point.x + apart, point.y) for name, point in ground.points.items()}
    copies = [
        Body(
            f"{body.name}2",
            {f"{name}2": point for name, point in body.points.items()},
            (body.start.x + apart, body.start.y, body.start.phi),
        )
        for body in bodies
    ]
    joints = [
        Revolute(
            f"{joint.name}2",
            tuple(f"{end.replace('.', '2.') if end[:6] != 'ground' else end}2" for end in joint.between),
        )
        for joint in other.joints
    ]
    drivers = [AngleDriver(f"{driver.name}2", f"{driver.of}2", driver.law) for driver in other.drivers]
    return replace(
        one,
        bodies=(Body("ground", {**one.bodies[0].points, **pins}), *one.bodies[1:], *copies),
        joints=(*one.joints, *joints),
        drivers=(*one.drivers, *drivers),
        points={},
    )


def with_second(linkage: Mechanism) -> Mechanism:
    """Return a four-bar and a copy next to it with its own driver: `second`, of `crank2`."""
    both = side_by_side(linkage, linkage)
    return replace(both, drivers=(*linkage.drivers, replace(both.drivers[-1], name="second")))


ROBOT_LENGTHS = 1.2, 4.0, 3.0  # of the arm, the link and the strut of `with_robot`
ROBOT_PIVOT = (6.0, -2.0)


def with_robot(linkage: Mechanism, start: float = 0.6) -> Mechanism:
    """A four-bar, an arm with a driver of its own, and two bars from its end to the rocker's: link and strut."""
    length, link, strut = ROBOT_LENGTHS
    rocker = next(body for body in linkage.bodies if body.name == "rocker")
    x, y, phi = rocker.start.x, rocker.start.y, rocker.start.phi
    d = complex(x, y) + rocker.points["Q"].x * cmath.exp(1j * phi)
    end = complex(*ROBOT_PIVOT) + length * cmath.exp(1j * start)
    way = end - d
    lean = math.acos((link**2 + abs(way) ** 2 - strut**2) / (2.0 * link * abs(way)))
    heading = cmath.phase(way) + lean
    back = d + link * cmath.exp(1j * heading) - end
    return replace(
        linkage,
        bodies=(
            Body("ground", {**linkage.bodies[0].points, "T": ROBOT_PIVOT}),
            *linkage.bodies[1:],
            Body("arm", {"T": (0, 0), "U": (length, 0)}, (*ROBOT_PIVOT, start)),
            Body("link", {"Q": (0, 0), "S": (link, 0)}, (d.real, d.imag, heading)),
            Body("strut", {"U": (0, 0), "S": (strut, 0)}, (end.real, end.imag, cmath.phase(back))),
        ),
        joints=(
            *linkage.joints,
            Revolute("T", ("ground.T", "arm.T")),
            Revolute("D", ("rocker.Q", "link.Q")),
            Revolute("U", ("arm.U", "strut.U")),
            Revolute("S", ("link.S", "strut.S")),
        ),
        drivers=(*linkage.drivers, AngleDriver("arm", "arm", ConstantSpeed(start, 1.0))),
    )


def folding_robot() -> Mechanism:
    """A five-bar whose bars fold over each other where its left arm is at 0 and its right one at 180 degrees."""
    left, right = 0.5, math.pi + 0.5
    p, q = cmath.exp(1j * left), 2.0 + cmath.exp(1j * right)
    way = q - p
    heading = cmath.phase(way) + math.acos(abs(way) / 3.0)
    back = p + 1.5 * cmath.exp(1j * heading) - q
    return Mechanism(
        "folding_robot",
        [
            Body("ground", {"A": (0, 0), "B": (2, 0)}),
            Body("left", {"A": (0, 0), "P": (1, 0)}, (0, 0, left)),
            Body("right", {"B": (0, 0), "Q": (1, 0)}, (2, 0, right)),
            Body("link", {"P": (0, 0), "S": (1.5, 0)}, (p.real, p.imag, heading)),
            Body("strut", {"Q": (0, 0), "S": (1.5, 0)}, (q.real, q.imag, cmath.phase(back))),
        ],
        [
            Revolute("A", ("ground.A", "left.A")),
            Revolute("B", ("ground.B", "right.B")),
            Revolute("P", ("left.P", "link.P")),
            Revolute("Q", ("right.Q", "strut.Q")),
            Revolute("S", ("link.S", "strut.S")),
        ],
        [
            AngleDriver("left", "left", ConstantSpeed(left, 1.0)),
            AngleDriver("right", "right", ConstantSpeed(right, 1.0)),
        ],
    )


def bar_linkage() -> Mechanism:
    """A four-bar whose coupler is only a distance: one unknown."""
    return Mechanism(
        "bar_linkage",
        [
            Body("ground", {"O": (0, 0), "C": (4, 0)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (0, 0, 1.0)),
            Body("rocker", {"C": (0, 0), "Q": (3, 0)}, (4, 0, 1.9)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("C", ("ground.C", "rocker.C")),
            Distance("coupler", ("crank.P", "rocker.Q"), 3.5),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(1.0, 1.0))],
    )


def uneven_chain(count: int) -> Mechanism:
    """`count` crank-rockers, each driven by the rocker before it, of different lengths: equal in formulas only."""
    first = math.radians(60.0)
    bodies = [
        Body("ground", {f"O_{k}": (4.0 * k, 0) for k in range(count + 1)}),
        Body("bar_0", {"O": (0, 0), "R": (1, 0)}, (0, 0, first)),
    ]
    joints = [Revolute("O_0", ("ground.O_0", "bar_0.O"))]
    for k in range(1, count + 1):
        bar = Body(f"bar_{k}", {"O": (0, 0), "P": (3.0 + 0.07 * k, 0), "R": (1, 0)}, (4.0 * k, 0, math.radians(100.0)))
        coupler = Body(
            f"coupler_{k}", {"P": (0, 0), "Q": (3.5 + 0.05 * k, 0)}, (4.0 * k - 3.5, 0.9, math.radians(40.0))
        )
        bodies += [bar, coupler]
        joints += [
            Revolute(f"O_{k}", (f"ground.O_{k}", f"bar_{k}.O")),
            Revolute(f"P_{k}", (f"bar_{k - 1}.R", f"coupler_{k}.P")),
            Revolute(f"Q_{k}", (f"coupler_{k}.Q", f"bar_{k}.P")),
        ]
    return Mechanism("uneven_chain", bodies, joints, [AngleDriver("crank", "bar_0", ConstantSpeed(first, 1.0))])


def wheels(rods: dict[str, tuple[int, int, float]], *, start: float = 0.5, second: bool = False) -> Mechanism:
    """Equal wheels of radius 0.5, 2 apart, that rods couple: name -> (wheel, other wheel, direction of the pin [rad]).

    second: next to them an arm with its own driver.
    """
    count, angle = 1 + max(wheel for _, wheel, _ in rods.values()), start
    pins: list[dict[str, tuple[float, float]]] = [{f"O{k}": (0.0, 0.0)} for k in range(count)]
    links, joints = [], [Revolute(f"O{k}", (f"ground.O{k}", f"wheel{k}.O{k}")) for k in range(count)]
    for name, (first, last, turn) in rods.items():
        for wheel, letter in ((first, "P"), (last, "Q")):
            pins[wheel][f"{letter}{name}"] = (0.5 * math.cos(turn), 0.5 * math.sin(turn))
            joints.append(Revolute(f"{letter}{name}", (f"wheel{wheel}.{letter}{name}", f"rod{name}.{letter}{name}")))
        x, y = 2.0 * first + 0.5 * math.cos(angle + turn), 0.5 * math.sin(angle + turn)
        links.append(Body(f"rod{name}", {f"P{name}": (0, 0), f"Q{name}": (2.0 * (last - first), 0)}, (x, y, 0.0)))
    bodies = [Body(f"wheel{k}", pins[k], (2.0 * k, 0.0, angle)) for k in range(count)] + links
    drivers = [AngleDriver("crank", "wheel0", ConstantSpeed(start, 1.0))]
    if second:
        bodies.append(Body("arm", {"S": (0, 0)}, (0.0, 3.0, 0.0)))
        joints.append(Revolute("S", ("ground.S", "arm.S")))
        drivers.append(AngleDriver("arm", "arm", ConstantSpeed(0.0, 1.0)))
    pivots = {f"O{k}": (2.0 * k, 0.0) for k in range(count)} | ({"S": (0.0, 3.0)} if second else {})
    return Mechanism("wheels", [Body("ground", pivots), *bodies], joints, drivers)


# --------------------------------------------------------------------------------------------------------------- scaled


def scaled(mechanism: Mechanism, factor: float) -> Mechanism:
    """The same mechanism `factor` times as large, at the same times; expressions are numbers in it.

    A factor that is a power of two changes no digit, any other leaves 15 decimal ones.
    """
    exact = math.frexp(factor)[0] == 0.5

    def larger(_: NumberPath, value: Any, quantity: Quantity) -> Any:
        power = int(Dimension.of(quantity).length)
        if value is None or isinstance(value, bool | int | str):
            return value
        product = float(value) * factor**power
        return product if exact else float(f"{product:.15g}")

    members = mechanism.members.changed(larger)
    return replace(
        mechanism,
        bodies=members.bodies,
        joints=members.joints,
        drivers=members.drivers,
        run=members.run,
        parameters={},
    )


# --------------------------------------------------------------------------------------------------------- open lengths


_NUMBER = re.compile(r"-?\d+\.\d+(e[-+]?\d+)?")


def with_open_lengths(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with parameters p0, p1, ... in place of all numbers of points, lengths and radii."""
    values: list[str] = []

    def opened(found: re.Match[str]) -> str:
        values.append(found.group())
        return f'"p{len(values) - 1}"'

    lines = []
    for line in text(mechanism).split("\n"):
        key, sign, rest = line.partition(" = ")
        is_length = key in ("points", "length", "radius", "radii") and not rest.startswith("[[")  # no table of a law
        lines.append(f"{key}{sign}{_NUMBER.sub(opened, rest)}" if is_length else line)
    head = [f'p{k} = "{value} {mechanism.length_unit}"' for k, value in enumerate(values)]
    if "[parameters]" in lines:
        at = lines.index("[parameters]") + 1
        lines[at:at] = head
    else:
        at = lines.index("[run]") if "[run]" in lines else lines.index("[bodies.ground]")
        lines[at:at] = ["[parameters]", *head, ""]
    return parse("\n".join(lines))
