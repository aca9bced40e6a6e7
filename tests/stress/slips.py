"""How often the advice of `check` undoes a beginner's slip: `python -m tests.stress.slips --count 1000 --seed 0`.

Thirteen kinds of slips on twenty mechanisms. Two questions: does the mechanism move after an advice is followed, and is
it the mechanism that was meant? That is one with the same motion, or one with the same parts joined in the same way,
dimensions within a tenth of the size, where a slip has lost them.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field, replace
from random import Random
from typing import Any, NamedTuple

import numpy as np

import kinfmu
from kinfmu.analysis.doctor import advice
from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.edits import edited
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.mechanism.toml_file import mechanism_of
from kinfmu.plan.equations.system import placement, size_of
from tests.stress.comparisons import all_compared, command_line
from tests.stress.slip_kinds import KINDS, NAMES, Document, Sheet, Slip

SAMPLES = 13  # of a run
BEGIN = 0.05  # of a run that a mechanism must follow to count as one that runs
SAME = 1e-6  # of the size; motions that differ by less are equal
CLOSE = 0.1  # of the size; dimensions that differ by less may be those meant, where a slip lost them
NEAR = 0.2  # of the size; poses of two mechanisms with such dimensions
DRAWS = 40
LEAST_RUNNING, LEAST_INTENDED = 0.95, 0.75  # shares of all slips, with the first advice


class Motion(NamedTuple):
    """Where the points of a mechanism are over its run: (samples, 2) each, NaN where it is not reached."""

    points: dict[str, FloatArray]
    good: FloatArray


def motion(mechanism: Mechanism) -> Motion | None:
    """Return the motion of a mechanism over its run; None if it does not move as its drivers say from the start."""
    start, stop = mechanism.run.start, mechanism.run.stop
    times = np.unique([*np.linspace(start, start + BEGIN * (stop - start), 3), *np.linspace(start, stop, SAMPLES)])
    try:
        run = kinfmu.solve(replace(mechanism, coordinates="all"), times, engine="python")
    except KinfmuError:
        return None
    if not run.good[:3].all():
        return None
    poses = [placement(mechanism, q) for q in run.values[:, : run.coordinate_count].tolist()]
    points = {point: np.array([pose.point(point) for pose in poses]) for point in mechanism.body_points}
    return Motion(points, run.good)


def apart(meant: Motion, other: Motion, size: float) -> FloatArray:
    """Return how far apart the points of two motions are at each sample, in sizes; infinite where the other ends."""
    common = [name for name in meant.points if name in other.points and not name.startswith("ground.")]
    off = [np.hypot(*(meant.points[name] - other.points[name]).T) / size for name in common]
    widest = np.max(off, axis=0) if off else np.full(len(meant.good), np.inf)
    missed = meant.good & ~other.good
    return np.where(missed, np.inf, np.where(meant.good, widest, 0.0))


class Edge(NamedTuple):
    """A pin, or a joint of another type, between parts; places: of its points in the parts; length: of a bar."""

    kind: str
    parts: frozenset[str]
    places: tuple[tuple[str, float, float], ...]
    length: float = 0.0


def graph(mechanism: Mechanism, links: bool) -> tuple[list[Edge], set[tuple[Any, ...]]]:
    """Return joints and drivers without the names of joints; welded bodies count as one part.

    links: links with two pins and no other part count as bars, whatever their names.
    """
    part = {body.name: body.name for body in mechanism.bodies}
    for joint in mechanism.joints:
        if joint.type == "fixed":
            i, j = (part[body] for body in joint.bodies())
            kept, lost = (i, j) if i == "ground" or (j != "ground" and i <= j) else (j, i)
            part = {body: kept if of == lost else of for body, of in part.items()}
    points = mechanism.body_points
    pins: list[set[str]] = []
    edges: list[Edge] = []
    for joint in mechanism.joints:
        if joint.type == "revolute":
            ends = {*joint.between}  # type: ignore[attr-defined]
            meeting = [pin for pin in pins if pin & ends]
            pins = [pin for pin in pins if not pin & ends] + [ends.union(*meeting)]
        elif joint.type != "fixed":
            ends = [point for point in getattr(joint, "between", (getattr(joint, "of", ""),)) if point in points]
            where = tuple(sorted((part[body_of(point)], *points[point]) for point in ends))
            edges.append(Edge(joint.type, frozenset(part[body] for body in joint.bodies()), where, joint.reach()))
    of_pins = [(frozenset(part[body_of(end)] for end in pin), pin) for pin in pins]
    used = Counter(body for parts, _ in of_pins for body in parts) + Counter(body for e in edges for body in e.parts)
    named = {body for driver in mechanism.drivers for body in driver.bodies()}
    named |= {body_of(point) for point in mechanism.points.values()}
    bars = {}
    if links:
        for body, count in used.items():
            mine = [pin for parts, pin in of_pins if body in parts]
            if count == 2 and len(mine) == 2 and body != "ground" and body not in named:
                bars[body] = mine
    for body, (first, second) in bars.items():
        ends = [next(end for end in pin if part[body_of(end)] == body) for pin in (first, second)]
        others = [end for pin in (first, second) for end in pin if part[body_of(end)] not in bars]
        length = float(np.hypot(*np.subtract(points[ends[0]], points[ends[1]])))
        where = tuple(sorted((part[body_of(end)], *points[end]) for end in others))
        edges.append(Edge("distance", frozenset(of for of, *_ in where), where, length))
    for _, pin in of_pins:
        where = tuple(sorted((part[body_of(end)], *points[end]) for end in pin if part[body_of(end)] not in bars))
        parts = frozenset(of for of, *_ in where)
        if len(parts) > 1:
            edges.append(Edge("revolute", parts, where))
    drivers = {
        (driver.type, *(part.get(body, body) for body in driver.bodies()), driver.law) for driver in mechanism.drivers
    }
    return edges, drivers


def is_same_graph(meant: Mechanism, other: Mechanism) -> bool:
    """Return whether two mechanisms have the same parts joined in the same way, dimensions nearly those meant."""
    size = size_of(meant)
    return any(_matches(graph(meant, links), graph(other, links), size) for links in (False, True))


def _matches(meant: tuple[list[Edge], set[Any]], other: tuple[list[Edge], set[Any]], size: float) -> bool:
    left = list(other[0])
    for edge in meant[0]:
        same = next((one for one in left if _is_equal(edge, one, size)), None)
        if same is None:
            return False
        left.remove(same)
    return not left and meant[1] == other[1]


def _is_equal(edge: Edge, other: Edge, size: float) -> bool:
    if (edge.kind, edge.parts, len(edge.places)) != (other.kind, other.parts, len(other.places)):
        return False
    if abs(edge.length - other.length) > CLOSE * size:
        return False
    for (of, x, y), (by, other_x, other_y) in zip(edge.places, other.places, strict=True):
        if of != by or (of != "ground" and np.hypot(x - other_x, y - other_y) > CLOSE * size):
            return False
    return True


@dataclass
class Treated:
    """A slip and what advice made of it; runs, meant: of each advice, or of the file itself if there is none."""

    seed: int
    family: str  # the kind of slip
    name: str
    texts: list[str] = field(default_factory=list)
    runs: list[bool] = field(default_factory=list)
    meant: list[bool] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def drawn(seed: int) -> tuple[str, str, Slip]:
    """Return the kind of a slip, the mechanism's name, and the slip; one that changes the motion."""
    kind = list(KINDS)[seed % len(KINDS)]
    rng = Random(seed)  # noqa: S311  no secret
    for _ in range(DRAWS):
        name = rng.choice(NAMES)
        slip = KINDS[kind](Sheet(name, rng))
        if slip is None or slip.meant == slip.made:
            continue
        meant, made = (mechanism_of(one, None) for one in slip)
        was = motion(meant)
        assert was is not None, (kind, name)
        now = motion(made)
        if now is None or apart(was, now, size_of(meant)).max() > SAME:
            return kind, name, slip
    raise AssertionError(f"no slip of kind '{kind}' in {DRAWS} draws of seed {seed}")


