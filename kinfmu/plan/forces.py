"""Forces of a plan: driver efforts, reduced inertia and energies, as a list of steps on a graph.

With the velocity coefficients K = dq/du of the drivers, accelerations a of the centres of mass, gravity g and the
efforts f of loads along the quantities s through which they act, the principle of virtual work gives without reactions:

    inertia_kl = sum m K_k.K_l + sum I K_k K_l                    K_k: of the centre of mass; of the angle
    effort_k   = sum m (a - g).K_k + sum I alpha K_k - sum f ds/du_k
    bias_k     = effort_k - sum_l inertia_kl udd_l
    energy     = 1/2 sum_kl inertia_kl ud_k ud_l

K follows block after block from J K = -r_u, as velocities do. All forces are in SI units, whatever the mechanism's unit
of length is. Haug (1989), chapters 6 and 7.
"""

from __future__ import annotations

import operator
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.force_names import effort_noun, external_names, force_names
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.quantities.arithmetic import sqrt
from kinfmu.plan.equations.graph import Graph, Node
from kinfmu.plan.mechanics import Coefficients, Mechanics
from kinfmu.plan.plan import SolvePlan
from kinfmu.plan.steps import Step, needed_steps
from kinfmu.units import ForceName

__all__ = ["ForceSteps", "effort_noun", "force_names", "force_steps", "loaded_coordinates"]


@dataclass(frozen=True, eq=False)
class ForceSteps:
    """What is computed for forces, in order.

    Symbols that no step gives are unknowns with their rates and accelerations, driver values, speeds and accelerations,
    parameters and `time`, under their contract names; with given coefficients also these, under the names of
    `derivative_name`.

    Attributes:
        steps: Assignments and linear solves.
        names: Of the forces.
        results: One node for each name.

    """

    steps: tuple[Step, ...]
    names: tuple[ForceName, ...]
    results: list[Node]


def chosen_steps(
    names: Sequence[ForceName], nodes: Sequence[Node], steps: Sequence[Step], wanted: Container[str] | None
) -> ForceSteps:
    """Return the steps to those of some forces that are wanted; None: to all."""
    pairs = [(name, node) for name, node in zip(names, nodes, strict=True) if wanted is None or name in wanted]
    results = [node for _, node in pairs]
    return ForceSteps(needed_steps(results, steps), tuple(name for name, _ in pairs), results)


def loaded_coordinates(mechanism: Mechanism) -> list[str]:
    """Return the coordinates of the bodies that have masses or on which loads act."""
    loaded = {body.name for body in mechanism.moving_bodies if body.has_mass}
    loaded |= {body for load in mechanism.loads for body in load.bodies()}
    return [name for name in mechanism.coordinate_names if name.owner in loaded]


def force_steps(plan: SolvePlan, wanted: Sequence[str], *, coefficients: Coefficients = "solved") -> ForceSteps:
    """Return the steps to forces.

    wanted: Names of forces, of those of `force_names`. coefficients: Where the velocity coefficients come from. At
    singular points they are known better than the blocks give them; a single driver that moves needs no steps that
    solve for them.
    """
    mechanics = Mechanics(plan, coefficients=coefficients)
    names, found = force_names(plan.mechanism), _forces(plan, mechanics)
    return chosen_steps(names, [found[name] for name in names], mechanics.steps, wanted)


class _Inertia(NamedTuple):
    """A mass or a moment of inertia, and what it moves along: a coordinate of the centre of mass [m], or an angle."""

    amount: Node
    rate: Node
    acceleration: Node  # relative to free fall
    coefficients: tuple[Node, ...]


