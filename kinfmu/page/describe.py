"""The data of a page: what is drawn of a mechanism, what can be set, and what the report of `check` states.

Points, shapes and loops refer to points by number, so that the page can draw the mechanism with other lengths. Lengths
are in the file's unit, angles in radians.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from kinfmu.analysis import Report
from kinfmu.analysis.loops import FourBar, Place
from kinfmu.analysis.measuring import turns_of_cycle
from kinfmu.analysis.summary import contact_text
from kinfmu.draw.instant import instant
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.instant import Instant, gravity_direction
from kinfmu.draw.scene.joints import Slide, slides
from kinfmu.draw.scene.loads import EFFORT_UNITS, load_text
from kinfmu.draw.scene.shape import Shape
from kinfmu.draw.scene.shapes import shapes
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import CoordinateDriver, DistanceDriver, Driver, SlideDriver
from kinfmu.mechanism.expression import Computed, Expression
from kinfmu.mechanism.force_names import force_names, reaction_names_of
from kinfmu.mechanism.joints import CamFlatFace, CamRoller, Coordinate, Distance, PointOnLine, Revolute, Translational
from kinfmu.mechanism.joints.joint import Joint
from kinfmu.mechanism.laws import ConstantValue
from kinfmu.mechanism.loads import Following, ForceAlong, ForceAt
from kinfmu.mechanism.members import NumberPath
from kinfmu.mechanism.opened import AXES, dependent_points, number_data, parameters_of, place_text
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.quantities.placement import body_of, unit_vector
from kinfmu.mechanism.toml_text import text
from kinfmu.motion.cams.placed import members_of
from kinfmu.page.module import PageModule
from kinfmu.plan.undetermined import undetermined_reactions
from kinfmu.units import Quantity, unit_of
from kinfmu.version import VERSION

_DIGITS = 7  # of numbers that are only drawn
_NOT_DRAWN = ("rib", "contact")  # the page finds corners and ribs of a link from its points
_ON_LINES = ("rail", "bed", "slot", "rod", "block", "die")
CAM_SHAPES = ("cam", "pitch", "face")  # kinds; a cam with one of them is known


def describe(mechanism: Mechanism, report: Report) -> dict[str, Any]:
    """Return the data of a page without its modules.

    Args:
        mechanism: The mechanism.
        report: Its report, without a problem.

    """
    return drawn(instant(mechanism, plan=report.plan), report)


def drawn(shown: Instant, report: Report | None = None) -> dict[str, Any]:
    """Return the data of a page without its modules.

    Args:
        shown: The pose that is drawn.
        report: The report of its mechanism, without a problem. Default: nothing that a report states, as of a mechanism
            that is only drawn in part.

    """
    mechanism = shown.mechanism
    numbers = {name: k for k, name in enumerate(mechanism.body_points)}
    sliding = slides(shown)
    along = {body: iter([slide for slide in sliding if slide.holder == body]) for body in shown.poses}  # of rods
    lines = {slide.name: slide for slide in sliding}
    found = []
    every = shapes(shown)
    for shape in every:
        if shape.is_load:
            continue
        slide = next(along[shape.frame]) if shape.kind == "rod" else lines.get(shape.name)
        found.append(_shape(shown, shape, numbers) | _line(shape, slide, numbers))
    cams = {shape["name"] for shape in found if shape["kind"] in CAM_SHAPES}
    bodies = [GROUND_NAME, *(body.name for body in mechanism.moving_bodies)]
    return {
        "name": mechanism.name,
        "title": mechanism.title,
        "unit": mechanism.length_unit,
        "version": VERSION,
        "run": {"from": float(mechanism.run.start), "to": float(mechanism.run.stop), "step": float(mechanism.run.step)},
        "bodies": [{"name": name, "colour": list(shown.colour(name))} for name in bodies],
        "points": [
            {"body": body_of(name), "name": name.partition(".")[2], "x": float(x), "y": float(y)}
            for name, (x, y) in mechanism.body_points.items()
        ],
        "joints": [_joint(mechanism, joint, numbers) for joint in mechanism.joints],
        "drivers": [_driver(driver, shown, report, numbers) for driver in mechanism.drivers],
        "interest": [
            {"name": name, "point": numbers[point], "colour": list(palette.body(len(bodies) - 1 + k))}
            for k, (name, point) in enumerate(mechanism.points.items())
        ],
        "loads": [_load(mechanism, shape, numbers) for shape in every if shape.is_load],
        "gravity": _gravity(mechanism),
        "cams": [cam_data(mechanism, joint, numbers) for joint in shown.joints if joint.name in cams],
        "shapes": [shape for shape in found if shape["kind"] not in _NOT_DRAWN],
    } | _reported(report, numbers)


def _reported(report: Report | None, numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return what a report states."""
    if report is None:
        return {"loops": [], "notes": [], "unknownContacts": [], "mobility": None, "redundant": []}
    return {
        "loops": list(_loops(report, numbers)),
        "notes": list(report.notes),
        "unknownContacts": [*map(contact_text, report.loading.unknown_contacts)] if report.loading else [],
        "mobility": report.mobility,
        "redundant": [row.row.owner for row in report.redundant],
    }


