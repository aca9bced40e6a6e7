"""The coefficients of the integrator in C: dormand_prince.h."""

from __future__ import annotations

from collections.abc import Sequence

from kinfmu.codegen.c.text import array


def dormand_prince(c: Sequence[float], a: Sequence[Sequence[float]], **rows: Sequence[float]) -> str:
    """Return the text of dormand_prince.h: kf_dp_c, kf_dp_a, and a table for each of the other rows."""
    count = len(c)
    lines = [
        "/* Dormand and Prince, order 8 with error estimates of orders 5 and 3: generated from a table. */",
        "#ifndef KF_DORMAND_PRINCE_H",
        "#define KF_DORMAND_PRINCE_H",
        "",
        f"#define KF_STAGES {count} /* the derivatives at the end of the step follow */",
        *array("static double kf_dp_c", c),
    ]
    square = [value for row in a for value in (*row, *(0.0,) * (count - len(row)))]
    lines += array("static double kf_dp_a", square)  # row after row
    for name, row in rows.items():
        lines += array(f"static double kf_dp_{name}", row[:count])
    return "\n".join([*lines, "", "#endif", ""])
