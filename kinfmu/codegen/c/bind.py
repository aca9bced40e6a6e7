"""kf_bind: parameters and what depends on them alone, or why they have no solution. kf_drive: the drivers at a time."""

from __future__ import annotations

from kinfmu.codegen.c.parts import Parts
from kinfmu.codegen.c.text import FUNCTIONS, function, string
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.solver.python.continuation import NO_NUMBER

_BIND = "bool kf_bind(kf_model *model, const double *parameters, char *why, size_t size)"
_HOLDS = {"positive": "{} > 0.0", "other than 0": "{} != 0.0", "0": "fabs({}) <= 1e-9"}


def bind(parts: Parts) -> list[str]:
    """Return kf_bind: true if all that follows from the parameters is finite and the plan's conditions hold."""
    derived, conditions = parts.derived, parts.plan.conditions
    writer = Writer(parts.names, (), derived)
    known = [f"{line};" for line in writer.statements([*derived, *(condition.node for condition in conditions)])]
    numbers = [writer.expression(condition.node) for condition in conditions]
    used = {node.name for node in writer.used if node.op == "symbol"}
    lines = [
        *(f"model->parameters[{k}] = parameters[{k}];" for k in parts.parameters.values()),
        *(f"{identifier(name)} = parameters[{k}];" for name, k in parts.parameters.items() if name in used),
        *known,
        *(f"model->derived[{k}] = {writer.expression(node)};" for k, node in enumerate(derived)),
    ]
    terms = [f"fabs({number})" for number, (_, node, _) in zip(numbers, conditions, strict=True) if node not in derived]
    if derived:
        lines += ["for (k = 0; k < KF_DERIVED; ++k) {", "    total += fabs(model->derived[k]);", "}"]
        terms.insert(0, "total")
    if terms:
        lines += _refused_unless(f"{' + '.join(terms)} < INFINITY", string(NO_NUMBER))
    for number, (name, _, required) in zip(numbers, conditions, strict=True):
        message = string(f"{name.replace('%', '%%')} = %.15g must be {required}")
        lines += _refused_unless(_HOLDS[required].format(number), f"{message}, {number}")
    variables = ("double total = 0.0;", "int k;") if derived else ()
    return function(_BIND, [*lines, "return true;"], ("model", "parameters", "why", "size"), variables)


def _refused_unless(condition: str, message: str) -> list[str]:
    return [f"if (!({condition})) {{", f"    snprintf(why, size, {message});", "    return false;", "}"]


_DRIVE = """\
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
    return function(_DRIVE, [*loads, *body], ("time", "model", "constants"))
