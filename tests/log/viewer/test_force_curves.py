"""Curves of reactions and arrows of forces in recordings, against the numbers of the run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import kinfmu
from kinfmu.draw.scene.scene import drawable
from kinfmu.log import write_rrd
from kinfmu.log.viewer.blueprint import Drawn, single
from kinfmu.log.viewer.linkage import view_box
from kinfmu.log.viewer.series import reactions
from kinfmu.log.viewer.timeline import timeline_of
from kinfmu.run import Run
from tests.log.viewer.test_rerun_file import SCALARS, rows, statics
from tests.run.test_forces import loaded


def test_a_recording_has_curves_of_reactions_with_names_and_arrows_with_a_scale(tmp_path: Path) -> None:
    run = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 1.0, 41))
    force, moment = reactions(run)
    joints = list(dict.fromkeys(name.owner for name in run.reaction_names if name.owner))
    assert (force.title, moment.title) == ("joint force [N]", "joint moment [N m]")
    assert list(force.names) == [*joints, "shaking"]
    path = tmp_path / "run.rrd"
    write_rrd(run, path)
    assert statics(path, "/reactions/force", "SeriesLines:names") == list(force.names)
    recorded = np.array([values for _, values in rows(path, "/reactions/force", SCALARS)])
    first = np.hypot(run[f"{joints[0]}.force_x"], run[f"{joints[0]}.force_y"])
    np.testing.assert_allclose(recorded[:, 0], first, rtol=1e-12)
    shaking = np.hypot(run["shaking_force_x"], run["shaking_force_y"])
    np.testing.assert_allclose(recorded[:, -1], shaking, rtol=1e-12)
    assert list(moment.names)[-1] == "shaking"
    (label,) = statics(path, "/linkage/forces/legend", "Arrows2D:labels")
    (along,) = statics(path, "/linkage/forces/legend", "Arrows2D:vectors")
    newton, unit = str(label).split()
    assert unit == "N"
    per_newton = np.hypot(*np.array(along, float)) / float(newton)  # the scale of all arrows
    pin = f"/linkage/forces/joints/{joints[0]}"
    assert statics(path, pin, "Arrows2D:labels") == [joints[0]]
    arrows = np.array([vectors[0] for _, vectors in rows(path, pin, "Arrows2D:vectors")], float)  # type: ignore[index]
    np.testing.assert_allclose(np.hypot(*arrows.T), first * per_newton, rtol=1e-5)


def test_undetermined_and_missing_reactions_have_no_curves(run: Run) -> None:
    assert reactions(run) == []  # without masses
    four = kinfmu.solve(loaded("fourbar"), np.linspace(0.0, 1.0, 11))
    named = {name for group in reactions(four) for name in group.names}
    assert named == {"shaking"}  # the redundant bar shares all loads
    crank = kinfmu.solve(loaded("slider_crank"), np.linspace(0.0, 1.0, 11))
    left_out = [name for name in crank.reaction_names if name.owner == crank.reaction_names[0].owner]
    kept = {name for group in reactions(crank.without(left_out)) for name in group.names}
    assert crank.reaction_names[0].owner not in kept


def views(part: Any) -> Iterator[Any]:
    """The views in a container of a layout."""
    for inner in getattr(part, "contents", ()) if hasattr(part, "grid_columns") else ():
        yield from views(inner)
    if not hasattr(part, "grid_columns"):
        yield part


def test_the_view_shows_all_arrows() -> None:
    run = kinfmu.solve(kinfmu.load("excavator_loaded"))
    shown, _ = drawable(run)
    assert shown is not None
    drawn = Drawn("linkage", "/linkage", run, shown)
    found = drawn.arrows
    assert found is not None
    layout = single(timeline_of([run]), run, [drawn], {}, [], [])
    (view,) = (view for view in views(layout.root_container) if view.name == "linkage")
    (bounds,) = view.properties["VisualBounds2D"].range.as_arrow_array().to_pylist()
    (x0, x1), (y0, y1) = bounds["x_range"], bounds["y_range"]
    assert x0 < view_box(shown)[0][0]  # of the linkage alone
    for name, along in found.along.items():
        x, y = (found.at[name] + along).T
        assert x0 < np.nanmin(x) <= np.nanmax(x) < x1, name
        assert y0 < np.nanmin(-y) <= np.nanmax(-y) < y1, name
