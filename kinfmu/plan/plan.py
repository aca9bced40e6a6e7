"""SolvePlan: what is computed, in what order, for the outputs asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from kinfmu.drivers import Driver
from kinfmu.equations.assembly import Assembled
from kinfmu.equations.closing import motion_samples, null_space
from kinfmu.equations.graph import Node, evaluate, reachable, symbols
from kinfmu.equations.part import Part
from kinfmu.equations.redundancy import Redundancy, find_redundancy
from kinfmu.equations.start_poses import StartValues
from kinfmu.equations.system import System
from kinfmu.errors import AssemblyError, InconsistentError, MobilityError, RequestError, listed, suggestion
from kinfmu.measures import DistanceBetween
from kinfmu.measures.arithmetic import Value
from kinfmu.mechanism import LawConstant, Mechanism, Point
from kinfmu.plan.anchor import find_anchor
from kinfmu.plan.block import Block, Rates, build_block
from kinfmu.plan.conditions import PlanCondition, find_conditions
from kinfmu.plan.origin import localized
from kinfmu.plan.structure import RowTracer, find_structure
from kinfmu.plan.trace import Tracer, is_parameter, parameter_symbol
from kinfmu.units import Quantity


class DriverInfo(NamedTuple):
    """A driver seen from outside: names of its inputs for value, speed and acceleration, and its quantity."""

    name: str
    inputs: tuple[str, str, str]
    quantity: Quantity


class PlanParameter(NamedTuple):
    """A parameter of the geometry, settable under its name; the name of its symbol is that of `parameter_symbol`."""

    name: str
    value: float
    quantity: Quantity
    description: str


class Motion(NamedTuple):
    """Something that moves: its position, rate and acceleration as nodes."""

    name: str
    position: Node
    rate: Node
    acceleration: Node


@dataclass(frozen=True, eq=False)
class SolvePlan:
    """A value: all that is needed to print the code of a mechanism. Equal plans have equal `text`.

    Attributes:
        mechanism: The mechanism that is planned.
        size: Of the mechanism [length]; residuals are relative to it.
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
        watches: Redundant rows, relative to the size, whose residuals are monitored.
        conditions: Conditions that parameters set at run time must keep.
        anchor: An assembled, regular pose.

    """

    mechanism: Mechanism
    size: float
    origin: Point
    drivers: tuple[DriverInfo, ...]
    law_constants: tuple[LawConstant, ...]
    parameters: tuple[PlanParameter, ...]
    laws: tuple[Motion, ...]
    jumps: tuple[tuple[Node, Node], ...]
    blocks: tuple[Block, ...]
    outputs_motion: tuple[Motion, ...]
    coordinate_count: int
    fixed_nodes: Mapping[str, Node]
    watches: tuple[tuple[str, Node], ...]
    conditions: tuple[PlanCondition, ...]
    anchor: Assembled

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
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs: q first, then points of interest."""
        return tuple(motion.name for motion in self.outputs_motion)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the generalized coordinates q."""
        return self.outputs[: self.coordinate_count]

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Coordinates found by Newton, block after block."""
        return tuple(name for block in self.blocks for name in block.unknowns)

    @property
    def watch_names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.watches)

    @cached_property
    def nodes(self) -> tuple[Node, ...]:
        """Every node that the plan is made of, arguments first."""
        roots = [node for block in self.blocks for node in _nodes(block)]
        roots += [node for motion in (*self.laws, *self.outputs_motion) for node in motion[1:]]
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
            lines.append(f"block {block.unknowns} {block.row_names} {scales} {[number[n] for n in _nodes(block)]}")
        lines += [f"output {m.name} {[number[n] for n in m[1:]]}" for m in (*self.laws, *self.outputs_motion)]
        lines += [f"watch {name} {number[node]}" for name, node in self.watches]
        lines += [f"fixed {name} {number[node]}" for name, node in self.fixed_nodes.items()]
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
            scale = 1.0 if name.endswith(".phi") else self.size
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
        """Inputs and parameters, by the names of their symbols, behind each output and each fixed coordinate."""
        behind = self._behind_coordinates
        found = {motion.name: _behind_all([motion.position], behind) for motion in self.outputs_motion}
        return found | {name: _behind_all([node], behind) for name, node in self.fixed_nodes.items()}

    @cached_property
    def _behind_coordinates(self) -> dict[str, frozenset[str]]:
        """The same behind each coordinate that moves."""
        behind: dict[str, frozenset[str]] = {}
        for block in self.blocks:
            own = set(block.coordinates)
            found = frozenset(_behind_all(_nodes(block)[: _position_count(block)], behind) - own)
            behind |= dict.fromkeys(own, found)
        return behind


