"""What parts at a limit: the bodies that can move there while the drivers stand still."""

from __future__ import annotations

import numpy as np

from kinfmu.analysis.way import Way
from kinfmu.equations.system import System
from kinfmu.plan import localized

_PART = 1e-3  # of the largest motion; a body that moves less stands still
_LARGE = 600  # coordinates; the singular values of more take too long


def parting(way: Way, at_limit: dict[str, float]) -> tuple[str, ...]:
    """Names of the bodies that move in the null direction of Phi_q at a limit pose, in file order.

    at_limit: all coordinates by name. Empty for a mechanism too large to tell.
    """
    if len(at_limit) > _LARGE:
        return ()
    local, origin = localized(way.plan.mechanism)
    system = System(local)
    offset = {"x": origin.x, "y": origin.y, "phi": 0.0}
    q = np.array([at_limit[name] - offset[name.rpartition(".")[2]] for name in system.coordinates])
    free = np.linalg.svd(system.scaled_jacobian(q))[2][-1]  # (n,)
    moves = np.abs(free).reshape(-1, 3).max(axis=1)
    return tuple(body.name for body, most in zip(local.moving_bodies, moves, strict=True) if most > _PART * moves.max())