def _forces(plan: SolvePlan, mechanics: Mechanics) -> dict[str, Node]:
    """Return all forces as nodes, by name."""
    graph, inertias = mechanics.graph, _inertias(mechanics)
    efforts = [
        (effort, mechanics.coefficients(quantity))
        for load in mechanics.members.loads
        for effort, quantity in zip(mechanics.efforts(load), mechanics.measured(load), strict=True)
    ]
    speeds, accelerations = (
        [mechanics.in_si(driver.quantity.kind, graph.symbol(driver.inputs[order])) for driver in plan.drivers]
        for order in (1, 2)
    )
    found: dict[str, Node] = {}
    for k, driver in enumerate(plan.drivers):
        of_masses = _sum(graph, (one.amount * one.acceleration * one.coefficients[k] for one in inertias))
        effort = of_masses - _sum(graph, (amount * coefficients[k] for amount, coefficients in efforts))
        row = [
            _sum(graph, (one.amount * (one.coefficients[k] * one.coefficients[other]) for one in inertias))
            for other in range(len(plan.drivers))
        ]
        noun = effort_noun(driver.quantity.kind)
        found[f"{driver.name}.{noun}"] = effort
        found[f"{driver.name}.power"] = effort * speeds[k]
        found[f"{driver.name}.bias_{noun}"] = effort - _sum(graph, map(operator.mul, row, accelerations))
        for other, reduced in zip(plan.drivers, row, strict=True):
            suffix = "" if other is driver else f".{other.name}"
            found[f"{driver.name}.reduced_inertia{suffix}"] = reduced
    if len(plan.drivers) == 1:
        (inertia,) = row
        found["kinetic_energy"] = inertia * (speeds[0] * speeds[0]) * 0.5
    else:  # motions by two drivers may cancel, and the terms of their inertias with them
        found["kinetic_energy"] = _sum(graph, (one.amount * (one.rate * one.rate) for one in inertias)) * 0.5
    found["potential_energy"] = _potential_energy(plan, mechanics)
    for load in mechanics.members.loads:
        if load.columns:
            found |= zip((f"{load.name}.{noun}" for noun in load.columns), _of_load(mechanics, load), strict=True)
    found |= {name: graph.symbol(name) for name in external_names(plan.mechanism)}
    return found


def _of_load(mechanics: Mechanics, load: Load) -> tuple[Node, Node]:
    """Return the effort of a spring or damper and its quantity, in the mechanism's unit of length."""
    efforts, measured = mechanics.efforts(load), mechanics.measured(load)
    if len(measured) == 2:  # the components of a spring without a free length, which pulls
        efforts, measured = ([sqrt(a * a + b * b)] for a, b in (efforts, measured))
        efforts = [-efforts[0]]
    (effort,), (quantity,) = efforts, measured
    return effort, quantity * (1.0 / mechanics.metre) if load.kinds()[0] == "length" else quantity


def _inertias(mechanics: Mechanics) -> list[_Inertia]:
    """Return all that is accelerated."""
    found = []
    for center in mechanics.centers():
        mass, inertia = mechanics.graph.lift(center.body.mass), mechanics.graph.lift(center.body.inertia)
        frame = (*center.origin, center.phi)
        rates, slopes = mechanics.rates.of(frame), list(zip(*map(mechanics.coefficients, frame), strict=True))
        along = zip(*map(center.turned, slopes), strict=True)
        found += [
            _Inertia(mass, rate, acceleration, coefficients)
            for rate, acceleration, coefficients in zip(center.turned(rates), center.acceleration, along, strict=True)
        ]
        found.append(_Inertia(inertia, rates[2], center.alpha, tuple(phi for *_, phi in slopes)))
    return [one for one in found if one.amount.constant != 0.0]


def _potential_energy(plan: SolvePlan, mechanics: Mechanics) -> Node:
    """Return the energy of the centres of mass above the world's origin, and what loads store."""
    graph = mechanics.graph
    heights = (
        graph.lift(center.body.mass) * g * (position + offset * mechanics.metre)
        for center in mechanics.centers()
        for position, offset, g in zip(center.position, plan.origin, mechanics.gravity(), strict=True)
    )
    stored = (graph.lift(load.energy(mechanics.measured(load))) for load in mechanics.members.loads)
    return _sum(graph, stored) - _sum(graph, heights)


def _sum(graph: Graph, nodes: Iterable[Node]) -> Node:
    return reduce(operator.add, nodes, graph.constant(0.0))
