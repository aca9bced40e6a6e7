"""Estimated errors of a pose's outputs: what rounding, conditioning and interpolation leave of their digits.

Every solved block is a source. Its rows are known to a few roundings of their terms, so its unknowns z to

    |dz| = |J^-1| R (2 eps (1 + offset) + residual + eps |z|)        R: scales of the rows, in lengths

which moves all blocks that come after it. Of laws with short rises, the roundings of their arguments are a source like
those of the driver values. The effect on outputs and rates is computed, not estimated: position,
velocity and acceleration are formed again at the moved pose, so that they contain the effect of a bad condition and of
rounding at each stage. The estimate is the sum over the sources. Near a singular point, of determinant m, errors grow
like 1/m, 1/m^2, 1/m^3. On a bridge the source is the difference of its two widths and the errors of its nodes.
"""

from __future__ import annotations

from math import copysign, inf, isfinite, sqrt
from typing import NamedTuple

from .linear import reciprocal_condition
from .pose import AT_REST, EPS, STEEP, UNDECIDED, UNIT_SPEED, Found, Model, Pose, Vector, evaluated, tangent_of
from .tracks import MIXED, TrackModel, held_blocks, rates_in_time
from .worst_case_step import worst_case_step

ROUNDINGS = 2.0  # of a row's terms, and of what is formed of them
UNBOUNDED = 0.5  # relative change of a determinant within a pose's error from which rates are unknown
MOST_SOURCES = 3  # with more blocks, those that move farthest represent all
STEEP_LAW = 8.0  # steps through a law per radian or size of its argument, above which the argument's rounding counts
UNKNOWN_ERRORS = inf, inf, inf


class DriverMotion(NamedTuple):
    """Speeds and accelerations of the drivers (with one driver: 1 and 0), and the bits of the blocks held."""

    ud: Vector
    udd: Vector
    held: int


class UnknownRates(NamedTuple):
    """First and second derivative of the unknowns, and the largest of each in radians and sizes."""

    first: Vector
    second: Vector
    speed: float
    curve: float


class Source(NamedTuple):
    """Errors of the unknowns: of z, of the derivatives by rounding, the derivatives given of held blocks, and of u."""

    z: Vector
    first: Vector
    second: Vector
    given_first: Vector = ()
    given_second: Vector = ()
    u: Vector = ()


def estimated_errors(model: Model, pose: Pose, ud: Vector, udd: Vector) -> tuple[float, float, float]:
    """Return estimated errors of q, qd, qdd: the largest of the outputs, in radians and sizes, per s and per s^2."""
    driven = _driver_motion(pose, ud, udd)
    rates = _rates(model, pose, driven)
    first, second, speed, curve = rates
    here = model.motion(pose.values, ud, udd, first, second)
    largest = max([abs(here[k]) for k in model.ANGLES], default=0.0)
    if len(ud) == 1:
        r = model.REACH[0]
        v = abs(ud[0]) / r
        speed, curve = speed * r * v, curve * r * r * v * v + speed * r * (abs(udd[0]) / r)
    _, qd, qdd = _differences(model, here, (0.0,) * len(here))
    speed, curve = max(speed, qd), max(curve, qdd)
    least = EPS * (1.0 + largest + model.OFFSET), ROUNDINGS * EPS * speed, ROUNDINGS * EPS * curve
    squares, lost = [0.0, 0.0, 0.0], False
    try:
        sources = _sources(model, pose, driven, rates)
        if pose.bridge is not None:
            sources.append(_of_bridge(model, pose, driven, rates))
        sources += [
            _of_track(model, pose, track, own, driven, rates) for track, own in pose.tracks if own.bridge is not None
        ]
        for source in sources:
            there, first, second = _moved(model, pose, driven, rates, source)
            q, qd, qdd = _differences(model, model.motion(there[-1], ud, udd, first, second), here)
            lost = lost or _is_singular_between(pose, there)
            squares[0] += q * q
            squares[1] += qd * qd
            squares[2] += qdd * qdd
    except (ArithmeticError, ValueError):  # exactly singular, or the sine of an overflow
        return UNKNOWN_ERRORS
    for own, v, slope in _bridged(model, pose, ud, rates):
        for order, off in enumerate(own.bridge.missed(own, slope)):
            squares[order] += (off * v**order) ** 2
    if not isfinite(sum(squares)):
        return UNKNOWN_ERRORS
    if lost or _is_at_a_crossing(model, pose, rates):
        return least[0] + sqrt(squares[0]), inf, inf
    return least[0] + sqrt(squares[0]), least[1] + sqrt(squares[1]), least[2] + sqrt(squares[2])


