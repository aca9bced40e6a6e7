"""Radau's method of scipy as an integrator of the motion under efforts: implicit, for stiff dampers and springs."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.solver.python.torque import Course, StepEnd


class Radau:
    """The integrator; scipy's object begins anew wherever a step does not start at the end of the one before.

    Args:
        tolerance: Error of a step in rad and sizes; that of angles is relative where they exceed 1 rad.

    Attributes:
        size: That the integrator would take next [s]; 0: chosen by scipy.

    """

    def __init__(self, tolerance: float) -> None:
        self.tolerance, self.size = tolerance, 0.0
        self._end: StepEnd | None = None

    def begin(self, course: Course, at: StepEnd) -> None:
        """Begin a span."""

    def step(self, course: Course, at: StepEnd, last: float, longest: float) -> StepEnd | None:
        """Return the end of a step, at `last` at the latest; None where no step succeeds."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # numbers that are not finite are reported as an end
            if at is not self._end:
                self._start(course, at, last, longest)
            scipys = self._integrator
            scipys.t_bound, scipys.status, scipys.max_step = last, "running", longest
            scipys.step()
        if scipys.status == "failed":
            course.here = at.pose
            return None
        self.size = scipys.h_abs
        self._end = course.complete(scipys.t, tuple(scipys.y.tolist()))
        return self._end

    def _start(self, course: Course, at: StepEnd, last: float, longest: float) -> None:
        from scipy.integrate import Radau as ScipysRadau  # slow to import

        def derive(t: float, y: FloatArray) -> FloatArray:
            f = course.derive(t, tuple(y.tolist()))
            return np.full(len(y), np.nan) if f is None else np.array(f)  # the integrator takes a shorter step

        scales = self.tolerance * np.array(course.reach * 2)
        first = min(self.size, last - at.t) or None
        self._integrator: Any = ScipysRadau(
            derive, at.t, np.array(at.y), last, rtol=self.tolerance, atol=scales, max_step=longest, first_step=first
        )
