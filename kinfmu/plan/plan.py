"""SolvePlan: what is computed, in what order, for the outputs asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple, TypeVar

from kinfmu.mechanism import LawConstant, Mechanism, Point
from kinfmu.plan.block import Block
from kinfmu.plan.conditions import PlanCondition
from kinfmu.plan.equations.assembly import Assembled
from kinfmu.plan.equations.graph import Node, evaluate, reachable, symbols
from kinfmu.plan.path_laws import PathLaws
from kinfmu.plan.trace import parameter_symbol
from kinfmu.units import CoordinateName, InputName, Quantity


class DriverInfo(NamedTuple):
    """A driver seen from outside: names of its inputs for value, speed and acceleration, and its quantity."""

    name: str
    inputs: tuple[InputName, InputName, InputName]
    quantity: Quantity


class PlanParameter(NamedTuple):
    """A parameter of the geometry, settable under its name; the name of its symbol is that of `parameter_symbol`."""

    name: str
    value: float
    quantity: Quantity
    description: str


Name = TypeVar("Name", bound=str)


class MotionNodes(NamedTuple, Generic[Name]):
    """Something that moves, an output or a driver: its position, rate and acceleration as nodes."""

    name: Name
    position: Node
    rate: Node
    acceleration: Node


@dataclass(frozen=True, eq=False)
class SolvePlan:
    """A value: all that is needed to print the code of a mechanism. Equal plans have equal `text`.

    Attributes:
        mechanism: The mechanism that is planned.
        size: Of the mechanism [length]; residuals are relative to it.
        row_offset: Of the bodies from the plan's origin, in sizes, where it is far: rows are rounded by so much more.
        origin: Place of the plan's own origin in the world; only outputs, `fixed` and start values are in the world.
        drivers: Names and quantities of the drivers, in file order.
        law_constants: Constants of the laws, settable at run time.
        parameters: Parameters of the geometry, settable at run time.
        laws: u, ud, udd of each driver over the symbol `time`.
        jumps: Times at which a law jumps, each with the period after which it jumps again, 0 if once.
        blocks: Rows solved together, in the order of solving.
        outputs_motion: The outputs: the generalized coordinates q, then the points of interest.
        coordinate_count: How many of the outputs are generalized coordinates.
        fixed_nodes: Coordinates that never move, as constants or formulas of parameters.
        known: The same of the bodies' coordinates, outputs among them, as seen from the plan's origin.
        known_by: The name of the row that gives each of them, in the order in which they follow from one another.
        load_sharing: Names of the rows among which a load can be distributed in any way: for each redundant row, it and
            those that imply it. Their reactions are undetermined.
        watches: Redundant rows, relative to the size, whose residuals are monitored.
        conditions: Conditions that parameters set at run time must keep.
        path_laws: What steps of a path monitor of the laws over quantities of the pose.
        anchor: An assembled, regular pose.

    """

    mechanism: Mechanism
    size: float
    row_offset: float
    origin: Point
    drivers: tuple[DriverInfo, ...]
    law_constants: tuple[LawConstant, ...]
    parameters: tuple[PlanParameter, ...]
    laws: tuple[MotionNodes[str], ...]
    jumps: tuple[tuple[Node, Node], ...]
    blocks: tuple[Block, ...]
    outputs_motion: tuple[MotionNodes[CoordinateName], ...]
    coordinate_count: int
    fixed_nodes: Mapping[CoordinateName, Node]
    known: Mapping[str, Node]
    known_by: Mapping[CoordinateName, str]
    load_sharing: tuple[tuple[str, ...], ...]
    watches: tuple[tuple[str, Node], ...]
    conditions: tuple[PlanCondition, ...]
    path_laws: PathLaws
    anchor: Assembled

    @cached_property
    def load_constants(self) -> tuple[LawConstant, ...]:
        """Constants of the laws of loads, settable at run time: forces depend on them, poses do not."""
        return self.mechanism.load_constants

    @cached_property
    def parameter_values(self) -> dict[str, float]:
        """Parameters as written, by the names of their symbols."""
        return {parameter_symbol(parameter.name): parameter.value for parameter in self.parameters}

    @cached_property
    def fixed(self) -> dict[str, float]:
        """Values of the coordinates that never move, with the parameters as written."""
        nodes = list(self.fixed_nodes.values())
        return dict(zip(self.fixed_nodes, evaluate(nodes, self.parameter_values), strict=True))

    @property
    def offset(self) -> float:
        """Distance of the mechanism from the world's origin, in sizes; 0 if it is near."""
        return max(self.row_offset, *(abs(part) / self.size for part in self.origin))

    @cached_property
    def outputs(self) -> tuple[CoordinateName, ...]:
        """Names of the outputs: q first, then points of interest."""
        return tuple(motion.name for motion in self.outputs_motion)

    @property
    def coordinates(self) -> tuple[CoordinateName, ...]:
        """Names of the generalized coordinates q."""
        return self.outputs[: self.coordinate_count]

    @cached_property
    def unknowns(self) -> tuple[CoordinateName, ...]:
        """Coordinates found by Newton, block after block."""
        return tuple(name for block in self.blocks for name in block.unknowns)

    @cached_property
    def block_of(self) -> Mapping[str, int]:
        """The number of the block in which each coordinate is solved."""
        return {name: k for k, block in enumerate(self.blocks) for name in block.coordinates}

    @property
    def watch_names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.watches)

    @cached_property
    def nodes(self) -> tuple[Node, ...]:
        """Every node that the plan is made of, arguments first."""
        roots = [node for block in self.blocks for node in nodes_of(block)]
        roots += [node for motion in (*self.laws, *self.outputs_motion) for node in motion[1:]]
        roots += [node for nodes in self.path_laws.nodes for node in nodes]
        roots += [*self.fixed_nodes.values(), *(node for _, node in self.watches)]
        return tuple(reachable([*roots, *(condition.node for condition in self.conditions)]))

    @cached_property
    def text(self) -> str:
        """The plan as text, equal for equal plans: its nodes numbered in order, then what is made of them."""
        number = {node: k for k, node in enumerate(self.nodes)}
        lines = [f"plan {self.mechanism.name} size {self.size!r} anchor {self.anchor_values!r}"]
        for node, k in number.items():
            made_of = [*(number[arg] for arg in node.args), *([] if node.value is None else [node.value])]
            lines.append(f"{k} = {node.op} {' '.join(map(str, made_of))}")
        for block in self.blocks:
            scales = f"{block.row_scales} {block.determinant_scale!r} {block.usual}"
            lines.append(f"block {block.unknowns} {block.row_names} {scales} {[number[n] for n in nodes_of(block)]}")
        motions: tuple[MotionNodes[str] | MotionNodes[CoordinateName], ...] = (*self.laws, *self.outputs_motion)
        lines += [f"output {m.name} {[number[n] for n in m[1:]]}" for m in motions]
        lines += [f"watch {name} {number[node]}" for name, node in self.watches]
        lines += [f"fixed {name} {number[node]}" for name, node in self.fixed_nodes.items()]
        for nodes in self.path_laws.nodes if self.path_laws.units else ():
            lines.append(f"laws on paths {self.path_laws.units} {[number[node] for node in nodes]}")
        lines += [f"condition {name} {number[node]} {required}" for name, node, required in self.conditions]
        lines += [f"{self.law_constants} {self.parameters} {self.drivers} {self.coordinate_count}"]
        return "\n".join(lines)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SolvePlan) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    @property
    def anchor_values(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Driver values and unknowns of the anchor.

        The unknowns are rounded to what every machine agrees on; the solver's first Newton step gives back the rest.
        """
        place = {name: k for k, name in enumerate(self.mechanism.coordinate_names)}
        z = []
        for name in self.unknowns:
            scale = 1.0 if name.is_angle else self.size
            z.append(round(float(self.anchor.q[place[name]]) / scale, 11) * scale + 0.0)
        return tuple(map(float, self.anchor.u)), tuple(z)

    def depends(self, output: str) -> tuple[int, ...]:
        """Return the drivers (by position) on which an output depends structurally."""
        behind = self._behind[output]
        return tuple(k for k, driver in enumerate(self.drivers) if driver.inputs[0] in behind)

    @cached_property
    def block_drivers(self) -> tuple[int, ...]:
        """The driver (by position) on which each solved block depends, itself or through others; -1: several.

        Structurally. A block that depends on none counts as one of the first driver's.
        """
        found = []
        for block in self.blocks:
            if block.unknowns:
                behind = self._behind_coordinates[block.unknowns[0]]
                drivers = [k for k, driver in enumerate(self.drivers) if driver.inputs[0] in behind]
                found.append(-1 if len(drivers) > 1 else drivers[0] if drivers else 0)
        return tuple(found)

    @property
    def has_tracks(self) -> bool:
        """True with several drivers if a solved block depends on one alone."""
        return len(self.drivers) > 1 and max(self.block_drivers, default=-1) >= 0

    @property
    def has_mixed(self) -> bool:
        """True if there are tracks, and blocks that depend on several drivers."""
        return self.has_tracks and min(self.block_drivers) < 0

    def parameters_of(self, name: str) -> tuple[str, ...]:
        """Return the parameters on which an output or a fixed coordinate depends structurally, in file order."""
        behind = self._behind[name]
        return tuple(p.name for p in self.parameters if parameter_symbol(p.name) in behind)

    @cached_property
    def _behind(self) -> dict[str, frozenset[str]]:
        """Inputs and parameters, by the names of their symbols, behind each output and each coordinate."""
        behind = self._behind_coordinates
        nodes = [(motion.name, motion.position) for motion in self.outputs_motion]
        return behind | {name: _behind_all([node], behind) for name, node in (*nodes, *self.fixed_nodes.items())}

    @cached_property
    def _behind_coordinates(self) -> dict[str, frozenset[str]]:
        """Inputs and parameters, by the names of their symbols, behind each coordinate that moves."""
        behind: dict[str, frozenset[str]] = {}
        for block in self.blocks:
            own = set(block.coordinates)
            found = frozenset(_behind_all(nodes_of(block)[: position_count(block)], behind) - own)
            behind |= dict.fromkeys(own, found)
        return behind


def _behind_all(nodes: Sequence[Node], behind: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """Return the symbols of nodes, each coordinate in `behind` replaced by the symbols that it depends on."""
    names = {symbol.name for symbol in symbols(nodes)}
    return frozenset().union(*(behind.get(name, frozenset((name,))) for name in names))


def nodes_of(block: Block) -> list[Node]:
    """Return all nodes of a block, those of the position stage first."""
    nodes = [motion[0] for _, motion in block.assigned]
    nodes += [*block.residuals, *block.entries]
    nodes += [node for _, motion in block.assigned for node in motion[1:]]
    return [*nodes, *block.velocity, *block.acceleration]


def position_count(block: Block) -> int:
    """Return how many of `nodes_of` belong to the position stage."""
    return len(block.assigned) + len(block.residuals) + sum(len(row) for row in block.jacobian)
