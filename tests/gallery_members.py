"""Parameters of tests of which a few run every time, and all with --long; the gallery among them."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from kinfmu.mechanism import gallery

FEW = (  # members that differ most
    "cam_roller",
    "double_pendulum",  # a row of a coordinate, limits
    "excavator_loaded",  # three cylinders, masses
    "fourbar",  # a redundant row, change points
    "geared_five_bar",  # two drivers
    "jansen_leg",  # parameters, blocks of two
    "rack_steering",
    "stephenson_six_bar",  # a block of four
    "triple_rocker",  # limits on both sides
)


def mostly_long(names: Iterable[str], few: Iterable[str] = FEW) -> list[object]:
    """Return names as parameters of a test; all but a few are long."""
    few = tuple(few)
    return [name if name in few else pytest.param(name, marks=pytest.mark.long) for name in names]


every_member = pytest.mark.parametrize("name", mostly_long(gallery.names()))
