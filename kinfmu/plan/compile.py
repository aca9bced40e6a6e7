"""Compile: from a mechanism and its redundancy to the SolvePlan."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

from kinfmu.errors import RequestError, listed, valid_names
from kinfmu.mechanism import Mechanism, Point
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.quantities.arithmetic import Value
from kinfmu.plan.anchor import find_anchor
from kinfmu.plan.block import Block, TimeDerivatives, build_block
from kinfmu.plan.conditions import (
    find_conditions,
    refuse_inconsistent,
    refuse_mobility,
    refuse_negative_distances,
    refuse_undefined_loads,
)
from kinfmu.plan.equations.assembly import Assembled
from kinfmu.plan.equations.graph import Node, symbols
from kinfmu.plan.equations.redundancy import Redundancy, find_redundancy
from kinfmu.plan.equations.system import System
from kinfmu.plan.origin import far_rows, localized
from kinfmu.plan.path_laws import find_path_laws
from kinfmu.plan.plan import DriverInfo, MotionNodes, PlanParameter, SolvePlan, nodes_of, position_count
from kinfmu.plan.structure import RowTracer, find_structure
from kinfmu.plan.trace import Tracer, is_parameter, parameter_symbol
from kinfmu.units import CoordinateName, Quantity


def compile_plan(
    mechanism: Mechanism,
    outputs: Sequence[str] | None = None,
    parameters: Sequence[str] | None = None,
    solved: Sequence[str] = (),
    redundancy: Redundancy | None = None,
) -> SolvePlan:
    """Return the plan of a mechanism.

    Args:
        mechanism: The mechanism.
        outputs: Names of the outputs to solve for; default: all. Loops that no output depends on are not solved.
            Columns keep the order of the mechanism.
        parameters: Names of the parameters that are settable; default: all that are given as numbers.
        solved: Coordinates of bodies to solve for though they are no outputs: forces depend on them.
        redundancy: Of the mechanism, or of one that differs only in what it asks for, not in bodies, joints and
            drivers, nor in the values of their numbers. Default: it is found.

    Returns:
        The plan, with those parameters of the geometry and the constants of the laws settable.

    Raises:
        InconsistentError: Joints contradict each other.
        MobilityError: There are not as many drivers as degrees of freedom, or the drivers do not determine the motion.
        AssemblyError: The mechanism does not close near its start pose.
        AmbiguousStartError: The start pose is singular and several branches leave it.
        RequestError: An output is unknown.

    """
    local, origin = localized(mechanism)
    system = System(local)
    return plan_from(mechanism, system, origin, redundancy or find_redundancy(system), outputs, parameters, solved)


def require_solvable(system: System, redundancy: Redundancy) -> Assembled:
    """Return the anchor of a mechanism, or raise why it has no plan, without making the plan.

    Args:
        system: The equations of the mechanism.
        redundancy: Of the system, with its assembly.

    Returns:
        The anchor.

    Raises:
        KinfmuError: As in `compile_plan`.

    """
    refuse_inconsistent(system, redundancy)
    refuse_mobility(system, redundancy)
    refuse_negative_distances(system, redundancy.assembly.start)
    anchor = find_anchor(system, redundancy.assembly, redundancy.kept)
    refuse_undefined_loads(system, redundancy.assembly.start, anchor)
    return anchor


def plan_from(
    mechanism: Mechanism,
    system: System,
    origin: Point,
    redundancy: Redundancy,
    outputs: Sequence[str] | None = None,
    parameters: Sequence[str] | None = None,
    solved: Sequence[str] = (),
) -> SolvePlan:
    """Return the plan of a mechanism whose redundancy is known.

    Args:
        mechanism: The mechanism in the world.
        system: The equations of the mechanism as seen from `origin`.
        origin: The plan's own origin in the world, as `localized` returns it.
        redundancy: Of the system, with its assembly.
        outputs: As in `compile_plan`.
        parameters: As in `compile_plan`.
        solved: As in `compile_plan`.

    Returns:
        The plan.

    Raises:
        KinfmuError: As in `compile_plan`.

    """
    local, anchor = system.mechanism, require_solvable(system, redundancy)
    settable = _parameters(mechanism, parameters)
    tracer = Tracer(local, [parameter.name for parameter in settable])
    row = RowTracer(system, tracer)
    structure = find_structure(system, tracer, row, redundancy, anchor.q)
    known = structure.fixed
    rates = TimeDerivatives(tracer, known)
    motions, coordinate_count, fixed = _outputs(mechanism, origin, tracer, rates, known)
    if outputs is not None:
        motions, coordinate_count = _chosen(motions, coordinate_count, outputs, fixed)
    at_anchor: dict[str, float] = dict(zip(system.coordinates, map(float, anchor.q), strict=True))
    at_anchor |= {parameter_symbol(parameter.name): parameter.value for parameter in settable}
    at_anchor |= {driver.inputs()[0]: float(u) for driver, u in zip(mechanism.drivers, anchor.u, strict=True)}
    far = far_rows(system, anchor.q)
    blocks = _needed(
        [build_block(system, tracer, row, rates, part, known, at_anchor, far) for part in structure.blocks],
        [*(motion.position for motion in motions), *(known.get(name, tracer.symbols[name]) for name in solved)],
    )
    moving = {name for block in blocks for name in block.coordinates}
    watches = []
    for index in (redundant.index for redundant in redundancy.redundant):
        node = row(index, known)
        if all(symbol.name in moving for symbol in symbols([node]) if not is_parameter(symbol)):
            watches.append((system.rows[index].name, node / (system.rows[index].scale * system.size)))
    return SolvePlan(
        mechanism=mechanism,
        size=system.size,
        row_offset=far.offset,
        origin=origin,
        drivers=tuple(DriverInfo(driver.name, driver.inputs(), driver.quantity) for driver in mechanism.drivers),
        law_constants=mechanism.law_constants,
        parameters=settable,
        laws=_laws(mechanism, tracer),
        jumps=_jumps(mechanism, tracer),
        blocks=tuple(blocks),
        outputs_motion=tuple(motions),
        coordinate_count=coordinate_count,
        fixed_nodes=fixed,
        known=known,
        known_by={name: system.rows[index].name for name, index in structure.fixed_by.items()},
        load_sharing=tuple((one.row.name, *(row.name for row in one.implied_by)) for one in redundancy.redundant),
        watches=tuple(watches),
        path_laws=find_path_laws(tracer, rates, known, blocks, system.size),
        conditions=find_conditions(mechanism, tracer),
        anchor=anchor,
    )


def _outputs(
    mechanism: Mechanism, origin: Point, tracer: Tracer, rates: TimeDerivatives, known: Mapping[str, Node]
) -> tuple[list[MotionNodes[CoordinateName]], int, dict[CoordinateName, Node]]:
    """Return outputs (q, then points), how many are coordinates, and what is fixed among all of them."""
    if mechanism.coordinates == "moving":
        wanted = [name for name in mechanism.coordinate_names if name not in known]
    elif mechanism.coordinates == "all":
        wanted = list(mechanism.coordinate_names)
    else:
        of_name: dict[str, CoordinateName] = {name: name for name in mechanism.coordinate_names}
        wanted = [of_name[name] for name in mechanism.coordinates]

    def in_world(name: CoordinateName, node: Node) -> Node:
        return node + {"x": origin.x, "y": origin.y, "phi": 0.0}[name.axis]

    nodes = [(name, in_world(name, known.get(name, tracer.symbols[name]))) for name in wanted]
    still = [name for name in mechanism.coordinate_names if name in known and name not in wanted]
    fixed = {name: in_world(name, known[name]) for name in still}
    coordinate_count = len(nodes)
    for name, target in mechanism.points.items():
        for axis, node in zip(("x", "y"), tracer.point(target, known), strict=True):
            coordinate = CoordinateName(name, axis)
            value = in_world(coordinate, node)
            if all(is_parameter(symbol) for symbol in symbols([value])):
                fixed[coordinate] = value
            else:
                nodes.append((coordinate, value))
    positions = [node for _, node in nodes]
    motions = zip((name for name, _ in nodes), positions, *rates.first_and_second(positions), strict=True)
    return [MotionNodes(*motion) for motion in motions], coordinate_count, fixed


def _chosen(
    motions: Sequence[MotionNodes[CoordinateName]],
    coordinate_count: int,
    outputs: Sequence[str],
    fixed: Collection[CoordinateName],
) -> tuple[list[MotionNodes[CoordinateName]], int]:
    """Return the motions of the outputs requested, and how many of these are coordinates."""
    known = [motion.name for motion in motions]
    if isinstance(outputs, str):
        raise RequestError(f"outputs: '{outputs}' must be a list of names, such as ['{known[0]}']")
    for name in outputs:
        if name in fixed:
            raise RequestError(f"outputs: '{name}' is not one: the joints hold it constant; outputs: {listed(known)}")
        if name not in known:
            raise RequestError(f"outputs: '{name}' is not one{valid_names(name, known, 'outputs')}")
    chosen = [(k, motion) for k, motion in enumerate(motions) if motion.name in outputs]
    return [motion for _, motion in chosen], sum(k < coordinate_count for k, _ in chosen)


def _needed(blocks: Sequence[Block], positions: Sequence[Node]) -> list[Block]:
    """Return the blocks on which the outputs depend, in order."""
    wanted = {symbol.name for symbol in symbols(positions)}
    needed = []
    for block in reversed(blocks):
        if wanted & set(block.coordinates):
            wanted |= {symbol.name for symbol in symbols(nodes_of(block)[: position_count(block)])}
            needed.append(block)
    return needed[::-1]


def _parameters(mechanism: Mechanism, wanted: Sequence[str] | None) -> tuple[PlanParameter, ...]:
    """Return the parameters wanted, in file order; default: those that are given as numbers."""
    known = list(mechanism.parameters)
    for name in wanted or ():
        if name not in known:
            raise mechanism.settable.unknown(name, known)
    chosen = mechanism.own_parameters if wanted is None else wanted
    return tuple(
        PlanParameter(name, float(parameter.value), parameter.quantity or Quantity("number"), parameter.description)
        for name, parameter in mechanism.parameters.items()
        if name in chosen
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
        jumps = driver.law.breaks(2, **constants)
        found += [(tracer.graph.lift(at), tracer.graph.lift(jumps.period)) for at in jumps.at]
    return tuple(found)


def _laws(mechanism: Mechanism, tracer: Tracer) -> tuple[MotionNodes[str], ...]:
    """Return the law of each driver over time, with its rate and acceleration."""
    graph = tracer.graph
    time, one = graph.symbol("time"), graph.constant(1.0)
    laws = []
    for driver, constants in _law_constants(mechanism, tracer):
        target = graph.lift(driver.law.target(time, **constants))
        (rate,) = graph.derivative([target], {time: one})
        (acceleration,) = graph.derivative([rate], {time: one})
        laws.append(MotionNodes(driver.name, target, rate, acceleration))
    return tuple(laws)
