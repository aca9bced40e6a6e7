"""Draw the error of Andrews' squeezer, driven by a torque, against the tolerance.

python -m tests.motion.torque.convergence docs/torque-tolerance.svg
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from kinfmu.draw.chart import dress
from kinfmu.draw.writing import write
from tests.motion.torque import andrews
from tests.run.test_lagrange import squeezed

TOLERANCES = {"DOP853": 10.0 ** np.arange(-4.0, -13.5, -1.0), "Radau": 10.0 ** np.arange(-4.0, -10.5, -1.0)}
COLOURS = {"DOP853": "#1d4ed8", "Radau": "#b45309"}
GREY = "#6b7280"
ORDERS = (("phi", "angles", "-"), ("omega", "speeds", "--"))


def errors(method: str, tolerance: float) -> tuple[float, float]:
    """Return the largest errors of angles and of speeds at the end, relative to the largest of each."""
    run = squeezed(method, tolerance)
    found = []
    for order, (column, _, _) in enumerate(ORDERS):
        exact = np.array([sum(andrews.AT_END[name][order] for name in names) for names in andrews.BODIES.values()])
        ours = np.array([run[f"{body}.{column}"][-1] for body in andrews.BODIES])
        found.append(float(np.abs(ours - exact).max() / np.abs(exact).max()))
    return found[0], found[1]


def chart() -> Figure:
    """Draw the errors, and the tolerance itself."""
    figure = Figure(figsize=(6.0, 3.6), layout="constrained")
    axes = figure.subplots()
    dress(axes, "Andrews' squeezer at 0.03 s, driven by 0.033 N m")
    for method, tolerances in TOLERANCES.items():
        found = np.array([errors(method, float(tolerance)) for tolerance in tolerances])
        for column, (_, what, style) in zip(found.T, ORDERS, strict=True):
            label = f"{method}, {what}"
            axes.plot(tolerances, column, style, marker="o", markersize=3, color=COLOURS[method], label=label)
    ends = TOLERANCES["DOP853"][[0, -1]]
    axes.plot(ends, ends, ":", color=GREY, label="error = tolerance")
    axes.set(xscale="log", yscale="log", xlabel="tolerance", ylabel="largest relative error")
    axes.legend(frameon=False, fontsize=8)
    return figure


def main() -> None:
    """Write the figure."""
    write(Path(sys.argv[1]), chart)


if __name__ == "__main__":
    main()
