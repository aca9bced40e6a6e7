"""events.c: the times at which the laws of drivers jump, which model exchange announces to its host."""

from __future__ import annotations

from kinfmu.codegen.c.text import FUNCTIONS, function
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import SolvePlan
from kinfmu.plan.trace import parameter_symbol

_SIGNATURE = "void kf_jumps(const kf_model *model, const double *constants, double *jumps, double *periods)"


def events(plan: SolvePlan) -> str:
    """Return the text of events.c: a function of the constants of the laws and of the parameters."""
    writer = Writer(Names(functions=FUNCTIONS), ())
    body = [f"{line};" for line in writer.statements([node for jump in plan.jumps for node in jump])]
    for k, (at, period) in enumerate(plan.jumps):
        body += [f"jumps[{k}] = {writer.expression(at)};", f"periods[{k}] = {writer.expression(period)};"]
    places = {constant.name: f"constants[{k}]" for k, constant in enumerate(plan.law_constants)}
    places |= {parameter_symbol(one.name): f"model->parameters[{k}]" for k, one in enumerate(plan.parameters)}
    used = {node.name for node in writer.used if node.op == "symbol"}
    loads = [f"{identifier(name)} = {place};" for name, place in places.items() if name in used]
    lines = [
        f"/* Jumps of the laws of {plan.mechanism.name}: generated from its mechanism, not to be edited. */",
        '#include "instance.h"',
        "",
        *function(_SIGNATURE, [*loads, *body], ("model", "constants", "jumps", "periods")),
    ]
    return "\n".join(lines).rstrip("\n") + "\n"
