"""The search for assemblies: block after block, Newton's method from random unknowns of each block's own size."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from kinfmu.analysis.loops import Place
from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.members import texts_of
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.plan import Block, SolvePlan, localized
from kinfmu.plan.equations.assembly import SINGULAR
from kinfmu.plan.equations.closing import CLOSED
from kinfmu.plan.origin import relative_to

IN_VAIN = 30  # times the square of the unknowns: known solutions in a row after which the search of a block ends
TRIES = 300  # times the same: most runs of Newton's method for a block
SEED = 1989
_SAME = 1e-6  # [rad, sizes of the block]; solutions closer than this count as one

Coordinates = Mapping[str, float]


class AssemblySearch:
    """The search for the assemblies of a plan with all coordinates as outputs.

    Each solution of a block is followed by the search for those of the blocks after it.
    """

    def __init__(self, plan: SolvePlan) -> None:
        self._plan, self._model, self._rng = plan, load_model(plan), np.random.default_rng(SEED)
        self._u, self._anchor = self._model.ANCHOR
        self._rest = (0.0,) * len(self._anchor)
        self._found: tuple[Any, ...] = ()  # what the model returned for the latest solution
        mechanism = localized(plan.mechanism)[0]
        at = dict(zip(mechanism.coordinate_names, plan.anchor.q.tolist(), strict=True))
        self._blocks = [_BlockSpace(plan, mechanism, block, at) for block in plan.blocks if block.unknowns]

    def poses(self) -> Iterator[FloatArray]:
        """Yield all coordinates of each assembly, relative to the plan's origin: the anchor's first, each once.

        Those that differ from the anchor's in the last blocks alone are the next ones.
        """
        anchor = np.array(self._anchor, dtype=float)
        if not self._blocks:
            yield self._pose(self._position(anchor, 0))
            return
        searches = [self._solutions(0, anchor)]
        while searches:
            z = next(searches[-1], None)
            if z is None:
                searches.pop()
            elif len(searches) < len(self._blocks):
                searches.append(self._solutions(len(searches), z))
            elif self._found[3] <= CLOSED and self._found[6] <= CLOSED:  # redundant rows close too
                yield self._pose(self._found)

    def _solutions(self, number: int, z: FloatArray) -> Iterator[FloatArray]:
        """Yield all unknowns with each regular solution of a block; first with the one near `z`."""
        block, (start, end) = self._blocks[number], self._model.BLOCKS[number]
        before = self._coordinates(self._position(z, number - 1)) if block.has_lengths else {}
        known: list[FloatArray] = []
        trial, in_vain, extent = z, 0, (end - start) ** 2
        for _ in range(TRIES * extent):
            with suppress(ArithmeticError, ValueError):  # singular, or diverged
                found = self._position(trial, number)
                own = np.array(found[0][start:end])
                if abs(found[1][number]) > SINGULAR:  # elsewhere links may fold without end
                    in_vain += 1
                    if in_vain > IN_VAIN * extent:
                        return
                    if all(block.distance(own, other) > _SAME for other in known):
                        known.append(own)
                        self._found, in_vain = found, 0
                        yield np.array([*found[0][:end], *self._anchor[end:]])
            trial = np.concatenate([z[:start], block.drawn(self._rng, before), z[end:]])

    def _position(self, z: FloatArray, number: int) -> tuple[Any, ...]:
        """Return what the model finds near unknowns `z` for the blocks up to a number; those after it are held."""
        held = (1 << len(self._blocks)) - (1 << (number + 1))
        found: tuple[Any, ...] = self._model.position(self._u, tuple(z.tolist()), self._rest, self._rest, -0.0, held)
        return found

    def _pose(self, found: tuple[Any, ...]) -> FloatArray:
        names, plan = self._plan.mechanism.coordinate_names, self._plan
        at = {**plan.fixed, **dict(zip(plan.outputs, self._model.outputs(found[-1]), strict=True))}
        return relative_to(plan.origin, names, at)

    def _coordinates(self, found: tuple[Any, ...]) -> dict[str, float]:
        return dict(zip(self._plan.mechanism.coordinate_names, self._pose(found).tolist(), strict=True))


class _BlockSpace:
    """Where the unknowns of a block may be: angles anywhere, bodies about the points that hold them.

    has_lengths: False if all unknowns are angles.
    """

    def __init__(self, plan: SolvePlan, mechanism: Mechanism, block: Block, at: Coordinates) -> None:
        """Take the block's own size from the points that its rows name, in a closed pose `at`."""
        owners, own = (
            {row.owner for row in (*block.rows, *block.assigned_by)},
            {name.owner for name in block.coordinates},
        )
        members: list[Joint | Driver] = [*mechanism.joints, *mechanism.drivers]
        points = mechanism.body_points
        names = sorted(
            {str(text) for one in members if one.name in owners for text in texts_of(one)} & {*points}
        ) or list(points)
        places = [Place(body_of(name), *map(float, points[name])) for name in names]
        spans = np.ptp([place.world(at) for place in places], axis=0) if places else (plan.size,)
        self._unknowns = block.unknowns
        self._is_angle = np.array([name.is_angle for name in block.unknowns])
        self._scales = np.where(self._is_angle, 1.0, math.hypot(*spans) or plan.size)
        self._holding = [place for place in places if place.body not in own] or places
        self._middles = {body: _middle(body, places) for body in own}
        self.has_lengths = not self._is_angle.all()

    def drawn(self, rng: np.random.Generator, before: Coordinates) -> FloatArray:
        """Return random unknowns; before: coordinates, of which those of the blocks before this one count."""
        reach = np.where(self._is_angle, math.pi, rng.uniform())  # near the centre other solutions attract less
        z = self._scales * reach * rng.uniform(-1.0, 1.0, len(self._unknowns))
        if self.has_lengths:
            at = {**before, **dict(zip(self._unknowns, z.tolist(), strict=True))}
            centre = np.mean([place.world(before) for place in self._holding] or [(0.0, 0.0)], axis=0)
            for k, name in enumerate(self._unknowns):
                if not name.is_angle:  # the middle of the body's points is there, wherever its frame is
                    at_rest = {**at, f"{name.owner}.x": 0.0, f"{name.owner}.y": 0.0}
                    axis = ("x", "y").index(name.axis)
                    z[k] += centre[axis] - self._middles[name.owner].world(at_rest)[axis]
        return z

    def distance(self, a: FloatArray, b: FloatArray) -> float:
        """Return the largest difference of two solutions, modulo whole turns [rad, sizes of the block]."""
        around = np.abs(np.remainder(b - a + math.pi, math.tau) - math.pi)
        return float(np.where(self._is_angle, around, np.abs(b - a) / self._scales).max())


def _middle(body: str, places: Sequence[Place]) -> Place:
    own = [place for place in places if place.body == body] or [Place(body, 0.0, 0.0)]
    return Place(body, sum(place.x for place in own) / len(own), sum(place.y for place in own) / len(own))
