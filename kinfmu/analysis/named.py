"""Loops that have a name, with their class and how well they transmit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kinfmu.analysis.grashof import Grashof, four_bar_class, slider_crank_class
from kinfmu.analysis.loops import FourBar, SliderCrank, named_loops
from kinfmu.analysis.transmission import TransmissionAngle, is_led_by_last, transmission_angle
from kinfmu.analysis.way import Way
from kinfmu.drivers import AngleDriver
from kinfmu.equations.redundancy import Redundancy
from kinfmu.mechanism import Mechanism

_MOST = 200  # coordinates of a mechanism whose transmission angles are followed, loop by loop


@dataclass(frozen=True)
class NamedLoop:
    """A four-bar or slider-crank with its class and its transmission angle on the way of each driver that moves it."""

    loop: FourBar | SliderCrank
    grashof: Grashof
    transmission: tuple[TransmissionAngle, ...] = ()


def find_named(mechanism: Mechanism, redundancy: Redundancy, ways: Sequence[Way]) -> tuple[NamedLoop, ...]:
    """The four-bars and slider-cranks of a mechanism, each read from the end that is driven.

    Joints with a row set aside are left out: they make no loop of their own. Transmission angles are left out for large
    mechanisms.
    """
    four_bars, slider_cranks = named_loops(mechanism, {row.row.owner for row in redundancy.dependent})
    followed = ways if len(mechanism.coordinate_names) <= _MOST else ()
    return (*_four_bars(mechanism, four_bars, ways, followed), *_slider_cranks(slider_cranks, followed))


def _four_bars(
    mechanism: Mechanism, loops: Sequence[FourBar], ways: Sequence[Way], followed: Sequence[Way]
) -> Iterator[NamedLoop]:
    driven = {driver.of for driver in mechanism.drivers if isinstance(driver, AngleDriver)}
    for loop in loops:
        from_last = any(is_led_by_last(way.plan, loop) for way in ways) if ways else loop.last.name in driven
        read = loop.turned_round() if from_last and loop.first.name not in driven else loop
        angles = (transmission_angle(way, read) for way in followed)
        yield NamedLoop(read, four_bar_class(*read.lengths), tuple(angle for angle in angles if angle is not None))


def _slider_cranks(loops: Sequence[SliderCrank], followed: Sequence[Way]) -> Iterator[NamedLoop]:
    for loop in loops:
        angles = (transmission_angle(way, loop) for way in followed)
        kind = slider_crank_class(loop.crank.length, loop.rod.length, loop.offset)
        yield NamedLoop(loop, kind, tuple(angle for angle in angles if angle is not None))
