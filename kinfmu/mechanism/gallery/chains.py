"""Chains of any length, to measure how the cost of a sample grows with the mechanism."""

from __future__ import annotations

import math
from collections.abc import Callable

from kinfmu.errors import RequestError
from kinfmu.mechanism import Body, Mechanism, Point, RunSettings, Start
from kinfmu.mechanism.drivers import AngleDriver
from kinfmu.mechanism.joints import Joint, RelativeAngle, Revolute
from kinfmu.mechanism.laws import ConstantSpeed

LONGEST_CHAIN = 10_000  # loops or links


def fourbar_chain(count: int) -> Mechanism:
    """Return `count` parallelogram four-bars side by side, each rocker the crank of the next (N-four-bar benchmark).

    Ground pivots are at 0, 1, ..., count; bars `bar_0` ... of length 1 turn about them, couplers `coupler_1` ... of
    length 1 join their tips. 2 count + 1 bodies, mobility 1, `count` blocks of two unknowns; all bars stay parallel, so
    bar_k.phi is the crank angle, and all blocks are singular together at 0 and pi.
    """
    start = math.radians(60.0)
    c, s = math.cos(start), math.sin(start)
    bodies = [Body("ground", {f"O_{k}": Point(float(k), 0.0) for k in range(count + 1)})]
    joints: list[Joint] = []
    for k in range(count + 1):
        bodies.append(Body(f"bar_{k}", {"O": Point(0.0, 0.0), "P": Point(1.0, 0.0)}, Start(float(k), 0.0, start)))
        joints.append(Revolute(f"O_{k}", (f"ground.O_{k}", f"bar_{k}.O")))
        if k:
            bodies.append(
                Body(f"coupler_{k}", {"P": Point(0.0, 0.0), "Q": Point(1.0, 0.0)}, Start(k - 1.0 + c, s, 0.0))
            )
            joints.append(Revolute(f"P_{k}", (f"bar_{k - 1}.P", f"coupler_{k}.P")))
            joints.append(Revolute(f"Q_{k}", (f"coupler_{k}.Q", f"bar_{k}.P")))
    return Mechanism(
        "fourbar_chain",
        tuple(bodies),
        tuple(joints),
        (AngleDriver("crank", "bar_0", ConstantSpeed(start, 1.0)),),
        title=f"Chain of {count} parallelogram four-bars",
        points={"end": f"bar_{count}.P"},
        run=RunSettings(0.0, 1.5, 0.01),
    )


def open_chain(count: int) -> Mechanism:
    """Return `count` links of length 1, each pinned to the previous one at a fixed small angle, without a loop.

    Every coordinate follows from the previous one, without iteration: phi_k = phi_1 + (k - 1) bend.
    """
    bend = 0.5 * math.pi / count
    bodies = [Body("ground", {"O": Point(0.0, 0.0)})]
    joints: list[Joint] = []
    for k in range(1, count + 1):
        before = f"link_{k - 1}.end" if k > 1 else "ground.O"
        bodies.append(Body(f"link_{k}", {"base": Point(0.0, 0.0), "end": Point(1.0, 0.0)}))
        joints.append(Revolute(f"pin_{k}", (before, f"link_{k}.base")))
        if k > 1:
            joints.append(RelativeAngle(f"bend_{k}", (f"link_{k - 1}", f"link_{k}"), bend))
    return Mechanism(
        "open_chain",
        tuple(bodies),
        tuple(joints),
        (AngleDriver("crank", "link_1", ConstantSpeed(0.0, 1.0)),),
        title=f"Open chain of {count} links",
        points={"end": f"link_{count}.end"},
        run=RunSettings(0.0, 6.0, 0.05),
    )


CHAINS: dict[str, Callable[[int], Mechanism]] = {"fourbar_chain": fourbar_chain, "open_chain": open_chain}


def chain(name: str, count: str) -> Mechanism:
    """Return the chain of `fourbar_chain:1000`, given as 'fourbar_chain' and '1000'."""
    if not count.isdecimal() or not 1 <= int(count) <= LONGEST_CHAIN:
        raise RequestError(f"{name}:{count}: the count must be a whole number from 1 to {LONGEST_CHAIN}")
    return CHAINS[name](int(count))
