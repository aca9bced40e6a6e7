"""The demonstration on the reference four-bar: check, FMU, simulation, comparison with the report, logs, picture."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from shlex import quote

import numpy as np
from numpy.typing import ArrayLike

from kinfmu.analysis import check
from kinfmu.arrays import FloatArray
from kinfmu.draw import animate
from kinfmu.errors import MissingPackageError
from kinfmu.fmu import build, simulate
from kinfmu.log import write_mcap, write_rrd
from kinfmu.mechanism.gallery import load
from kinfmu.run import Run
from kinfmu.solver.python.pose import Status

# The printed table of the report (Alzaga 1999): t [s], then phi1, x2, y2, phi2, phi3 to four digits.
PRINTED = (
    (30, (0.5236, 1.8660, 0.5000, 0.0, 0.5236)),
    (60, (1.0472, 1.5000, 0.8660, 0.0, 1.0472)),
    (90, (1.5708, 1.0000, 1.0000, 0.0, 1.5708)),
    (120, (2.0944, 0.5000, 0.8660, 0.0, 2.0944)),
    (150, (2.6180, 0.1340, 0.5000, 0.0, 2.6180)),
)
LETTERS = ("phi1", "x2", "y2", "phi2", "phi3")
EXACT = 1e-12  # largest difference from the closed form in q, qd, qdd


def compare_with_report(run: Run) -> tuple[str, bool]:
    """Return the table of the report and ours with percent errors, and whether all 25 numbers agree to four digits."""
    lines = ["  t [s]" + "".join(f"{letter:>10}{'error %':>10}" for letter in LETTERS)]
    agree = True
    for t, printed in PRINTED:
        row = run.q[int(np.flatnonzero(run.t == t)[0])]
        cells = []
        for ours, theirs in zip(row, printed, strict=True):
            agree &= bool(abs(ours - theirs) <= 0.5e-4 * (1.0 + 1e-9))
            percent = 100.0 * (theirs - ours) / ours if theirs else 100.0 * ours
            cells.append(f"{round(ours, 4) + 0.0:10.4f}{abs(percent):10.4f}")
        lines.append(f"{t:7d}" + "".join(cells))
    return "\n".join(lines), agree


def parallelogram(u: ArrayLike) -> FloatArray:
    """Return q, q', q'' of the reference four-bar's phi1, x2, y2, phi2, phi3, (3, ..., 5); u: (...) crank angle."""
    phi = np.asarray(u, dtype=float)
    s, c, none, one = np.sin(phi), np.cos(phi), np.zeros_like(phi), np.ones_like(phi)
    rows = [[phi, 1.0 + c, s, none, phi], [one, -s, c, none, one], [none, -c, -s, none, none]]
    return np.array([np.stack(row, axis=-1) for row in rows])


def compare_with_closed_form(run: Run) -> tuple[str, bool]:
    """Return the largest differences from the closed form, and whether all are within EXACT."""
    speed = np.pi / 180.0  # [rad/s]
    worst = [
        float(np.abs(ours - exact * speed**order).max())
        for order, (ours, exact) in enumerate(zip((run.q, run.qd, run.qdd), parallelogram(speed * run.t), strict=True))
    ]
    text = ", ".join(f"{name} {value:.1e}" for name, value in zip(("q", "qd", "qdd"), worst, strict=True))
    return text, max(worst) <= EXACT


def main() -> int:
    """Run the demonstration in the current folder; exit status 1 if a comparison fails."""
    mechanism = load("fourbar")
    print(check(mechanism))

    fmu = build(mechanism, Path("fmus/fourbar/fourbar.fmu"))
    run = simulate(fmu)
    bridged = listed_times(run, Status.BRIDGED)
    print(f"\nsimulated {fmu} with fmpy: t = {run.t[0]:g} ... {run.t[-1]:g} s, {len(run)} samples")
    print(f"interpolated across the singular points (status bridged) at t = {bridged} s")

    table, agrees = compare_with_report(run)
    print("\nour values compared with the table printed in R. A. Alzaga's report (1999), with its percent errors:")
    print("all 25 numbers agree within the four printed digits" if agrees else "DIFFERENT")
    print(table)
    difference, exact = compare_with_closed_form(run)
    print(f"\nlargest difference from the closed form: {difference} ({'within' if exact else 'MORE THAN'} {EXACT:g})")

    logs = Path("logs")
    write_mcap(run, logs / "fourbar.mcap")
    command = "kinfmu" if shutil.which("kinfmu") else quote(str(Path(sys.executable).with_name("kinfmu")))
    try:
        write_rrd(run, logs / "fourbar.rrd")
        print(
            "\nwrote logs/fourbar.mcap and logs/fourbar.rrd; to review them:\n"
            f"  {command} review logs/fourbar.mcap\n"
            f"  {command} review logs/fourbar.mcap --screenshot fourbar.png"
            "    # needs no screen; after scripts/graphics"
        )
    except MissingPackageError as missing:
        print(f"\nwrote logs/fourbar.mcap; no recording: {missing}")
    moving = logs / "fourbar.gif"
    try:
        animate(run, moving)
        print(f"\nthe moving linkage, which every browser opens: {moving.resolve().as_uri()}")
    except MissingPackageError as missing:
        print(f"\nno picture: {missing}")
    return 0 if agrees and exact and bool(run.good.all()) else 1


def listed_times(run: Run, status: Status) -> str:
    """Return the times of the samples with this status, such as '0, 1, 179, 180'."""
    return ", ".join(f"{t:g}" for t in run.t[run.status == status])


if __name__ == "__main__":
    sys.exit(main())
