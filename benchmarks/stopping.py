"""A generated model with another rule for when Newton stops, from its own source: everything else stays as shipped.

The loop that the Python backend writes for each block,

    for iteration in range(12):
        (residuals r0, r1, ..., `error` their square, entries of the Jacobian or its factors)
        if error <= enough or held & 1 or (it does not fall any more):
            break
        last = error
        (unknowns -= Jacobian^-1 r)

is rewritten as a syntax tree: another bound or a fixed number in the condition, and for chord Newton the entries or
factors of the first iteration in the correction.
"""

from __future__ import annotations

import ast
from types import ModuleType
from typing import Any

from benchmarks.engine import EngineSetting
from kinfmu.codegen.python import emit
from kinfmu.errors import KinfmuError
from kinfmu.plan import SolvePlan

MOST = 60  # iterations of chord Newton, which converges linearly


def model_with(plan: SolvePlan, setting: EngineSetting) -> Any:
    """Return the generated model of a plan, its parameters as written, whose `position` stops by the setting."""
    rewriter = _Rewriter(setting)
    tree = rewriter.visit(ast.parse(emit(plan)))
    if not rewriter.loops and any(block.unknowns for block in plan.blocks):
        raise KinfmuError(f"{plan.mechanism.name}: the generated code has no loop `for iteration in range(...)`")
    module = ModuleType(f"kinfmu.solver.python.model_{plan.mechanism.name}")
    module.__package__ = "kinfmu.solver.python"  # next to `linear`, as in an FMU
    exec(compile(ast.fix_missing_locations(tree), module.__name__, "exec"), module.__dict__)  # noqa: S102  our own
    return module.bound(tuple(value for _, value in module.PARAMETERS)) if plan.parameters else module


class _Rewriter(ast.NodeTransformer):
    def __init__(self, setting: EngineSetting) -> None:
        self.setting = setting
        self.loops = 0

    def visit_For(self, loop: ast.For) -> ast.For:
        """Change a loop of Newton; nothing else in a model is called `iteration`."""
        if not (isinstance(loop.target, ast.Name) and loop.target.id == "iteration"):
            return loop
        self.loops += 1
        place, stop = next((k, line) for k, line in enumerate(loop.body) if isinstance(line, ast.If))
        if not (isinstance(stop.test, ast.BoolOp) and len(stop.test.values) == 3):
            raise KinfmuError(f"the generated loop stops by another rule than is known here: {ast.unparse(stop.test)}")
        small, held, settled = stop.test.values
        if self.setting.corrections is not None:
            stop.test.values = [_expression(f"iteration >= {self.setting.corrections}"), held]
        elif self.setting.tolerance:
            stop.test.values = [_expression(f"error <= {self.setting.tolerance**2!r}"), held, settled]
        else:
            stop.test.values = [small, held, settled]
        loop.iter = _expression(f"range({MOST})")
        if self.setting.chord:
            loop.body = _chord(loop.body, place, stop)
        return loop


def _chord(body: list[ast.stmt], place: int, stop: ast.If) -> list[ast.stmt]:
    """Return the body of a loop whose correction uses the Jacobian of the first iteration."""
    evaluation, last, correction = body[:place], body[place + 1], body[place + 2 :]
    is_factored = any(_assigned(line).startswith("factors") for line in evaluation)
    factoring = [line for line in evaluation if is_factored and _assigned(line).startswith(("factors", "det"))]
    evaluation = [line for line in evaluation if line not in factoring]
    known = {_assigned(line) for line in body[:place]}
    taken = sorted({name for name in _loaded(correction) if name in known and not _is_residual(name)})
    first = [*factoring, *ast.parse("\n".join(f"first_{name} = {name}" for name in taken)).body]
    stop.body = [*factoring, *stop.body]  # rates are solved with the factors of the pose itself
    renamed = [_Renamer(frozenset(taken)).visit(line) for line in correction]
    return [*evaluation, stop, last, ast.If(_expression("iteration == 0"), first, []), *renamed]


class _Renamer(ast.NodeTransformer):
    def __init__(self, names: frozenset[str]) -> None:
        self.names = names

    def visit_Name(self, name: ast.Name) -> ast.Name:
        if name.id in self.names and isinstance(name.ctx, ast.Load):
            return ast.Name(f"first_{name.id}", ast.Load())
        return name


def _assigned(line: ast.stmt) -> str:
    """Return the name that a statement assigns to, or an empty text."""
    if isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name):
        return line.targets[0].id
    return ""


def _loaded(lines: list[ast.stmt]) -> set[str]:
    nodes = (node for line in lines for node in ast.walk(line))
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}


def _is_residual(name: str) -> bool:
    return name[0] == "r" and name[1:].isdigit()


def _expression(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body
