"""The function `differences` of a module: how far two rows of `motion` are apart, for the error estimates."""

from __future__ import annotations

from collections.abc import Sequence

from kinfmu.codegen.python.block_code import tupled, unpacking
from kinfmu.plan import SolvePlan

MANY = 100  # outputs; beyond that, loops are shorter
_HEAD = (
    "",
    "def differences(there, here):",
    '    """Largest differences of positions, of rates and of accelerations, in radians and sizes; all finite."""',
)


def angle_places(plan: SolvePlan) -> tuple[int, ...]:
    """Return the places of the angles among the outputs."""
    return tuple(k for k, name in enumerate(plan.outputs) if name.endswith(".phi"))


def differences(plan: SolvePlan) -> list[str]:
    """Return the lines of the function `differences`."""
    n = len(plan.outputs)
    angles = angle_places(plan)
    lengths = [k for k in range(n) if k not in set(angles)]
    if n > MANY:
        return [
            *_HEAD,
            "    gaps = [abs(a - b) for a, b in zip(there, here)]",
            f"    rows = [gaps[k : k + {n}] for k in range(0, {3 * n}, {n})]",
            "    of_angles = [max([row[k] for k in ANGLES], default=0.0) for row in rows]",
            f"    lengths = {tupled(map(str, lengths))}",
            "    of_lengths = [max([row[k] for k in lengths], default=0.0) / SIZE for row in rows]",
            "    return tuple(map(max, of_angles, of_lengths))",
            "",
        ]
    largest = [_largest([k + order * n for k in angles], [k + order * n for k in lengths]) for order in range(3)]
    return [
        *_HEAD,
        *unpacking([f"a{k}" for k in range(3 * n)], "there"),
        *unpacking([f"b{k}" for k in range(3 * n)], "here"),
        f"    return {tupled(largest)}",
        "",
    ]


def _largest(angles: Sequence[int], lengths: Sequence[int]) -> str:
    """Return the expression of the largest difference; a length counts relative to the size."""
    terms = [f"abs(a{k} - b{k})" for k in angles]
    if lengths:
        terms.append(f"{_max([f'abs(a{k} - b{k})' for k in lengths])} / SIZE")
    return _max(terms)


def _max(terms: Sequence[str]) -> str:
    return f"max({', '.join(terms)})" if len(terms) > 1 else "".join(terms) or "0.0"