def module_data(module: PageModule, places: Mapping[str, NumberPath]) -> dict[str, Any]:
    """Return the text of a module and what its numbers are; places: of parameters for plain numbers of the file."""
    mechanism, plan = module.plan.mechanism, module.plan
    unit = mechanism.length_unit
    users = dependent_points(mechanism)
    quantities = {str(name): name.quantity for name in (*force_names(mechanism), *reaction_names_of(mechanism))}
    parameters = [
        _parameter(one.name, one.value, one.quantity, unit, description=one.description, place=places.get(one.name))
        | {"points": users.get(one.name, [])}
        for one in plan.parameters
    ]
    parameters += [
        _parameter(one.name, one.value, one.quantity, unit)
        | {
            "label": f"{one.owner} {one.key}",
            "short": f"{one.owner} {one.key}",
            "inFile": "",
            "points": [],
            "isLaw": True,
        }
        for one in plan.law_constants
    ]
    return {
        "text": module.text,
        "outputs": [
            {
                "name": name,
                "owner": name.owner,
                "units": [unit_of(name.quantity(order), unit) for order in range(3)],
                "names": [name.derivative(order) for order in range(3)],
            }
            for name in plan.outputs
        ],
        "fixed": list(plan.fixed),
        "parameters": parameters,
        "forces": [{"name": name, "unit": unit_of(quantities[name], unit)} for name in module.forces],
        "reactions": [{"name": name, "unit": unit_of(quantities[name], unit)} for name in module.reactions],
        "undetermined": list(dict.fromkeys(name.owner for name in undetermined_reactions(plan))),
        "externals": list(module.loads),
    }


def _parameter(
    name: str, value: float, quantity: Quantity, unit: str, *, description: str = "", place: NumberPath | None = None
) -> dict[str, Any]:
    declared = "" if quantity.kind == "number" else unit_of(quantity, unit)
    group = str(place[0] if len(place) == 2 else place[1]) if place else ""
    return {
        "name": place_text(place) if place else name,
        "label": label_of(place) if place else name,
        "short": label_of(place).removeprefix(group).lstrip(". ") if place else name,
        "group": group,
        "kind": quantity.kind,
        "unit": declared,
        "inFile": "" if place else declared,
        "value": float(value),
        "description": description,
        "isPlace": place is not None,
        "isLaw": False,
    }


