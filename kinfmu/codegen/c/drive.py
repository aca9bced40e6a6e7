"""kf_drive: values, speeds and accelerations of the drivers at a time."""

from __future__ import annotations

from kinfmu.codegen.c.parts import Parts
from kinfmu.codegen.c.text import FUNCTIONS, function
from kinfmu.codegen.writer import Names, Writer, identifier

_SIGNATURE = """\
void kf_drive(const kf_model *model, double time, const double *constants, double *u, double *ud,
              double *udd)"""


def drive(parts: Parts) -> list[str]:
    """The function, over the constants of the laws and the parameters."""
    laws = parts.plan.laws
    orders = [[getattr(law, order) for law in laws] for order in ("position", "rate", "acceleration")]
    writer = Writer(Names(curves=parts.curves, functions=FUNCTIONS), ())
    body = [f"{line};" for line in writer.statements([node for nodes in orders for node in nodes])]
    for name, nodes in zip(("u", "ud", "udd"), orders, strict=True):
        body += [f"{name}[{k}] = {writer.expression(node)};" for k, node in enumerate(nodes)]
    places = {constant.name: f"constants[{k}]" for k, constant in enumerate(parts.plan.law_constants)}
    places |= {name: f"model->parameters[{k}]" for name, k in parts.parameters.items()}
    used = {node.name for node in writer.used if node.op == "symbol"}
    loads = [f"{identifier(name)} = {place};" for name, place in places.items() if name in used]
    return function(_SIGNATURE, [*loads, *body], ("time", "model", "constants"))