def _behind_all(nodes: Sequence[Node], behind: Mapping[str, frozenset[str]]) -> frozenset[str]:
    names = {symbol.name for symbol in symbols(nodes)}
    return frozenset().union(*(behind.get(name, frozenset((name,))) for name in names))


def _nodes(block: Block) -> list[Node]:
    """Return all nodes of a block, those of the position stage first."""
    nodes = [motion[0] for _, motion in block.assigned]
    nodes += [*block.residuals, *(entry for row in block.jacobian for entry in row)]
    nodes += [node for _, motion in block.assigned for node in motion[1:]]
    return [*nodes, *block.velocity, *block.acceleration]


def _position_count(block: Block) -> int:
    return len(block.assigned) + len(block.residuals) + sum(len(row) for row in block.jacobian)


def compile_plan(mechanism: Mechanism, outputs: Sequence[str] | None = None) -> SolvePlan:
    """Return the plan of a mechanism.

    Args:
        mechanism: The mechanism.
        outputs: Names of the outputs to solve for; default: all. Loops that no output depends on are not solved.

    Returns:
        The plan, with the parameters of the geometry and the constants of the laws settable.

    Raises:
        InconsistentError: Joints contradict each other.
        MobilityError: There are not as many drivers as degrees of freedom, or the drivers do not determine the motion.
        AssemblyError: The mechanism does not close near its start pose.
        AmbiguousStartError: The start pose is singular and several branches leave it.
        RequestError: An output is unknown.

    """
    local, origin = localized(mechanism)
    system = System(local)
    return plan_from(mechanism, system, origin, find_redundancy(system), outputs)


def plan_from(
    mechanism: Mechanism,
    system: System,
    origin: Point,
    redundancy: Redundancy,
    outputs: Sequence[str] | None = None,
) -> SolvePlan:
    """Return the plan of a mechanism whose redundancy is known.

    Args:
        mechanism: The mechanism in the world.
        system: The equations of the mechanism as seen from `origin`.
        origin: The plan's own origin in the world, as `localized` returns it.
        redundancy: Of the system, with its assembly.
        outputs: As in `compile_plan`.

    Returns:
        The plan.

    Raises:
        KinfmuError: As in `compile_plan`.

    """
    local = system.mechanism
    refuse_inconsistent(system, redundancy)
    refuse_mobility(system, redundancy)
    refuse_negative_distances(system, redundancy.assembly.start)
    anchor = find_anchor(system, redundancy.assembly)
    tracer = Tracer(local)
    set_aside = [row.index for row in redundancy.redundant]
    structure = find_structure(system, tracer, redundancy, anchor.q)
    known = structure.fixed
    rates, row = Rates(tracer, structure.fixed), RowTracer(system, tracer)
    motions, coordinate_count, fixed = _outputs(mechanism, origin, tracer, rates, known)
    if outputs is not None:
        motions, coordinate_count = _chosen(motions, coordinate_count, outputs)
    parameters = _parameters(mechanism)
    at_anchor = dict(zip(system.coordinates, map(float, anchor.q), strict=True))
    at_anchor |= {parameter_symbol(parameter.name): parameter.value for parameter in parameters}
    blocks = _needed(
        [build_block(system, tracer, row, rates, part, known, at_anchor) for part in structure.blocks],
        [motion.position for motion in motions],
    )
    solved = {name for block in blocks for name in block.coordinates}
    watches = []
    for index in set_aside:
        node = row(index, known)
        if all(symbol.name in solved for symbol in symbols([node]) if not is_parameter(symbol)):
            watches.append((system.rows[index].name, node / (system.rows[index].scale * system.size)))
    return SolvePlan(
        mechanism=mechanism,
        size=system.size,
        origin=origin,
        drivers=tuple(DriverInfo(driver.name, driver.inputs(), driver.quantity) for driver in mechanism.drivers),
        law_constants=mechanism.law_constants,
        parameters=parameters,
        laws=_laws(mechanism, tracer),
        jumps=_jumps(mechanism, tracer),
        blocks=tuple(blocks),
        outputs_motion=tuple(motions),
        coordinate_count=coordinate_count,
        fixed_nodes=fixed,
        watches=tuple(watches),
        conditions=find_conditions(mechanism, tracer),
        anchor=anchor,
    )


