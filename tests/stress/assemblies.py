"""Complete assemblies of random mechanisms against elimination in 50 digits: `python -m tests.stress.assemblies`.

Three points of a table are on circles about three pivots: a platform on three bars (one block of three unknowns), or
the coupler of a Stephenson six-bar that its output link drives (one block of four angles). With t = tan(phi / 2) of the
table the elimination of x and y leaves a polynomial of degree 6 (Merlet, Parallel Robots, 2006, chapter 4), of which
all real roots are poses.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np

from kinfmu import AngleDriver, Body, ConstantSpeed, Mechanism, Revolute
from kinfmu.analysis.assemblies import find_assemblies
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.joints import Distance
from kinfmu.plan import compile_plan
from tests.stress.comparisons import all_compared, command_line

FAMILIES = ("platforms", "stephenson six-bars")
DIGITS = 50
SAME = 1e-9  # [rad, length]

Pair = tuple[Any, Any]
Polynomial = list[Any]  # coefficients, the constant first


@dataclass
class Compared:
    """What the assemblies of one mechanism showed."""

    seed: int
    family: str
    count: int = 0
    seconds: float = 0.0
    refused: str = ""
    faults: list[str] = field(default_factory=list)


def _sum(a: Polynomial, b: Polynomial, factor: Any = 1) -> Polynomial:
    size = max(len(a), len(b))
    a, b = (p + [mpmath.mpf(0)] * (size - len(p)) for p in (a, b))
    return [x + factor * y for x, y in zip(a, b, strict=True)]


def _product(a: Polynomial, *others: Polynomial) -> Polynomial:
    for b in others:
        total = [mpmath.mpf(0)] * (len(a) + len(b) - 1)
        for i, x in enumerate(a):
            for j, y in enumerate(b):
                total[i + j] += x * y
        a = total
    return a


def _over_turns(p: Polynomial) -> Polynomial:
    """Return a polynomial over 1 + t^2, of which it is a multiple."""
    rest, quotient = list(p), [mpmath.mpf(0)] * (len(p) - 2)
    for k in range(len(p) - 3, -1, -1):
        quotient[k] = rest[k + 2]
        rest[k] -= quotient[k]
    if max(map(abs, rest[:2])) > mpmath.mpf(10) ** (-DIGITS // 2) * max(map(abs, p)):
        raise ArithmeticError("1 + t^2 is no factor")
    return quotient


def poses_of_a_table(
    pivots: Sequence[Pair], table: Sequence[Pair], lengths: Sequence[Any]
) -> list[tuple[float, float, float]]:
    """Return all x, y, phi in which the points of a table have given distances from the pivots."""
    with mpmath.workdps(DIGITS):
        mpf = mpmath.mpf
        d, c, s = [mpf(1), mpf(0), mpf(1)], [mpf(1), mpf(0), mpf(-1)], [mpf(0), mpf(2)]
        u, v, squares = [], [], []
        for (a, b), (x, y), length in zip(table, pivots, lengths, strict=True):
            along = _sum(_sum([mpf(a) * k for k in c], s, -mpf(b)), d, -mpf(x))
            across = _sum(_sum([mpf(a) * k for k in s], c, mpf(b)), d, -mpf(y))
            square = _sum(_sum(_product(along, along), _product(across, across)), _product(d, d), -(mpf(length) ** 2))
            u.append(along)
            v.append(across)
            squares.append(square)
        (a1, b1, r1), (a2, b2, r2) = (
            (
                [2 * x for x in _sum(u[k], u[0], -1)],
                [2 * x for x in _sum(v[k], v[0], -1)],
                _sum(squares[0], squares[k], -1),
            )
            for k in (1, 2)
        )
        det = _sum(_product(a1, b2), _product(a2, b1), -1)
        top = _sum(_product(r1, b2), _product(r2, b1), -1), _sum(_product(a1, r2), _product(a2, r1), -1)
        ends = [_sum(part, _product(w[0], det)) for part, w in zip(top, (u, v), strict=True)]
        closed = _sum(_product(ends[0], ends[0]), _product(ends[1], ends[1]))
        closed = _sum(closed, _product(det, det, d, d), -(mpf(lengths[0]) ** 2))
        for _ in range(3):
            closed = _over_turns(closed)
        while abs(closed[-1]) < mpf(10) ** (-DIGITS // 2) * max(map(abs, closed)):
            closed.pop()
        found = []
        for root in mpmath.polyroots(closed[::-1], maxsteps=500, extraprec=400):
            if abs(mpmath.im(root)) > mpf(10) ** (-DIGITS // 2):
                continue
            t = mpmath.re(root)
            bottom = mpmath.polyval(det[::-1], t) * (1 + t * t)
            x, y = (mpmath.polyval(part[::-1], t) / bottom for part in top)
            found.append((float(x), float(y), float(2 * mpmath.atan(t))))
        return sorted(found, key=lambda pose: pose[2])


def _table_on_bars(pivots: Sequence[Pair], table: Sequence[Pair], lengths: Sequence[float], pose: Any) -> Mechanism:
    ground = Body("ground", {"M": (0, 0), **{f"B{k}": point for k, point in enumerate(pivots)}})
    bodies = [
        Body("table", {f"P{k}": point for k, point in enumerate(table)}, pose),
        Body("wheel", {"M": (0, 0)}, (0, 0, 0)),
    ]
    bars = [Distance(f"bar{k}", (f"ground.B{k}", f"table.P{k}"), length) for k, length in enumerate(lengths)]
    joints = [*bars, Revolute("M", ("ground.M", "wheel.M"))]
    return Mechanism("table", [ground, *bodies], joints, [AngleDriver("motor", "wheel", ConstantSpeed(0.0, 1.0))])


def _six_bar(
    pivots: Sequence[Pair],
    table: Sequence[Pair],
    lengths: Sequence[float],
    pose: Any,
    output: tuple[Pair, float, float],
) -> Mechanism:
    """Return a six-bar whose coupler is the table; output: pivot, length and angle of the link with the third pivot."""
    (x, y, phi), (at, length, angle) = pose, output
    bodies = [Body("ground", {"A": pivots[0], "B": pivots[1], "C": at})]
    joints = [Revolute("C", ("ground.C", "output.C"))]
    for k, (link, holder) in enumerate((("crank", "ground.A"), ("rocker", "ground.B"), ("link", "output.S"))):
        place = float(pivots[k][0]), float(pivots[k][1])
        (a, b), c, s = table[k], math.cos(phi), math.sin(phi)
        turn = math.atan2(y + s * a + c * b - place[1], x + c * a - s * b - place[0])
        bodies.append(Body(link, {"a": (0, 0), "b": (lengths[k], 0)}, (*place, turn)))
        joints += [Revolute(f"J{k}", (holder, f"{link}.a")), Revolute(f"P{k}", (f"{link}.b", f"table.P{k}"))]
    bodies.append(Body("table", {f"P{k}": point for k, point in enumerate(table)}, pose))
    bodies.append(Body("output", {"C": (0, 0), "S": (length, 0)}, (*at, angle)))
    return Mechanism("six_bar", bodies, joints, [AngleDriver("drive", "output", ConstantSpeed(angle, 0.1))])


def _end(hub: Pair, radius: float, angle: float) -> Pair:
    """Return the end of a link in 50 digits."""
    with mpmath.workdps(DIGITS):
        r, turn = mpmath.mpf(radius), mpmath.mpf(angle)
        return hub[0] + r * mpmath.cos(turn), hub[1] + r * mpmath.sin(turn)


def compared(task: tuple[int, str]) -> Compared:
    """Compare the assemblies of a random mechanism with those of the elimination."""
    seed, family = task
    found = Compared(seed, family)
    rng = np.random.default_rng([seed, FAMILIES.index(family)])
    pivots: list[Pair] = [(float(x), float(y)) for x, y in rng.uniform(-2.0, 2.0, (3, 2))]
    table = [(float(x), float(y)) for x, y in rng.uniform(-1.0, 1.0, (3, 2))]
    hub, radius, angle = pivots[2], float(rng.uniform(0.3, 2.0)), float(rng.uniform(-math.pi, math.pi))
    is_six_bar = family == FAMILIES[1]
    if is_six_bar:
        pivots[2] = _end(hub, radius, angle)
    x, y, phi = (rng.uniform(-1.0, 1.0, 3) * (1.0, 1.0, math.pi)).tolist()
    c, s = math.cos(phi), math.sin(phi)
    lengths = [
        math.hypot(x + c * a - s * b - float(p), y + s * a + c * b - float(q))
        for (a, b), (p, q) in zip(table, pivots, strict=True)
    ]
    if is_six_bar:
        mechanism = _six_bar(pivots, table, lengths, (x, y, phi), (hub, radius, angle))
    else:
        mechanism = _table_on_bars(pivots, table, lengths, (x, y, phi))
    try:
        plan = compile_plan(mechanism)
    except KinfmuError as error:
        found.refused = str(error)
        return found
    if is_six_bar:  # near singular poses the driver starts elsewhere
        pivots[2] = _end(hub, radius, float(plan.anchor.u[0]))
    expected = poses_of_a_table(pivots, table, lengths)
    begun = time.process_time()
    assemblies = find_assemblies(mechanism, plan)
    found.seconds, found.count = time.process_time() - begun, len(expected)
    if not assemblies.complete:
        found.faults.append(f"not complete: {assemblies.ended}")
    poses = sorted(
        (tuple(one.coordinates[f"table.{axis}"] for axis in ("x", "y", "phi")) for one in assemblies.found),
        key=lambda one: one[2],
    )
    if len(poses) != len(expected):
        found.faults.append(f"{len(poses)} assemblies, not {len(expected)}")
    for got, exact in zip(poses, expected, strict=False):
        if max(map(abs, np.subtract(got, exact))) > SAME:
            found.faults.append(f"{got}, not {exact}")
    return found


def main() -> int:
    """Compare many mechanisms and print what is found; 1 if anything is wrong."""
    given = command_line("Assemblies of random mechanisms against elimination in 50 digits.", 1000).parse_args()
    families = [given.family] if given.family else FAMILIES
    tasks = [(seed, families[seed % len(families)]) for seed in range(given.seed, given.seed + given.count)]
    found = all_compared(compared, tasks, given.jobs)
    for family in families:
        of = [one for one in found if one.family == family and not one.refused]
        seconds = [one.seconds for one in of] or [0.0]
        counts = {count: sum(one.count == count for one in of) for count in sorted({one.count for one in of})}
        print(f"{family}: {len(of)}, assemblies {counts}, median {np.median(seconds):.3f} s, most {max(seconds):.2f} s")
    for one in found:
        if one.refused:
            print(f"refused: seed {one.seed}: {one.refused[:100]}")
    faulty = sum(bool(one.faults) for one in found)
    print(f"{len(found)} mechanisms, {faulty} wrong")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
