"""Links of PMKS+, the planar mechanism simulator in the browser: the drawing is in the address after the '?'.

    FLAGS.DECIMALS.WHOLE NUMBERS.UNITS.JOINT.JOINT. ... .LINK.LINK. ... .FORCE. ... .SELECTION and more, check character

An empty record ends the joints, the links and the forces. Fields are separated by commas. Numbers have base 64 with the
digits 0-9 A-Z a-z _ -, a leading 0 is the minus sign; decimals are in thousandths. Bits of a joint: 1 slider, 2 input,
4 ground, 8 weld, 16 traced, 32 cylinder.
"""

from __future__ import annotations

import math
import re
import string
from collections.abc import Sequence
from typing import NamedTuple
from urllib.parse import unquote

from kinfmu.errors import MechanismError, some
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.imports.sketch import LumpedMass, Sketch
from kinfmu.mechanism.valid import quoted
from kinfmu.units import METRES

_DIGITS = string.digits + string.ascii_uppercase + string.ascii_lowercase + "_-"
_CHECKS = _DIGITS[:62]  # of these the last character is the one whose place is the length of the rest
_MOST_DIGITS = 9
_HEAD = re.compile(r"[\w-]{1,3}\.[\w,-]*\.[\w,-]*\.[\w-]*\.")
_ADDRESS = re.compile(r"https?://", re.IGNORECASE)
_SLIDER, _INPUT, _GROUND, _WELD, _TRACED = 1, 2, 4, 8, 16
_CLOCKWISE, _NO_GRAVITY = 1, 2  # bits of the settings
_FACES_OUT, _TURNS = 2, 1  # bits of a force
_BODIES, _PARTS = "YAMG0123", "Namg4567"  # first characters of links that are bodies, and of parts of welded links
_FIELDS_OF_JOINT, _FIELDS_OF_LINK, _FIELDS_OF_FORCE = 5, 7, 8


class PmksUnits(NamedTuple):
    """Units of a drawing: of length and force, and one of mass [kg] and of inertia [kg m2]."""

    length: str
    force: str
    mass: float
    inertia: float


_POUND = 0.45359237  # [kg]
_UNITS = (  # by the first digit of the units
    PmksUnits("in", "lbf", _POUND, _POUND * METRES["in"] ** 2),
    PmksUnits("cm", "N", 1e-3, 1e-4),
    PmksUnits("m", "N", 1.0, 1.0),
)


class PmksJoint(NamedTuple):
    """A joint; slot: carrier and the two joints that give the direction, all '' for a guide on the ground."""

    id: str
    flags: int
    name: str
    x: float
    y: float
    angle: float
    slot: tuple[str, str, str]
    speed: float


class PmksLink(NamedTuple):
    """A link; parts: the welded links that it consists of."""

    id: str
    is_body: bool
    name: str
    mass: float
    inertia: float
    center: tuple[float, float]
    joints: list[str]
    parts: list[str]


def is_pmks_link(content: str) -> bool:
    """Return whether a text is a link of PMKS+, or what follows its '?'."""
    return bool(_ADDRESS.match(content) or _HEAD.match(content))


def sketch_of_pmks(content: str, name: str) -> Sketch:
    """Return the drawing of a link; name: of the mechanism."""
    payload = _payload(content)
    settings, joints, links, forces = _records(payload)
    units = _UNITS[_units_of(settings[3])]
    sketch = Sketch("a link of PMKS+", name or "pmks", units.length)
    if not _is_whole(payload):
        sketch.notes.append("the last character of the link does not fit its length: it may be damaged")
    for joint in joints.values():
        sketch.pin(joint.id, joint.name or joint.id, joint.x, joint.y)
    bodies = {link.id: link for link in links.values() if link.is_body}
    for link in bodies.values():
        sketch.link(link.id, link.name or link.id, link.joints)
    for joint in joints.values():
        holders = [link.id for link in bodies.values() if joint.id in link.joints]
        if joint.flags & _GROUND and not joint.flags & _SLIDER:
            sketch.hold(GROUND_NAME, joint.id)
        if joint.flags & _WELD:
            for other in holders[1:]:
                sketch.weld(holders[0], other)
    sketch.settle()
    for link in bodies.values():
        inertia = link.inertia * units.inertia
        sketch.heavy(sketch.body(link.id), LumpedMass(link.mass * units.mass, *link.center, inertia))
    clockwise = -1.0 if _whole(settings[0], "the settings", is_signed=False) & _CLOCKWISE else 1.0
    for joint in joints.values():
        if joint.flags & _SLIDER:
            _slide(sketch, joint, joints, bodies, clockwise * _decimal(_part(settings[1], 1), "the settings"))
        elif joint.flags & _INPUT:
            speed = joint.speed or clockwise * _whole(_part(settings[2], 0), "the settings")
            _drive(sketch, joint, speed)
        if joint.flags & _TRACED:
            sketch.trace(joint.id)
    owners = {part: link.id for link in bodies.values() for part in (link.id, *link.parts)}
    for fields in forces:
        _force(sketch, fields, owners, units.force)
    if _whole(settings[0], "the settings", is_signed=False) & _NO_GRAVITY:
        sketch.notes.append("gravity is switched off in the link")
    else:
        sketch.under_gravity()
    return sketch


