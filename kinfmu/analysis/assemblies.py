"""Assemblies: the distinct closed poses of a mechanism at its start driver values, and whether there may be others."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinfmu.analysis.certified.poses import LIMIT, closed_poses
from kinfmu.analysis.driver_path import degrees, driver_text, place_text, started
from kinfmu.arrays import FloatArray
from kinfmu.errors import AmbiguousStartError, AssemblyError, KinfmuError, listed
from kinfmu.mechanism import Mechanism, Start
from kinfmu.plan import SolvePlan, compile_plan, localized
from kinfmu.plan.anchor import find_anchor
from kinfmu.plan.equations.assembly import Assembled, find_assembly, start_values
from kinfmu.plan.equations.closing import CLOSED, close
from kinfmu.plan.equations.system import System
from kinfmu.plan.origin import in_world, relative_to
from kinfmu.units import CoordinateName

SEED = 1989
_STARTS = 60  # random poses from which a mechanism without a plan is assembled
_SPREAD = 2.0  # [sizes] to either side, range of random positions
_LARGE = 150  # coordinates; more take minutes
_SAME = 1e-6  # [rad, sizes]; poses closer than this count as one
_APART = 1e-3  # [rad, sizes]; smallest difference that distinguishes assemblies in the report
_STEPS = 4  # in which a pose is moved to nearby driver values
_ADVISED = 8  # assemblies for which few start poses are searched
_SINGLE = 3  # bodies that are tried alone


@dataclass(frozen=True)
class Assembly:
    """One assembly of the mechanism.

    coordinates: all of them by name, in the world [length, rad], angles within half a turn; is_chosen: the one that the
    file's start poses lead to; start: start poses by body that lead to it, in place of the file's.
    """

    coordinates: Mapping[str, float] = field(hash=False)
    is_chosen: bool
    start: Mapping[str, Start] = field(hash=False)


@dataclass(frozen=True)
class Assemblies:
    """The assemblies found at these driver values, the file's first.

    drivers: values by name [rad or length]; distinguished_by: coordinates of which at least one differs between
    any two; reasons: why there may be others; none: it is proved by interval arithmetic that there are no others.
    """

    mechanism: Mechanism
    drivers: Mapping[str, float] = field(hash=False)
    found: tuple[Assembly, ...]
    distinguished_by: tuple[CoordinateName, ...]
    reasons: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """True if it is proved that there are no other assemblies."""
        return not self.reasons

    @property
    def ended(self) -> str:
        """How the search ended, as text."""
        return "; ".join(self.reasons) or "with the proof that there are no others"

    def as_json(self) -> dict[str, Any]:
        """Return plain data: drivers, complete, ended, distinguished_by, found (chosen, coordinates, start by body)."""
        return {
            "drivers": dict(self.drivers),
            "complete": self.complete,
            "ended": self.ended,
            "distinguished_by": list(self.distinguished_by),
            "found": [
                {
                    "chosen": one.is_chosen,
                    "coordinates": dict(one.coordinates),
                    "start": {
                        body: {key: float(value) for key, value in start._asdict().items() if value is not None}
                        for body, start in one.start.items()
                    },
                }
                for one in self.found
            ],
        }

    def __str__(self) -> str:
        return "\n".join(_lines(self))


def find_assemblies(mechanism: Mechanism, plan: SolvePlan | None = None, limit: float = LIMIT) -> Assemblies:
    """Return the assemblies found of a mechanism at its start driver values, independent of its start poses.

    Raise a KinfmuError if the mechanism cannot be planned, an AssemblyError if no assembly is found.

    plan: that of the mechanism; None if its start poses do not close or leave several branches. Poses that differ by
    whole turns count as one. limit: most time for a block of equations [s].
    """
    whole = replace(mechanism, coordinates="all")
    chosen = None
    if plan is not None:
        chosen, planned = plan.anchor.q, plan if plan.mechanism.coordinates == "all" else compile_plan(whole)
    else:
        planned = compile_plan(started(whole, _some_pose(whole)))
    closed = closed_poses(planned, limit)
    names, reasons = planned.mechanism.coordinate_names, closed.reasons
    at = [{**planned.fixed, **dict(zip(planned.outputs, pose, strict=True))} for pose in closed.outputs.tolist()]
    poses = [relative_to(planned.origin, names, pose) for pose in at]
    if chosen is not None and all(_distance(planned, chosen, pose) > _SAME for pose in poses):
        poses.insert(0, chosen)
        reasons = reasons or ("the pose of the file is not among those proved",)
    is_chosen = [chosen is not None and _distance(planned, chosen, pose) <= _SAME for pose in poses]
    order = sorted(range(len(poses)), key=lambda k: (not is_chosen[k], _reduced(names, poses[k]).round(6).tolist()))
    poses, is_chosen = [poses[k] for k in order], [is_chosen[k] for k in order]
    apart = _distinguishing(planned, poses)
    targets = start_values(System(localized(mechanism)[0])).u  # where the start poses or the laws put the drivers
    is_at_start = chosen is not None or bool(np.abs(planned.anchor.u - targets).max(initial=0.0) <= _SAME)
    undecided = _undecided(planned, poses, is_at_start=is_at_start)
    is_quick = not planned.watches  # with redundant rows each try takes seconds
    found = []
    for k, pose in enumerate(poses):
        is_advised = k < _ADVISED and is_quick
        start = {} if is_chosen[k] else _choice(mechanism, planned, pose, chosen, undecided, is_advised=is_advised)
        found.append(Assembly(_named(planned, pose), is_chosen[k], start))
    drivers = {driver.name: float(u) for driver, u in zip(mechanism.drivers, planned.anchor.u, strict=True)}
    return Assemblies(mechanism, drivers, tuple(found), apart, reasons)


def _reduced(names: Sequence[CoordinateName], q: FloatArray) -> FloatArray:
    """Return the pose with angles within half a turn."""
    turned = [name.is_angle for name in names]
    return np.where(turned, np.remainder(q + math.pi, math.tau) - math.pi, q)


def _apart(plan: SolvePlan, a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the distance of two poses in each coordinate, modulo whole turns [rad, sizes], (n,)."""
    turned = np.array([name.is_angle for name in plan.mechanism.coordinate_names])
    around = np.abs(np.remainder(b - a + math.pi, math.tau) - math.pi)
    return np.where(turned, around, np.abs(b - a) / plan.size)