def refuse_inconsistent(system: System, redundancy: Redundancy) -> None:
    """Raise the InconsistentError of the first row that contradicts the others."""
    for dependent in redundancy.inconsistent:
        unit = system.gap_unit(dependent.row)
        raise InconsistentError(
            f"[joints.{dependent.row.owner}] contradicts the other joints: with "
            f"{listed(dependent.implied_by_joints) if dependent.implied_by_joints else 'all of them'} closed, row "
            f"'{dependent.row.label}' does not close: gap {abs(dependent.gap):.6g} {unit} in every pose; "
            f"change a dimension by that gap or remove the joint",
            joint=dependent.row.owner,
            gap=dependent.gap,
        )


def refuse_mobility(system: System, redundancy: Redundancy) -> None:
    """Raise a MobilityError if there are not as many drivers as degrees of freedom."""
    names = [driver.name for driver in system.mechanism.drivers]
    mobility = redundancy.mobility
    if len(names) == mobility > 0:
        return
    if len(names) < mobility:
        missing = mobility - len(names)
        raise MobilityError(
            f"[drivers] mobility is {mobility} but there {_are(names)}: "
            f"{missing} more {'driver is' if missing == 1 else 'drivers are'} needed, or joints: "
            f"{listed(_loose(system, redundancy))} can still move",
            mobility=mobility,
        )
    if mobility == 0:
        raise MobilityError(
            "[drivers] mobility is 0: the joints leave no motion, so there is nothing to drive",
            mobility=0,
        )
    raise MobilityError(
        f"[drivers] mobility is {mobility} but there {_are(names)}: remove {len(names) - mobility}",
        mobility=mobility,
    )


def refuse_negative_distances(system: System, start: StartValues) -> None:
    """Raise an AssemblyError if a driver starts at a distance below 0."""
    for driver, value in zip(system.mechanism.drivers, start.u, strict=True):
        if isinstance(driver.measured(), DistanceBetween) and value < 0.0:
            unit = system.mechanism.length_unit
            raise AssemblyError(
                f"[drivers.{driver.name}] starts at a length of {value:.6g} {unit}; a distance cannot be negative"
            )


def _loose(system: System, redundancy: Redundancy) -> list[str]:
    """Return the bodies that joints and drivers together do not hold."""
    rows = [*redundancy.kept, *range(system.joint_row_count, len(system.rows))]
    start = redundancy.assembly.start.q
    pose = next(iter(motion_samples(Part(system, redundancy.kept), start, 1)), start)
    free = null_space(system.scaled_jacobian(pose)[rows])
    moves = {
        name.partition(".")[0] for name, move in zip(system.coordinates, free, strict=True) if abs(move).max() > 1e-6
    }
    return [body.name for body in system.mechanism.moving_bodies if body.name in moves]


def _are(drivers: Sequence[str]) -> str:
    if not drivers:
        return "is no driver"
    return f"is 1 driver ({drivers[0]})" if len(drivers) == 1 else f"are {len(drivers)} drivers ({listed(drivers)})"