def _payload(content: str) -> str:
    if any(sign.isspace() and sign != " " for sign in content):
        raise MechanismError("is more than a link: it has several lines")
    payload = unquote(content)
    if _ADDRESS.match(payload):
        payload = payload.partition("?")[2].partition("#")[0]
        if not payload:
            raise MechanismError("is an address without a drawing: a link of PMKS+ has it after a '?'")
    return payload


def _is_whole(payload: str) -> bool:
    return payload[-1] == _CHECKS[(len(payload) - 1) % len(_CHECKS)]


def _records(payload: str) -> tuple[list[str], dict[str, PmksJoint], dict[str, PmksLink], list[list[str]]]:
    """Return the settings, joints and links by id, and the fields of the forces."""
    is_whole = _is_whole(payload)
    body = payload if payload.endswith(".") and not is_whole else payload[:-1]
    records = body.split(".")
    sections: list[list[str]] = [[]]
    for record in records[4:]:
        if record or len(sections) > 3:
            sections[-1].append(record)
        else:
            sections.append([])
    if len(records) < 5 or len(sections) < (3 if is_whole else 4):
        raise MechanismError(
            "is cut short or no link of PMKS+: joints, links and forces are lists that two points end, such as "
            "'...4C,C,_W,0,0..YRAB,AB,...,A,B,,...N_'"
        )
    joints = [_joint(record.split(",")) for record in sections[0]]
    links = [_link(record.split(",")) for record in sections[1]]
    by_id = {joint.id: joint for joint in joints}, {link.id: link for link in links}
    for what, members, known in (("joint", joints, by_id[0]), ("link", links, by_id[1])):
        if len(known) < len(members):
            raise MechanismError(f"has two {what}s of one id")
    for link in links:
        for joint in link.joints:
            if joint not in by_id[0]:
                raise MechanismError(f"link {quoted(link.id)}: there is no joint {quoted(joint)}")
    return records[:4], *by_id, [record.split(",") for record in sections[2]]


def _joint(fields: Sequence[str]) -> PmksJoint:
    where = f"joint {quoted(fields[0][1:])}"
    _check_fields(where, fields, _FIELDS_OF_JOINT)
    flags = _whole(fields[0][:1], where, is_signed=False)
    x, y, angle = (_decimal(text, where) for text in fields[2:5])
    slot = (_part(fields, 5), _part(fields, 6), _part(fields, 7))
    if any(slot) and not (all(slot) and flags & _SLIDER):
        raise MechanismError(f"{where}: a slot needs a sliding joint, a link and two of its joints")
    return PmksJoint(fields[0][1:], flags, fields[1], x, y, angle, slot, _decimal(_part(fields, 8), where))


def _link(fields: Sequence[str]) -> PmksLink:
    kind, identity = fields[0][:2], fields[0][2:]
    where = f"link {quoted(identity)}"
    _check_fields(where, fields, _FIELDS_OF_LINK)
    if kind[:1] not in _BODIES + _PARTS or kind[1:] not in ("R", "P"):
        raise MechanismError(
            f"{where}: {quoted(kind)} is no known kind of link, such as 'YR' (a bar) or 'YP' (a block)"
        )
    mass, inertia, x, y = (_decimal(text, where) for text in fields[2:6])
    members = list(fields[7:])
    end = members.index("") if "" in members else len(members)
    parts = [part for part in members[end:] if part]
    return PmksLink(identity, kind[0] in _BODIES, fields[1], mass, inertia, (x, y), members[:end], parts)


