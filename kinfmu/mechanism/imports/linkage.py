"""Files of Linkage, the mechanism designer of David Rector: XML with the root <linkage2>.

Connectors are points, in 1/96 inch whatever the unit of the drawing is; links are rigid and hold connectors. An input
turns clockwise with a positive rpm. An actuator is a link of two connectors whose length goes to and fro.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple, NoReturn
from xml.parsers import expat

from kinfmu.errors import MechanismError, listed, some
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.imports.sketch import Sketch
from kinfmu.mechanism.toml_document import read_decimal
from kinfmu.mechanism.valid import check_number, quoted

ROOT = "linkage2"
_PER_INCH = 96.0
_UNITS = {"MILLIMETERS": ("mm", 25.4 / _PER_INCH), "INCHES": ("in", 1.0 / _PER_INCH)}
_DECIMALS = 6  # of lengths: files have as many of 1/96 inch
_DRAWING_LAYERS = 15  # bits of layers without mechanism
_DEEPEST = 20  # elements in one another; a file has 4
_DEFAULT_CPM = 15.0
_NEAR = 1e-4  # of the length of a slot: a pin that is drawn nearer to it is on it
_SHOWN_ONLY = {  # attributes that change no motion
    *(
        "id",
        "name",
        "layer",
        "selected",
        "color",
        "usercolor",
        "linesize",
        "solid",
        "locked",
        "shapetype",
        "drawcircle",
    ),
    "measurementelement",
}
_READ = {
    "connector": {
        *("x", "y", "anchor", "input", "rpm", "draw", "slider", "slideradius", "alwaysmanual", "fasten", "fastenlink"),
    },
    "Link": {"actuator", "throw", "cpm", "gear", "alwaysmanual", "fastenlink", "fastenconnector"},
}
_DECORATION = {"program", "selected", "background", "ratios", "connector", "Link", "element"}


class XmlElement(NamedTuple):
    """An element of XML without its text."""

    tag: str
    attributes: dict[str, str]
    children: list[XmlElement]

    def all(self, *tags: str) -> Iterator[XmlElement]:
        """Yield the children with one of these tags."""
        return (child for child in self.children if child.tag in tags)

    def is_true(self, name: str) -> bool:
        """Return whether an attribute is 'true'."""
        return self.attributes.get(name) == "true"


def is_xml(content: str) -> bool:
    """Return whether a text can be XML only."""
    return content.startswith("<")


def sketch_of_linkage(content: str, name: str) -> Sketch:
    """Return the drawing of a file; name: of the mechanism."""
    return _LinkageReader(_tree(content), name).sketch


class _LinkageReader:
    """The connectors and links of a file on the way to a sketch, step by step in the order of `__init__`."""

    def __init__(self, root: XmlElement, name: str) -> None:
        program = next(root.all("program"), XmlElement("program", {}, []))
        unit, factor = _UNITS.get(program.attributes.get("units", "").upper(), _UNITS["MILLIMETERS"])
        scale = _number(program, "scalefactor", 1.0) or 1.0
        self.factor = factor * scale
        self.sketch = Sketch("a file of Linkage", name or "linkage", unit)
        if scale != 1.0:
            self.sketch.notes.append(f"scalefactor = {scale:g}: all lengths are multiplied by it")
        self.left = 0  # elements without influence on the mechanism
        self.connectors = self._by_id(root.all("connector"))
        links = self._by_id(root.all("Link", "element"))
        if self.left:
            self.sketch.notes.append(f"{self.left} elements of drawing layers and dimensions are left out")
        self.actuators = {key: link for key, link in links.items() if link.is_true("actuator")}
        geared = {one.attributes.get("id", "") for ratio in _ratios(root) for one in ratio.all("link")}
        self.links = {
            key: link
            for key, link in links.items()
            if key not in self.actuators and (len(self._held(link)) > 1 or key in geared)
        }
        self._add_pins_and_links()
        self._fasten()
        inputs = self._weld_inputs()
        self.sketch.settle()
        for key, connector in self.connectors.items():
            if connector.is_true("slider"):
                self._slide(key, connector)
            if connector.is_true("draw"):
                self.sketch.trace(_pin(key))
        for ratio in _ratios(root):
            self._mesh(ratio)
        for key, link in self.actuators.items():
            self._actuate(key, link)
        for key, turned in inputs.items():
            self._drive(key, turned)
        self._note_unknown(root, links)

    def _by_id(self, elements: Iterable[XmlElement]) -> dict[str, XmlElement]:
        """Return the elements of the mechanism, without drawings and dimensions, by their ids."""
        found: dict[str, XmlElement] = {}
        for element in elements:
            identity = element.attributes.get("id", "")
            if not identity or identity in found:
                raise MechanismError(f"<{element.tag}> has {f'the id {identity} of another' if identity else 'no id'}")
            layers = int(_number(element, "layer", 0.0))
            if element.is_true("measurementelement") or (layers and not layers & ~_DRAWING_LAYERS):
                self.left += 1
            else:
                found[identity] = element
        return found

    def _held(self, link: XmlElement) -> list[str]:
        """Return the ids of the connectors of a link."""
        ids = (child.attributes.get("id", "") for child in link.all("connector"))
        return [identity for identity in ids if identity in self.connectors]

    def _length(self, element: XmlElement, name: str, default: float | None = None) -> float:
        """Return the length of an attribute in the unit of the drawing; default: in that of the file."""
        return round(_number(element, name, default) * self.factor, _DECIMALS)

    def _add_pins_and_links(self) -> None:
        for key, connector in self.connectors.items():
            name = connector.attributes.get("name") or f"P{key}"
            self.sketch.pin(_pin(key), name, self._length(connector, "x"), self._length(connector, "y"))
            if connector.is_true("anchor"):
                self.sketch.hold(GROUND_NAME, _pin(key))
        for key, link in self.links.items():
            self.sketch.link(_link(key), link.attributes.get("name") or f"L{key}", map(_pin, self._held(link)))

    def _fasten(self) -> None:
        """Make links that are fastened to others, and connectors that are fastened to links, parts of them."""
        for key, link in self.links.items():
            to_link, to_connector = (link.attributes.get(f"fasten{what}", "") for what in ("link", "connector"))
            if to_link in self.links:
                self.sketch.weld(_link(key), _link(to_link))
            elif to_connector in self.connectors and self.connectors[to_connector].is_true("anchor"):
                self.sketch.weld(GROUND_NAME, _link(key))
            elif to_link or to_connector:
                self.sketch.notes.append(f"link {key} is fastened to what is no link and no anchor: left out")
            for child in link.all("fastenconnector"):
                if child.attributes.get("id", "") in self.connectors:
                    self.sketch.hold(_link(key), _pin(child.attributes["id"]))
        for key, connector in self.connectors.items():
            to_link = connector.attributes.get("fastenlink") or connector.attributes.get("fasten", "")
            if to_link in self.links:
                self.sketch.hold(_link(to_link), _pin(key))

    def _weld_inputs(self) -> dict[str, str]:
        """Return a link by each input that turns it; all others at the input turn with it."""
        inputs: dict[str, str] = {}
        for key, connector in self.connectors.items():
            if not connector.is_true("input"):
                continue
            turned = [link for link in self.sketch.links_at(_pin(key)) if not self.sketch.is_fixed(link)]
            if not turned or not connector.is_true("anchor"):
                self.sketch.notes.append(f"connector {key} is an input, but no anchor that turns a link: left out")
                continue
            for other in turned[1:]:
                self.sketch.weld(turned[0], other)
            inputs[key] = turned[0]
        return inputs

    def _drive(self, key: str, link: str) -> None:
        connector, body = self.connectors[key], self.sketch.body(link)
        if body == GROUND_NAME:
            self.sketch.notes.append(f"connector {key} is an input of a link that cannot turn: left out")
            return
        self._note_manual(f"connector {key}", connector)
        self.sketch.turn(-_number(connector, "rpm", 0.0), GROUND_NAME, body)

    def _slide(self, key: str, connector: XmlElement) -> None:
        """Add the slot of a sliding connector: the line, or the arc, between its two limits."""
        where = f"connector {key}"
        limits = [child.attributes.get("id", "") for child in connector.all("slidelimit")][:2]
        if len(limits) < 2 or not set(limits) <= set(self.connectors):
            self.sketch.notes.append(f"{where} slides without two limits: it is a plain pin")
            return
        pin, ends = _pin(key), [self.sketch.pins[_pin(limit)] for limit in limits]
        first, second = (self.sketch.bodies_at(_pin(limit)) for limit in limits)
        carrier = next((body for body in first if body in second), None)
        if carrier is None:
            raise MechanismError(f"{where} slides between connectors {listed(limits)}, which are not on one link")
        riders = [body for body in self.sketch.bodies_at(pin) if body != carrier]
        if not riders:
            self.sketch.notes.append(f"{where} slides, but on no other link than its own: left out")
            return
        (_, a_x, a_y), (_, b_x, b_y), (_, x, y) = *ends, self.sketch.pins[pin]
        length = math.hypot(b_x - a_x, b_y - a_y)
        if not length:
            raise MechanismError(f"{where} slides between two connectors in the same place")
        along_x, along_y = (b_x - a_x) / length, (b_y - a_y) / length
        radius = abs(self._length(connector, "slideradius", 0.0))
        rider = self.sketch.at(riders[0], pin)
        if radius:
            height = math.sqrt(max(radius * radius - length * length / 4.0, 0.0))
            middle = (a_x + b_x) / 2.0, (a_y + b_y) / 2.0
            centres = [(middle[0] - side * along_y, middle[1] + side * along_x) for side in (height, -height)]
            radius = max(radius, length / 2.0)
            centre = min(centres, key=lambda c: abs(math.dist(c, (x, y)) - radius))
            drawn = math.dist(centre, (x, y))
            self.sketch.pin(f"centre {key}", f"centre_{self.sketch.pins[pin].name}", *centre)
            between = [self.sketch.at(carrier, f"centre {key}"), rider]
            self.sketch.add("joints", f"arc_{key}", type="distance", between=between, length=drawn)
            off = abs(drawn - radius)
        else:
            off = abs(along_x * (y - a_y) - along_y * (x - a_x))
            between = [self.sketch.at(carrier, pin), rider]
            axis = math.atan2(along_y, along_x)
            self.sketch.add("joints", f"slot_{key}", type="point_on_line", between=between, axis=axis)
        if off > _NEAR * length:
            self.sketch.notes.append(f"{where} is drawn {off:.3g} away from its slot, which is moved to it")

    def _mesh(self, ratio: XmlElement) -> None:
        """Add a pair of gears, or of wheels of a chain, on the link between their axles or on the ground."""
        wheels = [one for one in ratio.all("link") if one.attributes.get("id", "") in self.links][:2]
        sizes = [_number(wheel, "size", 0.0) for wheel in wheels]
        if len(wheels) < 2 or min(sizes) <= 0.0:
            self.sketch.notes.append("a ratio without two links and their sizes is left out")
            return
        keys = [wheel.attributes["id"] for wheel in wheels]
        gears = [self.sketch.body(_link(key)) for key in keys]
        axles = [self._held(self.links[key])[:1] for key in keys]
        if not all(axles):
            raise MechanismError(f"links {listed(keys)} are wheels; both need a connector as their axle")
        first, second = (self.sketch.bodies_at(_pin(axle)) for (axle,) in axles)
        carrier = next((body for body in first if body in second and body not in gears), None)
        if carrier is None and GROUND_NAME in first and GROUND_NAME in second:
            carrier = GROUND_NAME
        if carrier is None or gears[0] == gears[1]:
            self.sketch.notes.append(f"wheels {listed(keys)} have no link between their axles: left out")
            return
        is_meshing = ratio.attributes.get("type") == "gears"
        quotient = sizes[0] / sizes[1] * (-1.0 if is_meshing else 1.0)
        keys_of_gear = {"type": "gear", "between": gears, "ratio": quotient, "carrier": carrier}
        self.sketch.add("joints", f"{'gears' if is_meshing else 'chain'}_{'_'.join(keys)}", **keys_of_gear)

    def _actuate(self, key: str, link: XmlElement) -> None:
        """Add the driver of an actuator's length, between the bodies at its ends."""
        where, held = f"actuator {key}", self._held(link)
        if len(held) != 2:
            raise MechanismError(f"{where} has {len(held)} connectors; an actuator has two")
        a, b = (self.sketch.pins[_pin(end)] for end in held)
        at_a, at_b = (self.sketch.bodies_at(_pin(end)) for end in held)
        if not at_a or not at_b or at_a[0] == at_b[0]:
            raise MechanismError(
                f"{where} must join two links, or a link and an anchor, by its connectors {listed(held)}"
            )
        length = math.hypot(b.x - a.x, b.y - a.y)
        cycles = _number(link, "cpm", _DEFAULT_CPM)
        half = math.copysign(self._length(link, "throw", length / self.factor / 2.0) / 2.0, cycles)
        between = [self.sketch.at(body, _pin(end)) for body, end in zip((at_a[0], at_b[0]), held, strict=True)]
        law: dict[str, Any] = {"law": "constant", "level": length}
        if half and cycles:
            law = {"law": "harmonic", "start": length + half, "amplitude": half, "phase": "-90 deg"}
            law |= {"frequency": f"{abs(cycles) / 60.0!r} Hz"}
            self.sketch.cycle(60.0 / abs(cycles))
            self.sketch.notes.append(
                f"{where} moves to and fro along a cosine of the same stroke and period, in place of a constant speed"
            )
        self._note_manual(where, link)
        name = link.attributes.get("name") or f"actuator_{key}"
        self.sketch.add("drivers", name, type="distance", between=between, **law)

    def _note_manual(self, where: str, element: XmlElement) -> None:
        if element.is_true("alwaysmanual"):
            self.sketch.notes.append(f"{where} is moved by hand in the source; it is driven at the speed of the file")

    def _note_unknown(self, root: XmlElement, links: Mapping[str, XmlElement]) -> None:
        """Note elements and attributes that may change the motion, but are not read."""
        for tag, elements in (("connector", self.connectors), ("Link", links)):
            known = _SHOWN_ONLY | _READ[tag]
            unknown: dict[str, list[str]] = {}
            for key, element in elements.items():
                for name in element.attributes:
                    if name not in known:
                        unknown.setdefault(name, []).append(key)
            for name, keys in unknown.items():
                self.sketch.notes.append(f"{name} of {tag.lower()} {some(keys)} is not read")
        others = dict.fromkeys(child.tag for child in root.children if child.tag not in _DECORATION)
        if others:
            self.sketch.notes.append(f"elements that are not read: {some(f'<{tag}>' for tag in others)}")


