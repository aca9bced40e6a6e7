"""Closed forms of the gallery's mechanisms in 50 digits, independent of kinfmu's joints and code.

Each function takes the driven quantities as power series in time and returns every coordinate that is an output of the
mechanism, by the names it has there; its dimensions are typed here once more. Rates and accelerations are terms of the
series. Where there is no closed form one unknown is left to Newton.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tests.mechanism.gallery.geometry import LEFT, RIGHT, Quantity, Vector, decimal, degrees, heading, meet, turned
from tests.oracle import solve
from tests.power_series import Series, asin, mp, sin, sqrt

Law = Callable[[Series], Series]  # the driven quantity over time, both as series
Coordinates = dict[str, Quantity]


@dataclass(frozen=True)
class Reference:
    """How a mechanism moves: its drivers' laws, and its coordinates for given drivers."""

    laws: Mapping[str, Law]  # by the driver's first input, in file order
    coordinates: Callable[..., Coordinates]  # of one series a driver
    first: int = 0  # sample of the run at which the reference begins, and as far from the end it ends

    def inputs(self, t: float) -> dict[str, Series]:
        """The driven quantities at a time, as series about it."""
        time = Series([t, 1, 0])
        return {name: law(time) for name, law in self.laws.items()}

    def motion(self, t: float) -> dict[str, Series]:
        """Every coordinate at a time, as series about it."""
        inputs = self.inputs(t).values()
        constant = Series([0, 0, 0])
        return {name: constant + value for name, value in self.coordinates(*inputs).items()}


REFERENCES: dict[str, Reference] = {}


def reference(first: int = 0, **laws: Law) -> Callable[[Callable[..., Coordinates]], Callable[..., Coordinates]]:
    """Register the function as the reference of the gallery's mechanism of its name."""

    def enter(coordinates: Callable[..., Coordinates]) -> Callable[..., Coordinates]:
        REFERENCES[coordinates.__name__] = Reference(laws, coordinates, first)
        return coordinates

    return enter


def turning(start: float, speed: float) -> Law:
    """A constant speed in degrees a second."""
    return lambda t: t * degrees(speed) + degrees(start)


def swinging(middle: float, amplitude: float, hertz: float, phase: float = 0) -> Law:
    """A harmonic motion, phase in degrees."""
    return lambda t: sin(t * (2 * mp.pi * decimal(hertz)) + degrees(phase)) * decimal(amplitude) + decimal(middle)


def in_degrees(law: Law) -> Law:
    """A law whose values are degrees."""
    return lambda t: law(t) * (mp.pi / 180)


def rising(start: float, *rises: tuple[float, float, float], shape: Callable[[Series], Series]) -> Law:
    """Rises (begin, duration, rise), each along a curve from 0 at 0 to 1 at 1."""

    def law(t: Series) -> Series:
        value = t * 0 + decimal(start)
        for begin, duration, rise in rises:
            part = (t - decimal(begin)) / decimal(duration)
            if part.c[0] >= 1:
                value = value + decimal(rise)
            elif part.c[0] > 0:
                value = value + shape(part) * decimal(rise)
        return value

    return law


def three_four_five(x: Series) -> Series:
    """10 x^3 - 15 x^4 + 6 x^5."""
    return x * x * x * (x * (x * 6 - 15) + 10)


def cycloidal(x: Series) -> Series:
    """x - sin(2 pi x) / (2 pi)."""
    return x - sin(x * (2 * mp.pi)) / (2 * mp.pi)


def point(name: str, at: Vector) -> Coordinates:
    """World coordinates of a point of interest."""
    return {f"{name}.x": at.x, f"{name}.y": at.y}


def body(name: str, at: Vector, phi: Quantity) -> Coordinates:
    """Pose of a body whose frame moves."""
    return {**point(name, at), f"{name}.phi": phi}


ORIGIN = Vector(0, 0)


# ------------------------------------------------------------------------------------------- the reference problems