def _bridged(model: Model, pose: Pose, ud: Vector, rates: UnknownRates) -> list[tuple[Pose, float, float]]:
    """Return the interpolated parts of a pose, with their driver's speed in radians and sizes, and steepest slope."""
    if pose.bridge is not None:
        return [(pose, abs(ud[0]) / model.REACH[0], rates.speed * model.REACH[0])]
    found = []
    for track, own in pose.tracks:
        if own.bridge is not None:
            slope = max([abs(a) / c for a, c in zip(tangent_of(track, own)[0], track.UNKNOWN_SCALES)])  # noqa: B905
            reach = track.REACH[0]
            found.append((own, abs(ud[track.driver]) / reach, slope * reach))
    return found


def _is_singular_between(pose: Pose, there: Found) -> bool:
    """Return whether a determinant changes by half of its size to a pose that rounding cannot distinguish.

    So close to a singular point the rates have no bound.
    """
    held = held_blocks(pose)
    pairs = enumerate(zip(pose.determinants, there[1], strict=True))
    return any(abs(b - a) > UNBOUNDED * abs(a) for k, (a, b) in pairs if not held >> k & 1)


def _is_at_a_crossing(model: Model, pose: Pose, rates: UnknownRates) -> bool:
    """Return whether branches cross without a bridge: to which branch the rates belong is unknown.

    There the rates stay as they are while the determinant falls; right before a dead centre they are steep.
    """
    if any(
        _is_at_a_crossing(track, own, _rates(track, own, _driver_motion(own, UNIT_SPEED, AT_REST)))
        for track, own in pose.tracks
    ):
        return True
    may_cross = len(pose.u) == 1 and pose.bridge is None
    return may_cross and pose.margin < UNDECIDED and rates.speed * model.REACH[0] < STEEP


def margin_of(model: Model, pose: Pose) -> float:
    """Return the smallest over the blocks of 1 / cond of the equilibrated block, 0 at a singular point.

    Or of |determinant| over the largest that it can be: where a row vanishes, as for a piston that drives at its
    dead centre, equilibrating hides it.
    """
    margin: float = min(1.0, pose.margin)
    for matrix in model.jacobians(pose.values):
        if len(matrix) > 1:
            margin = min(margin, reciprocal_condition(matrix))
    return margin


def with_driver_errors(
    model: Model,
    pose: Pose,
    ud: Vector,
    udd: Vector,
    off: tuple[Vector, Vector],
    errors: tuple[float, float, float],
) -> tuple[float, float, float]:
    """Return the errors plus those caused by errors `off` >= 0 of the drivers' speeds and accelerations."""
    of_q, of_qd, of_qdd = errors
    here = _motion(model, pose, ud, udd)
    for k, (speed, acceleration) in enumerate(zip(*off)):  # noqa: B905  one item per driver
        if speed == inf:
            return of_q, inf, inf
        _, by_speed, by_speed_too = _differences(model, _motion(model, pose, _shifted(ud, k, speed), udd), here)
        of_qd += by_speed
        of_qdd += by_speed_too
        if acceleration == inf:
            of_qdd = inf
        else:
            of_qdd += _differences(model, _motion(model, pose, ud, _shifted(udd, k, acceleration)), here)[2]
    return of_q, of_qd, of_qdd


def _shifted(values: Vector, k: int, more: float) -> Vector:
    return (*values[:k], values[k] + more, *values[k + 1 :])


def _motion(model: Model, pose: Pose, ud: Vector, udd: Vector) -> Vector:
    """Return positions, rates and accelerations of the outputs."""
    rates = _rates(model, pose, _driver_motion(pose, ud, udd))
    return model.motion(pose.values, ud, udd, rates.first, rates.second)  # type: ignore[no-any-return]


def _differences(model: Model, there: Vector, here: Vector) -> tuple[float, float, float]:
    """Return the largest differences of two rows of motion, of each order, in radians and sizes; inf for a NaN."""
    if isfinite(sum(there) + sum(here)):
        return model.differences(there, here)  # type: ignore[no-any-return]  # generated code has no types
    n = len(model.OUTPUTS)
    q, qd, qdd = [_largest(model, there[k : k + n], here[k : k + n]) for k in range(0, 3 * n, n)]
    return q, qd, qdd