def _pin(identity: str) -> str:
    return f"pin {identity}"


def _link(identity: str) -> str:
    return f"link {identity}"


def _ratios(root: XmlElement) -> Iterator[XmlElement]:
    return (ratio for ratios in root.all("ratios") for ratio in ratios.all("ratio"))


def _number(element: XmlElement, name: str, default: float | None = None) -> float:
    """Return the number of an attribute; without a default it is required."""
    where = f"{element.tag} {element.attributes.get('id', '')}".strip()
    written = element.attributes.get(name, "").strip()
    if not written:
        if default is None:
            raise MechanismError(f"{where} needs {name}, a number")
        return default
    try:
        value = read_decimal(written)
    except ValueError:
        raise MechanismError(f"{where}: {name} = {quoted(written)} must be a number") from None
    check_number(f"{where}: {name}", value, written)
    return value


def _tree(content: str) -> XmlElement:
    """Return the root of XML text; a file with entities of its own is refused."""
    parser = expat.ParserCreate("utf-8")
    top = XmlElement("", {}, [])
    path = [top]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        if len(path) == 1 and tag != ROOT:
            raise MechanismError(f"is XML, but no file of Linkage: its root is {quoted(tag)}, not {ROOT!r}")
        if len(path) > _DEEPEST:
            raise MechanismError(f"line {parser.CurrentLineNumber}: elements are nested too deeply")
        path[-1].children.append(XmlElement(tag, attributes, []))
        path.append(path[-1].children[-1])

    def end(_tag: str) -> None:
        path.pop()

    def refuse(*_: object) -> NoReturn:
        raise MechanismError("has a DOCTYPE, which files of Linkage do not have; files with entities are not read")

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(content.encode("utf-8", "replace"), True)
    except expat.ExpatError as error:
        raise MechanismError(f"is not a complete XML file: {error}") from None
    return top.children[0]