@reference(first=10, crank_angle=turning(0, 1))
def fourbar(u: Series) -> Coordinates:
    """Two cranks of length 1 stay parallel; the coupler does not turn."""
    q = Vector(1, 0) + turned(u, 1)
    return {"crank.phi": u, **body("coupler", q, 0), "rocker.phi": u, **point("A", q + Vector(1, 0))}


@reference(crank_angle=turning(300, 30))
def double_pendulum(u: Series) -> Coordinates:
    """Two bars of length 1 with their frames at the tips; the second tip stays on y = -1."""
    upper = turned(u, 1)
    lean = asin(-1 - upper.y) + 2 * mp.pi
    lower = turned(lean, 1)
    return {**body("upper", upper, u), **body("lower", Vector(upper.x + lower.x, -1), lean)}


# ------------------------------------------------------------------------------------------------------- four bars


@reference(crank_angle=turning(0, 180))
def crank_rocker(u: Series) -> Coordinates:
    """Hoeken's linkage: 20, 50, 50 on a ground of 40, traced at twice the coupler's length."""
    c = Vector(40, 0)
    p = turned(u, 20)
    q = meet(p, 50, c, 50, LEFT)
    coupler = heading(q - p, 1)
    tracer = p + turned(coupler, 100)
    return {
        "crank.phi": u,
        **body("coupler", p, coupler),
        "rocker.phi": heading(q - c, 2),
        **point("tracer", tracer),
    }


@reference(crank_angle=turning(0, 1800))
def fourbar_loaded(u: Series) -> Coordinates:
    """A crank-rocker: 40, 100, 90 on a ground of 110."""
    c = Vector(110, 0)
    p = turned(u, 40)
    q = meet(p, 100, c, 90, LEFT)
    return {"crank.phi": u, **body("coupler", p, heading(q - p, 1)), "rocker.phi": heading(q - c, 2)}


@reference(crank_angle=turning(0, 360))
def double_crank(u: Series) -> Coordinates:
    """A drag link: 60, 55, 60 on a ground of 20."""
    c = Vector(20, 0)
    p = turned(u, 60)
    q = meet(p, 55, c, 60, RIGHT)
    return {"crank.phi": u, **body("coupler", p, heading(q - p, u + 1)), "follower.phi": heading(q - c, u)}


@reference(left_angle=in_degrees(swinging(65, 17, 0.5)))
def triple_rocker(u: Series) -> Coordinates:
    """Roberts's linkage: rockers 65 on a ground of 100, a coupler of 50 with its tracer 65 from both pins."""
    b = Vector(100, 0)
    c = turned(u, 65)
    d = meet(c, 50, b, 65, LEFT)
    coupler = heading(d - c, 0)
    return {
        "left.phi": u,
        **body("coupler", c, coupler),
        "right.phi": heading(d - b, 2),
        **point("tracer", c + turned(coupler, 25, -60)),
    }


# --------------------------------------------------------------------------------------------------- slider-cranks


@reference(crank_angle=turning(0, 3600))
def slider_crank(u: Series) -> Coordinates:
    """Crank 45, rod 144, piston on y = 0."""
    p = turned(u, 45)
    s = Vector(p.x + sqrt(144**2 - p.y * p.y), p.y * 0)
    return {"crank.phi": u, **body("rod", p, heading(s - p, 0)), "piston.x": s.x}


@reference(crank_angle=turning(0, 18000))
def engine(u: Series) -> Coordinates:
    """The same dimensions, the piston on x = 0 above the crank, whose angle is 0 where it points to the piston."""
    p = turned(u, 0, 45)
    s = Vector(0, p.y + sqrt(144**2 - p.x * p.x))
    return {"crank.phi": u, **body("rod", p, heading(s - p, 1.5) - mp.pi / 2), "piston.y": s.y}


@reference(crank_angle=turning(0, 180))
def offset_slider_crank(u: Series) -> Coordinates:
    """Crank 30, rod 100, its end on y = 20."""
    p = turned(u, 30)
    rise = 20 - p.y
    s = Vector(p.x + sqrt(100**2 - rise * rise), 20)
    return {"crank.phi": u, **body("rod", p, heading(s - p, 0)), **point("slider", s)}


