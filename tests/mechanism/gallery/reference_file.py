"""fmus/<name>/reference.csv: the reference of a mechanism in numbers, as scripts/references writes it.

    time, then q, qd, qdd of every output of the mechanism, 20 digits; about 20 samples of the mechanism's run
    of a mechanism with masses then also efforts of the drivers, reactions of the joints, the kinetic energy, and
    the shaking force and moment

`python -m tests.mechanism.gallery.reference_file [name ...]` writes those of the mechanisms named, or of all.
"""

from __future__ import annotations

import csv
import io
import sys
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from tests.mechanism.gallery.forces import force_row
from tests.mechanism.gallery.references import REFERENCES
from tests.power_series import mp

FOLDER = Path(__file__).parents[3] / "fmus"
DIGITS = 20
NOTHING = mp.mpf(10) ** -40  # of 50 digits; what is smaller is a zero that was computed
INTERVALS = 20
RATES = {"x": ("x", "vx", "ax"), "y": ("y", "vy", "ay"), "phi": ("phi", "omega", "alpha")}


class Samples(NamedTuple):
    """The samples of a run that a reference holds: times t_k = start + k step for k = first, first + stride, ..."""

    times: list[float]
    step: float  # [s] from one to the next


def samples(name: str) -> Samples:
    """The samples of a mechanism's reference, evenly spread over its run."""
    run = tomllib.loads((FOLDER / name / "mechanism.toml").read_text(encoding="utf-8"))["run"]
    start, step, first = float(run["start"]), float(run["step"]), REFERENCES[name].first
    last = round((run["stop"] - start) / step) - first
    stride = (last - first) // INTERVALS
    return Samples([start + step * k for k in range(first, last + 1, stride)], stride * step)


def row(name: str, t: float) -> dict[str, str]:
    """One sample, by column."""
    motion = REFERENCES[name].motion(t)
    cells = {"time": repr(t)}
    for order in range(3):
        for coordinate, series in motion.items():
            owner, _, letter = coordinate.rpartition(".")
            cells[f"{owner}.{RATES[letter][order]}"] = _written(mp.factorial(order) * series.c[order])
    cells |= {column: _written(value) for column, value in force_row(name, t).items()}
    return cells


def text(name: str) -> str:
    """Return the text of the file."""
    rows = [row(name, t) for t in samples(name).times]
    page = io.StringIO()
    writer = csv.DictWriter(page, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return page.getvalue()


def path(name: str) -> Path:
    """Return the path of the file."""
    return FOLDER / name / "reference.csv"


def read(name: str) -> list[dict[str, str]]:
    """Return the rows of the file, by column."""
    with path(name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _written(value: Any) -> str:
    return "0.0" if abs(value) < NOTHING else str(mp.nstr(value, DIGITS))


def main(names: list[str]) -> None:
    for name in names or REFERENCES:
        path(name).write_text(text(name), encoding="utf-8", newline="\n")
        print(path(name).relative_to(FOLDER.parent))


if __name__ == "__main__":
    main(sys.argv[1:])
