"""Runs of designs of a study as a dataset of recordings, in which the viewer compares them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.design.study.definition import Study, own_cycles
from kinfmu.design.study.rows import StudyRows
from kinfmu.log.viewer.dataset import DesignRun, write_dataset
from kinfmu.run.model import compile  # noqa: A004  as re.compile

MOST_DESIGNS = 24  # of a dataset


def write_recordings(study: Study, result: StudyRows, folder: str | Path) -> list[Path]:
    """Write the runs of designs of a study as recordings of one layout, and return the files.

    Of more than MOST_DESIGNS designs, those are recorded that have the least and the greatest value of a measure, and
    evenly spaced ones.

    Args:
        study: The study.
        result: Its results.
        folder: The folder of the recordings.

    Raises:
        KinfmuError: A design cannot be solved, or a recording cannot be written.
        MissingPackageError: The viewer is not installed.

    """
    mechanism, motion = study.mechanism, study.motion
    model = compile(mechanism, parameters=[name for name in result.parameters if name in mechanism.parameters])
    designs = []
    shown = {column.name: column for column in result.shown_columns()}
    for row in chosen_rows(result):
        values = {name: float(result[name][row]) for name in result.parameters}
        driven: dict[str, Any] = dict(motion.inputs)
        if motion.at_own_speed:
            driven = own_cycles(mechanism, motion.inputs, {name: np.array([value]) for name, value in values.items()})
            values = {name: value for name, value in values.items() if name in mechanism.parameters}
        run = model.solve(motion.t, parameters=values, **driven)
        numbers = {
            f"{name} [{shown[name].unit}]" if shown[name].unit != "1" else name: float(shown[name].values[row])
            for name in (*result.parameters, *result.measures)
        }
        name = f"design {int(result['design'][row]):04}"
        info = {"title": f"{mechanism.title or mechanism.name}, {name}"}
        designs.append(DesignRun(name, replace(run, info=info), numbers))
    return write_dataset(designs, folder, f"study {mechanism.name}")


def chosen_rows(result: StudyRows) -> list[int]:
    """Return the rows of the designs to record, at most MOST_DESIGNS."""
    count = len(result)
    if count <= MOST_DESIGNS:
        return list(range(count))
    found: dict[int, None] = {}
    for name in result.measures:
        values = result[name]
        if np.isfinite(values).any():
            found |= {int(np.nanargmin(values)): None, int(np.nanargmax(values)): None}
    free = MOST_DESIGNS - len(found)
    spaced = np.linspace(0, count - 1, max(free, 0)).astype(int).tolist()
    return sorted(dict.fromkeys([*found, *spaced][:MOST_DESIGNS]))
