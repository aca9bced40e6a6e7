"""Messages: driver values with the digits that a reader needs."""

from __future__ import annotations

from .pose import Model, Vector

ROUGHLY, LOCATED = 6, 10  # digits; limits are located to 1e-10 rad
_DEGREE = 57.29577951308232  # to a radian
_LARGE = 1e6  # [rad]; beyond, decimals say nothing


def place(model: Model, u: Vector, digits: int = ROUGHLY) -> str:
    """'crank = 1.047198 rad (60 deg)': driver values; angles to so many decimals, lengths to so many digits."""
    said = []
    for name, kind, value in zip(model.DRIVERS, model.DRIVER_KINDS, u, strict=True):
        if kind == "angle":
            said.append(f"{name} = {_decimals(value, digits)} rad ({_decimals(value * _DEGREE, digits - 2)} deg)")
        else:
            said.append(f"{name} = {value:.{digits}g} {model.LENGTH_UNIT}")
    return ", ".join(said)


def _decimals(value: float, count: int) -> str:
    """A number to so many decimals, without zeros at its end."""
    if not -_LARGE < value < _LARGE:
        return f"{value:.{count}g}"
    said = f"{value:.{count}f}".rstrip("0").rstrip(".")
    return "0" if said == "-0" else said