def ground_points(one: Motion) -> set[str]:
    """Return the points of the ground, which a frame may have in its place."""
    return {name for name in one.points if body_of(name) == "ground"}


def is_intended(meant: Document, made: Document, kind: str) -> tuple[bool, bool]:
    """Return whether a mechanism runs, and whether it is the one meant."""
    wanted, found = mechanism_of(meant, None), mechanism_of(made, None)
    was, now = motion(wanted), motion(found)
    if was is None or now is None:
        return False, False
    off = apart(was, now, size_of(wanted))
    if off.max() <= SAME and was.points.keys() <= now.points.keys() | ground_points(was):
        return True, True
    is_near = float(np.median(off)) <= NEAR and kind != "start pose mirrored"
    return True, is_near and is_same_graph(wanted, found)


def treated(seed: int) -> Treated:
    """Draw a slip and follow each advice on it."""
    kind, name, slip = drawn(seed)
    found = Treated(seed, kind, name)
    for one in advice(slip.made):
        found.texts.append(one.text)
        runs, meant = is_intended(slip.meant, edited(slip.made, one.edits), kind)
        found.runs.append(runs)
        found.meant.append(meant)
    if not found.texts:
        runs, meant = is_intended(slip.meant, slip.made, kind)
        found.runs, found.meant = [runs], [meant]
    return found


def main() -> int:
    """Print the shares of each kind; 1 if they are lower than intended."""
    parser = command_line("Slips of beginners and the advice of check on them.", 1000)
    parser.add_argument(
        "--verbose", action="store_true", help="print every slip whose first advice is not what was meant"
    )
    given = parser.parse_args()
    seeds = [
        s for s in range(given.seed, given.seed + given.count) if given.family in (None, list(KINDS)[s % len(KINDS)])
    ]
    done = sorted(all_compared(treated, seeds, given.jobs), key=lambda one: one.seed)
    for one in done if given.verbose else []:
        if not one.meant[0]:
            print(f"{one.seed} {one.family}, {one.name}")
            for text, runs, meant in zip(one.texts or ["(no advice)"], one.runs, one.meant, strict=True):
                print(f"    {'meant' if meant else 'runs ' if runs else 'stuck'} {text}")
    print(f"{'kind':32}{'slips':>6}{'advised':>9}{'runs':>7}{'meant':>7}{'of three: runs':>16}{'meant':>7}")
    for kind in (*KINDS, "all"):
        of_kind = [one for one in done if kind in (one.family, "all")]
        if of_kind:
            print(
                f"{kind:32}{len(of_kind):6}"
                + "".join(f"{100.0 * share:{width}.1f}" for share, width in _shares(of_kind))
            )
    runs = sum(one.runs[0] for one in done) / len(done)
    intended = sum(one.meant[0] for one in done) / len(done)
    return 0 if runs >= LEAST_RUNNING and intended >= LEAST_INTENDED else 1


def _shares(done: list[Treated]) -> list[tuple[float, int]]:
    counts = (
        (sum(bool(one.texts) for one in done), 9),
        (sum(one.runs[0] for one in done), 7),
        (sum(one.meant[0] for one in done), 7),
        (sum(any(one.runs) for one in done), 16),
        (sum(any(one.meant) for one in done), 7),
    )
    return [(count / len(done), width) for count, width in counts]


if __name__ == "__main__":
    sys.exit(main())