def _outputs(
    mechanism: Mechanism, origin: Point, tracer: Tracer, rates: Rates, known: Mapping[str, Node]
) -> tuple[list[Motion], int, dict[str, Node]]:
    """Return outputs (q, then points), how many are coordinates, and what is fixed among all of them."""
    if mechanism.coordinates == "moving":
        wanted = [name for name in mechanism.coordinate_names if name not in known]
    elif mechanism.coordinates == "all":
        wanted = list(mechanism.coordinate_names)
    else:
        wanted = list(mechanism.coordinates)

    def in_world(name: str, node: Node) -> Node:
        offset = {"x": origin.x, "y": origin.y}.get(name.rpartition(".")[2], 0.0)
        return node + offset

    nodes = [(name, in_world(name, known.get(name, tracer.symbols[name]))) for name in wanted]
    fixed = {name: in_world(name, node) for name, node in known.items() if name not in wanted}
    coordinate_count = len(nodes)
    for name, target in mechanism.points.items():
        for coordinate, node in zip(("x", "y"), tracer.point(target, known), strict=True):
            value = in_world(coordinate, node)
            if all(is_parameter(symbol) for symbol in symbols([value])):
                fixed[f"{name}.{coordinate}"] = value
            else:
                nodes.append((f"{name}.{coordinate}", value))
    positions = [node for _, node in nodes]
    motions = zip((name for name, _ in nodes), positions, rates.of(positions), rates.second(positions), strict=True)
    return [Motion(*motion) for motion in motions], coordinate_count, fixed


def _chosen(motions: Sequence[Motion], coordinate_count: int, outputs: Sequence[str]) -> tuple[list[Motion], int]:
    known = [motion.name for motion in motions]
    if isinstance(outputs, str):
        raise RequestError(f"outputs: '{outputs}' must be a list of names, such as ['{known[0]}']")
    for name in outputs:
        if name not in known:
            raise RequestError(f"outputs: '{name}' is not one{suggestion(name, known)}; outputs: {listed(known)}")
    chosen = [(k, motion) for k, motion in enumerate(motions) if motion.name in outputs]
    return [motion for _, motion in chosen], sum(k < coordinate_count for k, _ in chosen)


def _needed(blocks: Sequence[Block], positions: Sequence[Node]) -> list[Block]:
    """The blocks on which the outputs depend, in order."""
    wanted = {symbol.name for symbol in symbols(positions)}
    needed = []
    for block in reversed(blocks):
        if wanted & set(block.coordinates):
            wanted |= {symbol.name for symbol in symbols(_nodes(block)[: _position_count(block)])}
            needed.append(block)
    return needed[::-1]


def _parameters(mechanism: Mechanism) -> tuple[PlanParameter, ...]:
    """Return the parameters that are numbers of their own; those with an expression follow from them."""
    return tuple(
        PlanParameter(name, float(parameter.value), parameter.quantity or Quantity("number"), parameter.description)
        for name, parameter in mechanism.parameters.items()
        if parameter.expression is None
    )


def _law_constants(mechanism: Mechanism, tracer: Tracer) -> Iterator[tuple[Driver, dict[str, Value]]]:
    """Yield each driver with the constants of its law: symbols, or formulas of parameters if written so."""
    for driver, traced in zip(mechanism.drivers, tracer.drivers, strict=True):
        yield (
            driver,
            {
                key: value
                if ("drivers", driver.name, "law", key) in mechanism.expressions
                else tracer.graph.symbol(f"{driver.name}.{key}")
                for key, (value, _) in traced.law.constants().items()
            },
        )


def _jumps(mechanism: Mechanism, tracer: Tracer) -> tuple[tuple[Node, Node], ...]:
    """Return the times at which a law jumps, each with its period."""
    found = []
    for driver, constants in _law_constants(mechanism, tracer):
        jumps = driver.law.jumps(**constants)
        found += [(tracer.graph.lift(at), tracer.graph.lift(jumps.period)) for at in jumps.at]
    return tuple(found)


def _laws(mechanism: Mechanism, tracer: Tracer) -> tuple[Motion, ...]:
    graph = tracer.graph
    time, one = graph.symbol("time"), graph.constant(1.0)
    laws = []
    for driver, constants in _law_constants(mechanism, tracer):
        target = graph.lift(driver.law.target(time, **constants))
        (rate,) = graph.derivative([target], {time: one})
        (acceleration,) = graph.derivative([rate], {time: one})
        laws.append(Motion(driver.name, target, rate, acceleration))
    return tuple(laws)
