"""Links of PMKS+ written after its codec, with the same mechanisms by hand."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from urllib.parse import quote

from kinfmu import RelativeAngleDriver, SlideDriver, Translational
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.laws import ConstantSpeed
from tests.mechanism.imports.drawn import Drawn, words_of

SIGNS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
FLAGS = {"slider": 1, "input": 2, "ground": 4, "weld": 8, "traced": 16, "cylinder": 32}
ADDRESS = "https://app.pmksplus.com/?"


def number(value: int) -> str:
    """A whole number in base 64."""
    rest, digit = divmod(abs(value), 64)
    return ("0" if value < 0 else "") + (number(rest) if rest else "") + SIGNS[digit]


def decimal(value: float) -> str:
    return number(round(value * 1000))


def checked(body: str) -> str:
    """A payload with its check character."""
    return body + SIGNS[len(body) % 62]


@dataclass
class Settings:
    """Settings of a link: rpm and linear speed, direction, unit of length (0 in, 1 cm, 2 m), gravity."""

    rpm: int = 10
    speed: float = 1.0
    clockwise: bool = False
    unit: int = 1
    no_gravity: bool = False

    def head(self) -> list[str]:
        flags = 8 + 16 + 32 + 128 + self.clockwise + 2 * self.no_gravity
        return [
            SIGNS[flags // 64] + SIGNS[flags % 64],
            f"{decimal(0.7)},{decimal(self.speed)}",
            f"{number(self.rpm)},0",
            f"{self.unit}0{min(self.unit, 1)}{self.unit}",
        ]


def payload(joints: str, links: str, forces: str = "", settings: Settings | None = None) -> str:
    """A payload; a joint: 'NAME X Y flag flag ... [angle=A] [on=LINK:A:B] [rpm=V]', a link: '[YR]NAME JOINT ...'."""
    records = (settings or Settings()).head()
    for name, x, y, *more in (part.split() for part in joints.split(",")):
        keys = dict(word.split("=") for word in more if "=" in word)
        flags = sum(FLAGS[word] for word in more if "=" not in word)
        slot = keys["on"].split(":") if "on" in keys else ["", "", ""] if "rpm" in keys else []
        own = [decimal(float(keys["rpm"]))] if "rpm" in keys else []
        angle = decimal(float(keys.get("angle", 0)))
        records.append(",".join([SIGNS[flags] + name, name, decimal(float(x)), decimal(float(y)), angle, *slot, *own]))
    records.append("")
    for head, *held in (part.split() for part in links.split(",")):
        kind, name = (head[:2], head[2:]) if head[:2] in ("YP", "YR", "AR", "NR", "aR", "0R") else ("YR", head)
        parts = [word[1:] for word in held if word[0] == "+"]
        pins = [word for word in held if word[0] != "+"]
        mass = [decimal(value) for value in (2, 3, 0.5, 0.25)]
        records.append(",".join([kind + name, name, *mass, "c5cae9", *pins, "", *(parts or [""])]))
    records.append("")
    for name, flags, link, *numbers in (part.split() for part in forces.split(",") if part):
        records.append(",".join([flags + name, link, name, *(decimal(float(value)) for value in numbers)]))
    records += ["", "N_"]
    return checked(".".join(records))


@dataclass
class PmksCase:
    """A link and the same mechanism by hand: of the names of `joints` and `links`, unless there are other bars."""

    joints: str
    links: str
    drawn: Drawn
    forces: str = ""
    settings: Settings | None = None

    @property
    def link(self) -> str:
        return ADDRESS + quote(payload(self.joints, self.links, self.forces, self.settings), safe=",-_.~")


def case(joints: str, links: str, pins: str, turns: dict[str, float], **more: object) -> PmksCase:
    """A case whose bars are its links."""
    own = {key: more.pop(key) for key in ("forces", "settings") if key in more}
    places = {name: (float(x), float(y)) for name, x, y, *_ in (part.split() for part in joints.split(","))}
    bars = words_of(str(more.pop("bars", links)))
    bars = {name.removeprefix("YP").removeprefix("YR").removeprefix("AR"): held for name, held in bars.items()}
    return PmksCase(joints, links, Drawn(places, bars, pins, turns, **more), **own)  # type: ignore[arg-type]


def guided(block: str, pin: str, angle: float, carrier: str = "ground") -> object:
    """A block that slides on a carrier along a direction of the drawing."""

    def members(drawn: Drawn) -> Iterator[Joint]:
        turn = drawn.angle(block) - drawn.angle(carrier)
        yield Translational(pin, (f"{carrier}.{pin}", f"{block}.{pin}"), angle - drawn.angle(carrier), turn)

    return members


def along(a: tuple[float, float], b: tuple[float, float]) -> float:
    return math.atan2(b[1] - a[1], b[0] - a[0])


def pushed(block: str, pin: str, angle: float, speed: float, carrier: str = "ground") -> object:
    def members(drawn: Drawn) -> Iterator[Joint | Driver]:
        yield from guided(block, pin, angle, carrier)(drawn)  # type: ignore[operator]
        axis = angle - drawn.angle(carrier)
        yield SlideDriver("push", (f"{carrier}.{pin}", f"{block}.{pin}"), axis, ConstantSpeed(0.0, speed))

    return members


def yoke(drawn: Drawn) -> Iterator[Joint]:
    yield Translational("P", ("ground.P", "yoke.P"), 0.0, drawn.angle("yoke"))
    axis = math.pi / 2 - drawn.angle("yoke")
    yield Translational("Q", ("yoke.Q", "block.Q"), axis, drawn.angle("block") - drawn.angle("yoke"))


def whitworth(drawn: Drawn) -> Iterator[Joint]:
    yield from guided("stone", "P", along((0.0, -3.0), (0.9, 4.2)), "lever")(drawn)  # type: ignore[operator]
    yield from guided("slide", "R", 0.0)(drawn)  # type: ignore[operator]


def arm(_: Drawn) -> Iterator[Driver]:
    turn = _.angle("fore") - _.angle("upper")
    yield RelativeAngleDriver("elbow", ("upper", "fore"), ConstantSpeed(turn, -7.5 * math.pi / 30.0))


PINS = "O ground crank, A crank coupler, B coupler rocker, C ground rocker"
BARS = "crank O A, coupler A B, rocker B C"
CASES = {
    "a crank-rocker": case("O 0 0 ground input, A 1 0, B 3 2, C 4 0 ground", BARS, PINS, {"crank": 10.0}),
    "clockwise, with a traced coupler point": case(
        "O 0 0 ground input traced, A 0.6 0.8 traced, B 3.2 2.15 traced, C 4 -0.25 ground, T 2.5 3.125 traced",
        "crank O A, coupler A B T, rocker B C",
        PINS,
        {"crank": -30.0},
        settings=Settings(rpm=30, clockwise=True),
    ),
    "inches and pounds": case(
        "O -1.5 2 ground input, A -1 2.5, B 2.125 5.75, C 4.25 1.5 ground",
        BARS,
        PINS,
        {"crank": -10.0},
        settings=Settings(clockwise=True, unit=0),
        unit="in",
    ),
    "metres, without gravity": case(
        "O 0 0 ground input, A 0.08 0.06, B 0.3 0.2, C 0.35 0 ground",
        BARS,
        PINS,
        {"crank": 25.0},
        settings=Settings(rpm=25, unit=2, no_gravity=True),
        unit="m",
    ),
    "a drag link with its own speed": case(
        "O 0 0 ground input rpm=-42.5, A 3 0, B 2 3.5, C 1 0 ground", BARS, PINS, {"crank": -42.5}
    ),
    "a slider-crank": case(
        "O 0 0 ground input, A 0.6 0.8, B 4 0, P 4 0 slider ground",
        "crank O A, rod A B, YPblock B P",
        "O ground crank, A crank rod, B rod block",
        {"crank": 10.0},
        others=guided("block", "P", 0.0),
    ),
    "an inclined, offset slider-crank": case(
        "O 1 -1 ground input, A 1.5 0.25, B 5.25 2, P 5.25 2 slider ground angle=0.524",
        "crank O A, rod A B, YPblock B P",
        "O ground crank, A crank rod, B rod block",
        {"crank": 10.0},
        others=guided("block", "P", 0.524),
    ),
    "an inverted slider-crank": case(
        "A 0 0 ground input, B 0.6 0.8, C 3 0 ground, D 2 2.5, P 0.6 0.8 slider on=CD:C:D",
        "AB A B, CD C D, YPblock B P",
        "A ground AB, B AB block, C ground CD",
        {"AB": 10.0},
        others=guided("block", "P", along((3.0, 0.0), (2.0, 2.5)), "CD"),
    ),
    "a Whitworth quick return": case(
        "O 0 0 ground input, A 1.2 0.5, C 0 -3 ground, D 0.9 4.2, P 1.2 0.5 slider on=lever:C:D,"
        "E 5 4, R 5 4 slider ground",
        "crank O A, lever C D, YPstone A P, link D E, YPslide E R",
        "O ground crank, A crank stone, C ground lever, D lever link, E link slide",
        {"crank": 10.0},
        others=whitworth,
    ),
    "a Scotch yoke": case(
        "O 0 0 ground input, A 0.6 0.8, B 3 0 weld, P 3 0 slider ground, S 0.6 -2, T 0.6 2,"
        "Q 0.6 0.8 slider on=yoke:S:T",
        "crank O A, yoke B S T, YPguide B P, YPblock A Q",
        "O ground crank, A crank block",
        {"crank": 10.0},
        bars="crank O A, yoke B S T P, block A Q",
        others=yoke,
    ),
    "a boom lifted by a cylinder": case(
        "A 0 0 ground, B 2 1, C 1.6 0.8 weld, D 4 2, P 1.6 0.8 slider input cylinder on=barrel:A:B,"
        "E 3 -2 ground, F 5 6",
        "barrel A B, rod C D, YPpiston C P, boom E D F",
        "A ground barrel, D rod boom, E ground boom",
        {},
        bars="barrel A B, rod C D P, boom E D F",
        others=pushed("rod", "P", along((0.0, 0.0), (2.0, 1.0)), 0.25, "barrel"),
        settings=Settings(speed=0.25),
        stop=2.0,
    ),
    "a slide that drives a rocker": case(
        "O 0 0 ground, A 1 1.5, B 4 0, P 4 0 slider input ground angle=0.1",
        "rocker O A, rod A B, YPblock B P",
        "O ground rocker, A rocker rod, B rod block",
        {},
        others=pushed("block", "P", 0.1, -0.5),
        settings=Settings(speed=0.5, clockwise=True),
        stop=1.0,
    ),
    "a six-bar of Watt": case(
        "O 0 0 ground input, A 0.5 1, B 3.5 2.5, C 4 0 ground, D 3 4.5, E 6.5 4, F 7 0.5",
        "crank O A, coupler A B D, rocker B C F, upper D E, outer E F",
        PINS + ", D coupler upper, E upper outer, F rocker outer",
        {"crank": 10.0},
    ),
    "a six-bar of Stephenson": case(
        "O 0 0 ground input, A 0.5 1, B 3.5 2.5, C 4 0 ground, D 2.25 4, E 6 4.5, F 7.5 0 ground",
        "crank O A, coupler A B D, rocker B C, link D E, outer E F",
        PINS + ", D coupler link, E link outer, F ground outer",
        {"crank": 10.0},
    ),
    "a parallelogram with three cranks": case(
        "O 0 0 ground input, A 0.6 0.8, B 3.6 0.8, C 3 0 ground, D 2.1 1.3, E 1.5 0.5 ground",
        "crank O A, coupler A B D, rocker B C, third D E",
        PINS + ", D coupler third, E ground third",
        {"crank": 10.0},
        stop=2.0,
    ),
    "a five-bar with two inputs": case(
        "O 0 0 ground input rpm=12, A -0.5 1, B 1.5 4, C 4 1.25, D 3.5 0 ground input rpm=-24",
        "left O A, long A B, short B C, right C D",
        "O ground left, A left long, B long short, C short right, D ground right",
        {"left": 12.0, "right": -24.0},
    ),
    "an arm with a motor at its elbow": case(
        "O 0 0 ground input, A 2 1 input rpm=-7.5, B 4 0.5",
        "upper O A, fore A B",
        "O ground upper, A upper fore",
        {"upper": 10.0},
        others=arm,
    ),
    "a coupler of two links": case(
        "O 0 0 ground input, A 1 0, B 3 2, C 4 0 ground, T 2 3",
        "crank O A, coupler A B, rocker B C, plate A B T",
        PINS,
        {"crank": 10.0},
        bars="crank O A, coupler A B T, rocker B C",
    ),
    "a welded coupler, with its parts and a force": case(
        "O 0 0 ground input, A 1 0, B 3 2, C 4 0 ground, T 4.5 3, U 2 1 weld",
        "crank O A, ARcoupler A B T U +AU +UBT, rocker B C, NRAU A U, NRUBT U B T",
        "O ground crank, A crank coupler, B coupler rocker, C ground rocker",
        {"crank": 10.0},
        bars="crank O A, coupler A B T U, rocker B C",
        forces="F1 2 AU 1.5 0.5 1.5 -0.5 12.5,F2 3 rocker 3.5 1 4.5 1 3",
    ),
    "two machines and a loose bar": case(
        "O 0 0 ground input, A 1 0, B 3 2, C 4 0 ground, P 8 1 ground input, Q 8.5 1.5, X -5 -5, Y -6 -5",
        BARS + ", flywheel P Q, loose X Y",
        PINS + ", P ground flywheel",
        {"crank": 10.0, "flywheel": 10.0},
        bars=BARS + ", flywheel P Q",
    ),
}