def _line(shape: Shape, slide: Slide | None, numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return for a shape of a slide its holder, its sliding point, and a point of its line if that has a name."""
    if slide is None or shape.kind not in _ON_LINES or (shape.kind == "rail" and slide.holder != GROUND_NAME):
        return {}
    return {"line": {"holder": slide.holder, "point": numbers[slide.point], "origin": numbers.get(slide.origin)}}


def label_of(place: NumberPath) -> str:
    """Return the place of a number in words: 'crank.P x', 'AB length', 'gravity y'."""
    if place[0] == "gravity":
        return " ".join(map(str, place))
    if place[0] == "bodies":
        _, body, *rest = place
        if isinstance(rest[-1], int):
            return f"{body}.{rest[-2]} {AXES[rest[-1]]}"
        return f"{body} {' '.join(map(str, rest))}"
    return " ".join(str(part) for part in place[1:] if part != "law")


def written_file(mechanism: Mechanism, module: PageModule, places: Mapping[str, NumberPath]) -> str:
    """Return the mechanism file with "{{name}}" in place of each number that the page can set.

    Start poses are "{{start crank.phi}}", so that the file assembles on the branch that the page shows.
    """
    paths = {path: place_text(path) for path in places.values()}
    paths |= {("drivers", one.owner, "law", one.key): one.name for one in module.plan.law_constants}
    known = {*module.plan.outputs, *module.plan.fixed}

    def slot(name: str, value: float) -> Any:
        expression = copy.copy(Expression("0", mechanism.length_unit))
        object.__setattr__(expression, "text", f"{{{{{name}}}}}")
        return Computed(value, expression)

    def changed(path: NumberPath, value: Any, _: Quantity) -> Any:
        if path in paths:
            return slot(paths[path], float(value))
        if path[0] == "bodies" and path[2] == "start" and f"{path[1]}.{path[3]}" in known:
            return slot(f"start {path[1]}.{path[3]}", float(value))
        return value

    members = mechanism.members.changed(changed)
    settable = {parameter.name for parameter in module.plan.parameters}
    parameters = {
        name: Parameter(slot(name, 0.0), parameter.quantity, parameter.description) if name in settable else parameter
        for name, parameter in mechanism.parameters.items()
    }
    written = copy.copy(mechanism)
    for key in ("bodies", "joints", "drivers", "loads", "measures", "gravity", "run"):
        object.__setattr__(written, key, getattr(members, key))
    object.__setattr__(written, "parameters", parameters)
    return text(written)


def _joint(mechanism: Mechanism, joint: Joint, numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return a joint with the numbers of its points, its parameters, and its slide in the first body's frame."""
    found: dict[str, Any] = {"name": joint.name, "type": joint.type}
    points = getattr(joint, "between", ()) if not hasattr(joint, "of") else (joint.of,)
    if all(point in numbers for point in points):
        found["points"] = [numbers[point] for point in points]
    if isinstance(joint, Translational | PointOnLine):
        found["axis"] = float(joint.axis)
    if isinstance(joint, Coordinate):
        found["across"] = joint.axis
    names = parameters_of(mechanism, joint)
    return found | ({"numbers": names} if names else {})


def _driver(driver: Driver, shown: Instant, report: Report | None, numbers: Mapping[str, int]) -> dict[str, Any]:
    kind = driver.quantity.kind
    found: dict[str, Any] = {
        "name": driver.name,
        "kind": kind,
        "type": driver.type,
        "law": driver.law.type,
        "unit": unit_of(driver.quantity, shown.mechanism.length_unit),
        "inputs": [str(name) for name in driver.inputs()],
        "start": float(driver.law.at(shown.mechanism.run.start)),
        "direction": shown.directions.get(driver.name, 1.0),
        "loadTurns": turns_of_cycle(shown.mechanism, 1) if len(shown.mechanism.drivers) == 1 else 1,
        "turns": None,
        "limits": [],
        "changePoints": [],
    }
    if isinstance(driver, DistanceDriver | SlideDriver):
        found["points"] = [numbers[point] for point in driver.between]
    elif isinstance(driver, CoordinateDriver):
        found["points"] = [numbers[driver.of]]
        found["across"] = driver.axis
    else:
        *held, body = driver.bodies()
        against = held[0] if held else GROUND_NAME
        pin = shown.pivot(body, against)
        found |= {"body": body, "against": against, "pivot": numbers[pin] if pin else None}
    if isinstance(driver, SlideDriver):
        found["axis"] = float(driver.axis)
    for reach in report.ranges if report else ():
        if reach.driver == driver.name:
            found["turns"] = reach.turns and math.lcm(reach.turns, found["loadTurns"])
            found["reach"] = list(reach.reach)
            found["limits"] = [{"at": limit.value, "text": limit.kind} for limit in reach.limits]
            found["changePoints"] = [point.value for point in reach.points if point.kind == "change point"]
    return found


def _load(mechanism: Mechanism, shape: Shape, numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return the symbol of a load; its points are numbers, none if the origin of its body has no name."""
    (load,) = (one for one in mechanism.loads if one.name == shape.name)
    ends, places = [*zip((shape.frame, shape.other), shape.points.tolist(), strict=False)], mechanism.body_points
    found: dict[str, Any] = {
        "name": load.name,
        "type": load.type,
        "colour": list(shape.colour),
        "text": load_text(load),
        "frame": shape.frame,
        "axes": shape.other,
        "points": [
            next(number for name, number in numbers.items() if body_of(name) == body and tuple(point) == places[name])
            for body, point in ends
            if any(body_of(name) == body and tuple(point) == places[name] for name in numbers)
        ],
    } | _strips(shape)
    numbers_of = {key: getattr(load, key) for key in ("x", "y") if isinstance(load, ForceAt)}
    if isinstance(load, ForceAlong):
        numbers_of["angle"] = load.angle
        found["isAgainst"] = float(np.dot(shape.towards, unit_vector(float(load.angle)))) < 0.0
    law = getattr(load, "law", None)
    if isinstance(load, Following) and isinstance(law, ConstantValue):
        found["level"] = number_data(mechanism, ("loads", load.name, "law", "level"), float(law.level))
        found["unit"] = EFFORT_UNITS[load.noun]
    return found | {
        key: number_data(mechanism, ("loads", load.name, key), float(value)) for key, value in numbers_of.items()
    }


def _strips(shape: Shape) -> dict[str, Any]:
    """Return the lines of a symbol with their rows of the table of strokes."""
    if not shape.strips:
        return {}
    return {"strips": [{"points": _rounded(strip.points), "stroke": strip.stroke} for strip in shape.strips]}


def _gravity(mechanism: Mechanism) -> list[float] | None:
    """Return the acceleration of free fall, if it is drawn."""
    if mechanism.gravity is None or gravity_direction(mechanism) is None:
        return None
    return [float(value) for value in mechanism.gravity]


def _shape(shown: Instant, shape: Shape, numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return a shape whose points are numbers of points of its body, or coordinates in its frame."""
    found: dict[str, Any] = {"kind": shape.kind, "name": shape.name, "frame": shape.frame, "colour": list(shape.colour)}
    if shape.kind == "link":
        found["at"] = [number for name, number in numbers.items() if body_of(name) == shape.frame]
    elif shape.kind in ("bar", "barrel", "shaft"):
        members: list[Joint | Driver] = [*shown.joints, *shown.drivers]
        (member,) = (one for one in members if one.name == shape.name and isinstance(one, Distance | DistanceDriver))
        found["between"] = [numbers[point] for point in member.between]
    else:
        anchor = _nearest(shown, shape, numbers)
        if anchor is not None:
            found["anchor"] = anchor
    if shape.kind in ("cam", "pitch"):
        pole = next(
            (
                joint.between[0]
                for joint in shown.joints
                if isinstance(joint, CamRoller | CamFlatFace) and joint.name == shape.name
            ),
            None,
        )
        if pole is not None:  # the file has the pitch curve itself, not what the roller does
            found["anchor"] = numbers[pole]
    if shape.kind.startswith("die") or shape.frame.startswith("die."):
        (joint,) = (one for one in shown.joints if f"die.{one.name}" == shape.frame)
        point = joint.of if isinstance(joint, Coordinate) else joint.between[1]  # type: ignore[attr-defined]
        found["follows"] = numbers[point]
    found["points"] = _rounded(shape.points)
    if shape.radius:
        found["radius"] = round(float(shape.radius), _DIGITS)
    if shape.is_closed:
        found["closed"] = True
    if shape.direction is not None:
        found["direction"] = _rounded(shape.direction)
    if shape.other:
        found["axes"] = shape.other
    return found | _strips(shape)


def _nearest(shown: Instant, shape: Shape, numbers: Mapping[str, int]) -> int | None:
    """Return the number of the point of the shape's body that is nearest to it; the shape moves with the point."""
    places = {name: np.array(shown.body_points[name]) for name in numbers if body_of(name) == shape.frame}
    if not places:
        return None
    middle = shape.points.mean(axis=0)
    return numbers[min(places, key=lambda name: float(np.hypot(*(places[name] - middle))))]


def _rounded(values: Any) -> Any:
    """Return numbers with seven digits after the point of their own size, as lists."""
    array = np.asarray(values, dtype=float)
    largest = float(np.abs(array).max(initial=0.0))
    digits = _DIGITS - (math.ceil(math.log10(largest)) if largest > 0.0 else 0)
    return (array.round(digits) + 0.0).tolist()


def _loops(report: Report, numbers: Mapping[str, int]) -> Any:
    """Yield the loops and dyads with a transmission angle: the numbers of the pins that enclose it."""
    points = report.mechanism.body_points

    def number(place: Place) -> int | None:
        """Return the number of the point at a place, None if the place has no name."""
        for name, index in numbers.items():
            if body_of(name) == place.body and math.dist(points[name], (place.x, place.y)) < 1e-9 * max(
                1.0, abs(place.x), abs(place.y)
            ):
                return index
        return None

    for named in report.loops:
        if not named.transmission:
            continue
        pins = [number(pin) for pin in named.loop.pins]
        if None in pins:
            continue
        angle, loop = named.transmission[0], named.loop
        found = {"driver": angle.driver, "coupler": angle.coupler, "output": angle.output}
        if isinstance(loop, FourBar):
            is_first = angle.output == loop.last.name  # the output is the last link, or the loop is led by it
            yield found | {"pins": pins[1:] if is_first else pins[2::-1]}
        elif angle.is_slide:
            yield found | {"pins": pins[1:], "direction": loop.direction}
        else:
            yield found | {"pins": [pins[2], pins[1], pins[0]]}
    for one in report.dyads:
        pins = [number(pin) for pin in one.pins]
        if None not in pins:
            angle = one.transmission[0]
            found = {"driver": angle.driver, "coupler": angle.coupler, "output": angle.output}
            yield found | {"pins": pins} | ({} if one.dyad.direction is None else {"direction": one.dyad.direction})


def cam_data(mechanism: Mechanism, joint: Any, numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return a cam: its bodies and points, and the bodies and joints whose numbers determine its curve.

    Args:
        mechanism: The mechanism.
        joint: A joint of a cam whose contact is known.
        numbers: The numbers of points, by 'body.point'.

    """
    cam, follower, touching = members_of(joint)
    if touching is None:
        raise TypeError(f"the contact of cam '{joint.name}' is unknown")
    found: dict[str, Any] = {"name": joint.name, "body": cam, "follower": follower, "point": numbers[touching]}
    for key in ("roller_radius", "normal"):
        value = getattr(joint, key, None)
        if value is not None:
            found[key] = number_data(mechanism, ("joints", joint.name, key), float(value))
    if isinstance(joint, CamRoller | CamFlatFace):  # the file has the curve
        return found | {"centre": numbers[joint.between[0]], "bodies": [], "joints": [joint.name]}
    bodies = joint.bodies()
    among = [one for one in mechanism.joints if {*one.bodies()} <= {*bodies}]
    axle = next(one for one in among if isinstance(one, Revolute) and {*one.bodies()} == {cam, joint.holder()})
    own = next(point for point in axle.between if body_of(point) == cam)
    return found | {"centre": numbers[own], "bodies": list(bodies), "joints": [one.name for one in among]}
