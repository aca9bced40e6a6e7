"""Functions that read a pose: outputs, their rates and accelerations, watches; and the fixed coordinates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from kinfmu.codegen.c.parts import Parts
from kinfmu.codegen.c.text import array, function
from kinfmu.codegen.lists import LISTS
from kinfmu.codegen.writer import Writer
from kinfmu.equations.graph import Node
from kinfmu.plan.trace import is_parameter

_LISTS = ("found->x", "x1", "x2")  # where a reader finds coordinates, their rates, their accelerations
_OUTPUTS = (("kf_outputs", "outputs"), ("kf_output_rates", "rates"), ("kf_output_accelerations", "accelerations"))
_ALONE = (((0, ""),), ((1, "v"),), ((2, "(v * v)"), (1, "a")))  # sums of derivatives with respect to the one driver


def readers(parts: Parts) -> list[str]:
    """Return all of them."""
    return [*(line for order in range(3) for line in _outputs(parts, order)), *_watches(parts), *_fixed(parts)]


def _outputs(parts: Parts, order: int) -> list[str]:
    """Return the function of the outputs of an order: some are items of a list, others are formulas.

    With one driver x1 and x2 are derivatives with respect to its value, and so are the formulas; of its speed v and
    acceleration a

        yd = y' v,   ydd = y'' v^2 + y' a
    """
    name, out = _OUTPUTS[order]
    summed = _ALONE[order] if len(parts.plan.drivers) == 1 else ((order, ""),)
    nodes = {of: [node for node, _ in parts.outputs(of)] for of, _ in summed}
    places = [place for _, place in parts.outputs(order)]
    formulas = [k for k, place in enumerate(places) if place is None]
    texts, lines = _expressions(parts, [nodes[of][k] for of, _ in summed for k in formulas])
    is_copied = len(formulas) < len(places)
    if is_copied:
        place = f"kf_{out}_places[k]"
        lines += [
            "for (k = 0; k < KF_OUTPUTS; ++k) {",
            f"    if ({place} >= 0) {{",
            f"        {out}[k] = {_sum((f'{_LISTS[of]}[{place}]', factor) for of, factor in summed)};",
            "    }",
            "}",
        ]
    for k in formulas:
        lines.append(f"{out}[{k}] = {_sum((texts[nodes[of][k]], factor) for of, factor in summed)};")
    lists, speeds = LISTS[1 : order + 1], ("v", "a")[:order]
    given = "".join([*(f" const double *{one}," for one in lists), *(f" double {one}," for one in speeds)])
    return [
        *array(f"int kf_{out}_places", [-1 if place is None else place for place in places]),
        "",
        *function(
            f"inline void {name}(const kf_model *model, const kf_found *found,{given}\n    double *{out})",
            lines,
            ("model", "found", *lists, *speeds),
            ("int k;",) if is_copied else (),
        ),
    ]


def _sum(terms: Iterable[tuple[str, str]]) -> str:
    """Return 'value * factor + ...'; a factor of one is left out."""
    return " + ".join(f"{_wrapped(value)} * {factor}" if factor else value for value, factor in terms)


def _wrapped(text: str) -> str:
    """Return the text in brackets, unless it is a name or an item of a list."""
    return text if text.isidentifier() or text.endswith("]") else f"({text})"


def _watches(parts: Parts) -> list[str]:
    nodes = [node for _, node in parts.plan.watches]
    texts, lines = _expressions(parts, nodes)
    lines += [f"watches[{k}] = {texts[node]};" for k, node in enumerate(nodes)]
    signature = "inline void kf_watches(const kf_model *model, const kf_found *found, double *watches)"
    return function(signature, lines, ("model", "found", "watches"))


def _fixed(parts: Parts) -> list[str]:
    nodes = list(parts.plan.fixed_nodes.values())
    texts, lines = _expressions(parts, nodes)
    lines += [f"fixed[{k}] = {texts[node]};" for k, node in enumerate(nodes)]
    return function("void kf_fixed(const kf_model *model, double *fixed)", lines, ("model", "fixed"))


def _expressions(parts: Parts, targets: Sequence[Node]) -> tuple[dict[Node, str], list[str]]:
    """Return each target as an expression, and the statements that come before."""
    writer = Writer(parts.names, [*parts.derived, *parts.stage_cache.nodes])
    statements = [f"{line};" for line in writer.statements(targets)]
    texts = {node: writer.expression(node) for node in targets}
    return texts, [*_loads(parts, writer.used), *statements]


def _loads(parts: Parts, used: Iterable[Node]) -> list[str]:
    """Return assignments of what the statements read from the model, its pose and the lists."""
    listed = {name: f"{_LISTS[order]}[{k}]" for order in range(3) for name, k in parts.places(order).items()}
    lines = []
    for node in used:
        if node in parts.derived:
            source = f"model->derived[{parts.derived[node]}]"
        elif node in parts.stage_cache.nodes:
            source = f"found->hold[{parts.stage_cache.place(node)}]"
        elif is_parameter(node):
            source = f"model->parameters[{parts.parameters[node.name]}]"
        else:
            source = listed[node.name]
        lines.append(f"{parts.names.of(node)} = {source};")
    return lines
