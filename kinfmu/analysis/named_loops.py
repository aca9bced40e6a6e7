"""Four-bars and slider-cranks with their class and transmission angles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from kinfmu.analysis.driver_path import DriverPath
from kinfmu.analysis.grashof import Grashof, four_bar_class, slider_crank_class
from kinfmu.analysis.loops import FourBar, SliderCrank, named_loops
from kinfmu.analysis.transmission import TransmissionRange, is_led_by_last, transmission_angle
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.drivers import AngleDriver
from kinfmu.plan.equations.redundancy import Redundancy

MOST = 200  # coordinates; transmission angles of larger mechanisms are not computed


@dataclass(frozen=True)
class NamedLoop:
    """A four-bar or slider-crank with its class and its transmission angle over the path of each driver.

    assembly: of a four-bar in the assembled pose, 'open' or 'crossed'; '' for others, or without a pose.
    """

    loop: FourBar | SliderCrank
    grashof: Grashof
    transmission: tuple[TransmissionRange, ...] = ()
    assembly: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the loop as plain data."""
        loop, kind = self.loop, self.grashof
        if isinstance(loop, FourBar):
            lengths = dict(zip(("ground", *loop.links), loop.lengths, strict=True))
            sizes: dict[str, Any] = {"kind": "four-bar", "links": list(loop.links), "lengths": lengths}
        else:
            lengths = {link.name: link.length for link in (loop.crank, loop.rod)}
            sizes = {"kind": "slider-crank", "links": list(loop.links), "lengths": lengths, "offset": loop.offset}
        return {
            **sizes,
            "class": kind.name,
            "shape": kind.shape or None,
            "assembly": self.assembly or None,
            "sums": [kind.small, kind.large],
            "transmission": [angle.as_json() for angle in self.transmission],
        }


def find_named_loops(
    mechanism: Mechanism, redundancy: Redundancy, paths: Sequence[DriverPath]
) -> tuple[NamedLoop, ...]:
    """Return the four-bars and slider-cranks of a mechanism, each read from its driven end.

    Joints with a row set aside are ignored: they form no loop of their own. Large mechanisms have no
    transmission angles.
    """
    four_bars, slider_cranks = named_loops(mechanism, {row.row.owner for row in redundancy.dependent})
    followed = paths if len(mechanism.coordinate_names) <= MOST else ()
    return (*_four_bars(mechanism, four_bars, paths, followed), *_slider_cranks(slider_cranks, followed))


def _four_bars(
    mechanism: Mechanism, loops: Sequence[FourBar], paths: Sequence[DriverPath], followed: Sequence[DriverPath]
) -> Iterator[NamedLoop]:
    driven = {driver.of for driver in mechanism.drivers if isinstance(driver, AngleDriver)}
    for loop in loops:
        from_last = any(is_led_by_last(path.plan, loop) for path in paths) if paths else loop.last.name in driven
        read = loop.turned_round() if from_last and loop.first.name not in driven else loop
        angles = (transmission_angle(path, read) for path in followed)
        kind, assembly = four_bar_class(*read.lengths), ""
        if paths:
            pose = paths[0].coordinates(paths[0].solver.anchor)
            assembly = "crossed" if read.is_crossed(pose) else "open"
        if kind.shape == "parallelogram" and assembly == "crossed":
            kind = replace(kind, shape="antiparallelogram")
        yield NamedLoop(read, kind, tuple(angle for angle in angles if angle is not None), assembly)


def _slider_cranks(loops: Sequence[SliderCrank], followed: Sequence[DriverPath]) -> Iterator[NamedLoop]:
    for loop in loops:
        angles = (transmission_angle(path, loop) for path in followed)
        kind = slider_crank_class(loop.crank.length, loop.rod.length, loop.offset)
        yield NamedLoop(loop, kind, tuple(angle for angle in angles if angle is not None))