def _slide(
    sketch: Sketch, joint: PmksJoint, joints: dict[str, PmksJoint], bodies: dict[str, PmksLink], speed: float
) -> None:
    """Add the slide of a sliding joint, whose block holds it, on the ground or on a link."""
    where = f"joint {quoted(joint.id)}"
    carrier, angle = GROUND_NAME, joint.angle
    if joint.slot[0]:
        link = bodies.get(joint.slot[0])
        if link is None or not set(joint.slot[1:]) <= set(link.joints) or joint.slot[1] == joint.slot[2]:
            raise MechanismError(f"{where}: its slot must name a link and two different joints of this link")
        a, b = (joints[end] for end in joint.slot[1:])
        carrier, angle = sketch.body(link.id), math.atan2(b.y - a.y, b.x - a.x)
    riders = [body for body in sketch.bodies_at(joint.id) if body != carrier]
    if not riders:
        sketch.notes.append(f"{where} slides, but no link that could move holds it: left out")
        return
    between = [sketch.at(carrier, joint.id), sketch.at(riders[0], joint.id)]
    slide = {"between": between, "axis": angle}
    sketch.add("joints", joint.name or joint.id, type="translational", **slide)
    if joint.flags & _INPUT:
        law = {"law": "constant_speed", "start": 0.0, "speed": joint.speed or speed}
        sketch.add("drivers", riders[0], type="slide", **slide, **law)


def _drive(sketch: Sketch, joint: PmksJoint, speed: float) -> None:
    """Add the driver of a pin: of its second body relative to its first, the ground where it is one of them."""
    bodies = sketch.bodies_at(joint.id)
    if len(bodies) < 2:
        sketch.notes.append(f"joint {quoted(joint.id)} is an input, but joins no two bodies: left out")
        return
    if len(bodies) > 2:
        sketch.notes.append(f"joint {quoted(joint.id)} drives {bodies[1]}, the first of {some(bodies[1:])}")
    sketch.turn(speed, *bodies[:2])


def _force(sketch: Sketch, fields: Sequence[str], owners: dict[str, str], unit: str) -> None:
    """Add a force, fixed in the world or turning with its link."""
    where = f"force {quoted(fields[0][1:])}"
    _check_fields(where, fields, _FIELDS_OF_FORCE)
    flags = _whole(fields[0][:1], where, is_signed=False)
    if fields[1] not in owners:
        raise MechanismError(f"{where}: there is no link {quoted(fields[1])}")
    x, y, end_x, end_y, size = (_decimal(text, where) for text in fields[3:8])
    body, length = sketch.body(owners[fields[1]]), math.hypot(end_x - x, end_y - y)
    if body == GROUND_NAME or not length * size:
        sketch.notes.append(f"{where} moves nothing: left out")
        return
    if not flags & _FACES_OUT:
        sketch.notes.append(f"{where} is drawn with its arrow at its link: it acts from its first point to its second")
    name = fields[2] or fields[0][1:]
    sketch.pin(f"force {fields[0]}", name, x, y)
    components = {
        "x": f"{size * (end_x - x) / length!r} {unit}",
        "y": f"{size * (end_y - y) / length!r} {unit}",
        **({"axes": body} if flags & _TURNS else {}),
    }
    sketch.add("loads", name, type="force", at=sketch.at(body, f"force {fields[0]}"), **components)


def _units_of(text: str) -> int:
    """Return the number of the unit of length."""
    number = _whole(text[:1], "the settings", is_signed=False)
    if number >= len(_UNITS):
        raise MechanismError(f"the settings name an unknown unit of length, {quoted(text[:1])}; known: 0, 1, 2")
    return number


def _check_fields(where: str, fields: Sequence[str], least: int) -> None:
    if len(fields) < least:
        raise MechanismError(f"{where} has {len(fields)} fields; it needs at least {least}")


def _part(fields: Sequence[str] | str, index: int) -> str:
    """Return a field, '' for one that is not there."""
    parts = fields.split(",") if isinstance(fields, str) else fields
    return parts[index] if index < len(parts) else ""


def _decimal(text: str, where: str) -> float:
    return _whole(text, where) / 1000.0


def _whole(text: str, where: str, *, is_signed: bool = True) -> int:
    """Return a number of base 64; none is 0."""
    is_negative = is_signed and len(text) > 1 and text[0] == "0"
    digits = text[1:] if is_negative else text
    if len(digits) > _MOST_DIGITS or not set(digits) <= set(_DIGITS):
        raise MechanismError(
            f"{where}: {quoted(text)} is not a number of at most {_MOST_DIGITS} digits 0-9 A-Z a-z _ -"
        )
    number = 0
    for digit in digits:
        number = 64 * number + _DIGITS.index(digit)
    return -number if is_negative else number
