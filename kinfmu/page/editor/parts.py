"""Operations that add a part: bars, joints, drivers, loads, points of interest."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import AngleDriver, RelativeAngleDriver
from kinfmu.mechanism.joints import Revolute
from kinfmu.mechanism.quantities.placement import body_of, point_of
from kinfmu.mechanism.toml_file import mechanism_of
from kinfmu.mechanism.valid import check_name, quoted
from kinfmu.page.editor.drawing import Drawing, Spot, written_angle, written_number
from kinfmu.page.editor.moving import carry
from kinfmu.page.editor.pen import OperationArguments, Pen, written_spot

_RUN = {"start": 0, "stop": 2, "step": 0.01}  # [s], of files without a run: one turn of a motor
_SPEED = "30 rpm"
_STROKE = 0.25  # of the drawn length of a cylinder
_LARGE = 60  # coordinates of a drawing; with more, finding a stroke takes too long
_FREE = 0.8  # of the way to a dead centre, which a cylinder goes
_SHORT = 0.5  # of a stroke; with less the other direction is looked at
_CYLINDER_TIME = 2  # [s]
_FORCE = 10.0  # [N]
_STIFFNESS = "1 N/mm"
_CAM_RISE = 0.25  # of the drawn distance from the pole: what a roller or a flat face of this size can follow
_ROLLER = 0.2  # of the same
_CAM_PARTS = (("cycloidal", 120, 1), ("dwell", 60, 0), ("cycloidal", 120, -1), ("dwell", 60, 0))  # law, [deg], rises
_ON_LINE = 1e-12  # of its length; a pin that is nearer is on the slot
_ROUND = 2  # digits of a default length


def bar(pen: Pen, values: OperationArguments) -> None:
    """Add a body with two points; an end on a point or a body is pinned there."""
    (first, a), (second, b) = (pen.target(values.target(key)) for key in ("from", "to"))
    if pen.is_same(a, b):
        raise values.error("its ends must be two places")
    name = pen.numbered_name("link")
    if values.has("body"):
        name = values.text("body")
        check_name("body", name)
        if name in pen.names():
            raise values.error(f"the name '{name}' is in use")
    ends: dict[str, Spot] = {}
    own = []
    for held, spot in ((first, a), (second, b)):
        wanted = point_of(held) if held else ""
        letter = wanted if wanted and wanted not in ends else pen.letter(ends)
        ends[letter] = spot
        own.append(letter)
    pen.add_body(name, ends)
    for held, letter in zip((first, second), own, strict=True):
        if held:
            pen.pin(held, f"{name}.{letter}")


def point(pen: Pen, values: OperationArguments) -> None:
    """Add a point of a body."""
    body, spot = pen.body(values.text("body")), values.spot("at")
    before = len(pen.edits)
    found = pen.add_point(body, spot)
    if len(pen.edits) == before:
        raise values.error(f"there is a point already: {found}")


def ground(pen: Pen, values: OperationArguments) -> None:
    """Add a point of the ground; on a point or a body also a pin."""
    held, spot = pen.target(values.target("at"))
    if held and body_of(held) == GROUND_NAME:
        raise values.error(f"{held} is on the ground already")
    if held and any(body_of(other) == GROUND_NAME for other in pen.drawing.pins.get(held, ())):
        raise values.error(f"{held} is pinned to the ground already")
    before = len(pen.edits)
    at = pen.add_point(GROUND_NAME, spot, point_of(held) if held else "")
    if held:
        pen.pin(at, held)
    elif len(pen.edits) == before:
        raise values.error(f"there is a point already: {at}")


def pin(pen: Pen, values: OperationArguments) -> None:
    """Add a revolute joint between two points, or between two bodies at a place."""
    if not values.has("points"):
        first, second = (pen.body(name) for name in values.texts("bodies", 2))
        _, spot = pen.target(values.target("at"))
        a = pen.add_point(first, spot)
        pen.pin(a, pen.add_point(second, spot, point_of(a)))
        return
    first, second = (pen.drawing.point(one, f"{values.name}: points") for one in values.texts("points", 2))
    if second in pen.drawing.pins[first]:
        raise values.error(f"{first} and {second} are pinned together already")
    if body_of(second) == GROUND_NAME:
        first, second = second, first
    pen.pin(first, second)
    if not pen.is_same(pen.spot(first), pen.spot(second)):
        carry(pen, second, pen.spot(first))


def motor(pen: Pen, values: OperationArguments) -> None:
    """Add a driver of the angle of a body relative to one that it is pinned to, first the ground."""
    body = pen.body(values.text("body"))
    if body == GROUND_NAME:
        raise values.error("the ground does not turn; choose another body")
    pinned = [*pen.drawing.pinned_to(body)]
    if values.has("joint"):
        name = values.text("joint")
        joint = next((one for one in pen.drawing.mechanism.joints if one.name == name), None)
        if joint is None or body not in joint.bodies():
            raise values.error(f"{quoted(name)} is not a joint of {body}")
        pinned = [one for one in joint.bodies() if one != body and one in pinned]
    if not pinned:
        raise values.error(f"{body} is not pinned to anything there; pin it to the ground or to another body first")
    against = GROUND_NAME if GROUND_NAME in pinned else pinned[0]
    turned = {GROUND_NAME, body, against}
    for driver in pen.drawing.mechanism.drivers:
        if isinstance(driver, AngleDriver | RelativeAngleDriver) and {GROUND_NAME, *driver.bodies()} == turned:
            raise values.error(f"driver '{driver.name}' turns {body} already")
    poses = pen.drawing.poses
    what: dict[str, Any] = {"type": "angle", "of": body}
    if against != GROUND_NAME:
        what = {"type": "relative_angle", "between": [against, body]}
    start = written_angle(poses[body][2] - poses[against][2])
    name = pen.free_name("motor")
    pen.put(("drivers", name), what | {"law": "constant_speed", "start": start, "speed": _SPEED})
    _add_run(pen)


def _add_run(pen: Pen) -> None:
    if "run" not in pen.document:
        pen.put(("run",), _RUN)


def slider(pen: Pen, values: OperationArguments) -> None:
    """Let a point slide along a line of the ground or of another body; as a block, without turning."""
    holder = pen.body(values.text("on", GROUND_NAME))
    along, is_block = values.spot("along"), values.truth("block")
    moved = _point_of_body(pen, values)
    if body_of(moved) == holder:
        raise values.error(f"{moved} is a point of {holder}; a slide is between two bodies")
    at = pen.add_point(holder, pen.spot(moved), point_of(moved))
    _unpin(pen, moved, holder)
    line = {"between": [at, moved], "axis": _axis(pen, values, holder, along)}
    if is_block:
        poses = pen.drawing.poses
        turn = {"angle": written_angle(poses[body_of(moved)][2] - poses[holder][2])}
        pen.put(("joints", pen.free_name(point_of(moved))), {"type": "translational", **line, **turn})
    else:
        pen.put(("joints", pen.free_name(point_of(moved))), {"type": "point_on_line", **line})


def _unpin(pen: Pen, point: str, body: str) -> None:
    """Remove the pin between a point that is to slide and a body."""
    for joint in pen.drawing.mechanism.joints:
        if isinstance(joint, Revolute) and point in joint.between and body in joint.bodies():
            pen.remove(("joints", joint.name))


def _axis(pen: Pen, values: OperationArguments, holder: str, along: Spot) -> str:
    """Return the angle of a direction of the world in the frame of a body, as it is written."""
    if along == (0.0, 0.0):
        raise values.error("the line needs a direction")
    return written_angle(_turned(math.atan2(along[1], along[0]) - pen.drawing.poses[holder][2]))


def _turned(angle: float) -> float:
    """Return an angle [rad] from -pi to pi."""
    return angle if -math.pi <= angle <= math.pi else math.remainder(angle, math.tau)


def _point_of_body(pen: Pen, values: OperationArguments) -> str:
    """Return the point that slides: a point of a body, or a new one."""
    moved, _ = pen.target(values.target("point"))
    if moved is None:
        raise values.error("its point must be on a body")
    return moved


def slot(pen: Pen, values: OperationArguments) -> None:
    """Let a point run in a slot of a body, which is moved onto the point."""
    moved = _point_of_body(pen, values)
    body, a, b = pen.body(values.text("body")), values.spot("from"), values.spot("to")
    if body_of(moved) == body:
        raise values.error(f"{moved} is a point of {body}; a slot is in another body")
    along = (b[0] - a[0], b[1] - a[1])
    length = math.hypot(*along)
    if pen.is_same(a, b):
        raise values.error("its ends must be two places")
    x, y = pen.spot(moved)
    normal = (-along[1] / length, along[0] / length)
    off = (x - a[0]) * normal[0] + (y - a[1]) * normal[1]
    shift = (0.0, 0.0) if abs(off) <= _ON_LINE * length else (off * normal[0], off * normal[1])
    _unpin(pen, moved, body)
    first, _ = (pen.add_point(body, (end[0] + shift[0], end[1] + shift[1])) for end in (a, b))
    line = {"between": [first, moved], "axis": _axis(pen, values, body, along)}
    pen.put(("joints", pen.free_name(point_of(moved))), {"type": "point_on_line", **line})


def _ends(pen: Pen, values: OperationArguments) -> tuple[list[str], float]:
    """Return the two points of a part between bodies, and their distance."""
    (a, first), (b, second) = (pen.target(values.target(key), ground=True) for key in ("from", "to"))
    if a is None or b is None or body_of(a) == body_of(b):
        raise values.error("its ends must be on two bodies, or on a body and the ground")
    if pen.is_same(first, second):
        raise values.error("its ends must be two places")
    return [a, b], math.dist(first, second)


def _rounded(value: float) -> float | int:
    return written_number(float(f"{value:.{_ROUND}g}"))


def cylinder(pen: Pen, values: OperationArguments) -> None:
    """Add a driver of the distance of two points; its stroke is one that the drawing allows."""
    ends, length = _ends(pen, values)
    rise = values.number("stroke") if values.has("stroke") else _rounded(_STROKE * length)
    if rise == 0.0:
        raise values.error("stroke = 0 must be other than 0")
    law = {"law": "3-4-5", "start": written_number(length), "rise": written_number(rise), "duration": _CYLINDER_TIME}
    name = pen.numbered_name("cylinder")
    pen.put(("drivers", name), {"type": "distance", "between": ends, **law})
    if not values.has("stroke"):
        tried = replace(pen.drawing, document=pen.document, mechanism=mechanism_of(pen.document, pen.drawing.folder))
        stroke = _possible_stroke(tried, name, length, rise)
        pen.put(("drivers", name, "rise"), _rounded(stroke))
    _add_run(pen)


def _possible_stroke(drawing: Drawing, driver: str, length: float, wanted: float) -> float:
    """Return the stroke of a cylinder, out or else in, that ends well before a dead centre; the wanted one at most."""
    best = 0.0
    if len(drawing.system.coordinates) <= _LARGE:
        for stroke in (wanted, -wanted):
            if abs(best) < _SHORT * wanted:
                best = max(best, _FREE * (drawing.reached(driver, length + stroke / _FREE) - length), key=abs)
    return best if abs(best) >= _SHORT * _SHORT * wanted else wanted


def gear(pen: Pen, values: OperationArguments) -> None:
    """Add a pair of gears on the body that holds both pivots."""
    first, second = (pen.body(name) for name in values.texts("bodies", 2))
    if first == second or GROUND_NAME in (first, second):
        raise values.error("a pair of gears is two bodies other than the ground")
    ratio = values.number("ratio") if values.has("ratio") else -1.0
    drawing = pen.drawing
    both = [name for name in drawing.pinned_to(first) if name in drawing.pinned_to(second)]
    if not both:
        raise values.error(f"{first} and {second} must both be pinned to the ground or to one other body")
    carrier = GROUND_NAME if GROUND_NAME in both else both[0]
    i, j, k = (drawing.poses[name][2] for name in (first, second, carrier))
    joint: dict[str, Any] = {"type": "gear", "between": [first, second], "ratio": written_number(ratio)}
    if carrier != GROUND_NAME:
        joint["carrier"] = carrier
    offset = (j - k) - ratio * (i - k)
    if offset != 0.0:
        joint["offset"] = written_angle(offset)
    pen.put(("joints", pen.numbered_name("gear")), joint)


def cam(pen: Pen, values: OperationArguments) -> None:
    """Add a cam that a roller or a flat face of a follower touches, with a rise, a dwell, a return and a dwell."""
    body = pen.body(values.text("body"))
    kind = values.text("kind", "roller")
    if kind not in ("roller", "flat_face"):
        raise values.wrong("kind", "'roller' or 'flat_face'")
    pinned = pen.drawing.pinned_to(body)
    if not pinned:
        raise values.error(f"{body} is not pinned to anything; pin the cam to the ground or to another body first")
    pole = pinned.get(GROUND_NAME) or next(iter(pinned.values()))
    touching, spot = pen.target(values.target("follower"))
    if touching is None or body_of(touching) in (body, GROUND_NAME):
        raise values.error("its follower must be a point of another body that can move")
    x, y = pen.spot(pole)
    away = (spot[0] - x, spot[1] - y)
    distance = math.hypot(*away)
    if pen.is_same((x, y), spot):
        raise values.error("the follower must be away from the pivot of the cam")
    rise = values.number("rise") if values.has("rise") else _rounded(_CAM_RISE * distance)
    towards = math.atan2(away[1], away[0])
    segments = [
        {"law": law, "duration": f"{turn} deg"} | ({"rise": written_number(sign * rise)} if sign else {})
        for law, turn, sign in _CAM_PARTS
    ]
    law = {"law": "sequence", "start": written_number(distance), "repeat": True, "segments": segments}
    law["begin"] = written_angle(_turned(towards - pen.drawing.poses[body][2]))
    element: dict[str, Any] = {"type": "cam_roller", "between": [pole, touching]}
    if kind == "flat_face":
        normal = _turned(towards - pen.drawing.poses[body_of(touching)][2])
        element |= {"type": "cam_flat_face", "normal": written_angle(normal)}
    else:
        element["roller_radius"] = _rounded(_ROLLER * distance)
    pen.put(("joints", pen.numbered_name("cam")), element | law)


def spring(pen: Pen, values: OperationArguments) -> None:
    """Add a spring between two points, without force as drawn."""
    ends, length = _ends(pen, values)
    stiffness: Any = _STIFFNESS
    if values.has("stiffness"):
        stiffness = values.any("stiffness")
        if not isinstance(stiffness, str):
            stiffness = written_number(values.number("stiffness"))
    load = {"type": "spring", "between": ends, "stiffness": stiffness, "free_length": written_number(length)}
    pen.put(("loads", pen.numbered_name("spring")), load)


def force(pen: Pen, values: OperationArguments) -> None:
    """Add a constant force at a point."""
    at, spot = pen.target(values.target("at"))
    if at is None or body_of(at) == GROUND_NAME:
        raise values.error("it must act on a body that can move")
    if values.has("vector"):
        x, y = values.spot("vector")
    else:
        to = values.spot("to")
        if pen.is_same(spot, to):
            raise values.error("it needs a direction")
        size = math.dist(spot, to)
        x, y = (float(f"{_FORCE * (end - begin) / size:.12g}") + 0.0 for begin, end in zip(spot, to, strict=True))
    numbers = dict(zip(("x", "y"), written_spot((x, y)), strict=True))
    pen.put(("loads", pen.numbered_name("force")), {"type": "force", "at": at, **numbers})


def interest(pen: Pen, values: OperationArguments) -> None:
    """Make a point of a body a point of interest."""
    at, _ = pen.target(values.target("at"))
    if at is None:
        raise values.error("it must be on a body")
    if values.has("name"):
        name = values.text("name")
        check_name("name", name)
        if name in pen.names():
            raise values.error(f"the name '{name}' is in use")
    else:
        name = pen.free_name(point_of(at))
    if at in pen.drawing.mechanism.points.values():
        raise values.error(f"{at} is a point of interest already")
    pen.put(("points", name), at)
