"""Generated C as WebAssembly: what is translated computes as C does; see tests/page/test_module.py for mechanisms."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path

import pytest

from kinfmu.codegen.wasm import Binary, Translator
from kinfmu.errors import CompilerError
from kinfmu.page.module import SOURCES

NODE = shutil.which("node")
CODE = """
typedef struct { bool is_held; int k; double x[3]; const double *more; } record;
static const double numbers[3] = {-0.5, 2.0, 1e-3}; /* a comment */
static const int places[2] = {2, 0};
static const record records[2] = {{true, 1, {1.0, 2.0, 3.0}, numbers}, {false, -2, {4.0, 5.0, 6.0}, numbers}};

static double sum(int count, const double *values, double *product)
{
    double total = 0.0;
    int k;
    (void)count;
    *product = 1.0;
    for (k = 0; k < 3; ++k) {
        total += values[k];
        *product *= values[k];
        if (k == count) {
            break;
        }
    }
    return total;
}

double kf_sin(double x)
{
    const record *const row = &records[1];
    const double list[2] = {x * 3.0, -x};
    double product, s, c;
    bool is_large = x > 10.0 || !(x >= -10.0 && row->k != 3);
    {
        double list[1] = {7.0};
        x += list[0] - 7.0;
    }
    s = sum(1, row->x + 1 - 1, &product);
    c = is_large ? -1.0 : row->k + 0.25;
    if (is_large) {
        return INFINITY;
    } else if (x < 0.0) {
        return sqrt(fabs(x)) / 3.0 - list[1] * row->more[places[0]];
    }
    return s * 1000.0 + product * c - list[0] / 7.0 + floor(x) - (records[0].is_held ? -1 : 1) * 2;
}
"""


def expected(x: float) -> float:
    if x > 10.0 or not x >= -10.0:
        return math.inf
    if x < 0.0:
        return math.sqrt(abs(x)) / 3.0 - -x * 1e-3
    return (4.0 + 5.0) * 1000.0 + 20.0 * (-2 + 0.25) - x * 3.0 / 7.0 + math.floor(x) + 2.0


def translated(code: str) -> Binary:
    """Return the module of pages with code in it."""
    module = Binary((SOURCES / "solver.wasm").read_bytes())
    Translator(module, {}, {}).translate(code)
    return module


@pytest.mark.skipif(NODE is None, reason="not installed: node")
def test_statements_and_operators_compute_as_in_c(tmp_path: Path) -> None:
    (tmp_path / "difference").write_bytes(translated(CODE).difference(["kf_sin"]))
    values = [0.3, 9.999, 10.5, -0.7, -11.0, 0.0]
    script = f"""
        import {{ assembled }} from {json.dumps((SOURCES.parent / "web" / "engine.js").as_uri())};
        import {{ readFileSync }} from "node:fs";
        const bytes = (path) => new Uint8Array(readFileSync(path)).buffer;
        const module = assembled(bytes({json.dumps(str(SOURCES / "solver.wasm"))}), bytes("difference"));
        const {{ instance }} = await WebAssembly.instantiate(module, {{}});
        console.log({json.dumps(values)}.map((x) => String(instance.exports.kf_sin(x))).join(" "));
    """
    (tmp_path / "script.mjs").write_text(script, "utf-8")
    done = subprocess.run([str(NODE), "script.mjs"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert [float(word.replace("Infinity", "inf")) for word in done.stdout.split()] == [expected(x) for x in values]


@pytest.mark.parametrize(
    "statement",
    [
        "while (x) { }",
        "return x % 2.0;",
        "return y;",
        "return (int)x;",
        "return pow(x, 2.0);",
        "int k = x;",
        "bool is = 2;",
        "return x ? 1.0 : 2.0;",
        "return x && 1;",
        "double list[2] = {x};",
        "x++;",
        "return 0x1p3;",
    ],
)
def test_c_that_is_not_generated_is_refused(statement: str) -> None:
    with pytest.raises(CompilerError, match="cannot translate"):
        translated(f"double kf_sin(double x)\n{{\n    {statement}\n    return x;\n}}\n")


def test_a_function_with_other_arguments_than_its_place_is_refused() -> None:
    with pytest.raises(CompilerError, match="cannot translate kf_sin: its place has other arguments"):
        translated("double kf_sin(int x)\n{\n    return 1.0;\n}\n")
