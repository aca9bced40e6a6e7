"""Names of variables: `<body>.x .y .phi`, rates `.vx .vy .omega`, accelerations `.ax .ay .alpha`; points alike."""

from __future__ import annotations

from kinfmu.units import Quantity

_DERIVATIVES = {"x": ("x", "vx", "ax"), "y": ("y", "vy", "ay"), "phi": ("phi", "omega", "alpha")}


def derivative_name(name: str, order: int) -> str:
    """'coupler.vx' of 'coupler.x' and order 1; order 0 is the name itself."""
    owner, _, coordinate = name.rpartition(".")
    return f"{owner}.{_DERIVATIVES[coordinate][order]}"


def quantity_of(name: str, order: int = 0, per: str = "time") -> Quantity:
    """What a coordinate such as 'coupler.x' or 'coupler.phi' measures, or its derivative of the given order."""
    return Quantity("angle" if name.endswith(".phi") else "length", order, per)


def is_coordinate(name: str) -> bool:
    """Return True for a name such as 'coupler.x'."""
    owner, _, coordinate = name.rpartition(".")
    return bool(owner) and coordinate in _DERIVATIVES
