"""What was measured as charts: run time against error, and the path through singular points."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from kinfmu import gallery
from kinfmu.bench.accuracy import Measured
from kinfmu.bench.near_singular import ChartRow, Passage, near_singular
from kinfmu.bench.singular import DISTANCES, Near
from kinfmu.bench.work_precision import Curve, Panel, work_precision
from kinfmu.draw.chart import Look
from kinfmu.plan import compile_plan
from kinfmu.scene.palette import BODIES, GROUND, darker

WORK_PRECISION, NEAR_SINGULAR = "accuracy-work-precision", "accuracy-singular"
ROWS = 2  # of the chart of singular points; the table has them all
SUFFIXES = (".svg", ".png")

NOTES = (
    "To the left is exact, below is fast.",
    "",
    "Points of kinfmu's generated Python and of",
    "the readable reference: 0 to 3 corrections",
    "of Newton; of the others: tolerances.",
    "",
    "Curves from light to dark: predicted by the",
    "last pose, with its velocity, with velocity",
    "and acceleration.",
    "",
    "kinfmu is what is shipped: the last, with every",
    "step judged, to round-off; native in C.",
)
LOOKS = {  # of the engines
    "kinfmu": Look(BODIES[4], 2.2, "D"),
    "kinfmu native": Look(darker(BODIES[4]), 2.2, "D"),
    "generated Python": Look(BODIES[0]),
    "pylinkage": Look(GROUND, 1.4, "s"),
    "CasADi": Look(BODIES[3]),
    "scipy fsolve": Look(BODIES[2]),
    "numpy Newton": Look(BODIES[1], 1.4, "s"),
    "readable reference": Look(BODIES[5]),
}


def draw_work_precision(folder: Path, measured: Sequence[Measured]) -> tuple[Path, ...]:
    """Write the work-precision chart as SVG and PNG: fixed numbers of corrections, or tolerances of the others."""
    paths = _paths(folder, WORK_PRECISION)
    panels = []
    for case in dict.fromkeys(one.case for one in measured):
        of_case = [one for one in measured if one.case == case]
        curves = []
        for engine in LOOKS:
            of_engine = [one for one in of_case if one.engine == engine and not one.setting.chord]
            fixed = [one for one in of_engine if one.setting.corrections is not None]
            for order in range(3):
                line = [one for one in fixed or of_engine if one.setting.predictor == order and isfinite(one.error)]
                if line:
                    points = [(one.error, one.microseconds.median) for one in line]
                    curves.append(Curve(engine, order, points))
        panels.append(Panel(_title(case), curves))
    engines = {one.engine for one in measured}
    looks = {name: look for name, look in LOOKS.items() if name in engines}
    work_precision(paths, panels, looks, NOTES)
    return paths


def _title(case: str) -> str:
    """'jansen leg: 2 + 2 + 2 unknowns': by blocks in the order of solving."""
    sizes = [len(block.unknowns) for block in compile_plan(gallery.load(case)).blocks if block.unknowns]
    return f"{case.replace('_', ' ')}: {' + '.join(map(str, sizes))} unknown{'s' * (sizes != [1])}"


def draw_singular(folder: Path, near: Sequence[Near]) -> tuple[Path, ...]:
    """Write the chart of singular points as SVG and PNG."""
    paths = _paths(folder, NEAR_SINGULAR)
    rows = []
    for point in list(dict.fromkeys(one.point for one in near))[:ROWS]:
        passages = [
            Passage(one.engine, one.before.T.tolist(), one.at.tolist(), one.beyond.T.tolist())
            for one in near
            if one.point == point
        ]
        rows.append(ChartRow(point, DISTANCES, passages))
    near_singular(paths, rows, LOOKS)
    return paths


def _paths(folder: Path, name: str) -> tuple[Path, ...]:
    return tuple(folder / f"{name}{suffix}" for suffix in SUFFIXES)