def _distance(plan: SolvePlan, a: FloatArray, b: FloatArray) -> float:
    return float(_apart(plan, a, b).max(initial=0.0))


def _distinguishing(plan: SolvePlan, poses: Sequence[FloatArray]) -> tuple[CoordinateName, ...]:
    """Return few coordinates, angles first, of which at least one differs between any two poses."""
    names = plan.mechanism.coordinate_names
    open_pairs = [_apart(plan, a, b) for k, a in enumerate(poses) for b in poses[k + 1 :]]
    order = sorted(range(len(names)), key=lambda k: not names[k].is_angle)
    chosen: list[CoordinateName] = []
    while open_pairs:
        seen = {k: sum(float(pair[k]) > _APART for pair in open_pairs) for k in order}
        best = max(order, key=lambda k: seen[k])
        if not seen[best]:
            break
        chosen.append(names[best])
        open_pairs = [pair for pair in open_pairs if pair[best] <= _APART]
    return tuple(chosen)


def _undecided(plan: SolvePlan, poses: Sequence[FloatArray], *, is_at_start: bool) -> NDArray[np.bool_]:
    """Return the coordinates that start poses influence, (bodies, 3).

    These are the ones that no joint fixes; if the drivers are where the start poses put them, only those in which poses
    differ.
    """
    undecided: NDArray[np.bool_] = np.array([name not in plan.fixed for name in plan.mechanism.coordinate_names])
    if is_at_start and len(poses) > 1:
        undecided &= np.max([_apart(plan, poses[0], pose) for pose in poses[1:]], axis=0) > _APART
    return undecided.reshape(-1, 3)


def _choice(
    mechanism: Mechanism,
    plan: SolvePlan,
    pose: FloatArray,
    instead_of: FloatArray | None,
    undecided: NDArray[np.bool_],
    *,
    is_advised: bool,
) -> dict[str, Start]:
    """Return few rounded start poses that lead to a pose in place of the file's; if few do not, all that differ.

    instead_of: the pose that the file's start poses lead to; undecided: whether start poses influence x, y, phi of
    each moving body, (bodies, 3). Others stay as in the file.
    """
    world = in_world(plan.origin, pose)  # angles as they are: a redundant gear may count turns
    named = dict(zip(plan.mechanism.coordinate_names, world.tolist(), strict=True))
    moved = undecided
    if instead_of is not None:
        moved = moved & (_apart(plan, instead_of, pose).reshape(-1, 3) > _APART)
    elsewhere = {}
    for body, free, where in zip(mechanism.moving_bodies, undecided, moved, strict=True):
        if where.any():
            pairs = zip(free, _rounded(named, body.name), body.start, strict=True)
            elsewhere[body.name] = Start(*(new if is_free else given for is_free, new, given in pairs))
    if is_advised:
        for start in _shorter_choices(mechanism, elsewhere, moved):
            if _leads_to(mechanism, plan, start, pose):
                return start
    return elsewhere


def _shorter_choices(
    mechanism: Mechanism, elsewhere: Mapping[str, Start], moved: NDArray[np.bool_]
) -> Iterator[dict[str, Start]]:
    """Yield the angle of one body that only turns; the angles of all that differ; these with their positions.

    moved: whether x, y, phi of each moving body differ, (bodies, 3).
    """
    bodies = mechanism.moving_bodies
    only_turns = [body.name for body, where in zip(bodies, moved, strict=True) if where[2] and not where[:2].any()]
    turned = {  # complete start poses stay poses that close the joints
        body.name: elsewhere[body.name]
        if None not in body.start and where[:2].any()
        else body.start._replace(phi=elsewhere[body.name].phi)
        for body, where in zip(bodies, moved, strict=True)
        if where[2]
    }
    for name in only_turns[:_SINGLE]:
        yield {name: turned[name]}
    if turned and (len(turned) > 1 or not only_turns):
        yield turned
    if len(only_turns) < len(elsewhere):
        yield {name: turned[name] if name in only_turns else start for name, start in elsewhere.items()}


