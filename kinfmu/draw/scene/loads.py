"""Forces of loads over a run, as arrows need them: where they act, and the force there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.placing import world
from kinfmu.draw.scene.scene import Scene
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement, body_of
from kinfmu.plan.equations.taylor import Taylor
from kinfmu.run import Run
from kinfmu.run.axis import TIME
from kinfmu.units import METRES

MOST_SAMPLES = 5000  # at which a load is evaluated; of longer runs the nearest of these is shown


def load_forces(run: Run, mechanism: Mechanism, scene: Scene) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Yield the name of each load that is a force, the points (n, 2) where it acts, and the force (n, 2) [N].

    Of a load between two points it is the force on the second one. Torques have no arrow, and neither have loads whose
    effort is unknown: those by an input, which a run does not hold, and those over time in a run without times.
    """
    rows = np.unique(np.linspace(0, len(run) - 1, min(len(run), MOST_SAMPLES)).round().astype(int))
    nearest = np.abs(np.searchsorted(0.5 * (rows[1:] + rows[:-1]), np.arange(len(run)))) if len(rows) else rows
    for load in mechanism.loads:
        known = all(body in scene.frames or body == GROUND_NAME for body in load.bodies())
        needs_time = getattr(load, "law", None) is not None and getattr(load, "over", None) is None
        if "angle" in load.kinds() or load.inputs() or not known or (needs_time and run.axis != TIME):
            continue
        point = str(getattr(load, "at", "") or load.between[1])  # type: ignore[attr-defined]  # one or the other
        at = world(scene.frames[body_of(point)], mechanism.body_points[point])
        try:
            force = np.array([_force(run, mechanism, scene, load, int(row)) for row in rows])
        except (KinfmuError, ArithmeticError, ValueError):  # such as rates that were not kept
            continue
        yield load.name, at, force[nearest]


def _force(run: Run, mechanism: Mechanism, scene: Scene, load: Load, row: int) -> tuple[float, float]:
    """Return the force of a load at a sample [N]; NaN where the sample has no numbers."""
    if not run.good[row]:
        return np.nan, np.nan
    moving, still = {GROUND_NAME: GROUND}, {GROUND_NAME: GROUND}
    for body in {*load.bodies()} - {GROUND_NAME}:
        pose = scene.frames[body][row].tolist()
        rates = [float(run[f"{body}.{rate}"][row]) for rate in ("vx", "vy", "omega")]
        still[body] = BodyFrame.of(*pose)
        moving[body] = BodyFrame.of(*(Taylor(one, rate) for one, rate in zip(pose, rates, strict=True)))
    place, metre = Placement(still, mechanism.body_points), METRES[mechanism.length_unit]
    quantities = load.measured(Placement(moving, mechanism.body_points))
    s = [metre * one.f if isinstance(one, Taylor) else metre * one for one in quantities]
    sd = [metre * one.d1 if isinstance(one, Taylor) else 0.0 for one in quantities]
    over = load.argument(place)
    efforts = load.efforts(place, s, sd, float(run.t[row]) if over is None else over)
    if len(efforts) > 1:
        return float(efforts[0]), float(efforts[1])
    d_x, d_y = place.vector(load.between)  # type: ignore[attr-defined]  # all loads of one length have it
    distance = float(np.hypot(d_x, d_y))
    return float(efforts[0]) * d_x / distance, float(efforts[0]) * d_y / distance
