"""kimech: revolute and prismatic joints between links, and whole sweeps by `kimech.solve`.

It predicts by the velocity and corrects all coordinates by MINPACK, then solves velocities and accelerations. A driven
distance is a cylinder: two links more and the prismatic joint between them, which is driven.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.case import Case, Motion
from benchmarks.engine import GAP, BenchEngine, EngineSetting, Sampler
from benchmarks.engines.scipy_fsolve import DEFAULT
from kinfmu.errors import MissingPackageError
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.drivers import AngleDriver, DistanceDriver
from kinfmu.mechanism.joints import Distance, Revolute, Translational
from kinfmu.mechanism.quantities.placement import body_of

SETTING = EngineSetting(1, DEFAULT)  # of `scipy.optimize.root`; kimech has no settings

Poses = dict[Any, Sequence[float]]  # x, y, phi by link


def _sampler(case: Case, _setting: EngineSetting) -> Sampler | None:
    """Return a sampler; None if the case has another kind of joint or driver, or redundant constraints.

    `solve` refuses a whole sweep if it refuses one sample: the samples before it and those after it are swept apart.
    The sampler remembers these samples, so that only its first call looks for them.
    """
    try:
        from kimech import KinematicDriver, KinematicSolveError, solve
    except ImportError:
        raise MissingPackageError("kimech is not installed: pip install 'kinfmu[bench]'") from None
    try:
        mechanism, start, driven = _stated(case)
    except NotImplementedError:
        return None
    if mechanism.mobility() != len(driven):
        return None
    chosen = [case.system.coordinates.index(name) for name in case.columns]
    histories = [np.array(table).T for table in (case.u, case.ud, case.udd)]  # (d, n) each
    gap = [GAP] * (3 * len(chosen))
    refused: set[int] = set()

    def take(n: int) -> Motion:
        guess: Any = start
        rows: list[list[float]] = []
        while (first := len(rows)) < n:
            last = min((k for k in refused if first <= k < n), default=n)
            if last == first:
                rows.append(gap)
                continue
            drivers = [
                KinematicDriver(joint, position=u[first:last], velocity=ud[first:last], acceleration=udd[first:last])
                for joint, u, ud, udd in zip(driven, *histories, strict=True)
            ]
            try:
                solution = solve(mechanism, drivers=drivers, initial_guess=guess)
            except KinematicSolveError as error:
                refused.add(first + error.context.sample_index)
                continue
            guess = solution[-1]
            tables = solution.coordinates, solution.coordinate_velocities, solution.coordinate_accelerations
            rows += np.hstack([table[:, chosen] for table in tables]).tolist()
        return rows

    return take


def _stated(case: Case) -> tuple[Any, Poses, list[Any]]:
    """Return the mechanism, the first pose of its links, and the driven joints. Raise NotImplementedError."""
    from kimech import Configuration, Mechanism

    mechanism = Mechanism(case.name)
    links = {body.name: mechanism.add_link(body.name) for body in case.mechanism.moving_bodies}
    bodies = {GROUND_NAME: mechanism.ground, **links}
    points = {name: bodies[body_of(name)].add_point(name, s) for name, s in case.mechanism.body_points.items()}
    start: Poses = dict(zip(links.values(), case.start_coordinates.reshape(-1, 3).tolist(), strict=True))
    first = Configuration(mechanism, case.start_coordinates)
    where = {name: first.point_position(point).tolist() for name, point in points.items()}
    on_ground: dict[str, Any] = {}  # revolute joints by the body that they join to the ground

    def rod(name: str, at: str, between: Sequence[str]) -> Any:
        """Return the pin of a new link at a point; its x-axis points from the first of two points to the second."""
        (x, y), (to_x, to_y) = (where[end] for end in between)
        link = mechanism.add_link(name)
        start[link] = *where[at], math.atan2(to_y - y, to_x - x)
        pin = link.add_point("pin", (0.0, 0.0))
        mechanism.revolute(points[at], pin)
        return pin

    for joint in case.mechanism.joints:
        if isinstance(joint, Revolute):
            a, b = sorted(joint.between, key=lambda name: body_of(name) != GROUND_NAME)
            made = mechanism.revolute(points[a], points[b])
            if body_of(a) == GROUND_NAME:
                on_ground[body_of(b)] = made
        elif isinstance(joint, Translational):
            axes = (joint.axis, joint.axis - joint.angle)  # one direction, in the frames of i and j
            axis_a, axis_b = ((math.cos(angle), math.sin(angle)) for angle in axes)
            mechanism.prismatic(*(points[name] for name in joint.between), axis_a=axis_a, axis_b=axis_b)
        elif isinstance(joint, Distance):
            a, b = joint.between
            bar = rod(f"{joint.name}.bar", a, joint.between).body
            mechanism.revolute(bar.add_point("end", (joint.length, 0.0)), points[b])
        else:
            raise NotImplementedError(joint.name)

    driven = []
    for driver in case.mechanism.drivers:
        if isinstance(driver, AngleDriver) and driver.of in on_ground:
            driven.append(on_ground[driver.of])
        elif isinstance(driver, DistanceDriver):
            parts = zip(("barrel", "piston"), driver.between, strict=True)
            pins = [rod(f"{driver.name}.{part}", at, driver.between) for part, at in parts]
            driven.append(mechanism.prismatic(*pins, axis_a=(1.0, 0.0), axis_b=(1.0, 0.0)))
        else:
            raise NotImplementedError(driver.name)
    return mechanism, start, driven


KIMECH = BenchEngine("kimech", _sampler, settings=(SETTING,), usual=SETTING)