@reference(crank_angle=turning(0, 120))
def inverted_slider_crank(u: Series) -> Coordinates:
    """A shaper: crank 100 about (0, 300), lever 600 about (0, 0), link 250 to a ram on y = 583."""
    p = Vector(0, 300) + turned(u, 100)
    lever = heading(p, 1.5)
    tip = turned(lever, 600)
    fall = 583 - tip.y
    ram = Vector(tip.x + sqrt(250**2 - fall * fall), 583)
    return {
        "crank.phi": u,
        **body("block", p, lever),
        "lever.phi": lever,
        **body("link", tip, heading(ram - tip, 0)),
        "ram.x": ram.x,
    }


@reference(crank_angle=turning(0, 720))
def scotch_yoke(u: Series) -> Coordinates:
    """The yoke moves with the crank pin's x; crank 40."""
    return {"crank.phi": u, "yoke.x": turned(u, 40).x}


@reference(bar_angle=turning(0, 90))
def elliptic_trammel(u: Series) -> Coordinates:
    """Pins A and B, 50 either side of the bar's middle, on the x and on the y axis; the pen is 110 from the middle."""
    half = turned(u, 50)
    middle = Vector(-half.x, half.y)
    a, b = middle - half, middle + half
    return {
        "horizontal.x": a.x,
        "vertical.y": b.y,
        **body("bar", middle, u),
        **point("pen", middle + turned(u, 110)),
        **point("third", middle + turned(u, 30, 40)),
    }


# -------------------------------------------------------------------------------------------------------- six bars


@reference(crank_angle=turning(0, 180))
def watt_six_bar(u: Series) -> Coordinates:
    """Watt I: a crank-rocker 25, 75, 60 on 80; bars 60 and 55 from coupler and rocker meet at T."""
    c = Vector(80, 0)
    p = turned(u, 25)
    q = meet(p, 75, c, 60, LEFT)
    coupler, rocker = heading(q - p, 1), heading(q - c, 2)
    r, s = p + turned(coupler, 20, 50), c + turned(rocker, 100)
    t = meet(r, 60, s, 55, LEFT)
    return {
        "crank.phi": u,
        **body("coupler", p, coupler),
        "rocker.phi": rocker,
        **body("left", r, heading(t - r, 1)),
        **body("right", s, heading(t - s, 2)),
        **point("T", t),
    }


@reference(crank_angle=turning(90, 360))
def toggle_press(u: Series) -> Coordinates:
    """Crank 80 about (-520, 300), rod 430 to the knee of two links of 300; the upper one hangs from (0, 600)."""
    p, top = Vector(-520, 300) + turned(u, 80), Vector(0, 600)
    k = meet(p, 430, top, 300, RIGHT)
    s = Vector(0, k.y - sqrt(300**2 - k.x * k.x))
    return {
        "crank.phi": u,
        **body("rod", p, heading(k - p, 0)),
        "upper_link.phi": heading(k - top, -1.8),
        **body("lower_link", k, heading(s - k, -1.3)),
        "ram.y": s.y,
    }


@reference(output_angle=turning(90, 15))
def stephenson_six_bar(u: Series) -> Coordinates:
    """Stephenson III, driven at the output: Newton finds the crank's angle, all else are closed forms of it."""
    b, d = Vector(80, 0), Vector(110, 20)

    def chain(crank: Series) -> Coordinates:
        p = turned(crank, 30)
        q = meet(p, 70, b, 60, LEFT)
        coupler = heading(q - p, 1)
        r = p + turned(coupler, 60, 40)
        s = meet(r, 70, d, 70, LEFT)
        return {
            "crank.phi": crank,
            **body("coupler", p, coupler),
            "rocker.phi": heading(q - b, 2),
            **body("link", r, heading(s - r, 0)),
            "output.phi": heading(s - d, 2),
            **point("R", r),
        }

    def opening(q: list[Series], target: Series) -> list[Series]:
        return [chain(q[0])["output.phi"] - target]

    value, speed, acceleration = u.c[0], u.c[1], 2 * u.c[2]
    guess = degrees(90) + (value - degrees(90.7)) * decimal(2.85)  # straight between two poses, to a few degrees
    crank = solve(opening, [guess], value, speed, acceleration)
    return {**chain(Series([crank.q[0, 0], crank.qd[0, 0], crank.qdd[0, 0] / 2])), "output.phi": u}


