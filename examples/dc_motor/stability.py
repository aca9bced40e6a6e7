"""Draw which couplings of motor and press are stable, and how their error depends on the step.

python examples/dc_motor/stability.py docs/drive-coupling.svg
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from kinfmu.draw.writing import write

sys.path.insert(0, str(Path(__file__).parent))
from build import build
from coupling import LARGEST_INERTIA, coupled, monolithic

RATIOS = 2.0 ** np.arange(-2.0, 4.5)
STEPS = (3e-4, 1e-3, 3e-3, 1e-2)  # [s]
STOP = 0.6  # [s]; a turn of the crank takes about a second
STABLE, UNSTABLE = 0.3, 1.0  # [rad] largest errors of the angle: below is stable, above diverged
GREEN, RED, GREY = "#15803d", "#b91c1c", "#6b7280"
TITLES = {"port": "port: bias torque and reduced inertia", "torque": "torque alone, a step late"}


def errors(fmus: dict[str, Path], coupling: str) -> Iterator[tuple[float, float, float]]:
    """Yield ratio of inertias, step and largest error of the angle [rad], infinite if the coupling diverges."""
    for ratio in RATIOS:
        for step in STEPS:
            rows = coupled(fmus, coupling, LARGEST_INERTIA / ratio, step, STOP)
            wanted = monolithic(LARGEST_INERTIA / ratio, step * np.arange(round(STOP / step) + 1), 1e-10)
            error = float(np.abs(rows - wanted)[:, 0].max()) if len(rows) == len(wanted) else np.inf
            yield float(ratio), step, error


def _map(axes: Axes, found: NDArray[np.float64], title: str) -> None:
    """Mark stable and unstable couplings over ratio of inertias and step."""
    ratio, step, error = found.T
    is_stable = error < STABLE
    axes.scatter(ratio[is_stable], step[is_stable], s=42, color=GREEN, label="stable")
    axes.scatter(ratio[~is_stable], step[~is_stable], s=42, color=RED, marker="x", label="diverges")
    axes.axvline(1.0, color=GREY, linewidth=0.8, linestyle=":")
    axes.set(xscale="log", yscale="log", xlabel="inertia of press / motor", ylabel="step [s]")
    axes.set_xticks(RATIOS, [f"{one:g}" for one in RATIOS], minor=False)
    axes.minorticks_off()
    axes.set_ylim(1.5e-4, 4e-2)
    axes.set_title(title, loc="left")
    axes.legend(loc="upper left", ncols=2, frameon=False)


def _convergence(axes: Axes, found: dict[str, NDArray[np.float64]]) -> None:
    """Draw the error over the step, at two ratios of inertias."""
    for coupling, colour in (("port", GREEN), ("torque", RED)):
        for wanted, style in ((0.5, "--"), (4.0, "-")):
            ratio, step, error = found[coupling].T
            rows = (ratio == wanted) & np.isfinite(error) & (error < UNSTABLE)
            if rows.sum() > 1:
                axes.plot(
                    step[rows], error[rows], style, marker="o", color=colour, label=f"{coupling}, ratio {wanted:g}"
                )
    slope = np.array([STEPS[0], STEPS[-1]])
    axes.plot(slope, 0.3 * slope, color=GREY, linewidth=0.8, linestyle=":", label="first order")
    axes.set(xscale="log", yscale="log", xlabel="step [s]", ylabel="error of the crank's angle [rad]")
    axes.set_title("error against one system", loc="left")
    axes.legend(frameon=False)


def _figure(found: dict[str, NDArray[np.float64]]) -> Figure:
    look = {"font.size": 9, "axes.titlesize": 9, "axes.spines.top": False, "axes.spines.right": False}
    with mpl.rc_context(look | {"legend.fontsize": 8}):
        figure = Figure(figsize=(11.0, 3.4), layout="constrained")
        panels = figure.subplots(1, 3)
        for axes, (coupling, title) in zip(panels, TITLES.items(), strict=False):
            _map(axes, found[coupling], title)
        _convergence(panels[2], found)
    return figure


def draw(path: Path) -> dict[str, NDArray[np.float64]]:
    """Write the figure and return rows of ratio, step and error by coupling."""
    with tempfile.TemporaryDirectory() as folder:
        fmus = build(Path(folder))
        found = {coupling: np.array(list(errors(fmus, coupling))) for coupling in TITLES}
    write(path, lambda: _figure(found))
    return found


if __name__ == "__main__":
    for coupling, rows in draw(Path(sys.argv[1] if len(sys.argv) > 1 else "drive-coupling.svg")).items():
        for ratio, step, error in rows:
            print(f"{coupling:>7}  ratio {ratio:5g}  step {step:7g} s  error {error:.2e} rad")
