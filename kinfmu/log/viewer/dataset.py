"""A dataset of recordings: runs of designs in one layout, with equal scales, which the viewer lists in a table."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from kinfmu.errors import LogError
from kinfmu.log.cdr import check_times
from kinfmu.log.viewer.blueprint import Drawn, single
from kinfmu.log.viewer.linkage import APPLICATION
from kinfmu.log.viewer.package import require_viewer
from kinfmu.log.viewer.rerun_file import RecordedRun, content_of, recording
from kinfmu.log.viewer.series import Group
from kinfmu.log.viewer.timeline import Timeline, timeline_of
from kinfmu.run import Run

if TYPE_CHECKING:
    import rerun as rr


class DesignRun(NamedTuple):
    """The run of a design: its name, such as 'design 7', and its numbers by the titles of their columns."""

    name: str
    run: Run
    numbers: Mapping[str, float]


def write_dataset(designs: Sequence[DesignRun], folder: str | Path, name: str) -> list[Path]:
    """Write a recording for each design into a folder; opened together they are one dataset of the viewer.

    Args:
        designs: The runs, all over the same axis.
        folder: The folder; recordings of an earlier dataset in it are removed.
        name: Of the dataset.

    Returns:
        The files.

    Raises:
        LogError: The runs have no axis in common, or a file cannot be written.
        MissingPackageError: The viewer is not installed.

    """
    folder = Path(folder)
    require_viewer(f"{folder}: a dataset of recordings")
    for design in designs:
        check_times(design.run.t)
    timeline = timeline_of([design.run for design in designs])
    contents = _in_one_view([_content(design, timeline) for design in designs])
    first = contents[0]
    curves = {key: _merged([one.curves[key] for one in contents if key in one.curves]) for key in first.curves}
    forces, solver = (_each_merged([getattr(one, kind) for one in contents]) for kind in ("forces", "solver"))
    layout = single(timeline, first.shown, first.drawn, curves, forces, solver, is_dataset=True)
    paths = [folder / f"{re.sub(r'[^a-z0-9]+', '_', design.name.lower())}.rrd" for design in designs]
    try:
        for old in folder.glob("design_*.rrd"):
            old.unlink()
    except OSError as error:
        raise LogError(f"{folder}: cannot be written ({error.strerror or error})") from None
    dataset = f"{APPLICATION}_{re.sub('[^a-z0-9]+', '_', name.lower())}"
    for path, design, content in zip(paths, designs, contents, strict=True):
        with recording(path, design.name, layout, dataset, path.stem) as rec:
            rec.send_property("design", _columns(design.numbers))
            content.log(rec)
    return paths


def _columns(numbers: Mapping[str, float]) -> rr.AnyValues:
    """Return numbers, to 6 digits, as columns of the table of recordings."""
    import rerun as rr

    found = rr.AnyValues()
    for name, number in numbers.items():
        found.with_component_from_data(name, np.array([float(f"{number:.6g}")]))
    return found


def _each_merged(found: Sequence[Sequence[Group]]) -> list[Group]:
    """Return the groups of the first design, each with the values of all designs that have it."""
    return [_merged([group for groups in found for group in groups if group.path == first.path]) for first in found[0]]


def _content(design: DesignRun, timeline: Timeline) -> RecordedRun:
    """Return what the recording of a design holds, with its numbers on the card."""
    content = content_of(design.run, timeline)
    numbers = ", ".join(f"{name} = {number:.6g}" for name, number in design.numbers.items() if isfinite(number))
    return replace(content, note=f"{numbers}. {content.note}".strip())


def _in_one_view(contents: Sequence[RecordedRun]) -> list[RecordedRun]:
    """Return the contents with scenes of one bounding box, so that all designs are drawn to one scale."""
    scenes = [one.scene for content in contents for one in content.drawn if one.scene]
    if not scenes:
        return list(contents)
    low = np.min([scene.low for scene in scenes], axis=0)
    high = np.max([scene.high for scene in scenes], axis=0)

    def placed(one: Drawn) -> Drawn:
        return replace(one, scene=one.scene and replace(one.scene, low=low, high=high))

    return [replace(content, drawn=[*map(placed, content.drawn)]) for content in contents]


def _merged(found: Sequence[Group]) -> Group:
    """Return one group with the values of all designs, one below the other.

    Its range shows all designs, without those with gaps if others have none: at their ends rates grow without bound.
    """
    whole = [group for group in found if np.isfinite(group.values).all()]
    ranges = [group.extent for group in whole or found if group.extent]
    shown = (min(low for low, _ in ranges), max(high for _, high in ranges)) if ranges else None
    return replace(found[0], values=np.vstack([group.values for group in found]), shown=shown)