# ---------------------------------------------------------------------------------------------------- special curves


@reference(crank_angle=turning(-60, 30))
def peaucellier(u: Series) -> Coordinates:
    """Arms 100 from O, a rhombus of 40, the crank 42 about (42, 0): P is the inverse of C in a circle about O."""
    a = Vector(42, 0)
    c = a + turned(u, 42)
    b, d = meet(ORIGIN, 100, c, 40, LEFT), meet(ORIGIN, 100, c, 40, RIGHT)
    p = c * ((100**2 - 40**2) / c.dot(c))
    return {
        "crank.phi": u,
        "upper_arm.phi": heading(b, 0),
        "lower_arm.phi": heading(d, 0),
        **body("upper_inner", b, heading(c - b, -2)),
        **body("lower_inner", d, heading(c - d, 2)),
        **body("upper_outer", b, heading(p - b, -1)),
        **body("lower_outer", d, heading(p - d, 1)),
        **point("P", p),
    }


@reference(crank_angle=turning(0, 360))
def jansen_leg(u: Series) -> Coordinates:
    """Theo Jansen's eleven numbers a to k; his l is the fixed pin's drop below the axle, his m the crank."""
    a, b, c, d, e, f, g, h, i, j, k, drop, m = (
        decimal(length) for length in (38, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49, 50, 61.9, 7.8, 15)
    )  # fmt: skip
    pin = Vector(-a, -drop)
    x = turned(u, m)
    top, bottom = meet(x, j, pin, b, RIGHT), meet(x, k, pin, c, LEFT)
    left = meet(top, e, pin, d, RIGHT)
    knee = meet(left, f, bottom, g, RIGHT)
    foot = meet(knee, h, bottom, i, RIGHT)
    return {
        "crank.phi": u,
        **body("upper_rod", x, heading(top - x, 2)),
        "upper_triangle.phi": heading(top - pin, 1.5),
        **body("lower_rod", x, heading(bottom - x, -2)),
        "lower_rocker.phi": heading(bottom - pin, -1),
        **body("link", left, heading(knee - left, -1)),
        **body("leg", bottom, heading(knee - bottom, 3)),
        **point("foot", foot),
    }


@reference(crank_angle=turning(0, 360))
def jansen_leg_loaded(u: Series) -> Coordinates:
    """The same lengths."""
    return jansen_leg(u)


@reference(stylus_x_position=swinging(80, 20, 0.25, 90), stylus_y_position=swinging(30, 20, 0.25))
def pantograph(x: Series, y: Series) -> Coordinates:
    """A parallelogram of 80 on arms of 240: the pen is where the stylus would be, three times as far from O."""
    stylus = Vector(x, y)
    d = meet(ORIGIN, 80, stylus, 80, LEFT)
    along, across = heading(d, 1), heading(stylus - d, -1)
    f = d * 3
    return {
        "arm.phi": along,
        **body("beam", f, across),
        **body("short_arm", f + (stylus - d), along),
        **body("short_beam", d, across),
        **point("stylus", stylus),
        **point("pen", stylus * 3),
    }


