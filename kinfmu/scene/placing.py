"""Poses of bodies and places of their points over a run."""

from __future__ import annotations

import numpy as np

from kinfmu.mechanism.mechanism import COORDINATES, Mechanism
from kinfmu.run import FloatArray, Run
from kinfmu.scene.completing import recomputed


def poses_of(run: Run, mechanism: Mechanism) -> tuple[dict[str, FloatArray], dict[str, tuple[str, ...]]]:
    """Return poses (n, 3) by body, and for each body that cannot be drawn the missing coordinates.

    Coordinates that are not outputs of the run are recomputed, if they follow from its drivers' values.
    """
    columns: dict[str, FloatArray] = {
        name: run.values[:, k] for k, name in enumerate(run.outputs) if name not in run.absent
    }
    columns |= {name: np.full(len(run), value) for name, value in run.fixed.items()}
    if not columns.keys() >= set(mechanism.coordinate_names):
        columns |= recomputed(run, mechanism) or {}
    poses: dict[str, FloatArray] = {}
    left_out: dict[str, tuple[str, ...]] = {}
    for body in mechanism.moving_bodies:
        names = [f"{body.name}.{coordinate}" for coordinate in COORDINATES]
        missing = tuple(name for name in names if name not in columns)
        if missing:
            left_out[body.name] = missing
        else:
            pose = np.column_stack([columns[name] for name in names])
            known = run.good & np.isfinite(pose).all(axis=1)
            poses[body.name] = np.where(known[:, None], pose, np.nan)
    return poses, left_out


def world(pose: FloatArray, s: tuple[float, float]) -> FloatArray:
    """Return world coordinates r + A s, (n, 2), of the body-fixed point s in poses (n, 3)."""
    x, y, phi = pose.T
    c, sin = np.cos(phi), np.sin(phi)
    return np.column_stack([x + c * s[0] - sin * s[1], y + sin * s[0] + c * s[1]])


def seen_from(pose: FloatArray, r: FloatArray) -> FloatArray:
    """Return body-fixed coordinates A^T (r_p - r), (n, 2), of points r_p (n, 2) of the world, in poses (n, 3)."""
    x, y, phi = pose.T
    c, sin = np.cos(phi), np.sin(phi)
    d_x, d_y = r[:, 0] - x, r[:, 1] - y
    return np.column_stack([c * d_x + sin * d_y, c * d_y - sin * d_x])
