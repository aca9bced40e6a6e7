"""The drawing of another program on its way to a mechanism: pins in world coordinates, and the links that hold them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from itertools import combinations, takewhile
from typing import Any, NamedTuple

from kinfmu.errors import MechanismError, some
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.toml_file import mechanism_of
from kinfmu.mechanism.toml_text import text
from kinfmu.mechanism.valid import check_number, is_line, quoted
from kinfmu.units import METRES

MOST_PARTS = 1000  # pins, and links, of a drawing; in larger ones the search for rigid groups would take minutes
UNDRIVEN = "nothing drives it: add a table [drivers.NAME]"
GRAVITY = "-9.81 m/s2"
_SAMPLES = 200  # of the run of an imported mechanism
_NOTES, _NOTE = "# Left out, or chosen:", "#   "  # at the head of a file
_LONGEST_NAME = 80  # characters, so that numbers can follow
_REFERENCES = ("between", "of", "carrier", "at", "axes")


def notes_of(text: str) -> tuple[str, ...]:
    """Return the notes at the head of the text of an imported file; none of another one."""
    _, head, rest = text.partition(f"{_NOTES}\n")
    lines = takewhile(lambda line: line.startswith(_NOTE), rest.splitlines())
    return tuple(line.removeprefix(_NOTE) for line in lines) if head else ()


class DrawnPin(NamedTuple):
    """A point of a drawing: its name, unique and valid, and where it is in the world [length]."""

    name: str
    x: float
    y: float


class LumpedMass(NamedTuple):
    """Mass [kg], centre of mass [length] in the world, moment of inertia about it [kg m2]."""

    mass: float
    x: float
    y: float
    inertia: float


class Sketch:
    """Pins, links and what connects them.

    Every body has the frame of the world in the drawn pose (`start` 0). Links that cannot move relative to each other
    are one body: those that are welded, and those that share two pins. A reader first adds all pins, links and welds,
    then calls `settle`, and then adds joints, drivers and loads between bodies.

    Args:
        source: What is imported, for the head of the file, such as 'a link of PMKS+'.
        name: Wanted name of the mechanism.
        length_unit: Unit of all lengths.

    Attributes:
        notes: What was left out or chosen, one line each.
        pins: The pins by the key of the reader.

    """

    def __init__(self, source: str, name: str, length_unit: str) -> None:
        self.notes: list[str] = []
        self.pins: dict[str, DrawnPin] = {}
        self._source = source
        self._name = name
        self._length_unit = length_unit
        self._links: dict[str, list[str]] = {GROUND_NAME: []}  # keys of pins by the key of the link
        self._names: dict[str, str] = {GROUND_NAME: GROUND_NAME}  # of links
        self._parents: dict[str, str] = {GROUND_NAME: GROUND_NAME}  # towards the link that stands for the body
        self._taken: dict[str, set[str]] = {"link": {GROUND_NAME}}
        self._renamed: list[str] = []
        self._bodies: dict[str, dict[str, tuple[float, float]]] = {}  # points by body
        self._at: dict[str, list[str]] = {}  # bodies by pin
        self._masses: dict[str, list[LumpedMass]] = {}
        self._tables: dict[str, dict[str, Any]] = {"joints": {}, "drivers": {}, "loads": {}, "points": {}}
        self._periods: list[float] = []
        self._has_gravity = False

    # ------------------------------------------------------------------------------------------ pins, links and welds

    def pin(self, key: str, text: str, x: float, y: float) -> None:
        """Add a pin; text: its name in the source."""
        self._check_count(self.pins, "pins")
        for axis, value in (("x", x), ("y", y)):
            check_number(f"pin {quoted(text)} {axis}", value)
        self.pins[key] = DrawnPin(self._unique("pin", text, "P"), x, y)

    def link(self, key: str, text: str, pins: Iterable[str]) -> None:
        """Add a link that holds pins; text: its name in the source."""
        self._check_count(self._links, "links")
        self._names[key] = self._unique("link", text, "L")
        self._links[key] = list(dict.fromkeys(pins))
        self._parents[key] = key

    def hold(self, link: str, pin: str) -> None:
        """Add a pin to a link; the ground is the link GROUND_NAME."""
        if pin not in self._links[link]:
            self._links[link].append(pin)

    def weld(self, a: str, b: str) -> bool:
        """Make two links one body, and return whether they were two."""
        first, second = sorted((self._root(a), self._root(b)), key=list(self._links).index)
        self._parents[second] = first
        return first != second

    def links_at(self, pin: str) -> list[str]:
        """Return the links that hold a pin, the ground first."""
        return [key for key, held in self._links.items() if pin in held]

    def is_fixed(self, link: str) -> bool:
        """Return whether a link is part of the ground, or held by it at two pins."""
        return self._root(link) == GROUND_NAME or len(set(self._links[link]) & set(self._links[GROUND_NAME])) > 1

    # --------------------------------------------------------------------------------------------------------- bodies

    def settle(self) -> None:
        """Make bodies of the links, and revolute joints of the pins that several bodies hold."""
        while self._weld_held_twice():
            pass
        for key, held in self._links.items():
            points = self._bodies.setdefault(self.body(key), {})
            points.update({self.pins[pin].name: self.pins[pin][1:] for pin in held})
            for pin in held:
                bodies = self._at.setdefault(pin, [])
                if self.body(key) not in bodies:
                    bodies.insert(0 if self.body(key) == GROUND_NAME else len(bodies), self.body(key))
        joined = set()
        for key, (first, *others) in self._at.items():
            name, x, y = self.pins[key]
            for other in others:
                if (first, other, x, y) not in joined:  # a second pin in the same place adds nothing
                    joined.add((first, other, x, y))
                    self.add("joints", name, type="revolute", between=[self.at(first, key), self.at(other, key)])

    def body(self, link: str) -> str:
        """Return the body that a link is part of."""
        return self._names[self._root(link)]

    def bodies_at(self, pin: str) -> list[str]:
        """Return the bodies that hold a pin, the ground first."""
        return self._at.get(pin, [])

    def at(self, body: str, pin: str) -> str:
        """Return 'body.point' of the place of a pin, which becomes a point of the body if it is none."""
        name, x, y = self.pins[pin]
        self._bodies[body][name] = (x, y)
        return f"{body}.{name}"

    def add(self, table: str, text: str, **keys: Any) -> str:
        """Add a joint, driver or load between bodies, and return its name."""
        name = self._unique(table, text, table[0].upper())
        self._tables[table][name] = keys
        return name

    def turn(self, speed: float, reference: str, driven: str) -> None:
        """Drive the angle of one body relative to another at a speed [rpm]."""
        if speed:
            self.cycle(60.0 / abs(speed))
        law = {"law": "constant_speed", "start": 0.0, "speed": f"{speed!r} rpm"} if speed else _REST
        bodies = {"type": "relative_angle", "between": [reference, driven]}
        if reference == GROUND_NAME:
            bodies = {"type": "angle", "of": driven}
        self.add("drivers", driven, **bodies, **law)

    def cycle(self, period: float) -> None:
        """Let the run last for the period of a driver [s], or for a longer one of another."""
        self._periods.append(period)

    def trace(self, pin: str) -> None:
        """Make a pin a point of interest, if a body that moves holds it and the ground does not."""
        bodies = self.bodies_at(pin)
        if bodies and bodies[0] != GROUND_NAME:
            name = self.pins[pin].name
            while name in self._bodies or name in self._tables["points"]:
                name += "_path"
            self._tables["points"][name] = self.at(bodies[0], pin)

    def heavy(self, body: str, part: LumpedMass) -> None:
        """Add a mass to a body."""
        for what, value in part._asdict().items():
            check_number(f"body {body} {what}", value)
        if part.mass > 0.0 and body != GROUND_NAME:
            self._masses.setdefault(body, []).append(part)

    def under_gravity(self) -> None:
        """Let gravity act on the masses."""
        self._has_gravity = True

    def reach(self, body: str, pin: str) -> float:
        """Return the distance of the farthest point of a body from a pin."""
        centre = self.pins[pin][1:]
        return max(math.dist(centre, point) for point in self._bodies[body].values())

    def mobility(self) -> int:
        """Return Gruebler's count of the degrees of freedom of all that is connected with the ground."""
        self._leave_out_loose()
        rows = {"revolute": 2, "translational": 2}
        lost = sum(rows.get(keys["type"], 1) for keys in self._tables["joints"].values())
        return 3 * (len(self._bodies) - 1) - lost

    # --------------------------------------------------------------------------------------------------------- result

    def file_text(self) -> str:
        """Return the mechanism file, with the notes at its head.

        Raise a MechanismError if the drawing is no mechanism.
        """
        mobility, drivers = self.mobility(), len(self._tables["drivers"])
        if self._renamed:
            self.notes.append(f"names made valid: {some(self._renamed)}")
        if not drivers:
            self.notes.append(UNDRIVEN)
        elif mobility < drivers:
            self.notes.append(
                f"degrees of freedom by count: {mobility}, drivers: {drivers}; it moves only if links are redundant, "
                "which needs exact lengths, and those of rounded places differ"
            )
        mechanism = mechanism_of(self._document(), None)
        head = [f"# Imported from {self._source}.", *_HEAD]
        if self.notes:
            head += [_NOTES, *(f"{_NOTE}{_shown(note)}" for note in self.notes)]
        return "\n".join([*head, "", text(mechanism, as_written=True)])

    def _document(self) -> dict[str, Any]:
        bodies: dict[str, Any] = {}
        for name, points in self._bodies.items():
            bodies[name] = {"points": {point: list(place) for point, place in points.items()}}
            if name != GROUND_NAME:
                bodies[name] |= {"start": {"x": 0.0, "y": 0.0, "phi": 0.0}, **self._mass_keys(name)}
        run = {"stop": max(self._periods), "step": max(self._periods) / _SAMPLES} if self._periods else {}
        document: dict[str, Any] = {"name": _valid(self._name, "M"), "units": {"length": self._length_unit}, "run": run}
        document |= {"bodies": bodies, **self._tables}
        if self._has_gravity and self._masses:
            document["gravity"] = {"x": 0.0, "y": GRAVITY}
        return document

    def _mass_keys(self, body: str) -> dict[str, Any]:
        """Return the keys of a body's mass: those of all its parts."""
        parts = self._masses.get(body, [])
        mass = math.fsum(part.mass for part in parts)
        if not mass:
            return {}
        x, y = (math.fsum(part.mass * part[k] for part in parts) / mass for k in (1, 2))
        square = METRES[self._length_unit] ** 2
        inertia = math.fsum(
            part.inertia + part.mass * ((part.x - x) ** 2 + (part.y - y) ** 2) * square for part in parts
        )
        return {"mass": mass, "center_of_mass": [x, y], "inertia": inertia}

    def _leave_out_loose(self) -> None:
        """Remove bodies that nothing connects with the ground, with all that refers to them."""
        neighbours: dict[str, set[str]] = {}
        for keys in (*self._tables["joints"].values(), *self._tables["drivers"].values()):
            bodies = _bodies_of(keys)
            for body in bodies:
                neighbours.setdefault(body, set()).update(bodies)
        held, new = {GROUND_NAME}, [GROUND_NAME]
        while new:
            found = neighbours.get(new.pop(), set()) - held
            held |= found
            new += found
        loose = [body for body in self._bodies if body not in held]
        if not loose:
            return
        if len(loose) == len(self._bodies) - 1:
            raise MechanismError("no link is connected with the ground: nothing in the drawing can move as a mechanism")
        self.notes.append(f"nothing connects these with the ground, so they are left out: {some(loose)}")
        for body in loose:
            del self._bodies[body]
            self._masses.pop(body, None)
        for table, members in self._tables.items():
            self._tables[table] = {name: keys for name, keys in members.items() if _bodies_of(keys) <= held}

    def _weld_held_twice(self) -> bool:
        """Weld links that share two pins in different places, and return whether there were any."""
        first_places: dict[tuple[str, str], tuple[float, float]] = {}
        holders: dict[str, set[str]] = {}
        for key, held in self._links.items():
            for pin in held:
                holders.setdefault(pin, set()).add(self._root(key))
        welded = False
        for key, roots in holders.items():
            place = self.pins[key][1:]
            for pair in combinations(sorted(roots), 2):
                if first_places.setdefault(pair, place) != place and self.weld(*pair):
                    welded = True
                    if GROUND_NAME not in pair:
                        a, b = (self._names[root] for root in pair)
                        self.notes.append(f"{a} and {b} share two pins: they are one body")
        return welded

    def _root(self, link: str) -> str:
        while self._parents[link] != link:
            link = self._parents[link]
        return link

    def _check_count(self, parts: Mapping[str, Any], what: str) -> None:
        if len(parts) >= MOST_PARTS:
            raise MechanismError(f"has more than {MOST_PARTS} {what}, the most that are imported")

    def _unique(self, kind: str, text: str, default: str) -> str:
        """Return a valid name that no other member of a kind has."""
        taken = self._taken.setdefault(kind, set())
        valid = name = _valid(text, default)
        number = 1
        while name in taken:
            number += 1
            name = f"{valid}_{number}"
        taken.add(name)
        if valid != text and kind in ("link", "pin"):
            self._renamed.append(f"{quoted(text)} is {name}")
        return name


_REST = {"law": "external", "start": 0.0}  # of a driver without a speed: FMUs have an input for it
_HEAD = ("# Points are in world coordinates, in the drawn pose; angles and travels count from this pose (start = 0).",)


def _valid(text: str, default: str) -> str:
    """Return a valid name like the text; default: what names that begin with a digit begin with."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text[:_LONGEST_NAME]).strip("_")
    return name if name and not name[0].isdigit() else f"{default}{name}"


def _bodies_of(keys: Any) -> set[str]:
    """Return the bodies to which a joint, driver, load or point of interest refers."""
    if isinstance(keys, str):
        return {keys.partition(".")[0]}
    references = (keys[key] for key in _REFERENCES if key in keys)
    names = (name for value in references for name in (value if isinstance(value, list) else [value]))
    return {name.partition(".")[0] for name in names}


def _shown(note: str) -> str:
    """Return a note as a comment can hold it."""
    return note if is_line(note) else "".join(sign if is_line(sign) else "?" for sign in note)
