"""The driver values in which outputs are linear: the model description declares these dependencies as fixed."""

from __future__ import annotations

from typing import NamedTuple

from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node, reachable
from kinfmu.plan.trace import is_parameter


class _Dependence(NamedTuple):
    """Inputs that a number depends on: with a factor of parameters and constants, and in any other way."""

    linear: frozenset[str]
    other: frozenset[str]

    @property
    def every(self) -> frozenset[str]:
        return self.linear | self.other


_NONE = _Dependence(frozenset(), frozenset())


def linear_inputs(plan: SolvePlan) -> dict[str, tuple[str, ...]]:
    """Return, for each output of a plan, the driver values in which it is linear, in their order.

        y = sum_k f_k u_k + rest

    where f_k depends on parameters and constants alone and the rest on other inputs. Unknowns
    of Newton's method count as linear in no input, even if they are.
    """
    inputs = tuple(driver.inputs[0] for driver in plan.drivers)
    known: dict[str, _Dependence] = {name: _Dependence(frozenset((name,)), frozenset()) for name in inputs}
    for block in plan.blocks:
        known |= dict.fromkeys(block.unknowns, _Dependence(frozenset(), frozenset(inputs)))
        for name, motion in block.assigned:
            known[name] = _Dependence(frozenset(), frozenset(inputs)) if block.unknowns else _of(motion[0], known)
    found = {motion.name: _of(motion.position, known).linear for motion in plan.outputs_motion}
    return {name: tuple(one for one in inputs if one in linear) for name, linear in found.items()}


def _of(node: Node, known: dict[str, _Dependence]) -> _Dependence:
    """Return the dependence of a formula, from those of its symbols."""
    of: dict[Node, _Dependence] = {}
    for one in reachable([node]):  # arguments first
        if one.op == "symbol":
            of[one] = _NONE if is_parameter(one) else known[one.name]
            continue
        arguments = [of[arg] for arg in one.args]
        moving = [argument for argument in arguments if argument.every]
        every = frozenset().union(*(argument.every for argument in moving))
        linear: frozenset[str] = frozenset()
        if one.op in ("+", "-", "neg"):
            linear = every - frozenset().union(*(argument.other for argument in moving))
        elif (one.op == "*" and len(moving) == 1) or (one.op == "/" and not arguments[1].every):
            linear = frozenset().union(*(argument.linear for argument in moving))
        of[one] = _Dependence(linear, every - linear)
    return of[node]
