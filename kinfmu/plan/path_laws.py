"""Laws of joints as a step of a path meets them: what it may not pass over unseen."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from kinfmu.mechanism.joints import Coupling
from kinfmu.mechanism.laws.law import TURN
from kinfmu.plan.block import Block, TimeDerivatives
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.trace import Tracer, is_parameter
from kinfmu.units import CoordinateName


class PathLaws(NamedTuple):
    """What a path monitors of the laws over quantities of the pose.

    Attributes:
        motions: Positions, rates and accelerations of the arguments of laws; then of the lengths that laws give for
            distances, which cannot be negative; then of the coordinates that laws give outright, and of the angles that
            follow from these outright.
        turns: After which each argument jumps back, 0 if it does not.
        steps: `Law.fewest_steps` of each argument, over the symbols `argument_symbol`.
        slopes: Bounds of the slopes of `steps`, over parameters.
        added: `Law.most_added` of each argument, over parameters.
        lengths: How many lengths there are.
        units: 1 rad or the size, for each item of the motions.

    """

    motions: tuple[tuple[Node, ...], ...] = ((), (), ())
    turns: tuple[float, ...] = ()
    steps: tuple[Node, ...] = ()
    slopes: tuple[Node, ...] = ()
    added: tuple[Node, ...] = ()
    lengths: int = 0
    units: tuple[float, ...] = ()

    @property
    def nodes(self) -> tuple[tuple[Node, ...], ...]:
        return (*self.motions, self.steps, self.slopes, self.added)


def argument_symbol(number: int) -> str:
    """Return the name of the symbol of an argument, by its number from 0."""
    return f"law_{number + 1}.argument"


def find_path_laws(
    tracer: Tracer, rates: TimeDerivatives, known: Mapping[str, Node], blocks: Sequence[Block], size: float
) -> PathLaws:
    """Return what paths monitor, as far as the blocks determine it; known: coordinates that never move."""
    graph, one = tracer.graph, tracer.graph.constant(1.0)
    moving = {name for block in blocks for name in block.coordinates} | {node.name for node in tracer.targets.values()}
    arguments: list[Node] = []
    lengths: list[Node] = []
    steps, slopes, added, turns, units, curved = [], [], [], [], [], set()
    for joint in tracer.joints:
        at = tracer.placement(joint.bodies(), known)
        led = joint.led_by(at)
        if led is None:
            continue
        law, argument = led[0], graph.lift(led[1])
        met = [symbol.name for symbol in symbols([argument]) if not is_parameter(symbol)]
        if not met or not moving.issuperset(met):
            continue
        constants = {name: constant.value for name, constant in law.constants().items()}
        x = graph.symbol(argument_symbol(len(arguments)))
        if isinstance(joint, Coupling) and joint.output.is_root:
            lengths.append(graph.lift(law.target(argument, **constants)))
        slope = graph.derivative([graph.lift(law.target(x, **constants))], {x: one})
        if graph.derivative(slope, {x: one})[0].constant == 0.0:
            continue  # a straight line
        curved.add(joint.name)
        fewest = graph.lift(law.fewest_steps(x, **constants))
        if fewest.constant is None:
            is_angle = getattr(joint, "law_kinds", ("", "angle"))[1] == "angle"
            arguments.append(argument)
            steps.append(fewest)
            slopes.append(graph.lift(law.most_steps(**constants)))
            added.append(graph.lift(law.most_added(**constants)))
            turns.append(TURN if argument.op == "atan2" else 0.0)
            units.append(1.0 if is_angle else size)
    given = _given(blocks, curved)
    nodes = [*arguments, *lengths, *(tracer.symbols[name] for name in given)]
    units += [*([size] * len(lengths)), *(1.0 if name.is_angle else size for name in given)]
    motions = tuple(map(tuple, (nodes, *rates.first_and_second(nodes))))
    return PathLaws(motions, tuple(turns), tuple(steps), tuple(slopes), tuple(added), len(lengths), tuple(units))


def _given(blocks: Sequence[Block], curved: Collection[str]) -> list[CoordinateName]:
    """Return the coordinates that rows of curved laws give outright, and the angles that follow from these."""
    found: list[CoordinateName] = []
    moved: set[str] = set()
    for block in blocks:
        for (name, (node, *_)), row in zip(block.assigned, block.assigned_by, strict=True):
            is_led = row.owner in curved
            if is_led or (name.is_angle and any(symbol.name in moved for symbol in symbols([node]))):
                found.append(name)
                moved.add(name)
        if any(row.owner in curved for row in block.rows):
            moved.update(block.unknowns)
    return found