@reference(piston_position=rising(-44, (0, 1.5, 12), (2.5, 1.5, -12), shape=cycloidal))
def parallel_jaw(y: Series) -> Coordinates:
    """Bell cranks of 60 and 20 about (35, 0), moved by rods of 40 from (10, y); jaws on parallelograms; mirrored."""
    pivot, pin = Vector(35, 0), Vector(10, y)
    r = meet(pivot, 20, pin, 40, RIGHT)
    right = heading(r - pivot, 3) - mp.pi / 2
    jaw, mirrored = pivot + turned(right, 60), mp.pi - right
    return {
        "piston.y": y,
        "right_crank.phi": right,
        **body("right_jaw", jaw, 0),
        "left_crank.phi": mirrored,
        **body("left_jaw", Vector(-jaw.x, jaw.y), 0),
        **point("right_pad", jaw + Vector(-20, 40)),
        **point("left_pad", Vector(20 - jaw.x, jaw.y + 40)),
    }


@reference(cam_angle=turning(0, 360))
def cam_roller(u: Series) -> Coordinates:
    """The roller of a lever of 80 about (90, 0) stays on the cam's pitch curve: Newton finds the lever's angle."""
    c = Vector(90, 0)
    third = 2 * mp.pi / 3
    pitch = rising(40, (0, third, 20), (third * 3 / 2, third, -20), shape=cycloidal)

    def opening(q: list[Series], cam: Series) -> list[Series]:
        r = c + turned(q[0], 80)
        polar = heading(r, 0) - cam
        return [sqrt(r.dot(r)) - pitch(polar - 2 * mp.pi * mp.floor(polar.c[0] / (2 * mp.pi)))]

    value, speed, acceleration = u.c[0], u.c[1], 2 * u.c[2]
    lever = solve(opening, [degrees(147)], value, speed, acceleration)
    psi = Series([lever.q[0, 0], lever.qd[0, 0], lever.qdd[0, 0] / 2])
    return {"cam.phi": u, "lever.phi": psi, **point("roller", c + turned(psi, 80))}


@reference(cam_angle=turning(0, 360))
def flat_face_lever(u: Series) -> Coordinates:
    """The face of a lever about (90, 0) touches a disc of radius 30 about a point 10 from the axle."""
    c = Vector(90, 0)
    way = turned(u, 10) - c
    psi = heading(way, mp.pi) - asin(30 / sqrt(way.dot(way)))
    return {"cam.phi": u, "lever.phi": psi, **point("tip", c + turned(psi, 150))}


# ------------------------------------------------------------------------------------------- several drivers, gears


@reference(left_angle=turning(135, -10), right_angle=turning(45, 5))
def five_bar(left: Series, right: Series) -> Coordinates:
    """Two motors 100 apart, arms of 120, forearms of 160."""
    b = Vector(100, 0)
    p, q = turned(left, 120), b + turned(right, 120)
    t = meet(p, 160, q, 160, LEFT)
    return {
        "left_arm.phi": left,
        "right_arm.phi": right,
        **body("left_forearm", p, heading(t - p, 0.5)),
        **body("right_forearm", q, heading(t - q, 2.5)),
        **point("T", t),
    }


@reference(gear_angle=turning(0, 180))
def geared_five_bar(u: Series) -> Coordinates:
    """Gears of 40 and 20 about (0, 0) and (60, 0) carry pins at 25 and 15; links of 60 meet at T."""
    c = Vector(60, 0)
    pinion = u * -2 + mp.pi / 2
    p, q = turned(u, 25), c + turned(pinion, 15)
    t = meet(p, 60, q, 60, LEFT)
    return {
        "gear.phi": u,
        "pinion.phi": pinion,
        **body("left", p, heading(t - p, 1)),
        **body("right", q, heading(t - q, 2)),
        **point("T", t),
    }


_DIGGING: dict[str, Law] = {
    "boom_cylinder_length": rising(2.25, (1, 4, 0.4), shape=three_four_five),
    "stick_cylinder_length": rising(2.45, (0, 4, 0.45), shape=three_four_five),
    "bucket_cylinder_length": rising(1.85, (0.5, 4, 0.5), shape=three_four_five),
}


