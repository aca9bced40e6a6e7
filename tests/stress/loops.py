"""Loops in closed form, each sign of a root followed smoothly through change points.

A loop closes where d^2 >= (b - c)^2 and d^2 <= (b + c)^2, for two bars b, c between points d apart. Where d is the
third side of a triangle g, a with the angle theta between them,

    d^2 - (b - c)^2 = (g - a)^2 - (b - c)^2 + 4 g a sin^2(theta / 2)
    (b + c)^2 - d^2 = (b + c)^2 - (g + a)^2 + 4 g a cos^2(theta / 2)

If a constant here is exactly 0 (a change point), its root is 2 sqrt(g a) sin(theta / 2) or cos(theta / 2): it changes
its sign there, and so goes on smoothly. If not, it is the positive root, and where that ends is a limit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from tests.stress.jets import Array, Exact, Jet, Numbers, Vector, turned


@dataclass
class Closing:
    """Measures of how well the loops close, one number each for every sample.

    limits: must be positive, about 1 where regular; one is 0 at a dead centre and falls linearly. sines: of the angle
    under which two bars meet; 0 at every singular point. widths: [rad], one per loop with an arm: within this distance
    of a change point the motion turns its direction, as the arm's end passes so close to the pivot.
    """

    limits: list[Array] = field(default_factory=list)
    sines: list[Array] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)

    def root(self, squared: Jet, scale: object) -> Jet:
        """The root of what must be positive; `scale` is its magnitude where regular."""
        self.limits.append(squared.d0 / scale)
        return squared.sqrt()


def number(numbers: Numbers, *, root_of: Exact) -> object:
    """The root of an exact number."""
    return numbers.sqrt(numbers.array([numbers.number(root_of)]))[0]


class Bars(NamedTuple):
    """Two bars that close a triangle with the way d: first - second = d."""

    d: Vector
    first: Vector
    second: Vector


def on_arm(closing: Closing, lengths: tuple[Exact, Exact, Exact, Exact], side: int, theta: Jet) -> Bars:
    """Two bars between the end of an arm and a pivot: d = (g, 0) - a (cos theta, sin theta).

    lengths: g, a, first, second.
    """
    g, a, b, c = lengths
    numbers = theta.numbers
    value = numbers.number
    s, co = (theta * value(1) / 2).sin_cos()
    whole, scale = value(4 * g * a), value(4 * b * c)
    if (g - a) ** 2 == (b - c) ** 2:
        low = s * number(numbers, root_of=4 * g * a)
    else:
        low = closing.root(s * s * whole + value((g - a) ** 2 - (b - c) ** 2), scale)
    if (b + c) ** 2 == (g + a) ** 2:
        high = co * number(numbers, root_of=4 * g * a)
    else:
        high = closing.root(co * co * whole + value((b + c) ** 2 - (g + a) ** 2), scale)
    closing.sines.append(low.d0 * high.d0 * 2 / scale)
    if g != a:
        closing.widths.append(float(abs(g - a)) / math.sqrt(g * a))
    d = Vector(s * s * value(2 * a) + value(g - a), s * co * value(-2 * a))
    if g == a and b == c:  # d itself vanishes on the way, and its direction goes on
        direction = Vector(s, -co)
        first = direction.times(s * value(a)) + direction.turned_left().times(high * value(side) / 2)
    else:
        squared = s * s * whole + value((g - a) ** 2)
        along = (squared + value(b * b - c * c)) / (squared * value(2))
        across = low * high * value(side) / (squared * value(2))
        first = d.times(along) + d.turned_left().times(across)
    return Bars(d, first, first - d)


def on_level(closing: Closing, arm: Exact, bar: Exact, level: Exact, side: int, theta: Jet) -> Vector:
    """A bar from the end of an arm at (arm cos theta, arm sin theta) to the line y = level, as a vector.

    Its x^2 = bar^2 - (level - arm sin theta)^2, with 1 + sin theta = 2 sin^2(theta / 2 + pi / 4).
    """
    numbers = theta.numbers
    value = numbers.number
    s, co = (theta * value(1) / 2 + numbers.pi / 4).sin_cos()
    scale = value(2 * bar)
    if bar - level == arm:
        low = s * number(numbers, root_of=2 * arm)
    else:
        low = closing.root(s * s * value(2 * arm) + value(bar - level - arm), scale)
    if bar + level == arm:
        high = co * number(numbers, root_of=2 * arm)
    else:
        high = closing.root(co * co * value(2 * arm) + value(bar + level - arm), scale)
    closing.sines.append(low.d0 * high.d0 / value(bar))
    return Vector(low * high * value(side), value(level) - theta.sin_cos()[0] * value(arm))


def on_slide(closing: Closing, a: Exact, b: Exact, level: Exact, side: int, u: Jet) -> Bars:
    """Two bars from the origin to the point (u, level) of a slide."""
    value = u.numbers.number
    scale = value(4 * a * b)
    if level**2 == (a - b) ** 2:
        low = u
    else:
        low = closing.root(u * u + value(level**2 - (a - b) ** 2), scale)
    high = closing.root(u * u * value(-1) + value((a + b) ** 2 - level**2), scale)
    closing.sines.append(low.d0 * high.d0 * 2 / scale)
    squared = u * u + value(level**2)
    d = Vector(u, u * value(0) + value(level))
    along = (squared + value(a * a - b * b)) / (squared * value(2))
    across = low * high * value(side) / (squared * value(2))
    first = d.times(along) + d.turned_left().times(across)
    return Bars(d, first, first - d)


def in_slot(closing: Closing, g: Exact, a: Exact, e: Exact, side: int, theta: Jet) -> Vector:
    """Direction of a lever about (g, 0) whose slot, a line e to the left of the lever's axis, holds the end of an arm.

    (cos phi, sin phi) = w (s - i e) / d^2,   w = a (cos theta, sin theta) - (g, 0),   s^2 = d^2 - e^2
    """
    numbers = theta.numbers
    value = numbers.number
    sine, co = (theta * value(1) / 2).sin_cos()
    whole = value(4 * g * a)
    if (g - a) ** 2 == e * e:
        s = sine * number(numbers, root_of=4 * g * a)
    else:
        s = closing.root(sine * sine * whole + value((g - a) ** 2 - e * e), whole)
    closing.sines.append(s.d0 / number(numbers, root_of=4 * g * a))
    s = s * value(side)
    if g == a and e == 0:
        return Vector(sine, -co).times(value(-side))
    closing.widths.append(float(max(abs(g - a), e)) / math.sqrt(g * a))
    w = Vector(sine * sine * value(-2 * a) + value(a - g), sine * co * value(2 * a))
    squared = sine * sine * whole + value((g - a) ** 2)
    return Vector((w.x * s + w.y * value(e)) / squared, (w.y * s - w.x * value(e)) / squared)


def between(closing: Closing, a: Vector, bars: tuple[object, object], b: Vector, side: int) -> Bars:
    """Two bars between any two points; a bar's length is a number or a jet (a cylinder)."""
    d = b - a
    squared = d.squared()
    first, second = (bar * bar for bar in bars)  # type: ignore[operator]
    product = 4 * bars[0] * bars[1]  # type: ignore[operator]
    scale = product.d0 if isinstance(product, Jet) else product
    low = closing.root(squared - (first + second) + product / 2, scale)
    high = closing.root(first + second + product / 2 - squared, scale)
    closing.sines.append(low.d0 * high.d0 * 2 / scale)
    along = (squared + first - second) / (squared * 2)
    across = low * high * side / (squared * 2)
    bar = d.times(along) + d.turned_left().times(across)
    return Bars(d, bar, bar - d)


__all__ = ["Bars", "Closing", "between", "in_slot", "on_arm", "on_level", "on_slide", "turned"]