def _largest(model: Model, there: Vector, here: Vector) -> float:
    """Return the largest difference of two rows of outputs, in radians and sizes."""
    largest = 0.0
    for k, (a, b) in enumerate(zip(there, here)):  # noqa: B905  one item per output
        gap = abs(a - b) if k in model.ANGLES else abs(a - b) / model.SIZE
        if gap != gap:
            return inf
        largest = max(largest, gap)
    return largest


def _driver_motion(pose: Pose, ud: Vector, udd: Vector) -> DriverMotion:
    held = held_blocks(pose)
    return DriverMotion(UNIT_SPEED, AT_REST, held) if len(ud) == 1 else DriverMotion(ud, udd, held)


def _rates(model: Model, pose: Pose, driven: DriverMotion) -> UnknownRates:
    speed = curve = 0.0
    if len(driven.ud) == 1:
        first, second = tangent_of(model, pose)
    else:
        first, second = rates_in_time(model, pose, driven.ud, driven.udd)
    for rate, bend, scale in zip(first, second, model.UNKNOWN_SCALES):  # noqa: B905  one item per unknown
        speed, curve = max(speed, abs(rate) / scale), max(curve, abs(bend) / scale)
    for rate, bend, scale in zip(driven.ud, driven.udd, model.REACH):  # noqa: B905  one item per driver
        speed, curve = max(speed, abs(rate) / scale), max(curve, abs(bend) / scale)
    return UnknownRates(first, second, speed, max(curve, speed * speed))


def _sources(model: Model, pose: Pose, driven: DriverMotion, rates: UnknownRates) -> list[Source]:
    """Return the sources of the blocks, only the largest ones if there are many."""
    n = len(model.UNKNOWNS)
    rounding = ROUNDINGS * EPS * (1.0 + model.ROW_OFFSET)
    matrices = model.jacobians(pose.values)
    found = []
    for block, matrix in enumerate(matrices):
        if driven.held >> block & 1:
            continue
        low, high = model.BLOCKS[block]
        scales = model.UNKNOWN_SCALES[low:high]
        step = worst_case_step(matrix, model.ROW_SCALES[block], scales)
        own = farthest = 0.0
        for z, a, scale in zip(pose.z[low:high], step, scales):  # noqa: B905  one item per unknown
            own, farthest = max(own, abs(z) / scale), max(farthest, abs(a) / scale)
        c = rounding + pose.residual + EPS * own
        found.append((c * farthest, block, step, c))
    count = len(found)
    if count > 2:  # a sum of two is the same in any order
        found.sort(key=lambda source: -source[0])
        found = found[:MOST_SOURCES]
    sources = []
    still = (0.0,) * len(driven.ud)
    for _, block, step, c in found:
        low, high = model.BLOCKS[block]
        given = (*((0.0,) * low), *step, *((0.0,) * (n - high)))
        all_of = model.velocity(pose.values, still, given, driven.held | 1 << block)
        weight = sqrt(count / len(found))
        of_z, of_rates = weight * c, weight * rounding
        of_first, of_second = of_rates * rates.speed, of_rates * rates.curve
        sources.append(
            Source(
                tuple([of_z * a for a in all_of]),
                tuple([of_first * a for a in all_of]),
                tuple([of_second * a for a in all_of]),
            )
        )
    rounded = _rounding_of_laws(model, pose) if model.LAW_TURNS else 0.0
    if rounded:  # at a break of a law its two sides differ
        sources += [_of_laws(model, pose, driven, rates, moved) for moved in (-rounded, rounded)]
    return sources


def _rounding_of_laws(model: Model, pose: Pose) -> float:
    """Return how well the arguments of steep laws are known, in radians and sizes; 0 without such laws."""
    slopes, added, positions = model.law_slopes(), model.law_added(), model.law_positions(pose.values)
    arguments = zip(slopes, added, positions, model.LAW_UNITS)  # noqa: B905  more positions
    steep = [(abs(here) + more) / unit for slope, more, here, unit in arguments if slope * unit > STEEP_LAW]
    return ROUNDINGS * EPS * (1.0 + max(steep)) if steep else 0.0


def _of_laws(model: Model, pose: Pose, driven: DriverMotion, rates: UnknownRates, moved: float) -> Source:
    """Return the source of steep laws: the motion where the drivers are moved by the rounding of the arguments."""
    u = tuple([moved * reach for reach in model.REACH])
    none = (0.0,) * len(pose.z)
    if len(u) == 1:
        z = tuple([u[0] * a for a in rates.first])
    else:
        z = tuple(model.velocity(pose.values, u, none, driven.held))
    return Source(z, none, none, u=u)


