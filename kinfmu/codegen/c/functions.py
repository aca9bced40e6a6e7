"""The functions of model.c: those of the whole model, around those of its units.

kf_solve_blocks, kf_velocity, kf_acceleration, kf_jacobian, kf_residuals    loops over the units
kf_outputs, kf_output_rates, kf_output_accelerations, kf_watches, kf_fixed  readers of a pose
kf_bind: parameters and what depends on them alone, or why they have no solution; kf_drive: the drivers at a time
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from kinfmu.codegen.c.stage_cache import StageCache
from kinfmu.codegen.c.text import FUNCTIONS, array, filled, function, loads, model_places, repeated, string
from kinfmu.codegen.c.units import Units
from kinfmu.codegen.lists import LISTS, Lists, UnitRun
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.plan import SolvePlan
from kinfmu.plan.equations.graph import Node
from kinfmu.plan.path_laws import argument_symbol
from kinfmu.solver.python.continuation import NO_NUMBER
from kinfmu.solver.python.curve import CurveData

MOST_STORES = 500  # of numbers in one function; the time of a compiler grows with their square


class Parts(Lists):
    """The parts of a plan's model in C, from which its functions are written.

    curves: names of the constants that hold the data of curves; solved: the blocks that need Newton; units: by the
    label of their kind; readable: where functions of the whole model find what they read.
    """

    def __init__(self, plan: SolvePlan) -> None:
        super().__init__(plan)
        data = dict.fromkeys(node.curve[0] for node in plan.nodes if node.op == "curve")
        self.curves: dict[CurveData, str] = {one: f"&curve_{k}" for k, one in enumerate(data, start=1)}
        self.names = Names((name for block in plan.blocks for name in block.coordinates), self.curves, FUNCTIONS)
        self.solved = [block for block in plan.blocks if block.unknowns]
        self.bound = model_places(self)
        self.units = {k: Units(kind, self.curves, self.bound) for k, kind in self.kinds.items()}
        self.stage_cache = StageCache(self, self.units)
        self.readable = self.bound.copy()
        self.readable |= {name: f"{_LISTS[order]}[{k}]" for order in range(3) for name, k in self.places(order).items()}
        self.readable |= {argument_symbol(k): f"arguments[{k}]" for k in range(len(plan.path_laws.turns))}


_LOCALS = ("const double *const x = found->x;", "const double *const hold = found->hold;")


def stages(parts: Parts) -> list[str]:
    """Return all of them."""
    return [
        *_positions(parts),
        *_rates(parts, "velocity", 1),
        *_rates(parts, "acceleration", 2),
        *_entries(parts, "jacobian"),
        *_entries(parts, "residuals"),
    ]


def _positions(parts: Parts) -> list[str]:
    """Return kf_solve_blocks."""
    calls: list[str] = []
    for number, run in parts.numbered():
        unit = _unit(parts, number, index(run))
        if run.kind.solved:
            block = block_of(run)
            call = [
                f"if (!position{run.kind.label}(model, {unit}, z, held && held[{block}],",
                f"                &found->determinants[{block}], newton)) {{",
                f"    return {block}",
                "}",
            ]
        else:
            call = [f"position{run.kind.label}(model, {unit})"]
        calls += repeated(len(run.members), call)
    signature = (
        "inline int kf_solve_blocks(const kf_model *model, const double *z, const bool *held, kf_found *found,\n"
        "                kf_newton *newton)"
    )
    variables = ["double *const x = found->x;", "double *const hold = found->hold;"]
    variables += ["int k;"] if any(index(run) == "k" for run in parts.runs) else []
    return function(signature, [*calls, "return -1"], variables)


def _rates(parts: Parts, name: str, order: int) -> list[str]:
    """Return kf_velocity or kf_acceleration."""
    out, driven = LISTS[order], "u" + "d" * order
    calls: list[str] = []
    for number, run in parts.numbered():
        solving = ["given", f"held && held[{block_of(run)}]"] if run.kind.solved else []
        arguments = ["model", _unit(parts, number, index(run)), *solving, *LISTS[1:order], out]
        calls += repeated(len(run.members), [f"{name}{run.kind.label}({', '.join(arguments)})"])
    ready = " const double *x1," if order == 2 else ""
    signature = (
        f"inline void kf_{name}(const kf_model *model, const kf_found *found, const double *{driven},{ready}\n"
        f"    const double *given, const bool *held, double *{out})"
    )
    drivers = [
        "for (k = 0; k < KF_DRIVERS; ++k) {",
        f"    {out}[KF_COORDINATES - KF_DRIVERS + k] = {driven}[k]",
        "}",
    ]
    return function(signature, [*drivers, *calls], (*_LOCALS, "int k;"))


def _entries(parts: Parts, name: str) -> list[str]:
    """Return kf_jacobian or kf_residuals: numbers of one block."""
    calls: list[str] = []
    for number, run in parts.numbered():
        if run.kind.solved:
            unit = _unit(parts, number, f"block - {run.first}")
            calls += [
                f"if (block < {run.first + len(run.members)}) {{",
                f"    {name}{run.kind.label}(model, {unit}, {name})",
                "    return",
                "}",
            ]
    signature = f"void kf_{name}(const kf_model *model, const kf_found *found, int block, double *{name})"
    return function(signature, calls, _LOCALS if calls else ())


def _unit(parts: Parts, number: int, k: str) -> str:
    """Return the arguments for unit k of a run: its row, the positions, and its part of the stage cache."""
    return f"&run_{number}[{k}], x, hold + {parts.stage_cache.start(number, k)}"


def index(run: UnitRun) -> str:
    """Return the index of a unit in a loop over its run; '0' for a run of one."""
    return "k" if len(run.members) > 1 else "0"


def block_of(run: UnitRun) -> str:
    """Return the number of the solved block of unit k."""
    return f"{run.first} + k" if len(run.members) > 1 else f"{run.first}"


_LISTS = ("found->x", "x1", "x2")  # where a reader finds coordinates, their rates, their accelerations
_OUTPUTS = (("kf_outputs", "outputs"), ("kf_output_rates", "rates"), ("kf_output_accelerations", "accelerations"))
_ALONE = (((0, ""),), ((1, "v"),), ((2, "(v * v)"), (1, "a")))  # sums of derivatives with respect to the one driver


def readers(parts: Parts) -> list[str]:
    """Return all of them."""
    watches = "inline void kf_watches(const kf_model *model, const kf_found *found, double *watches)"
    return [
        *(line for order in range(3) for line in _outputs(parts, order)),
        *_filled(parts, watches, [node for _, node in parts.plan.watches]),
        *_fixed(parts),
        *(_laws(parts) if parts.plan.path_laws.units else ()),
    ]


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
    targets = [nodes[of][k] for of, _ in summed for k in formulas]
    lines, expressions = _formulas(parts, targets)
    texts = dict(zip(targets, expressions, strict=True))
    is_copied = len(formulas) < len(places)
    if is_copied:
        place = f"kf_{out}_places[k]"
        lines += [
            "for (k = 0; k < KF_OUTPUTS; ++k) {",
            f"    if ({place} >= 0) {{",
            f"        {out}[k] = {_sum((f'{_LISTS[of]}[{place}]', factor) for of, factor in summed)}",
            "    }",
            "}",
        ]
    for k in formulas:
        lines.append(f"{out}[{k}] = {_sum((texts[nodes[of][k]], factor) for of, factor in summed)}")
    lists, speeds = LISTS[1 : order + 1], ("v", "a")[:order]
    given = "".join([*(f" const double *{one}," for one in lists), *(f" double {one}," for one in speeds)])
    return [
        *array(f"int kf_{out}_places", [-1 if place is None else place for place in places]),
        "",
        *function(
            f"inline void {name}(const kf_model *model, const kf_found *found,{given}\n    double *{out})",
            lines,
            ("int k;",) if is_copied else (),
        ),
    ]


def _sum(terms: Iterable[tuple[str, str]]) -> str:
    """Return 'value * factor + ...'; a factor of one is left out."""
    return " + ".join(f"{_wrapped(value)} * {factor}" if factor else value for value, factor in terms)


def _wrapped(text: str) -> str:
    """Return the text in brackets, unless it is a name or an item of a list."""
    return text if text.isidentifier() or text.endswith("]") else f"({text})"


def _laws(parts: Parts) -> list[str]:
    """Return the functions of what steps of a path monitor of laws."""
    laws, pose = parts.plan.path_laws, "const kf_model *model, const kf_found *found"
    functions = (
        (f"positions({pose}, double *positions)", laws.motions[0]),
        (f"rates({pose}, const double *x1, double *rates)", laws.motions[1]),
        (f"accelerations({pose}, const double *x1, const double *x2, double *accelerations)", laws.motions[2]),
        ("slopes(const kf_model *model, double *slopes)", laws.slopes),
        ("added(const kf_model *model, double *added)", laws.added),
        ("steps(const kf_model *model, const double *arguments, double *steps)", laws.steps),
    )
    return [line for head, nodes in functions for line in _filled(parts, f"void kf_law_{head}", nodes)]


def _filled(parts: Parts, signature: str, nodes: Sequence[Node]) -> list[str]:
    """Return a function that writes numbers into its last argument."""
    lines, texts = _formulas(parts, nodes)
    return function(signature, [*lines, *filled(signature.split("*")[-1].rstrip(")"), texts)])


def _fixed(parts: Parts) -> list[str]:
    """Return the function of the fixed coordinates; beyond MOST_STORES their numbers are a table."""
    signature, nodes = "void kf_fixed(const kf_model *model, double *fixed)", list(parts.plan.fixed_nodes.values())
    if len(nodes) <= MOST_STORES:
        return _filled(parts, signature, nodes)
    lines, texts = _formulas(parts, nodes)
    numbers = [0.0 if node.constant is None else node.constant for node in nodes]
    copied = ["for (k = 0; k < KF_FIXED; ++k) {", "    fixed[k] = fixed_numbers[k];", "}"]
    stored = [one for one, node in zip(filled("fixed", texts), nodes, strict=True) if node.constant is None]
    table = array("static double fixed_numbers", numbers)
    return [*table, "", *function(signature, [*lines, *copied, *stored], ("int k;",))]


def _formulas(parts: Parts, targets: Sequence[Node]) -> tuple[list[str], list[str]]:
    """Return statements, those that read first, and after them each target as an expression."""
    writer = Writer(parts.names, [*parts.derived, *parts.stage_cache.nodes])
    statements, texts = writer.formulas(targets)
    held = parts.stage_cache.place
    read = loads(parts.names, writer.used, parts.readable, lambda node: f"found->hold[{held(node)}]")
    return [*read, *statements], texts


_BIND = "bool kf_bind(kf_model *model, const double *parameters, char *why, size_t size)"
_HOLDS = {"positive": "{} > 0.0", "0 or more": "{} >= 0.0", "other than 0": "{} != 0.0", "0": "fabs({}) <= 1e-9"}


def bind(parts: Parts) -> list[str]:
    """Return kf_bind: true if all that follows from the parameters is finite and the plan's conditions hold."""
    derived, conditions = parts.derived, parts.plan.conditions
    writer = Writer(parts.names, (), derived)
    known = writer.statements([*derived, *(condition.node for condition in conditions)])
    numbers = [writer.expression(condition.node) for condition in conditions]
    used = {node.name for node in writer.used if node.op == "symbol"}
    lines = [
        *(f"model->parameters[{k}] = parameters[{k}]" for k in parts.parameters.values()),
        *(f"{identifier(name)} = parameters[{k}]" for name, k in parts.parameters.items() if name in used),
        *known,
        *filled("model->derived", map(writer.expression, derived)),
    ]
    terms = [f"fabs({number})" for number, (_, node, _) in zip(numbers, conditions, strict=True) if node not in derived]
    if derived:
        lines += ["for (k = 0; k < KF_DERIVED; ++k) {", "    total += fabs(model->derived[k])", "}"]
        terms.insert(0, "total")
    if terms:
        lines += _refused_unless(f"{' + '.join(terms)} < INFINITY", string(NO_NUMBER))
    for number, (name, _, required) in zip(numbers, conditions, strict=True):
        message = string(f"{name.replace('%', '%%')} = %.15g must be {required}")
        lines += _refused_unless(_HOLDS[required].format(number), f"{message}, {number}")
    variables = ("double total = 0.0;", "int k;") if derived else ()
    return function(_BIND, [*lines, "return true"], variables)


def _refused_unless(condition: str, message: str) -> list[str]:
    return [f"if (!({condition})) {{", f"    snprintf(why, size, {message})", "    return false", "}"]


_DRIVE = """\
void kf_drive(const kf_model *model, double time, const double *constants, double *u, double *ud,
              double *udd)"""


def drive(parts: Parts) -> list[str]:
    """Return the function, over the constants of the laws and the parameters."""
    laws = parts.plan.laws
    orders = [[getattr(law, order) for law in laws] for order in ("position", "rate", "acceleration")]
    writer = Writer(Names(curves=parts.curves, functions=FUNCTIONS), ())
    body = writer.statements([node for nodes in orders for node in nodes])
    for name, nodes in zip(("u", "ud", "udd"), orders, strict=True):
        body += filled(name, map(writer.expression, nodes))
    places = {constant.name: f"constants[{k}]" for k, constant in enumerate(parts.plan.law_constants)}
    places |= {name: f"model->parameters[{k}]" for name, k in parts.parameters.items()}
    used = {node.name for node in writer.used if node.op == "symbol"}
    read = [f"{identifier(name)} = {place}" for name, place in places.items() if name in used]
    return function(_DRIVE, [*read, *body])
