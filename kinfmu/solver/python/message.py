"""Messages: driver values with the digits that a reader needs."""

from __future__ import annotations

from .pose import Model, Vector

ROUGHLY, LOCATED = 6, 10  # digits; limits are located to 1e-10 rad
_DEGREE = 57.29577951308232  # degrees in a radian
_LARGE = 1e6  # [rad]; decimals of larger numbers are meaningless
_MORE = 6  # digits that such numbers have before the point


def place(model: Model, u: Vector, digits: int = ROUGHLY) -> str:
    """Return driver values as 'crank = 1.047198 rad (60 deg)'; digits: decimals of angles, digits of lengths."""
    parts = []
    for name, kind, value in zip(model.DRIVERS, model.DRIVER_KINDS, u, strict=True):
        if kind == "angle":
            parts.append(f"{name} = {_decimals(value, digits)} rad ({_decimals(value * _DEGREE, digits - 2)} deg)")
        else:
            parts.append(f"{name} = {value:.{digits}g} {model.LENGTH_UNIT}")
    return ", ".join(parts)


def differs(model: Model, a: Vector, b: Vector, digits: int) -> bool:
    """Return whether `place` shows a driver of two places with different digits: of an angle, in rad and in degrees."""
    for kind, first, second in zip(model.DRIVER_KINDS, a, b, strict=True):
        if kind != "angle":
            is_same = f"{first:.{digits}g}" == f"{second:.{digits}g}"
        else:  # in degrees there are fewer digits
            is_same = _decimals(first * _DEGREE, digits - 2) == _decimals(second * _DEGREE, digits - 2)
        if not is_same:
            return True
    return False


def _decimals(value: float, count: int) -> str:
    """Return a number with at most `count` decimals, without zeros at its end."""
    if not -_LARGE < value < _LARGE:
        return f"{value:.{count + _MORE if count > ROUGHLY else count}g}"
    text = f"{value:.{count}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