def _leads_to(mechanism: Mechanism, plan: SolvePlan, start: Mapping[str, Start], pose: FloatArray) -> bool:
    """Return True if the mechanism with these start poses assembles in `pose`, at the same driver values."""
    bodies = [replace(body, start=start.get(body.name, body.start)) for body in mechanism.bodies]
    system = System(localized(replace(mechanism, bodies=tuple(bodies)))[0])
    try:
        assembly = find_assembly(system)
        if assembly.pose is None:
            return False
        assembled = find_anchor(system, assembly, range(system.joint_row_count))
    except KinfmuError:
        return False
    return _distance(plan, _moved_to(system, assembled, plan.anchor.u), pose) <= _SAME


def _moved_to(system: System, assembled: Assembled, u: FloatArray) -> FloatArray:
    """Return the assembled pose moved to driver values `u` in small steps."""
    q, change = assembled.q, u - assembled.u
    for k in range(1, _STEPS + 1) if np.abs(change).max(initial=0.0) > 0.0 else ():
        q, _ = close(system, q, assembled.u + change * (k / _STEPS))
    return q


def _named(plan: SolvePlan, pose: FloatArray) -> dict[str, float]:
    """Return all coordinates by name, in the world."""
    names = plan.mechanism.coordinate_names
    return dict(zip(names, in_world(plan.origin, _reduced(names, pose)).tolist(), strict=True))


def _rounded(named: Mapping[str, float], body: str) -> Start:
    """Return a start pose rounded to a tenth of a degree and four digits of a length."""
    x, y = (float(f"{named[f'{body}.{axis}']:.4g}") for axis in ("x", "y"))
    return Start(x, y, math.radians(round(math.degrees(named[f"{body}.phi"]), 1)))


def _some_pose(mechanism: Mechanism) -> FloatArray:
    """Return a closed pose in the world: near a singular start pose, or from random start poses."""
    try:
        return _in_world(mechanism, compile_plan(mechanism).anchor.q)
    except AmbiguousStartError as error:
        branches: list[FloatArray] = error.data["branches"]  # type: ignore[assignment]  # data are objects
        return _in_world(mechanism, branches[0])
    except AssemblyError as error:
        found = _assemble_from_random_starts(mechanism)
        if found is None:
            raise error from None
        return found


def _in_world(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    _, origin = localized(mechanism)
    return in_world(origin, q)


def _assemble_from_random_starts(mechanism: Mechanism) -> FloatArray | None:
    """Return a closed pose at the start driver values, from seeded random poses; None if not found."""
    system = System(localized(mechanism)[0])
    if len(system.coordinates) > _LARGE:
        return None
    u, rng = start_values(system).u, np.random.default_rng(SEED)
    middle = np.mean(system.mechanism.ground_points or [(0.0, 0.0)], axis=0)
    centre = np.tile([*middle, 0.0], len(system.coordinates) // 3)
    spread = np.tile([_SPREAD * system.size, _SPREAD * system.size, math.pi], len(system.coordinates) // 3)
    for _ in range(_STARTS):
        pose, gap = close(system, centre + spread * rng.uniform(-1.0, 1.0, len(centre)), u)
        if gap <= CLOSED:
            return _in_world(mechanism, pose)
    return None


def _lines(assemblies: Assemblies) -> Iterator[str]:
    mechanism = assemblies.mechanism
    at = listed(
        driver_text(driver, assemblies.drivers[driver.name], mechanism.length_unit) for driver in mechanism.drivers
    )
    given = {body.name: body.start for body in mechanism.bodies}
    apart = f", distinguished by {listed(assemblies.distinguished_by)}" if assemblies.distinguished_by else ""
    yield f"  assemblies  {len(assemblies.found)} found at {at}{apart}"
    if assemblies.complete:
        yield "              complete: it is proved that there are no others"
    for reason in assemblies.reasons:
        yield f"              there may be more: {reason}"
    for k, one in enumerate(assemblies.found, start=1):
        values = [
            f"{name} {place_text(one.coordinates[name], 'rad' if name.is_angle else mechanism.length_unit)}"
            for name in assemblies.distinguished_by
        ]
        if one.is_chosen:
            values.append("that of the file")
        yield f"  {'*' if one.is_chosen else ' '} {k:<8}  {listed(values)}"
        for number, (body, start) in enumerate(one.start.items()):
            how = "and by" if number else "choose it by"
            yield f"              {how} [bodies.{body}] start{_start(given[body], start)}"


def _start(given: Start, start: Start) -> str:
    """Return the text of a start pose in a file; one coordinate alone where only that changes."""
    entries = {key: f"{value:.6g}" for key, value in (("x", start.x), ("y", start.y)) if value is not None}
    if start.phi is not None:
        entries["phi"] = f'"{degrees(start.phi)}"'
    for key, value in entries.items():
        if start._replace(**{key: getattr(given, key)}) == given:
            return f".{key} = {value}"
    return f" = {{ {listed(f'{key} = {value}' for key, value in entries.items())} }}"
