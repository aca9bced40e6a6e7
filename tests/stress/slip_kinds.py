"""Slips of beginners: a sound mechanism file, and the same with one slip drawn at random."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from itertools import combinations
from random import Random
from typing import Any, NamedTuple

import numpy as np

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.quantities.placement import body_of, point_of
from kinfmu.mechanism.toml_document import document_of
from kinfmu.mechanism.toml_file import mechanism_of
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.system import placement, size_of

Document = dict[str, Any]
GALLERY = (
    *("crank_rocker", "double_crank", "triple_rocker", "watt_six_bar", "stephenson_six_bar", "peaucellier"),
    *("pantograph", "five_bar", "jansen_leg", "slider_crank", "offset_slider_crank", "inverted_slider_crank"),
    *("elliptic_trammel", "scotch_yoke", "fourbar"),
)
_OWN = {
    "wiper": """
        units.length = "mm"
        run = { start = 0, stop = 2, step = 0.01 }
        bodies.ground.points = { O = [0, 0], C = [140, -20] }
        bodies.crank.points = { O = [0, 0], P = [35, 0] }
        bodies.rod = { points = { P = [0, 0], Q = [140, 0] }, start = { x = 35, phi = "26 deg" } }
        bodies.lever = { points = { C = [0, 0], Q = [85, 0] }, start = { x = 140, y = -20, phi = "77 deg" } }
        bodies.blade = { points = { C = [0, 0], tip = [420, 0] }, start = { x = 140, y = -20, phi = "107 deg" } }
        joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
        joints.P = { type = "revolute", between = ["crank.P", "rod.P"] }
        joints.Q = { type = "revolute", between = ["rod.Q", "lever.Q"] }
        joints.C = { type = "revolute", between = ["ground.C", "lever.C"] }
        joints.hub = { type = "fixed", between = ["lever.C", "blade.C"], angle = "30 deg" }
        drivers.crank = { type = "angle", of = "crank", law = "constant_speed", speed = "30 rpm" }
        points.tip = "blade.tip"
    """,
    "crane": """
        run = { start = 0, stop = 5, step = 0.01 }
        bodies.ground.points = { O = [0, 0], foot = [1.2, -0.5] }
        bodies.boom = { points = { O = [0, 0], P = [4, 0], eye = [1.8, 0.4] }, start = { phi = "35 deg" } }
        bodies.jib = { points = { P = [0, 0], hook = [2.5, 0], eye = [-0.5, 0.6] }, start = { x = 3.28, y = 2.29 } }
        joints.O = { type = "revolute", between = ["ground.O", "boom.O"] }
        joints.P = { type = "revolute", between = ["boom.P", "jib.P"] }
        joints.tie = { type = "distance", between = ["ground.O", "jib.eye"], length = 4 }
        points.hook = "jib.hook"
        [drivers.cylinder]
        type = "distance"
        between = ["ground.foot", "boom.eye"]
        law = "3-4-5"
        start = 1.86
        rise = 0.3
        duration = 5
    """,
    "lifting_table": """
        units.length = "cm"
        run = { start = 0, stop = 2, step = 0.01 }
        bodies.ground.points = { A = [0, 0], B = [50, 0] }
        bodies.left = { points = { A = [0, 0], C = [40, 0] }, start = { phi = "60 deg" } }
        bodies.right = { points = { B = [0, 0], D = [38, 0] }, start = { x = 50, phi = "66 deg" } }
        bodies.beam = { points = { C = [0, 0], D = [45, 0], E = [22, 15] }, start = { x = 20, y = 34.6 } }
        bodies.mast = { points = { E = [0, 0], top = [0, 30] }, start = { x = 42, y = 50 } }
        bodies.table = { points = { top = [0, 0], F = [35, 0] }, start = { x = 42, y = 80, phi = "-20 deg" } }
        bodies.guide = { points = { B = [0, 0], F = [75, 0] }, start = { x = 50, phi = "70 deg" } }
        joints.A = { type = "revolute", between = ["ground.A", "left.A"] }
        joints.B = { type = "revolute", between = ["ground.B", "right.B"] }
        joints.C = { type = "revolute", between = ["left.C", "beam.C"] }
        joints.D = { type = "revolute", between = ["right.D", "beam.D"] }
        joints.E = { type = "fixed", between = ["beam.E", "mast.E"] }
        joints.top = { type = "revolute", between = ["mast.top", "table.top"] }
        joints.F = { type = "revolute", between = ["table.F", "guide.F"] }
        joints.guide = { type = "revolute", between = ["ground.B", "guide.B"] }
        points.edge = "table.F"
        [drivers.left]
        type = "angle"
        of = "left"
        law = "harmonic"
        start = "60 deg"
        amplitude = "8 deg"
        frequency = "0.5 Hz"
    """,
    "arm": """
        run = { start = 0, stop = 2, step = 0.01 }
        bodies.ground.points = { base = [0, 0] }
        bodies.upper = { points = { base = [0, 0], elbow = [0.5, 0] }, start = { phi = "70 deg" } }
        bodies.fore = { points = { elbow = [0, 0], wrist = [0.4, 0] }, start = { x = 0.171, y = 0.47 } }
        bodies.hand = { points = { wrist = [0, 0], tool = [0.15, 0] }, start = { x = 0.571, y = 0.47, phi = -1.05 } }
        joints.base = { type = "revolute", between = ["ground.base", "upper.base"] }
        joints.elbow = { type = "revolute", between = ["upper.elbow", "fore.elbow"] }
        joints.wrist = { type = "revolute", between = ["fore.wrist", "hand.wrist"] }
        joints.level = { type = "angle", of = "hand", value = "-60 deg" }
        drivers.upper = { type = "angle", of = "upper", law = "constant_speed", start = "70 deg", speed = "10 deg/s" }
        points.tool = "hand.tool"
        [drivers.elbow]
        type = "relative_angle"
        between = ["upper", "fore"]
        law = "constant_speed"
        start = "-70 deg"
        speed = "5 deg/s"
    """,
    "feeder": """
        units.length = "mm"
        run = { start = 0, stop = 2, step = 0.01 }
        bodies.ground.points = { O = [0, 0], C = [60, -40], way = [0, 55] }
        bodies.crank = { points = { O = [0, 0], P = [18, 0] }, start = { phi = "40 deg" } }
        bodies.rod = { points = { P = [0, 0], Q = [70, 0] }, start = { x = 13.8, y = 11.6, phi = "-5 deg" } }
        bodies.lever = { points = { C = [0, 0], Q = [51, 0], R = [80, 0] }, start = { x = 60, y = -40, phi = 1.12 } }
        bodies.link = { points = { R = [0, 0], S = [50, 0] }, start = { x = 95, y = 32, phi = "28 deg" } }
        bodies.slide = { points = { S = [0, 0], finger = [20, 5] }, start = { x = 139, y = 55 } }
        joints.O = { type = "revolute", between = ["ground.O", "crank.O"] }
        joints.P = { type = "revolute", between = ["crank.P", "rod.P"] }
        joints.Q = { type = "revolute", between = ["rod.Q", "lever.Q"] }
        joints.C = { type = "revolute", between = ["ground.C", "lever.C"] }
        joints.R = { type = "revolute", between = ["lever.R", "link.R"] }
        joints.S = { type = "revolute", between = ["link.S", "slide.S"] }
        joints.way = { type = "translational", between = ["ground.way", "slide.S"] }
        drivers.crank = { type = "angle", of = "crank", law = "constant_speed", start = "40 deg", speed = "30 rpm" }
        points.finger = "slide.finger"
    """,
}
NAMES = (*GALLERY, *_OWN)


@cache
def _sound(name: str) -> tuple[Mechanism, str]:
    if name in _OWN:
        mechanism = mechanism_of(document_of(f"name = '{name}'\n{_OWN[name]}", name), None)
    else:
        mechanism = kinfmu.load(name)
    return mechanism, text(mechanism, as_written=True)


class Sheet:
    """A sound mechanism file on which a slip is made: its tables, and where its points are at the start."""

    def __init__(self, name: str, rng: Random) -> None:
        self.mechanism, written = _sound(name)
        self.document: Document = document_of(written, name)
        self.rng = rng
        self.size = size_of(self.mechanism)
        run = kinfmu.solve(replace(self.mechanism, coordinates="all"), [self.mechanism.run.start], engine="python")
        count = run.coordinate_count
        self.q: FloatArray = run.values[0, :count]
        self.at = placement(self.mechanism, self.q.tolist())

    def world(self, point: str) -> tuple[float, float]:
        """Return where a point is, rounded as people write it."""
        x, y = self.at.point(point)
        return self.rounded(x), self.rounded(y)

    def rounded(self, length: float) -> float:
        """Return a length with the digits that people write."""
        return round(length, 4 - math.floor(math.log10(self.size)))

    def phi(self, body: str) -> float:
        """Return the angle of a body [rad]."""
        moving = [one.name for one in self.mechanism.moving_bodies]
        return float(self.q[3 * moving.index(body) + 2]) if body in moving else 0.0

    @property
    def pins(self) -> list[str]:
        return [name for name, joint in self.document["joints"].items() if joint["type"] == "revolute"]

    @property
    def moving(self) -> list[str]:
        return [body.name for body in self.mechanism.moving_bodies]

    def joints_at(self, body: str) -> list[str]:
        return [joint.name for joint in self.mechanism.joints if body in joint.bodies()]

    @property
    def driven(self) -> set[str]:
        return {body for driver in self.mechanism.drivers for body in driver.bodies()}


class Slip(NamedTuple):
    """A file with a slip, and the file that was meant."""

    meant: Document
    made: Document


Make = Callable[[Sheet], Slip | None]


def _deg(angle: float) -> str:
    return f"{math.degrees(math.remainder(angle, math.tau)):.4g} deg"


def _slip(sheet: Sheet, change: Callable[[Document], None]) -> Slip:
    made = copy.deepcopy(sheet.document)
    change(made)
    return Slip(sheet.document, made)


def pin_welded(sheet: Sheet) -> Slip | None:
    """A revolute joint is written as a fixed one, with or without the angle at which it is."""
    name = sheet.rng.choice(sheet.pins)
    i, j = map(body_of, sheet.document["joints"][name]["between"])
    has_angle = sheet.rng.random() < 0.5

    def change(document: Document) -> None:
        document["joints"][name]["type"] = "fixed"
        if has_angle:
            document["joints"][name]["angle"] = _deg(sheet.phi(j) - sheet.phi(i))

    return _slip(sheet, change)


def brace_added(sheet: Sheet) -> Slip | None:
    """A bar between two bodies too many, as a distance or as a body with two pins."""
    rng = sheet.rng
    points = list(sheet.mechanism.body_points)
    a, b = rng.sample(points, 2)
    length = math.dist(sheet.world(a), sheet.world(b))
    if body_of(a) == body_of(b) or length < 0.1 * sheet.size:
        return None
    (x, y), (to_x, to_y) = sheet.world(a), sheet.world(b)
    as_body = rng.random() < 0.5

    def change(document: Document) -> None:
        if not as_body:
            document["joints"]["brace"] = {"type": "distance", "between": [a, b], "length": sheet.rounded(length)}
            return
        document["bodies"]["brace"] = {
            "points": {"A": [0, 0], "B": [sheet.rounded(length), 0]},
            "start": {"x": x, "y": y, "phi": _deg(math.atan2(to_y - y, to_x - x))},
        }
        document["joints"]["brace_A"] = {"type": "revolute", "between": [a, "brace.A"]}
        document["joints"]["brace_B"] = {"type": "revolute", "between": [b, "brace.B"]}

    return _slip(sheet, change)


def unjoined_pin(sheet: Sheet) -> Slip | None:
    """A pin is dropped near its partner, so that no joint is made."""
    rng = sheet.rng
    name = rng.choice(sheet.pins)
    off = sheet.size * 10.0 ** rng.uniform(-4.0, -1.2)
    turn = rng.uniform(0.0, math.tau)

    def change(document: Document) -> None:
        between = document["joints"].pop(name)["between"]
        used = [point for joint in document["joints"].values() for point in joint.get("between", ())]
        for point in rng.sample(between, 2):
            if point not in used and isinstance(
                document["bodies"][body_of(point)]["points"][point_of(point)][0], float
            ):
                x, y = document["bodies"][body_of(point)]["points"][point_of(point)]
                moved = [sheet.rounded(x + off * math.cos(turn)), sheet.rounded(y + off * math.sin(turn))]
                document["bodies"][body_of(point)]["points"][point_of(point)] = moved
                break

    return _slip(sheet, change)


def hanging_link(sheet: Sheet) -> Slip | None:
    """A link hangs from one pin, its other end is free."""
    rng = sheet.rng
    point = rng.choice(list(sheet.mechanism.body_points))
    length, phi = sheet.rounded(sheet.size * rng.uniform(0.2, 1.0)), rng.uniform(-math.pi, math.pi)
    x, y = sheet.world(point)

    def change(document: Document) -> None:
        document["bodies"]["link_9"] = {
            "points": {"A": [0, 0], "B": [length, 0]},
            "start": {"x": x, "y": y, "phi": _deg(phi)},
        }
        document["joints"]["link_9"] = {"type": "revolute", "between": [point, "link_9.A"]}

    return _slip(sheet, change)


def stray_link(sheet: Sheet) -> Slip | None:
    """A link is left over, without a joint."""
    rng = sheet.rng
    x, y = (sheet.rounded(sheet.size * rng.uniform(-1.0, 2.0)) for _ in range(2))
    length, phi = sheet.rounded(sheet.size * rng.uniform(0.2, 1.0)), rng.uniform(-math.pi, math.pi)

    def change(document: Document) -> None:
        start = {"x": x, "y": y, "phi": _deg(phi)}
        document["bodies"]["link_9"] = {"points": {"A": [0, 0], "B": [length, 0]}, "start": start}

    return _slip(sheet, change)


def _without_body(document: Document, body: str) -> None:
    """Remove a body and all that names it."""
    del document["bodies"][body]
    for table in ("joints", "drivers", "loads", "measures", "points"):
        for name, entry in list(document.get(table, {}).items()):
            values = list(entry.values()) if isinstance(entry, dict) else [entry]
            texts = [one for value in values for one in (value if isinstance(value, list) else [value])]
            if any(isinstance(one, str) and body_of(one) == body for one in texts):
                del document[table][name]


def rocker_deleted(sheet: Sheet) -> Slip | None:
    """A link with two pins is deleted with its joints."""
    joints = sheet.document["joints"]
    named = {body_of(point) for point in sheet.mechanism.points.values()}
    links = [
        body
        for body in sheet.moving
        if body not in sheet.driven | named
        and len(sheet.joints_at(body)) == 2
        and all(joints[name]["type"] == "revolute" for name in sheet.joints_at(body))
    ]
    if not links:
        return None
    link = sheet.rng.choice(links)
    return _slip(sheet, lambda document: _without_body(document, link))


def weld_left_off(sheet: Sheet) -> Slip | None:
    """Two bodies that are one part are only pinned to each other, or not joined at all."""
    rng = sheet.rng
    meant = copy.deepcopy(sheet.document)
    welds = [name for name, joint in meant["joints"].items() if joint["type"] == "fixed"]
    if not welds:  # a body of three points or more, as two parts
        plates = [body for body in sheet.moving if len(meant["bodies"][body]["points"]) > 2]
        if not plates:
            return None
        plate = rng.choice(plates)
        points = meant["bodies"][plate]["points"]
        moved = rng.choice(list(points)[1:])
        shared = rng.choice([point for point in points if point != moved])
        start = copy.deepcopy(meant["bodies"][plate].get("start", {}))
        arm = {"points": {shared: points[shared], moved: points.pop(moved)}, "start": start}
        meant["bodies"] |= {"arm_2": arm}
        for table in ("joints", "drivers", "points"):
            for name, entry in meant.get(table, {}).items():
                _renamed(meant[table], name, entry, f"{plate}.{moved}", f"arm_2.{moved}")
        meant["joints"]["weld"] = {"type": "fixed", "between": [f"{plate}.{shared}", f"arm_2.{shared}"]}
        welds = ["weld"]
    weld = rng.choice(welds)
    made = copy.deepcopy(meant)
    if rng.random() < 0.5:
        del made["joints"][weld]
    else:
        made["joints"][weld] = {"type": "revolute", "between": made["joints"][weld]["between"]}
    return Slip(meant, made)


def _renamed(table: Document, key: str, value: Any, old: str, new: str) -> None:
    """Replace a text in a value of a table, and in what is below it."""
    if value == old:
        table[key] = new
    elif isinstance(value, list):
        table[key] = [new if one == old else one for one in value]
    elif isinstance(value, dict):
        for below, one in list(value.items()):
            _renamed(value, below, one, old, new)


def two_inputs(sheet: Sheet) -> Slip | None:
    """A second body is driven, too."""
    rng = sheet.rng
    bodies = [body for body in sheet.moving if body not in sheet.driven]
    if not bodies:
        return None
    body = rng.choice(bodies)

    def change(document: Document) -> None:
        law = {"law": "constant_speed", "start": _deg(sheet.phi(body)), "speed": "30 deg/s"}
        document["drivers"]["second"] = {"type": "angle", "of": body, **law}

    return _slip(sheet, change)


def input_on_the_coupler(sheet: Sheet) -> Slip | None:
    """The driver is on a body that is not at the ground, from where the law was or from where the body is."""
    rng = sheet.rng
    pinned = {
        body
        for joint in sheet.document["joints"].values()
        if any(body_of(point) == "ground" for point in joint.get("between", ()))
        for body in map(body_of, joint["between"])
    }
    couplers = [body for body in sheet.moving if body not in pinned]
    drivers = [name for name, one in sheet.document["drivers"].items() if one["type"] == "angle"]
    if not couplers or not drivers:
        return None
    driver, coupler, from_pose = rng.choice(drivers), rng.choice(couplers), rng.random() < 0.5
    is_renamed = rng.random() < 0.5

    def change(document: Document) -> None:
        document["drivers"][driver]["of"] = coupler
        if is_renamed:
            document["drivers"] = {
                coupler if name == driver else name: one for name, one in document["drivers"].items()
            }
        if from_pose:
            document["drivers"][coupler if is_renamed else driver]["start"] = _deg(sheet.phi(coupler))

    return _slip(sheet, change)


def frame_as_a_bar(sheet: Sheet) -> Slip | None:
    """The frame is drawn as a body like the others; nothing is on the ground, or one pin."""
    rng = sheet.rng
    points = {name: sheet.world(f"ground.{name}") for name in sheet.document["bodies"]["ground"]["points"]}
    first = sheet.rng.choice(list(points))
    keeps_pin, is_moved = rng.random() < 0.5, rng.random() < 0.5
    x, y = points[first] if is_moved else (0.0, 0.0)

    def change(document: Document) -> None:
        for table in ("joints", "drivers"):
            for name, entry in document[table].items():
                for point in points:
                    _renamed(document[table], name, entry, f"ground.{point}", f"frame.{point}")
        frame = {name: [sheet.rounded(px - x), sheet.rounded(py - y)] for name, (px, py) in points.items()}
        document["bodies"]["frame"] = {"points": frame, "start": {"x": x, "y": y, "phi": 0.0}}
        document["bodies"]["ground"]["points"] = {first: list(points[first])} if keeps_pin else {}
        if keeps_pin:
            document["joints"]["frame"] = {"type": "revolute", "between": [f"ground.{first}", f"frame.{first}"]}

    return _slip(sheet, change)


def joint_grounded(sheet: Sheet) -> Slip | None:
    """A pin between two moving bodies is on the ground, for both bodies or in place of one of them."""
    rng, joints = sheet.rng, sheet.document["joints"]
    pins = [name for name in sheet.pins if "ground" not in map(body_of, joints[name]["between"])]
    if not pins:
        return None
    pin = rng.choice(pins)
    end = rng.randrange(2)
    at = list(sheet.world(joints[pin]["between"][0]))
    in_place = rng.random() < 1.0 / 3.0

    def change(document: Document) -> None:
        document["bodies"]["ground"]["points"]["fixed_9"] = at
        if in_place:
            document["joints"][pin]["between"][end] = "ground.fixed_9"
        else:
            between = ["ground.fixed_9", joints[pin]["between"][end]]
            document["joints"]["fixed_9"] = {"type": "revolute", "between": between}

    return _slip(sheet, change)


def plate_held(sheet: Sheet) -> Slip | None:
    """A body that ought to move is held: its angle, a coordinate of one of its points, or a pin on the ground."""
    rng = sheet.rng
    bodies = [body for body in sheet.moving if body not in sheet.driven]
    plates = [body for body in bodies if len(sheet.document["bodies"][body]["points"]) > 2] or bodies
    if not plates:
        return None
    plate, how = rng.choice(plates), rng.randrange(3)
    point = f"{plate}.{rng.choice(list(sheet.document['bodies'][plate]['points']))}"
    at, axis = sheet.world(point), rng.randrange(2)

    def change(document: Document) -> None:
        held: Document = {"type": "angle", "of": plate, "value": _deg(sheet.phi(plate))}
        if how == 1:
            held = {"type": "coordinate", "of": point, "axis": "xy"[axis], "value": at[axis]}
        elif how == 2:
            held = {"type": "revolute", "between": ["ground.held_9", point]}
            document["bodies"]["ground"]["points"]["held_9"] = list(at)
        document["joints"]["held_9"] = held

    return _slip(sheet, change)


def start_mirrored(sheet: Sheet) -> Slip | None:
    """Start poses are mirrored: one angle has the wrong sign, two links are on the other side, or the whole is."""
    how = sheet.rng.randrange(4)
    turned = [body for body in sheet.moving if abs(math.sin(sheet.phi(body))) > 0.1]
    if not turned:
        return None
    body = sheet.rng.choice(turned)
    pairs = [
        (i, j)
        for i, j in combinations(sheet.moving, 2)
        for ends in [_outer_pins(sheet, i, j)]
        if ends and not {i, j} & sheet.driven
    ]
    pair = sheet.rng.choice(pairs) if pairs and how == 2 else None
    if how == 2 and pair is None:
        return None

    def change(document: Document) -> None:
        if how < 2:
            document["bodies"][body]["start"]["phi"] = _deg(-sheet.phi(body))
        elif how == 2 and pair is not None:
            _flip(sheet, document, pair)
        else:
            for one in sheet.moving:
                x, y = sheet.at.point(f"{one}.{next(iter(document['bodies'][one]['points']))}")
                document["bodies"][one]["start"] = {
                    "x": sheet.rounded(x),
                    "y": sheet.rounded(-y),
                    "phi": _deg(-sheet.phi(one)),
                }

    return _slip(sheet, change)


def _outer_pins(sheet: Sheet, i: str, j: str) -> tuple[str, str] | None:
    """Return the outer pins of two links that are pinned to each other and to one other body each."""
    joints = sheet.document["joints"]
    of_i, of_j = sheet.joints_at(i), sheet.joints_at(j)
    if len(of_i) != 2 or len(of_j) != 2 or len({*of_i} & {*of_j}) != 1:
        return None
    if any(joints[name]["type"] != "revolute" for name in (*of_i, *of_j)):
        return None
    (a,), (b,) = {*of_i} - {*of_j}, {*of_j} - {*of_i}
    return (
        next(point for point in joints[a]["between"] if body_of(point) == i),
        next(point for point in joints[b]["between"] if body_of(point) == j),
    )


def _flip(sheet: Sheet, document: Document, pair: tuple[str, str]) -> None:
    """Mirror two links about the line through their outer pins."""
    outer = _outer_pins(sheet, *pair)
    assert outer is not None
    a, b = (np.array(sheet.at.point(point)) for point in outer)
    line = math.atan2(b[1] - a[1], b[0] - a[0])
    for body, pin, place in ((pair[0], outer[0], a), (pair[1], outer[1], b)):
        own = document["bodies"][body]["points"]
        inner = next(
            point
            for name in sheet.joints_at(body)
            for point in sheet.document["joints"][name]["between"]
            if body_of(point) == body and point != pin
        )
        to = np.array(sheet.at.point(inner)) - place
        turn = 2.0 * (line - math.atan2(to[1], to[0]))
        phi = sheet.phi(body) + turn
        px, py = sheet.mechanism.body_points[pin]
        x = place[0] - (math.cos(phi) * px - math.sin(phi) * py)
        y = place[1] - (math.sin(phi) * px + math.cos(phi) * py)
        del own
        document["bodies"][body]["start"] = {"x": sheet.rounded(x), "y": sheet.rounded(y), "phi": _deg(phi)}


KINDS: Mapping[str, Make] = {
    "pin welded": pin_welded,
    "brace added": brace_added,
    "pin dropped near its partner": unjoined_pin,
    "hanging link": hanging_link,
    "stray link": stray_link,
    "rocker deleted": rocker_deleted,
    "weld left off": weld_left_off,
    "two inputs": two_inputs,
    "input on the coupler": input_on_the_coupler,
    "frame as a bar": frame_as_a_bar,
    "joint grounded": joint_grounded,
    "plate held": plate_held,
    "start pose mirrored": start_mirrored,
}
