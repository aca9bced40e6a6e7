"""Motion: the coordinates of a mechanism over time or over a driver's value, in the words of readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray, IntArray
from kinfmu.errors import RequestError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.force_names import NEVER_NEGATIVE
from kinfmu.mechanism.members import kind_of_measured
from kinfmu.mechanism.quantities import PoseQuantity, cosine_between
from kinfmu.mechanism.quantities.arithmetic import Value, sqrt
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement, body_of, unit_vector
from kinfmu.motion.breaks import ORDER, Break, distinct, law_breaks, split_at
from kinfmu.motion.extremes import Extremes, SamplesNeededError
from kinfmu.motion.fitting import Circle, Line, deviation
from kinfmu.motion.history import FEWEST, Extreme, History, first_pole
from kinfmu.motion.quantities import QuantityNames, QuantityRead, path_of
from kinfmu.motion.samples import (
    driven_at,
    driven_samples,
    goes_round,
    is_crowded,
    lowest,
    sampled_history,
    spread,
    window,
    within_period,
)
from kinfmu.plan.equations.system import size_of
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Run
from kinfmu.run.axis import TIME
from kinfmu.units import CoordinateName, Quantity

SHAPES: dict[str, type[Line] | type[Circle]] = {"line": Line, "circle": Circle}
Vector = tuple[Taylor, Taylor]
MARGIN = "solver.margin"  # its column, of which only samples are known
_STILL = 1e-9  # [rad, sizes]; of rates: of their largest value; a quantity that changes by less does not move
_TURNED = 1.0  # [rad]; the ends of a motion that goes round differ by nothing or by whole turns


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of a mechanism, for one design or for many.

    Attributes:
        mechanism: The mechanism; of many designs the one they vary.
        x: (n,) ascending arguments: time, or values of the driver; rates are derivatives by them.
        per: What x is: 'time', 'angle' or 'length'.
        tables: Values, rates and accelerations of the outputs, each (..., n, m).
        outputs: The m quantities of which the tables hold columns: coordinates by their names, and others.
        fixed: Coordinates that a joint holds at a constant, by name; those that differ between designs are (m, 1).
        drive: Value of the driver over x; None if several drivers move.
        points: Body-fixed coordinates of the points by 'body.point'; those that differ between designs are (m, 1).
        driver: Name of that driver; 'time' if several move.
        is_closed: True if the motion goes round: the last sample is the first, after one period.
        window: First and last argument of the part that readings see; None: all of it.
        sampled: The samples (..., n) of a column of which rates are unknown, by its name: of a force, or of the margin.
            None: they are unknown too.
        is_seamed: True if a law's derivatives jump at the ends of a motion that goes round. Inside x is twice where
            they jump, once for each side.
        extremes: Extremes of many designs, which are known in place of the tables; None: the tables hold samples.

    """

    mechanism: Mechanism
    x: FloatArray
    per: str
    tables: tuple[FloatArray, FloatArray, FloatArray]
    outputs: Sequence[QuantityRead]
    fixed: Mapping[CoordinateName, Value]
    drive: History | None
    points: Mapping[str, tuple[Value, Value]]
    driver: str = TIME
    is_closed: bool = False
    window: tuple[float, float] | None = None
    sampled: Callable[[str], FloatArray] | None = None
    is_seamed: bool = False
    extremes: Extremes | None = None
    _histories: dict[QuantityRead, History] = field(default_factory=dict, repr=False)
    _names: QuantityNames | None = field(default=None, repr=False)  # the same object in all parts and all designs
    _windows: dict[tuple[float | None, float | None, bool], tuple[float, float]] = field(
        default_factory=dict, repr=False
    )

    @classmethod
    def of_run(cls, run: Run) -> Motion:
        """Return the motion of a run; forces and margins are computed when they are read.

        Raise a RequestError if the run has too few samples or no mechanism, or its samples are not in the order of time
        or of one driver that has a constant speed.
        """
        mechanism = run.mechanism
        if mechanism is None:
            raise RequestError("the run holds no mechanism, so nothing can be measured on it")
        if len(run) < FEWEST:
            raise RequestError(f"the run has {len(run)} samples; measures need {FEWEST} or more")
        x, per, order, driver, drive = driven_samples(run)
        tables = run.values[order], run.rates[order], run.accelerations[order]

        def sampled(name: str) -> FloatArray:
            return (run.margin if name == MARGIN else np.asarray(run[name], dtype=float))[order]

        points: Any = mechanism.body_points
        motion = cls(mechanism, x, per, tables, run.outputs, run.fixed, drive, points, driver, sampled=sampled)
        motion = motion._spread()
        outputs = [(motion.quantity_history(name), name.is_angle) for name in run.outputs]
        is_closed = bool(outputs) and bool(goes_round(outputs))
        breaks = motion.breaks(over_time=run.axis == TIME)
        return motion._split(breaks, is_closed=is_closed)._spread().going_round(is_closed)

    def _spread(self) -> Motion:
        """Return the motion without samples that are so close to others that they add nothing but rounding."""
        if not is_crowded(self.x):
            return self
        kept = spread(self.x, self.tables[1], self.tables[2])
        sampled = self.sampled
        return replace(
            self,
            x=self.x[kept],
            tables=tuple(table[kept] for table in self.tables),  # type: ignore[arg-type]  # three of them
            drive=self.drive and self.drive.samples(kept),
            sampled=sampled and (lambda name: sampled(name)[kept]),
            _histories={},
        )

    def breaks(self, *, over_time: bool) -> list[Break]:
        """Return where derivatives of laws of drivers and joints jump; over_time: drivers follow their laws."""
        found: list[Break] = []
        laws = [(driver.law, self.argument) for driver in self.mechanism.drivers] if over_time else []
        for joint in self.mechanism.joints:
            with suppress(RequestError):  # the motion does not hold the bodies
                led = joint.led_by(self._placement(joint.bodies()))
                laws += [(led[0], self._as_history(led[1]))] if led else []
        for law, history in laws:
            if history.is_known:
                found += law_breaks(history, law.own_breaks(ORDER), law.own_breaks())
        return distinct(found, self.x)

    def _split(self, breaks: Sequence[Break], *, is_closed: bool) -> Motion:
        """Return the motion with samples on both sides of each break."""
        split = split_at(self.x, breaks, is_closed=is_closed)
        if split.is_empty:
            return replace(self, is_seamed=split.is_seamed, _histories={})
        sampled = self.sampled
        return replace(
            self,
            x=split.x_split,
            tables=split.tables(self.tables),
            drive=self.drive and split.driver(self.drive),
            sampled=sampled and (lambda name: split.samples(sampled(name), is_smooth=name != MARGIN)),
            is_seamed=split.is_seamed,
            _histories={},
        )

    def goes_round(
        self, quantities: Sequence[QuantityRead], is_known: NDArray[np.bool_] | None = None
    ) -> NDArray[np.bool_]:
        """Return (...) whether quantities go round, whatever else moves; is_known: designs without gaps, if known."""
        if self.extremes is not None:
            return self.extremes.goes_round(quantities)
        moving = [(self.quantity_history(one), one.is_angle) for one in quantities if one not in self.fixed]
        return goes_round(moving, is_known) if moving else np.full(self.tables[0].shape[:-2], self.is_closed)

    def going_round(self, is_closed: bool) -> Motion:
        """Return the motion as one that goes round, or does not."""
        if is_closed == self.is_closed:
            return self
        drive = replace(self.drive, is_closed=is_closed) if self.drive else None
        return replace(self, is_closed=is_closed, drive=drive, _histories={})

    def of_designs(self, chosen: IntArray) -> Motion:
        """Return the motion of some of the designs, of one leading axis."""
        if self.extremes is not None:
            return replace(self, extremes=self.extremes.of_designs(chosen))

        def rows(value: Value) -> Value:
            return value[chosen] if isinstance(value, np.ndarray) else value

        tables = [table.transpose(0, 2, 1)[chosen].transpose(0, 2, 1) for table in self.tables]
        return replace(
            self,
            tables=(tables[0], tables[1], tables[2]),
            fixed={name: rows(value) for name, value in self.fixed.items()},
            points={name: (rows(x), rows(y)) for name, (x, y) in self.points.items()},
            _histories={},
        )

    def __post_init__(self) -> None:
        if self._names is None:
            object.__setattr__(self, "_names", QuantityNames(self.mechanism))

    @property
    def names(self) -> QuantityNames:
        """What quantities are called."""
        assert self._names is not None  # noqa: S101  __post_init__ makes it
        return self._names

    @property
    def argument(self) -> History:
        """The argument itself as a history: what rates are derivatives by, and the driver where it is one."""
        return History(self.x, self.x, np.ones_like(self.x), np.zeros_like(self.x), self.is_closed, self.is_seamed)

    @property
    def driver_quantity(self) -> Quantity:
        """What the value of the driver measures; time where several drivers move."""
        found = [driver.quantity for driver in self.mechanism.drivers if driver.name == self.driver]
        return found[0] if found else Quantity("time")

    def driven_at(self, x: FloatArray) -> FloatArray:
        """Return values of the driver at arguments (...); the end of a motion that goes round is its begin."""
        return x if self.drive is None else within_period(self.drive, driven_at(self.drive, x))

    def driven_between(self, start: FloatArray, stop: FloatArray) -> FloatArray:
        """Return how far the driver moves between arguments (...)."""
        if self.drive is None:
            return np.abs(stop - start)
        return np.abs(driven_at(self.drive, stop) - driven_at(self.drive, start))

    def part(self, begin: float | None, end: float | None) -> Motion:
        """Return the part of the motion between two values of the driver; None: its first or last.

        Raise a RequestError if the driver turns back or does not reach them.
        """
        if begin is None and end is None:
            return self
        key = (begin, end, self.is_closed)
        if key not in self._windows:
            self._windows[key] = window(self.argument if self.drive is None else self.drive, begin, end)
        return replace(self, window=self._windows[key], _histories=self._histories)

    def require_closed(self, word: str) -> None:
        """Raise a RequestError unless the motion goes round; word: what needs that."""
        if not self.is_closed:
            raise RequestError(f"{word} needs a motion that goes round: its last pose must be the first")

    def at_rest(self, of: str | PoseQuantity) -> tuple[NDArray[np.bool_], str]:
        """Return (...) True for the designs in which a quantity does not move, and that as text."""
        history = self.history(of)
        low, high = (extreme.value for extreme in history.extremes())
        quantity = self.quantity(of)
        largest = np.maximum(np.abs(low), np.abs(high))
        size = 1.0 if quantity.kind == "angle" else size_of(self.mechanism)
        least = _STILL * (size if quantity.order == 0 else largest)
        return np.asarray(high - low <= least), f"{_name(of)} does not move"

    def turning_on(self, of: str | PoseQuantity, so: str) -> tuple[NDArray[np.bool_], str]:
        """Return (...) True for the designs in which an angle turns on where the motion goes round; so: what follows.

        Its first value differs from its last one by whole turns; which values are the extremes depends on where the
        motion begins.
        """
        history = self.history(of)
        turn = np.abs(history.value[..., -1] - history.value[..., 0])
        is_angle = self.quantity(of) == Quantity("angle")
        found = np.asarray((turn > _TURNED) & (history.is_closed and is_angle))
        return found, f"{_name(of)} turns all the way round, {so}"

    def ratio(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Return a / b; NaN or infinite where b is 0."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.divide(a, b))

    def quantity(self, of: str | PoseQuantity, order: int = 0) -> Quantity:
        """Return what a quantity, or its derivative of an order, measures."""
        if of in self.names.forces:
            return self.names.forces[of][0].quantity
        own = self.names.orders.get(of) if isinstance(of, str) else None
        order += own[1] if own else 0
        return Quantity(kind_of_measured(of), order, self.per if order else "time")

    def ratio_quantity(self, of: str | PoseQuantity, to: str | None, *, inverse: bool = False) -> Quantity:
        """Return what the ratio of two speeds measures."""
        kinds = [kind_of_measured(of), self.driver_quantity.kind if to is None else kind_of_measured(to)]
        over, under = kinds[::-1] if inverse else kinds
        return Quantity("number") if over == under else Quantity(over, 1, under)

    def history(self, of: str | PoseQuantity) -> History:
        """Return a quantity over the motion: a coordinate, a rate of one, or a measured quantity."""
        if self.extremes is not None:
            return self._extremes_of(of, 0)
        return self._cut(self._whole(of))

    def derivative(self, of: str | PoseQuantity, order: Literal[1, 2]) -> History:
        """Return the speed (order 1) or acceleration (2) of a quantity; of a point 'body.point' its magnitude."""
        if self.extremes is not None:
            return self._extremes_of(of, order)
        if isinstance(of, str) and of in self.mechanism.body_points:
            x, y = (_derived(history, order).taylor for history in self._path(of))
            return self._cut(self._as_history(sqrt(x * x + y * y)))
        return self._cut(_derived(self._whole(of), order))

    def _extremes_of(self, of: str | PoseQuantity, order: int) -> History:
        """Return the extremes of a quantity, or of its derivative of an order, in place of its history."""
        assert self.extremes is not None  # noqa: S101  the callers look
        columns, order = self.extremes.channels.find(self.names, self.mechanism.body_points, of, order)
        found: Any = self.extremes.of(columns, order, self.window, self.x, is_closed=self.is_closed)
        return found  # type: ignore[no-any-return]  # as much of a history as most measures read

    def speed_ratio(self, of: str | PoseQuantity, to: str | None) -> History:
        """Return the speed of a quantity over that of another; to: a coordinate, None: the driver."""
        over, under = self._speeds(of, to)
        with np.errstate(all="ignore"):  # samples at which the other is at rest have no ratio
            return self._cut(self._as_history(over.taylor / under.taylor))

    def largest_ratio(self, of: str | PoseQuantity, to: str | None) -> Extreme:
        """Return the largest size of a ratio of speeds: infinite where it has no bound."""
        found, pole = self.speed_ratio(of, to).largest_size(), self._pole(of, to)
        return Extreme(np.where(np.isnan(pole), found.value, np.inf), np.where(np.isnan(pole), found.x, pole))

    def unbounded_ratio(self, of: str | PoseQuantity, to: str) -> tuple[NDArray[np.bool_], str]:
        """Return (...) True for the designs in which a ratio of speeds has no bound, and that as text."""
        return ~np.isnan(self._pole(of, to)), f"{_name(to)} turns back, where the ratio has no bound"

    def _pole(self, of: str | PoseQuantity, to: str | None) -> FloatArray:
        """Return (...) the first place where a ratio of speeds has no bound, NaN for designs without one."""
        over, under = self._speeds(of, to)
        return first_pole(self._cut(over), self._cut(under))

    def _speeds(self, of: str | PoseQuantity, to: str | None) -> tuple[History, History]:
        """Return the speeds of a quantity and of another, as in `speed_ratio`, without regard to the window."""
        if to is None and self.drive is None:
            raise RequestError("a ratio of speeds needs the key 'to' where several drivers move")
        below = self.drive if to is None and self.drive is not None else self._whole(to or "")
        return self._whole(of).derivative(), below.derivative()

    def vector(self, between: tuple[str, str]) -> Vector:
        """Return the vector from one point to another, in the world."""
        return self._placement(tuple(map(body_of, between))).vector(between)

    def direction(self, angle: float) -> Vector:
        """Return the unit vector at an angle [rad]."""
        x, y = unit_vector(float(angle))
        return Taylor.of(2, x), Taylor.of(2, y)

    def velocity_against(self, point: str, body: str) -> Vector:
        """Return the velocity of a point relative to the point of a body at the same place."""
        at = self._placement((body_of(point), body))
        frame = at.poses[body]
        p_x, p_y = at.point(point)
        v_x, v_y = (self._as_history(one).derivative().taylor for one in (p_x - frame.x, p_y - frame.y))
        turning = self._as_history(frame.phi + 0.0 * p_x).derivative().taylor
        return v_x + turning * (p_y - frame.y), v_y - turning * (p_x - frame.x)

    def cosine(self, a: Vector, b: Vector) -> History:
        """Return the cosine of the angle between two vectors."""
        return self._cut(self._as_history(cosine_between(a, b)))

    def arc_sine(self, sine: FloatArray) -> FloatArray:
        """Return the angle [rad] of a sine that may exceed 1 by rounding."""
        return np.arcsin(np.clip(sine, -1.0, 1.0))

    def deviation(self, point: str, shape: Literal["line", "circle"]) -> FloatArray:
        """Return the deviation of the path of a point from the best line or circle."""
        x, y = map(self._cut, self._path(point))
        return deviation(x, y, SHAPES[shape])

    def path_distance(self, point: str, targets: Sequence[tuple[float, float]]) -> tuple[FloatArray, FloatArray]:
        """Return the largest distance of targets from the path of a point, and where the path is closest to it."""
        p_x, p_y = (history.taylor for history in self._path(point))
        value, x = np.asarray(-np.inf), np.asarray(np.nan)
        for t_x, t_y in targets:
            d_x, d_y = p_x - float(t_x), p_y - float(t_y)
            nearest = self._cut(self._as_history(d_x * d_x + d_y * d_y)).minimum()
            distance = np.sqrt(np.maximum(nearest.value, 0.0))
            is_worse = ~(distance <= value)
            value, x = np.where(is_worse, distance, value), np.where(is_worse, nearest.x, x)
        return value, x

    def lowest_margin(self) -> tuple[FloatArray, FloatArray]:
        """Return the smallest margin of the samples and where it occurs; margins have no rates."""
        return lowest(self.x, self._samples(MARGIN), self.window, is_closed=self.is_closed)

    def quantity_history(self, quantity: QuantityRead) -> History:
        """Return a quantity that measures read, without regard to the window."""
        if self.extremes is not None:
            raise SamplesNeededError
        if quantity not in self._histories:
            self._histories[quantity] = self._new_history(quantity)
        return self._histories[quantity]

    def _new_history(self, quantity: QuantityRead) -> History:
        if isinstance(quantity, str) or quantity in self.outputs:
            history = self._column(quantity)
        else:
            history = self._as_history(quantity.value(self._placement(quantity.bodies())))
        is_root = isinstance(quantity, PoseQuantity) and quantity.is_root
        return replace(history, is_root=True) if is_root else history

    def _whole(self, of: str | PoseQuantity) -> History:
        """Return a quantity as `history` does, without regard to the window."""
        if self.extremes is not None:
            raise SamplesNeededError
        if of in self.names.forces:
            return self._force_history(str(of))
        if isinstance(of, str):
            name, order = self.names.orders.get(of, (of, 0))
            return _derived(self.quantity_history(name), order)  # type: ignore[arg-type]  # unknown names are refused
        return self.quantity_history(of)

    def _force_history(self, name: str) -> History:
        """Return a force, of which only samples are known."""
        samples = self._samples(name)
        if self.sampled is None:
            return History(self.x, samples, samples, samples, self.is_closed, self.is_seamed)
        history = sampled_history(self.x, samples, is_closed=self.is_closed, is_seamed=self.is_seamed)
        made_of = self.names.forces[name]  # the size of a force is made of two components
        return replace(history, is_nonnegative=len(made_of) > 1 or made_of[0].noun in NEVER_NEGATIVE)

    def _samples(self, name: str) -> FloatArray:
        """Return a column of which samples alone are known, (..., n); NaN if not even these are."""
        return np.full(self.tables[0].shape[:-1], np.nan) if self.sampled is None else self.sampled(name)

    def _path(self, point: str) -> tuple[History, History]:
        """Return the world coordinates of a point, without regard to the window."""
        x, y = map(self.quantity_history, path_of(point))
        return x, y

    def _column(self, quantity: QuantityRead) -> History:
        """Return the history of a quantity that is fixed, or has a column in the tables."""
        if quantity in self.fixed:
            constant = self.fixed[quantity] + np.zeros_like(self.x)  # type: ignore[index]  # it is the name of one
            return History(self.x, constant, 0.0 * constant, 0.0 * constant, self.is_closed, self.is_seamed)
        if quantity not in self.outputs:
            raise RequestError(
                f"there is no output '{quantity}', which a measure needs; solve or compile the mechanism with it, or "
                f"with all outputs"
            )
        k = self.outputs.index(quantity)
        value, rate, acceleration = (table[..., k] for table in self.tables)
        return History(self.x, value, rate, acceleration, self.is_closed, self.is_seamed)

    def _cut(self, history: History) -> History:
        """Return the part of a history that is in the window."""
        if self.window is None:
            return history
        return history.part(*self.window)

    def _placement(self, bodies: Sequence[str]) -> Placement:
        """Return bodies with their poses over the motion."""
        poses = {
            body: GROUND
            if body == GROUND_NAME
            else BodyFrame.of(*(self.quantity_history(CoordinateName(body, axis)).taylor for axis in ("x", "y", "phi")))
            for body in {*bodies, GROUND_NAME}
        }
        return Placement(poses, self.points)

    def _as_history(self, value: Value) -> History:
        """Return a computed quantity as a history of this motion."""
        like = History(self.x, self.x, self.x, self.x, self.is_closed, self.is_seamed)
        return History.of(like, value if isinstance(value, Taylor) else Taylor.of(2, float(value)))


def break_places(run: Run) -> list[float]:
    """Return the arguments of a run, time or driver values, at which derivatives of laws jump.

    Raise a RequestError as `Motion.of_run` does.
    """
    motion = Motion.of_run(run)
    return [one.x for one in motion.breaks(over_time=run.axis == TIME)]


def _name(of: str | PoseQuantity) -> str:
    return of if isinstance(of, str) else "the quantity"


def _derived(history: History, order: int) -> History:
    """Return the derivative of an order 0 to 2."""
    return (lambda: history, history.derivative, history.second_derivative)[order]()