def _of_bridge(model: Model, pose: Pose, driven: DriverMotion, rates: UnknownRates) -> Source:
    """Return the source of a bridge: the difference of its two widths, and the errors of its nearest nodes."""
    half = pose.bridge.half
    nodes = [_of_node(model, node, half) for node in pose.bridge.span.nodes[2:4]]
    rounding = [max(pair) for pair in zip(*nodes)]  # noqa: B905  one item per unknown
    z, zd, zdd = pose.bridge.difference(pose.u[0])
    given = [
        tuple([a + (c * e if a >= 0.0 else -c * e) for a, e in zip(gap, rounding)])  # noqa: B905
        for gap, c in ((z, 1.0), (zd, 1.0 / half), (zdd, 1.0 / half**2))
    ]
    still = (0.0,)
    none = (0.0,) * len(pose.z)
    moved = tuple(model.velocity(pose.values, still, given[0], driven.held))
    first = tuple([a + b for a, b in zip(rates.first, given[1])])  # noqa: B905
    second = tuple([a + b for a, b in zip(rates.second, given[2])])  # noqa: B905
    return Source(moved, none, none, first, second)


def _of_track(
    model: Model, pose: Pose, track: TrackModel, own: Pose, driven: DriverMotion, rates: UnknownRates
) -> Source:
    """Return the source of the bridge of one track, in time."""
    at_unit_speed = _driver_motion(own, UNIT_SPEED, AT_REST)
    along = _rates(track, own, at_unit_speed)
    off = _of_bridge(track, own, at_unit_speed, along)
    v, a = driven.ud[track.driver], driven.udd[track.driver]
    still = (0.0,) * len(rates.first)
    off_first = [x - y for x, y in zip(off.given_first, along.first)]  # noqa: B905  one item per unknown
    off_second = [x - y for x, y in zip(off.given_second, along.second)]  # noqa: B905
    first = track.put([v * x for x in off_first], still)
    second = track.put([v * v * y + a * x for x, y in zip(off_first, off_second)], still)  # noqa: B905
    of_tracks = sum([1 << k for k, by in enumerate(model.BLOCK_DRIVERS) if by != MIXED])
    return Source(
        tuple(model.velocity(pose.values, (0.0,) * len(pose.u), track.put(off.z, still), of_tracks)),
        still,
        still,
        tuple([x + y for x, y in zip(rates.first, first)]),  # noqa: B905
        tuple([x + y for x, y in zip(rates.second, second)]),  # noqa: B905
    )


def _of_node(model: Model, node: Pose, half: float) -> Vector:
    """Return the error of a bridge's node in each unknown: of z, half z' and half^2 z'' together."""
    driven = _driver_motion(node, UNIT_SPEED, AT_REST)
    rates = _rates(model, node, driven)
    squares = [0.0] * len(node.z)
    for source in _sources(model, node, driven, rates):
        _, first, second = _moved(model, node, driven, rates, source)
        for k, dz in enumerate(source.z):
            error = abs(dz) + half * abs(first[k] - rates.first[k]) + half**2 * abs(second[k] - rates.second[k])
            squares[k] += error * error
    return tuple([sqrt(square) for square in squares])


def _moved(
    model: Model, pose: Pose, driven: DriverMotion, rates: UnknownRates, source: Source
) -> tuple[Found, Vector, Vector]:
    """Return the result of `position` at the pose moved by a source, and its first and second derivative."""
    z = tuple([a + d for a, d in zip(pose.z, source.z)])  # noqa: B905
    u = tuple([a + d for a, d in zip(pose.u, source.u)]) if source.u else pose.u  # noqa: B905
    there = evaluated(model, u, z)
    values = there[-1]
    first = model.velocity(values, driven.ud, source.given_first or rates.first, driven.held)
    first = _added(first, rates.first, source.first)
    second = model.acceleration(values, driven.ud, driven.udd, first, source.given_second or rates.second, driven.held)
    return there, first, _added(second, rates.second, source.second)


def _added(there: Vector, here: Vector, more: Vector) -> Vector:
    """Return `there` moved by `more` away from `here`, so that two errors cannot cancel by chance."""
    along = 0.0
    for a, b, c in zip(there, here, more):  # noqa: B905  one item per unknown
        along += (a - b) * c
    sign = copysign(1.0, along)
    return tuple([a + sign * c for a, c in zip(there, more)])  # noqa: B905