@reference(**_DIGGING)
def excavator(boom_length: Series, stick_length: Series, bucket_length: Series) -> Coordinates:
    """Boom, stick and bucket, each by the triangle that its cylinder spans; the bucket behind a four-bar linkage."""
    eye, stick_foot, p = Vector(2.4, 0.9), Vector(2.9, 1.3), Vector(5.6, 0)
    boom = meet(ORIGIN, _length(eye), Vector(0.5, -0.4), boom_length, LEFT)
    boom_phi = heading(boom, 0.5) - _angle(eye)

    def on_boom(s: Vector) -> Vector:
        return turned(boom_phi, s.x, s.y)

    pin, foot = on_boom(p), on_boom(stick_foot)
    stick_eye = Vector(-0.8, 0.3)
    stick = meet(pin, _length(stick_eye), foot, stick_length, RIGHT)
    stick_phi = heading(stick - pin, 2) - _angle(stick_eye)

    def on_stick(x: float, y: float) -> Vector:
        return pin + turned(stick_phi, x, y)

    q, idler_pin, bucket_foot = on_stick(2.9, 0), on_stick(2.5, 0), on_stick(0.3, 0.5)
    n = meet(bucket_foot, bucket_length, idler_pin, 0.6, LEFT)
    ear = Vector(0, 0.45)
    m = meet(n, 0.6, q, _length(ear), LEFT)
    bucket_phi = heading(m - q, 0) - _angle(ear)
    return {
        "boom.phi": boom_phi,
        **body("stick", pin, stick_phi),
        **body("idler", idler_pin, heading(n - idler_pin, 1)),
        **body("link", n, heading(m - n, 0)),
        **body("bucket", q, bucket_phi),
        **point("tip", q + turned(bucket_phi, 1.4, 0)),
    }


@reference(**_DIGGING)
def excavator_loaded(boom_length: Series, stick_length: Series, bucket_length: Series) -> Coordinates:
    """The same dimensions and laws."""
    return excavator(boom_length, stick_length, bucket_length)


def _length(way: Vector) -> Quantity:
    return mp.sqrt(way.dot(way))


def _angle(way: Vector) -> Quantity:
    return mp.atan2(way.y, way.x)


@reference(steering_angle=in_degrees(swinging(0, 300, 0.1)))
def rack_steering(u: Series) -> Coordinates:
    """A pinion of radius 8 moves the rack; tie rods of 270 turn arms (30, -100) about (-650, 0) and (650, 0)."""
    way = u * 8
    left_pin, right_pin = Vector(-650, 0), Vector(650, 0)
    a, b = Vector(way - 350, -100), Vector(way + 350, -100)
    radius = mp.sqrt(30**2 + 100**2)
    arm_left, arm_right = meet(a, 270, left_pin, radius, LEFT), meet(b, 270, right_pin, radius, RIGHT)
    left = heading(arm_left - left_pin, -1) - _angle(Vector(30, -100))
    right = heading(arm_right - right_pin, -2) - _angle(Vector(-30, -100))
    return {
        "pinion.phi": u,
        "rack.x": way,
        "left_rod.x": a.x,
        "left_rod.phi": heading(arm_left - a, 3),
        "right_rod.x": b.x,
        "right_rod.phi": heading(arm_right - b, 0),
        "left_knuckle.phi": left,
        "right_knuckle.phi": right,
        **point("left_wheel", left_pin + turned(left, -80)),
        **point("right_wheel", right_pin + turned(right, 80)),
    }


@reference(crank_angle=lambda t: t + decimal(1.0471975511965976))
def fourbar_chain(u: Series) -> Coordinates:
    """Bars of length 1 on pivots at 0 to 4 stay parallel; couplers do not turn."""
    coordinates: Coordinates = {"bar_0.phi": u}
    for k in range(1, 5):
        coordinates |= {f"bar_{k}.phi": u, **body(f"coupler_{k}", Vector(k - 1, 0) + turned(u, 1), 0)}
    return coordinates | point("end", Vector(4, 0) + turned(u, 1))
